"""Tilting a tool from touch to touch of a surface, and the test of a new tip on it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Generic

import numpy as np

from robolink.calibration import Floats, VerifyResult, linear_fit, rotation_of
from robolink.messages import tr
from robolink.methods.pivot.tilts import (
    TURNS_DEG,
    UPRIGHT,
    OverPin,
    Tilt,
    TiltedNames,
    apart_deg,
    tilt_in_air,
    tip_place,
)
from robolink.methods.surface_touch import SurfaceTouchSource
from robolink.methods.surface_touch.survey import SurveyT, Vector
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    MOST_MORE,
    SurfaceProof,
    SurfaceTouches,
    TouchPlan,
    approach_path,
    resume_samples,
    sample_sequentially,
)
from robolink.procedures.samples import ResultT
from robolink.runner import Notify, Procedure, TakenAgainError, TouchedAt

PROVING_TOUCHES: Final = 4
"""Number of touches: three for the components, and one that may contradict them."""

_LEFT: Final = 0.5
"""Share of the clearance that must remain if the tip is wrong by as much as the clearance."""

FAINT: Final = 1e-6
"""Regularisation: makes two plans comparable before any combination of touches determines every
unknown."""


@dataclass(frozen=True, slots=True)
class SurfaceSpot:
    """A place of a surface, and how the tool is oriented to touch it.

    Attributes:
        tilt: How the tool stands, against its first orientation.
        place_mm: Where the surface is touched, base, as far as it is known.
        normal: Its unit normal there, away from it.
    """

    tilt: Tilt
    place_mm: Vector
    normal: Vector


class SurfaceDrive:
    """Moves a lifted tip from spot to spot of a surface.

    Args:
        plan: Lift and clearance.
        over: The place over which the tip is, lifted and upright.
        touches: How the surface is touched.
    """

    def __init__(self, plan: TouchPlan, over: OverPin, touches: SurfaceTouches) -> None:
        self._plan = plan
        self._over = over
        self._touches = touches
        self._stands = UPRIGHT

    def pose(self, spot: SurfaceSpot) -> Pose:
        """Return the pose of the frame with the tip on a spot."""
        return replace(self._over, pin_mm=spot.place_mm).pose(spot.tilt, 0.0)

    def to(self, goal: Tilt) -> Procedure[None]:
        """Tilt in the air, over the place that was touched last.

        Raises:
            CalibrationError: ``not_tilted``.
        """
        yield from tilt_in_air(self._over, self._stands, goal, self._plan.lift_mm)
        self._stands = goal

    def touch(
        self,
        spot: SurfaceSpot,
        *,
        key: Hashable,
        columns: Floats | None = None,
        further_mm: float = 0.0,
        instruction: str = "",
    ) -> Procedure[TouchedAt]:
        """Tilt in the air, go to a spot, and let a person touch; see :class:`SurfaceTouches`.

        Raises:
            CalibrationError: ``not_tilted``, ``not_touched`` or ``typed_ahead``, with the tip
                drawn back.
        """
        yield from self.to(spot.tilt)
        try:
            found = yield from self._touches.again(
                self.pose(spot),
                spot.normal,
                key=key,
                columns=columns,
                further_mm=max(further_mm, self._swing_mm(spot)),
                instruction=instruction,
            )
        except TakenAgainError:
            # The tip was drawn back over this spot, and is tilted from there.
            self._over = replace(self._over, pin_mm=spot.place_mm)
            raise
        self._over = self._over.moved_to(found)
        return found

    def _swing_mm(self, spot: SurfaceSpot) -> float:
        """Return how much more than the clearance keeps a tip off that is believed elsewhere.

        A tip that is wrong by e is nearer by up to e |R'n - R0'n|: its place on the surface was
        found in the first orientation. No e is larger than the clearance, which is refused below
        the largest change that is believed; half of that is left.
        """
        upright = rotation_of(self.pose(replace(spot, tilt=UPRIGHT)))
        turned = rotation_of(self.pose(spot)) - upright
        nearer = float(np.linalg.norm(np.array(spot.normal) @ turned))
        return self._plan.clearance_mm * max(0.0, nearer - _LEFT)


def candidates(tilt_deg: float, axes: int, *, turned_deg: float = 0.0) -> tuple[Tilt, ...]:
    """Return the tilts to choose among.

    Args:
        tilt_deg: How far the tool leans.
        axes: How many axes the robot has, 0 where nobody knows.
        turned_deg: Turned by so much more; 30 makes them others than those without.
    """
    leans = [Tilt(lean_deg=tilt_deg), Tilt(lean_deg=-tilt_deg)]
    if axes >= SIX:
        leans += [Tilt(roll_deg=tilt_deg), Tilt(roll_deg=-tilt_deg)]
    return tuple(
        Tilt(turn + turned_deg, lean.lean_deg, lean.roll_deg)
        for turn in TURNS_DEG
        for lean in leans
    )


def doubts_with_each(normal: Floats, rows: Floats) -> Floats:
    """Return for each of many touches how uncertain the tip would be with it.

    Args:
        normal: The normal matrix of the touches that are chosen already, the tip first.
        rows: The derivatives at each of the others.
    """
    with_each = np.linalg.inv(normal + rows[:, :, None] * rows[:, None, :])
    doubts: Floats = np.einsum("nii->n", with_each[:, :3, :3])
    return doubts


def in_turn(spots: Iterable[SurfaceSpot]) -> list[SurfaceSpot]:
    """Return spots in the order of their turns, so that the robot goes round once."""
    return sorted(spots, key=lambda one: (one.tilt.turn_deg, one.tilt.lean_deg, one.tilt.roll_deg))


def places_of(touches: Sequence[Pose], tip: ToolOffset) -> list[Vector]:
    """Return where a tip was at touches, base."""
    return [tip_place(touch, tip) for touch in touches]


def proving_spots(over: OverPin, possible: Sequence[SurfaceSpot]) -> tuple[SurfaceSpot, ...]:
    """Return the four possible spots whose touches together show a drift best."""
    rows = [np.array(spot.normal) @ rotation_of(over.pose(spot.tilt, 0.0)) for spot in possible]
    chosen: list[int] = []

    def doubt(index: int) -> float:
        seen = np.array([rows[one] for one in (*chosen, index)])
        return float(np.trace(np.linalg.inv(seen.T @ seen + FAINT * np.eye(3))))

    for _ in range(PROVING_TOUCHES):
        chosen.append(min((i for i in range(len(rows)) if i not in chosen), key=doubt))
    return tuple(possible[index] for index in sorted(chosen))


def verify_on_surface(
    plan: TouchPlan,
    *,
    over: OverPin,
    spots: Sequence[SurfaceSpot],
    tolerance_mm: float,
    u_mm: float,
) -> Procedure[VerifyResult]:
    """Let a person touch a known surface in tilts not measured in. Runs in the new tool.

    The tip starts lifted and upright. How far the person jogs beyond the place where the surface
    should have been shows, from all touches together, where the tip is beside where it was
    written to be. A drift too near to the tolerance is touched again at all spots, at most twice.
    It ends as it started.

    Args:
        plan: Lift, clearance, contact input.
        over: Where the tip is, lifted, in the selected frame.
        spots: What is touched.
        tolerance_mm: Largest drift that passes with its guard band, all directions together.
        u_mm: Standard uncertainty of what one touch shows.

    Raises:
        CalibrationError: ``not_tilted``, and ``not_touched`` or ``typed_ahead`` with the tip drawn
            back.
    """
    drive = SurfaceDrive(plan, over, SurfaceTouches(plan, limit_mm=tolerance_mm))
    proof = SurfaceProof(over.pose(UPRIGHT, 0.0), tolerance_mm, u_mm)
    said = tr("Jog the tip onto the surface again. We measure how far it was off.")
    for left in reversed(range(1 + MOST_MORE)):
        for spot in spots:
            found = yield from drive.touch(spot, key=len(proof.touches), instruction=said)
            proof.add(drive.pose(spot), found, spot.normal)
        if not left or not proof.undecided():
            break
        yield Notify(
            tr(
                "The tip is {drift:.3f} mm off, too near the limit of {limit:.3f} mm. "
                "Touch the surface once more at every place; the mean counts.",
                drift=proof.drift().distance_mm,
                limit=tolerance_mm,
            )
        )
    yield from drive.to(UPRIGHT)
    return proof.result()


_TIP_COLUMNS = 3

SIX: Final = 6
"""Number of axes of a robot that tilts its tool about two axes of the flange."""

TURNED_DEG: Final = 30.0
"""Turn of the test's tilts relative to those of the measurement, degrees."""


