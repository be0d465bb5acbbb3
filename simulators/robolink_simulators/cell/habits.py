"""The mistakes of a person at a simulated cell, touch by touch.

Assumed, all of it: these are habits that people have, and nothing was measured.
"""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from robolink_simulators.cell.places import Direction, XyzMm

BiasFrame = Literal["base", "tool", "approach"]
"""The frame in which the constant error of a one-sided touch is fixed: the base, the tool flange,
or the direction of approach.
"""


@dataclass(frozen=True, slots=True)
class PersonHabits:
    """One person.

    Attributes:
        stays_share: Share of the touches for which they press ENTER and do not jog.
        stays_from_touch: The first touch to which that share applies, counted from 1.
        bias_mm: How far beside the pin they always stop.
        bias_frame: In what that side is fixed; ``approach`` is short of the pin, on the side from
            which the tip came.
        bias_toward_deg: That side, counted from X of the base or of the flange.
        tires_mm: Step, per axis X and Y, of a random walk of their aim: one step from touch to
            touch.
        angle_error_deg: By how much they turn U, to either side, before they touch.
        presses_mm: How much deeper than the contact they go; the needle gives way.
        types_ahead: They press ENTER before they are asked, and look when they are asked again.
        thinks_s: How long they look before they answer.
    """

    stays_share: float = 0.0
    stays_from_touch: int = 1
    bias_mm: float = 0.0
    bias_frame: BiasFrame = "base"
    bias_toward_deg: float = 0.0
    tires_mm: float = 0.0
    angle_error_deg: float = 0.0
    presses_mm: float = 0.0
    types_ahead: bool = False
    thinks_s: float = 1.0


@dataclass(frozen=True, slots=True)
class PinBump:
    """A pin that is bumped between two touches.

    Attributes:
        after_touch: After which one, counted from 1.
        mm: How far it moves.
        toward_deg: In which direction of the base.
    """

    after_touch: int = 2
    mm: float = 0.0
    toward_deg: float = 0.0

    @property
    def by_mm(self) -> tuple[float, float]:
        """How far it moves along X and Y."""
        toward = math.radians(self.toward_deg)
        return self.mm * math.cos(toward), self.mm * math.sin(toward)


@dataclass(frozen=True, slots=True)
class PersonManner:
    """How a person handles one question.

    Attributes:
        thinks_s: Seconds, of the clock by which they are asked, before the first answer.
        touch: The number of the touch that is asked for, 0 for any other question.
        stays: They press ENTER and do not jog.
        turn_deg: By how much they turn U first.
    """

    thinks_s: float = 0.0
    touch: int = 0
    stays: bool = False
    turn_deg: float = 0.0


class TouchCourse:
    """The touches of one person, since these habits were set.

    Args:
        habits: Theirs.
        rng: Source of what is drawn.

    Attributes:
        touches: How many touches have begun.
    """

    def __init__(self, habits: PersonHabits, rng: random.Random) -> None:
        self.touches = 0
        self._habits = habits
        self._random = rng
        self._walked_mm = (0.0, 0.0)
        self._came_from: Direction = (0.0, 0.0, 0.0)

    def begin(self, gap_mm: XyzMm, *, asked: bool) -> PersonManner:
        """Begin the next touch, and return how it is made.

        Args:
            gap_mm: From the tip to the pin.
            asked: Whether somebody asks for it, so that it can be answered ahead.
        """
        habits, rng = self._habits, self._random
        self.touches += 1
        if self.touches > 1 and habits.tires_mm:
            x_mm, y_mm = (at + rng.gauss(0.0, habits.tires_mm) for at in self._walked_mm)
            self._walked_mm = (x_mm, y_mm)
        away_mm = math.hypot(gap_mm[0], gap_mm[1])
        if away_mm:
            self._came_from = (-gap_mm[0] / away_mm, -gap_mm[1] / away_mm, 0.0)
        if asked and habits.types_ahead:
            return PersonManner(touch=self.touches, stays=True)
        turn_deg = habits.angle_error_deg * rng.choice((-1, 1)) if habits.angle_error_deg else 0.0
        return self._taken(turn_deg)

    def resume(self) -> PersonManner:
        """Repeat the same touch, because it was asked for again."""
        return self._taken(0.0)

    def aim_mm(self, turned: Callable[[Direction], Direction]) -> XyzMm:
        """Return where the tip ends beside the pin: base axes, mm.

        Args:
            turned: Tells how a direction on the flange lies in the base now.
        """
        habits = self._habits
        toward = math.radians(habits.bias_toward_deg)
        along, across = math.cos(toward), math.sin(toward)
        side: Direction = (along, across, 0.0)
        if habits.bias_frame == "approach":
            side = self._came_from
        elif habits.bias_frame == "tool":
            side = turned(side)
        return (
            habits.bias_mm * side[0] + self._walked_mm[0],
            habits.bias_mm * side[1] + self._walked_mm[1],
            habits.bias_mm * side[2] - habits.presses_mm,
        )

    def _taken(self, turn_deg: float) -> PersonManner:
        habits = self._habits
        stays = self.touches >= habits.stays_from_touch and (
            self._random.random() < habits.stays_share
        )
        return PersonManner(habits.thinks_s, self.touches, stays, 0.0 if stays else turn_deg)
