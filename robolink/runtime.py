"""What a program gets from its surroundings: chance, time, and locks for threads.

Whatever decides how a run goes and is not given to it comes from here, so that a test can give
it instead: the same chance, the same times and the same order of threads give the same run, byte
for byte (docs/decisions/0026-a-machine-that-looks-for-defects.md). A program never replaces them.

What is left out on purpose: the terminal and the sockets of a stop are read against the real
time, since nothing simulated stands behind them.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Protocol

__all__ = [
    "SystemRuntime",
    "WaitingLock",
    "WaitingRoom",
    "boot_ns",
    "lock",
    "monotonic_ns",
    "random_bytes",
    "random_number",
    "reentrant_lock",
    "regularly",
    "replaced",
    "sleep",
    "steps_time",
    "waiting_room",
    "wall_s",
]


class WaitingLock(Protocol):
    """A lock at which a thread may have to wait; a context manager."""

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """Take it; False where that takes longer than allowed."""

    def release(self) -> None:
        """Release it."""

    def __enter__(self) -> bool: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class WaitingRoom(Protocol):
    """A condition variable: a lock, and threads that wait for a notification."""

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for a notification; False if none came within ``timeout`` seconds."""

    def wait_for(self, predicate: Callable[[], bool], timeout: float | None = None) -> bool:
        """Wait until ``predicate`` is true, at most ``timeout`` seconds; return whether it is."""

    def notify_all(self) -> None:
        """Wake everybody who waits."""

    def __enter__(self) -> bool: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


def in_a_thread(every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
    """Call ``act`` every so many seconds in a thread that ends with its process.

    Args:
        every_s: How often; the first time after so long.
        act: What is called; it raises nothing.
        name: Of the thread.

    Returns:
        What ends the thread, and waits for that.
    """
    ending = threading.Event()

    def run() -> None:
        while not ending.wait(every_s):
            act()

    thread = threading.Thread(target=run, name=name, daemon=True)
    thread.start()

    def end() -> None:
        ending.set()
        thread.join()

    return end


class SystemRuntime:
    """The real surroundings; a subclass replaces them.

    Attributes:
        steps_time: Whether time passes here only where it is stepped, so that what is done
            regularly keeps to the time of clocks that stand still by themselves.
    """

    steps_time = False

    def random_bytes(self, count: int) -> bytes:
        """Return unpredictable bytes."""
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
        """Call ``act`` every so many seconds, besides what this thread does.

        Args:
            every_s: How often.
            act: What is called; it raises nothing.
            name: Of the thread in which that is done, for whoever looks at a list of them.

        Returns:
            What ends it; ``act`` is not under way any more when that returns.

        Example:
            >>> from robolink.runtime import SystemRuntime
            >>> end = SystemRuntime().regularly(60.0, lambda: None, "once a minute")
            >>> end()
        """
        return in_a_thread(every_s, act, name)


_present = SystemRuntime()


@contextmanager
def replaced(ambience: SystemRuntime) -> Iterator[None]:
    """Replace the real surroundings by ``ambience``, in every thread, within the block."""
    global _present  # noqa: PLW0603 - a process has one environment
    before, _present = _present, ambience
    try:
        yield
    finally:
        _present = before


def random_bytes(count: int) -> bytes:
    """Return unpredictable bytes."""
    return _present.random_bytes(count)


def random_number(bits: int) -> int:
    """Return an unpredictable number from 1 to 2**bits - 1; never 0."""
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
    """Call ``act`` every so many seconds; see :meth:`SystemRuntime.regularly`.

    Args:
        every_s: How often.
        act: What is called; it raises nothing.
        name: Of the thread in which that is done.

    Returns:
        What ends it.

    Example:
        >>> from robolink import runtime
        >>> end = runtime.regularly(60.0, lambda: None, "once a minute")
        >>> end()
    """
    return _present.regularly(every_s, act, name)


def steps_time() -> bool:
    """Return whether time passes only in steps; see :class:`SystemRuntime`."""
    return _present.steps_time
