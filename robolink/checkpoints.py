"""Points where another thread may interleave: locks, exchanges, commits, questions.

A program that can be stopped from a second thread is right only if the stop may come at any of
these points. They are named in the code that passes them, so that a test, or a scheduler that
places threads on purpose, can let something happen at each one in turn instead of waiting for the
worst microsecond by chance. Without an observer a checkpoint costs one comparison.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum

__all__ = [
    "Checkpoint",
    "Observer",
    "checkpoint",
    "observed",
]


class Checkpoint(StrEnum):
    """The kind of point that a thread passes."""

    LOCK = "lock"
    """Before taking the lock of an exchange; the thread may wait there for another one."""

    HELD = "held"
    """The thread has that lock, and others wait for it. A decision made here cannot be overtaken.
    """

    EXCHANGE = "exchange"
    """An exchange has ended and its lock is free again."""

    PROCEDURE = "procedure"
    """Before an operation of several exchanges begins."""

    COMMIT = "commit"
    """Before, and after, storing something durably."""

    QUESTION = "question"
    """A person's answer, or its absence, has just been fetched."""

    STEP = "step"
    """Between two steps of a procedure."""


Observer = Callable[[Checkpoint, str], None]
"""Called by the thread that passes a point, with its kind and a description."""

_observer: Observer | None = None


def checkpoint(point: Checkpoint, what: str = "") -> None:
    """Pass a point where another thread may interleave.

    Args:
        point: Its kind.
        what: What goes on there: a request, an operation, a question.
    """
    if _observer is not None:
        _observer(point, what)


@contextmanager
def observed(observer: Observer) -> Iterator[None]:
    """Let ``observer`` see every checkpoint that any thread of this process passes."""
    global _observer  # noqa: PLW0603 - one process has one order of events
    before, _observer = _observer, observer
    try:
        yield
    finally:
        _observer = before
