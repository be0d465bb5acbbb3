"""Cutting the stream of a serial line into frames, by length and check sum.

A frame is a first byte (STX for a request, ACK for a success, NAK for a refusal), a letter, data,
ETX, and the XOR of everything from the letter through ETX (docs/reference/epson.md 2.1). Numbers
in the data may be 02, 03, 06 or 15, so no byte is ever searched for where the letter tells how
long the data is. Text has no length; it ends at the first ETX behind which the right check sum
stands, a quoted one only behind its closing quote. What a frame is therefore never depends on how
the stream was cut into chunks.

What the manuals leave open about Remote RS232, each as an option with its evidence.

Source: docs/reference/epson.md 2.

Every command that has a letter on Remote RS232, and what stands behind it.

Source: docs/reference/epson.md 2.2. A command that is missing has no letter in any manual: the
queries about the controller itself and the alarms.
"""

from dataclasses import dataclass
from enum import Enum, StrEnum, auto
from functools import reduce
from operator import xor
from types import MappingProxyType
from typing import Final, Literal

from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.protocols._role import Role


class Numbers(StrEnum):
    """How a number of one or two bytes is written.

    Three of the four languages of the manual print Start main as ``02 47 00 03 44``, one prints
    ``02 47 30 30 03 44``. Equal pairs cancel in an XOR, so the check sum of no published example
    tells them apart.
    """

    BINARY = "binary"
    """Most significant byte first."""
    ASCII_HEX = "ascii_hex"
    """Two hexadecimal digits for each byte."""


class NakCode(StrEnum):
    """How the two bytes of a refusal's code are written; the manual says only how many."""

    DIGITS = "digits"
    """Two decimal digits, just as GetStatus writes its code in four."""
    BINARY = "binary"
    """A binary number, most significant byte first."""


