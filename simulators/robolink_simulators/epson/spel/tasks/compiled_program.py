"""A program after its build: functions as rows of operations, variables, labels."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from robolink_simulators.epson.spel.expressions.closures import Scope
from robolink_simulators.epson.spel.expressions.values import DataType, Variable
from robolink_simulators.epson.spel.source_text import SourcePlace

Operation = Callable[[Any], Any]
"""One step of a ``SpelTask``. Returns ``None`` when done, otherwise what the task must wait for."""


class JumpTarget:
    """An operation that others jump to; its number is known once all have been made."""

    __slots__ = ("pc",)

    def __init__(self) -> None:
        self.pc = -1


@dataclass(frozen=True, slots=True)
class LocalSlot:
    """A variable of a function: what it is when the function begins."""

    name: str
    kind: DataType
    bounds: tuple[int, ...] = ()
    array: bool = False


@dataclass(slots=True)
class CompiledFunction:
    """A function.

    Attributes:
        name: In lower case.
        spelled: As it is written.
        place: Its first line.
        scope: What names stand for inside it.
        parameters: How many of the first variables after the result are given by the caller.
        by_reference: For each parameter, whether the caller's variable itself is taken.
        arrays: For each parameter, whether it is an array.
        variables: Its own result, its parameters, and its other variables.
        operations: What it does.
        places: The line of each operation.
        starts: For each operation, the first one of its statement.
        labels: Where its labels stand.
        result_slots: How many results of calls a statement keeps at most.
    """

    name: str
    spelled: str
    place: SourcePlace
    scope: Scope
    parameters: int = 0
    by_reference: list[bool] = field(default_factory=list)
    arrays: list[bool] = field(default_factory=list)
    variables: list[LocalSlot] = field(default_factory=list)
    operations: list[Operation] = field(default_factory=list)
    places: list[SourcePlace] = field(default_factory=list)
    starts: list[int] = field(default_factory=list)
    labels: dict[str, JumpTarget] = field(default_factory=dict)
    result_slots: int = 0

    def statement_after(self, pc: int) -> int:
        """Return where the statement behind that of an operation begins."""
        start, number = self.starts[pc], pc
        while number < len(self.starts) and self.starts[number] == start:
            number += 1
        return min(number, len(self.operations) - 1)


@dataclass(slots=True)
class SpelProject:
    """A project: all its functions and the variables that they share.

    Attributes:
        functions: By their names in lower case.
        shared: Global variables by their names, and how long each lives: ``global`` or
            ``preserve``.
        modules: Variables of each file.
        sources: The lines of each file, for those who follow a run.
        background: The functions that begin with the controller, as background tasks.
        encoding: The code page of its files, ``None`` where no one fits them all.
    """

    functions: dict[str, CompiledFunction] = field(default_factory=dict)
    shared: dict[str, tuple[Variable, str]] = field(default_factory=dict)
    modules: dict[str, dict[str, Variable]] = field(default_factory=dict)
    sources: dict[SourcePlace, str] = field(default_factory=dict)
    background: tuple[CompiledFunction, ...] = ()
    encoding: str | None = None

    def clear_globals(self) -> None:
        """Forget what is not preserved, as the start of a function does."""
        for variable, life in self.shared.values():
            if life != "preserve":
                variable.clear()
        for variables in self.modules.values():
            for variable in variables.values():
                variable.clear()

    def preserved(self) -> Mapping[str, Variable]:
        """Return the Global Preserve variables."""
        return {name: v for name, (v, life) in self.shared.items() if life == "preserve"}
