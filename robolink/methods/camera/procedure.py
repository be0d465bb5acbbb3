"""A tip seen by an up-looking camera at several angles of U."""

from collections.abc import Callable, Sequence
from typing import TypeVar

from robolink.calibration import (
    CalibrationResult,
    CameraRound,
    Sighting,
    height_of,
    solvable_planes,
    solve_camera_round,
    solve_up_camera,
)
from robolink.model import Pose, ToolOffset
from robolink.procedures import NO_OFFSET, CameraDrive, CameraSamples, LookPlan, Place
from robolink.runner import Procedure, SeenAt
from robolink.stations import CameraStation

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def measure_camera(
    station: CameraStation,
    plan: LookPlan,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> Procedure[CameraRound]:
    """Measure X and Y of a tip with a calibrated camera. Runs in Tool 0.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles it is looked at.
        here: Where the flange is; its U is where the angles count from.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: ``tilted_pose`` before anything moves; ``tip_not_seen``,
            ``several_tips_seen``, ``camera_not_calibrated``, and those of
            :func:`solve_camera_round`.

    Example:
        >>> from robolink.methods import measure_camera
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> camera, here = CameraStation(x_mm=300, y_mm=80, z_mm=-30), Pose(300, 100, 20, 0)
        >>> course = measure_camera(camera, LookPlan(), here=here, stored=ToolOffset(12, -3.5, -20))
        >>> found = PaperCell(here, ToolOffset(12.4, -3.8, -20)).run(course)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.4, -3.8)
    """

    def solve(sightings: Sequence[Sighting]) -> CameraRound:
        return solve_camera_round(sightings, stored=stored, sigma_mm=sigma_mm, camera=station.model)

    return (yield from look_round(station, plan, solve, here=here, stored=stored, retake=retake))


def look_round(
    station: CameraStation,
    plan: LookPlan,
    solver: Callable[[Sequence[Sighting]], ResultT],
    *,
    here: Pose,
    stored: ToolOffset | None,
    retake: bool,
) -> Procedure[ResultT]:
    """Bring a tip before a calibrated camera at every angle of a plan, and solve what is seen.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles it is looked at.
        solver: Makes the result of what was seen.
        here: Where the flange is; its U is where the angles count from.
        stored: The offset stored now; the tip is expected there.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: ``tilted_pose`` before anything moves; ``tip_not_seen``,
            ``several_tips_seen``, ``camera_not_calibrated``, and those of the solver.
        LimitError: The arm cannot bring the tip before the camera so; nothing was moved.
    """
    solvable_planes([here], height_of(stored))
    tip, centred = stored or NO_OFFSET, False
    drive = CameraDrive(station, plan, here)
    angles_deg = yield from drive.angles_in_reach(
        here, lambda angles: [Place(u_deg, stored or NO_OFFSET) for u_deg in angles]
    )
    if plan.centre_first:
        found = Place(angles_deg[0], tip)

        def expected(looks: Sequence[SeenAt]) -> ToolOffset:
            return solve_up_camera(station.sighting(looks[0]), stored=stored).offset

        tip = yield from drive.centred([found], here, expected)
        here, centred = drive.pose(found), True
    places = [Place(u_deg, tip) for u_deg in angles_deg]

    def solve(looks: Sequence[SeenAt]) -> ResultT:
        return solver([station.sighting(look) for look in looks])

    looks = CameraSamples(drive, solve, here, before_camera=centred)
    return (yield from looks.at(places, retake=retake))
