"""A link to a PLC's mailbox on which the adversary sees all traffic, on any carrier."""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Final, Protocol

from robolink.errors import TransportError
from robolink.protocols.mailbox import (
    COMMAND,
    COMMAND_WORDS,
    RESPONSE,
    BlockError,
    CommandState,
    Opcode,
    Words,
    decode_command,
    decode_response,
    encode_command,
)
from robolink.transport import MailboxHead, MailboxLink
from robolink.transport.word_traffic import MailboxLinkAround
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.plant.machine import SentKind, SentRequest, WireTap

_CRC: Final = COMMAND["crc"].word
_BOOT: Final = RESPONSE["boot_id"].word
_ACK: Final = RESPONSE["ack_head"].word
_TAKEN_OVER: Final = 0x00A5_0000
_ENDED: Final = (CommandState.DONE, CommandState.ABORTED, CommandState.ERROR)
_FOLLOWED: Final = (Opcode.MOVE_DIRECT, Opcode.MOVE_LINEAR, Opcode.MOVE_UNTIL_INPUT, Opcode.JOG)
"""Commands that end later than their acknowledgement."""


class SeenSession:
    """Follows the blocks of a session, without the driver's knowledge.

    The rules are those of docs/reference/mailbox.md, "When a command counts": a session ends with a
    restart of the PLC that it met, and with an acknowledgement of another client in place of its
    own; a block is written again only after the PLC has counted a damaged one. One thread sees that
    first: another may be about to write, and learns it at its own next reading.

    Attributes:
        overtaken: Whether another client was acknowledged in the place of its last command.
    """

    def __init__(self) -> None:
        self._boot_id = 0
        self._over: dict[int, str] = {}
        self._written: tuple[int, ...] = ()
        self._proved = False
        self._rejected = 0
        self.overtaken = False

    def written(self, words: Sequence[int], rejected: int) -> str:
        """Note a command block before it leaves; return why it must not, empty if it may.

        Args:
            words: The block.
            rejected: The number of damaged blocks that the PLC has counted so far.
        """
        block = tuple(words[: _CRC + 1])
        again = block == self._written and rejected == self._rejected
        self._written, self._rejected, self._proved = block, rejected, False
        if again:
            return "it was written before, and nothing was damaged"
        return self._over.get(threading.get_ident(), "")

    def answered(self, words: Words) -> None:
        """Note a response block that the client has read."""
        starts_anew = words[_BOOT] != self._boot_id
        acknowledged = bool(self._written) and words[_ACK] == self._written[0]
        if not starts_anew and not acknowledged:
            return
        try:
            now = decode_response(words)
        except BlockError:
            return  # it is read again
        if self._boot_id and now.boot_id != self._boot_id:
            self._over[threading.get_ident()] = "the PLC has restarted since"
        self._boot_id = self._boot_id or now.boot_id
        if not acknowledged or self._proved:
            return
        ours = decode_command((*self._written, 0, self._written[0]))
        # A later answer under the same number does not replace another client's.
        ended = now.state in _ENDED or ours.opcode in _FOLLOWED
        self._proved = now.ack_owner == ours.owner and ended
        # A take may have succeeded although another client was answered since; it names the holder.
        took = ours.opcode == Opcode.OWNERSHIP and now.answer.holder == ours.owner
        self.overtaken = now.ack_owner != ours.owner and not took
        if self.overtaken:
            self._over[threading.get_ident()] = "another client was acknowledged in its place"


def another_clients(words: Sequence[int]) -> Words:
    """Return the block of another client with the same number and opcode."""
    command = decode_command(words)
    return encode_command(replace(command, owner=command.owner ^ _TAKEN_OVER), heartbeat=0)


_KINDS: Final = {
    Opcode.MOVE_DIRECT: SentKind.MOVE,
    Opcode.MOVE_LINEAR: SentKind.MOVE,
    Opcode.MOVE_UNTIL_INPUT: SentKind.MOVE,
    Opcode.JOG: SentKind.MOVE,
    Opcode.CONTINUE: SentKind.MOVE,
    Opcode.WRITE_TOOL: SentKind.WRITE,
    Opcode.CLEAR_TOOL: SentKind.WRITE,
    Opcode.SELECT_TOOL: SentKind.SELECT,
    Opcode.STOP: SentKind.STOP,
    Opcode.HALT: SentKind.STOP,
}
_I0, _OPCODE = COMMAND["i0"].word, COMMAND["opcode"].word


