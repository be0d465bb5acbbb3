"""Local and Pallet, what defines, lists and clears them (docs/reference/spel.md 5.4)."""

from collections.abc import Callable
from dataclasses import astuple
from typing import Final

from robolink.protocols.spel import decimal
from robolink_simulators.epson.definitions.local_frames import Local
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import out_of_range
from robolink_simulators.epson.spel.statements.defined.frames_of_points import (
    Pair,
    coordinates_of_points,
    fit_of_pairs,
)
from robolink_simulators.epson.spel.statements.points import point_argument
from robolink_simulators.epson.spel.tree import (
    Expression,
    KeywordStatement,
    Literal,
    PointExpression,
    PointPair,
)

_LEVEL_DEG: Final = 1e-6
_WORDS: Final = frozenset({"l", "r", "x", "y", "baseu"})


def _miscounted(command: KeywordStatement) -> SpelRefusal:
    text = f"{command.name} does not take {len(command.arguments)} arguments here"
    return SpelRefusal(RefusalKind.SYNTAX, text)


def _words(arguments: list[Expression]) -> set[str]:
    """Take the words off the end of the arguments: L, R, X, Y, BaseU."""
    words = set[str]()
    while arguments and isinstance(last := arguments[-1], Literal) and last.value in _WORDS:
        words.add(str(last.value))
        arguments.pop()
    return words


def _local(evaluator: Evaluator, command: KeywordStatement) -> str:
    arguments = list(command.arguments)
    words = _words(arguments)
    if not arguments:
        raise _miscounted(command)
    number, locals_ = evaluator.integer(arguments.pop(0)), evaluator.session.machine.locals
    if not arguments:
        # The layout is not shown anywhere: as ArmSet prints (assumed).
        x, y, z, u, v, w, _ = astuple(locals_.get(number))
        return f"Local {number}: " + ", ".join(map(decimal, (x, y, z, u, v, w))) + CRLF
    made = _made(evaluator, command, arguments, words)
    if max(abs(made.v_deg), abs(made.w_deg)) > _LEVEL_DEG and not locals_.tilting:
        raise out_of_range("V and W of a local are 0 on a SCARA")
    locals_.define(number, made)
    return ""


def _made(
    evaluator: Evaluator, command: KeywordStatement, given: list[Expression], words: set[str]
) -> Local:
    """Return the local of two pairs, three points, a point, or the old list of numbers."""
    machine = evaluator.session.machine
    match given:
        case [PointPair() as first, PointPair() as second] if words <= {"l", "r", "baseu"}:
            pairs = _pair(evaluator, first), _pair(evaluator, second)
            aligned = "".join(words - {"baseu"})
            return Local(*fit_of_pairs(*pairs, aligned), base_u="baseu" in words)
        case [PointExpression(), PointExpression(), PointExpression()] if words <= {"x", "y"}:
            places = [machine.locals.to_base(evaluator.point_of(p)).coordinates for p in given]
            return Local(*coordinates_of_points(*places, along_x="y" not in words))
    if words or len(given) not in (1, 4, 6):
        raise _miscounted(command)
    return Local(*point_argument(evaluator, tuple(given)).coordinates)


def _pair(evaluator: Evaluator, pair: PointPair) -> Pair:
    in_base = evaluator.session.machine.locals.to_base(evaluator.point(pair.base))
    return evaluator.point(pair.local).coordinates, in_base.coordinates


def _clear_local(evaluator: Evaluator, command: KeywordStatement) -> str:
    evaluator.session.machine.locals.clear(_only(evaluator, command))
    return ""


def _only(evaluator: Evaluator, command: KeywordStatement) -> int:
    if len(command.arguments) != 1:
        raise _miscounted(command)
    return evaluator.integer(command.arguments[0])


def _pallet(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Define a pallet from three or four corners, columns and rows, or list all.

    The layout of the list is shown nowhere (assumed).
    """
    pallets = evaluator.session.machine.pallets
    if not command.arguments:
        sizes = ((n, pallet.columns, pallet.rows) for n, pallet in pallets.all().items())
        return "".join(f"Pallet {n}: {columns}, {rows}{CRLF}" for n, columns, rows in sizes)
    if len(command.arguments) not in (6, 7):
        raise _miscounted(command)
    number, *corners, columns, rows = command.arguments
    points = [evaluator.point_of(corner) for corner in corners]
    counts = (evaluator.integer(columns), evaluator.integer(rows))
    outside = command.name == "pallet outside"
    pallets.define(evaluator.integer(number), points, *counts, outside=outside)
    return ""


def _clear_pallet(evaluator: Evaluator, command: KeywordStatement) -> str:
    evaluator.session.machine.pallets.clear(_only(evaluator, command))
    return ""


PLACE_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "local": _local,
    "localclr": _clear_local,
    "pallet": _pallet,
    "pallet outside": _pallet,
    "palletclr": _clear_pallet,
}
"""Keyword to what carries it out."""
