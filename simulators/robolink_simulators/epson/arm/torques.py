"""Estimated torques and speeds of a robot's joints, and their measured values.

An estimate of the torques of a robot's drives: the simulator's own, not EPSON's.

No page tells masses, gears or motors. Assumed: the load (Weight, Inertia) and a share of the arm,
:data:`OWN_KG`, are one mass at the flange; a drive carries its acceleration and its weight, the
inertia of what the last joint turns, and the force with which a thing in the way resists, acting at
the flange. The torque is the work of these by the joint: ``t = J' (m (a + g) - f)``, J the Jacobian
of the flange (the principle of virtual work). A drive can give :data:`RESERVE` times what its joint
alone needs with the heaviest load, stretched out, at Accel 100. Torques are told as shares of that,
docs/reference/spel.md 7.4.

Torques and speeds of the joints while a robot runs, for ATRQ, PTRQ, AvgSpeed and their kin.

A quantity is measured from its clearing on, and costs nothing before. Source:
docs/reference/spel.md 7.4.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import Vector, dot, scale, subtract
from robolink_simulators.cell.surfaces import NO_FORCE
from robolink_simulators.epson.arm.arm import Arm, Travelled
from robolink_simulators.epson.arm.kinematics import forward
from robolink_simulators.epson.arm.robots import Joints, RobotModel
from robolink_simulators.epson.arm.trajectory import FULL_SPEED_AFTER_S
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

OWN_KG: Final = 2.0
"""Weight of the arm in kg, as its drives carry it at the flange (assumed)."""

RESERVE: Final = 4.0
"""Ratio of the torque that a drive can give to the torque that its joint alone needs (assumed)."""

_ECCENTRIC_M: Final = 0.1
"""Largest distance in m of the heaviest load's centre from the last joint (assumed)."""

_GRAVITY: Final[Vector] = (0.0, 0.0, 9.81)
_NUDGE: Final = 1e-3
_MM_PER_M: Final = 1000.0


@dataclass(frozen=True, slots=True)
class CarriedLoad:
    """The load by Weight and Inertia: kg, and kg m2 about the last joint."""

    weight_kg: float
    inertia_kg_m2: float


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Joints at an instant, and ``step_s`` before and after it; at rest all three are one."""

    before: Joints
    now: Joints
    after: Joints
    step_s: float


def torques(
    model: RobotModel, load: CarriedLoad, motion: JointMotion, resistance_n: Vector
) -> tuple[float, ...]:
    """Return the torque of each joint as a share of its drive's momentary torque.

    Args:
        model: The robot.
        load: What it carries.
        motion: How it moves.
        resistance_n: Force of a thing in the way on the tip, in base axes, N.

    Returns:
        One number a joint, with its sign; beyond 1 a drive would be asked for more than it has.
    """
    pull_n = _pull_n(model, load.weight_kg + OWN_KG, motion, resistance_n)
    needed = [dot(column, pull_n) for column in _jacobian(model, motion.now)]
    spun = zip(motion.before, motion.now, motion.after, strict=True)
    *_, turning = ((a - 2 * b + c) / motion.step_s**2 for a, b, c in spun)
    needed[-1] += load.inertia_kg_m2 * math.radians(turning)
    return tuple(n / most for n, most in zip(needed, momentary(model), strict=True))


def speeds(model: RobotModel, motion: JointMotion) -> tuple[float, ...]:
    """Return the speed of each joint as a share of its speed at Speed 100."""
    pairs = zip(motion.before, motion.after, model.top_speed, strict=True)
    return tuple((b - a) / (2 * motion.step_s) / top for a, b, top in pairs)


@lru_cache(maxsize=64)
def momentary(model: RobotModel) -> tuple[float, ...]:
    """Return the momentary torque of each drive: N m, or N for a linear joint."""
    mass_kg, found = model.payload_kg + OWN_KG, list[float]()
    for index, lever_m in enumerate(_levers_m(model)):
        if index + 1 in model.linear_joints:
            rate = model.top_speed[index] / _MM_PER_M / FULL_SPEED_AFTER_S
            found.append(RESERVE * mass_kg * (rate + _GRAVITY[2]))
            continue
        rate = math.radians(model.top_speed[index]) / FULL_SPEED_AFTER_S
        weight = mass_kg * _GRAVITY[2] * lever_m if model.six_axes else 0.0
        found.append(RESERVE * (mass_kg * lever_m**2 * rate + weight))
    return tuple(found)


def _levers_m(model: RobotModel) -> tuple[float, ...]:
    """Return how far from each joint's axis the flange can be, m."""
    if not model.six_axes:
        a1_mm, a2_mm = model.lengths_mm
        return ((a1_mm + a2_mm) / _MM_PER_M, a2_mm / _MM_PER_M, 0.0, _ECCENTRIC_M)
    _, out, upper, lift, fore, hand = (length / _MM_PER_M for length in model.lengths_mm)
    forearm = math.hypot(lift, fore) + hand
    wrist = hand + _ECCENTRIC_M
    return (out + upper + forearm, upper + forearm, forearm, wrist, wrist, _ECCENTRIC_M)


