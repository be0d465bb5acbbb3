"""The person at the cell, as whoever runs a procedure asks them."""

from enum import Enum
from typing import Protocol


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
