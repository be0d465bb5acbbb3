"""A tip touched onto a sphere from several sides, upright and tilted: X, Y and Z, and the sphere.

The first four touches are made in one orientation and tell where the sphere is, but for the error
of the tip. Then the sides and tilts are chosen that tell most about the tip.
"""

import numpy as np

from robolink.calibration import SphereTouchResult, solve_sphere_touch, sphere_columns
from robolink.messages import tr
from robolink.methods.pivot.reach import free_tilts
from robolink.methods.pivot.tilts import UPRIGHT, OverPin
from robolink.methods.plane_touch.design import candidates
from robolink.methods.sphere_touch.design import (
    informative_spots,
    reachable,
    sphere_of,
    spot_on,
)
from robolink.methods.sphere_touch.survey import UPRIGHTS, SphereSurvey, Vector
from robolink.methods.surface_drive import SurfaceDrive, SurfaceSpot, places_of
from robolink.model import ToolOffset
from robolink.procedures import SurfaceTouches, TouchPlan
from robolink.runner import Notify, Procedure


def measure_sphere_touch(
    plan: TouchPlan,
    survey: SphereSurvey,
    *,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
) -> Procedure[SphereTouchResult]:
    """Measure a tip on a sphere. Runs in Tool 0.

    It ends lifted, over the place that was touched last, in the orientation in which it began.

    Args:
        plan: Lift, clearance, contact input.
        survey: How many touches, and from which sides.
        stored: The offset stored now; the approaches use it. Where it is wrong by e, the tip comes
            down nearer to the sphere by up to 2 e sin(tilt / 2).
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.

    Raises:
        CalibrationError: ``off_top``, ``radius_contradicted``, ``not_tilted``; ``not_touched``,
            ``typed_ahead``, ``touch_not_proven``, ``large_residual``; and as
            :func:`~robolink.calibration.solve_sphere_touch`.

    Example:
        >>> import math
        >>> from robolink.methods import SphereSurvey, measure_sphere_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> def onto_the_ball(at, centre=(310, 95, -60), radius_mm=10):
        ...     share = radius_mm / math.dist(at, centre)
        ...     return tuple(c + share * (x - c) for x, c in zip(at, centre))
        >>> cell = PaperCell(Pose(298, 99, 20, 0), ToolOffset(12.3, -3.9, -20.6), onto_the_ball)
        >>> course = measure_sphere_touch(
        ...     TouchPlan(), SphereSurvey(radius_mm=10), stored=ToolOffset(12, -4, -20), axes=6
        ... )
        >>> [round(length, 3) for length in cell.run(course).offset.components()[:3]]
        [12.3, -3.9, -20.6]
    """
    touches = SurfaceTouches(plan)
    first = yield from touches.shown(tr("Jog the tip onto the top of the sphere."), key=0)
    over = OverPin.touched(first, stored)
    drive = SurfaceDrive(plan, over, touches)
    yield from _upright(drive, over.pin_mm, survey)
    places = places_of(touches.taken, stored)
    if plan.nominal:
        centre, radius_mm = _below(over.pin_mm, survey.radius_mm), survey.radius_mm
    else:
        centre, radius_mm = sphere_of(places, survey)
    uprights = [
        SurfaceSpot(UPRIGHT, place, survey.upright_side(i)) for i, place in enumerate(places)
    ]
    tilts = yield from free_tilts(over, candidates(survey.tilt_deg, axes), plan.lift_mm)
    possible = reachable(drive, centre, radius_mm, tilts, survey)
    spots, columns = informative_spots(drive, uprights, possible, survey, stored, centre)
    for number in range(UPRIGHTS, survey.count):
        yield Notify(tr("Touch {k} of {n}", k=number + 1, n=survey.count))
        yield from drive.touch(spots[number], key=number, columns=columns[: number + 1])
    yield from drive.to(UPRIGHT)
    return _solved(touches, stored, sigma_mm)


def _upright(drive: SurfaceDrive, top_mm: Vector, survey: SphereSurvey) -> Procedure[None]:
    """Have the sphere touched on three sides in the first orientation."""
    centre = _below(top_mm, survey.radius_mm)
    for number in range(1, UPRIGHTS):
        spot = spot_on(centre, survey.radius_mm, UPRIGHT, survey.upright_side(number))
        yield from drive.touch(spot, key=number, further_mm=survey.aside_mm)


def _below(top_mm: Vector, radius_mm: float) -> Vector:
    return top_mm[0], top_mm[1], top_mm[2] - radius_mm


def _solved(
    touches: SurfaceTouches, stored: ToolOffset, sigma_mm: float | None
) -> SphereTouchResult:
    result = solve_sphere_touch(touches.taken, stored=stored, sigma_mm=sigma_mm)
    x_mm, y_mm, z_mm = result.reference_point_mm
    columns = sphere_columns(touches.taken, result.offset, (x_mm, y_mm, z_mm))
    places = np.array(places_of(touches.taken, result.offset))
    apart_mm = np.linalg.norm(places - np.array(result.reference_point_mm), axis=1)
    touches.require_made(columns, apart_mm - result.radius_mm)
    return result
