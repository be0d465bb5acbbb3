"""Time in which nobody does anything, stepped by the test: what goes on beside it goes on in it."""

from collections.abc import Callable
from typing import Protocol

from robolink.runtime import SystemRuntime

_EVERY_S = 1.0


class Steps(Protocol):
    """A clock that a test can step."""

    def now_ns(self) -> int: ...

    def advance(self, seconds: float) -> None: ...


class QuietTime(SystemRuntime):
    """Real surroundings, in which what is done regularly is done when the test lets time pass.

    It is the clock of whoever waits, too: so that others go on meanwhile.

    Args:
        clock: What is stepped.
    """

    steps_time = True

    def __init__(self, clock: Steps) -> None:
        self._clock = clock
        self._acts: dict[object, Callable[[], None]] = {}
        self._since_s = 0.0

    @property
    def going_on(self) -> int:
        """How many things are done regularly just now."""
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
        """Let some seconds pass, and others act once in each."""
        while seconds > 0:
            step_s = min(seconds, _EVERY_S - self._since_s)
            self._clock.advance(step_s)
            self._since_s += step_s
            seconds -= step_s
            if self._since_s >= _EVERY_S:
                self._since_s = 0.0
                for act in [*self._acts.values()]:
                    act()
