"""Touches by a person from where the robot stopped, and whether each was made.

A touch counts when something was done since the robot stopped: the tip was jogged, or a contact
input switched (docs/reference/evidence.md 1). Another try is asked for, then it is refused.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink import runtime
from robolink.calibration import PERSON_SIGMA_Z_MM, PROBE_SIGMA_Z_MM
from robolink.errors import CalibrationError
from robolink.messages import joined, tr
from robolink.model import InputEdge, Pose
from robolink.runner import (
    AngleShown,
    Ask,
    Move,
    Notify,
    NotYet,
    Procedure,
    TouchedAt,
    TouchSubject,
)

if TYPE_CHECKING:
    from robolink.calibration import WitnessedTouch


_SEED_BITS: Final = 48


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """How a tip is lifted off the pin and returned.

    Attributes:
        lift_mm: How far the tip is lifted before anything turns.
        clearance_mm: Least height above the expected contact to which it comes down again; up to
            ``HIGHEST_MM`` more is drawn.
        turn_deg: By how much U differs between the two poses.
        contact: The input that shows contact, ``None`` where a person's eye does.
        sigma_z_mm: Standard deviation of a touch in height, ``None`` for what is usual.
        seed: From which the standoffs are drawn, ``None`` for a new one in each run.
        nominal: Whether it is only looked at: the highest standoffs, nothing drawn or judged.
    """

    lift_mm: float = 10.0
    clearance_mm: float = 2.0
    turn_deg: float = 180.0
    contact: InputEdge | None = None
    sigma_z_mm: float | None = None
    seed: int | None = None
    nominal: bool = False

    @property
    def sigma_in_height_mm(self) -> float:
        """Standard deviation of a touch in height, stated or usual."""
        usual_mm = PERSON_SIGMA_Z_MM if self.contact is None else PROBE_SIGMA_Z_MM
        return self.sigma_z_mm or usual_mm


def fresh_seed() -> int:
    """Return the seed of a run: nobody can predict the standoffs."""
    return runtime.random_number(_SEED_BITS)


def plain_pose(pose: Pose) -> Pose:
    """Return a pose without how it was taken."""
    return Pose(*pose.coordinates(), pose.hand, pose.local, pose.tool, pose.posture)


TOUCH_CODES: Final = (
    "not_touched",
    "typed_ahead",
    "touch_heights_differ",
    "touch_not_proven",
    "coarse_step",
    "still_moving",
    "old_reading",
    "turned_too_little",
    "not_upright",
    "mixed_tool",
    "tip_did_not_move",
    "camera_changed",
    "spot_changed",
    "stale_picture",
)
"""Reasons why touches or looks do not count, in a measurement and in a turn test."""


def was_jogged(touch: TouchedAt) -> bool:
    """Return whether a person jogged from where the robot had stopped."""
    return witnessed_by(touch).made(_PRINTED_MM)


def jog_mm(touch: TouchedAt) -> float | None:
    """Return how far that was; ``None`` without an arrival."""
    if touch.arrival is None:
        return None
    return math.dist(touch.coordinates()[:3], touch.arrival.coordinates()[:3])


def require_touches(touches: Sequence[TouchedAt], *, sigma_z_mm: float) -> None:
    """Refuse touches of one pin that were not made (docs/reference/evidence.md 1).

    Args:
        touches: All that count.
        sigma_z_mm: Standard deviation of a touch in height.

    Raises:
        CalibrationError: ``not_touched``, ``touch_heights_differ``, ``touch_not_proven``,
            ``large_residual``.
    """
    from robolink.calibration import judge_touches  # numpy, imported only when used

    evidence = judge_touches([witnessed_by(touch) for touch in touches], sigma_z_mm=sigma_z_mm)
    if code := evidence.most_telling:
        raise _refusal(code, evidence.z_range_mm, evidence.max_residual_mm)


def heights_agree(heights_mm: Sequence[float], sigma_z_mm: float) -> bool:
    """Return whether heights of a tip on one pin differ by no more than touches scatter."""
    from robolink.calibration import height_limit_mm  # numpy, imported only when used

    limit_mm = height_limit_mm(len(heights_mm), sigma_z_mm)
    return max(heights_mm) - min(heights_mm) <= limit_mm


def require_one_height(heights_mm: Sequence[float], *, sigma_z_mm: float) -> None:
    """Refuse heights of an upright flange that were not all taken on one pin.

    Raises:
        CalibrationError: ``touch_heights_differ``.
    """
    if len(heights_mm) > 1 and not heights_agree(heights_mm, sigma_z_mm):
        range_mm = max(heights_mm) - min(heights_mm)
        raise _refusal("touch_heights_differ", range_mm, None)


_PRINTED_MM: Final = 0.001
"""Coarsest step of printed positions, in mm; a finer one changes nothing."""


def witnessed_by(touch: TouchedAt) -> "WitnessedTouch":
    """Return a touch as the mathematics needs it."""
    from robolink.calibration import Standoff, WitnessedTouch  # numpy

    return WitnessedTouch(
        touch,
        touch.arrival,
        Standoff(*touch.standoff_mm),
        touch.seconds,
        contact=touch.contact is True,
    )


def _refusal(code: str, range_mm: float | None, residual_mm: float | None) -> CalibrationError:
    whats = {
        "touch_heights_differ": tr(
            "Heights differ by {spread:.2f} mm on one pin: at least one touch was in the air.",
            spread=range_mm or 0.0,
        ),
        "touch_not_proven": tr(
            "At least one touch was not made: the tip stayed where the robot had stopped "
            "beside the pin."
        ),
        "large_residual": tr(
            "One touch is {residual:.3f} mm off the others: the tip was not on the pin, or "
            "the pin moved.",
            residual=residual_mm or 0.0,
        ),
    }
    return CalibrationError(
        code,
        whats.get(code, tr("A touch was not made.")),
        remedy=tr("Nothing was written. Check that the pin is tight, then touch it each time."),
    )


MOST_ASKED: Final = 3
"""How often a person is asked for a touch before the refusal ends the measurement."""


def you_touch() -> str:
    """Return the next step after the robot stopped beside what is touched."""
    return tr("You jog the tip into contact.")


class WitnessedTouches(ABC):
    """The touches of one thing in one measurement or one turn test.

    Args:
        plan: Lift, clearance, contact input.
        total: How many touches are planned, ``None`` where nobody knows.
        limit_mm: Largest drift that passes where they are those of a proof, else ``None``.
        retakes: Whether whoever makes them hears of one that is to be made again, alone.
    """

    def __init__(
        self,
        plan: TouchPlan,
        *,
        total: int | None = None,
        limit_mm: float | None = None,
        retakes: bool = False,
    ) -> None:
        self._plan = plan
        self._total = total
        self._limit_mm = limit_mm
        self._retakes = retakes
        self._taken: dict[Hashable, TouchedAt] = {}
        self._numbers: dict[Hashable, int] = {}
        self._number = 0
        self._earlier: tuple[AngleShown, ...] = ()
        self._seed: int | None = None

    def shown(self, instruction: str, *, key: Hashable = None) -> Procedure[TouchedAt]:
        """Let the person move the tip into contact from wherever it is, and lift off.

        Nothing witnesses such a touch but those that follow.

        Args:
            instruction: What the person is to do.
            key: By which a later touch takes the place of this one; ``None`` for its U.
        """
        self._number = self._count()
        answer: Pose = yield Ask(
            instruction, contact=self._plan.contact, subject=self._subject(None)
        )
        touch = TouchedAt.of(answer)
        yield self.off(touch)
        key = touch.u_deg if key is None else key
        self._numbers[key] = self._number
        self._taken[key] = touch
        return touch

    def touched(
        self,
        expected: Pose,
        arrival: Pose,
        standoff_mm: tuple[float, float, float],
        *,
        key: Hashable,
        instruction: str,
    ) -> Procedure[TouchedAt]:
        """Let the person touch from where the robot stopped; nothing is lifted yet.

        Args:
            expected: Pose with the tip in contact, as far as it is known.
            arrival: Where the robot stopped.
            standoff_mm: How far from there that is.
            key: By which a later touch takes the place of this one.
            instruction: What the person is to do.

        Raises:
            CalibrationError: ``not_touched`` or ``typed_ahead``, with the tip drawn back.
        """
        self._number = self._numbers.setdefault(key, self._count())
        ask = Ask(
            instruction,
            foreseen=expected,
            contact=self._plan.contact,
            subject=self._subject(arrival),
            judge=None if self._plan.nominal else lambda touch: self._not_yet(touch, arrival),
        )
        for left in reversed(range(MOST_ASKED)):
            touch = yield from self._answered(ask, arrival, standoff_mm)
            if self._plan.nominal or touch.typed or self._made(touch):
                self._taken[key] = touch
                return touch
            told, how = self._not_made(touch)
            if left:
                yield Notify(joined(" ", filter(None, (told, how))))
        yield self.off(touch)
        raise CalibrationError("not_touched", told, remedy=how or self._how_to_make())

    def adopt(self, touches: Mapping[Hashable, TouchedAt]) -> None:
        """Take over the touches of a measurement that is continued.

        Args:
            touches: By the keys by which later ones take their places, in their order.
        """
        self._taken = dict(touches)
        self._numbers = {key: number for number, key in enumerate(touches, start=1)}

    def tell_of(self, earlier: tuple[AngleShown, ...]) -> None:
        """Show with the next requests what the touches of a turn test have shown so far."""
        self._earlier = earlier

    @property
    def plan(self) -> TouchPlan:
        """Lift, clearance, contact input."""
        return self._plan

    def _subject(self, arrival: Pose | None) -> TouchSubject:
        """Return what a screen shows of the requested touch."""
        first = self._by_number.get(1)
        total = self._total
        return TouchSubject(
            number=self._number,
            total=None if total is None else max(total, self._number),
            arrival=arrival,
            first_z_mm=first.z_mm if first is not None and self._compares_heights else None,
            contact=self._plan.contact,
            limit_mm=self._limit_mm,
            retakes=self._retakes,
            types=self._may_be_typed,
            earlier=self._earlier,
        )

    @property
    def _by_number(self) -> dict[int, TouchedAt]:
        """The touches that count, by the numbers that a person knows them by."""
        numbered = {self._numbers[key]: touch for key, touch in self._taken.items()}
        return dict(sorted(numbered.items()))

    def _count(self) -> int:
        """Return the number, from 1, of the next touch that is not a repeat."""
        return max(self._numbers.values(), default=0) + 1

    @property
    def _may_be_typed(self) -> bool:
        """Whether the pose of one may be typed instead of read."""
        return False

    @property
    def _compares_heights(self) -> bool:
        """Whether the heights of the touches show something by themselves."""
        return False

    def _not_yet(self, touch: TouchedAt, arrival: Pose) -> NotYet | None:
        """Return why a touch does not yet count, while the tip is still there."""
        if arrival.tool is None or touch.tool == arrival.tool:
            return None
        return NotYet(
            "mixed_tool",
            tr(
                "Somebody selected tool {n}. Touch 1 was made with tool {tool}.",
                n=touch.tool,
                tool=arrival.tool,
            ),
        )

    def _drawn_from(self) -> int:
        """Return the source of the random standoffs; the recorded touches name it."""
        self._seed = fresh_seed() if self._plan.seed is None else self._plan.seed
        return self._seed

    @abstractmethod
    def off(self, touch: Pose) -> Move:
        """Return the step that lifts the tip out of contact."""

    @abstractmethod
    def _not_jogged(self, away_mm: float) -> str:
        """Return that the robot is where it stopped, so far from contact."""

    @abstractmethod
    def _how_to_make(self) -> str:
        """Return what a person has to do whose touches do not count."""

    def _answered(
        self, ask: Ask, arrival: Pose, standoff_mm: tuple[float, float, float]
    ) -> Procedure[TouchedAt]:
        try:
            answer: Pose = yield ask
        except CalibrationError:
            yield self.off(arrival)
            raise
        touch = TouchedAt.of(answer)
        if touch.typed:  # nothing shows that the standoff was jogged away
            return replace(touch, seed=self._seed)
        return replace(touch, seed=self._seed, arrival=arrival, standoff_mm=standoff_mm)

    def _made(self, touch: TouchedAt) -> bool:
        if self._plan.contact is not None:
            return touch.contact is True
        return was_jogged(touch)

    def _not_made(self, touch: TouchedAt) -> tuple[str, str]:
        """Return what happened, and what to do where a contact input shows it."""
        if self._plan.contact is None:
            return self._not_jogged(math.hypot(*touch.standoff_mm)), ""
        told = tr(
            "Touch {number} was not made: input {input} did not go over to contact since the "
            "robot stopped.",
            number=self._number,
            input=self._plan.contact.number,
        )
        how = tr("Jog until it does; if it shows contact all the time, look at its wiring.")
        return told, how
