"""How long the servo needs to come within Fine, or FineDist, of a target.

Source: docs/reference/spel.md 7.1, 7.2. The servo is assumed to follow its command with one time
constant, ``servo_lag_ms``: during an even deceleration ``a`` it stays ``a * lag ** 2`` behind where
it will rest, and that fades with ``exp(-t / lag)`` (a lag of first order, R. C. Dorf and R. H.
Bishop, Modern Control Systems).
"""

import math
from collections.abc import Sequence
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.joints import Joints
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind
from robolink_simulators.epson.spel.session import Session

NS_PER_MS: Final = NS_PER_S // 1000

GIVEN_UP_NS: Final = 2 * NS_PER_S
"""After about this long without Fine a motion ends in error 4024 (documented)."""

_LEAST_PULSES: Final = 0.5
"""Assumed: Fine 0 is met where no encoder tells a difference."""


def settling_ns(session: Session, legs: Sequence[Leg]) -> int:
    """Return how long after its end a motion counts as done; note the error if it never does."""
    lag_ms, unrest = session.options.servo_lag_ms, session.options.servo_unrest_pulses
    if not lag_ms and not unrest:
        return 0
    machine, leg = session.machine, legs[-1]
    end = leg.joints_at(leg.duration_ns)
    ever = _off_mm(machine, end, [unrest] * machine.model.axes)
    fine_mm = machine.robot.drives.get("finedist")[0]
    fine = machine.settings.fine_pulses
    met = ever <= fine_mm if fine_mm else all(unrest <= pulses for pulses in fine)
    if not met:
        machine.robot.guard.coming = machine.robot.guard.coming or RefusalKind.FINE_NOT_REACHED
        return GIVEN_UP_NS
    behind = _behind_pulses(machine, leg, lag_ms)
    if fine_mm:
        ratio = _off_mm(machine, end, behind) / fine_mm
    else:
        pairs = zip(behind, fine, strict=True)
        ratio = max(off / max(pulses, _LEAST_PULSES) for off, pulses in pairs)
    return round(lag_ms * NS_PER_MS * math.log(max(ratio, 1.0)))


def _behind_pulses(machine: Machine, leg: Leg, lag_ms: float) -> list[float]:
    """Return how far each joint is behind when its command has come to rest."""
    last_ns = leg.duration_ns
    a, b, c = (leg.joints_at(max(0, last_ns - step)) for step in (2 * NS_PER_MS, NS_PER_MS, 0))
    scales = zip(a, b, c, machine.model.pulses_per_unit, strict=True)
    return [abs(p - 2 * q + r) * lag_ms**2 * scale for p, q, r, scale in scales]


def _off_mm(machine: Machine, end: Joints, pulses: Sequence[float]) -> float:
    """Return how far the tip is from a target when each joint is off by some pulses."""
    scales = zip(end, pulses, machine.model.pulses_per_unit, strict=True)
    there = Joints(*(joint + off / scale for joint, off, scale in scales))
    tips = [machine.robot.tip_near(joints).coordinates()[:3] for joints in (end, there)]
    return math.dist(*tips)
