"""A stream of lines. The same bytes give the same lines however they are cut."""

from collections import deque

from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.protocols._role import NEED_DATA, Need
from robolink.protocols.spel_callback._lines import LONGEST_LINE, CallbackLine, decode_line

_END = b"\r\n"


class CallbackCodec:
    """Takes bytes, gives lines. One that was no line ends it for good: nothing is guessed."""

    def __init__(self) -> None:
        self._held = bytearray()
        self._lines: deque[bytes] = deque()
        self._failed: RemoteProtocolError | None = None

    def receive(self, data: bytes) -> None:
        """Take what came. Memory is bounded by one line beyond what was given."""
        if self._failed is not None:
            return
        self._held += data
        *lines, rest = bytes(self._held).split(_END)
        self._lines.extend(lines)
        self._held[:] = rest[: LONGEST_LINE + 2]

    def next_event(self) -> CallbackLine | Need:
        """Return the next line, or ``NEED_DATA``.

        Raises:
            RemoteProtocolError: What came is no line; from then on always.
        """
        if self._failed is not None:
            raise self._failed
        try:
            if self._lines:
                return decode_line(self._lines.popleft())
            if len(self._held) > LONGEST_LINE + 1:
                raise RemoteProtocolError(
                    tr("A line is longer than {count} characters.", count=LONGEST_LINE),
                    raw=bytes(self._held),
                )
        except RemoteProtocolError as error:
            self._failed = error
            self._lines.clear()
            self._held.clear()
            raise
        return NEED_DATA
