"""What the manuals leave open about Remote RS232, each as an option with its evidence.

Source: docs/reference/epson.md 2.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal


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
    """Two decimal digits, as the code of GetStatus is four of them."""
    BINARY = "binary"
    """One number, most significant byte first."""


class Letters(StrEnum):
    """Which letters are sent."""

    DOCUMENTED = "documented"
    """Only those that a manual prints."""
    GUESSED = "guessed"
    """Also the upper-case twins of readers for their setters, and A for Abort: a pattern, seen in
    each pair that is printed and stated nowhere."""


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
