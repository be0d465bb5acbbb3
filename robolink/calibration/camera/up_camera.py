"""Tool offset from one look of a calibrated, fixed, up-looking camera (EPSON's CalcTool).

The camera tells where the tip is in the base, the controller where the flange is:
``t = Rz(-U) (tip - flange)``. In this form there is no Atan2(0, 0) and no order of its
arguments to get wrong (docs/reference/calibration.md 1.2). A flange that leans or hangs upside
down takes the general form (docs/reference/evidence.md 3): with the tip's height seen as well it
is ``R' (tip - flange)``.
"""

from collections.abc import Sequence
from dataclasses import replace

from robolink.calibration.camera.camera_model import (
    CameraModel,
    Sighting,
    check_sightings,
    plane_gains,
)
from robolink.calibration.camera.camera_uncertainty import camera_sources
from robolink.calibration.core.dispersion import Dispersion, interval_of
from robolink.calibration.core.pose_checks import components, refuses_by_name
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.flange_plane import (
    TipHeight,
    height_of,
    known_z_mm,
    solvable_planes,
    with_height_error,
)
from robolink.calibration.quality.station import StationPart, with_station
from robolink.messages import tr
from robolink.model import ToolOffset


@refuses_by_name
def solve_up_camera(
    sighting: Sighting,
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    sigma_mm: float | None = None,
    camera: CameraModel | None = None,
) -> CalibrationResult:
    """Return the offset of a tip that a calibrated camera saw once.

    Args:
        sighting: The tip, and the flange pose at that moment. With its height Z is measured as
            well, and the flange may lean as it likes.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        height: Z of the tip, for a flange that leans; without it that of ``stored`` counts.
        sigma_mm: Standard deviation of one coordinate of one sighting, robot and camera
            together. Without it the result has no interval: one look leaves no residual.
        camera: The camera, whose place and scale are as uncertain as they say.

    An error of the camera's own calibration goes into the offset in full and shows in no
    residual. Several looks at different U tell it (:func:`solve_n_angle`).

    Raises:
        CalibrationError: ``non_finite``, ``suspect_units``, ``tool_pose``, ``local_pose``,
            ``tilted_pose`` or ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting, solve_up_camera
        >>> found = solve_up_camera(Sighting(Pose(300, 100, -60, 0), 312.3, 96.3))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.3, -3.7)
    """
    check_sightings((sighting,))
    if sighting.z_mm is not None:
        in_space, gains = _seen_in_space(sighting, sighting.z_mm, stored, sigma_mm)
        return _with_camera(in_space, sighting, camera, gains)
    height = height_of(stored, height)
    (plane,) = solvable_planes((sighting.flange,), height)
    x_mm, y_mm = sighting.in_flange_mm(known_z_mm(height))
    result = _one_look(sighting, {"x_mm": x_mm, "y_mm": y_mm}, stored, sigma_mm)
    result = with_height_error(result, plane.in_flange(0.0, 0.0, 1.0), height)
    return _with_camera(result, sighting, camera, plane_gains((plane,)))


def _with_camera(
    result: CalibrationResult,
    sighting: Sighting,
    camera: CameraModel | None,
    gains: Sequence[Sequence[float]],
) -> CalibrationResult:
    """Return a result with its camera's uncertainty, equal in every direction."""
    sources = camera_sources((sighting,), gains, camera=camera, finds_place=False)
    result = replace(result, sources=sources)
    if camera is None:
        return result
    variance = camera.sigma_at_mm(sighting.x_mm, sighting.y_mm) ** 2
    axes = range(len(result.measured))
    part = StationPart(
        tr("place and scale of the camera"),
        tuple(tuple(variance if i == j else 0.0 for j in axes) for i in axes),
        origin=tr("record of the station"),
    )
    return with_station(result, part)


def _seen_in_space(
    sighting: Sighting, z_mm: float, stored: ToolOffset | None, sigma_mm: float | None
) -> tuple[CalibrationResult, list[list[float]]]:
    """Return the result, and by how much it changes with X and Y of what was seen."""
    from robolink.calibration.core.rotations import rotation_of  # numpy, not needed for X and Y

    flange = sighting.flange
    away = (sighting.x_mm - flange.x_mm, sighting.y_mm - flange.y_mm, z_mm - flange.z_mm)
    turned = rotation_of(flange).T
    x_mm, y_mm, z_mm = (turned @ away).tolist()
    found = {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm}
    return _one_look(sighting, found, stored, sigma_mm), turned[:, :2].tolist()


def _one_look(
    sighting: Sighting,
    found: dict[str, float],
    stored: ToolOffset | None,
    sigma_mm: float | None,
) -> CalibrationResult:
    scatter, axes = Dispersion.of(0.0, 0, sigma_mm), len(found)
    # A rotation leaves errors unchanged that are equal in all directions.
    variance = scatter.sigma_mm**2 if scatter else 0.0
    place = (sighting.x_mm, sighting.y_mm, sighting.z_mm)
    return CalibrationResult(
        method="camera",
        **components(stored, **found),
        reference_point_mm=tuple(value for value in place if value is not None),
        sigma_gain=1.0,
        warnings=(),
        inputs=(sighting.flange,),
        **interval_of(scatter, (variance,) * axes, axes),
        sigma_mm=sigma_mm,
        sigma_stated=scatter is not None,
        interval_from=scatter.source if scatter else "",
        rank=axes,
        dof=0,
    )
