"""Whether a person can be asked, and where: the entry of the process answers it once.

A person is at the terminal of this process, or at the other end of a wire: a page on a tablet,
whose server started this process (:mod:`robolink_cli.job_process`).
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from typing import TextIO


class Person(Enum):
    """Where the person is who can be asked. Nobody is false."""

    TERMINAL = "terminal"
    WIRE = "wire"
    NOBODY = ""

    def __bool__(self) -> bool:
        """Return whether there is one."""
        return self is not Person.NOBODY


_at: Person | None = None


def person_here() -> Person:
    """Return where the person is who can be asked."""
    if _at is not None:
        return _at
    ends = is_terminal(sys.stdin) and is_terminal(sys.stderr)
    return Person.TERMINAL if ends else Person.NOBODY


def may_be_guided() -> bool:
    """Return whether a wizard can guide the person: at a wire, or at a terminal that is real.

    Streams that a program puts in place of its terminal can be asked line by line alone.
    """
    if _at is not None:
        return bool(_at)
    try:
        ends = [stream.fileno() for stream in (sys.stdin, sys.stderr)]
        return all(os.isatty(end) and _is_no_other_device(end) for end in ends)
    except (OSError, ValueError, AttributeError):  # closed, or a stream inside a program
        return False


@contextmanager
def person_at(place: Person) -> Iterator[None]:
    """Let the entry say where the person is, for the block; else the streams tell it."""
    global _at  # noqa: PLW0603 - a process has one person
    before, _at = _at, place
    try:
        yield
    finally:
        _at = before


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal, where a person can be."""
    try:
        return (
            stream is not None
            and stream.isatty()
            and (os.name != "nt" or _is_no_other_device(stream.fileno()))
        )
    except (OSError, ValueError, AttributeError):  # closed, or a stream inside a program
        return False


def _is_no_other_device(descriptor: int) -> bool:
    """Return whether a supposed terminal is one: on Windows NUL and a port claim it too."""
    if sys.platform != "win32":
        return True
    import ctypes
    import msvcrt

    handle, mode = msvcrt.get_osfhandle(descriptor), ctypes.c_ulong()
    console = ctypes.windll.kernel32
    return bool(console.GetConsoleMode(ctypes.c_void_p(handle), ctypes.byref(mode)))
