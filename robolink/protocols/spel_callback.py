"""The lines between this software and a SPEL+ program that starts it, for both ends.

docs/reference/spel_callback.md, "The lines", is their description. Nothing here opens a port.

One line: what stands in it, and the sum by which a bent one is found.

A stream of lines. The same bytes give the same lines however they are cut.

Lengths and angles in lines: whole thousandths of a millimetre or degree.

That is the last digit which the controller prints, and what is sent is what is compared
(docs/reference/spel.md 5).
"""

import re
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.lazy_exports import old_names
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.protocols import _role

__all__ = [
    "CallbackCodec",
    "CallbackLine",
    "CallbackWord",
    "LONGEST_LINE",
    "check_sum",
    "decode_line",
    "encode_line",
    "offset_fields",
    "read_components",
    "read_place",
    "read_thousandths",
    "read_tool",
    "same_thousandths",
    "tool_fields",
]

COMPONENTS: Final = 6
_LARGEST: Final = 9_999_999
_WHOLE: Final = re.compile(r"-?[0-9]{1,7}")


def offset_fields(offset: ToolOffset) -> tuple[str, ...]:
    """Return the six fields of an offset.

    Raises:
        LocalProtocolError: It is too large.
    """
    return tuple(_field(value) for value in offset.components())


def tool_fields(offset: ToolOffset | None) -> tuple[str, ...]:
    """Return the seven fields of a tool: 1 if it is defined, and its value."""
    return ("0" if offset is None else "1", *offset_fields(offset or ToolOffset()))


def read_components(fields: Sequence[str]) -> tuple[float, ...]:
    """Return six lengths and angles, mm and degrees.

    Raises:
        RemoteProtocolError: They are none.
    """
    return read_thousandths(fields, COMPONENTS)


def read_place(fields: Sequence[str]) -> tuple[float, ...]:
    """Read X and Y of a place, mm.

    Raises:
        RemoteProtocolError: They are none.
    """
    return read_thousandths(fields, 2)


def read_thousandths(fields: Sequence[str], count: int) -> tuple[float, ...]:
    """Return so many lengths, angles or speeds, in mm, degrees or mm/s.

    Raises:
        RemoteProtocolError: They are none, or not so many.
    """
    if len(fields) != count or not all(map(_WHOLE.fullmatch, fields)):
        raise RemoteProtocolError(
            tr(
                "{fields} are not {count} whole numbers of thousandths.",
                fields=",".join(fields),
                count=count,
            )
        )
    return tuple(int(field) / 1000 for field in fields)


def read_tool(fields: Sequence[str]) -> ToolOffset | None:
    """Return what :func:`tool_fields` was given, rounded.

    Raises:
        RemoteProtocolError: It is no tool.
    """
    values = read_components(fields[1:])
    if fields[0] not in ("0", "1"):
        raise RemoteProtocolError(tr("{field!r} is neither 0 nor 1.", field=fields[0]))
    return ToolOffset(*values) if fields[0] == "1" else None


def same_thousandths(one: ToolOffset | None, other: ToolOffset | None) -> bool:
    """Return whether two tools are the same to the digits that the controller prints."""
    return tool_fields(one) == tool_fields(other)


def _field(value: float) -> str:
    thousandths = round(value * 1000)
    if abs(thousandths) > _LARGEST:
        raise LocalProtocolError(tr("{value:g} is too large for a line.", value=value))
    return str(thousandths)


VERSION: Final = "RL1"

LONGEST_LINE: Final = 255
"""Largest number of characters of a SPEL+ string (docs/reference/spel.md 17)."""

_BASE: Final = 251
_PRIME: Final = 8_388_593
"""Largest prime below 2^23: 251 times a smaller number still fits in a SPEL+ Long."""

_FIELD: Final = re.compile(r"[!-)+\-.-~]+")
"""Printable ASCII except blank, asterisk and comma. No field is empty, because ParseStr skips empty
ones."""

_LAST_NUMBER: Final = 999_999


