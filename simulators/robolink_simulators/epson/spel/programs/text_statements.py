"""FmtStr and ParseStr, UBound, Eval, what a program tells a PC (docs/reference/spel.md 11, 17)."""

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from typing import Final

from robolink.messages import tr
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.print_format import CRLF, formatted
from robolink_simulators.epson.spel.expressions.values import (
    LONGEST_STRING,
    as_integer,
    as_number,
    as_text,
)
from robolink_simulators.epson.spel.line_tree import Call
from robolink_simulators.epson.spel.parser import parse
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.tasks.compiled_program import Operation
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tasks.waits import (
    StatementWait,
    TaskWait,
    WaitSequence,
)
from robolink_simulators.epson.spel.tree import ByReference, Expression, KeywordStatement, Name


def _plain(item: Expression) -> Expression:
    return item.target if isinstance(item, ByReference) else item


def _named(emitter: Emitter, item: Expression) -> Name:
    given = _plain(item)
    if not isinstance(given, Name):
        raise emitter.fault(tr("a variable is needed"))
    return Name(given.name, given.arguments or None)


def _format(emitter: Emitter, node: Call) -> Operation:
    """FmtStr expression, format$, variable$."""
    if len(node.arguments) != 3:
        raise emitter.fault(tr("FmtStr takes a value, a format and a variable"))
    value, layout = (emitter.run(argument) for argument in node.arguments[:2])
    reference = emitter.variable(_named(emitter, node.arguments[2]))

    def go(t: SpelTask) -> None:
        reference(t).values[0] = formatted(as_number(value(t)), as_text(layout(t)))

    return go


def parse_text(emitter: Emitter, arguments: Sequence[Expression], slot: int) -> Operation:
    """ParseStr text$, tokens$(), delimiters$: any of the characters splits.

    Delimiters that follow each other leave no empty token between them (not stated; assumed).

    Raises:
        ProgramFault: The arguments do not fit.
    """
    if len(arguments) != 3:
        raise emitter.fault(tr("ParseStr takes a text, an array and delimiters"))
    text, delimiters = emitter.run(arguments[0]), emitter.run(arguments[2])
    reference = emitter.array(_named(emitter, arguments[1]))

    def go(t: SpelTask) -> None:
        marks = as_text(delimiters(t))
        tokens = [as_text(text(t))]
        if marks:
            tokens = [part for part in re.split(f"[{re.escape(marks)}]+", tokens[0]) if part]
        array = reference(t)
        if len(array.bounds) != 1:
            raise SpelRefusal(RefusalKind.SUBSCRIPT, "ParseStr fills an array of one dimension")
        array.resize((max(0, len(tokens) - 1),), keep=False)
        for index, token in enumerate(tokens):
            array.values[index] = array.kind.store(token)
        t.results[slot] = len(tokens)

    return go


def _parse(emitter: Emitter, node: Call) -> Operation:
    return parse_text(emitter, node.arguments, emitter.slot())


def upper_bound(emitter: Emitter, arguments: Sequence[Expression], slot: int) -> Operation:
    """UBound(array[, dimension]).

    Raises:
        ProgramFault: The arguments do not fit.
    """
    if not 1 <= len(arguments) <= 2:
        raise emitter.fault(tr("UBound takes an array and a dimension"))
    reference = emitter.array(_named(emitter, arguments[0]))
    dimension = emitter.run(arguments[1]) if len(arguments) > 1 else None

    def go(t: SpelTask) -> None:
        bounds = reference(t).bounds
        wanted = 1 if dimension is None else as_integer(dimension(t))
        if not 1 <= wanted <= len(bounds):
            raise SpelRefusal(RefusalKind.SUBSCRIPT, f"There is no dimension {wanted}")
        t.results[slot] = bounds[wanted - 1]

    return go


def evaluated(emitter: Emitter, arguments: Sequence[Expression], slot: int) -> Operation:
    """Eval(command$[, reply$]): a line of the command window; its error number, 0 if it is fine.

    It never raises; the reply is cut at 255 characters, and is ``!Error: number`` after an error
    (documented, docs/reference/spel.md 4.4).

    Raises:
        ProgramFault: The arguments do not fit.
    """
    if not 1 <= len(arguments) <= 2:
        raise emitter.fault(tr("Eval takes a command and a variable for its reply"))
    command = emitter.run(arguments[0])
    reply = emitter.variable(_named(emitter, arguments[1])) if len(arguments) > 1 else None

    def finish(t: SpelTask, number: int, said: str) -> None:
        t.results[slot] = number
        if reply is not None:
            text = f"!Error: {number}" if number else said.removesuffix(CRLF)
            reply(t).values[0] = text[:LONGEST_STRING]

    def carrying_out(t: SpelTask, text: str) -> Iterator[TaskWait]:
        said = ""
        try:
            for statement in parse(text):
                running = StatementWait(t.runner.steps.carried_out(t, statement))
                yield running
                said += running.execution.output
                t.now_ns = max(t.now_ns, running.execution.ended_ns)
                if running.execution.error is not None:
                    finish(t, running.execution.error.number, "")
                    return
        except SpelRefusal as refusal:
            finish(t, getattr(t.session.options.numbers, refusal.kind.option), "")
            return
        finish(t, 0, said)

    def go(t: SpelTask) -> TaskWait | None:
        steps = carrying_out(t, as_text(command(t)))
        first = next(steps, None)
        return None if first is None else WaitSequence(chain((first,), steps))

    return go


def recovered(_: Emitter, arguments: Sequence[Expression], slot: int) -> Operation:
    """Recover([robot | All[, way]]) as a function: carried out, and whether it came to its end."""
    command = KeywordStatement("recover", tuple(arguments), open_ended=False)

    def carrying_out(t: SpelTask, running: StatementWait) -> Iterator[TaskWait]:
        yield running
        t.now_ns = max(t.now_ns, running.execution.ended_ns)
        t.results[slot] = running.execution.error is None

    def go(t: SpelTask) -> TaskWait:
        running = StatementWait(t.runner.steps.carried_out(t, command))
        return WaitSequence(carrying_out(t, running))

    return go


def _evaluate(emitter: Emitter, node: Call) -> Operation:
    return evaluated(emitter, node.arguments, emitter.slot())


def _tell(emitter: Emitter, node: Call) -> Operation:
    """SPELCom_Event: what EPSON's own API would hand to a PC stands in the console instead."""
    runs = [emitter.run(argument) for argument in node.arguments]
    return lambda t: t.runner.show(f"SPELCom_Event {', '.join(str(run(t)) for run in runs)}\r\n")


PROCEDURES: Final[dict[str, Callable[[Emitter, Call], Operation]]] = {
    "fmtstr": _format,
    "parsestr": _parse,
    "eval": _evaluate,
    "spelcom_event": _tell,
}
"""Compilers of the statements written as calls, by name."""

FUNCTIONS_OF_ARRAYS: Final[dict[str, Callable[[Emitter, Sequence[Expression], int], Operation]]] = {
    "parsestr": parse_text,
    "eval": evaluated,
    "recover": recovered,
    "ubound": upper_bound,
}
"""Compilers, by name, of the functions that take a variable itself instead of its value."""
