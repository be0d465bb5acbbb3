"""The two ends of a Remote RS232 line, without the line.

Theory of operation. The same as of the codec of Remote Ethernet: bytes go in through
:meth:`~EpsonBinaryCodec.receive_data` and events come out of
:meth:`~EpsonBinaryCodec.next_event`; events go in through :meth:`~EpsonBinaryCodec.send` and bytes
come out. The events are those of :mod:`robolink.protocols.epson_text`.

A host whose stream makes no sense is dead from there on: behind a broken frame nothing tells
where the next one begins, and the check sum of one byte lets one in 256 broken ones pass. A
device skips what begins no request, and refuses what is broken, as a controller has to.

What stands in a frame, as the events of Remote Ethernet, and back.
"""

import re
from collections.abc import Sequence
from typing import Final, Literal

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.messages import tr
from robolink.protocols._role import Need, Role
from robolink.protocols.epson_binary._frames import (
    ACK,
    BY_BYTE,
    EOT,
    NAK,
    STX,
    Data,
    Dialect,
    FrameBuffer,
    Letter,
    Letters,
    NakCode,
    Numbers,
    SerialFrame,
    framed,
    letter_of,
    width,
)
from robolink.protocols.epson_text import (
    BadRequest,
    EpsonCodec,
    ErrorCode,
    Event,
    Opening,
    Refusal,
    Reply,
    Request,
)

_ENCODING: Final = "latin-1"
_LARGEST_CODE: Final = {NakCode.DIGITS: 99, NakCode.BINARY: 0xFFFF}
_STATUS: Final = re.compile(rb"([\x00\x01]{10,11}),?([0-9]{4})", re.DOTALL)
_VARIABLE: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def write_request(request: Request, dialect: Dialect) -> bytes:
    """Return the frame of a request.

    Raises:
        LocalProtocolError: Remote RS232 has no letter for it, or none that a manual prints, or
            the frame cannot carry its parameters. No message repeats a password.
    """
    letter = _sendable(request.name, dialect)
    parameters = request.parameters
    if letter.name == "GetVariable":
        parameters = _scalar(parameters)
    if len(parameters) != len(letter.request):
        raise _refused(request.name, tr("it has the wrong number of parameters"))
    data = b"".join(
        _written(request.name, part, text, dialect)
        for part, text in zip(letter.request, parameters, strict=True)
    )
    return framed(STX, letter.byte, data)


def write_answer(answer: Reply | Refusal, dialect: Dialect) -> bytes:
    """Return the frame of an answer.

    Raises:
        LocalProtocolError: The frame cannot carry it.
    """
    letter = letter_of(answer.name)
    if isinstance(answer, Refusal):
        # A refusal repeats the letter received, known or not (docs/reference/epson.md 2.1). A
        # message that was no frame has no letter, and the manual does not say what is sent then.
        echoed = letter.byte if letter is not None else ord(answer.name[:1] or "\0")
        return framed(NAK, echoed, _code(answer, dialect))
    if letter is None:
        raise _refused(answer.name, tr("it has no letter"))
    if not letter.reply:
        return framed(ACK, letter.byte, b"")
    part = letter.reply[0]
    if part is Data.QUOTED:
        return framed(ACK, letter.byte, _printed(answer))
    if part is Data.STATUS:
        return framed(ACK, letter.byte, _status_data(answer, dialect))
    text = ",".join(answer.fields)
    return framed(ACK, letter.byte, _written(answer.name, part, text, dialect))


def read_answer(frame: SerialFrame, dialect: Dialect) -> Reply | Refusal:
    """Return the message of a device.

    Raises:
        RemoteProtocolError: The check sum is wrong, or it makes no sense.
    """
    if not frame.intact:
        raise _no_answer(
            frame,
            tr("The check sum of an answer is wrong."),
            tr("Check the cable and its shield, and the port's settings, then try again."),
        )
    letter = BY_BYTE.get(frame.letter)
    if frame.first == NAK:
        return Refusal("" if letter is None else letter.name, _read_code(frame, dialect))
    if letter is None:
        raise _no_answer(
            frame,
            tr(
                "An answer came with a letter that is not known: {letter:#04x}.",
                letter=frame.letter,
            ),
            tr("Connect again; if it happens twice, report it with the firmware version."),
        )
    if not letter.reply:
        return Reply(letter.name, ("0",))
    match letter.reply[0]:
        case Data.QUOTED:
            return _read_printed(frame, letter)
        case Data.STATUS:
            return _read_status(frame, letter)
        case Data.TEXT:
            return Reply(letter.name, tuple(frame.data.decode(_ENCODING).split(",")))
        case part:
            return Reply(letter.name, (_number_text(frame, part, dialect),))


