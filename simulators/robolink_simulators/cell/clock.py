"""Clocks for simulated time: one that a test steps, and one that runs at a factor of real time."""

import threading

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, SystemClock


class ManualClock:
    """A clock that stands still until someone waits on it or advances it. Thread-safe.

    Args:
        start_ns: The time at first.
    """

    def __init__(self, start_ns: int = 0) -> None:
        self._lock = threading.Lock()
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the simulated time in nanoseconds."""
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        """Let ``seconds`` pass at once."""
        self.advance(max(0.0, seconds))

    def advance(self, seconds: float) -> None:
        """Move the time forward.

        Raises:
            ConfigError: ``seconds`` is negative.
        """
        if seconds < 0:
            raise ConfigError(
                tr("A clock cannot go back by {seconds} s.", seconds=-seconds),
                remedy=tr("Advance by zero or more seconds."),
            )
        with self._lock:
            self._now_ns += round(seconds * NS_PER_S)

    def advance_to(self, now_ns: int) -> None:
        """Move the time forward to ``now_ns``; an instant that has passed changes nothing."""
        with self._lock:
            self._now_ns = max(self._now_ns, now_ns)


class ScaledClock:
    """Simulated time that runs ``factor`` times as fast as another clock.

    Args:
        factor: Simulated seconds per second of ``base``; above zero.
        base: The clock that really passes.

    Raises:
        ConfigError: ``factor`` is not above zero.
    """

    def __init__(self, factor: float = 1.0, base: Clock | None = None) -> None:
        if not 0 < factor < float("inf"):
            raise ConfigError(
                tr("Simulated time cannot run at a factor of {factor}.", factor=factor),
                remedy=tr("Give a number above zero, for example 1 or 10."),
            )
        self._factor = factor
        self._base = base or SystemClock()
        self._origin_ns = self._base.now_ns()

    def now_ns(self) -> int:
        """Return the simulated time in nanoseconds."""
        passed_ns = self._base.now_ns() - self._origin_ns
        return self._origin_ns + (passed_ns if self._factor == 1 else int(passed_ns * self._factor))

    def sleep(self, seconds: float) -> None:
        """Block until ``seconds`` of simulated time have passed."""
        self._base.sleep(seconds / self._factor)

    def real_seconds(self, until_ns: int) -> float:
        """Return how long it really takes until the simulated instant, 0.0 when it passed."""
        return max(0, until_ns - self.now_ns()) / NS_PER_S / self._factor

    def really_takes_s(self, seconds: float) -> float:
        """Return how many seconds of the base clock so many simulated ones are."""
        return seconds / self._factor
