"""Names, members and indices: where a value is, and how it is read and written."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from lark import Token

from robolink.messages import tr
from robolink_simulators.structured_text.data_types import (
    ArrayType,
    BlockType,
    DataType,
    Family,
    Frame,
    Getter,
    ScalarType,
    Storer,
    StructType,
    TextVariable,
    Typed,
    Value,
    as_number,
    type_name,
)
from robolink_simulators.structured_text.parse import (
    Node,
    TextDialect,
    TextPlace,
    refused,
)

SPENT: Final = object()
"""Value of a FOR loop's variable after the loop has ended: its real value depends on the compiler.
"""

Locator = Callable[[Frame], tuple[Frame, int]]


@dataclass(slots=True)
class Runtime:
    """What all instances of a running program share.

    Attributes:
        now_us: The present time, in microseconds.
        turns_left: Turns of loops that this cycle may still make.
    """

    now_us: int = 0
    turns_left: int = 0


@dataclass(slots=True)
class TextScope:
    """What the text of one block can name.

    Attributes:
        file: Where it stands.
        dialect: What it may hold.
        members: Variables of the instance.
        globals: Global variables, with the list that holds them.
        lists: The same under the names of their lists.
        types: Every named type.
        runtime: The running program.
        loops: Variables of FOR loops, in small letters.
        turning: Those of the loops around the present statement.
    """

    file: str
    dialect: TextDialect
    members: dict[str, TextVariable]
    globals: dict[str, tuple[Frame, TextVariable]]
    lists: dict[str, dict[str, tuple[Frame, TextVariable]]]
    types: dict[str, DataType]
    runtime: Runtime
    loops: set[str] = field(default_factory=set)
    turning: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class VariableReference:
    """A place that holds a value.

    Attributes:
        type: Of the value.
        get: Gets it.
        locate: Returns the list that holds it, and where in the list.
        name: The variable's.
        simple: Whether it is a variable itself and no part of one.
        slot: Its slot in the instance, -1 when it stands elsewhere.
        writable: Whether it may be assigned to.
    """

    type: DataType
    get: Getter
    locate: Locator
    name: str
    simple: bool = False
    slot: int = -1
    writable: bool = True

    def storer(self) -> Storer:
        """Return what puts a scalar there."""
        if self.slot >= 0:
            slot = self.slot

            def store_in_frame(frame: Frame, value: Value) -> None:
                frame[slot] = value

            return store_in_frame
        locate = self.locate

        def store(frame: Frame, value: Value) -> None:
            container, key = locate(frame)
            container[key] = value

        return store


Translate = Callable[[Node], Typed]


def find(tree: Node, scope: TextScope, translate: Translate) -> VariableReference:
    """Return what a reference of the text means.

    Args:
        tree: The reference.
        scope: What can be named.
        translate: Translates the expressions of indices.

    Raises:
        StructuredTextError: There is nothing of that name, or no such member.
    """
    name, *rest = tree.children
    parts = [part for part in rest if not isinstance(part, Token)]
    reference = _variable(name, scope, parts)
    for part in parts:
        place = TextPlace.of(scope.file, part)
        if part.data == "member":
            (member,) = part.children
            reference = _member(reference, str(member).lower(), place)
        else:
            indices = [translate(child) for child in part.children]
            reference = _element(reference, indices, place)
    return reference


def _variable(name: Token, scope: TextScope, parts: list[Node]) -> VariableReference:
    low, place = name.lower(), TextPlace.of(scope.file, name)
    variable = scope.members.get(low)
    if variable is not None:
        return _own(variable, scope, place)
    if low in scope.lists and parts and parts[0].data == "member":
        (member,) = parts.pop(0).children
        listed = scope.lists[low].get(str(member).lower())
        if listed is None:
            raise refused(
                place, tr("{list} has no variable {name}", list=str(name), name=str(member))
            )
        return _global(*listed)
    if low in scope.globals:
        return _global(*scope.globals[low])
    raise refused(place, tr("nothing is called {name}", name=str(name)))


def _own(variable: TextVariable, scope: TextScope, place: TextPlace) -> VariableReference:
    slot = variable.slot
    writable = not variable.constant
    if variable.kind == "var_in_out" and isinstance(variable.type, ScalarType):

        def through(frame: Frame) -> Value:
            container, key = frame[slot]
            return container[key]

        return VariableReference(variable.type, through, lambda frame: frame[slot], variable.name)
    counts = variable.name in scope.loops
    return VariableReference(
        variable.type,
        _unspent(slot, place, variable.name) if counts else lambda frame: frame[slot],
        lambda frame: (frame, slot),
        variable.name,
        simple=True,
        slot=slot,
        writable=writable,
    )


def _unspent(slot: int, place: TextPlace, name: str) -> Getter:
    def get(frame: Frame) -> Value:
        value = frame[slot]
        if value is SPENT:
            raise refused(
                place,
                tr("what {name} holds after its loop differs by compiler", name=name),
                tr("Keep the value in a variable of its own."),
            )
        return value

    return get


def _global(container: Frame, variable: TextVariable) -> VariableReference:
    slot = variable.slot
    return VariableReference(
        variable.type,
        lambda _: container[slot],
        lambda _: (container, slot),
        variable.name,
        writable=not variable.constant,
    )


def _member(whole: VariableReference, name: str, place: TextPlace) -> VariableReference:
    members = whole.type.members if isinstance(whole.type, StructType | BlockType) else {}
    variable = members.get(name)
    reachable = variable is not None and variable.kind not in ("var_in_out", "private")
    if variable is None or not reachable:
        raise refused(
            place, tr("{type} has no member {name}", type=type_name(whole.type), name=name)
        )
    slot, get = variable.slot, whole.get
    writable = whole.writable and (
        isinstance(whole.type, StructType) or variable.kind == "var_input"
    )
    held = whole.slot
    return VariableReference(
        variable.type,
        # Most are of a variable of the block itself, and a program reads thousands in a cycle.
        (lambda frame: frame[held][slot]) if held >= 0 else lambda frame: get(frame)[slot],
        lambda frame: (get(frame), slot),
        whole.name,
        writable=writable,
    )


def _element(
    whole: VariableReference, indices: Sequence[Typed], place: TextPlace
) -> VariableReference:
    of = whole.type
    if not isinstance(of, ArrayType) or len(indices) != len(of.bounds):
        raise refused(place, tr("{name} has no such indices", name=whole.name))
    numbers = [as_number(index) for index in indices]
    for number in numbers:
        if number.scalar is None or number.scalar.family is not Family.INTEGER:
            raise refused(place, tr("an index is a whole number"))
    key = _offset(of, numbers, place, whole.name)
    get = whole.get
    held = whole.slot
    return VariableReference(
        of.element,
        # As for a member.
        (lambda frame: frame[held][key(frame)]) if held >= 0 else lambda f: get(f)[key(f)],
        lambda frame: (get(frame), key(frame)),
        whole.name,
        writable=whole.writable,
    )


def _offset(of: ArrayType, indices: Sequence[Typed], place: TextPlace, name: str) -> Getter:
    outside = tr("the index {index} lies outside of {name}", index="{index}", name=name)

    def one(get: Getter, low: int, high: int) -> Getter:
        def offset(frame: Frame) -> int:
            index: int = get(frame)
            if not low <= index <= high:
                raise refused(place, outside.format(index=index))
            return index - low

        return offset

    first, *others = [
        one(index.get, low, high) for index, (low, high) in zip(indices, of.bounds, strict=True)
    ]
    fixed = indices[0].constant
    if not others:
        low, high = of.bounds[0]
        if fixed is not None and low <= fixed <= high:
            return lambda _: fixed - low
        if fixed is not None:
            raise refused(place, outside.format(index=fixed))
        return first
    lengths = [high - low + 1 for low, high in of.bounds[1:]]

    def offset(frame: Frame) -> int:
        at: int = first(frame)
        for length, get in zip(lengths, others, strict=True):
            at = at * length + get(frame)
        return at

    return offset
