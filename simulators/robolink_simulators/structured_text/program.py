"""A program of several texts, translated and executed cycle by cycle.

Theory of operation. Each text is parsed, its declarations are taken in where they stand, and each
body becomes a tree of Python functions of one argument, the list of the instance's variables.
Nothing is looked up by name when it runs. Time is given with each cycle and never taken.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from robolink.messages import tr
from robolink_simulators.structured_text.data_types import (
    ArrayType,
    BlockType,
    DataType,
    Frame,
    ScalarType,
    StructType,
    TextVariable,
    Value,
    copier,
)
from robolink_simulators.structured_text.declarations import Declarations, retained_scalars
from robolink_simulators.structured_text.functions import standard_blocks
from robolink_simulators.structured_text.parse import (
    Node,
    TextDialect,
    TextPlace,
    parse,
    refused,
)
from robolink_simulators.structured_text.references import Runtime
from robolink_simulators.structured_text.statements import (
    TURNS_A_CYCLE,
    StatementTranslator,
    counted_in,
)


@dataclass(frozen=True, slots=True)
class ForeignParts:
    """What a program names and no text declares: libraries, and objects of the project.

    Attributes:
        types: Types and blocks, by name in capital letters.
        symbols: Names of enumerations, in the order of their numbers.
        objects: Global objects by name, with their types.
    """

    types: Mapping[str, DataType] = field(default_factory=dict)
    symbols: Mapping[ScalarType, Sequence[str]] = field(default_factory=dict)
    objects: Mapping[str, tuple[DataType, Value]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SourceText:
    """One file of a program.

    Attributes:
        name: Of the file; what stands before the first dot names its list of global variables.
        text: What it holds.
        dialect: What it may hold.
    """

    name: str
    text: str
    dialect: TextDialect = TextDialect.COMMON


class StructuredProgram:
    """A program that can be executed.

    Args:
        sources: Its files; what is used must have been declared before.
        main: Name of the PROGRAM, or of a function block, that each cycle executes.
        foreign: What no text declares.

    Attributes:
        runtime: Time, and the turns of loops that are left.

    Raises:
        StructuredTextError: A text is not in the subset; says where and why.

    Example:
        >>> from robolink_simulators.structured_text import SourceText, StructuredProgram
        >>> text = "PROGRAM Count VAR n : INT; END_VAR n := n + 1; END_PROGRAM"
        >>> program = StructuredProgram([SourceText("count.st", text)], "Count")
        >>> for now_us in (0, 1000):
        ...     program.cycle(now_us)
        >>> program.value("n")
        2
    """

    def __init__(
        self, sources: Iterable[SourceText], main: str, *, foreign: ForeignParts | None = None
    ) -> None:
        self.runtime = Runtime()
        parts = foreign or ForeignParts()
        known = {**standard_blocks(self.runtime), **parts.types}
        self._declared = Declarations(known, self.runtime)
        self._declare(parts)
        file = ""
        for source in sources:
            file = source.name
            self._take_in(source)
        block = self._declared.types.get(main.upper())
        if not isinstance(block, BlockType):
            raise refused(TextPlace(file, 1, 1), tr("there is no program {name}", name=main))
        self._main = block
        self._frame = block.initial()

    def cycle(self, now_us: int) -> None:
        """Execute the program once.

        Args:
            now_us: The present time in microseconds.

        Raises:
            StructuredTextError: It does what compilers do differently, leaves an array, divides
                by zero, or its loops turn too often.
        """
        self.runtime.now_us, self.runtime.turns_left = now_us, TURNS_A_CYCLE
        self._main.run(self._frame)

    def restart(self) -> None:
        """Give every variable its initial value, except retained ones."""
        kept = self.retained()
        self._frame = self._main.initial()
        for container, variable in self._declared.globals.values():
            container[variable.slot] = variable.initial()
        self.restore(kept)

    def value(self, path: str) -> Value:
        """Return a variable by its name, or by names with points: ``core.state``.

        An array or a structure is handed out itself, as a list, and may be changed in place.

        Raises:
            KeyError: There is none.
        """
        container, slot, _ = self._located(path)
        return container[slot]

    def put(self, path: str, value: Value) -> None:
        """Give a scalar a value, or an array one of the same length.

        Raises:
            KeyError: There is no such variable.
        """
        container, slot, of = self._located(path)
        if isinstance(of, ScalarType) or not isinstance(value, list):
            container[slot] = value
        else:
            container[slot][:] = value

    def retained(self) -> dict[str, Any]:
        """Return what a restart retains, ready for JSON."""
        return {
            name: _copied(variable.type, container[variable.slot])
            for name, (container, variable) in self._kept()
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what :meth:`retained` returned; other names are ignored."""
        for name, (container, variable) in self._kept():
            if name not in state:
                continue
            if isinstance(variable.type, ScalarType):
                container[variable.slot] = state[name]
            else:
                copier(variable.type)(container[variable.slot], state[name])

    def _declare(self, parts: ForeignParts) -> None:
        for of, names in parts.symbols.items():
            numbers: Frame = list(range(len(names)))
            self._declared.lists[of.name.lower()] = {
                name.lower(): (numbers, TextVariable(name.lower(), of, at, constant=True))
                for at, name in enumerate(names)
            }
        for name, (of_object, value) in parts.objects.items():
            variable = TextVariable(name.lower(), of_object, 0, first=value)
            self._declared.globals[name.lower()] = ([value], variable)

    def _kept(self) -> list[tuple[str, tuple[Frame, TextVariable]]]:
        own = {name: (self._frame, one) for name, one in self._main.members.items()}
        found = {**self._declared.globals, **own}
        return [(name, place) for name, place in found.items() if place[1].retained]

    def _located(self, path: str) -> tuple[Frame, int, DataType]:
        first, *rest = path.lower().split(".")
        own = self._main.members.get(first)
        if own is not None:
            container, variable = self._frame, own
        elif first in self._declared.lists and rest:
            container, variable = self._declared.lists[first][rest.pop(0)]
        else:
            container, variable = self._declared.globals[first]
        for name in rest:
            of = variable.type
            container = container[variable.slot]
            if not isinstance(of, StructType | BlockType):
                raise KeyError(path)
            variable = of.members[name]
        return container, variable.slot, variable.type

    def _take_in(self, source: SourceText) -> None:
        tree = parse(source.name, source.text, source.dialect)
        for unit in tree.children:
            if unit.data == "type_block":
                for definition in unit.children:
                    self._declared.declare_type(definition, source.name, source.dialect)
            elif unit.data == "global_list":
                self._list(unit, source)
            elif unit.data in ("function_block", "program"):
                self._block(unit, source)

    def _list(self, tree: Node, source: SourceText) -> None:
        if source.dialect is TextDialect.COMMON:
            raise refused(
                TextPlace.of(source.name, tree), tr("global variables appear in the glue only")
            )
        section = type(tree)("section", [_kind_var(tree), *tree.children])
        variables = self._declared.variables(iter([section]), source.name, source.dialect)
        frame = [variable.initial() for variable in variables.values()]
        listed = {name: (frame, variable) for name, variable in variables.items()}
        stem = source.name.partition(".")[0]
        self._declared.list_named(stem, TextPlace.of(source.name, tree)).update(listed)
        self._declared.globals.update(listed)

    def _block(self, tree: Node, source: SourceText) -> None:
        name, *sections, body = tree.children
        file, dialect = source.name, source.dialect
        self._declared.require_free(name, file, dialect)
        members = self._declared.variables(iter(sections), file, dialect)
        for variable in members.values():
            if variable.retained and not retained_scalars(variable.type):
                raise refused(
                    TextPlace.of(file, tree),
                    tr("{name} cannot be retained: it holds an instance", name=variable.name),
                )
        scope = self._declared.scope(file, dialect, members)
        scope.loops = counted_in(body)
        run = StatementTranslator(scope).block(body)
        self._declared.types[str(name).upper()] = BlockType(str(name), members, run)


def _kind_var(tree: Node) -> Node:
    return type(tree)("kind", ["var"])


def _copied(of: DataType, value: Value) -> Value:
    if isinstance(of, ScalarType):
        return value
    if isinstance(of, ArrayType):
        return [_copied(of.element, item) for item in value]
    members = of.members.values() if isinstance(of, StructType) else ()
    return [_copied(member.type, item) for member, item in zip(members, value, strict=True)]
