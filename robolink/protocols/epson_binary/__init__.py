"""EPSON Remote RS232: the commands of Remote Ethernet in binary frames, for both ends of the line.

The frames carry the events of :mod:`robolink.protocols.epson_text`, so that whoever asks a
controller something need not know which of the two lines it stands on. What differs is here: a
letter in place of a name, binary numbers, and a check sum of one byte.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports
from robolink.protocols._role import NEED_DATA as NEED_DATA
from robolink.protocols._role import Role as Role

if TYPE_CHECKING:
    from robolink.protocols.epson_binary._codec import EpsonBinaryCodec as EpsonBinaryCodec
    from robolink.protocols.epson_binary._dialect import Dialect as Dialect
    from robolink.protocols.epson_binary._dialect import Letters as Letters
    from robolink.protocols.epson_binary._dialect import NakCode as NakCode
    from robolink.protocols.epson_binary._dialect import Numbers as Numbers
    from robolink.protocols.epson_binary._letters import LETTERS as LETTERS
    from robolink.protocols.epson_binary._letters import Letter as Letter
    from robolink.protocols.epson_binary._letters import letter_of as letter_of
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_codec": "EpsonBinaryCodec",
            "_dialect": "Dialect Letters NakCode Numbers",
            "_letters": "LETTERS Letter letter_of",
        },
    )
