"""The proof of a tip on the sphere on which it was measured."""

from robolink.calibration import CalibrationResult, SphereTouchResult, VerifyResult
from robolink.methods.pivot.reach import free_tilts
from robolink.methods.pivot.tilts import OverPin
from robolink.methods.plane_touch.design import candidates
from robolink.methods.plane_touch.proof import TURNED_DEG
from robolink.methods.sphere_touch.design import reachable
from robolink.methods.sphere_touch.survey import SphereSurvey
from robolink.methods.surface_drive import SurfaceDrive, proving_spots, verify_on_surface
from robolink.model import Pose, ToolOffset
from robolink.procedures import SurfaceTouches, TouchPlan
from robolink.runner import Procedure


def verify_on_sphere(
    plan: TouchPlan,
    survey: SphereSurvey,
    result: CalibrationResult,
    *,
    here: Pose,
    tip: ToolOffset,
    axes: int,
    tolerance_mm: float,
    u_mm: float,
) -> Procedure[VerifyResult]:
    """Touch the sphere that was found, in tilts not measured in.

    Args:
        plan: Lift, clearance, contact input.
        survey: From which sides it may be touched.
        result: The measurement; its sphere is touched.
        here: The pose of the new tool, lifted and upright.
        tip: The tip, seen from the frame in force.
        axes: How many axes the robot has, 0 where nobody knows.
        tolerance_mm: Largest drift that passes with its guard band.
        u_mm: Standard uncertainty of what one touch shows.

    Raises:
        CalibrationError: As :func:`~robolink.methods.surface_drive.verify_on_surface`.
        TypeError: The result is not that of a sphere.
    """
    if not isinstance(result, SphereTouchResult):
        raise TypeError("the sphere that was touched is a part of the result")
    x_mm, y_mm, z_mm = result.reference_point_mm
    radius_mm = result.radius_mm
    over = OverPin(here, (x_mm, y_mm, z_mm + radius_mm), tip=tip, frame=result.offset)
    drive = SurfaceDrive(plan, over, SurfaceTouches(plan))
    choice = candidates(survey.tilt_deg, axes, turned_deg=TURNED_DEG)
    tilts = yield from free_tilts(over, choice, plan.lift_mm)
    possible = reachable(drive, (x_mm, y_mm, z_mm), radius_mm, tilts, survey)
    return (
        yield from verify_on_surface(
            plan,
            over=over,
            spots=proving_spots(over, possible),
            tolerance_mm=tolerance_mm,
            u_mm=u_mm,
        )
    )
