"""Every command that has a letter on Remote RS232, and what stands behind it.

Source: docs/reference/epson.md 2.2. A command that is missing has no letter in any manual: the
queries about the controller itself and the alarms.
"""

from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType
from typing import Final


class Data(Enum):
    """What one part of a message is."""

    BYTE = auto()
    """A number of one byte."""
    WORD = auto()
    """A number of two bytes."""
    WORD_PORT = auto()
    """The number of a port of words; how long it is, the dialect says."""
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
    # The manual's table prints u once more, which is taken; in the pattern it is v.
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
