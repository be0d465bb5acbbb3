"""How the simulated arm travels: one leg at a time, each a known function of time.

The time law is ours (assumed): a trapezoid of speed over the share of the path, the same for
all joints, so that they start and stop together. At Accel 100 a joint reaches its top speed
in ``FULL_SPEED_AFTER_S``. Real controllers smooth the corners; nothing here depends on that.
"""

import math
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Protocol, Self

from robolink.model import Hand, Pose, Posture, ToolOffset
from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.kinematics import (
    ScaraPlace,
    flange_of,
    forward,
    hand_of,
    posture_of,
    scara_flange,
    scara_joints,
)
from robolink_simulators.epson.arm.robots import Joints, RobotModel, check_depth, check_ranges
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal


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
    """A ramp that is interrupted after ``at_s`` and stops with its own deceleration."""

    ramp: Ramp
    at_s: float

    @property
    def duration_s(self) -> float:
        """How long it takes to stop, from the start of the path."""
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
"""The share of a path covered, as a function of time."""


FULL_SPEED_AFTER_S: Final = 0.2
"""Time in seconds to a joint's top speed at Accel 100 (assumed)."""

_STILL = 1e-9
_NO_TURN_DEG = 1e-6
"""Turn of a leg that counts as none: what rounding leaves."""
_CHECK_EVERY_MM = 2.0
_CHECK_EVERY_DEG = 2.0
_MOST_CHECKS = 2000


@dataclass(frozen=True, slots=True)
class JointPace:
    """How fast a joint-space leg may be; ``tip_limit_mm_s`` is the low-power limit."""

    speed_percent: float
    accel_percent: float = 100.0
    decel_percent: float = 100.0
    tip_limit_mm_s: float | None = None


class LinePace(NamedTuple):
    """How fast a straight leg may be; the turn values rule legs that only turn."""

    speed_mm_s: float
    accel_mm_s2: float
    decel_mm_s2: float
    turn_deg_s: float
    turn_deg_s2: float


class Leg(Protocol):
    """A stretch of motion."""

    @property
    def duration_ns(self) -> int:
        """How long it takes."""

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after its start; its end from the duration on."""

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that those joints give."""

    def braked(self, elapsed_ns: int) -> "Leg":
        """Return the same leg, left that long after its start to come to rest."""


@dataclass(frozen=True, slots=True)
class RampedLeg:
    """What legs share that follow one time law along their path.

    Attributes:
        ramp: How the share of the way grows with time, ``None`` for a leg that stays.
    """

    ramp: TimeLaw | None

    @property
    def duration_ns(self) -> int:
        """How long it takes."""
        return 0 if self.ramp is None else math.ceil(self.ramp.duration_s * NS_PER_S)

    def braked(self, elapsed_ns: int) -> Self:
        """Return the same leg, left to come to rest."""
        if not isinstance(self.ramp, Ramp):
            return self
        return replace(self, ramp=BrakedRamp(self.ramp, elapsed_ns / NS_PER_S))

    def _share_at(self, elapsed_ns: int) -> float:
        return 1.0 if self.ramp is None else self.ramp.share_at(elapsed_ns / NS_PER_S)


@dataclass(frozen=True, slots=True)
class JointLeg(RampedLeg):
    """Straight in joint space; all joints start and stop together."""

    model: RobotModel
    start: Joints
    end: Joints

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that long after the start."""
        return forward(self.model, self.joints_at(elapsed_ns))

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after the start."""
        share = self._share_at(elapsed_ns)
        if share >= 1:
            return self.end
        pairs = zip(self.start, self.end, strict=True)
        return Joints(*(a + (b - a) * share for a, b in pairs))


@dataclass(frozen=True, slots=True)
class LineLeg(RampedLeg):
    """The tool's tip on a straight line, U turning evenly along it, of a SCARA."""

    model: RobotModel
    start: Pose
    end: Pose
    offset: ToolOffset | None
    hand: Hand
    posture: Posture | None

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after the start."""
        return self.joints_after(self._share_at(elapsed_ns))

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that long after the start."""
        return self._flange_after(self._share_at(elapsed_ns))

    @property
    def top_mm_s(self) -> float | None:
        """Speed that nothing the flange carries exceeds, in mm/s; ``None`` where it turns."""
        a, b = self.start, self.end
        if abs(b.u_deg - a.u_deg) > _NO_TURN_DEG:
            return None
        if self.ramp is None:
            return 0.0
        ramp = self.ramp.ramp if isinstance(self.ramp, BrakedRamp) else self.ramp
        return math.dist(a.coordinates()[:3], b.coordinates()[:3]) * ramp.peak_per_s

    def joints_after(self, share: float) -> Joints:
        """Return the joints after a share of the line."""
        return scara_joints(self.model, self._place_after(share), self.hand, self.posture)

    def _flange_after(self, share: float) -> Pose:
        if share >= 1:
            return flange_of(self.model, self.end, self.offset)
        return Pose(*self._place_after(share), tool=0)

    def _place_after(self, share: float) -> ScaraPlace:
        a, b = self.start, self.end
        if share >= 1:
            x_mm, y_mm, z_mm, u_deg = b.x_mm, b.y_mm, b.z_mm, b.u_deg
        else:
            x_mm = a.x_mm + (b.x_mm - a.x_mm) * share
            y_mm = a.y_mm + (b.y_mm - a.y_mm) * share
            z_mm = a.z_mm + (b.z_mm - a.z_mm) * share
            u_deg = a.u_deg + (b.u_deg - a.u_deg) * share
        if self.offset is None:
            return x_mm, y_mm, z_mm, u_deg
        return scara_flange((x_mm, y_mm, z_mm), u_deg, self.offset)


