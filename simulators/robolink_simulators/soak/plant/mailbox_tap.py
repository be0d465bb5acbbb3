"""A link to a PLC's mailbox on which the adversary sees everything, whatever carries it."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink.protocols.mailbox import COMMAND, COMMAND_WORDS, Opcode, Words
from robolink.timing import Clock
from robolink.transport import MailboxHead, MailboxLink
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.plant.machine import SentKind, SentRequest, WireTap

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


class TappedMailboxLink:
    """Implements :class:`robolink.transport.MailboxLink` around another one.

    Args:
        inner: Carries it all.
        process: Whose link it is.
        tap: Told of everything.
        announce: Told of each request in words, before it leaves.
    """

    def __init__(
        self,
        inner: MailboxLink,
        process: VirtualProcess,
        tap: WireTap,
        announce: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self._inner = inner
        self._process = process
        self._tap = tap
        self._announce = announce

    @property
    def identity(self) -> str:
        """The inner link's."""
        return self._inner.identity

    @property
    def place(self) -> str:
        """The inner link's."""
        return self._inner.place

    @property
    def durable(self) -> bool:
        """The inner link's."""
        return self._inner.durable

    @property
    def clock(self) -> Clock:
        """The inner link's."""
        return self._inner.clock

    @property
    def whole_look_s(self) -> float:
        """The inner link's."""
        return self._inner.whole_look_s

    def write_command(self, words: Sequence[int]) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`."""
        sent = _classified(words)
        self._tap.leaving(self._process, sent)
        self._announce(sent.text)
        self._inner.write_command(words)
        self._tap.passed(self._process, f"wire sent {sent.text}")

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`."""
        self._asks("read_head")
        return self._inner.read_head()

    def read_response(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_response`."""
        self._asks("read_response")
        words = self._inner.read_response()
        self._tap.passed(self._process, f"wire received {words[1]} {words[2]} {words[-2]:04x}")
        return words

    def read_slot(self, slot: int) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_slot`."""
        self._asks(f"read_slot {slot}")
        return self._inner.read_slot(slot)

    def read_device(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_device`."""
        self._asks("read_device")
        return self._inner.read_device()

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`."""
        self._asks("beat")
        self._inner.beat(word)

    def reopened(self, *, timeout_s: float) -> "TappedMailboxLink":
        """See :meth:`robolink.transport.MailboxLink.reopened`."""
        inner = self._inner.reopened(timeout_s=timeout_s)
        return TappedMailboxLink(inner, self._process, self._tap, self._announce)

    def close(self) -> None:
        """See :meth:`robolink.transport.MailboxLink.close`."""
        self._inner.close()

    def _asks(self, text: str) -> None:
        self._tap.leaving(self._process, SentRequest(SentKind.OTHER, text))
        self._announce(text)


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