def read_request(frame: SerialFrame, dialect: Dialect) -> Request | BadRequest:
    """Return the request of a host; a senseless one becomes the refusal that it deserves."""
    letter = BY_BYTE.get(frame.letter)
    name = "" if letter is None else letter.name
    if not frame.intact:
        return BadRequest(name, ErrorCode.CHECKSUM)
    if letter is None or (not letter.documented and dialect.letters is Letters.DOCUMENTED):
        return BadRequest(name or chr(frame.letter), ErrorCode.UNKNOWN_COMMAND)
    parameters: list[str] = []
    at = 0
    for part in letter.request:
        taken = width(part, dialect) or len(frame.data) - at
        text = _read_part(frame.data[at : at + taken], part, dialect)
        if text is None:
            return BadRequest(name, ErrorCode.MALFORMED)
        parameters.append(text)
        at += taken
    return Request(name, tuple(parameters))


def _sendable(name: str, dialect: Dialect) -> Letter:
    letter = letter_of(name)
    if letter is None:
        raise LocalProtocolError(
            tr("Remote RS232 has no {name}.", name=name),
            remedy=tr("Nothing was sent. Use Remote Ethernet for it."),
            request=name,
        )
    if not letter.documented and dialect.letters is Letters.DOCUMENTED:
        raise LocalProtocolError(
            tr("No manual prints the letter of {name} on Remote RS232.", name=name),
            remedy=tr(
                "Nothing was sent. Use Remote Ethernet, or allow letters=guessed once the "
                "controller was seen to understand it."
            ),
            request=name,
        )
    return letter


def is_array(parameters: Sequence[str]) -> bool:
    """Whether a GetVariable asks for elements of an array: name, type and count."""
    return len(parameters) > 2


def _scalar(parameters: tuple[str, ...]) -> tuple[str, ...]:
    """A single variable needs its name alone (docs/reference/epson.md 1.2, note 4).

    How elements of an array and their count are written together is not said clearly enough.
    """
    if is_array(parameters) or not parameters or not _VARIABLE.fullmatch(parameters[0]):
        raise _refused("GetVariable", tr("only a single variable can be read there, not an array"))
    return parameters[:1]


def _written(name: str, part: Data, text: str, dialect: Dialect) -> bytes:
    if part is Data.QUOTED:
        return b'"' + _text(name, text) + b'"'
    size = width(part, dialect)
    if not size:
        return _text(name, text)
    count = size if dialect.numbers is Numbers.BINARY else size // 2
    value = _integer(text, 16 if part in (Data.HEX_BYTE, Data.HEX_WORD) else 10)
    if value is None or value >= 1 << 8 * count:
        raise _refused(
            name,
            tr("{text!r} is not 0 to {most}", text=text[:20], most=(1 << 8 * count) - 1),
        )
    if dialect.numbers is Numbers.BINARY:
        return value.to_bytes(count, "big")
    return f"{value:0{size}X}".encode("ascii")


def _text(name: str, text: str) -> bytes:
    if not (text.isascii() and text.isprintable()) and text:
        raise _refused(name, tr("it holds a character that is not printable ASCII"))
    if '"' in text and name == "Execute":
        raise _refused(name, tr("a statement holds no quote"))
    return text.encode("ascii")


def _integer(text: str, base: int) -> int | None:
    digits = "0123456789abcdef"[:base]
    return int(text, base) if text and not text.lower().strip(digits) else None


