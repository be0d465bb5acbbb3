"""Keys of a Windows console with the time at which they came, however busy this process is.

What :mod:`robolink_cli.wizard.faces.arrivals` says of a terminal holds here too. The console keeps
a queue of records, which a thread of its own looks into: the loop that draws would find the rest
of a scanned code there late, and take its first digit for a key that a hand pressed.
"""

import os
import threading
import time
from asyncio import get_running_loop
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from prompt_toolkit.input import Input
from prompt_toolkit.key_binding import KeyPress

from robolink_cli.wizard.faces.arrivals import TICK_S, TimedInput, TimedKeys, TimedPress


class TimedConsole(TimedKeys):
    """The keys of a console, each with its time.

    Args:
        source: Reads the queue of the console, without waiting.
        waits: Tells whether there is anything in that queue.
        now_s: The time, monotonic and fine: see :func:`fine_clock`.
    """

    def __init__(
        self,
        source: Input,
        waits: Callable[[], bool],
        now_s: Callable[[], float],
    ) -> None:
        super().__init__(source)
        self._waits, self._now_s = waits, now_s
        self._lock = threading.Lock()
        self._came: list[KeyPress] = []
        self._quiet_s = now_s()
        self._last = (self._quiet_s, self._quiet_s)

    def look(self) -> bool:
        """Take what is there; tell whether there was anything. Any thread may look.

        A lone Esc is no key yet: only when the loop has been told does it ask for what is left.
        """
        with self._lock:
            before_s = self._now_s()
            if not self._waits():
                self._quiet_s = before_s
                return False
            keys = self._source.read_keys()
            self._last = (self._now_s(), self._quiet_s)
            self._keep(keys)
            return True

    def quiet(self) -> float | None:
        """See :meth:`~robolink_cli.wizard.faces.arrivals.ArrivalReader.quiet`."""
        with self._lock:
            before_s = self._now_s()
            if self._came or self._waits():
                return None
            self._quiet_s = before_s
            return before_s

    def read_keys(self) -> list[KeyPress]:
        """Return the keys that came."""
        with self._lock:
            came, self._came = self._came, []
            return came

    def flush_keys(self) -> list[KeyPress]:
        """Return what is no longer taken for the beginning of a longer key."""
        with self._lock:
            self._keep(self._source.flush_keys())
        return self.read_keys()

    @contextmanager
    def attach(self, input_ready_callback: Callable[[], None]) -> Iterator[None]:
        """Have the loop that runs told when there are keys."""
        loop, over = get_running_loop(), threading.Event()

        def follow() -> None:
            while not over.is_set():
                # An Event would wait 16 ms here; since Python 3.11 this is as fine as it says.
                time.sleep(TICK_S)
                if self.look():
                    with suppress(RuntimeError):  # the loop is over
                        loop.call_soon_threadsafe(input_ready_callback)

        thread = threading.Thread(target=follow, name="keys", daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def _keep(self, keys: list[KeyPress]) -> None:
        """Keep keys with the time at which the last of them came."""
        self._came += [TimedPress(one, *self._last) for one in keys]


def fine_clock() -> Callable[[], float]:
    """Return a clock that is finer than two keys of a scanner are apart.

    Up to Python 3.12 ``time.monotonic`` goes in steps of 16 ms on Windows (``GetTickCount64``),
    ``time.perf_counter`` never does. Where the two have drifted apart, the coarse one is right.
    """
    step_s = 2 * time.get_clock_info("monotonic").resolution
    apart_s = time.monotonic() - time.perf_counter()

    def now_s() -> float:
        nonlocal apart_s
        fine_s, coarse_s = time.perf_counter() + apart_s, time.monotonic()
        if abs(fine_s - coarse_s) > max(step_s, 1e-3):
            apart_s += coarse_s - fine_s
            return coarse_s
        return fine_s

    return now_s


def timed(source: Input) -> TimedKeys:
    """Return an input whose keys have their time."""
    if os.name == "posix":
        return TimedInput(source)
    return TimedConsole(source, _queue_of(source), fine_clock())


def _queue_of(source: Any) -> Callable[[], bool]:  # noqa: ANN401 - its class exists on Windows only
    """Return what tells whether the queue of a console holds anything."""
    import ctypes

    console: Any = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined,unused-ignore]
    count = ctypes.c_ulong()

    def waits() -> bool:
        console.GetNumberOfConsoleInputEvents(source.handle, ctypes.byref(count))
        return count.value > 0

    return waits
