"""Tool offset from several looks of a calibrated camera, with the tool turned in between.

What the camera is off by is the same in all looks, while the offset turns with the tool: so
both are told apart. With the tip seen at s, flange p and R = Rz(U), ``p - s + R t`` is one
point, and the least squares are those of a pin touched at several angles
(docs/reference/calibration.md 2.1).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from robolink.calibration.camera.up_camera import Sighting, check_sightings, solve_up_camera
from robolink.calibration.core.planar_checks import require_poses
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.pin.n_angle import solve_n_angle
from robolink.calibration.quality.tolerances import PLANAR_TOLERANCE, Tolerance
from robolink.model import ToolOffset

CAMERA_MOVED_MM = 0.1
"""A camera that is off by more than this since its own calibration is doubted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraRound(CalibrationResult):
    """A tool offset seen by a camera.

    Attributes:
        camera_error_mm: By how much the camera sees things beside where they are, base X and Y;
            ``None`` after a single look, which cannot tell.
    """

    camera_error_mm: tuple[float, float] | None = None

    def details(self) -> dict[str, object]:
        """Return what the camera is off by."""
        error_mm = self.camera_error_mm
        return {"camera_error_mm": None if error_mm is None else list(error_mm)}


def solve_camera_round(
    sightings: Sequence[Sighting],
    *,
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> CameraRound:
    """Return the offset of a tip that a calibrated camera saw at one or several angles.

    Args:
        sightings: The tip, with the flange pose (Tool 0) of each look. A single one relies on
            the camera being where its calibration put it.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: As :func:`solve_up_camera`, and for several looks as
            :func:`solve_n_angle`.
        ConfigError: ``sigma_mm`` is not positive.
    """
    require_poses(len(sightings), 1)
    check_sightings(tuple(sightings))
    inputs = tuple(sighting.flange for sighting in sightings)
    if len(sightings) == 1:
        return as_round(solve_up_camera(sightings[0], stored=stored, sigma_mm=sigma_mm))
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
    result = replace(result, method="camera", inputs=inputs)
    return as_round(result, camera_error_mm=error_mm)


def as_round(
    result: CalibrationResult, *, camera_error_mm: tuple[float, float] | None = None
) -> CameraRound:
    """Return a result with what the camera is off by, doubted when that is much."""
    values = {field.name: getattr(result, field.name) for field in fields(CalibrationResult)}
    if camera_error_mm is not None and max(map(abs, camera_error_mm)) > CAMERA_MOVED_MM:
        values["warnings"] = (*result.warnings, "camera_moved")
    return CameraRound(**values, camera_error_mm=camera_error_mm)