class SurfaceSampler(TiltedNames, ABC, Generic[SurveyT, ResultT]):
    """Touches of one surface, known by their numbers from 0; implements ``SequentialSampler``.

    Args:
        source: What is measured, and how.
        stored: The offset stored now; the approaches use it.
        touches: How they are made.
        first: The first one, which is made already, upright.
    """

    def __init__(
        self,
        source: SurfaceTouchSource[SurveyT, ResultT],
        stored: ToolOffset,
        touches: SurfaceTouches,
        first: TouchedAt,
    ) -> None:
        self.touches = touches
        self.over = OverPin.touched(first, stored)
        self.stored = stored
        self.survey = source.survey
        self.axes = source.axes
        self.sigma_mm = source.sigma_mm
        self.drive = SurfaceDrive(touches.plan, self.over, touches)
        self._spots: tuple[SurfaceSpot, ...] = ()

    def take(self, place: int) -> Procedure[Pose]:
        """Go to a spot, and let a person touch the surface there."""
        if place >= self.survey.uprights:
            if not self._spots:
                self._spots = yield from self._laid_out()
            yield Notify(tr("Touch {k} of {n}", k=place + 1, n=self.survey.count))
        spot, further_mm = self._spot(place)
        return (
            yield from self.drive.touch(
                spot, key=place, columns=self._columns(place, spot), further_mm=further_mm
            )
        )

    def away(self) -> Procedure[None]:
        """Move upright again, lifted: a person may take their time, or nothing follows."""
        return self.drive.to(UPRIGHT)

    def foreseen(self, place: int) -> Pose:
        """Return the pose in which a tilted touch would be made."""
        return self.drive.pose(self._spot(place)[0])

    def gain(self, taken: Sequence[Pose]) -> float:
        """Return the standard deviation of the tip as a multiple of one touch's."""
        columns = self.derivatives(taken)
        fit = linear_fit(columns, np.zeros(len(columns)))
        return math.sqrt(float(fit.unit_covariance.diagonal()[:_TIP_COLUMNS].max()))

    def adopt(self, taken: Sequence[TouchedAt]) -> None:
        """Take over the touches of a measurement of which one is repeated."""
        self.touches.adopt(dict(enumerate(taken)))
        choice = candidates(self.survey.tilt_deg, self.axes)
        tilts = [UPRIGHT] * self.survey.uprights
        for pose in taken[self.survey.uprights :]:
            tilts.append(min(choice, key=lambda tilt: apart_deg(self.over.pose(tilt, 0.0), pose)))
        spots = zip(tilts, places_of(taken, self.stored), strict=True)
        self._spots = tuple(SurfaceSpot(tilt, at, self.normal_at(at)) for tilt, at in spots)

    @abstractmethod
    def solve(self, taken: Sequence[Pose]) -> ResultT:
        """Return their result, with their residuals in their order.

        Raises:
            CalibrationError: They say nothing that can be trusted.
        """

    @abstractmethod
    def derivatives(self, poses: Sequence[Pose]) -> Floats:
        """Return the derivatives of the distances by tip and surface, one row a pose."""

    @abstractmethod
    def normal_at(self, place_mm: Vector) -> Vector:
        """Return the unit normal of the surface, by the upright touches, nearest to a place.

        Raises:
            CalibrationError: They show a surface that is not to be touched so.
        """

    @abstractmethod
    def aligned(self, spot: SurfaceSpot) -> SurfaceSpot:
        """Return a spot where the upright touches that count now put it.

        Raises:
            CalibrationError: They show a surface that is not to be touched so.
        """

    @abstractmethod
    def require_made(self, result: ResultT) -> None:
        """Refuse touches that were not made; see :meth:`SurfaceTouches.require_made`."""

    @abstractmethod
    def _upright(self, place: int) -> tuple[SurfaceSpot, float]:
        """Return the spot of an upright touch, and how much farther away it is kept."""

    @abstractmethod
    def _laid_out(self) -> Procedure[tuple[SurfaceSpot, ...]]:
        """Return the spots of all touches, once the upright ones are made.

        Raises:
            CalibrationError: The surface, or the arm, does not let the tip be told.
        """

    def upright_places(self) -> list[Vector]:
        """Return where the tip was at the upright touches made so far, base."""
        return places_of(self.touches.taken[: self.survey.uprights], self.stored)

    def _spot(self, place: int) -> tuple[SurfaceSpot, float]:
        if place < self.survey.uprights:
            return self._upright(place)
        return self.aligned(self._spots[place]), 0.0

    def _columns(self, place: int, spot: SurfaceSpot) -> Floats | None:
        """Return what tip and surface could explain of all the others and of this one."""
        if not self._spots:
            return None
        return self.derivatives([*self.touches.others(place), self.drive.pose(spot)])


