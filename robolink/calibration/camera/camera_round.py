"""Tool offset from several looks of a calibrated camera, with the tool turned in between.

What the camera is off by is the same in all looks, while the offset turns with the tool: so
both are told apart. With the tip seen at s, flange p and R = Rz(U), ``p - s + R t`` is one
point, and the least squares are those of a pin touched at several angles
(docs/reference/calibration.md 2.1). Under a flange that leans or hangs upside down each look
says ``s - p - c t_z = A t + e`` with the camera's error e (docs/reference/evidence.md 3).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from robolink.calibration.camera.camera_model import CameraModel, Sighting, check_sightings
from robolink.calibration.camera.camera_uncertainty import camera_sources
from robolink.calibration.camera.up_camera import solve_up_camera
from robolink.calibration.core.least_squares import linear_fit
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    check_planar,
    components,
    refuses_by_name,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.flange_plane import (
    FlangePlane,
    TipHeight,
    height_of,
    known_z_mm,
    solvable_planes,
    with_height_error,
)
from robolink.calibration.pin.n_angle import solve_n_angle
from robolink.calibration.quality.doubts import PLANAR_TOLERANCE, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.model import Pose, ToolOffset

CAMERA_MOVED_MM = 0.1
"""Error of a camera since its calibration, in mm, above which the camera is doubted."""

_UNKNOWNS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraRound(CalibrationResult):
    """A tool offset measured by a camera.

    Attributes:
        camera_error_mm: By how much the camera sees things beside where they are, base X and Y;
            ``None`` after a single look, which cannot tell.
    """

    camera_error_mm: tuple[float, float] | None = None

    def details(self) -> dict[str, object]:
        """Return the camera's error."""
        error_mm = self.camera_error_mm
        return {"camera_error_mm": None if error_mm is None else list(error_mm)}


