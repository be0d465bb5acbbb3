"""A tip touched onto a plane, upright and tilted: X, Y and Z, and how the plane lies.

The first three touches are made in one orientation and tell how the plane lies. Then the tilts are
chosen that tell most about the tip, and touched at places round the first one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robolink.calibration import (
    Floats,
    PlaneTouchResult,
    plane_columns,
    solve_plane_touch,
)
from robolink.methods.pivot.tilts import UPRIGHT, OverPin, free_tilts
from robolink.methods.plane_touch.design import (
    candidates,
    informative_spots,
    normal_of,
    on_plane,
    require_lean,
    require_observable,
)
from robolink.methods.plane_touch.survey import UPRIGHTS, PlaneSurvey
from robolink.methods.surface_drive import SurfaceSpot, Vector, places_of
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

_LEVEL: Vector = (0.0, 0.0, 1.0)


def measure_plane_touch(
    plan: TouchPlan,
    survey: PlaneSurvey,
    *,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
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
        sampling: Whether a touch may be made again when all are made.

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
    touches = SurfaceTouches(plan, total=survey.count, retakes=True)
    first = yield from touches.first(0)
    over = OverPin.touched(first, stored)
    sampler = _PlaneSampler(touches, over, survey, stored=stored, axes=axes, sigma_mm=sigma_mm)
    result = yield from sample_sequentially(sampler, first, range(survey.count), sampling)
    sampler.require_made(result)
    return result


def go_on_plane_touch(
    plan: TouchPlan,
    survey: PlaneSurvey,
    *,
    here: Pose,
    taken: Sequence[TouchedAt],
    again: int,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
) -> Procedure[PlaneTouchResult]:
    """Make one touch of :func:`measure_plane_touch` again. Runs in Tool 0, ends as it does.

    Args:
        plan: Lift, clearance, contact input.
        survey: How many touches there were, and where.
        here: Where the flange is.
        taken: The touches of the measurement.
        again: Index of the one that is made again.
        stored: The offset stored now.
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.

    Raises:
        CalibrationError: As :func:`measure_plane_touch`.
    """
    touches = SurfaceTouches(plan, total=len(taken), retakes=True)
    over = OverPin.touched(taken[0], stored)
    sampler = _PlaneSampler(touches, over, survey, stored=stored, axes=axes, sigma_mm=sigma_mm)
    sampler.adopt(taken, candidates(survey.tilt_deg, axes))
    result = yield from go_on_surface(sampler, here=here, taken=taken, again=again)
    sampler.require_made(result)
    return result


class _PlaneSampler(SurfaceSampler[PlaneTouchResult]):
    """Touches of a plane."""

    uprights = UPRIGHTS

    def __init__(
        self,
        touches: SurfaceTouches,
        over: OverPin,
        survey: PlaneSurvey,
        *,
        stored: ToolOffset,
        axes: int,
        sigma_mm: float | None,
    ) -> None:
        super().__init__(touches, over, stored=stored, count=survey.count, sigma_mm=sigma_mm)
        self._survey = survey
        self._axes = axes

    def solve(self, taken: Sequence[Pose]) -> PlaneTouchResult:
        return solve_plane_touch(taken, stored=self.stored, sigma_mm=self.sigma_mm)

    def derivatives(self, poses: Sequence[Pose]) -> Floats:
        return plane_columns(poses, self.stored, self._normal())

    def normal_at(self, place_mm: Vector) -> Vector:  # noqa: ARG002 - a plane has one
        return self._normal()

    def aligned(self, spot: SurfaceSpot) -> SurfaceSpot:
        first, normal = self.upright_places()[0], self._normal()
        beside_mm = spot.place_mm[0] - first[0], spot.place_mm[1] - first[1]
        return replace(spot, place_mm=on_plane(first, normal, beside_mm), normal=normal)

    def require_made(self, result: PlaneTouchResult) -> None:
        """Refuse touches that were not made; see :meth:`SurfaceTouches.require_made`."""
        plane, taken = result.plane, self.touches.taken
        columns = plane_columns(taken, result.offset, plane.normal)
        places: Floats = np.array(places_of(taken, result.offset))
        misses_mm = places @ plane.normal - plane.distance_mm
        self.touches.require_made(columns, _upward(misses_mm, plane.normal))

    def _upright(self, place: int) -> tuple[SurfaceSpot, float]:
        # As if nothing were known yet: one that is made again may be what the others contradict.
        at = on_plane(self.upright_places()[0], _LEVEL, self._survey.beside_mm(place))
        return SurfaceSpot(UPRIGHT, at, _LEVEL), self._survey.rise_mm

    def _laid_out(self) -> Procedure[tuple[SurfaceSpot, ...]]:
        survey, plan, normal = self._survey, self.touches.plan, self._normal()
        uprights = [SurfaceSpot(UPRIGHT, place, normal) for place in self.upright_places()]
        tilts = candidates(survey.tilt_deg, self._axes)
        choice = yield from free_tilts(self.over, tilts, plan.lift_mm)
        spots, columns = informative_spots(self.drive, uprights, survey, choice, self.stored)
        if not plan.nominal:
            require_observable(columns)
        return spots

    def _normal(self) -> Vector:
        """Return how the plane lies by the upright touches.

        Raises:
            CalibrationError: ``rank_deficient`` or ``surface_leans``.
        """
        if self.touches.plan.nominal:
            return _LEVEL
        normal = normal_of(self.upright_places())
        require_lean(normal, self._survey)
        return normal


def _upward(misses_mm: Floats, normal: Vector) -> Floats:
    """Return distances from a plane counted upward; its normal may point either way."""
    return misses_mm if normal[2] > 0 else -misses_mm
