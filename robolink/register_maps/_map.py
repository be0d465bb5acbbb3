"""What a map says, ready for use: places with units, without defaults left open."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from robolink.register_maps._numbers import Number
from robolink.register_maps._places import RegisterTable, RegisterWords, Signal, Word

COMPONENTS: Final = ("x", "y", "z", "u", "v", "w")
"""Components of a tool offset and of a pose, in the order of :class:`robolink.model.Pose`."""

ANGLES: Final = frozenset("uvw")
"""Those that are degrees; the others are mm."""


class AllZero(StrEnum):
    """What a slot means whose registers are all zero.

    A CODESYS PLC zeroes what clients may write when its watchdog expires
    (docs/reference/softmotion.md 4.1), so that all zeros may be a lost link and no tool
    (docs/reference/faults.md F30).
    """

    REFUSE = "refuse"
    UNDEFINED = "undefined"
    TOOL = "tool"


@dataclass(frozen=True, slots=True)
class MapSlot:
    """Where one tool stands.

    Attributes:
        tool: Its number.
        name: What people call it, may be empty.
        components: Those that the PLC has, by name; the others are always 0.
        defined: Tells whether the tool is defined, if the PLC has such a thing.
    """

    tool: int
    name: str
    components: Mapping[str, Number]
    defined: Signal | None = None

    @property
    def table(self) -> RegisterTable:
        """The table in which all components stand."""
        return next(iter(self.components.values())).table

    @property
    def span(self) -> range:
        """The addresses from the first to the last register, gaps included."""
        return span_of(self.components)

    @property
    def contiguous(self) -> bool:
        """Whether there is no gap, so that one request writes it all."""
        return len(self.span) == sum(len(number.registers) for number in self.components.values())


def span_of(components: Mapping[str, Number]) -> range:
    """Return the addresses from the first to the last register, gaps included."""
    taken = [number.registers for number in components.values()]
    return range(min(r.start for r in taken), max(r.stop for r in taken))


class CommitKind(StrEnum):
    """How the PLC is told to take new values over."""

    COMMIT_BIT = "commit_bit"
    LEVEL = "level"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Commit:
    """How new values come into force.

    Attributes:
        kind: The handshake.
        request: Switched on when the values stand; off again after ``answer``.
        answer: The PLC's done or acknowledge signal.
        busy: The PLC must not be asked now.
        error: The PLC refused, or is in error.
        error_code: Number of the error; alone, a number that is not 0 is an error.
        error_texts: What the numbers mean.
        tool_number: Told which tool it is, before the request.
        timeout_s: Longest wait for each answer.
        settle_s: Without a handshake: how long before the values are read back.
    """

    kind: CommitKind = CommitKind.NONE
    request: Signal | None = None
    answer: Signal | None = None
    busy: Signal | None = None
    error: Signal | None = None
    error_code: Word | None = None
    error_texts: Mapping[int, str] = field(default_factory=dict)
    tool_number: Word | None = None
    timeout_s: float = 2.0
    settle_s: float = 0.0


@dataclass(frozen=True, slots=True)
class MapProbe:
    """A constant in the PLC that tells word order and offset."""

    number: Number
    value: float


@dataclass(frozen=True, slots=True)
class Input:
    """An input that can be read."""

    number: int
    name: str
    signal: Signal


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """One whole map that is right.

    Attributes:
        name: What people call the machine.
        sha256: Hash of the file, hexadecimal: a confirmation holds for these bytes only.
        slots: The tools by number.
        commit: How new values come into force.
        probe: The constant to compare before anything is believed, if there is one.
        permit: On while offsets may be written, if there is such a signal.
        selected: Number of the tool in force, if the PLC tells it.
        device_id: Where a number stands that tells this machine from every other one, if it
            has one.
        flange: Where the flange is, by component; empty where the PLC does not tell.
        inputs: Inputs by number.
        all_zero: What a slot of zeros means.
        largest_mm: Lengths above are no tool.
    """

    name: str
    sha256: str
    slots: Mapping[int, MapSlot]
    commit: Commit = field(default_factory=Commit)
    probe: MapProbe | None = None
    permit: Signal | None = None
    selected: Word | None = None
    device_id: RegisterWords | None = None
    flange: Mapping[str, Number] = field(default_factory=dict)
    inputs: Mapping[int, Input] = field(default_factory=dict)
    all_zero: AllZero = AllZero.REFUSE
    largest_mm: float = 2000.0

    @property
    def writable(self) -> bool:
        """Whether tools can be written: all stand in holding registers."""
        return all(slot.table.writable for slot in self.slots.values())
