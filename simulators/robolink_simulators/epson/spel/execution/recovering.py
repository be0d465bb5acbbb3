"""Recover: motors on after the safeguard, and back to where the robots were.

Source: docs/reference/spel.md 4.5.
"""

from typing import Final

from robolink_simulators.epson.memory.driven_robot import DrivenRobot
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.legs import go_leg
from robolink_simulators.epson.spel.tree import Expression, KeywordStatement, Name

_WITH_MOVE: Final = 0
_WITHOUT_MOVE: Final = 1


def recover(evaluator: Evaluator, command: KeywordStatement) -> int:
    """Carry Recover out; return how long the way back takes, in ns.

    Motors come on, and each robot goes back point to point in low power (documented); robots go
    side by side (assumed).

    Raises:
        Refusal: The safeguard is open (the number of that error is assumed), or it names no robot.
    """
    session = evaluator.session
    machine, condition = session.machine, session.condition
    numbers, moves = _asked(evaluator, command.arguments)
    if condition.guard_open or condition.flags().emergency_stop:
        kind = RefusalKind.GUARD_OPEN if condition.guard_open else RefusalKind.EMERGENCY_STOP
        raise SpelRefusal(kind, "The robots cannot be recovered now")
    now_ns, chosen, longest_ns = machine.arm.now_ns, machine.robot_number, 0
    try:
        for machine.robot_number in numbers:
            robot = machine.robot
            robot.switch_motors(True)
            if moves and robot.recovers_to is not None:
                leg = go_leg(machine, robot.arm.joints, robot.recovers_to)
                longest_ns = max(longest_ns, robot.arm.start([leg], now_ns) - now_ns)
                robot.way_back = robot.arm.moves_started
            robot.recovers_to = None
    finally:
        machine.robot_number = chosen
    return longest_ns


def _asked(evaluator: Evaluator, arguments: tuple[Expression, ...]) -> tuple[list[int], bool]:
    machine = evaluator.session.machine
    if len(arguments) > 2:
        raise SpelRefusal(RefusalKind.SYNTAX, "Recover takes a robot and a way")
    way = evaluator.integer(arguments[1]) if len(arguments) > 1 else _WITH_MOVE
    if way not in (_WITH_MOVE, _WITHOUT_MOVE):
        raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"There is no way {way}")
    if not arguments or arguments[0] == Name("all"):
        robots: list[DrivenRobot] = list(machine.robots)
        return list(range(1, len(robots) + 1)), way == _WITH_MOVE
    number = evaluator.integer(arguments[0])
    machine.numbered(number)
    return [number], way == _WITH_MOVE
