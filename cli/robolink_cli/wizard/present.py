"""The desk at which the person of this process sits, while a wizard shows it."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robolink_cli.wizard.desk import Desk

_desk: "Desk | None" = None


def present_desk() -> "Desk | None":
    """Return the desk, ``None`` where questions are plain lines."""
    return _desk


@contextmanager
def sitting_at(desk: "Desk") -> Iterator[None]:
    """Have every question of this process asked at ``desk``, for the block."""
    global _desk  # noqa: PLW0603 - a process has one terminal, and one person at it
    before, _desk = _desk, desk
    try:
        yield
    finally:
        _desk = before
