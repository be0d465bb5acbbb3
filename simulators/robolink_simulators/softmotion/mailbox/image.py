"""Between the user units of a mailbox and the millimetres of the simulated group."""

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from itertools import combinations
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import AxisKind
from robolink.protocols.mailbox import (
    COMMAND_WORDS,
    DEVICE_START,
    DEVICE_WORDS,
    RESPONSE_WORDS,
    Four,
    Layout,
    Six,
    WordOrder,
    Words,
    WordType,
    crc16,
)
from robolink_simulators.softmotion.group.paths import Dynamics
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox.options import MailboxOptions

_UM_PER_MM = 1000.0


class UserUnits:
    """Scales lengths; angles are degrees on both sides.

    Args:
        unit_um: Micrometres per user unit.

    Attributes:
        unit_um: The same, as a REAL holds it.
    """

    def __init__(self, unit_um: float) -> None:
        (self.unit_um,) = struct.unpack("<f", struct.pack("<f", unit_um))
        self._mm = self.unit_um / _UM_PER_MM

    def tool(self, frame: Six) -> CoordRef:
        """Return a tool offset in mm."""
        x, y, z, a, b, c = frame
        return CoordRef(x * self._mm, y * self._mm, z * self._mm, a, b, c)

    def pose(self, frame: Six) -> Six:
        """Return a pose in mm."""
        return self.tool(frame).components()

    def given(self, frame: CoordRef) -> Six:
        """Return a tool offset or pose in user units.

        There is no minus zero in it: a program that takes numbers apart has none.
        """
        x, y, z, a, b, c = (value + 0.0 for value in frame.components())
        return (x / self._mm, y / self._mm, z / self._mm, a, b, c)

    def axes(self, values: Six, kinds: Sequence[AxisKind]) -> Six:
        """Return axis values in mm and degrees."""
        return _six(values, kinds, lambda value: value * self._mm)

    def given_axes(self, values: Sequence[float], kinds: Sequence[AxisKind]) -> Six:
        """Return axis values in user units and degrees; axes that are not there are 0."""
        return _six([value + 0.0 for value in values], kinds, lambda value: value / self._mm)

    def dynamics(self, numbers: Four, *, factors: bool = False) -> Dynamics:
        """Return velocity and the rest in mm, or unchanged when they are factors."""
        if factors:
            return Dynamics(*numbers)
        return Dynamics(*(number * self._mm for number in numbers))


def _six(
    values: Sequence[float], kinds: Sequence[AxisKind], scale: Callable[[float], float]
) -> Six:
    linear = AxisKind.LINEAR
    scaled = [
        scale(value) if kind is linear else value
        for value, kind in zip(values, kinds, strict=False)
    ]
    a0, a1, a2, a3, a4, a5 = (*scaled, *(0.0,) * (6 - len(scaled)))
    return (a0, a1, a2, a3, a4, a5)


REGISTERS: Final = 4096
"""Number of holding registers, and of input registers: the most that CODESYS offers (documented).
"""

OUTPUT_WORDS: Final = DEVICE_START + DEVICE_WORDS
"""Words of the response, the slots and the device block, one after the other."""


class Bank(Enum):
    """What a PLC keeps its registers in."""

    HOLDING = auto()
    INPUT = auto()


@dataclass(frozen=True, slots=True)
class MailboxPlace:
    """Part of the mailbox in a bank of registers.

    Attributes:
        name: Which block.
        bank: Where it stands.
        start: Its first address.
        count: Its words.
        first: Which word of the command block, or of what the PLC gives out, is its first.
        written: Whether clients write it.
    """

    name: str
    bank: Bank
    start: int
    count: int
    first: int = 0
    written: bool = False

    @property
    def end(self) -> int:
        """The address behind it."""
        return self.start + self.count


def places_of(options: MailboxOptions) -> tuple[MailboxPlace, ...]:
    """Return where command, response, and the slots with the device block stand."""
    bank = Bank.HOLDING if options.registers == "holding" else Bank.INPUT
    slots = options.slots or options.response + RESPONSE_WORDS
    return (
        MailboxPlace("command", Bank.HOLDING, options.command, COMMAND_WORDS, written=True),
        MailboxPlace("response", bank, options.response, RESPONSE_WORDS),
        MailboxPlace("slots", bank, slots, OUTPUT_WORDS - RESPONSE_WORDS, RESPONSE_WORDS),
    )


def require_places(options: MailboxOptions) -> None:
    """Refuse addresses at which the blocks overlap or stick out.

    Raises:
        ConfigError: Names the block.
    """
    places = places_of(options)
    for place in places:
        if place.end > REGISTERS:
            raise ConfigError(
                tr(
                    "The block {name} does not fit at address {start}.",
                    name=place.name,
                    start=place.start,
                ),
                remedy=tr("A PLC has {count} registers of a kind.", count=REGISTERS),
            )
    for one, other in combinations(places, 2):
        if one.bank is other.bank and one.start < other.end and other.start < one.end:
            raise ConfigError(
                tr("The blocks {one} and {other} overlap.", one=one.name, other=other.name),
                remedy=tr("Give {other}={end} or more.", other=other.name, end=one.end),
            )


def arranged(layout: Layout, words: Sequence[int], order: WordOrder) -> Words:
    """Return a block with its values of several words in another order.

    The same again gives the block back. A checksum that was right is right afterwards: the
    program works it out over its words as they stand.

    Args:
        layout: Of the block.
        words: The block.
        order: Where each word of an LREAL stands; values of two words follow it.
    """
    if order is WordOrder.LOW_FIRST:
        return tuple(words)
    moved = list(words)
    for start, count in _values(layout):
        piece = words[start : start + count]
        if count == 4:
            moved[start : start + count] = order.arrange(piece)
        elif order is not WordOrder.HALVES_SWAPPED:
            moved[start : start + count] = piece[::-1]
    if layout.guarded and layout.intact(words):
        end = layout["crc"].word
        moved[end] = crc16(moved[:end])
    return tuple(moved)


def _values(layout: Layout) -> Iterator[tuple[int, int]]:
    """Give start and length of each value of two or four words."""
    for field in layout.fields:
        size = field.type.words
        if size > 1 and field.type is not WordType.CHARS:
            for start in range(field.word, field.end, size):
                yield start, size
