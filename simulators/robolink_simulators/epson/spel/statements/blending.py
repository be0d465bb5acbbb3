"""CP: the statement behind a motion begins as soon as the motion slows down.

Source: docs/reference/spel.md 7.1. The way itself is not rounded: the next motion begins when
this one has ended (assumed simplification), what stands between them does not wait.
"""

from robolink_simulators.epson.arm.trajectory import JointLeg, Leg
from robolink_simulators.epson.arm.ways.arch import ArchedLeg
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.spel.legs import go_leg, line_leg
from robolink_simulators.epson.spel.tree import MotionStatement

_SAME_NS = 1000


def blends(machine: Machine, motion: MotionStatement) -> bool:
    """Tell whether the next statement need not wait for the end of a motion."""
    if motion.options.until is not None:
        return False
    return "cp" in motion.options.words or machine.settings.continuous_path


def fall_ns(leg: Leg) -> int:
    """Return how long the deceleration at the end of a leg takes.

    Whoever brakes during the deceleration comes to rest when the leg ends; whoever brakes
    before comes to rest sooner.
    """
    low, high = 0, leg.duration_ns
    while high - low > _SAME_NS:
        middle = (low + high) // 2
        if leg.braked(middle).duration_ns + _SAME_NS < leg.duration_ns:
            low = middle
        else:
            high = middle
    return leg.duration_ns - high


def rest_of_way(machine: Machine, leg: Leg) -> Leg:
    """Return the way from where the arm stands to where a leg was to end."""
    end = leg.joints_at(leg.duration_ns)
    if isinstance(leg, JointLeg | ArchedLeg):
        return go_leg(machine, machine.arm.joints, end)
    return line_leg(machine, machine.tip(), machine.tip_at(end), near=machine.arm.joints)
