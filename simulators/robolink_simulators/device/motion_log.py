"""Every motion that a simulated robot was told to make, whoever told it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

MOST_MOTIONS: Final = 2000

Place = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class StartedMotion:
    """A motion that began.

    Attributes:
        number: Counts from 1.
        at_ns: The simulated instant at which it was commanded.
        kind: ``move`` for one with a target, ``jog`` for one that buttons end.
        flange_mm: Where the flange is to end, in base coordinates; ``None`` for a jog.
        robot: Which of the controller's robots; counts from 1.
    """

    number: int
    at_ns: int
    kind: str
    flange_mm: Place | None
    robot: int = 1


class MotionLog:
    """The last motions; where each ends is worked out when somebody asks.

    Attributes:
        added: How many there were so far.
    """

    def __init__(self) -> None:
        self.added = 0
        self._held: list[tuple[int, Callable[[], Place] | None, int]] = []

    def add(self, at_ns: int, flange_mm: Callable[[], Place] | None = None, robot: int = 1) -> None:
        """Note one that begins; without a target it is a jog."""
        self.added += 1
        self._held.append((at_ns, flange_mm, robot))
        if len(self._held) > 2 * MOST_MOTIONS:
            del self._held[:-MOST_MOTIONS]

    def motions(self, after: int = 0) -> Iterator[StartedMotion]:
        """Yield those that are still held and have a number above ``after``."""
        held = self._held[-MOST_MOTIONS:]
        first = self.added - len(held) + 1
        for number, (at_ns, flange_mm, robot) in enumerate(held, first):
            if number > after:
                kind = "jog" if flange_mm is None else "move"
                yield StartedMotion(number, at_ns, kind, flange_mm and flange_mm(), robot)
