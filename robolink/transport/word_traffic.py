"""A mailbox link without bytes of its own, such as that of a simulator inside this process."""

from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from robolink.timing import Clock
from robolink.transport._mailbox_link import MailboxHead, MailboxLink
from robolink.transport.traffic import Traffic

_BYTES: Final = 2
"""Of a word."""

_WordsT = TypeVar("_WordsT", tuple[int, ...], MailboxHead)


class MailboxLinkAround:
    """The part of a :class:`~robolink.transport.MailboxLink` that is another one's as it is.

    Whoever sees what passes has it as base, and passes the exchanges on.

    Args:
        inner: Carries it all; owned by this.
    """

    def __init__(self, inner: MailboxLink) -> None:
        self._inner = inner

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

    def close(self) -> None:
        """See :meth:`robolink.transport.MailboxLink.close`."""
        self._inner.close()


class WordTraffic(MailboxLinkAround):
    """Implements :class:`~robolink.transport.MailboxLink` by another, and tells what passes.

    A word is told as two bytes, the high one first, as in the registers of a Modbus server.

    Args:
        inner: Moves the words; owned by this.
    """

    def __init__(self, inner: MailboxLink, traffic: Traffic | None = None) -> None:
        super().__init__(inner)
        self._traffic = traffic or Traffic(inner.identity, inner.clock)

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`."""

        def told() -> None:
            admit()
            self._sent("write command", words)

        self._inner.write_command(words, told)

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`."""
        return self._read("read head", self._inner.read_head)

    def read_response(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_response`."""
        return self._read("read response", self._inner.read_response)

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_slot`."""
        return self._read(f"read slot {slot}", lambda: self._inner.read_slot(slot))

    def read_device(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_device`."""
        return self._read("read device", self._inner.read_device)

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`."""
        self._sent("beat", (word,))
        self._inner.beat(word)

    def reopened(self, *, timeout_s: float) -> MailboxLink:
        """See :meth:`robolink.transport.MailboxLink.reopened`."""
        return WordTraffic(self._inner.reopened(timeout_s=timeout_s), self._traffic)

    def _sent(self, request: str, words: Sequence[int]) -> None:
        self._traffic.count += _BYTES * len(words)
        if self._traffic.listened():
            self._traffic.sent(_as_bytes(words), request=request)

    def _read(self, request: str, read: Callable[[], _WordsT]) -> _WordsT:
        words = read()
        self._traffic.count += _BYTES * len(words)
        if self._traffic.listened():
            self._traffic.received(_as_bytes(words), request=request)
        return words


def _as_bytes(words: Sequence[int]) -> bytes:
    return b"".join((word & 0xFFFF).to_bytes(2) for word in words)
