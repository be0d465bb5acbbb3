"""How long a movement takes, from its way and from how fast what moves it may be.

Each kind of controller says it of its own movements (``movement_times`` of its group); the rule by
which a way becomes a time stands here once: the speed rises evenly, stays, and falls evenly.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from robolink.model import MotionProfile, Pose

_STILL: Final = 1e-6
"""Smallest way that takes any time, in mm and degrees."""


@dataclass(frozen=True, slots=True)
class JointRates:
    """How fast the joints of an arm, or the axes of a machine, may be.

    Attributes:
        speeds: Highest speed of each: degrees/s, mm/s of a linear one.
        accelerations: Highest acceleration of each: degrees/s2, mm/s2 of a linear one.
    """

    speeds: tuple[float, ...]
    accelerations: tuple[float, ...]

    def takes_s(
        self,
        deltas: Sequence[float],
        speed_share: float,
        acceleration_share: float,
        least_s: float = 0.0,
    ) -> float | None:
        """Return how long joints take that start and stop together.

        Args:
            deltas: By how much each moves.
            speed_share: Of the highest speeds, above 0.
            acceleration_share: Of the highest accelerations, above 0.
            least_s: How long the way takes at least without the time to speed up and brake, because
                the tip may not be faster.

        Returns:
            ``None`` where the values are those of another number of joints.

        Example:
            >>> from robolink.controllers import JointRates
            >>> rates = JointRates((100, 200), (500, 1000))
            >>> round(rates.takes_s((50, 20), speed_share=0.5, acceleration_share=0.5), 3)
            1.2
        """
        if not len(deltas) == len(self.speeds) == len(self.accelerations):
            return None
        moved = [
            (abs(delta), speed, acceleration)
            for delta, speed, acceleration in zip(
                deltas, self.speeds, self.accelerations, strict=True
            )
            if abs(delta) > _STILL
        ]
        if not moved:
            return 0.0
        cruise_s = max(delta / (speed * speed_share) for delta, speed, _ in moved)
        rate = 1 / max(cruise_s, least_s)
        ramp = min(each * acceleration_share / delta for delta, _, each in moved)
        return ramped_s(1.0, rate, ramp, ramp)


def ramped_s(length: float, speed: float, rise: float, fall: float) -> float:
    """Return how long a way takes from rest to rest.

    Args:
        length: Of the way.
        speed: The highest on it, per s.
        rise: Acceleration, per s2.
        fall: Deceleration, per s2.

    Example:
        >>> from robolink.controllers.movement_time import ramped_s
        >>> ramped_s(100, 50, 100, 100), ramped_s(1, 50, 100, 100)
        (2.5, 0.2)
    """
    if length <= _STILL:
        return 0.0
    slack = 1 / rise + 1 / fall
    peak = min(speed, math.sqrt(2 * length / slack))
    return length / peak + peak * slack / 2


@dataclass(frozen=True, slots=True)
class Way:
    """The way of a movement.

    Attributes:
        length_mm, turn_deg: How far the frame goes that moves, and by how much it turns.
        start, end: Where the flange is before and after.
        profile: How it goes, and how fast.
    """

    length_mm: float
    turn_deg: float
    start: Pose
    end: Pose
    profile: MotionProfile


@dataclass(frozen=True, slots=True)
class AnswerCounts:
    """For how many answers of the controller is waited; the requests are those of the driver.

    Attributes:
        run: In a run, whatever it does, with what is selected and put back.
        tool: For each tool that is measured, written and read back.
        select: When another tool is selected.
        move: With a movement: what is read before it, its start, and what is read after it.
        search: With a movement that an input ends.
    """

    run: float
    tool: float
    select: float
    move: float
    search: float


class MovementTimes(Protocol):
    """How long the movements of a group take, as far as its controller, or the cell, tells it."""

    @property
    def answers(self) -> AnswerCounts:
        """For how many answers each is waited for."""

    def move_s(self, way: Way) -> float | None:
        """Return the seconds of a movement; ``None`` where nobody knows.

        Args:
            way: Its way.
        """

    def search_s(self, way: Way) -> float | None:
        """Return those of one that an input ends.

        Args:
            way: Its way, to where it stops behind the edge.
        """
