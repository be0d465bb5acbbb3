"""An estimate of the torques of a robot's drives: the simulator's own, not EPSON's.

No page tells masses, gears or motors. Assumed: the load (Weight, Inertia) and a share of the arm,
:data:`OWN_KG`, are one mass at the flange; a drive carries its acceleration and its weight, the
inertia of what the last joint turns, and the force with which a thing in the way resists, acting at
the flange. The torque is the work of these by the joint: ``t = J' (m (a + g) - f)``, J the Jacobian
of the flange (the principle of virtual work). A drive can give :data:`RESERVE` times what its joint
alone needs with the heaviest load, stretched out, at Accel 100. Torques are told as shares of that,
docs/reference/spel.md 7.4.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from robolink_simulators.cell.frames import Vector, dot, scale, subtract
from robolink_simulators.epson.arm.joints import Joints
from robolink_simulators.epson.arm.kinematics import forward
from robolink_simulators.epson.arm.robots import RobotModel
from robolink_simulators.epson.arm.trajectory import FULL_SPEED_AFTER_S

OWN_KG: Final = 2.0
"""Assumed: what the arm weighs as its drives feel it at the flange."""

RESERVE: Final = 4.0
"""Assumed: how many times more a drive can give than its joint alone needs."""

_ECCENTRIC_M: Final = 0.1
"""Assumed: how far from the last joint the heaviest load may have its centre."""

_GRAVITY: Final[Vector] = (0.0, 0.0, 9.81)
_NUDGE: Final = 1e-3
_MM_PER_M: Final = 1000.0


@dataclass(frozen=True, slots=True)
class CarriedLoad:
    """What Weight and Inertia say: kg, and kg m2 about the last joint."""

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
    """Return the torque of each joint as a share of what its drive can give for a moment.

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
    """Return the most that each drive gives for a moment: N m, or N for a linear joint."""
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
