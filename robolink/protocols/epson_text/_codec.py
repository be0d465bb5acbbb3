"""The two ends of a Remote Ethernet line, without the line.

Theory of operation. Bytes go in through :meth:`~EpsonTextCodec.receive_data`, events come
out of :meth:`~EpsonTextCodec.next_event`; events go in through
:meth:`~EpsonTextCodec.send`, bytes come out. The codec frames and checks syntax. Whether a
request is allowed now, and which reply answers which request, is for the layers above.

A stream that makes no sense ends the codec for good: what follows a broken message cannot
be told from the rest of it, and a reply taken for the wrong question moves a robot. So
every later call raises the same error again.

Cutting a stream into messages at CR, LF or CRLF.

The terminator is chosen in the controller's setup (docs/reference/epson.md 1.1), and a technician
may have chosen any; so all three end a message here, whichever we send ourselves. A message is
handed out at its CR, without waiting for an LF that may never come; an LF that follows is
dropped when it arrives. What a message is therefore never depends on how the stream was cut
into chunks.

A reply whose payload starts with a quote may hold line ends of its own. It lasts until a
quote is directly followed by a line end (docs/reference/epson.md 1.5).
"""

import codecs
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final, Literal, Never, Protocol

from robolink.errors import ConfigError, LocalProtocolError, RemoteProtocolError
from robolink.messages import tr
from robolink.protocols._role import NEED_DATA, Need, Role
from robolink.protocols.epson_text._events import (
    EndOfStream,
    Event,
    Refusal,
    Reply,
    Request,
)
from robolink.protocols.epson_text._messages import (
    BLANKS,
    next_request,
    read_answer,
    read_request,
    write_refusal,
    write_reply,
    write_request,
)

_HASH: Final = ord("#")
_QUOTE: Final = ord('"')
_CR: Final = ord("\r")
_LF: Final = ord("\n")


class MessageBuffer:
    """Holds what has arrived and hands out whole messages without their terminator.

    Memory is bounded by ``max_line`` plus one chunk as long as :meth:`take` is called until
    it returns ``None`` after each :meth:`append`.

    Attributes:
        data: The bytes that no message has used yet.

    Args:
        max_line: Most bytes of one message.
        quoted_replies: Whether messages may be replies with a quoted payload.
        next_message: Finds where, from an index on, the next message begins that follows
            without a line end; -1 for nowhere. None: no message does.
    """

    __slots__ = (
        "_ended",
        "_max_line",
        "_next_message",
        "_opening",
        "_quoted_replies",
        "_scanned",
        "_skip_lf",
        "data",
    )

    def __init__(
        self,
        max_line: int,
        *,
        quoted_replies: bool,
        next_message: Callable[[bytearray, int], int] | None = None,
    ) -> None:
        self.data = bytearray()
        self._max_line = max_line
        self._quoted_replies = quoted_replies
        self._scanned = 0  # nothing before this index can end the message
        self._opening = 0  # index of the opening quote, 0 while none is known
        self._skip_lf = False  # the last message ended in CR; its LF may still come
        self._next_message = next_message
        self._ended = False  # the last message ended without a line end, which may still come

    @property
    def held(self) -> bytes:
        """A copy of them."""
        return bytes(self.data)

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
        self.data += data

    def end_message(self) -> None:
        """Make what is held a complete message, as if its terminator had come."""
        if self.data and self.data[-1] not in (_CR, _LF):
            self.data.append(_LF)
            self._ended = True

    def take(self) -> bytes | None:
        """Return the next whole message, ``None`` when there is none yet.

        Raises:
            RemoteProtocolError: The message is longer than the limit.
        """
        end = self._find_end()
        if (len(self.data) if end < 0 else end) > self._max_line:
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
                self._scanned = len(self.data)
                return -1
            if self._quoted_replies:
                self._opening = self._opening_quote(end)
            if not self._opening:
                return end if self._next_message is None else self._sooner(end, self._next_message)
            self._scanned = self._opening + 1
        closing = self._earliest(b'"\r', b'"\n')
        if closing < 0:
            # The last byte may be the closing quote, with its line end still to come.
            self._scanned = max(self._opening + 1, len(self.data) - 1)
            return -1
        return closing + 1

    def _sooner(self, end: int, next_message: Callable[[bytearray, int], int]) -> int:
        """Return where a message that has no line end of its own ends before ``end``."""
        following = next_message(self.data, 1)
        return following if 0 < following < end else end

    def _earliest(self, first: bytes, second: bytes) -> int:
        one = self.data.find(first, self._scanned)
        if one < 0:
            return self.data.find(second, self._scanned)
        other = self.data.find(second, self._scanned, one)
        return one if other < 0 else other

    def _opening_quote(self, end: int) -> int:
        """Return the index of the quote that opens the payload of the line, 0 for none."""
        data = self.data
        if data[0] != _HASH:
            return 0
        opening = data.find(b",", 0, end) + 1
        return opening if opening and data[opening] == _QUOTE else 0

    def _cut(self, end: int) -> bytes:
        data = self.data
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


