"""What every map says, whatever its places are: registers of Modbus or symbols of OPC UA.

A map is of one kind of place. Readers that only need a number, a signal or a word take the
protocols of this module; what a place is on the wire, its own module says.
"""

import math
import struct
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final, Generic, Protocol, TypeVar

from robolink.messages import tr

LREAL_TOLERANCE: Final = 1e-9
"""Largest difference between equal LREALs (docs/reference/rules.md 3)."""

_TINY: Final = 1e-20
"""Smallest plausible value; a smaller one that is not 0 means that the words are in the wrong
order."""

Cells = dict[Any, float]
"""What stands at the places of one tool, each under what tells it from the others: the address of
a register, or a :class:`SymbolCell`."""


class NumberType(StrEnum):
    """How a number is encoded, by the names that PLC programmers use."""

    INT16 = "int16"
    UINT16 = "uint16"
    INT32 = "int32"
    UINT32 = "uint32"
    REAL = "REAL"
    LREAL = "LREAL"

    @property
    def words(self) -> int:
        """How many registers it takes."""
        return struct.calcsize(_FORMATS[self]) // 2

    @property
    def whole(self) -> bool:
        """Whether it holds whole numbers only."""
        return self not in (NumberType.REAL, NumberType.LREAL)

    def packed(self, value: float) -> bytes:
        """Return the nearest value that it holds, high byte first.

        Raises:
            OverflowError: It cannot hold it.
        """
        try:
            return struct.pack(_FORMATS[self], round(value) if self.whole else value + 0.0)
        except (struct.error, ValueError) as error:
            raise OverflowError(str(error)) from error

    def unpacked(self, data: bytes) -> float:
        """Return the value of such bytes; it may be not a number."""
        value: float
        (value,) = struct.unpack(_FORMATS[self], data)
        return value

    def slack(self, value: float, factor: float) -> float:
        """Return how far from ``value`` another may be that is stored alike.

        Args:
            value: In mm or degrees.
            factor: Millimetres or degrees in one unit of the stored number.
        """
        if self.whole:
            return abs(factor) / 2
        if self is NumberType.REAL:
            _, exponent = math.frexp(value / factor)
            return math.ldexp(abs(factor), exponent - 24)
        return LREAL_TOLERANCE


_FORMATS: Final = {
    NumberType.INT16: ">h",
    NumberType.UINT16: ">H",
    NumberType.INT32: ">i",
    NumberType.UINT32: ">I",
    NumberType.REAL: ">f",
    NumberType.LREAL: ">d",
}


def is_absurd(value: float, factor: float) -> bool:
    """Return whether ``value`` is not a number, or smaller than any length that is not 0."""
    return not math.isfinite(value) or 0 < abs(value / factor) < _TINY


def scale_in_words(factor: float) -> list[str]:
    """Return how a person reads a factor; nothing for 1."""
    return [tr("times {factor:g}", factor=factor)] if factor != 1 else []


class PlacedNumber(Protocol):
    """A length in mm, or an angle in degrees, at a place of a PLC."""

    @property
    def type(self) -> NumberType:
        """How it is encoded."""

    @property
    def factor(self) -> float:
        """Millimetres or degrees in one unit of the encoded number; not 0."""

    @property
    def cells(self) -> Sequence[Hashable]:
        """What tells its place from all others: one for each part of it that is stored alone."""

    @property
    def place(self) -> str:
        """The place as a person reads it."""

    @property
    def form(self) -> str:
        """How it is encoded, as a person reads it."""

    def encode(self, value: float) -> Sequence[float]:
        """Return what its cells hold for ``value``; OverflowError if they cannot."""

    def decode(self, stored: Sequence[float]) -> float:
        """Return the value in mm or degrees; it may be not a number, or an absurd one."""

    def is_absurd(self, value: float) -> bool:
        """Return whether ``value`` can be no length and no angle."""

    def slack(self, value: float) -> float:
        """Return how far from ``value`` another may be that is stored alike."""


class PlacedSignal(Protocol):
    """Something that is on or off."""

    @property
    def writable(self) -> bool:
        """Whether it can be written without changing anything beside it."""

    @property
    def place(self) -> str:
        """The place as a person reads it."""


