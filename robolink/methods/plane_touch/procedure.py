"""A tip touched onto a plane, upright and tilted: X, Y and Z, and how the plane lies.

The first three touches are made in one orientation and tell how the plane lies. Then the tilts are
chosen that tell most about the tip, and touched at places round the first one.
"""

import numpy as np

from robolink.calibration import (
    Floats,
    PlaneTouchResult,
    plane_columns,
    solve_plane_touch,
)
from robolink.messages import tr
from robolink.methods.pivot.reach import free_tilts
from robolink.methods.pivot.tilts import UPRIGHT, OverPin
from robolink.methods.plane_touch.design import (
    candidates,
    informative_spots,
    normal_of,
    on_plane,
    require_lean,
    require_observable,
)
from robolink.methods.plane_touch.survey import UPRIGHTS, PlaneSurvey
from robolink.methods.surface_drive import SurfaceDrive, SurfaceSpot, Vector, places_of
from robolink.model import ToolOffset
from robolink.procedures import SurfaceTouches, TouchPlan
from robolink.runner import Notify, Procedure

_LEVEL: Vector = (0.0, 0.0, 1.0)


def measure_plane_touch(
    plan: TouchPlan,
    survey: PlaneSurvey,
    *,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
) -> Procedure[PlaneTouchResult]:
    """Measure a tip on a plane. Runs in Tool 0.

    It ends lifted, over the place that was touched last, in the orientation in which it began.

    Args:
        plan: Lift, clearance, contact input.
        survey: How many touches, and where.
        stored: The offset stored now; the approaches use it. Where it is wrong by e, the tip comes
            down nearer to the plane by up to 2 e sin(tilt / 2).
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.

    Raises:
        CalibrationError: ``surface_leans``, ``not_tilted``; ``not_touched``, ``typed_ahead``,
            ``touch_not_proven``, ``large_residual``; and as
            :func:`~robolink.calibration.solve_plane_touch`.

    Example:
        >>> from robolink.methods import PlaneSurvey, measure_plane_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> cell = PaperCell(
        ...     Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20.6), lambda at: (at[0], at[1], -40)
        ... )
        >>> stored, survey = ToolOffset(12, -4, -20), PlaneSurvey(count=8)
        >>> found = cell.run(measure_plane_touch(TouchPlan(), survey, stored=stored, axes=6))
        >>> [round(length, 3) for length in found.offset.components()[:3]]
        [12.3, -3.9, -20.6]
    """
    touches = SurfaceTouches(plan)
    over = OverPin.touched((yield from touches.first(0)), stored)
    drive = SurfaceDrive(plan, over, touches)
    normal = yield from _upright(plan, drive, touches, over.pin_mm, survey, stored)
    uprights = [SurfaceSpot(UPRIGHT, place, normal) for place in places_of(touches.taken, stored)]
    choice = yield from free_tilts(over, candidates(survey.tilt_deg, axes), plan.lift_mm)
    spots, columns = informative_spots(drive, uprights, survey, choice, stored)
    if not plan.nominal:
        require_observable(columns)
    for number in range(UPRIGHTS, survey.count):
        yield Notify(tr("Touch {k} of {n}", k=number + 1, n=survey.count))
        yield from drive.touch(spots[number], key=number, columns=columns[: number + 1])
    yield from drive.to(UPRIGHT)
    return _solved(touches, stored, sigma_mm)


def _upright(
    plan: TouchPlan,
    drive: SurfaceDrive,
    touches: SurfaceTouches,
    first_mm: Vector,
    survey: PlaneSurvey,
    stored: ToolOffset,
) -> Procedure[Vector]:
    """Have the plane touched twice more in the first orientation; return how it lies."""
    for number in range(1, UPRIGHTS):
        place = on_plane(first_mm, _LEVEL, survey.beside_mm(number))
        spot = SurfaceSpot(UPRIGHT, place, _LEVEL)
        yield from drive.touch(spot, key=number, further_mm=survey.rise_mm)
    if plan.nominal:
        return _LEVEL
    normal = normal_of(places_of(touches.taken, stored))
    require_lean(normal, survey)
    return normal


def _solved(
    touches: SurfaceTouches, stored: ToolOffset, sigma_mm: float | None
) -> PlaneTouchResult:
    result = solve_plane_touch(touches.taken, stored=stored, sigma_mm=sigma_mm)
    plane = result.plane
    columns = plane_columns(touches.taken, result.offset, plane.normal)
    places: Floats = np.array(places_of(touches.taken, result.offset))
    touches.require_made(columns, _upward(places @ plane.normal - plane.distance_mm, plane.normal))
    return result


def _upward(misses_mm: Floats, normal: Vector) -> Floats:
    """Return distances from a plane counted upward; its normal may point either way."""
    return misses_mm if normal[2] > 0 else -misses_mm
