"""The proof of a tip on the plane on which it was measured."""

import numpy as np

from robolink.calibration import CalibrationResult, PlaneTouchResult, VerifyResult, rotation_of
from robolink.methods.pivot.reach import free_tilts
from robolink.methods.pivot.tilts import OverPin
from robolink.methods.plane_touch.design import candidates
from robolink.methods.surface_drive import (
    SurfaceSpot,
    Vector,
    proving_spots,
    verify_on_surface,
)
from robolink.model import Pose, ToolOffset
from robolink.procedures import TouchPlan
from robolink.runner import Procedure

TURNED_DEG = 30.0
"""By how much the tilts are turned against those that were measured in."""


def verify_on_plane(
    plan: TouchPlan,
    result: CalibrationResult,
    *,
    here: Pose,
    tip: ToolOffset,
    tilt_deg: float,
    axes: int,
    tolerance_mm: float,
    u_mm: float,
) -> Procedure[VerifyResult]:
    """Touch the plane that was found, below where the tip is, in tilts not measured in.

    Args:
        plan: Lift, clearance, contact input.
        result: The measurement; its plane is touched.
        here: The pose of the new tool, lifted and upright.
        tip: The tip, seen from the frame in force.
        tilt_deg: How far the tool leans.
        axes: How many axes the robot has, 0 where nobody knows.
        tolerance_mm: Largest drift that passes with its guard band.
        u_mm: Standard uncertainty of what one touch shows.

    Raises:
        CalibrationError: As :func:`~robolink.methods.surface_drive.verify_on_surface`.
        TypeError: The result is not that of a plane.
    """
    if not isinstance(result, PlaneTouchResult):
        raise TypeError("the plane that was touched is a part of the result")
    normal, foot = _under(here, tip, result)
    over = OverPin(here, foot, tip=tip, frame=result.offset)
    choice = candidates(tilt_deg, axes, turned_deg=TURNED_DEG)
    tilts = yield from free_tilts(over, choice, plan.lift_mm)
    spots = proving_spots(over, [SurfaceSpot(tilt, foot, normal) for tilt in tilts])
    return (
        yield from verify_on_surface(
            plan, over=over, spots=spots, tolerance_mm=tolerance_mm, u_mm=u_mm
        )
    )


def _under(here: Pose, tip: ToolOffset, result: PlaneTouchResult) -> tuple[Vector, Vector]:
    """Return the upward normal of the plane, and its place straight below the tip."""
    plane = result.plane
    sign = 1.0 if plane.normal[2] > 0 else -1.0
    nx, ny, nz = (sign * part for part in plane.normal)
    x, y, z = (np.array(here.coordinates()[:3]) + rotation_of(here) @ tip.components()[:3]).tolist()
    above_mm = x * nx + y * ny + z * nz - sign * plane.distance_mm
    return (nx, ny, nz), (x, y, z - above_mm / nz)