_TERMINATORS: Final = (b"\r\n", b"\r", b"\n")

_ENCODINGS: Final = frozenset(
    codecs.lookup(name).name
    for name in ("latin-1", "cp1252", "utf-8", "shift_jis", "cp932", "gb18030", "big5")
)
"""Encodings in which no multi-byte character contains the byte of a comma, a quote or a line end.
"""


class _Held(Protocol):
    """What has arrived, until it becomes an event."""

    data: bytearray
    """The bytes that no event has used yet."""

    @property
    def held(self) -> bytes:
        """A copy of them."""

    def append(self, data: bytes) -> None:
        """Add what was received."""


class EpsonCodec(ABC):
    """One end of one line to a controller, whatever the frames on it are.

    Args:
        role: HOST sends requests, DEVICE answers them.
        buffer: Keeps what has arrived.
    """

    __slots__ = ("_arrived", "_ended", "_failure", "_hosts", "_role")

    def __init__(self, role: Role, buffer: _Held) -> None:
        self._role = role
        self._hosts = role is Role.HOST  # asked with every message
        self._arrived = buffer
        self._ended = False
        self._failure: RemoteProtocolError | None = None

    def __repr__(self) -> str:
        # The bytes held may be a login, so only their length is shown.
        return f"<{type(self).__name__} {self._role.name} holding {len(self._arrived.held)} bytes>"

    @property
    def bytes_held(self) -> bytes:
        """What has arrived and is part of no event yet, for errors about half a reply."""
        return self._arrived.held

    def receive_data(self, data: bytes) -> None:
        """Accept received data; ``b""`` means that the far side closed.

        Raises:
            LocalProtocolError: Bytes after the end of the stream.
            RemoteProtocolError: The codec is dead.
        """
        if self._failure is not None:
            raise self._failed_again(self._failure)
        if not data:
            self._ended = True
        elif self._ended:
            raise LocalProtocolError(
                tr("Bytes cannot follow the end of the stream."),
                remedy=tr("Use a new codec for a new connection."),
            )
        else:
            self._arrived.append(data)

    def next_event(self) -> Event | Literal[Need.DATA]:
        """Return the next event, or ``NEED_DATA``.

        After the far side closed between two messages: ``EndOfStream``, each time.

        Raises:
            RemoteProtocolError: The stream makes no sense, or ended inside a message; the
                codec is dead from here on.
        """
        if self._failure is not None:
            raise self._failed_again(self._failure)
        if not self._arrived.data and not self._ended:
            return NEED_DATA  # called twice in every exchange, and mostly true
        try:
            return self._next_event()
        except RemoteProtocolError as error:
            if not self._hosts:
                error.raw = b""  # it may hold a password
            self._failure = error
            raise

    @abstractmethod
    def carries(self, name: str, *parameters: str) -> bool:
        """Whether a command can be sent, with these parameters where any are given."""

    @abstractmethod
    def send(self, event: Event) -> bytes:
        """Return the bytes of one message.

        Raises:
            LocalProtocolError: The protocol, or this end's role, forbids it.
            RemoteProtocolError: The codec is dead.
        """

    @abstractmethod
    def _next_event(self) -> Event | Literal[Need.DATA]:
        """Cut the next event out of what has arrived."""

    def _at_the_end(self) -> EndOfStream | Literal[Need.DATA]:
        """Return the event for the end of data without a whole message."""
        if not self._ended:
            return NEED_DATA
        if held := self._arrived.held:
            raise RemoteProtocolError(
                tr("The connection ended inside a message."),
                remedy=tr("Check cable and power of the controller, then try again."),
                raw=held,
            )
        return EndOfStream()

    def _not_sent(self, event: Event) -> LocalProtocolError:
        return LocalProtocolError(
            tr(
                "A {role} does not send {kind}.",
                role=self._role.name.lower(),
                kind=type(event).__name__,
            ),
            remedy=tr("A host sends requests; a device sends replies and refusals."),
        )

    @staticmethod
    def _failed_again(failure: RemoteProtocolError) -> RemoteProtocolError:
        """Return the error of a codec that has failed."""
        return RemoteProtocolError(failure.what, remedy=failure.remedy, raw=failure.raw)


