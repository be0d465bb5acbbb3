"""The surroundings that are in force, and how a test replaces them as a whole."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robolink.ambient.regularly import in_a_thread
from robolink.ambient.waiting import WaitingLock, WaitingRoom


class Ambience:
    """The real surroundings; a subclass stands in for them.

    Attributes:
        steps_time: Whether time passes here only where it is stepped, so that what is done
            regularly keeps to the time of clocks that stand still by themselves.
    """

    steps_time = False

    def random_bytes(self, count: int) -> bytes:
        """Return bytes that nobody can know beforehand."""
        return os.urandom(count)

    def wall_s(self) -> float:
        """Return the wall-clock time, in seconds since 1970 UTC; it may jump."""
        return time.time()

    def monotonic_ns(self) -> int:
        """Return a time that never decreases, in nanoseconds."""
        return time.monotonic_ns()

    def boot_ns(self) -> int:
        """Return the time since the start of the system, asleep or not, in nanoseconds."""
        boottime: int | None = getattr(time, "CLOCK_BOOTTIME", None)
        return time.monotonic_ns() if boottime is None else time.clock_gettime_ns(boottime)

    def sleep(self, seconds: float) -> None:
        """Block the calling thread."""
        time.sleep(seconds)

    def lock(self) -> WaitingLock:
        """Return a new lock."""
        return threading.Lock()

    def reentrant_lock(self) -> WaitingLock:
        """Return a new lock that its holder may take again."""
        return threading.RLock()

    def waiting_room(self) -> WaitingRoom:
        """Return a new condition variable."""
        return threading.Condition()

    def regularly(self, every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
        """Have ``act`` called every so many seconds, beside what this thread does.

        Args:
            every_s: How often.
            act: What is called; it raises nothing.
            name: Of the thread in which that is done, for whoever looks at a list of them.

        Returns:
            What ends it; ``act`` is not under way any more when that returns.

        Example:
            >>> from robolink.ambient import Ambience
            >>> end = Ambience().regularly(60.0, lambda: None, "once a minute")
            >>> end()
        """
        return in_a_thread(every_s, act, name)


_present = Ambience()


@contextmanager
def replaced(ambience: Ambience) -> Iterator[None]:
    """Let ``ambience`` stand in for the real surroundings, in every thread, within the block."""
    global _present  # noqa: PLW0603 - a process has one world around it
    before, _present = _present, ambience
    try:
        yield
    finally:
        _present = before


def random_bytes(count: int) -> bytes:
    """Return bytes that nobody can know beforehand."""
    return _present.random_bytes(count)


def random_number(bits: int) -> int:
    """Return a number from 1 to 2**bits - 1 that nobody can know beforehand; never 0."""
    drawn = int.from_bytes(_present.random_bytes((bits + 7) // 8))
    return drawn % ((1 << bits) - 1) + 1


def wall_s() -> float:
    """Return the wall-clock time, in seconds since 1970 UTC; a label, it may jump."""
    return _present.wall_s()


def monotonic_ns() -> int:
    """Return a time that never decreases, in nanoseconds."""
    return _present.monotonic_ns()


def boot_ns() -> int:
    """Return the time since the start of the system, asleep or not, in nanoseconds."""
    return _present.boot_ns()


def sleep(seconds: float) -> None:
    """Block the calling thread."""
    _present.sleep(seconds)


def lock() -> WaitingLock:
    """Return a new lock."""
    return _present.lock()


def reentrant_lock() -> WaitingLock:
    """Return a new lock that its holder may take again."""
    return _present.reentrant_lock()


def waiting_room() -> WaitingRoom:
    """Return a new condition variable."""
    return _present.waiting_room()


def regularly(every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
    """Have ``act`` called every so many seconds; see :meth:`Ambience.regularly`.

    Args:
        every_s: How often.
        act: What is called; it raises nothing.
        name: Of the thread in which that is done.

    Returns:
        What ends it.

    Example:
        >>> from robolink import ambient
        >>> end = ambient.regularly(60.0, lambda: None, "once a minute")
        >>> end()
    """
    return _present.regularly(every_s, act, name)


def steps_time() -> bool:
    """Tell whether time passes only where it is stepped; see :class:`Ambience`."""
    return _present.steps_time
