"""How the share of a path grows with time: a trapezoid of speed, or one that was broken off."""

import math
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True, slots=True)
class Ramp:
    """A trapezoid of speed over a path whose length is 1."""

    rise_s: float
    cruise_s: float
    fall_s: float
    peak_per_s: float

    @classmethod
    def fastest(cls, rate_per_s: float, rise_per_s2: float, fall_per_s2: float) -> Self:
        """Return the quickest ramp within the given speed and accelerations."""
        slack = 1 / rise_per_s2 + 1 / fall_per_s2
        peak = min(rate_per_s, math.sqrt(2 / slack))
        cruise = max(0.0, 1 - peak * peak * slack / 2) / peak
        return cls(peak / rise_per_s2, cruise, peak / fall_per_s2, peak)

    @property
    def duration_s(self) -> float:
        """How long the whole path takes."""
        return self.rise_s + self.cruise_s + self.fall_s

    def share_at(self, time_s: float) -> float:
        """Return the share of the path covered after ``time_s``, 0 to 1."""
        if time_s >= self.duration_s:
            return 1.0
        if time_s <= self.rise_s:
            return self.peak_per_s * time_s * time_s / (2 * self.rise_s)
        left_s = self.duration_s - time_s
        if left_s < self.fall_s:
            return 1 - self.peak_per_s * left_s * left_s / (2 * self.fall_s)
        return self.peak_per_s * (time_s - self.rise_s / 2)

    def rate_at(self, time_s: float) -> float:
        """Return how much of the path is covered in a second, after ``time_s``."""
        left_s = max(0.0, self.duration_s - time_s)
        return self.peak_per_s * min(1.0, time_s / self.rise_s, left_s / self.fall_s)


@dataclass(frozen=True, slots=True)
class BrakedRamp:
    """A ramp that is left after ``at_s`` to come to rest with its own deceleration."""

    ramp: Ramp
    at_s: float

    @property
    def duration_s(self) -> float:
        """How long it takes to come to rest, from the start of the path."""
        return self.at_s + self._braking_s

    def share_at(self, time_s: float) -> float:
        """Return the share of the path covered after ``time_s``."""
        if time_s <= self.at_s:
            return self.ramp.share_at(time_s)
        braking_s = min(time_s - self.at_s, self._braking_s)
        rate, fall = self.ramp.rate_at(self.at_s), self.ramp.peak_per_s / self.ramp.fall_s
        return self.ramp.share_at(self.at_s) + rate * braking_s - fall * braking_s**2 / 2

    @property
    def _braking_s(self) -> float:
        return self.ramp.rate_at(self.at_s) * self.ramp.fall_s / self.ramp.peak_per_s


TimeLaw = Ramp | BrakedRamp
"""How the share of a path grows with time."""
