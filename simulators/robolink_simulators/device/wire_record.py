"""What crossed the wire of a simulated controller, with running numbers."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from sys import intern
from typing import Final

MOST_LINES: Final = 2000


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


class WireRecord(deque[tuple[int, str, str]]):
    """The last (now_ns, ">" or "<", text).

    Args:
        most: How many are held; ``None`` for all.

    Attributes:
        added: How many there were so far.
    """

    def __init__(self, most: int | None = MOST_LINES) -> None:
        super().__init__(maxlen=most)
        self.added = 0

    def append(self, line: tuple[int, str, str]) -> None:
        """Add what crossed the wire just now."""
        self.added += 1
        now_ns, direction, text = line
        # Thousands of controllers are asked the same: each text is held once in a process.
        super().append((now_ns, direction, intern(text)))

    def clear(self) -> None:
        """Forget all of it, and count from 1 again."""
        super().clear()
        self.added = 0

    def lines(self, after: int = 0) -> Iterator[WireLine]:
        """Yield those that are still held and have a number above ``after``."""
        first = self.added - len(self) + 1
        skipped = max(0, after + 1 - first)
        for number, line in enumerate(islice(self, skipped, None), first + skipped):
            yield WireLine(number, *line)
