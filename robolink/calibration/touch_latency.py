"""The latency of a trigger and the braking after it, from touches at several speeds.

A line z_read = z - latency v always; with three speeds and four touches also a parabola
z_read = z - latency v - overshoot v^2, which counts when F(1, N - 3) at 1 % says that it is
there (docs/reference/evidence.md 13).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.robust import Floats
from robolink.calibration.core.statistics import f_quantile, student_t95
from robolink.errors import CalibrationError
from robolink.messages import tr

LATENCY_S = (-0.002, 0.2)
"""What a trigger can have: a scan takes 1 to 20 ms, a filter 1 to 50, a polled network up to
200; a little below nothing is rounding of the clock."""

OVERSHOOT_S2_PER_MM = (0.0, 0.005)
"""What braking can have: 0.005 is a deceleration of 100 mm/s^2."""

_BEYOND_SIGMAS = 3.0
_AS_RARE = 0.9973

_OVERSHOOT_QUANTILE = 0.99

_ROUNDING_MM = 1e-9


@dataclass(frozen=True, slots=True)
class TouchFit:
    """What touches at several speeds say.

    Attributes:
        fit: Unknowns: z, then the latency unless it was given, then the overshoot if it counts.
        flange_z_mm: Height of the flange when the tip really touched.
        latency_s: As it was found or given.
        latency_gain: Its standard deviation for a scatter of 1 mm; 0 where it was given.
        overshoot_s2_per_mm: ``None`` where it does not count.
        overshoot_gain: Its standard deviation for a scatter of 1 mm.
        f_quadratic: How much the overshoot explains, ``None`` without a test.
        f_limit: What that has to exceed.
        overshoot_upper_s2_per_mm: The largest overshoot, in 97.5 %, that the test may have missed;
            ``None`` without a test.
        braking_mm2_per_s2: By how much an overshoot of 1 s^2/mm that the fit does not know shifts
            the height: v1 v2 for a line through two speeds, the mean of v^2 for a latency that
            was given.
    """

    fit: LinearFit
    flange_z_mm: float
    latency_s: float
    latency_gain: float
    overshoot_s2_per_mm: float | None = None
    overshoot_gain: float = 0.0
    f_quadratic: float | None = None
    f_limit: float | None = None
    overshoot_upper_s2_per_mm: float | None = None
    braking_mm2_per_s2: float = 0.0

    @property
    def gain(self) -> float:
        """Standard deviation of the height as a multiple of one touch's."""
        return math.sqrt(float(self.fit.unit_covariance[0, 0]))


def fit_touches(
    z_mm: Sequence[float], speeds_mm_s: Sequence[float], latency_s: float | None
) -> TouchFit:
    """Return height, latency and, where three speeds show it, overshoot.

    Args:
        z_mm: Heights of the flange when the trigger was read.
        speeds_mm_s: Speed of each touch.
        latency_s: Where an earlier measurement found it.
    """
    z, v = np.array(z_mm, dtype=float), np.array(speeds_mm_s, dtype=float)
    columns = [np.ones(len(z))]
    if latency_s is None:
        columns.append(-v)
    else:
        z = z + v * latency_s
    line = replace(_with(columns, z, latency_s), braking_mm2_per_s2=_braking(columns, v))
    dof = len(z) - len(columns) - 1
    if len(set(speeds_mm_s)) < 3 or dof < 1:
        return line
    parabola = _with([*columns, -(v**2)], z, latency_s)
    left = float(parabola.fit.residuals @ parabola.fit.residuals)
    won = float(line.fit.residuals @ line.fit.residuals) - left
    floor = len(z) * _ROUNDING_MM**2
    ratio = max(won, 0.0) * dof / max(left, floor)
    limit = f_quantile(_OVERSHOOT_QUANTILE, 1, dof)
    gain, found = math.sqrt(float(parabola.fit.unit_covariance[-1, -1])), float(parabola.fit.x[-1])
    upper = max(found, 0.0) + student_t95(dof) * gain * math.sqrt(left / dof)
    best = parabola if ratio > limit else line
    return replace(
        best,
        overshoot_s2_per_mm=found if best is parabola else None,
        overshoot_gain=gain,
        f_quadratic=ratio,
        f_limit=limit,
        overshoot_upper_s2_per_mm=upper,
    )


def _braking(columns: list[Floats], v: Floats) -> float:
    """Return by how much the height of a line is off for an overshoot of 1 s^2/mm."""
    return abs(float(np.linalg.pinv(np.column_stack(columns))[0] @ v**2))


def require_plausible(
    found: TouchFit, sigma_mm: float | None, *, step_mm: float | None = None
) -> None:
    """Refuse a latency or braking that no machine has: speeds or touches are wrong then.

    Args:
        found: The fit.
        sigma_mm: Standard deviation of one touch, where it is known; else the residuals tell it.
        step_mm: How finely its place is told, where it is known: what repeats itself hides that.

    Raises:
        CalibrationError: ``implausible_latency``.
    """
    residuals = found.fit.residuals
    dof = residuals.size - found.fit.rank
    slack = max(_BEYOND_SIGMAS * (sigma_mm or 0.0), step_mm or 0.0)
    if dof > 0:
        # Of a scatter that a few touches tell, as many as are as rare: Student's t.
        scatter = math.sqrt(float(residuals @ residuals) / dof)
        slack = max(slack, math.sqrt(f_quantile(_AS_RARE, 1, dof)) * scatter)
    low, high = LATENCY_S
    if not low - slack * found.latency_gain <= found.latency_s <= high + slack * found.latency_gain:
        raise _implausible(
            tr(
                "The trigger would be read {latency:.4f} s after the touch; possible "
                "are {low:g} to {high:g} s.",
                latency=found.latency_s,
                low=low,
                high=high,
            )
        )
    overshoot, (low, high) = found.overshoot_s2_per_mm, OVERSHOOT_S2_PER_MM
    slack *= found.overshoot_gain
    if overshoot is not None and not low - slack <= overshoot <= high + slack:
        raise _implausible(
            tr(
                "The braking distance would be {overshoot:.5f} s^2/mm times the "
                "squared speed; possible are {low:g} to {high:g}.",
                overshoot=overshoot,
                low=low,
                high=high,
            )
        )


def _with(columns: list[Floats], z: Floats, latency_s: float | None) -> TouchFit:
    fit = linear_fit(np.column_stack(columns), z)
    if latency_s is not None:
        return TouchFit(fit, float(fit.x[0]), latency_s, 0.0)
    gain = math.sqrt(float(fit.unit_covariance[1, 1]))
    return TouchFit(fit, float(fit.x[0]), float(fit.x[1]), gain)


def _implausible(what: str) -> CalibrationError:
    return CalibrationError(
        "implausible_latency",
        what,
        remedy=tr(
            "Does the robot reach these speeds before the touch? Are surface and tip clean, "
            "and is it the right input? Then touch again."
        ),
    )
