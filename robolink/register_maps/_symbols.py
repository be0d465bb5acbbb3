"""A map of symbols ready for use: nodes of an OPC UA server instead of registers.

A node is named as :mod:`robolink.transport.opcua.client` reads it: ``ns=4;s=|var|PLC.GVL.aTool1``,
``i=2258``, or a browse path from Objects. What stands inside a node, an element of an array or a
field of a structure, has no address of its own on the wire: a node is read and written whole.

Two equal readings show that no value was caught half changed only if the program had time to
finish its change between them. So a map says how long a cycle of the program may take, or where
the program counts its cycles (docs/reference/symbol-maps.md).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from robolink.messages import tr
from robolink.register_maps._places import (
    COMPONENTS,
    AllZero,
    Commit,
    Input,
    MapProbe,
    NumberType,
    is_absurd,
    scale_in_words,
)

Step = int | str
"""One step into a value: the index of an element from 0, or the name of a field."""

CYCLE_MS: Final = 100.0
"""Longest change of a program unless its map says otherwise: five cycles of the 20 ms that CODESYS
gives a new task (assumed to hold for other makers)."""


class SymbolCell(NamedTuple):
    """A node, or the part of its value at the end of some steps."""

    node: str
    steps: tuple[Step, ...] = ()

    @property
    def place(self) -> str:
        """The place as a person reads it."""
        match self.steps:
            case ():
                return self.node
            case (int(element),):
                return tr("{node}, element {element}", node=self.node, element=element)
        return tr("{node}, field {field}", node=self.node, field=steps_in_words(self.steps))


def steps_in_words(steps: Sequence[Step]) -> str:
    """Return steps as a PLC program writes them: ``stTip.aValue[2]``."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)
    return text.removeprefix(".")


_STEP: Final = re.compile(r"\.([^\W\d]\w*)|\[(0|[1-9]\d{0,8})\]")


def steps_of(text: str) -> tuple[Step, ...]:
    """Return the steps that :func:`steps_in_words` writes so.

    Raises:
        ValueError: It is no name of a field.
    """
    rest, steps = f".{text}", list[Step]()
    while rest:
        found = _STEP.match(rest)
        if found is None:
            raise ValueError(text)
        steps.append(found[1] or int(found[2]))
        rest = rest[found.end() :]
    return tuple(steps)


@dataclass(frozen=True, slots=True)
class SymbolNumber:
    """A length in mm, or an angle in degrees, in a node.

    Attributes:
        cell: Where.
        type: The type that it has at the server, too.
        factor: Millimetres or degrees in one unit of the stored number; not 0.
        length: How many elements the array has of which it is one; ``None`` where it is none.
    """

    cell: SymbolCell
    type: NumberType
    factor: float = 1.0
    length: int | None = None

    @property
    def cells(self) -> tuple[SymbolCell]:
        """Its only cell."""
        return (self.cell,)

    @property
    def place(self) -> str:
        """The place as a person reads it."""
        return self.cell.place

    @property
    def form(self) -> str:
        """How it stands there, as a person reads it."""
        return ", ".join([str(self.type), *scale_in_words(self.factor)])

    def encode(self, value: float) -> tuple[float]:
        """Return what the node stores for ``value`` (mm, degrees).

        Raises:
            OverflowError: It cannot hold it.
        """
        return (self.type.unpacked(self.type.packed(value / self.factor)),)

    def decode(self, stored: Sequence[float]) -> float:
        """Return the value in mm or degrees; it may be not a number, or an absurd one."""
        (raw,) = stored
        return raw * self.factor + 0.0  # turns a negative zero into zero

    def is_absurd(self, value: float) -> bool:
        """Return whether ``value`` is not a number, or smaller than any length that is not 0."""
        return is_absurd(value, self.factor)

    def slack(self, value: float) -> float:
        """Return how far from ``value`` another may be that is stored alike."""
        return self.type.slack(value, self.factor)


@dataclass(frozen=True, slots=True)
class SymbolSignal:
    """Something that is on or off: a BOOL, a whole number, or one bit of one.

    Attributes:
        cell: Where.
        bit: Bit of a whole number, 0 the lowest; ``None`` for all of it.
        on: What it reads when it is on, and is written to switch it on.
        off: What is written to switch it off.
        length: As in :class:`SymbolNumber`.
    """

    cell: SymbolCell
    bit: int | None = None
    on: int = 1
    off: int = 0
    length: int | None = None

    @property
    def writable(self) -> bool:
        """Whether it is a node of its own."""
        return self.bit is None and not self.cell.steps

    @property
    def place(self) -> str:
        """The place as a person reads it."""
        if self.bit is None:
            return self.cell.place
        return tr("{place} bit {bit}", place=self.cell.place, bit=self.bit)