class Letters(StrEnum):
    """Which letters are sent."""

    DOCUMENTED = "documented"
    """Only letters that a manual prints."""
    GUESSED = "guessed"
    """Also the upper-case counterparts of read commands for writing, and A for Abort: a pattern
    that every printed pair follows, but that is stated nowhere."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """One reading of the manual, the same at both ends of a line.

    Attributes:
        numbers: How numbers are written.
        nak_code: How the code of a refusal is written.
        letters: Which letters may be sent.
        status_flags: How many flags a device tells: ten with RC+ 5, whose manual prints them;
            eleven, with Test, are likely since RC+ 7. A host takes both.
        word_port_bytes: Of how many bytes the number of a port of words is; one is printed for a
            port of bytes, nothing for a port of words.
    """

    numbers: Numbers = Numbers.BINARY
    nak_code: NakCode = NakCode.DIGITS
    letters: Letters = Letters.DOCUMENTED
    status_flags: Literal[10, 11] = 10
    word_port_bytes: Literal[1, 2] = 1


class Data(Enum):
    """The kind of one part of a message."""

    BYTE = auto()
    """A number of one byte."""
    WORD = auto()
    """A number of two bytes."""
    WORD_PORT = auto()
    """The number of a word port; its length depends on the dialect."""
    HEX_BYTE = auto()
    """One byte that Remote Ethernet prints as two hexadecimal digits."""
    HEX_WORD = auto()
    """Two bytes that Remote Ethernet prints as four hexadecimal digits."""
    TEXT = auto()
    """Text to the end of the message."""
    QUOTED = auto()
    """Text between quotes, or nothing."""
    STATUS = auto()
    """Flags, one byte each, and four decimal digits."""


@dataclass(frozen=True, slots=True)
class Letter:
    """One command.

    Attributes:
        name: Its name on Remote Ethernet.
        byte: The byte on the wire.
        request: What follows in a request.
        reply: What follows in a success.
        documented: Whether a manual prints the letter; else it follows a pattern.
    """

    name: str
    byte: int
    request: tuple[Data, ...] = ()
    reply: tuple[Data, ...] = ()
    documented: bool = True


def _letter(
    name: str, letter: str, request: tuple[Data, ...] = (), reply: tuple[Data, ...] = ()
) -> Letter:
    return Letter(name, ord(letter), request, reply)


def _guessed(name: str, letter: str, request: tuple[Data, ...] = ()) -> Letter:
    return Letter(name, ord(letter), request, documented=False)


_BYTE, _WORD, _TEXT, _WORD_PORT = (Data.BYTE,), (Data.WORD,), (Data.TEXT,), (Data.WORD_PORT,)

LETTERS: Final[tuple[Letter, ...]] = (
    _letter("Login", "L", _TEXT),
    _letter("Logout", "l"),
    _letter("Start", "G", _BYTE),
    _letter("Stop", "Q"),
    _letter("Pause", "P"),
    _letter("Continue", "C"),
    _letter("Reset", "R"),
    _letter("SetMotorsOn", "M", _BYTE),
    _letter("SetMotorsOff", "N", _BYTE),
    _letter("SetCurRobot", "Y", _BYTE),
    _letter("GetCurRobot", "y", (), _BYTE),
    _letter("Home", "H", _BYTE),
    _letter("GetIO", "i", _WORD, _BYTE),
    _letter("SetIO", "I", (Data.WORD, Data.BYTE)),
    _letter("GetMemIO", "o", _WORD, _BYTE),
    _letter("GetIOByte", "b", _BYTE, (Data.HEX_BYTE,)),
    _letter("GetMemIOByte", "t", _BYTE, (Data.HEX_BYTE,)),
    _letter("GetIOWord", "w", _WORD_PORT, (Data.HEX_WORD,)),
    _letter("GetMemIOWord", "u", _WORD_PORT, (Data.HEX_WORD,)),
    _letter("GetStatus", "S", (), (Data.STATUS,)),
    _letter("Execute", "X", (Data.QUOTED,), (Data.QUOTED,)),
    # The manual's table prints u again, which is taken; by the pattern it is v.
    Letter("GetVariable", ord("v"), _TEXT, _TEXT, documented=False),
    _guessed("SetMemIO", "O", (Data.WORD, Data.BYTE)),
    _guessed("SetIOByte", "B", (Data.BYTE, Data.BYTE)),
    _guessed("SetMemIOByte", "T", (Data.BYTE, Data.BYTE)),
    _guessed("SetIOWord", "W", (Data.WORD_PORT, Data.WORD)),
    _guessed("SetMemIOWord", "U", (Data.WORD_PORT, Data.WORD)),
    _guessed("Abort", "A"),
)
"""The table, in the order of docs/reference/epson.md 2.2."""

_BY_NAME: Final = MappingProxyType({letter.name.lower(): letter for letter in LETTERS})
BY_BYTE: Final = MappingProxyType({letter.byte: letter for letter in LETTERS})
"""The table by the byte on the wire."""


def letter_of(name: str) -> Letter | None:
    """Return the letter of a command, ``None`` where Remote RS232 has none."""
    return _BY_NAME.get(name.lower())


STX: Final = 0x02
ETX: Final = 0x03
EOT: Final = 0x04
ACK: Final = 0x06
NAK: Final = 0x15
QUOTE: Final = ord('"')

_LEAD: Final = 2
"""Length of the first byte and the letter."""

_TAIL: Final = 2
"""Length of ETX and the checksum."""

_CODE_BYTES: Final = 2
_STATUS_DIGITS: Final = 4
_STATUS_FLAGS: Final = (10, 11)
_COMMA: Final = ord(",")


def check_sum(checked: bytes) -> int:
    """Return the XOR of the bytes from the letter through ETX.

    It does not see two bytes that changed places, nor the same bit flipped in two of them: what
    is written over it has to be read back.
    """
    return reduce(xor, checked, 0)


def framed(first: int, letter: int, data: bytes) -> bytes:
    """Return one frame as it stands on the line."""
    checked = bytes([letter, *data, ETX])
    return bytes([first, *checked, check_sum(checked)])


@dataclass(frozen=True, slots=True)
class SerialFrame:
    """One received frame.

    Attributes:
        first: STX, ACK, NAK, or EOT, which stands alone.
        letter: The byte behind it.
        data: What stands between the letter and ETX.
        intact: Whether ETX and the check sum are right.
    """

    first: int
    letter: int = 0
    data: bytes = b""
    intact: bool = True


def width(part: Data, dialect: Dialect) -> int:
    """Return how many bytes a number takes on the line, 0 for what has no length."""
    match part:
        case Data.BYTE | Data.HEX_BYTE:
            count = 1
        case Data.WORD | Data.HEX_WORD:
            count = 2
        case Data.WORD_PORT:
            count = dialect.word_port_bytes
        case _:
            return 0
    return count if dialect.numbers is Numbers.BINARY else 2 * count


class FrameBuffer:
    """Holds what has arrived and hands out whole frames.

    Attributes:
        data: The bytes that no frame has used yet.

    Args:
        role: A host takes answers; a device takes requests, and EOT between them.
        dialect: How numbers are written.
        max_frame: Most bytes of one frame.
    """

    __slots__ = ("_dialect", "_max_frame", "_role", "_scanned", "_sum", "data")

    def __init__(self, role: Role, dialect: Dialect, max_frame: int) -> None:
        self.data = bytearray()
        self._dialect = dialect
        self._max_frame = max_frame
        self._role = role
        self._scanned, self._sum = 1, 0  # of a text: number of bytes scanned, and their checksum

    @property
    def held(self) -> bytes:
        """A copy of them."""
        return bytes(self.data)

    def append(self, data: bytes) -> None:
        """Add what was received."""
        self.data += data

    def take(self) -> SerialFrame | None:
        """Return the next frame, ``None`` while it is not whole.

        Raises:
            RemoteProtocolError: What a host received is no answer, or it is too long for one.
        """
        if self._role is Role.DEVICE:
            self._skip_noise()
        if not self.data:
            return None
        if self.data[0] == EOT and self._role is Role.DEVICE:
            del self.data[0]
            return SerialFrame(EOT)
        self._check_first()
        length = self._length() if len(self.data) >= _LEAD else None
        if length is None and len(self.data) > self._max_frame:
            raise RemoteProtocolError(
                tr("A message is longer than {limit} bytes.", limit=self._max_frame),
                remedy=tr("Check that a controller is at the other end, then connect again."),
                raw=bytes(self.data[:80]),
            )
        if length is None or len(self.data) < length:
            return None
        return self._cut(length)

    def give_up(self) -> SerialFrame | None:
        """Return what is held as one frame that is not intact, ``None`` where nothing is."""
        if not self.data:
            return None
        letter = self.data[1] if len(self.data) > 1 else 0
        frame = SerialFrame(self.data[0], letter, bytes(self.data[_LEAD:]), intact=False)
        self.data.clear()
        self._scanned, self._sum = 1, 0
        return frame

    def _skip_noise(self) -> None:
        begin = next((i for i, byte in enumerate(self.data) if byte in (STX, EOT)), None)
        del self.data[: len(self.data) if begin is None else begin]

    def _check_first(self) -> None:
        known = (STX,) if self._role is Role.DEVICE else (ACK, NAK)
        if self.data[0] not in known:
            raise RemoteProtocolError(
                tr(
                    "{data!r} does not begin an answer of Remote RS232.",
                    data=bytes(self.data[:20]),
                ),
                remedy=tr(
                    "Check baud rate, parity and stop bits on both ends, and that the control "
                    "device is Remote RS232; then connect again."
                ),
                raw=bytes(self.data[:80]),
            )

    def _length(self) -> int | None:
        """Return how long the frame at the start is, ``None`` while that is unknown."""
        if self.data[0] == NAK:
            return _LEAD + _CODE_BYTES + _TAIL
        letter = BY_BYTE.get(self.data[1])
        if letter is None:
            return self._text_length(_LEAD)
        return self._layout_length(letter)

    def _layout_length(self, letter: Letter) -> int | None:
        parts = letter.request if self._role is Role.DEVICE else letter.reply
        end = _LEAD
        for part in parts:
            fixed = width(part, self._dialect)
            if fixed:
                end += fixed
            elif part is Data.STATUS:
                return self._status_length()
            else:
                return self._text_length(end, quoted=part is Data.QUOTED)
        return end + _TAIL

    def _status_length(self) -> int | None:
        """Flags are 00 or 01, digits are not; so where they end is seen."""
        body = self.data[_LEAD : _LEAD + max(_STATUS_FLAGS) + 1]
        flags = next((i for i, byte in enumerate(body) if byte not in (0, 1)), None)
        if flags is None:
            return None if len(body) <= max(_STATUS_FLAGS) else len(self.data)
        comma = int(body[flags] == _COMMA)
        return _LEAD + flags + comma + _STATUS_DIGITS + _TAIL

    def _text_length(self, start: int, *, quoted: bool = False) -> int | None:
        """Return where a text ends that begins at ``start``, with its ETX and check sum.

        The sum runs along with the search: each byte is looked at once, however it arrives.
        """
        data = self.data
        quoted = quoted and len(data) > start and data[start] == QUOTE
        while self._scanned + 1 < len(data):
            at = self._scanned
            self._sum ^= data[at]
            self._scanned += 1
            closes = not quoted or (at > start + 1 and data[at - 1] == QUOTE)
            if at >= start and data[at] == ETX and closes and self._sum == data[at + 1]:
                return at + _TAIL
        return None

    def _cut(self, length: int) -> SerialFrame:
        whole = bytes(self.data[:length])
        del self.data[:length]
        self._scanned, self._sum = 1, 0
        intact = whole[-_TAIL] == ETX and check_sum(whole[1:-1]) == whole[-1]
        return SerialFrame(whole[0], whole[1], whole[_LEAD:-_TAIL], intact)