def _read_part(data: bytes, part: Data, dialect: Dialect) -> str | None:
    if part is Data.TEXT:
        return data.decode(_ENCODING)
    if part is Data.QUOTED:
        quoted = len(data) >= 2 and data[:1] == data[-1:] == b'"'
        return data[1:-1].decode(_ENCODING) if quoted else None
    value = _value(data, dialect)
    if value is None:
        return None
    if part in (Data.HEX_BYTE, Data.HEX_WORD):
        return f"{value:0{2 if part is Data.HEX_BYTE else 4}X}"
    return str(value)


def _value(data: bytes, dialect: Dialect) -> int | None:
    if dialect.numbers is Numbers.BINARY:
        return int.from_bytes(data, "big")
    return _integer(data.decode(_ENCODING), 16)


def _number_text(frame: SerialFrame, part: Data, dialect: Dialect) -> str:
    text = _read_part(frame.data, part, dialect)
    if text is None:
        raise _no_answer(
            frame,
            tr("A number is not written in hexadecimal digits: {data!r}.", data=frame.data),
            tr("Set numbers=binary for this line, then connect again."),
        )
    return text


def _printed(answer: Reply) -> bytes:
    if answer.text is None:
        return b""
    try:
        return b'"' + answer.text.encode(_ENCODING) + b'"'
    except UnicodeEncodeError as error:
        raise _refused(
            answer.name, tr("{encoding} lacks a character", encoding=_ENCODING)
        ) from error


def _read_printed(frame: SerialFrame, letter: Letter) -> Reply:
    """Nothing, or the ``0`` of Remote Ethernet, is the answer to what printed nothing."""
    data = frame.data
    if data in (b"", b"0"):
        return Reply(letter.name, ("0",))
    if len(data) < 2 or data[:1] != b'"' or data[-1:] != b'"':
        raise _no_answer(
            frame,
            tr("What was printed is not in quotes: {data!r}.", data=data[:40]),
            tr("Connect again; if it happens twice, report it with the firmware version."),
        )
    text = data[1:-1].decode(_ENCODING)
    return Reply(letter.name, text=text.removesuffix("\n").removesuffix("\r"))


def _status_data(answer: Reply, dialect: Dialect) -> bytes:
    flags, code = answer.fields
    return bytes(int(flag) for flag in flags[-dialect.status_flags :]) + code.encode("ascii")


def _read_status(frame: SerialFrame, letter: Letter) -> Reply:
    found = _STATUS.fullmatch(frame.data)
    if found is None:
        raise _no_answer(
            frame,
            tr("{reply!r} is not a status.", reply=frame.data[:40]),
            tr("Connect again; if it happens twice, report it with the firmware version."),
        )
    flags = "".join(str(flag) for flag in found[1])
    return Reply(letter.name, (flags, found[2].decode("ascii")))


def _code(refusal: Refusal, dialect: Dialect) -> bytes:
    most = _LARGEST_CODE[dialect.nak_code]
    if not 0 <= refusal.code <= most:
        raise _refused(refusal.name, tr("its code is not 0 to {limit}", limit=most))
    if dialect.nak_code is NakCode.DIGITS:
        return f"{refusal.code:02d}".encode("ascii")
    return int(refusal.code).to_bytes(2, "big")


def _read_code(frame: SerialFrame, dialect: Dialect) -> int:
    if dialect.nak_code is NakCode.BINARY:
        return int.from_bytes(frame.data, "big")
    if not frame.data.isdigit():
        raise _no_answer(
            frame,
            tr("The code of a refusal is not two digits: {data!r}.", data=frame.data),
            tr("Set nak_code=binary for this line, then connect again."),
        )
    return int(frame.data)


def _no_answer(frame: SerialFrame, what: str, remedy: str) -> RemoteProtocolError:
    raw = bytes([frame.first, frame.letter]) + frame.data[:80]
    return RemoteProtocolError(what, remedy=remedy, raw=raw)


def _refused(name: str, why: str) -> LocalProtocolError:
    return LocalProtocolError(
        tr("{name} cannot be sent: {why}.", name=name, why=why),
        remedy=tr("Nothing was sent. Correct the parameters."),
        request=name,
    )


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
        """Its reading of the manuals."""
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
        """Treat what is held as a complete request, since the line went silent.

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
