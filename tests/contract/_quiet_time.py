"""Time in which nobody does anything, stepped by the test: what goes on beside it goes on in it."""

from collections.abc import Callable
from typing import Protocol

from robolink.ambient import Ambience


class Steps(Protocol):
    """A clock that a test can step."""

    def now_ns(self) -> int: ...

    def advance(self, seconds: float) -> None: ...


class QuietTime(Ambience):
    """Real surroundings, in which what is done regularly is done when the test lets time pass.

    It is the clock of whoever waits, too: so that others go on meanwhile.

    Args:
        clock: What is stepped.
    """

    steps_time = True

    def __init__(self, clock: Steps) -> None:
        self._clock = clock
        self._acts: dict[object, Callable[[], None]] = {}

    @property
    def going_on(self) -> int:
        """How many things are done regularly just now."""
        return len(self._acts)

    def regularly(self, every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
        """See :meth:`robolink.ambient.Ambience.regularly`; a second is the step here."""
        assert every_s == 1.0, name
        key = object()
        self._acts[key] = act
        return lambda: self._acts.pop(key, None) and None

    def now_ns(self) -> int:
        """Return the time in nanoseconds."""
        return self._clock.now_ns()

    def sleep(self, seconds: float) -> None:
        """Let some seconds pass, one by one."""
        for _ in range(round(seconds)):
            self._clock.advance(1.0)
            for act in [*self._acts.values()]:
                act()
