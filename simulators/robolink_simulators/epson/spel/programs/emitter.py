"""Collects the operations of one function; calls inside expressions become operations too."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from operator import is_
from typing import Any, Final, TypeVar

from robolink.messages import tr
from robolink_simulators.epson.condition import SpelRefusal
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.expressions.closures import Run, closure
from robolink_simulators.epson.spel.expressions.values import DataType, Variable
from robolink_simulators.epson.spel.programs.operations import enter
from robolink_simulators.epson.spel.programs.scope import Reference
from robolink_simulators.epson.spel.source_text import ProgramFault, SourcePlace
from robolink_simulators.epson.spel.tasks.compiled_program import (
    CompiledFunction,
    JumpTarget,
    LocalSlot,
    Operation,
)
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tree import (
    ByReference,
    Expression,
    Name,
    ResultSlot,
)

_NAMES_A_TASK: Final = frozenset({"taskstate", "taskdone", "taskinfo", "taskinfo$"})
"""Functions whose argument may name another function without calling it."""

_Node = TypeVar("_Node")
_Maker = Callable[[SpelTask], Variable]


FunctionOfArray = Callable[["Emitter", Sequence[Expression], int], Operation]
"""Compiles a SPEL+ function that takes an array. Its result goes to a slot."""


@lru_cache(maxsize=256)
def _parts_of(kind: type[object]) -> tuple[str, ...]:
    """Return the names of a node's parts; anything else has none."""
    return tuple(part.name for part in fields(kind)) if is_dataclass(kind) else ()


