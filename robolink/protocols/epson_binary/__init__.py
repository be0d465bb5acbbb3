"""EPSON Remote RS232: the commands of Remote Ethernet in binary frames, for both ends of the line.

The frames carry the events of :mod:`robolink.protocols.epson_text`, so that whoever asks a
controller something need not know which of the two lines it stands on. What differs is here: a
letter in place of a name, binary numbers, and a check sum of one byte.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.protocols.epson_binary._codec import EpsonBinaryCodec
from robolink.protocols.epson_binary._frames import (
    LETTERS,
    Dialect,
    Letter,
    Letters,
    NakCode,
    Numbers,
    letter_of,
)

__all__ = [
    "Dialect",
    "EpsonBinaryCodec",
    "LETTERS",
    "Letter",
    "Letters",
    "NakCode",
    "Numbers",
    "letter_of",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
