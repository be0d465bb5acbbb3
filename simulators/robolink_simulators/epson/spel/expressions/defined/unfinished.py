"""What tells of a motion that was broken off: JT, RecoverPos (docs/reference/spel.md 5.3, 7.1)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.values import Value, as_integer
from robolink_simulators.epson.spel.session import Session

Arguments = Sequence[Value]

_COMPLETED: Final = 16
"""From which bit JT tells which parts are completed; from bit 0, which have begun."""


def _parts_of_jump(session: Session, _: Arguments) -> Value:
    """Return JT of the last Jump, Jump3 or Jump3CP; a part without a way counts as done."""
    robot = session.machine.robot
    if robot.jump is None:
        return 0
    start_ns, durations_ns = robot.jump
    passed_ns = robot.arm.travelled_until_ns - start_ns
    bits, began_ns = 0, 0
    for bit, duration_ns in enumerate(durations_ns):
        if not duration_ns or passed_ns > began_ns:
            bits |= 1 << bit
        began_ns += duration_ns
        if not duration_ns or passed_ns >= began_ns:
            bits |= 1 << _COMPLETED + bit
    return bits


def place_to_recover(session: Session, arguments: Arguments) -> Point:
    """Return RecoverPos: where a robot was when the safeguard opened, zeros when it was not."""
    machine = session.machine
    robot = machine.numbered(as_integer(arguments[0])) if arguments else machine.robot
    if robot.recovers_to is None:
        return Point((0.0,) * 6)
    return robot.point_at(robot.tip_at(robot.recovers_to))


UNFINISHED_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Arguments], Value]]]] = {
    "jt": (range(1), _parts_of_jump),
}
"""Name to the numbers of arguments allowed and the function."""