class Emitter:
    """Writes the operations of a function.

    Args:
        function: What is written to.
        functions: All functions of the project.
        options: The controller's habits.
        of_arrays: Functions of the language that take arrays.

    Attributes:
        place: The line that is being compiled.
    """

    def __init__(
        self,
        function: CompiledFunction,
        functions: dict[str, CompiledFunction],
        options: EpsonOptions,
        of_arrays: "Mapping[str, FunctionOfArray] | None" = None,
    ) -> None:
        self._of_arrays = of_arrays or {}
        self.function = function
        self.functions = functions
        self.options = options
        self.place = function.place
        self._start = 0

    @property
    def scope(self) -> Any:  # noqa: ANN401 - FunctionScope, named in compiled
        """What names stand for in the function."""
        return self.function.scope

    def begin(self, place: SourcePlace) -> None:
        """Begin a statement."""
        self.place = place
        self._start = len(self.function.operations)

    def emit(self, operation: Operation) -> None:
        """Add an operation to the statement."""
        self.function.operations.append(operation)
        self.function.places.append(self.place)
        self.function.starts.append(self._start)

    def put(self, target: JumpTarget) -> None:
        """Let a target be the operation that comes next."""
        target.pc = len(self.function.operations)

    def slot(self) -> int:
        """Reserve a place for a value that outlives its statement's operations."""
        self.function.result_slots += 1
        return self.function.result_slots - 1

    def fault(self, text: str, *, expected: tuple[str, ...] = ()) -> ProgramFault:
        """Return a fault of the present line."""
        return ProgramFault(self.place, text, expected=expected)

    def run(self, expression: Expression) -> Run:
        """Return a function that calculates an expression; the calls in it are emitted first.

        Raises:
            ProgramFault: It makes no sense.
        """
        return self.checked(self.hoisted(expression))

    def checked(self, expression: Expression) -> Run:
        """Return a function that calculates an expression without calls.

        Raises:
            ProgramFault: It makes no sense.
        """
        try:
            return closure(expression, self.scope)
        except SpelRefusal as refusal:
            raise self.fault(refusal.text) from refusal

    def hoisted(self, node: _Node) -> _Node:
        """Return a part of the tree with calls of functions replaced by their results.

        The reference names no short circuit, so every call in a statement is made anyway; that
        they are made before anything else of it is read is assumed.
        """
        if isinstance(node, tuple):
            whole = tuple(map(self.hoisted, node))
            return node if all(map(is_, whole, node)) else whole  # type: ignore[return-value]
        if isinstance(node, Name):
            if self.is_call(node):
                return ResultSlot(self.call(node.name, node.arguments or ()))  # type: ignore[return-value]
            if node.name in self._of_arrays and not self.scope.holds(node.name):
                slot = self.slot()
                self.emit(self._of_arrays[node.name](self, node.arguments or (), slot))
                return ResultSlot(slot)  # type: ignore[return-value]
            if node.name in _NAMES_A_TASK or node.arguments is None:
                return node
        new = dict[str, object]()
        for name in _parts_of(type(node)):  # type: ignore[arg-type]
            part = getattr(node, name)
            if (hoisted := self.hoisted(part)) is not part:
                new[name] = hoisted
        return replace(node, **new) if new else node  # type: ignore[type-var]

    def is_call(self, name: Name) -> bool:
        """Return whether a name calls a function of the project here."""
        if name.name not in self.functions:
            return False
        if name.name == self.function.name:
            return name.arguments is not None
        return not self.scope.holds(name.name)

    def call(self, name: str, arguments: Sequence[Expression]) -> int:
        """Emit a call; return where its result is kept.

        Raises:
            ProgramFault: The arguments do not fit.
        """
        function, makers = self.given(name, arguments)
        slot = self.slot()
        self.emit(enter(function, makers, slot))
        return slot

    def given(
        self, name: str, arguments: Sequence[Expression]
    ) -> tuple[CompiledFunction, list[_Maker]]:
        """Return a function, and what makes the variables that it finds as its parameters.

        Raises:
            ProgramFault: The arguments do not fit.
        """
        function = self.functions[name]
        if len(arguments) != function.parameters:
            takes = {"function": function.spelled, "count": function.parameters}
            raise self.fault(tr("{function} takes {count} arguments", **takes))
        makers = [self._maker(function, i, argument) for i, argument in enumerate(arguments)]
        return function, makers

    def variable(self, name: Name) -> Reference:
        """Return what gives a scalar, or an element as one.

        Raises:
            ProgramFault: There is no such variable.
        """
        reference = self.scope.reference(name.name)
        if reference is None and self.scope.undeclared is not None:
            self.scope.declare(LocalSlot(name.name, self.scope.undeclared))
            reference = self.scope.reference(name.name)
        if reference is None:
            raise self.fault(tr("nothing is called {name}", name=name.name))
        if not name.arguments:
            if self.scope.is_array(name.name):
                raise self.fault(tr("{name} is an array", name=name.name))
            return reference  # type: ignore[no-any-return]
        subscripts = [self.run(argument) for argument in name.arguments]
        return lambda t: reference(t).element([run(t) for run in subscripts])

    def variable_for(self, item: Expression) -> Reference:
        """Return what gives the variable that a statement writes to, ``ByRef`` or not.

        Raises:
            ProgramFault: It is no variable, or there is no such one.
        """
        given = item.target if isinstance(item, ByReference) else item
        if not isinstance(given, Name):
            raise self.fault(tr("a variable is needed"))
        return self.variable(given)

    def array(self, name: Name) -> Reference:
        """Return what gives an array itself.

        Raises:
            ProgramFault: It is none.
        """
        if not self.scope.is_array(name.name) or name.arguments:
            raise self.fault(tr("an array is needed, written {name}()", name=name.name))
        return self.scope.reference(name.name)  # type: ignore[no-any-return]

    def _maker(self, function: CompiledFunction, index: int, argument: Expression) -> _Maker:
        """Return what makes the variable that a function finds as its parameter."""
        given = argument.target if isinstance(argument, ByReference) else argument
        if function.arrays[index]:
            if not isinstance(given, Name):
                raise self.fault(tr("an array is needed, written {name}()", name="a"))
            return self.array(given)
        if isinstance(argument, ByReference) and function.by_reference[index]:
            return self.variable(argument.target)
        kind: DataType = function.variables[1 + index].kind
        value = self.run(given)

        def copied(t: SpelTask) -> Variable:
            variable = Variable(kind)
            variable.values[0] = kind.store(value(t))
            return variable

        return copied
