"""A camera of unknown pose and a tip, found together."""

from collections.abc import Sequence

from robolink.calibration import (
    MIN_ROTATION_DEG,
    CameraCalibration,
    PixelSighting,
    angle_spread_deg,
    height_of,
    solvable_planes,
    solve_camera_affine,
    toward_zero,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.camera_affine.parameters import LEAST_SPAN_MM, CameraAffineParameters
from robolink.model import Pose, ToolOffset
from robolink.procedures import NO_OFFSET, CameraDrive, CameraSamples, Place
from robolink.runner import Procedure, SeenAt
from robolink.stations import CameraStation


def measure_camera_affine(
    station: CameraStation,
    plan: CameraAffineParameters,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
) -> Procedure[CameraCalibration]:
    """Measure X and Y of a tip, and the camera with it. Runs in Tool 0.

    The tip goes to four corners about the middle of the image, which tells what a pixel is,
    and turns in the middle, which tells the offset.

    Args:
        station: Where the camera is, to within its field of view; with its model of before,
            against which a changed camera is refused.
        plan: The pattern, and whether the look that fits worst is offered again.
        here: Where the flange is; its U is that of the corners.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.

    Raises:
        CalibrationError: ``rank_deficient`` and ``insufficient_rotation`` before anything moves
            when the pattern cannot tell, and ``tilted_pose``; ``tip_not_seen``,
            ``several_tips_seen``, ``tip_did_not_move``, ``spot_changed``, ``camera_changed``, and
            the others of :func:`solve_camera_affine`.

    Example:
        >>> from robolink.methods import CameraAffineParameters, measure_camera_affine
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> camera, here = CameraStation(x_mm=300, y_mm=80, z_mm=-30), Pose(300, 100, 20, 0)
        >>> plan, stored = CameraAffineParameters(), ToolOffset(12, -3.5, -20)
        >>> course = measure_camera_affine(camera, plan, here=here, stored=stored)
        >>> found = PaperCell(here, ToolOffset(12.2, -3.6, -20), mm_per_px=0.02).run(course)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.2, -3.6)
    """
    _require_pattern(plan)
    solvable_planes([here], height_of(stored))
    tip = stored or NO_OFFSET
    drive = CameraDrive(station, plan.look, here, calibrated=False)
    drive.watch.longest_mm_per_px = plan.pixel_limit_mm
    places = [
        Place(toward_zero(here.u_deg, turn), tip, aside_mm=(dx, dy)) for dx, dy, turn in plan.places
    ]

    def solve(looks: Sequence[SeenAt]) -> CameraCalibration:
        sightings = [PixelSighting(look, look.spot.x, look.spot.y) for look in looks]
        found = solve_camera_affine(
            sightings,
            stored=stored,
            sigma_mm=sigma_mm,
            before=station.model,
            limits=plan.limits,
        )
        drive.watch.require_followed(found.camera.mm_per_px)
        return found

    return (yield from CameraSamples(drive, solve, here).at(places, retake=plan.retake))


def _require_pattern(plan: CameraAffineParameters) -> None:
    """Refuse a pattern that cannot tell camera and offset apart, before anything moves."""
    if plan.span_mm < LEAST_SPAN_MM:
        raise CalibrationError(
            "rank_deficient",
            tr("A pattern of {span:g} mm is too small to tell what a pixel is.", span=plan.span_mm),
            remedy=tr("Let the tip go {least:g} mm or more to each side.", least=LEAST_SPAN_MM),
        )
    spread_deg = angle_spread_deg([0.0, *plan.look.turns_deg])
    if spread_deg < MIN_ROTATION_DEG:
        raise CalibrationError(
            "insufficient_rotation",
            tr("The pattern turns the tool by {spread:.1f} degrees only.", spread=spread_deg),
            remedy=tr("Turn it by {minimum:.0f} degrees or more.", minimum=MIN_ROTATION_DEG),
        )
