"""What is looked at before the robot starts, as the screen of it and the flow know it."""

from dataclasses import dataclass
from enum import StrEnum


class Mark(StrEnum):
    """How a point of the list stands."""

    OK = "ok"
    TO_DO = "to do"
    YOU = "you"
    LOOK = "look"
    """Worth knowing; nothing waits for it."""


@dataclass(frozen=True, slots=True)
class CheckPoint:
    """One point.

    Attributes:
        mark: How it stands.
        text: What it says.
        key: The key that does or confirms it, empty for none.
        does: What that key is called.
    """

    mark: Mark
    text: str
    key: str = ""
    does: str = ""


@dataclass(frozen=True, slots=True)
class CheckSubject:
    """What is looked at before the robot starts.

    Attributes:
        points: The list.
        plan: What the robot will do, a sentence.
    """

    points: tuple[CheckPoint, ...]
    plan: str

    def open_keys(self, confirmed: frozenset[str]) -> tuple[str, ...]:
        """Return the keys of the points that are not settled yet."""
        return tuple(
            point.key
            for point in self.points
            if point.mark is Mark.TO_DO or (point.mark is Mark.YOU and point.key not in confirmed)
        )


SWITCH_ON = "motors"
"""The answer with which a person has the motors switched on."""
