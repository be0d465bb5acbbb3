"""Every significantly different order of the steps of two processes, each once.

Two steps of different processes that touch different things may be swapped without any effect;
sleep sets (Godefroid, 1996) leave such orders out. The steps are known only during a run: a refused
process takes fewer.
"""

import random
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

from tests.faults._operator_steps import Waiting

Plan = tuple[tuple[int, ...], frozenset[int]]
"""The processes of the first steps, and those that need not go next: already tried."""


class Run(Protocol):
    """Two processes on one cell, each before its next step."""

    def waiting(self) -> Mapping[int, Waiting]:
        """Return the next step of each process that has not ended."""

    def step(self, who: int) -> None:
        """Let one process do its step."""

    def abandon(self) -> None:
        """End a run that is not worth finishing."""


class Interleavings:
    """Plans runs, one after another, until every order has been seen.

    Args:
        alike: Whether both processes do the same, so that either may go first.
        most: The largest number of orders; ``None`` for all of them. With a limit the runs
            are drawn from all over the orders, the same ones each time.

    Attributes:
        seen: Orders that were followed to the end.
    """

    def __init__(self, *, alike: bool = True, most: int | None = None) -> None:
        self._todo: list[Plan] = [((0,) if alike else (), frozenset())]
        self._draw = random.Random(1) if most else None
        self._most = most
        self.seen = 0

    def __iter__(self) -> Iterator[Plan]:
        while self._todo and self.seen != self._most:
            last = len(self._todo) - 1
            yield self._todo.pop(self._draw.randint(0, last) if self._draw else last)

    def follow(self, run: Run, beginning: Sequence[int], asleep: frozenset[int]) -> bool:
        """Drive a run to its end along one order, and plan the orders that branch off.

        Returns:
            Whether the order was a new one.
        """
        path: tuple[int, ...] = ()
        for who in beginning:
            run.step(who)
            path += (who,)
        while waiting := run.waiting():
            awake = [who for who in waiting if who not in asleep]
            if not awake:
                run.abandon()
                return False
            first, *others = awake
            for other in others:
                tried = asleep | {first}
                still = frozenset(who for who in tried if apart(waiting[who], waiting[other]))
                self._todo.append(((*path, other), still))
            asleep = frozenset(who for who in asleep if apart(waiting[who], waiting[first]))
            run.step(first)
            path += (first,)
        self.seen += 1
        return True


def apart(one: Waiting, other: Waiting) -> bool:
    """Whether two steps may be swapped without any effect."""
    here, there = one.touches(), other.touches()
    return not any(here[what] or there[what] for what in here.keys() & there.keys())