_CHANGING: Final = (SentKind.MOVE, SentKind.WRITE)


class WatchedMailbox(Protocol):
    """The machine behind a link, which receives the link's traffic."""

    @property
    def rejected(self) -> int:
        """The number of damaged blocks that the mailbox has counted."""

    def announce(self, text: str, words: Sequence[int] = ()) -> None:
        """Handle a request before it leaves, as text, with the block if it is one."""


class TappedMailboxLink(MailboxLinkAround):
    """Implements :class:`robolink.transport.MailboxLink` around another one.

    Args:
        inner: The link that carries the traffic.
        process: The process of the link.
        tap: Receives the traffic.
        plant: Receives each request before it leaves.
    """

    def __init__(
        self,
        inner: MailboxLink,
        process: VirtualProcess,
        tap: WireTap,
        plant: "WatchedMailbox",
    ) -> None:
        super().__init__(inner)
        self._process = process
        self._tap = tap
        self._plant = plant
        self._seen = SeenSession()
        self._last = SentKind.OTHER

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`."""
        forbidden = self._seen.written(words, self._plant.rejected)
        sent = replace(_classified(words), forbidden=forbidden)
        self._tap.leaving(self._process, sent)
        self._last = sent.kind
        self._plant.announce(sent.text, words)
        with self._cut_off_noted():
            self._inner.write_command(words, admit)
        self._tap.passed(self._process, f"wire sent {sent.text}")

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`."""
        self._asks("read_head")
        with self._cut_off_noted():
            return self._inner.read_head()

    def read_response(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_response`."""
        self._asks("read_response")
        with self._cut_off_noted():
            words = self._inner.read_response()
        self._seen.answered(words)
        self._process.overtaken |= self._seen.overtaken and self._last in _CHANGING
        self._tap.passed(self._process, f"wire received {words[1]} {words[2]} {words[-2]:04x}")
        return words

    def read_slot(self, slot: int) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_slot`."""
        self._asks(f"read_slot {slot}")
        with self._cut_off_noted():
            return self._inner.read_slot(slot)

    def read_device(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_device`."""
        self._asks("read_device")
        with self._cut_off_noted():
            return self._inner.read_device()

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`."""
        self._asks("beat")
        with self._cut_off_noted():
            self._inner.beat(word)

    def reopened(self, *, timeout_s: float) -> "TappedMailboxLink":
        """See :meth:`robolink.transport.MailboxLink.reopened`."""
        inner = self._inner.reopened(timeout_s=timeout_s)
        return TappedMailboxLink(inner, self._process, self._tap, self._plant)

    def _asks(self, text: str) -> None:
        self._tap.leaving(self._process, SentRequest(SentKind.OTHER, text))
        self._plant.announce(text)

    @contextmanager
    def _cut_off_noted(self) -> Iterator[None]:
        try:
            yield
        except TransportError:
            self._process.cut_off = True
            raise


def _classified(words: Sequence[int]) -> SentRequest:
    opcode, operand = words[_OPCODE], words[_I0]
    try:
        name = Opcode(opcode).name
    except ValueError:
        name = str(opcode)
    kind = _KINDS.get(Opcode(opcode), SentKind.OTHER) if name != str(opcode) else SentKind.OTHER
    if opcode == Opcode.STOP and operand:
        kind = SentKind.OTHER  # it releases the hold
    if opcode == Opcode.JOG and not any(words[_I0 : _I0 + 2]):
        kind = SentKind.STOP  # it ends the jog
    tool = operand if kind in (SentKind.WRITE, SentKind.SELECT) else None
    carried = " ".join(f"{word:04x}" for word in words[_OPCODE : COMMAND_WORDS - 3])
    return SentRequest(kind, f"{name} {words[0]}: {carried}", tool)
