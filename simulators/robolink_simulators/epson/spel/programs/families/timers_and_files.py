"""Timers, random numbers, and point files while a program runs.

Source: docs/reference/spel.md 4.6, 5.1, 11.
"""

import random
from collections.abc import Callable
from typing import Final

from robolink.messages import tr
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.closures import Run
from robolink_simulators.epson.spel.expressions.values import as_integer, as_number, as_text
from robolink_simulators.epson.spel.line_tree import Call
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.tasks.compiled import Operation
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tree import Name


def _values(emitter: Emitter, node: Call, least: int, most: int) -> list[Run]:
    if not least <= len(node.arguments) <= most:
        raise emitter.fault(tr("{word} takes other values", word=node.name))
    return [emitter.run(argument) for argument in node.arguments]


def _reset_timer(emitter: Emitter, node: Call) -> Operation:
    (number,) = _values(emitter, node, 1, 1)
    return lambda t: t.runner.sharing.reset_timer(as_integer(number(t)), t.present_ns)


def _reset_elapsed(emitter: Emitter, node: Call) -> Operation:
    _values(emitter, node, 0, 0)

    def go(t: SpelTask) -> None:
        t.runner.sharing.elapsed_since_ns = t.present_ns

    return go


def _randomize(emitter: Emitter, node: Call) -> Operation:
    seeds = _values(emitter, node, 0, 1)

    def go(t: SpelTask) -> None:
        seed = as_number(seeds[0](t)) if seeds else t.present_ns
        t.runner.sharing.rng = random.Random(seed)

    return go


def _load_points(emitter: Emitter, node: Call) -> Operation:
    """LoadPoints file$[, Merge]: files of the project alone (documented)."""
    arguments = list(node.arguments)
    merge = len(arguments) > 1 and arguments.pop() == Name("merge")
    if len(arguments) != 1:
        raise emitter.fault(tr("LoadPoints takes a file"))
    name = emitter.run(arguments[0])

    def go(t: SpelTask) -> None:
        wanted = as_text(name(t)).lower()
        if wanted not in t.runner.project.point_files:
            raise SpelRefusal(RefusalKind.NO_SUCH_FILE, f"There is no file {wanted}")
        points, labels = t.runner.project.point_files[wanted]
        table = t.session.machine.points
        if not merge:
            table.clear()
        for number, point in points.items():
            table.store(number, point)
        for label, number in labels.items():
            table.label(number, label)

    return go


def _save_points(emitter: Emitter, node: Call) -> Operation:
    """SavePoints file$: it is kept in the controller, never written to the PC's disk."""
    (name,) = _values(emitter, node, 1, 1)

    def go(t: SpelTask) -> None:
        table = t.session.machine.points
        points = {number: table.get(number) for number in table.numbers()}
        t.runner.project.point_files[as_text(name(t)).lower()] = (points, table.labels())

    return go


TIMERS_AND_FILES: Final[dict[str, Callable[[Emitter, Call], Operation]]] = {
    "tmreset": _reset_timer,
    "resetelapsedtime": _reset_elapsed,
    "randomize": _randomize,
    "loadpoints": _load_points,
    "savepoints": _save_points,
}
"""Statements that are written as calls."""
