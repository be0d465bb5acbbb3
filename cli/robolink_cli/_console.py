"""Output that never fails for want of a character."""

import io
import os
import sys


def tolerate_any_console() -> None:
    """Show what the console's encoding lacks as an escape instead of raising.

    A technician's console may be cp1252, cp936 or plain ASCII, and a degree sign must not
    end a calibration.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def colour_wanted() -> bool | None:
    """Return False when NO_COLOR asks for none, else None: only on a terminal."""
    return False if os.environ.get("NO_COLOR") else None


def leave_pipe() -> None:
    """Send what is still to be flushed nowhere, because the reader of the pipe has left."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
