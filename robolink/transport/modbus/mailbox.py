"""A PLC mailbox in the registers of a Modbus server (docs/reference/mailbox.md, "Registers")."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from robolink.errors import ConfigError, RejectedError
from robolink.messages import tr
from robolink.timing import Clock
from robolink.transport._mailbox_link import (
    COMMAND_WORDS,
    DEVICE_WORDS,
    HEAD_PLACES,
    HEARTBEAT_WORD,
    RESPONSE_WORDS,
    SLOT_WORDS,
    SLOTS,
    MailboxHead,
    require_slot,
    require_words,
)
from robolink.transport._url import LinkUrl, UrlOptions
from robolink.transport.modbus.client import ModbusClient
from robolink.transport.modbus.frames import Area
from robolink.transport.modbus.opening import Probe, open_client
from robolink.transport.traffic import told_alike

_HEAD_WORDS: Final = max(HEAD_PLACES) + 1
_REGISTERS: Final = 0x10000
_AREAS: Final = {"input": Area.INPUT, "holding": Area.HOLDING}


@dataclass(frozen=True, slots=True)
class MailboxPlaces:
    """Where a PLC keeps its mailbox.

    Attributes:
        command: Address of the command block, in holding registers.
        response: Address of the response block.
        slots: Address of tool slot 1.
        area: Where response and slots are read: input or holding registers.
    """

    command: int
    response: int
    slots: int
    area: Area


def open_modbus_link(
    url: LinkUrl, *, timeout_s: float, clock: Clock | None = None
) -> "ModbusMailboxLink":
    """Open a mailbox over Modbus TCP or RTU.

    Args:
        url: Options beside those of a Modbus client: ``command``, ``response`` and ``slots``
            (addresses counted from 0; 0, 0 and behind the response), ``registers``
            (``holding`` reads response and slots from holding registers, function 3).
        timeout_s: Longest wait for the connection, and for each answer.
        clock: Keeps the deadlines.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: No connection; on a serial line also when the unit does not answer.
        RemoteProtocolError: What a serial line brings is no Modbus.
    """
    options = UrlOptions(url)
    places = _take_places(options)
    probe = Probe(places.area, places.response)
    client = open_client(url, options, probe=probe, timeout_s=timeout_s, clock=clock)

    if client.most_registers < RESPONSE_WORDS:
        client.close()
        raise ConfigError(
            tr(
                "robolink reads {read} registers at once; {identity} allows {most}.",
                read=RESPONSE_WORDS,
                most=client.most_registers,
                identity=client.identity,
            ),
            remedy=tr(
                "Let the PLC allow {read} in a read and {written} in a write, or use a map.",
                read=RESPONSE_WORDS,
                written=COMMAND_WORDS,
            ),
            controller=client.identity,
        )

    @told_alike
    def again(timeout_s: float) -> ModbusMailboxLink:
        return open_modbus_link(url, timeout_s=timeout_s, clock=clock)

    return ModbusMailboxLink(client, places, again)


class ModbusMailboxLink:
    """Implements :class:`~robolink.transport.MailboxLink` on a client, and owns it.

    Its identity and place name which of a unit's mailboxes it is, when that is not the usual one.
    """

    durable: bool = True
    """True: a PLC outlives this process."""

    def __init__(
        self,
        client: ModbusClient,
        places: MailboxPlaces,
        again: Callable[[float], "ModbusMailboxLink"],
    ) -> None:
        self._client = client
        self._places = places
        self.identity, self.clock = self._which(client.identity), client.clock
        self._again = again

    @property
    def place(self) -> str:
        """The client's, and which of a unit's mailboxes when it is not the usual one."""
        return self._which(self._client.place)

    @property
    def whole_look_s(self) -> float:
        """See :meth:`robolink.transport.MailboxLink.whole_look_s`."""
        return self._client.read_takes_s(RESPONSE_WORDS) + self._client.write_takes_s(1)

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`; one function 16."""
        command = require_words(words, COMMAND_WORDS)
        self._client.write_registers(self._places.command, command, admit=admit)

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`; ten registers."""
        words = self._read(self._places.response, _HEAD_WORDS)
        return MailboxHead(*(words[place] for place in HEAD_PLACES))

    def read_response(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_response`; one request."""
        return self._read(self._places.response, RESPONSE_WORDS)

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_slot`; one request."""
        return self._read(self._places.slots + (require_slot(slot) - 1) * SLOT_WORDS, SLOT_WORDS)

    def read_device(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_device`; one request."""
        start = self._places.slots + SLOTS * SLOT_WORDS
        if start + DEVICE_WORDS > _REGISTERS:
            raise RejectedError(
                tr("There are no registers after the tool slots of {it}.", it=self.identity),
                remedy=tr("Move the slots down by {count} registers.", count=DEVICE_WORDS),
                controller=self.identity,
            )
        return self._read(start, DEVICE_WORDS)

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`; function 16 with one register."""
        self._client.write_registers(
            self._places.command + HEARTBEAT_WORD, require_words((word,), 1)
        )

    def reopened(self, *, timeout_s: float) -> "ModbusMailboxLink":
        """See :meth:`robolink.transport.MailboxLink.reopened`."""
        return self._again(timeout_s)

    def close(self) -> None:
        """See :meth:`robolink.transport.MailboxLink.close`."""
        self._client.close()

    def _which(self, name: str) -> str:
        command, joint = self._places.command, "&" if "?" in name else "?"
        return f"{name}{joint}command={command}" if command else name

    def _read(self, address: int, count: int) -> tuple[int, ...]:
        if self._places.area is Area.HOLDING:
            return self._client.read_holding(address, count)
        return self._client.read_input(address, count)


def _take_places(options: UrlOptions) -> MailboxPlaces:
    area = options.take_choice("registers", "input", _AREAS)
    command = options.take_int("command", 0, 0, _REGISTERS - COMMAND_WORDS)
    response = options.take_int("response", 0, 0, _REGISTERS - RESPONSE_WORDS)
    last = _REGISTERS - SLOTS * SLOT_WORDS
    slots = options.take_int("slots", min(response + RESPONSE_WORDS, last), 0, last)
    blocks = {
        "response": range(response, response + RESPONSE_WORDS),
        "slots": range(slots, slots + SLOTS * SLOT_WORDS),
    }
    if area is Area.HOLDING:
        blocks["command"] = range(command, command + COMMAND_WORDS)
    _require_apart(blocks, area)
    return MailboxPlaces(command, response, slots, area)


def _require_apart(blocks: dict[str, range], area: Area) -> None:
    ordered = sorted(blocks.items(), key=lambda block: block[1].start)
    for (name, block), (next_name, next_block) in pairwise(ordered):
        if block.stop > next_block.start:
            raise ConfigError(
                tr(
                    "The mailbox blocks {name} and {next_name} overlap: {next_name} begins at "
                    "{reference} (address {address}).",
                    name=name,
                    next_name=next_name,
                    reference=area.reference(next_block.start),
                    address=next_block.start,
                ),
                remedy=tr(
                    "Give {next_name}={address} or more in the URL, as in the PLC's map.",
                    next_name=next_name,
                    address=block.stop,
                ),
            )