@dataclass(frozen=True, slots=True)
class SurfaceKind(Generic[SurveyT, ResultT]):
    """A kind of surface.

    Attributes:
        sampler: Makes its touches, as :class:`SurfaceSampler` does.
        asked: Returns what the person is asked for first, before anything is known of it.
    """

    sampler: Callable[
        [SurfaceTouchSource[SurveyT, ResultT], ToolOffset, SurfaceTouches, TouchedAt],
        SurfaceSampler[SurveyT, ResultT],
    ]
    asked: Callable[[], str]


def measure_surface(
    source: SurfaceTouchSource[SurveyT, ResultT],
    kind: SurfaceKind[SurveyT, ResultT],
    stored: ToolOffset,
) -> Procedure[ResultT]:
    """Measure a tip on a surface. Runs in Tool 0.

    Args:
        source: What is measured, and how.
        kind: What the surface is.
        stored: The offset stored now.
    """
    count = source.survey.count
    touches = SurfaceTouches(source.touch, total=count, retakes=True)
    first = yield from touches.shown(kind.asked(), key=0)
    samples = kind.sampler(source, stored, touches, first)
    result = yield from sample_sequentially(samples, first, range(count), source.sampling)
    samples.require_made(result)
    return result


def retake_on_surface(
    source: SurfaceTouchSource[SurveyT, ResultT],
    kind: SurfaceKind[SurveyT, ResultT],
    stored: ToolOffset,
    *,
    here: Pose,
    taken: Sequence[TouchedAt],
    again: int,
) -> Procedure[ResultT]:
    """Repeat one touch of :func:`measure_surface`. Runs in Tool 0, ends as it does.

    Args:
        source: What was measured, and how.
        kind: What the surface is.
        stored: The offset stored now.
        here: Where the flange is.
        taken: The touches of the measurement.
        again: Index of the one that is made again.

    Raises:
        CalibrationError: As the measurement.
    """
    touches = SurfaceTouches(source.touch, total=len(taken), retakes=True)
    samples = kind.sampler(source, stored, touches, taken[0])
    samples.adopt(taken)
    above = samples.over.pose(UPRIGHT, source.touch.lift_mm)
    yield from approach_path(above, here=here, purpose=tr("Moving over the surface."))
    result = yield from resume_samples(samples, range(len(taken)), taken, again)
    samples.require_made(result)
    return result
