"""Clocks and deadlines.

Whoever waits does so on an injected :class:`Clock`, in integer nanoseconds of a
monotonic time. Wall time appears in records only, as a label.
"""

from collections import deque
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self, runtime_checkable

from robolink import runtime

__all__ = [
    "AnswerTimes",
    "Clock",
    "Deadline",
    "FASTEST_ANSWER_S",
    "NS_PER_S",
    "SteppedClock",
    "SystemClock",
    "local_label",
    "wall_label",
    "wall_time",
]

if TYPE_CHECKING:
    from datetime import datetime

NS_PER_S = 1_000_000_000

FASTEST_ANSWER_S = 0.3
"""Shortest time in which a person reads and answers a question, in s (docs/reference/evidence.md
1)."""


class Clock(Protocol):
    """A monotonic time that can be waited on."""

    def now_ns(self) -> int:
        """Return the time in nanoseconds since an arbitrary origin; never decreases."""

    def sleep(self, seconds: float) -> None:
        """Let ``seconds`` of this clock's time pass; zero or less returns at once."""


@runtime_checkable
class SteppedClock(Clock, Protocol):
    """A clock that stands still until somebody waits on it or moves it."""

    def advance_to(self, now_ns: int) -> None:
        """Move the time forward to an instant; one that has passed changes nothing."""


class SystemClock:
    """The machine's monotonic clock."""

    def now_ns(self) -> int:
        """Return the machine's monotonic time in nanoseconds."""
        return runtime.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        """Block the calling thread."""
        if seconds > 0:
            runtime.sleep(seconds)


class Deadline(NamedTuple):
    """One instant that a whole exchange must meet, however many reads it takes."""

    clock: Clock
    at_ns: int

    @classmethod
    def after(cls, clock: Clock, timeout_s: float) -> Self:
        """Return the deadline ``timeout_s`` seconds from now."""
        return cls(clock, clock.now_ns() + int(timeout_s * NS_PER_S))

    def remaining_s(self) -> float:
        """Return the seconds left, 0.0 when the deadline has passed."""
        left_ns = self.at_ns - self.clock.now_ns()
        return left_ns / NS_PER_S if left_ns > 0 else 0.0

    @property
    def expired(self) -> bool:
        """Whether the instant has been reached."""
        return self.clock.now_ns() >= self.at_ns


class AnswerTimes:
    """How long the far end of a connection takes to answer, and for how many answers one waits.

    Attributes:
        clock: The clock of the connection.
        waited: How many answers held up what came next.
        moving: How many more came while a movement was under way.

    Example:
        >>> from robolink.timing import AnswerTimes, SystemClock
        >>> times = AnswerTimes(SystemClock())
        >>> times.median_s is None
        True
        >>> times.answered(times.clock.now_ns())
        >>> times.median_s < 1
        True
    """

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.waited, self.moving = 0.0, 0
        self._last_ns: deque[int] = deque(maxlen=_LAST_ANSWERS)

    def answered(self, asked_ns: int, *, moving: bool = False, awaited: bool = True) -> None:
        """Note an answer that came just now.

        Args:
            asked_ns: When its request was sent.
            moving: Whether a movement is under way.
            awaited: Whether it counts at all: one that is only asked for because answers come at
                once does not.
        """
        self._last_ns.append(self.clock.now_ns() - asked_ns)
        self.waited += awaited and not moving
        self.moving += awaited and moving

    @property
    def last_s(self) -> float | None:
        """The last answer; ``None`` before the first one."""
        return self._last_ns[-1] / NS_PER_S if self._last_ns else None

    @property
    def median_s(self) -> float | None:
        """The median of the last answers; ``None`` before the first one."""
        if not self._last_ns:
            return None
        return sorted(self._last_ns)[len(self._last_ns) // 2] / NS_PER_S


_LAST_ANSWERS = 64
"""Number of answers that are kept: those of connecting, and of what is read before a movement."""


def wall_label() -> str:
    """Return the wall-clock time, ISO 8601 UTC, as a label for people."""
    return _label(int(runtime.wall_s()))


@lru_cache(maxsize=1)
def _label(second: int) -> str:
    from datetime import UTC, datetime  # here, because most users of clocks need no calendar

    return datetime.fromtimestamp(second, UTC).isoformat(timespec="seconds")


def wall_time() -> "datetime":
    """Return the wall-clock time in UTC, which may jump: for labels and due days only."""
    from datetime import UTC, datetime  # as above

    return datetime.fromtimestamp(runtime.wall_s(), UTC)


def local_label(at: str) -> str:
    """Return a wall-clock label as the clock on the wall shows it: ``2026-11-23 14:58 (UTC+1)``.

    For screens only: records keep UTC.

    Args:
        at: ISO 8601 with its zone; what is none, as in a damaged record, is returned as it is.

    Example:
        >>> from robolink.timing import local_label
        >>> local_label("unknown")
        'unknown'
    """
    from datetime import datetime, timedelta  # as above

    try:
        local = datetime.fromisoformat(at)
        if local.tzinfo is None:
            return at
        local = local.astimezone()
    except (ValueError, OverflowError, OSError):  # Windows knows no time zone before 1970
        return at
    minutes = (local.utcoffset() or timedelta()) // timedelta(minutes=1)
    hours, rest = divmod(abs(minutes), 60)
    ahead = f"{'-' if minutes < 0 else '+'}{hours}" if minutes else ""
    return f"{local:%Y-%m-%d %H:%M} (UTC{ahead}{f':{rest:02d}' if rest else ''})"