class PlacedWord(Protocol):
    """A whole number."""

    @property
    def place(self) -> str:
        """The place as a person reads it."""


NumberT = TypeVar("NumberT", bound=PlacedNumber, covariant=True)
SignalT = TypeVar("SignalT", bound=PlacedSignal, covariant=True)
WordT = TypeVar("WordT", bound=PlacedWord, covariant=True)


COMPONENTS: Final = ("x", "y", "z", "u", "v", "w")
"""Components of a tool offset and of a pose, in the order of :class:`robolink.model.Pose`."""

ANGLES: Final = frozenset("uvw")
"""Components that are in degrees; the others are in mm."""


class AllZero(StrEnum):
    """The meaning of a slot whose registers are all zero.

    A CODESYS PLC zeroes what clients may write when its watchdog expires
    (docs/reference/softmotion.md 4.1), so that all zeros may be a lost link and no tool
    (docs/reference/faults.md F30).
    """

    REFUSE = "refuse"
    UNDEFINED = "undefined"
    TOOL = "tool"


class CommitKind(StrEnum):
    """How the PLC is asked to take new values over."""

    COMMIT_BIT = "commit_bit"
    LEVEL = "level"
    NONE = "none"


class ToolSlot(Protocol[NumberT, SignalT]):
    """Where one tool is stored."""

    @property
    def tool(self) -> int:
        """Its number."""

    @property
    def components(self) -> Mapping[str, NumberT]:
        """Those that the PLC has, by name; the others are always 0."""

    @property
    def defined(self) -> SignalT | None:
        """Tells whether the tool is defined, if the PLC has such a thing."""

    @property
    def writable(self) -> bool:
        """Whether its values can be written as one whole; a handshake makes one of several."""

    @property
    def layout(self) -> tuple[object, ...]:
        """What is the same of two tools that are laid out alike."""


@dataclass(frozen=True, slots=True)
class Commit(Generic[SignalT, WordT]):
    """How new values take effect.

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
    request: SignalT | None = None
    answer: SignalT | None = None
    busy: SignalT | None = None
    error: SignalT | None = None
    error_code: WordT | None = None
    error_texts: Mapping[int, str] = field(default_factory=dict, hash=False)
    tool_number: WordT | None = None
    timeout_s: float = 2.0
    settle_s: float = 0.0


@dataclass(frozen=True, slots=True)
class MapProbe(Generic[NumberT]):
    """A constant in the PLC that shows that the map is this PLC's: with registers, their order."""

    number: NumberT
    value: float


@dataclass(frozen=True, slots=True)
class Input(Generic[SignalT]):
    """An input that can be read."""

    number: int
    name: str
    signal: SignalT


class PlcMap(Protocol[NumberT, SignalT, WordT]):
    """One whole, correct map, as far as its places do not matter."""

    @property
    def name(self) -> str:
        """What people call the machine."""

    @property
    def sha256(self) -> str:
        """Hash of the file, hexadecimal: a confirmation holds for these bytes only."""

    @property
    def slots(self) -> Mapping[int, ToolSlot[NumberT, SignalT]]:
        """The tools by number."""

    @property
    def commit(self) -> Commit[SignalT, WordT]:
        """How new values come into force."""

    @property
    def probe(self) -> MapProbe[NumberT] | None:
        """The constant to compare before anything is believed, if there is one."""

    @property
    def permit(self) -> SignalT | None:
        """On while offsets may be written, if there is such a signal."""

    @property
    def selected(self) -> WordT | None:
        """Number of the selected tool, if the PLC tells it."""

    @property
    def flange(self) -> Mapping[str, NumberT]:
        """Where the flange is, by component; empty where the PLC does not tell."""

    @property
    def inputs(self) -> Mapping[int, Input[SignalT]]:
        """Inputs by number."""

    @property
    def all_zero(self) -> AllZero:
        """What a slot of zeros means."""

    @property
    def largest_mm(self) -> float:
        """Lengths above are no tool."""

    @property
    def writable(self) -> bool:
        """Whether tools can be written."""


AnyMap = PlcMap[PlacedNumber, PlacedSignal, PlacedWord]
"""A map of registers or of symbols."""