def _pull_n(model: RobotModel, mass_kg: float, motion: JointMotion, resistance_n: Vector) -> Vector:
    pulled = scale(_GRAVITY, mass_kg)
    if not motion.before == motion.now == motion.after:
        a, b, c = (_place_m(model, at) for at in (motion.before, motion.now, motion.after))
        rate = mass_kg / motion.step_s**2
        x, y, z = (rate * (p - 2 * q + r) for p, q, r in zip(a, b, c, strict=True))
        pulled = (x, y, z + pulled[2])
    return subtract(pulled, resistance_n)


def _jacobian(model: RobotModel, joints: Joints) -> list[Vector]:
    """Return how the flange goes with each joint: m for a radian, or for a metre."""
    here, columns = _place_m(model, joints), list[Vector]()
    for index in range(model.axes):
        moved = list(joints)
        moved[index] += _NUDGE
        linear = index + 1 in model.linear_joints
        by = _NUDGE / _MM_PER_M if linear else math.radians(_NUDGE)
        columns.append(scale(subtract(_place_m(model, Joints(*moved)), here), 1 / by))
    return columns


def _place_m(model: RobotModel, joints: Joints) -> Vector:
    flange = forward(model, joints)
    return scale((flange.x_mm, flange.y_mm, flange.z_mm), 1 / _MM_PER_M)


MEAN_FOR_S: Final = 60
"""Longest time in seconds after clearing for which a mean can be read (documented)."""

_LOOKS: Final = 32
_LOOKS_BACK: Final = 16
_STEP_NS: Final = 1_000_000
_KEPT: Final = 256
_LASTING: Final = 0.05
"""Mean square of the torque that a drive can bear permanently, as a share of the momentary one
(assumed). OLRate 1 stands for it.
"""


class DriveQuantity(StrEnum):
    """What is measured; each value names the statement that clears it."""

    MEAN_TORQUE = "atclr"
    PEAK_TORQUE = "ptclr"
    MEAN_SPEED = "avgspeedclear"
    PEAK_SPEED = "peakspeedclear"


_LATE: Final = {
    DriveQuantity.MEAN_TORQUE: RefusalKind.TORQUE_TOO_LATE,
    DriveQuantity.MEAN_SPEED: RefusalKind.SPEED_TOO_LATE,
}


@dataclass(slots=True)
class _Measured:
    """Measurements of one joint since its clearing; ``sums`` is of values or squares, times s."""

    since_ns: int
    sums: float = 0.0
    peak: float = 0.0


