"""Cutting a stream into messages at CR, LF or CRLF.

The terminator is chosen in the controller's setup (docs/reference/epson.md 1.1), and a technician
may have chosen any; so all three end a message here, whichever we send ourselves. A message is
handed out at its CR, without waiting for an LF that may never come; an LF that follows is
dropped when it arrives. What a message is therefore never depends on how the stream was cut
into chunks.

A reply whose payload starts with a quote may hold line ends of its own. It lasts until a
quote is directly followed by a line end (docs/reference/epson.md 1.5).
"""

from collections.abc import Callable
from typing import Final

from robolink.errors import RemoteProtocolError
from robolink.messages import tr

_HASH: Final = ord("#")
_QUOTE: Final = ord('"')
_CR: Final = ord("\r")
_LF: Final = ord("\n")


class MessageBuffer:
    """Holds what has arrived and hands out whole messages without their terminator.

    Memory is bounded by ``max_line`` plus one chunk as long as :meth:`take` is called until
    it returns ``None`` after each :meth:`append`.

    Args:
        max_line: Most bytes of one message.
        quoted_replies: Whether messages may be replies with a quoted payload.
        next_message: Finds where, from an index on, the next message begins that follows
            without a line end; -1 for nowhere. None: no message does.
    """

    __slots__ = (
        "_data",
        "_ended",
        "_max_line",
        "_next_message",
        "_opening",
        "_quoted_replies",
        "_scanned",
        "_skip_lf",
    )

    def __init__(
        self,
        max_line: int,
        *,
        quoted_replies: bool,
        next_message: Callable[[bytearray, int], int] | None = None,
    ) -> None:
        self._data = bytearray()
        self._max_line = max_line
        self._quoted_replies = quoted_replies
        self._scanned = 0  # nothing before this index can end the message
        self._opening = 0  # index of the opening quote, 0 while none is known
        self._skip_lf = False  # the last message ended in CR; its LF may still come
        self._next_message = next_message
        self._ended = False  # the last message ended without a line end, which may still come

    @property
    def held(self) -> bytes:
        """The bytes that no message has used yet."""
        return bytes(self._data)

    def __bool__(self) -> bool:
        return bool(self._data)

    def append(self, data: bytes) -> None:
        """Add what was received."""
        if self._ended and data:
            self._ended = False
            self._skip_lf = data[0] == _CR
            data = data[1:] if data[0] in (_CR, _LF) else data
        if self._skip_lf and data:
            self._skip_lf = False
            if data[0] == _LF:
                data = data[1:]
        self._data += data

    def end_message(self) -> None:
        """Make what is held a complete message, as if its terminator had come."""
        if self._data and self._data[-1] not in (_CR, _LF):
            self._data.append(_LF)
            self._ended = True

    def take(self) -> bytes | None:
        """Return the next whole message, ``None`` when there is none yet.

        Raises:
            RemoteProtocolError: The message is longer than the limit.
        """
        end = self._find_end()
        if (len(self._data) if end < 0 else end) > self._max_line:
            raise RemoteProtocolError(
                tr("A message is longer than {limit} bytes.", limit=self._max_line),
                remedy=tr("Check that this port is the controller's Remote Ethernet port."),
                raw=self.held,
            )
        return None if end < 0 else self._cut(end)

    def _find_end(self) -> int:
        if not self._opening:
            end = self._earliest(b"\r", b"\n")
            if end < 0:
                self._scanned = len(self._data)
                return -1
            if self._quoted_replies:
                self._opening = self._opening_quote(end)
            if not self._opening:
                return end if self._next_message is None else self._sooner(end, self._next_message)
            self._scanned = self._opening + 1
        closing = self._earliest(b'"\r', b'"\n')
        if closing < 0:
            # The last byte may be the closing quote whose line end is still to come.
            self._scanned = max(self._opening + 1, len(self._data) - 1)
            return -1
        return closing + 1

    def _sooner(self, end: int, next_message: Callable[[bytearray, int], int]) -> int:
        """Return where a message that has no line end of its own ends before ``end``."""
        following = next_message(self._data, 1)
        return following if 0 < following < end else end

    def _earliest(self, first: bytes, second: bytes) -> int:
        one = self._data.find(first, self._scanned)
        if one < 0:
            return self._data.find(second, self._scanned)
        other = self._data.find(second, self._scanned, one)
        return one if other < 0 else other

    def _opening_quote(self, end: int) -> int:
        """Return the index of the quote that opens the payload of the line, 0 for none."""
        data = self._data
        if data[0] != _HASH:
            return 0
        opening = data.find(b",", 0, end) + 1
        return opening if opening and data[opening] == _QUOTE else 0

    def _cut(self, end: int) -> bytes:
        data = self._data
        message = bytes(data[:end])
        used = end + (data[end] in (_CR, _LF))
        if data[end] == _CR:
            if used == len(data):
                self._skip_lf = True
            elif data[used] == _LF:
                used += 1
        del data[:used]
        self._scanned = self._opening = 0
        return message
