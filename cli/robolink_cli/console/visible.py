"""What a terminal would obey, shown as an escape; needs no package beside Python."""

import re
from typing import Final

_OBEYED: Final = re.compile(
    "[\x00-\x09\x0b-\x1f\x7f-\x9f"  # C0 without LF, DEL, C1
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]"  # line separators, direction of writing
)


def visible(text: str) -> str:
    r"""Return ``text`` with everything that a terminal would obey as ``\x1b`` or ``\u202e``.

    CRLF, with which controllers end their lines, is a line feed.
    """
    lines = text.replace("\r\n", "\n")
    return _OBEYED.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), lines)
