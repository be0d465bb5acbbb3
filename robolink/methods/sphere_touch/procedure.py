"""A tip touched onto a sphere from several sides, upright and tilted: X, Y and Z, and the sphere.

The first four touches are made in one orientation and tell where the sphere is, but for the error
of the tip. Then the sides and tilts are chosen that tell most about the tip.
"""

import math
from collections.abc import Sequence

import numpy as np

from robolink.calibration import Floats, SphereTouchResult, solve_sphere_touch, sphere_columns
from robolink.messages import tr
from robolink.methods.pivot.tilts import UPRIGHT, OverPin, free_tilts
from robolink.methods.plane_touch.design import candidates
from robolink.methods.sphere_touch.design import (
    informative_spots,
    reachable,
    sphere_of,
    spot_on,
)
from robolink.methods.sphere_touch.survey import UPRIGHTS, SphereSurvey, Vector
from robolink.methods.surface_drive import SurfaceSpot, places_of
from robolink.methods.surface_sampler import SurfaceSampler, go_on_surface
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    TAKE_ALL,
    SamplingPolicy,
    SurfaceTouches,
    TouchPlan,
    sample_sequentially,
)
from robolink.runner import Procedure, TouchedAt


def measure_sphere_touch(
    plan: TouchPlan,
    survey: SphereSurvey,
    *,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
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
        sampling: Whether a touch may be made again when all are made.

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
    touches = SurfaceTouches(plan, total=survey.count, retakes=True)
    first = yield from touches.shown(tr("Jog the tip onto the top of the sphere."), key=0)
    over = OverPin.touched(first, stored)
    sampler = _SphereSampler(touches, over, survey, stored=stored, axes=axes, sigma_mm=sigma_mm)
    result = yield from sample_sequentially(sampler, first, range(survey.count), sampling)
    sampler.require_made(result)
    return result


def go_on_sphere_touch(
    plan: TouchPlan,
    survey: SphereSurvey,
    *,
    here: Pose,
    taken: Sequence[TouchedAt],
    again: int,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
) -> Procedure[SphereTouchResult]:
    """Make one touch of :func:`measure_sphere_touch` again. Runs in Tool 0, ends as it does.

    Args:
        plan: Lift, clearance, contact input.
        survey: How many touches there were, and from which sides.
        here: Where the flange is.
        taken: The touches of the measurement.
        again: Index of the one that is made again.
        stored: The offset stored now.
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.

    Raises:
        CalibrationError: As :func:`measure_sphere_touch`.
    """
    touches = SurfaceTouches(plan, total=len(taken), retakes=True)
    over = OverPin.touched(taken[0], stored)
    sampler = _SphereSampler(touches, over, survey, stored=stored, axes=axes, sigma_mm=sigma_mm)
    sampler.adopt(taken, candidates(survey.tilt_deg, axes))
    result = yield from go_on_surface(sampler, here=here, taken=taken, again=again)
    sampler.require_made(result)
    return result


class _SphereSampler(SurfaceSampler[SphereTouchResult]):
    """Touches of a sphere."""

    uprights = UPRIGHTS

    def __init__(
        self,
        touches: SurfaceTouches,
        over: OverPin,
        survey: SphereSurvey,
        *,
        stored: ToolOffset,
        axes: int,
        sigma_mm: float | None,
    ) -> None:
        super().__init__(touches, over, stored=stored, count=survey.count, sigma_mm=sigma_mm)
        self._survey = survey
        self._axes = axes

    def solve(self, taken: Sequence[Pose]) -> SphereTouchResult:
        return solve_sphere_touch(taken, stored=self.stored, sigma_mm=self.sigma_mm)

    def derivatives(self, poses: Sequence[Pose]) -> Floats:
        return sphere_columns(poses, self.stored, self._sphere()[0])

    def normal_at(self, place_mm: Vector) -> Vector:
        centre, _ = self._sphere()
        apart_mm = math.dist(place_mm, centre)
        x, y, z = ((at - c) / apart_mm for at, c in zip(place_mm, centre, strict=True))
        return x, y, z

    def aligned(self, spot: SurfaceSpot) -> SurfaceSpot:
        return spot_on(*self._sphere(), spot.tilt, spot.normal)

    def require_made(self, result: SphereTouchResult) -> None:
        """Refuse touches that were not made; see :meth:`SurfaceTouches.require_made`."""
        x_mm, y_mm, z_mm = result.reference_point_mm
        taken = self.touches.taken
        columns = sphere_columns(taken, result.offset, (x_mm, y_mm, z_mm))
        places = np.array(places_of(taken, result.offset))
        apart_mm = np.linalg.norm(places - np.array(result.reference_point_mm), axis=1)
        self.touches.require_made(columns, apart_mm - result.radius_mm)

    def _upright(self, place: int) -> tuple[SurfaceSpot, float]:
        # As if nothing were known yet: one that is made again may be what the others contradict.
        survey, first = self._survey, self.upright_places()[0]
        centre = _below(first, survey.radius_mm)
        spot = spot_on(centre, survey.radius_mm, UPRIGHT, survey.upright_side(place))
        return spot, survey.aside_mm

    def _laid_out(self) -> Procedure[tuple[SurfaceSpot, ...]]:
        survey = self._survey
        centre, radius_mm = self._sphere()
        uprights = [
            SurfaceSpot(UPRIGHT, place, survey.upright_side(i))
            for i, place in enumerate(self.upright_places())
        ]
        choice = candidates(survey.tilt_deg, self._axes)
        tilts = yield from free_tilts(self.over, choice, self.touches.plan.lift_mm)
        possible = reachable(self.drive, centre, radius_mm, tilts, survey)
        spots, _ = informative_spots(self.drive, uprights, possible, survey, self.stored, centre)
        return spots

    def _sphere(self) -> tuple[Vector, float]:
        """Return where the sphere is by the upright touches, and its radius.

        Raises:
            CalibrationError: ``radius_contradicted`` or ``off_top``.
        """
        places = self.upright_places()
        if self.touches.plan.nominal:
            return _below(places[0], self._survey.radius_mm), self._survey.radius_mm
        return sphere_of(places, self._survey)


def _below(top_mm: Vector, radius_mm: float) -> Vector:
    return top_mm[0], top_mm[1], top_mm[2] - radius_mm
