"""Time that passes only where somebody waits, and something that happens then."""

import threading
from collections.abc import Callable

from robolink import runtime


class Meanwhile(runtime.SystemRuntime):
    """Surroundings in which a wait takes no time.

    Args:
        happens: What is done at the first wait, once.

    Attributes:
        slept_s: How long was waited in all.
    """

    def __init__(self, happens: Callable[[], None] = lambda: None) -> None:
        self.slept_s = 0.0
        self._happens = happens

    def monotonic_ns(self) -> int:
        return int(self.slept_s * 1e9)

    def sleep(self, seconds: float) -> None:
        self.slept_s += seconds
        happens, self._happens = self._happens, lambda: None
        happens()

    def waiting_room(self) -> runtime.WaitingRoom:
        return QuickRoom(self)


class QuickRoom(threading.Condition):
    def __init__(self, time: Meanwhile) -> None:
        super().__init__()
        self._time = time

    def wait(self, timeout: float | None = None) -> bool:
        assert timeout is not None
        self._time.sleep(timeout)
        return False
