"""Clocks and deadlines.

Whoever waits does so on an injected :class:`Clock`, in integer nanoseconds of a
monotonic time. Wall time appears in records only, as a label.
"""

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self, runtime_checkable

from robolink import runtime

__all__ = [
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
