"""Base: where the base stands that points and locals count from (docs/reference/spel.md 5.4)."""

from collections.abc import Callable
from typing import Final

from robolink.protocols.spel import decimal
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.statements.defined.frames_of_points import (
    coordinates_of_points,
)
from robolink_simulators.epson.spel.statements.points import point_argument
from robolink_simulators.epson.spel.tree import KeywordStatement, Literal, PointExpression


def _base(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Move the base, or show where it stands.

    The layout of what is shown is not in the reference: as ArmSet prints (assumed). A place is told
    in the robot's own system (documented); points of the three-point form are where they are by the
    base in force (assumed).
    """
    robot, arguments = evaluator.session.machine.robot, list(command.arguments)
    if not arguments:
        return "Base: " + ", ".join(map(decimal, robot.kept.base.coordinates)) + CRLF
    match arguments:
        case [PointExpression(), PointExpression(), PointExpression(), *axis]:
            along_x = axis in ([], [Literal("x")])
            if not along_x and axis != [Literal("y")]:
                raise SpelRefusal(RefusalKind.SYNTAX, "Base takes X or Y after its points")
            points = (evaluator.point_of(point) for point in arguments[:3])
            places = [robot.pose_of(point).coordinates() for point in points]
            robot.move_base(coordinates_of_points(*places, along_x=along_x))
        case _ if len(arguments) in (1, 4, 6):
            robot.move_base(point_argument(evaluator, tuple(arguments)).coordinates)
        case _:
            raise SpelRefusal(RefusalKind.SYNTAX, "Base takes a place, or three points")
    return ""


BASE_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {"base": _base}
"""Keyword to what carries it out."""