class EpsonTextCodec(EpsonCodec):
    r"""One end of one connection.

    Receiving accepts CR, LF and CRLF whatever ``terminator`` is, and any cut of the stream
    into chunks gives the same events. As HOST, one empty line directly after an answer is
    skipped: a controller set to LF CR, or one that puts Print's own line end behind the
    closing quote, leaves such a line. Any other empty line is an error. As DEVICE, an empty
    line is a request without ``$``.

    A quoted text is handed out without one line end at its end, whether or not the
    controller prints one before the closing quote (docs/reference/epson.md 1.5). A quote directly
    followed by a line end ends the text, even if the controller meant it as part of it.

    Args:
        role: HOST sends requests, DEVICE answers them.
        terminator: What ends the messages sent: CR, LF or CRLF.
        max_line: Most bytes of one received message.
        encoding: Of names and texts. Controllers print in the code page of their language
            (cp1252, Shift-JIS, GB18030, Big5; docs/reference/epson.md 1.1); the default, latin-1,
            loses no byte. A byte outside the encoding is shown as ``\xNN``.
        unterminated: DEVICE only: a request may lack its terminator, as one controller was
            seen to accept (docs/reference/epson.md 1.1). It ends where the next one begins, or with
            :meth:`end_of_request`.
        skips_blanks: DEVICE only: blanks before the ``$`` of a request are skipped. Else they are
            what the request begins with, so that it is refused with error 10.

    Raises:
        ConfigError: An argument is none of these.

    Example:
        >>> from robolink.protocols import Role
        >>> from robolink.protocols.epson_text import EpsonTextCodec
        >>> device = EpsonTextCodec(Role.DEVICE, terminator=bytes([13]))
        >>> device.receive_data("$GetStatus".encode() + bytes([13, 10]))
        >>> device.next_event().name
        'GetStatus'
    """

    __slots__ = (
        "_blank_allowed",
        "_buffer",
        "_encoding",
        "_skips_blanks",
        "_terminator",
        "_unterminated",
    )

    def __init__(
        self,
        role: Role,
        *,
        terminator: bytes = b"\r\n",
        max_line: int = 65536,
        encoding: str = "latin-1",
        unterminated: bool = False,
        skips_blanks: bool = False,
    ) -> None:
        if terminator not in _TERMINATORS:
            _misconfigured(tr("{value!r} is not CR, LF or CRLF.", value=terminator))
        if unterminated and role is Role.HOST:
            _misconfigured(tr("Only a device can take requests without a line end."))
        self._terminator = terminator
        self._encoding = _known_encoding(encoding)
        self._unterminated = unterminated
        self._skips_blanks = skips_blanks
        self._buffer = MessageBuffer(
            max_line,
            quoted_replies=role is Role.HOST,
            next_message=next_request if unterminated else None,
        )
        super().__init__(role, self._buffer)
        self._blank_allowed = False

    def carries(self, name: str, *parameters: str) -> bool:  # noqa: ARG002 - the text form carries all commands
        """Return whether a command can be sent: here all, known or not to the firmware."""
        return bool(name)

    def send(self, event: Event) -> bytes:
        """Return the bytes of one message.

        Raises:
            LocalProtocolError: The protocol, or this end's role, forbids it.
            RemoteProtocolError: The codec is dead.
        """
        if self._failure is not None:
            raise self._failed_again(self._failure)
        if self._hosts:
            if isinstance(event, Request):
                return write_request(event) + self._terminator
        elif isinstance(event, Reply):
            return write_reply(event, self._encoding) + self._terminator
        elif isinstance(event, Refusal):
            return write_refusal(event, self._encoding) + self._terminator
        raise self._not_sent(event)

    def end_of_request(self) -> None:
        """Treat what is held as a complete request, since nothing has followed for a while.

        A line end that follows all the same belongs to that request.

        Raises:
            LocalProtocolError: The codec was made without ``unterminated``.
            RemoteProtocolError: The codec is dead.
        """
        if self._failure is not None:
            raise self._failed_again(self._failure)
        if not self._unterminated:
            raise LocalProtocolError(
                tr("This codec takes no request without its line end."),
                remedy=tr("Make it with unterminated=True."),
            )
        self._buffer.end_message()

    def _next_event(self) -> Event | Literal[Need.DATA]:
        while (line := self._buffer.take()) is not None:
            if not self._hosts:
                if self._skips_blanks:
                    line = line.lstrip(BLANKS)
                return read_request(line, self._encoding)
            if line:
                self._blank_allowed = True
                return read_answer(line, self._encoding)
            if not self._blank_allowed:
                raise RemoteProtocolError(
                    tr("An empty line came where an answer was expected."),
                    remedy=tr("Set the terminator to CRLF in the controller's setup."),
                )
            self._blank_allowed = False
        return self._at_the_end()


def _known_encoding(name: str) -> str:
    try:
        found = codecs.lookup(name).name
    except LookupError:
        found = ""
    if found not in _ENCODINGS:
        _misconfigured(tr("{name!r} is not an encoding of EPSON controllers.", name=name))
    return found


def _misconfigured(what: str) -> Never:
    raise ConfigError(what, remedy=tr("Correct the codec's arguments."))
