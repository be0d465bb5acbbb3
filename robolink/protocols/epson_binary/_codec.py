"""The two ends of a Remote RS232 line, without the line.

Theory of operation. The same as of the codec of Remote Ethernet: bytes go in through
:meth:`~EpsonBinaryCodec.receive_data` and events come out of
:meth:`~EpsonBinaryCodec.next_event`; events go in through :meth:`~EpsonBinaryCodec.send` and bytes
come out. The events are those of :mod:`robolink.protocols.epson_text`.

A host whose stream makes no sense is dead from there on: behind a broken frame nothing tells
where the next one begins, and the check sum of one byte lets one in 256 broken ones pass. A
device skips what begins no request, and refuses what is broken, as a controller has to.
"""

from typing import Literal

from robolink.errors import LocalProtocolError
from robolink.messages import tr
from robolink.protocols._role import Need, Role
from robolink.protocols.epson_binary._dialect import Dialect, Letters
from robolink.protocols.epson_binary._frames import EOT, FrameBuffer
from robolink.protocols.epson_binary._letters import letter_of
from robolink.protocols.epson_binary._messages import (
    is_array,
    read_answer,
    read_request,
    write_answer,
    write_request,
)
from robolink.protocols.epson_text import EpsonCodec, Event, Opening, Refusal, Reply, Request


class EpsonBinaryCodec(EpsonCodec):
    """One end of one serial line.

    Args:
        role: HOST sends requests, DEVICE answers them.
        dialect: What the manuals leave open.
        max_frame: Most bytes of one received frame.

    Example:
        >>> from robolink.protocols import Role
        >>> from robolink.protocols.epson_binary import EpsonBinaryCodec
        >>> EpsonBinaryCodec(Role.HOST).carries("GetStatus")
        True
    """

    __slots__ = ("_buffer", "_dialect")

    def __init__(
        self, role: Role, dialect: Dialect | None = None, *, max_frame: int = 65536
    ) -> None:
        self._dialect = dialect or Dialect()
        self._buffer = FrameBuffer(role, self._dialect, max_frame)
        super().__init__(role, self._buffer)

    @property
    def dialect(self) -> Dialect:
        """What it takes the manuals to mean."""
        return self._dialect

    def carries(self, name: str, *parameters: str) -> bool:
        """Whether a command has a letter that may be sent, and is no read of an array.

        How an array is asked for, no manual says clearly enough (docs/reference/epson.md 2.2).
        """
        letter = letter_of(name)
        guessed = self._dialect.letters is Letters.GUESSED
        if letter is None or not (letter.documented or guessed):
            return False
        return not (letter.name == "GetVariable" and is_array(parameters))

    def send(self, event: Event) -> bytes:
        """Return the bytes of one message.

        Raises:
            LocalProtocolError: The protocol, the dialect or this end's role forbids it.
            RemoteProtocolError: The codec is dead.
        """
        if self._failure is not None:
            raise self._failed_again(self._failure)
        if self._role is Role.HOST and isinstance(event, Opening):
            return bytes([EOT])
        if self._role is Role.HOST and isinstance(event, Request):
            return write_request(event, self._dialect)
        if self._role is Role.DEVICE and isinstance(event, (Reply, Refusal)):
            return write_answer(event, self._dialect)
        raise self._not_sent(event)

    def end_of_request(self) -> Event | None:
        """Take what is held for all that will come of a request, since the line went silent.

        Returns:
            The refusal that a broken request deserves; ``None`` where nothing is held.

        Raises:
            LocalProtocolError: Only a device waits for silence.
        """
        if self._role is Role.HOST:
            raise LocalProtocolError(
                tr("Only a device can take requests without an end."),
                remedy=tr("A host ends the session instead."),
            )
        frame = self._buffer.give_up()
        return None if frame is None else read_request(frame, self._dialect)

    def _next_event(self) -> Event | Literal[Need.DATA]:
        frame = self._buffer.take()
        if frame is not None:
            if frame.first == EOT:
                return Opening()
            if self._role is Role.DEVICE:
                return read_request(frame, self._dialect)
            return read_answer(frame, self._dialect)
        return self._at_the_end()
