"""How long the movements of an EPSON robot take, in Power Low.

Source: docs/reference/epson-robots.md, "Joint speeds"; docs/reference/spel.md 6.3 and 7.2.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.controllers.epson.arms.joints import joint_deltas
from robolink.controllers.epson.arms.models import ArmModel, arm_of
from robolink.controllers.movement_time import AnswerCounts, JointRates, Way, ramped_s
from robolink.errors import RejectedError
from robolink.model import Path
from robolink.protocols import spel

if TYPE_CHECKING:
    from robolink.controllers.epson.link import EpsonLink

LOW_POWER_MM_S: Final = 250.0
"""Highest speed of the tip in Power Low, in mm/s (docs/reference/spel.md 7.2)."""

LOW_POWER_PERCENT: Final = 5
"""Highest Speed in Power Low, in percent: its default, by the samples of the language reference
(docs/reference/spel.md 6.3)."""

LOW_POWER_ACCEL_PERCENT: Final = 10
"""Highest Accel in Power Low, in percent: its default, as a real controller printed it
(docs/reference/spel_statements.md)."""

_PERCENT: Final = 100.0
_SCARA_JOINTS: Final = 4


@dataclass(frozen=True, slots=True)
class EpsonTimes:
    """Implements :class:`robolink.controllers.MovementTimes`.

    Attributes:
        accel_s_mm_s2: AccelS as it will be: acceleration and deceleration of straight movements.
        accel_percent: Accel as it is set: the same of joint movements.
        speed_factor_percent: SpeedFactor.
        arm: The robot's arm, ``None`` where its figures are not known.
    """

    accel_s_mm_s2: tuple[float, float]
    accel_percent: tuple[float, float]
    speed_factor_percent: float
    arm: ArmModel | None

    @property
    def answers(self) -> AnswerCounts:
        """For how many answers each is waited for: one look before, the start, one look after."""
        return AnswerCounts(run=30.0, tool=20.0, select=4.0, move=3.5, search=5.0)

    def move_s(self, way: Way) -> float | None:
        """Return the seconds of a movement; see :class:`robolink.controllers.MovementTimes`."""
        if way.profile.path is Path.STRAIGHT:
            return self._straight_s(way)
        arm = self.arm
        deltas = None if arm is None else joint_deltas(arm, way.start, way.end)
        if arm is None or deltas is None:
            return None
        factor = self.speed_factor_percent / _PERCENT
        percent = min(way.profile.speed_percent, LOW_POWER_PERCENT)
        accel = min(*self.accel_percent, LOW_POWER_ACCEL_PERCENT)
        return arm.rates.takes_s(
            deltas,
            percent * factor / _PERCENT,
            accel * factor / _PERCENT,
            way.length_mm / LOW_POWER_MM_S,
        )

    def search_s(self, way: Way) -> float | None:
        """Return those of one that an input ends; it brakes as any other."""
        return self._straight_s(way)

    def _straight_s(self, way: Way) -> float | None:
        if not way.length_mm and way.turn_deg:
            return None  # that goes by SpeedR, which robolink neither reads nor sets
        factor = self.speed_factor_percent / _PERCENT
        speed = min(way.profile.speed_mm_s, LOW_POWER_MM_S) * factor
        if self.arm is not None and len(self.arm.rates.speeds) == _SCARA_JOINTS and way.turn_deg:
            speed = min(speed, way.length_mm * self.arm.rates.speeds[-1] / way.turn_deg)
        rise, fall = (each * factor for each in self.accel_s_mm_s2)
        return ramped_s(way.length_mm, speed, rise, fall) if math.isfinite(speed) else None


def read_times(
    link: "EpsonLink", accel_s_mm_s2: tuple[float, float], stated: JointRates | None
) -> EpsonTimes:
    """Read what tells how long the movements of the current robot will take.

    Args:
        link: The controller.
        accel_s_mm_s2: AccelS as it will be.
        stated: How fast the joints are at Speed 100 and Accel 100, where a person wrote it down.
    """
    window = link.window
    accel = spel.print_accel(1), spel.print_accel(2)
    try:
        rise, fall, factor = map(
            spel.parse_number, window.printed_numbers(*accel, spel.print_speed_factor())
        )
    except RejectedError:  # firmware that has no SpeedFactor
        rise, fall = map(spel.parse_number, window.printed_numbers(*accel))
        factor = _PERCENT
    model = link.model()
    arm = None if model is None else arm_of(model, stated)
    return EpsonTimes(accel_s_mm_s2, (rise, fall), factor, arm)
