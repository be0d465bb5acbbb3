"""How far along its path a movement is: phases of even acceleration.

The time law is ours (assumed): a trapezoid of speed. SoftMotion also limits the jerk and so
rounds the corners; nothing here depends on that.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Self

_STILL = 1e-12
_ARRIVED = 1e-9


class Phase(NamedTuple):
    """A stretch of time with one acceleration, in shares of the path."""

    duration_s: float
    acceleration_per_s2: float


class Pace(NamedTuple):
    """The limits of a profile, in shares of the path."""

    rate_per_s: float
    rise_per_s2: float
    fall_per_s2: float


@dataclass(frozen=True, slots=True)
class SpeedProfile:
    """The share of a path, 0 to 1, as a function of time.

    Attributes:
        start: Share at time 0, at rest.
        phases: What follows; at rest afterwards.
        end: Share at rest.
        duration_s: How long it takes to come to rest.
        falls_after_s: When it begins to slow down for the last time.
    """

    start: float
    phases: tuple[Phase, ...]
    end: float
    duration_s: float = field(init=False, compare=False)
    falls_after_s: float = field(init=False, compare=False)

    def __post_init__(self) -> None:
        # Calculated once, because every cycle of the motion task reads it.
        object.__setattr__(self, "duration_s", sum(phase.duration_s for phase in self.phases))
        falls_after_s = sum(phase.duration_s for phase in self.phases[:-1])
        object.__setattr__(self, "falls_after_s", falls_after_s)

    @classmethod
    def fastest(cls, start: float, pace: Pace | None) -> Self:
        """Return the quickest profile from rest at ``start`` to rest at 1.

        No pace means that there is no way to go.
        """
        left = 1.0 - start
        if pace is None or left < _STILL:
            return cls(1.0, (), 1.0)
        slack = 1 / pace.rise_per_s2 + 1 / pace.fall_per_s2
        peak = min(pace.rate_per_s, math.sqrt(2 * left / slack))
        cruise_s = max(0.0, left - peak * peak * slack / 2) / peak
        phases = (
            Phase(peak / pace.rise_per_s2, pace.rise_per_s2),
            Phase(cruise_s, 0.0),
            Phase(peak / pace.fall_per_s2, -pace.fall_per_s2),
        )
        return cls(start, phases, 1.0)

    def share_at(self, time_s: float) -> float:
        """Return the share of the path covered by then."""
        if time_s >= self.duration_s:
            return self.end
        share = self.start
        for passed_s, rate, phase in self._until(time_s):
            share += rate * passed_s + phase.acceleration_per_s2 * passed_s * passed_s / 2
        return min(share, 1.0)

    def rate_at(self, time_s: float) -> float:
        """Return how fast it is then, in shares a second."""
        if time_s >= self.duration_s:
            return 0.0
        final = 0.0
        for passed_s, rate, phase in self._until(time_s):
            final = rate + phase.acceleration_per_s2 * passed_s
        return max(0.0, final)

    def braked(self, time_s: float, fall_per_s2: float) -> Self:
        """Return this profile up to ``time_s``, stopping after that.

        Slows down harder than asked where the path would end first, as MC_GroupStop may
        (documented, docs/reference/softmotion.md 2.3).
        """
        if time_s >= self.duration_s:
            return self
        rate, share = self.rate_at(time_s), self.share_at(time_s)
        if rate < _STILL:
            return replace(self, phases=(), end=share)
        fall = max(fall_per_s2, rate * rate / (2 * max(1.0 - share, _STILL)))
        kept = tuple(
            Phase(passed_s, phase.acceleration_per_s2) for passed_s, _, phase in self._until(time_s)
        )
        end = share + rate * rate / (2 * fall)
        if end > 1.0 - _ARRIVED:
            end = 1.0
        return replace(self, phases=(*kept, Phase(rate / fall, -fall)), end=end)

    def _until(self, time_s: float) -> Iterator[tuple[float, float, Phase]]:
        """Yield each phase that has begun: how long it has lasted, and the rate it began at."""
        rate, left_s = 0.0, max(0.0, time_s)
        for phase in self.phases:
            passed_s = min(phase.duration_s, left_s)
            yield passed_s, rate, phase
            rate += phase.acceleration_per_s2 * phase.duration_s
            left_s -= passed_s
            if left_s <= 0:
                return
