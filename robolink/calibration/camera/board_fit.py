"""A board with several fiducials: its drawing fitted by turning and moving, not stretching.

With d the drawing and f what was seen, both as x + iy and with their means taken off, the
turn of the least squares is the direction of sum(conj(d) f).

A held board seen at several angles: what the camera itself is off by is found with it.

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

from robolink.calibration.camera.board import SPACING_TOLERANCE, check_spacing, mean_by_height
from robolink.calibration.camera.camera_model import (
    CameraModel,
    Sighting,
    check_sightings,
    seen_in_flange,
)
from robolink.calibration.camera.camera_round import CameraRound, as_round
from robolink.calibration.camera.camera_uncertainty import (
    camera_part,
    camera_sources,
    print_source,
)
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    angle_spread_deg,
    components,
    keep_unmeasured,
    refuses_by_name,
    require_finite,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.flange_plane import (
    FlangePlane,
    TipHeight,
    height_of,
    known_z_mm,
    with_height_error,
)
from robolink.calibration.pin.n_angle import Complexes
from robolink.calibration.quality.doubts import PLANAR_TOLERANCE, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.station import with_station
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset

UNKNOWNS = 3


@refuses_by_name
def solve_board_fit(
    sightings: Sequence[Sighting],
    drawing_mm: Sequence[tuple[float, float]],
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    sigma_mm: float | None = None,
    camera: CameraModel | None = None,
    allow_mixed_hand: bool = False,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> CalibrationResult:
    """Return the tool whose axes are those of the drawing of a held board.

    Args:
        sightings: Fiducials as they were seen, with the flange pose of each picture.
        drawing_mm: Where the same fiducials are in the drawing, in the same order.
        stored: The offset stored now; Z, V and W are kept from it, or 0 without one.
        height: Z of the board, for a flange that leans; without it that of ``stored`` counts.
        sigma_mm: Standard deviation of one coordinate of one sighting, when it is known.
        camera: The camera, whose place and scale are as uncertain as they say.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``coincident_fiducials``, ``spacing_mismatch``,
            ``tool_pose``, ``local_pose``, ``tilted_pose``, and those of
            ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.
        ValueError: The lists differ in length.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting, solve_board_fit
        >>> drawing_mm = [(0, 0), (40, 0), (0, 30)]
        >>> flange = Pose(300, 100, -60, 0)
        >>> seen = [Sighting(flange, 312 + x_mm, 96.5 + y_mm) for x_mm, y_mm in drawing_mm]
        >>> found = solve_board_fit(seen, drawing_mm)
        >>> offset = found.offset
        >>> [round(value, 3) + 0.0 for value in (offset.x_mm, offset.y_mm, offset.u_deg)]
        [12.0, -3.5, 0.0]
    """
    if len(sightings) != len(drawing_mm):
        raise ValueError(f"{len(sightings)} sightings for {len(drawing_mm)} places in the drawing")
    require_poses(len(sightings), 2)
    for number, (x, y) in enumerate(drawing_mm, start=1):
        require_finite(**{f"x of drawing {number}": x, f"y of drawing {number}": y})
    warnings = check_sightings(tuple(sightings), allow_mixed_hand=allow_mixed_hand)
    height = height_of(stored, height)
    seen = np.array([complex(*place) for place in seen_in_flange(sightings, height)])
    drawing = np.array([complex(*place) for place in drawing_mm])
    _require_as_drawn(seen, drawing)
    origin, turn = _placed(seen, drawing)
    residuals = seen - origin - turn * drawing
    unit = _unit_covariance(turn, drawing)
    gains = _gains(unit, turn * drawing, sightings)
    result = CalibrationResult(
        method="board",
        **components(
            stored,
            x_mm=origin.real,
            y_mm=origin.imag,
            u_deg=math.degrees(math.atan2(turn.imag, turn.real)),
        ),
        reference_point_mm=(),
        sigma_gain=float(np.sqrt(max(unit[0, 0], unit[1, 1]))),
        warnings=warnings,
        inputs=tuple(sighting.flange for sighting in sightings),
        residuals_mm=_in_base(residuals, sightings),
        rank=UNKNOWNS,
        sources=(
            *camera_sources(sightings, gains, camera=camera, finds_place=False),
            print_source(sightings, gains, drawing_mm),
        ),
        marks_mm=tuple(dict.fromkeys((x, y) for x, y in drawing_mm)),
    )
    result = judged(
        result,
        residuals.view(float).reshape(-1, 2),
        unit,
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )
    result = with_height_error(result, mean_by_height(sightings), height)
    if camera is None:
        return result

    def found(others: Sequence[Sighting]) -> tuple[float, float, float]:
        at = np.array([complex(*place) for place in seen_in_flange(others, height)])
        moved, turned = _placed(at, drawing)
        return moved.real, moved.imag, math.degrees(math.atan2(turned.imag, turned.real))

    return with_station(result, camera_part(camera, sightings, found, angles=(2,)))


def _placed(seen: Complexes, drawing: Complexes) -> tuple[complex, complex]:
    """Return the origin and the direction of a drawing, in the flange's axes."""
    overlap = complex(np.vdot(drawing - drawing.mean(), seen - seen.mean()))
    turn = overlap / abs(overlap)
    return complex(seen.mean() - turn * drawing.mean()), turn


