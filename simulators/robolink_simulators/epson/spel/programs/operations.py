"""The steps that functions are made of: jumps, assignments, loops, calls.

Each takes a task and changes where it goes on, or what a variable holds.
"""

import operator
from collections.abc import Callable, Sequence
from typing import Any, Final

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.closures import Run, binary
from robolink_simulators.epson.spel.expressions.values import (
    DataType,
    Value,
    Variable,
    as_number,
    as_text,
    truth,
)
from robolink_simulators.epson.spel.programs.scope import Reference
from robolink_simulators.epson.spel.tasks.compiled_program import (
    CompiledFunction,
    JumpTarget,
    Operation,
)
from robolink_simulators.epson.spel.tasks.task import DEEPEST_CALL, SpelTask

SWITCHED: Final = object()
"""Returned by an operation after which the task continues in another function."""


def condition_holds(value: Value) -> bool:
    """Return whether the condition of a branch or a loop is true; an empty text is not.

    Source: docs/reference/spel.md 4.2, 4.3.
    """
    return as_text(value) != "" if isinstance(value, str) else truth(value)


def jump(target: JumpTarget) -> Operation:
    """Continue elsewhere."""

    def go(t: SpelTask) -> None:
        t.pc = target.pc

    return go


def jump_if(condition: Run, target: JumpTarget, *, holds: bool) -> Operation:
    """Continue elsewhere if the condition is true, or if it is not."""

    def go(t: SpelTask) -> None:
        value = condition(t)
        if (value if type(value) is bool else condition_holds(value)) is holds:
            t.pc = target.pc

    return go


def repeat(condition: Run | None, target: JumpTarget, *, holds: bool) -> Operation:
    """End a pass of Do ... Loop."""

    def go(t: SpelTask) -> None:
        t.count_pass()
        if condition is None or condition_holds(condition(t)) is holds:
            t.pc = target.pc

    return go


def assign_local(index: int, kind: DataType, value: Run) -> Operation:
    """Store into a scalar of the function."""
    store = kind.store

    def go(t: SpelTask) -> None:
        t.variables[index].values[0] = store(value(t))

    return go


def assign_shared(variable: Variable, value: Run) -> Operation:
    """Store into a scalar of the module or the project."""
    store, values = variable.kind.store, variable.values

    def go(t: SpelTask) -> None:
        values[0] = store(value(t))

    return go


def assign_element(reference: Reference, subscripts: Sequence[Run], value: Run) -> Operation:
    """Store into an element of an array."""

    def go(t: SpelTask) -> None:
        variable = reference(t)
        at = variable.at([run(t) for run in subscripts])
        variable.values[at] = variable.kind.store(value(t))

    return go


def keep(slot: int, value: Run) -> Operation:
    """Keep a value until the block ends."""

    def go(t: SpelTask) -> None:
        t.results[slot] = value(t)

    return go


def case(slot: int, sign: str, value: Run, other: JumpTarget) -> Operation:
    """Continue with the next Case unless the stored value compares so."""

    def go(t: SpelTask) -> None:
        if not binary(sign, t.results[slot], value(t)):
            t.pc = other.pc

    return go


def for_start(
    variable: Reference,
    slot: int,
    ends: tuple[Run, Run, Run | None],
    leave: JumpTarget,
    *,
    at_top: bool,
) -> Operation:
    """Begin a For: the end and the step are calculated once."""
    start, end, step = ends

    def go(t: SpelTask) -> None:
        counter = variable(t)
        first = counter.kind.store(start(t))
        limit, by = as_number(end(t)), 1 if step is None else as_number(step(t))
        counter.values[0] = first
        t.results[slot] = (counter, limit, by)
        if at_top and _past(as_number(first), limit, by):
            t.pc = leave.pc

    return go


def _past(value: float, limit: float, step: float) -> bool:
    return value < limit if step < 0 else value > limit


def for_next(slot: int, body: JumpTarget) -> Operation:
    """End a pass of a For: the variable ends beyond the limit (docs/reference/spel.md 4.3)."""

    def go(t: SpelTask) -> None:
        begun = t.results[slot]
        if begun is None:
            raise SpelRefusal(RefusalKind.NEXT_WITHOUT_FOR, "Next without For")
        counter, limit, by = begun
        t.count_pass()
        value = counter.values[0] = counter.kind.store(counter.values[0] + by)
        if not (value < limit if by < 0 else value > limit):
            t.pc = body.pc

    return go


def enter(
    function: CompiledFunction, makers: Sequence[Callable[[SpelTask], Variable]], slot: int
) -> Operation:
    """Call a function."""

    def go(t: SpelTask) -> object:
        t.enter(function, [make(t) for make in makers], slot)
        return SWITCHED

    return go


def leave(t: SpelTask) -> object:
    """Return from a function, or end the task."""
    t.leave()
    return SWITCHED


def go_sub(target: JumpTarget) -> Operation:
    """Continue elsewhere until Return."""

    def go(t: SpelTask) -> None:
        if len(t.frame.returns) >= DEEPEST_CALL:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "Subroutines call too deeply")
        t.frame.returns.append(t.pc)
        t.pc = target.pc

    return go


def go_back(t: SpelTask) -> None:
    """Carry Return out."""
    if not t.frame.returns:
        raise SpelRefusal(RefusalKind.RETURN_WITHOUT_GOSUB, "Return without GoSub")
    t.pc = t.frame.returns.pop()


def on_error(target: JumpTarget | None) -> Operation:
    """Set where errors of this function, and of those that it calls, are handled."""

    def go(t: SpelTask) -> None:
        t.frame.handler = target

    return go


def error_resume(target: JumpTarget | None, *, following: bool) -> Operation:
    """Return from where an error was handled."""

    def go(t: SpelTask) -> None:
        failed, t.frame.failed_pc = t.frame.failed_pc, None
        if failed is None:
            raise SpelRefusal(RefusalKind.RESUME_WITHOUT_ERROR, "EResume without an error")
        function = t.frame.function
        if target is not None:
            t.pc = target.pc
        else:
            t.pc = function.statement_after(failed) if following else function.starts[failed]

    return go


def redim(reference: Reference, bounds: Sequence[Run], *, keep_values: bool) -> Operation:
    """Give an array other bounds."""

    def go(t: SpelTask) -> None:
        wanted = tuple(operator.index(int(as_number(run(t)))) for run in bounds)
        reference(t).resize(wanted, keep=keep_values)

    return go


def refuse(kind: RefusalKind, text: str) -> Operation:
    """Refuse a statement each time it is reached."""

    def go(_: SpelTask) -> Any:  # noqa: ANN401 - nothing is returned
        raise SpelRefusal(kind, text)

    return go
