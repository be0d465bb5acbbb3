"""The drives of an axis group: their limits, power, state and single movements."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from robolink.model import AxisKind
from robolink.timing import NS_PER_S
from robolink_simulators.softmotion.group.profile import Pace, SpeedProfile
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_ROUNDING = 1e-9
_STILL = 1e-9


class AxisState(IntEnum):
    """``SMC_AXIS_STATE`` (documented, docs/reference/softmotion.md 2.1)."""

    POWER_OFF = 0
    ERRORSTOP = 1
    STOPPING = 2
    STANDSTILL = 3
    DISCRETE_MOTION = 4
    CONTINUOUS_MOTION = 5
    SYNCHRONIZED_MOTION = 6
    HOMING = 7


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """What a drive may do: degrees of a rotary axis, mm of a linear one.

    Attributes:
        low: Lower software limit.
        high: Upper software limit.
        velocity_per_s: Top velocity.
        acceleration_per_s2: Top acceleration, and deceleration.
    """

    low: float
    high: float
    velocity_per_s: float
    acceleration_per_s2: float

    def holds(self, value: float) -> bool:
        """Return whether a value lies inside; 1e-9 absorbs the arithmetic of a round trip."""
        return self.low - _ROUNDING <= value <= self.high + _ROUNDING


ASSUMED_LIMITS: Final = {
    AxisKind.ROTARY: AxisLimits(-170.0, 170.0, 360.0, 1800.0),
    AxisKind.LINEAR: AxisLimits(-300.0, 300.0, 500.0, 5000.0),
}
"""Default limits of a drive by kind of axis (assumed: each machine has its own)."""


@dataclass(frozen=True, slots=True)
class _Travel:
    start_ns: int
    origin: float
    target: float
    profile: SpeedProfile

    @property
    def end_ns(self) -> int:
        return self.start_ns + round(self.profile.duration_s * NS_PER_S)

    def value_at(self, now_ns: int) -> float:
        share = self.profile.share_at((now_ns - self.start_ns) / NS_PER_S)
        return self.origin + (self.target - self.origin) * share


class Axis:
    """One drive.

    Args:
        number: Its place in the group, from 0.
        kind: How it moves.
        limits: What it may do.

    Attributes:
        powered: Whether the drive has power.
        failed: Whether it is in error, until a reset; power off and on does not help.
        play: Behind the encoder: the true axis trails :attr:`value` by half of it, against the
            way it last went (assumed model).
    """

    def __init__(self, number: int, kind: AxisKind, limits: AxisLimits) -> None:
        self.number = number
        self.kind = kind
        self.limits = limits
        self.play = 0.0
        self._value = 0.0
        self._way = 0.0
        self.powered = False
        self.failed = False
        self._coupled = AxisState.STANDSTILL
        self._travel: _Travel | None = None

    @property
    def value(self) -> float:
        """Where it is by its encoder: degrees or mm."""
        return self._value

    @value.setter
    def value(self, value: float) -> None:
        if abs(value - self._value) > _STILL:
            self._way = math.copysign(1.0, value - self._value)
        self._value = value

    def trailing(self, value: float) -> float:
        """Return where the true axis is, with the encoder at ``value``, by its last direction."""
        return value - self.play / 2 * self._way

    @property
    def state(self) -> AxisState:
        """The state, as ``MC_ReadStatus`` of the axis shows it."""
        if not self.powered:
            return AxisState.POWER_OFF
        if self.failed:
            return AxisState.ERRORSTOP
        return AxisState.DISCRETE_MOTION if self.moving_alone else self._coupled

    @property
    def moving_alone(self) -> bool:
        """Whether a single movement is in progress."""
        return self._travel is not None

    def switch(self, on: bool) -> None:
        """Switch the power, as ``MC_Power``; a single movement ends where it is."""
        if on != self.powered:
            self.halt()
            self.powered = on

    def start_alone(self, target: float, now_ns: int) -> None:
        """Begin a single movement at top velocity, as ``MC_MoveAbsolute``.

        Raises:
            Refused: No power, an error, or the target lies outside the limits.
        """
        if not self.powered:
            raise BlockRefused(ErrorKind.NO_POWER, f"Axis {self.number} has no power")
        if self.failed:
            raise BlockRefused(ErrorKind.AXIS_ERROR, f"Axis {self.number} is in error")
        self.require_inside(target)
        distance = max(abs(target - self.value), _STILL)
        ramp = self.limits.acceleration_per_s2 / distance
        pace = Pace(self.limits.velocity_per_s / distance, ramp, ramp)
        self._travel = _Travel(now_ns, self.value, target, SpeedProfile.fastest(0.0, pace))

    def require_inside(self, value: float) -> None:
        """Refuse a value outside the software limits.

        Raises:
            Refused: Names the axis, the value and the limits.
        """
        if not self.limits.holds(value):
            raise BlockRefused(
                ErrorKind.AXIS_LIMIT,
                f"Axis {self.number} outside its limits: {value:.3f}, "
                f"allowed {self.limits.low:.3f} to {self.limits.high:.3f}",
            )

    def advance(self, now_ns: int) -> None:
        """Let a single movement reach ``now_ns``."""
        if self._travel is None:
            return
        self.value = self._travel.value_at(now_ns)
        if now_ns >= self._travel.end_ns:
            self.value = self._travel.target
            self._travel = None

    def next_change(self) -> int | None:
        """Return when a single movement ends."""
        return None if self._travel is None else self._travel.end_ns

    def couple(self) -> None:
        """Show that the group moves the axis."""
        self._coupled = AxisState.SYNCHRONIZED_MOTION

    def free(self) -> None:
        """Show that the group releases the axis."""
        self._coupled = AxisState.STANDSTILL

    def fail(self) -> None:
        """Stop where the axis is, in error."""
        self.halt()
        self.failed = True

    def halt(self) -> None:
        """End a single movement where the axis is."""
        self._travel = None
