"""Every order of the steps of two processes that makes a difference, each once.

Two steps of different processes that do not touch the same thing may be swapped without
anybody noticing; sleep sets (Godefroid, 1996) leave such orders out. Which steps there are
shows only on the way: a process that is refused takes fewer.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

from tests.faults._operator_process import StepKind, Waiting

_CONFLICTS = {
    frozenset({"tool read", "tool write"}),
    frozenset({"tool write"}),
    frozenset({"journal read", "journal write"}),
    frozenset({"journal write"}),
}


class Run(Protocol):
    """Two processes on one cell, each before its next step."""

    def waiting(self) -> Mapping[int, Waiting]:
        """Return who stands before which step; who has ended is left out."""

    def step(self, who: int) -> None:
        """Let one do his step."""

    def abandon(self) -> None:
        """End what is not worth finishing."""


class Interleavings:
    """Plans runs, one after another, until every order has been seen.

    Attributes:
        seen: Orders that were followed to their end.
    """

    def __init__(self) -> None:
        # Who goes first makes no difference: the two do the same.
        self._todo: list[tuple[tuple[int, ...], frozenset[int]]] = [((0,), frozenset())]
        self.seen = 0

    def __iter__(self) -> Iterator[tuple[tuple[int, ...], frozenset[int]]]:
        while self._todo:
            yield self._todo.pop()

    def follow(self, run: Run, beginning: Sequence[int], asleep: frozenset[int]) -> bool:
        """Drive a run to its end along one order, and plan those that branch off.

        Returns:
            Whether it was an order of its own.
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
                still = frozenset(
                    who for who in tried if apart(waiting[who].kind, waiting[other].kind)
                )
                self._todo.append(((*path, other), still))
            asleep = frozenset(
                who for who in asleep if apart(waiting[who].kind, waiting[first].kind)
            )
            run.step(first)
            path += (first,)
        self.seen += 1
        return True


def apart(one: StepKind, other: StepKind) -> bool:
    """Whether two steps may be swapped without anybody noticing."""
    return frozenset({one, other}) not in _CONFLICTS