def _require_as_drawn(seen: Complexes, drawing: Complexes) -> None:
    centred_f, centred_d = seen - seen.mean(), drawing - drawing.mean()
    size = float((np.abs(centred_d) ** 2).sum())
    # With two fiducials, twice the rms distance from their middle equals their spacing.
    spread_mm = 2 * math.sqrt(float((np.abs(centred_f) ** 2).sum()) / len(seen))
    check_spacing(min(spread_mm, 2 * math.sqrt(size / len(seen))), None)
    scale = float(abs(np.vdot(centred_d, centred_f))) / size
    if abs(scale - 1) > SPACING_TOLERANCE:
        raise CalibrationError(
            "spacing_mismatch",
            tr("The fiducials are {scale:.4f} times as far apart as in the drawing.", scale=scale),
            remedy=tr("Check the marks that the camera found, their order, and its scale."),
        )


def _unit_covariance(turn: complex, drawing: Complexes) -> Floats:
    """Return the covariance of x, y in mm^2 and u in deg^2 for sigma = 1 mm."""
    centred = drawing - drawing.mean()
    angle = 1 / float((np.abs(centred) ** 2).sum())
    # The mean fixes only the middle of the fiducials; an angle error swings the origin about it.
    lever = -1j * turn * complex(drawing.mean())
    column = np.array([lever.real, lever.imag, math.degrees(1.0)])
    unit: Floats = np.outer(column, column) * angle + np.diag([1, 1, 0]) / len(drawing)
    return unit


def _gains(unit: Floats, turned: Complexes, sightings: Sequence[Sighting]) -> list[list[float]]:
    """Return by how much origin and direction change with each sighting, base X and Y."""
    degree = math.radians(1.0)
    design = np.zeros((len(turned), 2, UNKNOWNS))
    design[:, 0, 0] = design[:, 1, 1] = 1.0
    design[:, 0, 2], design[:, 1, 2] = -degree * turned.imag, degree * turned.real
    return gains_in_base(np.einsum("kl,ijl->kij", unit, design), sightings)


def gains_in_base(gains: Floats, sightings: Sequence[Sighting]) -> list[list[float]]:
    """Return gains for shifts in the base from those for shifts in the flange's axes.

    Args:
        gains: A line for each component, a row for each sighting, X and Y.
        sightings: With the flange pose of each.

    Example:
        >>> import numpy as np
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting
        >>> from robolink.calibration.camera.board_fit import gains_in_base
        >>> turned = Sighting(Pose(300, 100, -60, 90), 300, 100)
        >>> gains = gains_in_base(np.eye(2)[:, None], [turned])
        >>> [[round(g, 6) + 0.0 for g in line] for line in gains]
        [[0.0, 1.0], [-1.0, 0.0]]
    """
    columns = np.array([FlangePlane.of(sighting.flange).columns for sighting in sightings])
    inverse = np.linalg.inv(columns.transpose(0, 2, 1))
    in_base = np.einsum("kij,ijl->kil", gains, inverse)
    found: list[list[float]] = in_base.reshape(len(gains), -1).tolist()
    return found


def _in_base(
    residuals: Complexes, sightings: Sequence[Sighting]
) -> tuple[tuple[float, float], ...]:
    return tuple(
        FlangePlane.of(sighting.flange).in_base(residual.real, residual.imag)
        for residual, sighting in zip(residuals.tolist(), sightings, strict=True)
    )


ROUND_UNKNOWNS = 5


@refuses_by_name
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
    # A row of residuals times A transposed is converted from flange axes to base axes.
    vectors = (fit.residuals.reshape(2, -1).T[:, None, :] @ columns)[:, 0, :]
    in_degrees = np.diag((1.0, 1.0, math.degrees(1.0)))
    unit = in_degrees @ fit.unit_covariance[:3, :3] @ in_degrees
    u_deg = math.degrees(math.remainder(turn_rad, math.tau))
    # The rows are X of all sightings, then Y of all sightings.
    by_row = (in_degrees @ fit.gains(design)[:3]).reshape(3, 2, -1).transpose(0, 2, 1)
    gains = gains_in_base(by_row, sightings)
    # These values replace those of the plain fit.
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
    result = judged(
        fresh, vectors, unit, unknowns=ROUND_UNKNOWNS, sigma_mm=sigma_mm, tolerance=tolerance
    )
    result = with_height_error(result, planes[0].in_flange(0.0, 0.0, 1.0), height)
    if camera is not None:

        def placed(others: Sequence[Sighting]) -> tuple[float, float, float]:
            moved, _, turned_rad = found(others)
            return float(moved.x[0]), float(moved.x[1]), math.degrees(turned_rad)

        result = with_station(result, camera_part(camera, sightings, placed, angles=(2,)))
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