@refuses_by_name
def solve_camera_round(
    sightings: Sequence[Sighting],
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    sigma_mm: float | None = None,
    camera: CameraModel | None = None,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> CameraRound:
    """Return the offset of a tip that a calibrated camera saw at one or several angles.

    Args:
        sightings: The tip, with the flange pose (Tool 0) of each look. A single one relies on
            the camera being where its calibration put it.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        height: Z of the tip, for a flange that leans; without it that of ``stored`` counts.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        camera: The camera; how sure its record is of its place counts for a single look. Several
            looks find what it is off by.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: As :func:`solve_up_camera`, and for several looks as
            :func:`solve_n_angle`.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting, solve_camera_round
        >>> from robolink.model import rotate_xy
        >>> looks = []
        >>> for u_deg in (0, 90, 180, -90):  # the camera says 0.2 mm too much in X
        ...     dx_mm, dy_mm = rotate_xy(12.3, -3.7, u_deg)
        ...     looks.append(Sighting(Pose(300, 100, -60, u_deg), 300.2 + dx_mm, 100 + dy_mm))
        >>> found = solve_camera_round(looks)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.3, -3.7)
        >>> [round(part, 3) + 0.0 for part in found.camera_error_mm]
        [0.2, 0.0]
    """
    require_poses(len(sightings), 1)
    check_sightings(tuple(sightings))
    inputs = tuple(sighting.flange for sighting in sightings)
    if len(sightings) == 1:
        found = solve_up_camera(
            sightings[0], stored=stored, height=height, sigma_mm=sigma_mm, camera=camera
        )
        return as_round(found)
    if any((s.flange.v_deg, s.flange.w_deg) != (0.0, 0.0) for s in sightings):
        known = height_of(stored, height)
        return _leaning(sightings, stored, known, sigma_mm, tolerance, camera)
    mean_x = sum(sighting.x_mm for sighting in sightings) / len(sightings)
    mean_y = sum(sighting.y_mm for sighting in sightings) / len(sightings)
    on_one_point = [
        replace(
            sighting.flange,
            x_mm=sighting.flange.x_mm - sighting.x_mm + mean_x,
            y_mm=sighting.flange.y_mm - sighting.y_mm + mean_y,
        )
        for sighting in sightings
    ]
    result = solve_n_angle(on_one_point, stored=stored, sigma_mm=sigma_mm, tolerance=tolerance)
    x_mm, y_mm = result.reference_point_mm
    error_mm = (mean_x - x_mm, mean_y - y_mm)
    sources = camera_sources(sightings, _upright_gains(inputs), camera=camera, finds_place=True)
    result = replace(result, method="camera", inputs=inputs, sources=sources)
    return as_round(result, camera_error_mm=error_mm)


def _upright_gains(flanges: Sequence[Pose]) -> list[list[float]]:
    """Return by how much the offset of upright flanges changes with each sighting.

    With z = exp(iU) that is conj(z - mean z) / sum |z - mean z|^2 (docs/reference/calibration.md
    1.1).
    """
    z = np.exp(1j * np.radians([flange.u_deg for flange in flanges]))
    turned = z - z.mean()
    by = turned.conj() / float(np.vdot(turned, turned).real)
    # The real and imaginary parts of a complex product.
    x = np.column_stack((by.real, -by.imag)).ravel()
    y = np.column_stack((by.imag, by.real)).ravel()
    return [x.tolist(), y.tolist()]


def _leaning(
    sightings: Sequence[Sighting],
    stored: ToolOffset | None,
    height: TipHeight | None,
    sigma_mm: float | None,
    tolerance: Tolerance,
    camera: CameraModel | None,
) -> CameraRound:
    """Solve for t and the camera's error with the flange as it hangs.

    Raises:
        CalibrationError: ``tilted_pose``, and those of :func:`check_planar`.
    """
    flanges = tuple(sighting.flange for sighting in sightings)
    planes = solvable_planes(flanges, height)
    turned = [
        replace(flange, u_deg=plane.heading_deg, v_deg=0.0, w_deg=0.0)
        for flange, plane in zip(flanges, planes, strict=True)
    ]
    warnings = check_planar(
        turned, minimum=2, min_rotation_deg=MIN_ROTATION_DEG, allow_mixed_hand=False
    )
    a = np.zeros((len(planes), 2, _UNKNOWNS))
    a[:, :, :2] = np.array([plane.columns for plane in planes]).transpose(0, 2, 1)
    a[:, 0, 2] = a[:, 1, 3] = 1.0
    seen = np.array([(s.x_mm - s.flange.x_mm, s.y_mm - s.flange.y_mm) for s in sightings])
    lean = np.array([plane.axis for plane in planes]) * known_z_mm(height)
    design = a.reshape(-1, _UNKNOWNS)
    fit = linear_fit(design, (seen - lean).ravel())
    x_mm, y_mm, error_x, error_y = fit.x.tolist()
    residuals = fit.residuals.reshape(-1, 2)
    mean = np.mean([(s.x_mm, s.y_mm) for s in sightings], axis=0).tolist()
    result = CalibrationResult(
        method="camera",
        **components(stored, x_mm=x_mm, y_mm=y_mm),
        reference_point_mm=(mean[0] - error_x, mean[1] - error_y),
        sigma_gain=math.sqrt(float(fit.unit_covariance.diagonal()[:2].max())),
        warnings=warnings,
        inputs=flanges,
        residuals_mm=tuple(map(tuple, residuals.tolist())),
        condition_number=fit.condition_number,
        rank=fit.rank,
        sources=camera_sources(
            sightings, fit.gains(design)[:2].tolist(), camera=camera, finds_place=True
        ),
    )
    unit = fit.unit_covariance[:2, :2]
    result = judged(
        result, residuals, unit, unknowns=_UNKNOWNS, sigma_mm=sigma_mm, tolerance=tolerance
    )
    by_height = FlangePlane.of(flanges[0]).in_flange(0.0, 0.0, 1.0)
    found = with_height_error(result, by_height, height)
    return as_round(found, camera_error_mm=(error_x, error_y))


def as_round(
    result: CalibrationResult, *, camera_error_mm: tuple[float, float] | None = None
) -> CameraRound:
    """Return a result with the camera's error, and a doubt if that is large."""
    values = {field.name: getattr(result, field.name) for field in fields(CalibrationResult)}
    if camera_error_mm is not None and max(map(abs, camera_error_mm)) > CAMERA_MOVED_MM:
        values["warnings"] = (*result.warnings, "camera_moved")
    return CameraRound(**values, camera_error_mm=camera_error_mm)
