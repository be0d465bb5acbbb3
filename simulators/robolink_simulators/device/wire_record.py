"""The traffic of a simulated controller, with running numbers."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

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
    """The last motions; their ends are calculated when somebody asks.

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
        """Yield the stored ones with a number above ``after``."""
        held = self._held[-MOST_MOTIONS:]
        first = self.added - len(held) + 1
        for number, (at_ns, flange_mm, robot) in enumerate(held, first):
            if number > after:
                kind = "jog" if flange_mm is None else "move"
                yield StartedMotion(number, at_ns, kind, flange_mm and flange_mm(), robot)


MOST_LINES: Final = 2000

MOST_SHARED: Final = 4096
"""Number of different texts kept only once per process. When it is reached, the store starts empty
again.
"""

_shared: dict[str, str] = {}


@dataclass(frozen=True, slots=True)
class WireLine:
    """One request or answer.

    Attributes:
        number: Counts from 1; what was pushed out of the log has been counted.
        at_ns: The simulated instant.
        direction: ``>`` for what came from a client, ``<`` for what left.
        text: What it was, passwords hidden.
    """

    number: int
    at_ns: int
    direction: str
    text: str


class WireRecord:
    """The last (now_ns, ">" or "<", text).

    Each line is held as three values in a row: a tuple for each would be looked at by every
    collection of garbage, and thousands of simulators hold thousands of lines each.

    Args:
        most: How many are held; ``None`` for all.

    Attributes:
        added: How many there were so far.
    """

    def __init__(self, most: int | None = MOST_LINES) -> None:
        self._held: deque[Any] = deque(maxlen=None if most is None else 3 * most)
        self.added = 0

    def __len__(self) -> int:
        return len(self._held) // 3

    def __iter__(self) -> Iterator[tuple[int, str, str]]:
        values = iter(tuple(self._held))
        return zip(values, values, values, strict=True)

    def add(self, now_ns: int, direction: str, text: str) -> None:
        """Add what crossed the wire just now."""
        self.added += 1
        self._held.extend((now_ns, direction, _held_once(text)))

    def clear(self) -> None:
        """Remove all of it, and count from 1 again."""
        self._held.clear()
        self.added = 0

    def lines(self, after: int = 0) -> Iterator[WireLine]:
        """Yield the stored ones with a number above ``after``."""
        first = self.added - len(self) + 1
        skipped = max(0, after + 1 - first)
        for number, line in enumerate(islice(self, skipped, None), first + skipped):
            yield WireLine(number, *line)


def _held_once(text: str) -> str:
    """Return the stored copy of a text: thousands of controllers receive the same ones.

    ``sys.intern`` would do, but for Pythons that never let go of what went through it: 3.12.1
    grew by 113 bytes for each different text, 3.11.7 and 3.13.0 by nothing.
    """
    if len(_shared) >= MOST_SHARED:
        _shared.clear()
    return _shared.setdefault(text, text)
