"""Speeds, accelerations and LimZ, their defaults and their values in low power."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from robolink_simulators.epson.arm.trajectory import JointPace, LinePace

LOW_POWER_TIP_MM_S: Final = 250.0
"""Limit of the tip speed in low power, in mm/s (docs/reference/spel.md 7.2, docs/reference/epson.md
3.4).
"""


HIGHEST_SPEED_S: Final = 2000.0
"""Highest SpeedS in mm/s (docs/reference/spel.md 7.2)."""


class MotionPhase(IntEnum):
    """Which part of a Jump a leg belongs to; everything else is travel."""

    TRAVEL = 0
    DEPART = 1
    APPROACH = 2


@dataclass(slots=True)
class MotionParameters:
    """What Speed, Accel, SpeedS, AccelS, SpeedR, AccelR and LimZ set.

    The defaults are "per model (low)" in the reference, 5 % in its samples
    (docs/reference/spel.md 6.3); the other numbers are assumed. Triples and pairs run travel,
    depart, approach.

    Attributes:
        speed: Speed in percent.
        accel: Accel in percent: acceleration and deceleration of each phase.
        speed_s: SpeedS in mm/s.
        accel_s: AccelS in mm/s2, arranged as ``accel``.
        speed_r: SpeedR in degrees/s.
        accel_r: AccelR in degrees/s2.
        limz_mm: LimZ, height of joint 3 above which no Jump rises.
    """

    speed: tuple[int, int, int] = (5, 5, 5)
    accel: tuple[int, int, int, int, int, int] = (10, 10, 10, 10, 10, 10)
    speed_s: tuple[float, float, float] = (50.0, 50.0, 50.0)
    accel_s: tuple[float, float, float, float, float, float] = (200.0,) * 6
    speed_r: float = 50.0
    accel_r: float = 200.0
    limz_mm: float = 0.0

    def joint_pace(self, *, power_high: bool, phase: MotionPhase = MotionPhase.TRAVEL) -> JointPace:
        """Return the pace of a joint-space leg.

        In low power the values may be set but are held to the defaults (documented,
        docs/reference/spel.md 7.2), and the tip to 250 mm/s.
        """
        used = self if power_high else self._held_to_defaults()
        accel, decel = used.accel[2 * phase : 2 * phase + 2]
        limit = None if power_high else LOW_POWER_TIP_MM_S
        return JointPace(used.speed[phase], accel, decel, limit)

    def line_pace(self, *, power_high: bool) -> LinePace:
        """Return the pace of a straight leg.

        SpeedS set by the user counts up to 250 mm/s in low power (documented limit); that the
        default does not hold it lower is assumed, since the default is per model.
        """
        speed = self.speed_s[0] if power_high else min(self.speed_s[0], LOW_POWER_TIP_MM_S)
        return LinePace(speed, self.accel_s[0], self.accel_s[1], self.speed_r, self.accel_r)

    def _held_to_defaults(self) -> "MotionParameters":
        standard = MotionParameters()
        s1, s2, s3 = (min(a, b) for a, b in zip(self.speed, standard.speed, strict=True))
        a1, a2, a3, a4, a5, a6 = (
            min(a, b) for a, b in zip(self.accel, standard.accel, strict=True)
        )
        return MotionParameters(speed=(s1, s2, s3), accel=(a1, a2, a3, a4, a5, a6))
