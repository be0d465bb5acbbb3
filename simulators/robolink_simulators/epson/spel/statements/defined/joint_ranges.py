"""Range and JRange in pulses, and the order in which Home moves the joints (Hordr).

Source: docs/reference/spel.md 6.3, 7.2, 7.3.
"""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.joint_functions import JOINT_COUNTS, another_robot
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range

_JRANGE_VALUES: Final = 3


def _range(machine: Machine, values: Sequence[Number]) -> str:
    """Hold every joint to low and high, or list those in force."""
    robot, axes = machine.robot, machine.model.axes
    if not values:
        return ", ".join(map(str, robot.kept.ranges.pulses())) + CRLF
    if len(values) in {2 * count for count in JOINT_COUNTS - {axes}}:
        raise another_robot(machine.model)
    if len(values) != 2 * axes:
        raise SpelRefusal(RefusalKind.SYNTAX, "Range takes two values for each joint")
    before = robot.kept.ranges.to_state()
    try:
        for joint in range(1, axes + 1):
            low, high = values[2 * joint - 2 : 2 * joint]
            robot.kept.ranges.set_pulses(joint, int(low), int(high))
    except SpelRefusal:
        robot.kept.ranges.restore(before)
        raise
    robot.hold_to_ranges()
    return ""


def _of_one_joint(machine: Machine, values: Sequence[Number]) -> str:
    if len(values) != _JRANGE_VALUES:
        raise SpelRefusal(RefusalKind.SYNTAX, "JRange takes a joint and two ends")
    joint, low, high = map(int, values)
    if not 1 <= joint <= machine.model.axes:
        raise out_of_range(f"There is no joint {joint}")
    machine.robot.kept.ranges.set_pulses(joint, low, high)
    machine.robot.hold_to_ranges()
    return ""


def _home_order(machine: Machine, values: Sequence[Number]) -> str:
    """Set which joints Home moves in each step, a bit for each joint, or list that."""
    settings, axes = machine.settings, machine.model.axes
    if not values:
        return ", ".join(map(str, settings.home_order)) + CRLF
    if len(values) in JOINT_COUNTS - {axes}:
        raise another_robot(machine.model)
    if len(values) != axes:
        raise SpelRefusal(RefusalKind.SYNTAX, f"Hordr takes {axes} values")
    if any(not 0 <= value < 1 << axes for value in values):
        raise out_of_range(f"Allowed are 0 to {(1 << axes) - 1}")
    settings.home_order = tuple(map(int, values))
    return ""


RANGE_STATEMENTS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {
    "range": _range,
    "jrange": _of_one_joint,
    "hordr": _home_order,
}
"""Keyword to what sets or shows it."""
