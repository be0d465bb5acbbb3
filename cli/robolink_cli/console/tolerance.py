"""Output and input that never fail for want of a character."""

import codecs
import io
import os
import sys
from typing import Final, TextIO

PLAINLY: Final = "robolink.plainly"
"""Name of what stands in for characters that an encoding lacks: signs in letters, else escapes."""

PLAIN: Final = "robolink.plain"
"""Where a command finds that lines are wanted in place of screens."""

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
        ends = [stream.fileno() for stream in (sys.stdin, sys.stderr)]
        return all(os.isatty(end) and _is_no_other_device(end) for end in ends)
    except (OSError, ValueError, AttributeError):  # closed, or a stream inside a program
        return False


def is_terminal(stream: TextIO | None) -> bool:
    """Tell whether a stream is a terminal, where a person can be."""
    try:
        return (
            stream is not None
            and stream.isatty()
            and (os.name != "nt" or _is_no_other_device(stream.fileno()))
        )
    except (OSError, ValueError, AttributeError):  # closed, or a stream inside a program
        return False


def _is_no_other_device(descriptor: int) -> bool:
    """Tell whether what says that it is a terminal is one: on Windows NUL and a port say so too."""
    if sys.platform != "win32":
        return True
    import ctypes
    import msvcrt

    handle, mode = msvcrt.get_osfhandle(descriptor), ctypes.c_ulong()
    console = ctypes.windll.kernel32
    return bool(console.GetConsoleMode(ctypes.c_void_p(handle), ctypes.byref(mode)))
