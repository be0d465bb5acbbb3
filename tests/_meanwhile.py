"""A runtime in which waiting takes no time and the first wait can trigger an event."""

import threading
from collections.abc import Callable

from robolink import runtime


class Meanwhile(runtime.SystemRuntime):
    """A runtime in which a wait takes no time.

    Args:
        happens: Called once, at the first wait.

    Attributes:
        slept_s: The sum of all waits.
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
