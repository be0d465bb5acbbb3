"""Where the blocks of a mailbox stand among a PLC's Modbus registers."""

from dataclasses import dataclass
from enum import Enum, auto
from itertools import combinations
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.protocols.mailbox import (
    COMMAND_WORDS,
    DEVICE_START,
    DEVICE_WORDS,
    RESPONSE_WORDS,
)
from robolink_simulators.softmotion.mailbox.options import MailboxOptions

REGISTERS: Final = 4096
"""Holding registers, and input registers: the most that CODESYS offers (documented)."""

OUTPUT_WORDS: Final = DEVICE_START + DEVICE_WORDS
"""Response, slots and device block, one behind the other."""


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
