"""Simulated idle time: the test advances it, and periodic background work runs as it passes."""

from collections.abc import Callable
from typing import Protocol

from robolink.runtime import SystemRuntime

_EVERY_S = 1.0


class Steps(Protocol):
    """A clock that a test can step."""

    def now_ns(self) -> int: ...

    def advance(self, seconds: float) -> None: ...


class QuietTime(SystemRuntime):
    """A runtime whose periodic work runs when the test advances the time.

    Waiting threads use the same clock, so that periodic work goes on while they wait.

    Args:
        clock: The clock to advance.
    """

    steps_time = True

    def __init__(self, clock: Steps) -> None:
        self._clock = clock
        self._acts: dict[object, Callable[[], None]] = {}
        self._since_s = 0.0

    @property
    def going_on(self) -> int:
        """The number of periodic jobs at present."""
        return len(self._acts)

    def regularly(self, every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
        """See :meth:`robolink.runtime.SystemRuntime.regularly`."""
        assert every_s == _EVERY_S, name
        key = object()
        self._acts[key] = act

        def end() -> None:
            del self._acts[key]

        return end

    def now_ns(self) -> int:
        """Return the time in nanoseconds."""
        return self._clock.now_ns()

    def sleep(self, seconds: float) -> None:
        """Advance the time; each periodic job runs once per second of it."""
        while seconds > 0:
            step_s = min(seconds, _EVERY_S - self._since_s)
            self._clock.advance(step_s)
            self._since_s += step_s
            seconds -= step_s
            if self._since_s >= _EVERY_S:
                self._since_s = 0.0
                for act in [*self._acts.values()]:
                    act()
