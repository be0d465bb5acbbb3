"""One line: what stands in it, and the sum by which a bent one is found."""

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.messages import tr

VERSION: Final = "RL1"

LONGEST_LINE: Final = 255
"""A SPEL+ string holds no more characters (docs/reference/spel.md 17)."""

_BASE: Final = 251
_PRIME: Final = 8_388_593
"""The largest prime below 2^23: 251 times a smaller number still fits a Long of SPEL+."""

_FIELD: Final = re.compile(r"[!-)+\-.-~]+")
"""Printable ASCII but blank, asterisk and comma. None is empty: ParseStr passes over those."""

_LAST_NUMBER: Final = 999_999


class CallbackWord(StrEnum):
    """What a line says. The first row is sent by the program, the second is answered."""

    HELLO = "HELLO"
    BEGIN = "BEGIN"
    POSE = "POSE"
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
