"""The person at the cell, as whoever runs a procedure asks them."""

from collections.abc import Callable
from enum import Enum
from typing import Final, Protocol

POLL_S: Final = 1.0
"""Longest time between two status reads while a person is asked."""


class Question(Enum):
    """What kind of answer is wanted."""

    PLACE = "place"
    """Jog steps until the tip is on the reference point, then an empty line."""

    ROOM = "room"
    """Jog steps until the tip is free to go along the axes of the tool, then an empty line."""

    ALONG_X = "along x"
    """Jog steps along the tool's own +X, then an empty line."""

    ALONG_Z = "along z"
    """The same along its +Z."""

    YES_NO = "yes/no"

    TEXT = "text"
    """A line of text that is not empty; ``q`` alone ends."""

    CHOICE = "choice"
    """The number of a row; an empty line, or ``q``, is the first, which is safe."""


class Operator(Protocol):
    """The person at the cell, or whoever stands in for one."""

    def tell(self, text: str) -> None:
        """Show something that needs no answer."""

    def ask(self, question: str, kind: Question) -> None:
        """Show what is to be done or decided; :meth:`poll` fetches the answer."""

    def poll(self, wait_s: float) -> str | None:
        """Return the next line of the answer, ``None`` if none came within ``wait_s``."""


def awaited_line(operator: Operator, look: Callable[[], object], *, wait_s: float = POLL_S) -> str:
    """Return the next line that a person types, looking at the controller while there is none.

    Whoever asks a person fetches the answer here: an idle client is cut off after the remote
    time-out (docs/reference/epson.md 1.1), and a person may take longer than that to look into the
    cell (docs/reference/rules.md 7).

    Args:
        operator: Who was asked.
        look: Reads the status; what it raises ends the question.
        wait_s: Longest time between two looks.

    Example:
        >>> from robolink.runner import awaited_line
        >>> class Person:  # implements robolink.Operator
        ...     lines = iter([None, "y"])
        ...     def poll(self, wait_s):
        ...         return next(self.lines)
        >>> awaited_line(Person(), lambda: print("a look"))
        a look
        'y'
    """
    while (line := operator.poll(wait_s)) is None:
        look()
    return line
