"""Room on the interpreter's stack of frames, which it takes and gives back piece by piece.

CPython 3.11 and later keep frames in pieces of 16 KiB. Where a loop calls a function at just the
depth at which a piece ends, each call takes a piece from the system and gives it back: 100,000
times in three files of tests.
"""

from collections.abc import Callable
from typing import TypeVar

_WORDS = 17_000
"""Size of the frame that is put below: the piece that holds it has room for hundreds of others."""

T = TypeVar("T")


def with_room(call: Callable[[], T]) -> T:
    """Call something, with room for the frames above it."""
    return call()


with_room.__code__ = with_room.__code__.replace(co_stacksize=_WORDS)
