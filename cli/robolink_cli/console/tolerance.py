"""Output and input that no character breaks: none is lacking, and none is obeyed."""

import codecs
import io
import os
import re
import sys
from typing import Final

PLAINLY: Final = "robolink.plainly"
"""Name of what stands in for characters that an encoding lacks: signs in letters, else escapes."""

PLAIN: Final = "robolink.plain"
"""Where a command finds that lines are wanted in place of screens."""

_OBEYED: Final = re.compile(
    "[\x00-\x09\x0b-\x1f\x7f-\x9f"  # C0 without LF, DEL, C1
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]"  # line separators, direction of writing
)

_IN_ASCII: Final = {"\u00b1": "+-", "\u221e": "inf", "\u00b0": " deg", "\u2192": "->"}


def _plainly(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        return codecs.backslashreplace_errors(error)
    lacking = error.object[error.start : error.end]
    escaped = (
        _IN_ASCII.get(one) or one.encode("ascii", "backslashreplace").decode("ascii")
        for one in lacking
    )
    return "".join(escaped), error.end


codecs.register_error(PLAINLY, _plainly)


def visible(text: str) -> str:
    r"""Return ``text`` with everything that a terminal would obey as ``\x1b`` or ``\u202e``.

    CRLF, with which controllers end their lines, is a line feed.
    """
    lines = text.replace("\r\n", "\n")
    return _OBEYED.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), lines)


def tolerate_any_console() -> None:
    """Show what the console's encoding lacks as an escape instead of raising.

    A technician's console may be cp1252, cp936 or plain ASCII, and a degree sign must not
    end a calibration; nor must a slip of the fingers that the encoding does not know.
    """
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=PLAINLY)


def colour_wanted() -> bool | None:
    """Return False when NO_COLOR asks for none, else None: only on a terminal."""
    return False if os.environ.get("NO_COLOR") else None


def help_width() -> int:
    """Return the width of help pages: the terminal's, between 50 and 78 columns.

    The rule is click's own; click would import ``shutil``, and with it the compression
    modules, to find out.
    """
    try:
        columns = int(os.environ.get("COLUMNS") or os.get_terminal_size().columns)
    except (OSError, ValueError):
        columns = 80
    return max(min(columns, 80) - 2, 50)


def may_be_guided() -> bool:
    """Tell whether a person sits at both ends of this process's terminal."""
    try:
        return os.isatty(sys.stdin.fileno()) and os.isatty(sys.stderr.fileno())
    except (OSError, ValueError, AttributeError):  # closed, or a stream inside a program
        return False
