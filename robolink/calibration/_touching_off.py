"""Touch-off on a surface that switches an input. The tip stops at the touch, then retreats."""

from collections.abc import Sequence
from dataclasses import replace

from robolink.calibration._drawing_back import sought
from robolink.calibration._result import Drift, VerifyResult
from robolink.calibration._stations import ProbePlan, TouchStation
from robolink.calibration._steps import Move, Procedure, Seek
from robolink.calibration._touch import NO_OFFSET, raised, travel
from robolink.calibration._z_touch import Touch, ZTouchResult, solve_z_touch
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset, rotate_xy


def touch_off(
    station: TouchStation,
    plan: ProbePlan,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
) -> Procedure[ZTouchResult]:
    """Measure Z of a tip by touching a surface. Runs in Tool 0, from above the surface.

    Args:
        station: Where the surface is.
        plan: How it is touched.
        here: Where the flange is.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one touch, where it is known.

    Raises:
        CalibrationError: ``no_edge``, ``edge_passed``, and those of :func:`solve_z_touch`.
    """
    touches = yield from _touches(station, plan, here, stored or NO_OFFSET)
    return solve_z_touch(touches, station.z_mm, stored=stored, sigma_mm=sigma_mm)


def verify_by_touching(
    station: TouchStation,
    plan: ProbePlan,
    *,
    here: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    aside: ToolOffset = NO_OFFSET,
) -> Procedure[VerifyResult]:
    """Turn about the new tip and touch the surface there again. Runs in the new tool.

    Args:
        station: Where the surface is.
        plan: How it is touched.
        here: Where the frame of the new tool is.
        angles_deg: Its angles U at which the surface is touched.
        tolerance_mm: Largest drift that passes.
        aside: Where the tip is expected, seen from the frame in force; not 0 where a difference
            to a reference was written.

    Raises:
        CalibrationError: As :func:`touch_off`.
    """
    drifts = []
    for angle_deg in angles_deg:
        frame = replace(here, u_deg=angle_deg)
        touches = yield from _touches(station, plan, here, aside, frame=frame)
        here = replace(_above(station, plan, frame, aside), z_mm=_safe_z_mm(station, plan, aside))
        found = solve_z_touch(touches, station.z_mm).offset
        drifts.append(Drift(angle_deg, 0.0, 0.0, aside.z_mm - found.z_mm))
    return VerifyResult(tuple(drifts), tolerance_mm, heights_only=True)


def _touches(
    station: TouchStation,
    plan: ProbePlan,
    here: Pose,
    tip: ToolOffset,
    *,
    frame: Pose | None = None,
) -> Procedure[list[Touch]]:
    """Touch at every speed of the plan; begins and ends above the surface."""
    above, safe_z_mm = _above(station, plan, frame or here, tip), _safe_z_mm(station, plan, tip)
    safe = replace(above, z_mm=safe_z_mm)
    end = raised(above, -plan.clearance_mm - plan.beyond_mm)
    yield from travel(safe, here=here, purpose=tr("go above the surface"))
    here = yield Move(above, Path.STRAIGHT, tr("come down to the clearance"))
    touches = []
    for speed_mm_s in plan.speeds_mm_s:
        step = Seek(end, station.edge, speed_mm_s, tr("seek the surface"))
        touch = yield from sought(step, here=here, safe_z_mm=safe_z_mm)
        touches.append(Touch(touch.z_mm, speed_mm_s))
        here = yield Move(raised(touch, plan.back_off_mm), Path.STRAIGHT, tr("back off"))
    yield Move(safe, Path.STRAIGHT, tr("lift off the surface"))
    return touches


def _above(station: TouchStation, plan: ProbePlan, frame: Pose, tip: ToolOffset) -> Pose:
    """Return the frame's pose with the tip where it begins to seek."""
    dx, dy = rotate_xy(tip.x_mm, tip.y_mm, frame.u_deg)
    return replace(
        frame,
        x_mm=station.x_mm - dx,
        y_mm=station.y_mm - dy,
        z_mm=station.z_mm + plan.clearance_mm - tip.z_mm,
    )


def _safe_z_mm(station: TouchStation, plan: ProbePlan, tip: ToolOffset) -> float:
    return station.z_mm + plan.lift_mm - tip.z_mm
