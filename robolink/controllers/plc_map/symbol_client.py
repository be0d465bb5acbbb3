"""What the driver needs of an OPC UA client, and what a server says of a node's value."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol

from robolink.register_maps import Step, SymbolWord
from robolink.timing import Clock

STRUCTURE: Final = "Structure"
"""Kind of a value that has fields."""

BITS: Final[Mapping[str, int]] = {
    "SByte": 8,
    "Byte": 8,
    "Int16": 16,
    "UInt16": 16,
    "Int32": 32,
    "UInt32": 32,
    "Int64": 64,
    "UInt64": 64,
}
"""Kinds of whole numbers, and the bits of each."""


class PartFacts(Protocol):
    """What a server says of a value, or of a field of a structure."""

    @property
    def name(self) -> str:
        """What the server calls it."""

    @property
    def kind(self) -> str:
        """Built-in type of the value, as OPC UA calls it; ``Structure``; empty for none."""

    @property
    def lengths(self) -> tuple[int, ...]:
        """Of an array, one for each dimension; empty for a single value."""

    @property
    def fields(self) -> Sequence["PartFacts"]:
        """Of a structure, what is known of each field."""

    @property
    def type_name(self) -> str:
        """The type for display."""


class SymbolFacts(PartFacts, Protocol):
    """What a server says of one node."""

    @property
    def id(self) -> str:
        """Its id, in one spelling."""

    @property
    def readable(self) -> bool:
        """Whether the value can be read."""


class SymbolClient(Protocol):
    """What the driver needs of an OPC UA client, as ``open_opcua`` returns one."""

    @property
    def identity(self) -> str:
        """Which PLC this is."""

    @property
    def place(self) -> str:
        """Where it was reached, the same for each spelling of the URL."""

    @property
    def clock(self) -> Clock:
        """The clock on which its time passes."""

    def describe(self, node: str) -> SymbolFacts:
        """Return what the server says of a node."""

    def read(self, nodes: Sequence[str]) -> tuple[Any, ...]:
        """Return the values of nodes, in one request; a structure as a dictionary."""

    def write(self, node: str, value: object) -> None:
        """Write the whole value of one node."""

    def require_writable(self, node: str) -> object:
        """Raise what :meth:`write` would before anything is sent."""

    def close(self) -> None:
        """Close."""


class _Element(NamedTuple):
    """One element of an array."""

    name: str
    kind: str
    fields: Sequence[PartFacts]
    lengths: tuple[int, ...] = ()

    @property
    def type_name(self) -> str:
        return self.kind


def part_at(facts: PartFacts, steps: Sequence[Step]) -> PartFacts | None:
    """Return what is known of a part of a value; ``None`` where there is no such part."""
    for step in steps:
        if isinstance(step, str):
            named = [one for one in facts.fields if one.name == step]
            if facts.lengths or not named:
                return None
            facts = named[0]
        elif len(facts.lengths) != 1 or facts.lengths[0] <= step:
            return None
        else:
            facts = _Element(facts.name, facts.kind, facts.fields)
    return facts


def bits_at(client: SymbolClient, word: SymbolWord) -> int:
    """Return how many bits the node of a whole number has."""
    facts = part_at(client.describe(word.cell.node), word.cell.steps)
    return BITS.get(facts.kind if facts else "", 32)
