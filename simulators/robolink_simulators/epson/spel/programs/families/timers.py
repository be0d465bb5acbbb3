"""Timers and random numbers while a program runs (docs/reference/spel.md 4.6, 11)."""

import random
from collections.abc import Callable
from typing import Final

from robolink.messages import tr
from robolink_simulators.epson.spel.expressions.closures import Run
from robolink_simulators.epson.spel.expressions.values import as_integer, as_number
from robolink_simulators.epson.spel.line_tree import Call
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.tasks.compiled import Operation
from robolink_simulators.epson.spel.tasks.task import SpelTask


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


TIMERS: Final[dict[str, Callable[[Emitter, Call], Operation]]] = {
    "tmreset": _reset_timer,
    "resetelapsedtime": _reset_elapsed,
    "randomize": _randomize,
}
"""Statements that are written as calls."""
