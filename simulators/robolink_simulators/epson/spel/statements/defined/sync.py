"""SyncRobots: robots whose motions were reserved with SYNC start at one instant.

Source: docs/reference/spel.md 7.1.
"""

from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.tree import KeywordStatement, Name


def _sync(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Start the reserved motions of some robots, or of all that have one; wait for none (assumed).

    That All starts nothing where none is reserved is assumed; of a robot that is named the error is
    documented, its number is not.
    """
    machine, arguments = evaluator.session.machine, command.arguments
    if not arguments:
        raise SpelRefusal(RefusalKind.SYNTAX, "SyncRobots needs robots, or All")
    waiting = [n for n, robot in enumerate(machine.robots, start=1) if robot.reserved is not None]
    if arguments != (Name("all"),):
        asked = [evaluator.integer(argument) for argument in arguments]
        for number in asked:
            machine.numbered(number)
            if number not in waiting:
                text = f"No motion of robot {number} is reserved"
                raise SpelRefusal(RefusalKind.NOT_RESERVED, text)
        waiting = sorted(set(asked))
    now_ns, chosen = machine.arm.now_ns, machine.robot_number
    try:
        for machine.robot_number in waiting:
            motion, machine.robot.reservation = machine.robot.reserved, None
            if motion is not None:
                motion.start_reserved(now_ns)
    finally:
        machine.robot_number = chosen
    return ""


SYNC_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "syncrobots": _sync
}
"""Keyword to what carries it out."""
