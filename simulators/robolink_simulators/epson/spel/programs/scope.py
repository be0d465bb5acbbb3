"""The meaning of names inside a function: its own variables first, then wider ones.

Order (inferred): local, module, global, the functions that know the task, then the language.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.closures import Run, Surroundings, closure
from robolink_simulators.epson.spel.expressions.values import DataType, Value, Variable
from robolink_simulators.epson.spel.parser import UNSIMULATED_FAMILIES, UNSIMULATED_FUNCTIONS
from robolink_simulators.epson.spel.tasks.compiled_program import LocalSlot, SpelProject
from robolink_simulators.epson.spel.tasks.task_functions import task_function
from robolink_simulators.epson.spel.tree import Expression

ENUMERATED: Final = frozenset({"forced", "merge", "error", "all", "none", "outside"})
"""Words among the arguments of statements that are not names."""

Reference = Callable[[Surroundings], Variable]
"""Returns a variable itself instead of its value."""


@dataclass(slots=True)
class FunctionScope:
    """Resolves the names of one function.

    Attributes:
        project: The functions and global variables.
        module: The variables of the file.
        slots: Where each of the function's own variables stands.
        variables: What they are.
        undeclared: What becomes of a name that nobody declared, ``None`` for an error.
        labels: Names of points, inputs and outputs, ``None`` where they are not known yet: then
            a run finds out.
    """

    project: SpelProject
    module: dict[str, Variable]
    slots: dict[str, int] = field(default_factory=dict)
    variables: list[LocalSlot] = field(default_factory=list)
    undeclared: DataType | None = None
    labels: frozenset[str] | None = None

    def declare(self, slot: LocalSlot) -> int:
        """Add a variable of the function; return where it stands."""
        index = len(self.variables)
        self.slots[slot.name] = index
        self.variables.append(slot)
        return index

    def shared(self, name: str) -> Variable | None:
        """Return a variable of the module or of the project."""
        own = self.module.get(name)
        if own is not None:
            return own
        known = self.project.shared.get(name)
        return None if known is None else known[0]

    def holds(self, name: str) -> bool:
        """Return whether a name is a variable's here."""
        return name in self.slots or self.shared(name) is not None

    def kind(self, name: str) -> DataType | None:
        """Return the type of a variable."""
        if name in self.slots:
            return self.variables[self.slots[name]].kind
        variable = self.shared(name)
        return None if variable is None else variable.kind

    def is_array(self, name: str) -> bool:
        """Return whether a name is an array's here."""
        if name in self.slots:
            return self.variables[self.slots[name]].array
        variable = self.shared(name)
        return variable is not None and bool(variable.bounds)

    def reference(self, name: str) -> Reference | None:
        """Return what gives a variable itself, and not what it holds."""
        if name in self.slots:
            index = self.slots[name]
            return lambda t: t.variables[index]
        variable = self.shared(name)
        return None if variable is None else lambda _: variable

    def named(self, name: str, arguments: Sequence[Expression] | None) -> Run | None:
        """Return the value of a variable, or of a function about tasks."""
        if name in self.slots and (arguments is None or self.is_array(name)):
            return self._local(self.slots[name], name, arguments)
        variable = self.shared(name)
        if variable is not None:
            return self._shared_value(variable, name, arguments)
        return task_function(name, arguments, self)

    def unknown(self, name: str, arguments: Sequence[Expression] | None) -> Run:
        """Look a label up when it is needed; anything else that is unknown is an error.

        Raises:
            Refusal: Nothing is called so.
        """
        if name in UNSIMULATED_FUNCTIONS or name.startswith(UNSIMULATED_FAMILIES):
            return _unsimulated(name)
        if arguments is not None:
            raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")
        if self.labels is not None and name in self.labels:
            return lambda t: t.of_the_project(name)
        if self.undeclared is not None:
            self.declare(LocalSlot(name, self.undeclared))
            return self._local(self.slots[name], name, None)
        if self.labels is not None and name not in ENUMERATED:
            raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")
        return lambda t: t.of_the_project(name)

    def _local(self, index: int, name: str, arguments: Sequence[Expression] | None) -> Run:
        if arguments is None:
            self._need_scalar(name)
            return lambda t: t.variables[index].values[0]
        runs = [closure(argument, self) for argument in arguments]
        if len(runs) == 1:
            only = runs[0]

            def one(t: Surroundings) -> Value:
                variable = t.variables[index]
                return variable.values[variable.at((only(t),))]

            return one

        def several(t: Surroundings) -> Value:
            variable = t.variables[index]
            return variable.values[variable.at([run(t) for run in runs])]

        return several

    def _shared_value(
        self, variable: Variable, name: str, arguments: Sequence[Expression] | None
    ) -> Run:
        values = variable.values
        if arguments is None:
            self._need_scalar(name)
            return lambda _: values[0]
        runs = [closure(argument, self) for argument in arguments]
        return lambda t: values[variable.at([run(t) for run in runs])]

    def _need_scalar(self, name: str) -> None:
        if self.is_array(name):
            raise SpelRefusal(RefusalKind.SUBSCRIPT, f"{name} is an array")


def _unsimulated(name: str) -> Run:
    def refuse(_: Surroundings) -> Value:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, f"{name} is not simulated")

    return refuse
