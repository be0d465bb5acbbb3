"""What happened in a history: events with a hash, violated rules, and how it is told."""

import hashlib
from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.soak.history import History

_KEPT: Final = 4000
"""Events that are kept for the telling; the hash is over all."""


@dataclass(frozen=True, slots=True)
class RuleBroken:
    """A rule that did not hold.

    Attributes:
        rule: Its name.
        hour: In which hour.
        sentence: What was seen.
    """

    rule: str
    hour: int
    sentence: str

    def __str__(self) -> str:
        return f"{self.rule} in hour {self.hour}: {self.sentence}"


@dataclass(slots=True)
class Story:
    """One history as it went.

    Attributes:
        history: What was to happen.
        broken: Rules that did not hold, in order.
        events: How many events there were.
        hours: How many hours were run.
        endings: How the deeds ended, by name, and how often.
        met: Which disturbances were met, by kind, and how often.
        checks: How often each rule was looked at.
        certified: Tips that were proved, and how many of those lay where they were said to.
    """

    history: History
    broken: list[RuleBroken] = field(default_factory=list)
    events: int = 0
    hours: int = 0
    endings: Counter[str] = field(default_factory=Counter)
    met: Counter[str] = field(default_factory=Counter)
    checks: Counter[str] = field(default_factory=Counter)
    certified: list[bool] = field(default_factory=list)
    _hash: "hashlib._Hash" = field(default_factory=hashlib.sha256)
    _told: deque[tuple[int, int, str]] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _hour: int = -1

    @property
    def hash(self) -> str:
        """SHA-256 over every event, in order."""
        return self._hash.hexdigest()

    def begin_hour(self, number: int) -> None:
        """Note that an hour begins."""
        self._hour = number
        self.hours += 1

    def note(self, now_ns: int, text: str) -> None:
        """Note an event."""
        self.events += 1
        self._hash.update(f"{now_ns} {text}\n".encode())
        self._told.append((self._hour, now_ns, text))

    def break_rule(self, rule: str, sentence: str) -> None:
        """Note that a rule does not hold; the same of one hour is noted once."""
        found = RuleBroken(rule, self._hour, sentence)
        if all((one.rule, one.hour) != (rule, self._hour) for one in self.broken):
            self.broken.append(found)

    def lines(self, *, hour: int | None = None) -> list[str]:
        """Return the events that are kept, as lines.

        Args:
            hour: Of this hour only.
        """
        return [
            f"{at_ns / NS_PER_S:12.6f}  {text}"
            for of, at_ns, text in self._told
            if hour is None or of == hour
        ]

    def told(self) -> str:
        """Return it in words: what was broken, what had happened, and what crossed the wire."""
        history = self.history
        lines = [
            f"seed {history.seed}, {history.kind}: {len(history.hours)} hours, "
            f"{history.disturbances} disturbances, {self.events} events, hash {self.hash}",
        ]
        if not self.broken:
            return "\n".join((*lines, "every rule held"))
        lines += [f"BROKEN  {one}" for one in self.broken]
        first = self.broken[0]
        for hour in history.hours:
            who = hour.habit.person + ("" if hour.habit.careful else f" ({hour.habit})")
            lines.append(f"hour {hour.number}: {who} sets out to {hour.deed}")
            lines += [f"    in the way: {one}" for one in hour.disturbances]
        lines.append(f"hour {first.hour}, event by event:")
        return "\n".join((*lines, *self.lines(hour=first.hour)))
