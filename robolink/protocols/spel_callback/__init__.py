"""The lines between a SPEL+ program that calls back and this software, for both ends.

docs/spel-callback.md, "The lines", is their description. Nothing here opens a port.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports
from robolink.protocols._role import NEED_DATA as NEED_DATA

if TYPE_CHECKING:
    from robolink.protocols.spel_callback._codec import CallbackCodec as CallbackCodec
    from robolink.protocols.spel_callback._lines import LONGEST_LINE as LONGEST_LINE
    from robolink.protocols.spel_callback._lines import CallbackLine as CallbackLine
    from robolink.protocols.spel_callback._lines import CallbackWord as CallbackWord
    from robolink.protocols.spel_callback._lines import check_sum as check_sum
    from robolink.protocols.spel_callback._lines import decode_line as decode_line
    from robolink.protocols.spel_callback._lines import encode_line as encode_line
    from robolink.protocols.spel_callback._values import offset_fields as offset_fields
    from robolink.protocols.spel_callback._values import read_components as read_components
    from robolink.protocols.spel_callback._values import read_place as read_place
    from robolink.protocols.spel_callback._values import read_tool as read_tool
    from robolink.protocols.spel_callback._values import same_thousandths as same_thousandths
    from robolink.protocols.spel_callback._values import tool_fields as tool_fields
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_codec": "CallbackCodec",
            "_lines": "LONGEST_LINE CallbackLine CallbackWord check_sum decode_line encode_line",
            "_values": "offset_fields read_components read_place read_tool same_thousandths "
            "tool_fields",
        },
    )
