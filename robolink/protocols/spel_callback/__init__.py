"""The lines between a SPEL+ program that calls back and this software, for both ends.

docs/spel-callback.md, "The lines", is their description. Nothing here opens a port.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.protocols.spel_callback._codec import CallbackCodec
from robolink.protocols.spel_callback._lines import (
    LONGEST_LINE,
    CallbackLine,
    CallbackWord,
    check_sum,
    decode_line,
    encode_line,
)
from robolink.protocols.spel_callback._values import (
    offset_fields,
    read_components,
    read_place,
    read_tool,
    same_thousandths,
    tool_fields,
)

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
    "read_tool",
    "same_thousandths",
    "tool_fields",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