class CallbackWord(StrEnum):
    """The kinds of lines. The program sends the first row; the second is answered."""

    HELLO = "HELLO"
    BEGIN = "BEGIN"
    POSE = "POSE"
    ROUND = "ROUND"
    SOLVE = "SOLVE"
    WROTE = "WROTE"
    PROOF = "PROOF"
    JUDGE = "JUDGE"
    KEPT = "KEPT"
    RESTORED = "RESTORED"
    BYE = "BYE"

    WELCOME = "WELCOME"
    GO = "GO"
    OK = "OK"
    VALUE = "VALUE"
    PROVE = "PROVE"
    KEEP = "KEEP"
    BACK = "BACK"
    DONE = "DONE"
    REFUSE = "REFUSE"


@dataclass(frozen=True, slots=True)
class CallbackLine:
    """A line.

    Attributes:
        number: That of the question; its answer bears the same.
        word: What it says.
        fields: What stands behind it.
    """

    number: int
    word: CallbackWord
    fields: tuple[str, ...] = ()


def check_sum(text: str) -> int:
    """Return the sum of a text: its characters as digits to the base 251, modulo a prime.

    Source: the fingerprint of Karp and Rabin. Any one changed character, and any two that change
    places, give another; of other damage one in eight million passes.
    """
    total = 0
    for character in text:
        total = (total * _BASE + ord(character)) % _PRIME
    return total


def encode_line(line: CallbackLine) -> bytes:
    """Return a line as it is sent, with its end.

    Raises:
        LocalProtocolError: A field cannot stand in a line, or the line is too long.
    """
    for field in line.fields:
        if not _FIELD.fullmatch(field):
            raise LocalProtocolError(tr("{field!r} cannot be part of a line.", field=field))
    text = ",".join((VERSION, str(line.number), line.word, *line.fields))
    text = f"{text}*{check_sum(text):X}"
    if len(text) > LONGEST_LINE or not 1 <= line.number <= _LAST_NUMBER:
        raise LocalProtocolError(
            tr("A line of {count} characters cannot be sent.", count=len(text))
        )
    return text.encode("ascii") + b"\r\n"


def decode_line(data: bytes) -> CallbackLine:
    """Return what a line says, given without its end.

    Raises:
        RemoteProtocolError: It is bent, of another version, or says nothing that is known.
    """
    text = data.decode("latin-1")
    body, star, given = text.rpartition("*")
    if not star or len(text) > LONGEST_LINE or given != f"{check_sum(body):X}":
        raise _useless(tr("A line arrived damaged: its check sum is wrong."), data)
    version, *rest = body.split(",")
    if version != VERSION:
        raise _useless(tr("The other end speaks {version!r}.", version=version), data)
    if len(rest) < 2 or not all(map(_FIELD.fullmatch, rest)):
        raise _useless(tr("A line lacks a part."), data)
    number, word, *fields = rest
    if not re.fullmatch("[1-9][0-9]{0,5}", number):
        raise _useless(tr("{number!r} is not a line number.", number=number), data)
    if word not in CallbackWord.__members__:
        raise _useless(tr("{word!r} is not known.", word=word), data)
    return CallbackLine(int(number), CallbackWord(word), tuple(fields))


def _useless(what: str, data: bytes) -> RemoteProtocolError:
    remedy = tr("Compare the versions of recal.prg and of this software, and the terminator CRLF.")
    return RemoteProtocolError(what, remedy=remedy, raw=data)


_END = b"\r\n"


class CallbackCodec:
    """Turns bytes into lines. An invalid line ends it for good: nothing is guessed."""

    def __init__(self) -> None:
        self._held = bytearray()
        self._lines: deque[bytes] = deque()
        self._failed: RemoteProtocolError | None = None

    def receive(self, data: bytes) -> None:
        """Accept received bytes. Memory is bounded by one line beyond what was given."""
        if self._failed is not None:
            return
        self._held += data
        *lines, rest = bytes(self._held).split(_END)
        self._lines.extend(lines)
        self._held[:] = rest[: LONGEST_LINE + 2]

    def next_event(self) -> CallbackLine | _role.Need:
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
        return _role.NEED_DATA


if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