class DriveObserver:
    """Measures the drives of one robot.

    Args:
        arm: Whose.
        load: Tells what it carries.
        limits: Tells the highest torque that is allowed now, of each joint, as shares.

    Attributes:
        resistance_n: Tells the force of a thing in the way on the tip, for joints.
    """

    def __init__(
        self,
        arm: Arm,
        load: Callable[[], CarriedLoad],
        limits: Callable[[], tuple[float, ...]],
    ) -> None:
        self.resistance_n: Callable[[Joints], Vector] = lambda _: NO_FORCE
        self._arm, self._load, self._limits = arm, load, limits
        self._measured: dict[DriveQuantity, dict[int, _Measured]] = {}
        self._seen_ns = 0

    @cached_property
    def _last(self) -> deque[Travelled]:
        """The motions of the last minute; most robots of a process never move."""
        return deque(maxlen=_KEPT)

    def forget(self) -> None:
        """Forget all that was measured, and the motions of the last minute."""
        self._measured.clear()
        self._last.clear()

    def clear(self, quantity: DriveQuantity, joints: Iterable[int]) -> None:
        """Start to measure a quantity of some joints, by their numbers."""
        self._catch_up()
        of_joints = self._measured.setdefault(quantity, {})
        for joint in joints:
            of_joints[joint] = _Measured(self._arm.now_ns)

    def value(self, quantity: DriveQuantity, joint: int) -> float:
        """Return a mean or a peak of a joint since its clearing, 0 without one (assumed).

        The mean of the torque is the root of the mean square, of the speed that of its size.

        Raises:
            Refusal: A mean whose clearing is more than a minute ago (documented).
        """
        self._catch_up()
        measured = self._measured.get(quantity, {}).get(joint)
        if measured is None:
            return 0.0
        lasted_s = (self._arm.now_ns - measured.since_ns) / NS_PER_S
        late = _LATE.get(quantity)
        if late is None:
            return measured.peak
        if lasted_s > MEAN_FOR_S:
            raise SpelRefusal(late, f"More than {MEAN_FOR_S} s after the clearing")
        mean = measured.sums / lasted_s if lasted_s else 0.0
        return math.sqrt(mean) if quantity is DriveQuantity.MEAN_TORQUE else mean

    def present(self, joint: int) -> float:
        """Return the present torque of a joint, as a share of the highest allowed."""
        under_way, now_ns = self._arm.under_way, self._arm.now_ns
        motion = self._motion(under_way, now_ns)
        return _within_limits(self.torques(motion), self._limits())[joint - 1]

    def overload(self, joint: int) -> float:
        """Return the mean square of a joint's torque over the last minute, 1 for the rated one."""
        now_ns, found = self._arm.now_ns, 0.0
        began_ns = max(0, now_ns - MEAN_FOR_S * NS_PER_S)
        moved_ns = 0
        for travelled in (*self._last, *filter(None, [self._arm.under_way])):
            start_ns = max(travelled.start_ns, began_ns)
            if travelled.end_ns <= start_ns:
                continue
            for at_ns, lasts_ns in _looks(start_ns, travelled.end_ns, _LOOKS_BACK):
                torque = self.torques(self._motion(travelled, at_ns))[joint - 1]
                found += torque * torque * lasts_ns
            moved_ns += travelled.end_ns - start_ns
        rest = self.torques(self._motion(None, now_ns))[joint - 1]
        found += rest * rest * max(0, now_ns - began_ns - moved_ns)
        return found / (MEAN_FOR_S * NS_PER_S) / _LASTING

    def torques(self, motion: JointMotion) -> tuple[float, ...]:
        """Return the torques of a motion at an instant, as shares of the momentary torque."""
        return torques(self._arm.model, self._load(), motion, self.resistance_n(motion.now))

    def pressing(self, joints: Joints) -> tuple[float, ...]:
        """Return the torques with which the drives push against an obstacle, as shares."""
        force_n = self.resistance_n(joints)
        if force_n == NO_FORCE:
            return (0.0,) * self._arm.model.axes
        still = JointMotion(joints, joints, joints, _STEP_NS / NS_PER_S)
        pushed, free = (
            torques(self._arm.model, self._load(), still, force) for force in (force_n, NO_FORCE)
        )
        return tuple(a - b for a, b in zip(pushed, free, strict=True))

    def take(self, travelled: Travelled) -> None:
        """Note a motion that is over."""
        self._last.append(travelled)
        if self._measured:
            self._rest_until(travelled.start_ns)
            self._measure(travelled)

    def _catch_up(self) -> None:
        """Measure what has not been measured yet."""
        if not self._measured:
            self._seen_ns = self._arm.now_ns
            return
        under_way = self._arm.under_way
        if under_way is not None:
            self._rest_until(under_way.start_ns)
            self._measure(under_way)
        self._rest_until(self._arm.now_ns)

    def _measure(self, travelled: Travelled) -> None:
        start_ns = max(travelled.start_ns, self._seen_ns)
        if travelled.end_ns <= start_ns:
            return
        for at_ns, lasts_ns in (
            *_looks(start_ns, travelled.end_ns, _LOOKS),
            (travelled.end_ns, 0),
        ):
            self._note(self._motion(travelled, at_ns), lasts_ns)
        self._seen_ns = travelled.end_ns

    def _rest_until(self, end_ns: int) -> None:
        if end_ns > self._seen_ns:
            self._note(self._motion(None, end_ns), end_ns - self._seen_ns)
            self._seen_ns = end_ns

    def _note(self, motion: JointMotion, lasts_ns: float) -> None:
        lasts_s = lasts_ns / NS_PER_S
        torque = _within_limits(self.torques(motion), self._limits())
        speed = speeds(self._arm.model, motion)
        for quantity, of_joints in self._measured.items():
            is_torque = quantity in (DriveQuantity.MEAN_TORQUE, DriveQuantity.PEAK_TORQUE)
            values = torque if is_torque else speed
            for joint, measured in of_joints.items():
                size = abs(values[joint - 1])
                measured.peak = max(measured.peak, size)
                measured.sums += (size * size if is_torque else size) * lasts_s

    def _motion(self, travelled: Travelled | None, at_ns: int) -> JointMotion:
        if travelled is None:
            here = self._arm.joints
            return JointMotion(here, here, here, _STEP_NS / NS_PER_S)
        return motion_at(travelled.joints_at, at_ns, travelled.start_ns)


def motion_at(joints_at: Callable[[int], Joints], at_ns: int, start_ns: int) -> JointMotion:
    """Return the motion about an instant, from a function that gives the joints."""
    middle_ns = max(at_ns, start_ns + _STEP_NS)
    before, now, after = (joints_at(middle_ns + step) for step in (-_STEP_NS, 0, _STEP_NS))
    return JointMotion(before, now, after, _STEP_NS / NS_PER_S)


def _looks(start_ns: int, end_ns: int, count: int) -> list[tuple[int, float]]:
    """Return the middles of even parts of a time, and how long each part is."""
    part_ns = (end_ns - start_ns) / count
    return [(start_ns + round((n + 0.5) * part_ns), part_ns) for n in range(count)]


def _within_limits(shares: tuple[float, ...], limits: tuple[float, ...]) -> tuple[float, ...]:
    """Return torques as shares of the highest allowed; none gives more (documented)."""
    pairs = zip(shares, limits, strict=True)
    return tuple(max(-1.0, min(1.0, share / limit)) for share, limit in pairs)
