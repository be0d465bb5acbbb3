"""Every instant of a run at which a disturbance can occur, and its injection.

A run is one process on one clock that advances only during waits, so its instants are the same each
time: each exchange (before it is carried out, and before its answer leaves), the middle of each
wait of the driver (movements are waited for like that), each question to the person, and each
durable transaction of the journal (before it, and once it counts). Questions and transactions lie
between exchanges, where Ctrl-C is not held back.
"""

import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from typing import Final, Literal

import pytest
from robolink_cli.prompts import operator as _operator
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.device.hosted import HostedDevice

from robolink.journal.store.store import Store, Tables
from robolink.runner import Question
from robolink.timing import NS_PER_S

EVERYTHING: Final = os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1"
"""Whether all instants are disturbed, not only a sample."""

Kind = Literal["request", "answer", "wait", "question", "commit", "statement"]
_EVERY: Final = 97
"""Every 97th instant belongs to the sample,"""
_TURNS: Final = 12
"""of which each test takes every twelfth."""


@dataclass(frozen=True)
class Instant:
    """One instant: the ``number``-th of its kind, and its subject.

    The subject of an answer is its request, of a commit whether it already counts, of a statement
    its place in the program and its text.
    """

    kind: Kind
    number: int
    what: str

    def __str__(self) -> str:
        return f"{self.kind} {self.number}: {self.what}"


class Instants:
    """Counts the instants of a run, and acts at one of them.

    Attributes:
        passed: The instants so far.

    Args:
        at: The instant to act at; ``None`` for never.
        act: Called then, once.
    """

    def __init__(self, at: Instant | None = None, act: Callable[[], None] = lambda: None) -> None:
        self.passed: list[Instant] = []
        self._at = at
        self._act = act
        self._counts = Counter[Kind]()

    def pass_by(self, kind: Kind, what: str = "") -> None:
        """Pass one instant."""
        self._counts[kind] += 1
        self.passed.append(Instant(kind, self._counts[kind], what))
        at = self._at
        if at is not None and (at.kind, at.number) == (kind, self._counts[kind]):
            self._act()


@contextmanager
def noted(at: object) -> Iterator[None]:
    """Name an instant beside what is wrong after its disturbance."""
    try:
        yield
    except AssertionError as error:
        error.add_note(f"disturbed at {at}")
        raise


class WatchedClock(ManualClock):
    """A clock that reports when half of a wait is over."""

    def __init__(self) -> None:
        super().__init__()
        self.on_wait: Callable[[], None] = lambda: None

    def sleep(self, seconds: float) -> None:
        """Let ``seconds`` pass, with a report after half of them."""
        until_ns = self.now_ns() + round(seconds * NS_PER_S)
        super().sleep(seconds / 2)
        self.on_wait()
        super().advance_to(until_ns)  # two halves of a nanosecond would be none

    def advance_to(self, now_ns: int) -> None:
        """Move the time forward to ``now_ns``, with a report halfway."""
        super().advance_to((self.now_ns() + now_ns) // 2)
        self.on_wait()
        super().advance_to(now_ns)


class Person:
    """Confirms everything that a command asks on its terminal."""

    def __init__(self, instants: Instants) -> None:
        self.asked: list[str] = []
        self._instants = instants

    def tell(self, text: str) -> None:
        """Accept a message."""

    def ask(self, question: str, kind: Question) -> None:
        """Accept a question."""
        self.asked.append(question)

    def poll(self, wait_s: float) -> str:
        """Say yes."""
        self._instants.pass_by("question", self.asked[-1])
        return "y"


@contextmanager
def questions(instants: Instants) -> Iterator[Person]:
    """Let ``instants`` see the questions; yields the person at the terminal."""
    person = Person(instants)
    poll = _operator.AssistedOperator.poll

    def polled(operator: _operator.AssistedOperator, wait_s: float) -> str | None:
        instants.pass_by("question", "the recipe's, or where the tip is")
        return poll(operator, wait_s)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_operator, "terminal", lambda: person)
        patch.setattr(_operator.AssistedOperator, "poll", polled)
        yield person


@contextmanager
def exchanges_and_commits(simulator: HostedDevice, instants: Instants) -> Iterator[None]:
    """Let ``instants`` see the requests to a simulator and the transactions of a journal."""
    write = Store.write
    asked: dict[int, str] = {}

    def hear(number: int, text: str) -> None:
        asked[number] = text
        instants.pass_by("request", text)

    def answer(number: int, _text: str) -> None:
        instants.pass_by("answer", asked.get(number, ""))

    @contextmanager
    def written(store: Store, what: str = "", then: str = "", **room: int) -> Iterator[Tables]:
        instants.pass_by("commit", "before")
        with write(store, what, then, **room) as tables:
            yield tables
        instants.pass_by("commit", "after")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulator, "on_request", hear)
        patch.setattr(
            simulator, "on_reply", lambda n, _: instants.pass_by("answer", asked.get(n, ""))
        )
        patch.setattr(Store, "write", written)
        yield


def chosen(instants: Sequence[Instant], matters: re.Pattern[str], turn: int) -> list[Instant]:
    """Return the instants to act at: all, or, without the switch, a sample.

    Args:
        instants: All of one run.
        matters: Instants of greater weight in the sample.
        turn: The number of the sample, of several that complement each other.
    """
    if EVERYTHING:
        return list(instants)
    worth = [i for n, i in enumerate(instants) if n % _EVERY == 0 or matters.match(i.what)]
    return worth[turn % _TURNS :: _TURNS]


def without_inner_polls(instants: Sequence[Instant], polls: re.Pattern[str]) -> list[Instant]:
    """Return the instants with only the first, the middle and the last of each row of polls.

    During a movement alone, polls differ only in the time.
    """
    kept: list[Instant] = []
    for polling, group in groupby(instants, lambda i: bool(polls.match(f"{i.kind} {i.what}"))):
        row = list(group)
        kept += [row[n] for n in sorted({0, len(row) // 2, len(row) - 1})] if polling else row
    return kept