@dataclass(frozen=True, slots=True)
class SymbolWord:
    """A whole number.

    Attributes:
        cell: Where.
        length: As in :class:`SymbolNumber`.
    """

    cell: SymbolCell
    length: int | None = None

    @property
    def place(self) -> str:
        """The place as a person reads it."""
        return self.cell.place


@dataclass(frozen=True, slots=True)
class SymbolSlot:
    """Where one tool is stored.

    Attributes:
        tool: Its number.
        name: What people call it, may be empty.
        components: Those that the PLC has, by name; the others are always 0.
        defined: Tells whether the tool is defined, if the PLC has such a thing.
        asked: Whether the PLC is asked to take values over, so that several nodes make one whole.
    """

    tool: int
    name: str
    components: Mapping[str, SymbolNumber] = field(hash=False)
    defined: SymbolSignal | None = None
    asked: bool = False

    @property
    def nodes(self) -> tuple[str, ...]:
        """Which nodes hold it, each once."""
        return tuple(dict.fromkeys(number.cell.node for number in self.components.values()))

    @property
    def writable(self) -> bool:
        """Whether one request writes it all, or a handshake makes one whole of several."""
        return self.asked or len(self.nodes) == 1

    @property
    def layout(self) -> tuple[object, ...]:
        """What is the same of two tools that are laid out alike.

        Elements count from the first of the tool; of several nodes the names have to be the same
        but for the number of the tool.
        """
        taken = [it.cell.steps[0] for it in self.components.values() if it.cell.steps]
        base = min((step for step in taken if isinstance(step, int)), default=0)
        return tuple(
            (name, self._pattern(n.cell.node), _from(n.cell.steps, base), n.type, n.factor)
            for name in COMPONENTS
            if (n := self.components.get(name)) is not None
        )

    def _pattern(self, node: str) -> str:
        if len(self.nodes) == 1:
            return ""
        space, _, name = node.rpartition(";")
        return f"{space};{re.sub(rf'(?<![0-9])0*{self.tool}(?![0-9])', '#', name)}"


def _from(steps: tuple[Step, ...], base: int) -> tuple[Step, ...]:
    if steps and isinstance(steps[0], int):
        return (steps[0] - base, *steps[1:])
    return steps


@dataclass(frozen=True, slots=True)
class SymbolMap:
    """One whole, correct map of symbols.

    Attributes:
        name, sha256, slots, commit, probe, permit, selected, flange, inputs, all_zero, largest_mm:
            As in :class:`RegisterMap`.
        device_id: Where a number stands that tells this machine from every other one, if it has
            one.
        cycle_ms: The longest time that the program takes to change values which belong together; 0
            where the count of cycles alone says when they rest.
        cycle_counter: A number that the program raises in each of its cycles, if there is one.
        change_counter: A number that it raises when it has changed values, if there is one.
    """

    name: str
    sha256: str
    slots: Mapping[int, SymbolSlot] = field(hash=False)
    commit: Commit[SymbolSignal, SymbolWord] = field(default_factory=Commit)
    probe: MapProbe[SymbolNumber] | None = None
    permit: SymbolSignal | None = None
    selected: SymbolWord | None = None
    device_id: SymbolWord | None = None
    flange: Mapping[str, SymbolNumber] = field(default_factory=dict, hash=False)
    inputs: Mapping[int, Input[SymbolSignal]] = field(default_factory=dict, hash=False)
    all_zero: AllZero = AllZero.REFUSE
    largest_mm: float = 2000.0
    cycle_ms: float = CYCLE_MS
    cycle_counter: SymbolWord | None = None
    change_counter: SymbolWord | None = None

    @property
    def writable(self) -> bool:
        """Whether tools can be written, as far as a map knows: the server may refuse."""
        return all(slot.writable for slot in self.slots.values())

    @property
    def half_written(self) -> tuple[int, ...]:
        """Tools that the machine may use while only a part of a new value has arrived."""
        return tuple(
            slot.tool
            for slot in self.slots.values()
            if slot.writable and not slot.asked and len(slot.components) > 1
        )