def plan_go(
    model: RobotModel, start: Joints, end: Joints, pace: JointPace, *, radius_mm: float
) -> JointLeg:
    """Plan a joint-space leg.

    Args:
        model: The robot.
        start: Where the arm is.
        end: Where it goes.
        pace: How fast it may be.
        radius_mm: Distance of the tip from the last joint, for the low-power limit.

    Raises:
        OutOfReach: ``end`` lies outside a joint's range.
    """
    check_ranges(model, end)
    check_depth(model, end)
    deltas = [b - a for a, b in zip(start, end, strict=True)]
    shares = [abs(d) / top for d, top in zip(deltas, model.top_speed, strict=True)]
    longest = max(shares)
    if longest < _STILL:
        return JointLeg(None, model, start, end)
    rate = pace.speed_percent / 100 / longest
    if pace.tip_limit_mm_s is not None:
        rate = min(rate, pace.tip_limit_mm_s / _tip_travel_bound(model, deltas, radius_mm))
    accel_unit = 1 / (100 * FULL_SPEED_AFTER_S * longest)
    rise, fall = pace.accel_percent * accel_unit, pace.decel_percent * accel_unit
    return JointLeg(Ramp.fastest(rate, rise, fall), model, start, end)


def _tip_travel_bound(model: RobotModel, deltas: list[float], radius_mm: float) -> float:
    """Bound the tip's path length per whole leg: each link as if it alone carried the tip."""
    if model.six_axes:
        return max(_six_axes_bound(model, deltas, radius_mm), _STILL)
    a1_mm, a2_mm = model.lengths_mm
    j1, j2, j4 = (math.radians(deltas[joint]) for joint in (0, 1, 3))
    level = a1_mm * abs(j1) + a2_mm * abs(j1 + j2) + radius_mm * abs(j1 + j2 + j4)
    return max(math.hypot(level, deltas[2]), _STILL)


def _six_axes_bound(model: RobotModel, deltas: list[float], radius_mm: float) -> float:
    _, l2, l3, l4, l5, l6 = model.lengths_mm
    wrist_mm = l6 + radius_mm
    forearm_mm = math.hypot(l4, l5) + wrist_mm
    arms_mm = (l2 + l3 + forearm_mm, l3 + forearm_mm, forearm_mm, wrist_mm, wrist_mm, radius_mm)
    return sum(abs(math.radians(d)) * arm for d, arm in zip(deltas, arms_mm, strict=True))


def plan_move(
    model: RobotModel,
    ends: tuple[Pose, Pose],
    pace: LinePace,
    *,
    offset: ToolOffset | None,
    near: Joints,
) -> LineLeg:
    """Plan a straight leg of a SCARA's tip between two tip poses; ``near`` is where it is.

    The whole line is checked before anything moves (assumed: a real controller may notice a
    line that leaves the envelope only on the way).

    Raises:
        OutOfReach: The line leaves the envelope or the hand would have to change.
    """
    start, end = ends
    hand = hand_of(model, near)
    if end.hand is not None and end.hand is not hand:
        raise SpelRefusal(RefusalKind.OUT_OF_REACH, "A straight motion cannot change the hand")
    length_mm = math.dist(start.coordinates()[:3], end.coordinates()[:3])
    turn_deg = abs(end.u_deg - start.u_deg)
    ramp = None
    if length_mm > _STILL:
        rate = min(pace.speed_mm_s / length_mm, model.top_speed[3] / max(turn_deg, _STILL))
        ramp = Ramp.fastest(rate, pace.accel_mm_s2 / length_mm, pace.decel_mm_s2 / length_mm)
    elif turn_deg > _STILL:
        accel = pace.turn_deg_s2 / turn_deg
        ramp = Ramp.fastest(pace.turn_deg_s / turn_deg, accel, accel)
    leg = LineLeg(ramp, model, start, end, offset, hand, posture_of(model, near))
    steps = math.ceil(min(length_mm / _CHECK_EVERY_MM + turn_deg / _CHECK_EVERY_DEG, _MOST_CHECKS))
    for step in (steps, *range(1, steps)):
        joints = leg.joints_after(step / steps if steps else 1.0)
        check_ranges(model, joints)
        check_depth(model, joints)
    return leg
