"""What is looked at before the robot starts, as the screen of it and the flow know it."""

from collections.abc import Collection
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
        name: What it is known by while the list is gone through; empty for what is only read.
        does: What the main key does on its row.
    """

    mark: Mark
    text: str
    name: str = ""
    does: str = ""

    def is_open(self, confirmed: Collection[str]) -> bool:
        """Tell whether something is still to be done or confirmed."""
        return self.mark is Mark.TO_DO or (self.mark is Mark.YOU and self.name not in confirmed)


@dataclass(frozen=True, slots=True)
class CheckSubject:
    """What is looked at before the robot starts.

    Attributes:
        points: The list.
        plan: What the robot will do, a sentence.
    """

    points: tuple[CheckPoint, ...]
    plan: str

    @property
    def rows(self) -> tuple[CheckPoint, ...]:
        """The points that a person goes through; after them comes the row that starts."""
        return tuple(point for point in self.points if point.name)

    def open_rows(self, confirmed: Collection[str]) -> tuple[int, ...]:
        """Return the indices of the rows that are not settled yet."""
        return tuple(i for i, point in enumerate(self.rows) if point.is_open(confirmed))


SWITCH_ON = "motors"
"""The answer with which a person has the motors switched on."""
