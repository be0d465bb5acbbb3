"""A held board seen at several angles: what the camera itself is off by is found with it.

A fiducial at d in the drawing is seen from the flange at ``conj(z) (s - p) = o + turn d +
conj(z) b``, with z = exp(iU), the board's origin o and direction turn, and the camera's error b.
All but the direction is linear, and that is known well enough after the plain fit for one step.
Under a flange that leans or hangs upside down the inverse of its A stands in place of conj(z)
(docs/reference/evidence.md 3).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robolink.calibration.camera.board_fit import gains_in_base, solve_board_fit
from robolink.calibration.camera.camera_model import CameraModel
from robolink.calibration.camera.camera_round import CameraRound, as_round
from robolink.calibration.camera.camera_uncertainty import (
    camera_part,
    camera_sources,
    print_source,
)
from robolink.calibration.camera.sighting import Sighting
from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    angle_spread_deg,
    keep_unmeasured,
)
from robolink.calibration.core.robust import Floats
from robolink.calibration.flange_checks import with_height_error
from robolink.calibration.flange_plane import FlangePlane, TipHeight, height_of, known_z_mm
from robolink.calibration.pin.planar import Complexes
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.station_part import with_station
from robolink.calibration.quality.tolerances import PLANAR_TOLERANCE, Tolerance
from robolink.model import ToolOffset

UNKNOWNS = 5


def solve_board_round(
    sightings: Sequence[Sighting],
    drawing_mm: Sequence[tuple[float, float]],
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    sigma_mm: float | None = None,
    camera: CameraModel | None = None,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> CameraRound:
    """Return the tool whose axes are those of the drawing of a held board, and the camera's error.

    Args:
        sightings: Fiducials as they were seen, with the flange pose of each look. Over less than
            30 degrees of U the camera's error cannot be told and is taken for none.
        drawing_mm: Where the same fiducials are in the drawing, in the same order.
        stored: The offset stored now; Z, V and W are kept from it, or 0 without one.
        height: Z of the board, for a flange that leans; without it that of ``stored`` counts.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        camera: The camera, whose place and scale are as uncertain as they say; the round finds what
            its place is off by.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: As :func:`solve_board_fit`.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting, solve_board_round
        >>> from robolink.model import rotate_xy
        >>> drawing_mm, looks, drawn = [(0, 0), (40, 0), (0, 30)], [], []
        >>> for u_deg in (0, 90, 180):
        ...     for x_mm, y_mm in drawing_mm:
        ...         dx_mm, dy_mm = rotate_xy(12 + x_mm, -3.5 + y_mm, u_deg)
        ...         looks.append(Sighting(Pose(300, 100, -60, u_deg), 300 + dx_mm, 100 + dy_mm))
        ...         drawn.append((x_mm, y_mm))
        >>> found = solve_board_round(looks, drawn)
        >>> offset = found.offset
        >>> [round(value, 3) + 0.0 for value in (offset.x_mm, offset.y_mm, offset.u_deg)]
        [12.0, -3.5, 0.0]
    """
    height = height_of(stored, height)
    planes = [FlangePlane.of(sighting.flange) for sighting in sightings]
    spread_deg = angle_spread_deg([plane.heading_deg for plane in planes])
    plain = solve_board_fit(
        sightings,
        drawing_mm,
        stored=stored,
        height=height,
        sigma_mm=sigma_mm,
        camera=camera if spread_deg < MIN_ROTATION_DEG else None,
        tolerance=tolerance,
    )
    if spread_deg < MIN_ROTATION_DEG:
        return as_round(plain)
    z_mm, columns = known_z_mm(height), np.array([plane.columns for plane in planes])
    drawn = np.array([complex(*place) for place in drawing_mm])

    def found(others: Sequence[Sighting]) -> tuple[LinearFit, Floats, float]:
        seen = np.array([complex(*sighting.in_flange_mm(z_mm)) for sighting in others])
        return _turned_fit(seen, columns, drawn, math.radians(plain.offset.u_deg))

    fit, design, turn_rad = found(sightings)
    x_mm, y_mm, _, error_x, error_y = fit.x.tolist()
    # A row of residuals times the transposed A leads from the flange's axes to the base's.
    vectors = (fit.residuals.reshape(2, -1).T[:, None, :] @ columns)[:, 0, :]
    in_degrees = np.diag((1.0, 1.0, math.degrees(1.0)))
    unit = in_degrees @ fit.unit_covariance[:3, :3] @ in_degrees
    u_deg = math.degrees(math.remainder(turn_rad, math.tau))
    # Rows are X of all sightings, then Y.
    by_row = (in_degrees @ fit.gains(design)[:3]).reshape(3, 2, -1).transpose(0, 2, 1)
    gains = gains_in_base(by_row, sightings)
    # What the plain fit said about itself is said anew.
    fresh = replace(
        plain,
        offset=keep_unmeasured(stored, x_mm=x_mm, y_mm=y_mm, u_deg=u_deg),
        residuals_mm=tuple(map(tuple, vectors.tolist())),
        sigma_gain=math.sqrt(float(unit.diagonal()[:2].max())),
        condition_number=fit.condition_number,
        rank=fit.rank,
        warnings=(),
        sources=(
            *camera_sources(sightings, gains, camera=camera, finds_place=True),
            print_source(sightings, gains, drawing_mm),
        ),
    )
    result = judged(fresh, vectors, unit, unknowns=UNKNOWNS, sigma_mm=sigma_mm, tolerance=tolerance)
    result = with_height_error(result, planes[0].in_flange(0.0, 0.0, 1.0), height)
    if camera is not None:

        def components(others: Sequence[Sighting]) -> tuple[float, float, float]:
            moved, _, turned_rad = found(others)
            return float(moved.x[0]), float(moved.x[1]), math.degrees(turned_rad)

        result = with_station(result, camera_part(camera, sightings, components, angles=(2,)))
    return as_round(result, camera_error_mm=(error_x, error_y))


def _turned_fit(
    seen: Complexes, columns: Floats, drawn: Complexes, turn_rad: float
) -> tuple[LinearFit, Floats, float]:
    """Return the last step's fit, its design and the direction, from one that is nearly right."""
    for _ in range(2):
        fit, design = _step(seen, columns, drawn * np.exp(1j * turn_rad))
        turn_rad += float(fit.x[2])
    return fit, design, turn_rad


def _step(seen: Complexes, columns: Floats, turned: Complexes) -> tuple[LinearFit, Floats]:
    """Return the fit of origin, small turn in radians, and camera error, and its design."""
    ones, zeros = np.ones(len(seen)), np.zeros(len(seen))
    inverse = np.linalg.inv(columns.transpose(0, 2, 1))
    a = np.vstack(
        (
            np.column_stack((ones, zeros, -turned.imag, inverse[:, 0])),
            np.column_stack((zeros, ones, turned.real, inverse[:, 1])),
        )
    )
    missing = seen - turned
    return linear_fit(a, np.concatenate((missing.real, missing.imag))), a
