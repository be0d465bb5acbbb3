"""PTPTime and PTPBoostOK: what a point-to-point motion would take (docs/reference/spel.md 7.2)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.kinematics import flange_of, inverse
from robolink_simulators.epson.refusals import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import Value, as_integer, as_point
from robolink_simulators.epson.spel.legs import go_leg, is_short
from robolink_simulators.epson.spel.session import Session

_DIGITS: Final = 6


def _time_to(session: Session, arguments: Sequence[Value]) -> Value:
    """Return PTPTime(point, arm, tool) in seconds from where the arm stands, 0 out of reach.

    In low power the tool in force counts for the speed of the tip (assumed).
    """
    machine, target = session.machine, as_point(arguments[0])
    arm, tool = (as_integer(argument) for argument in arguments[1:])
    machine.kept.arms.values(arm)
    if arm != machine.kept.arms.selected:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "The time of another arm than that in force")
    offset = machine.tools.get(tool)
    if offset is None and tool:
        raise SpelRefusal(RefusalKind.TOOL_UNDEFINED, f"Tool {tool} is not defined")
    flange = flange_of(machine.model, machine.pose_of(target), offset)
    try:
        joints = inverse(machine.model, flange, target.hand, target.posture)
    except OutOfReach:
        return 0.0
    leg = go_leg(machine, machine.arm.joints, joints)
    return round(leg.duration_ns / NS_PER_S, _DIGITS)


def _short_enough(session: Session, arguments: Sequence[Value]) -> Value:
    """Tell whether PTPBoost counts for the motion from here to a point."""
    machine = session.machine
    joints = machine.joints_for(as_point(arguments[0]))
    return is_short(go_leg(machine, machine.arm.joints, joints))


TRAVEL_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "ptptime": (range(3, 4), _time_to),
    "ptpboostok": (range(1, 2), _short_enough),
}
"""Name to the numbers of arguments allowed and the function."""
