"""Keys with the time at which they reached the terminal, however busy this process is.

Whether a key was pressed by a hand is told by what came just before and after it
(:mod:`robolink_cli.wizard.keys`). On a busy computer a screen is drawn for longer than a hand
needs for two keys, so the loop that draws cannot tell. A thread of its own reads each key as it
comes. It notes when, and the last time before at which surely nothing was there to be read: where
even that thread came late, two keys are no further apart than it can show.
"""

import codecs
import os
import select
import threading
import time
from abc import abstractmethod
from asyncio import get_running_loop
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from typing import Any, Final

from prompt_toolkit.input import Input
from prompt_toolkit.input.vt100_parser import Vt100Parser
from prompt_toolkit.key_binding import KeyPress

from robolink_cli.wizard.keys import ALONE_S

TICK_S: Final = 0.005
"""Interval in seconds between checks for further keys."""

_WATCHED_S: Final = ALONE_S + 2 * TICK_S
_MOST_BYTES: Final = 1024


@dataclass(frozen=True, slots=True)
class Arrival:
    """Input that came in one piece.

    Attributes:
        data: The bytes, empty at the end of the stream.
        at_s: It had come by then.
        quiet_s: Nothing was there to be read then; the last such time that is known.
    """

    data: bytes
    at_s: float
    quiet_s: float


class ArrivalReader:
    """Reads a descriptor, and notes the time. Any thread may read.

    Args:
        fd: What is read.
        now_s: The time, monotonic.

    Attributes:
        over: Whether nothing will come any more.
    """

    def __init__(self, fd: int, now_s: Callable[[], float] = time.monotonic) -> None:
        self.over = False
        self._fd, self._now_s = fd, now_s
        self._lock = threading.Lock()
        self._came: list[Arrival] = []
        self._quiet_s = self._last_s = now_s()

    def look(self) -> bool:
        """Read what is there; return whether anything was."""
        with self._lock:
            before_s = self._now_s()
            if self.over or not _readable(self._fd):
                self._quiet_s = before_s
                return False
            try:
                data = os.read(self._fd, _MOST_BYTES)
            except OSError:  # the far end of the terminal is gone: a signal reports it
                self.over = True
                return False
            self.over = not data
            self._last_s = self._now_s()
            self._came.append(Arrival(data, self._last_s, self._quiet_s))
            return True

    def taken(self) -> list[Arrival]:
        """Return what came since the last call."""
        with self._lock:
            came, self._came = self._came, []
            return came

    def quiet(self) -> float | None:
        """Return a time at which nothing was there, ``None`` while something waits to be read.

        What waits to be read is left to the thread, which tells the loop of it.
        """
        with self._lock:
            before_s = self._now_s()
            if self._came or (not self.over and _readable(self._fd)):
                return None
            self._quiet_s = before_s
            return before_s

    @property
    def watched(self) -> bool:
        """Return whether it is still unknown if something follows the last input."""
        return self._quiet_s - self._last_s < _WATCHED_S

    @contextmanager
    def following(self, came: Callable[[], None]) -> Iterator[None]:
        """Read in a thread of its own; ``came`` is called there when there is input."""
        end, ends = os.pipe()

        def follow() -> None:
            while not self.over:
                waits_s = TICK_S if self.watched else None
                if end in _readable(self._fd, end, wait_s=waits_s):
                    return
                if self.look():
                    came()

        thread = threading.Thread(target=follow, name="keys", daemon=True)
        thread.start()
        try:
            yield
        finally:
            os.close(ends)
            thread.join()
            os.close(end)


class TimedPress(KeyPress):
    """A key, with when it came.

    Attributes:
        at_s: See :class:`Arrival`.
        quiet_s: See there.
    """

    def __init__(self, press: KeyPress, at_s: float, quiet_s: float) -> None:
        super().__init__(press.key, press.data)
        self.at_s, self.quiet_s = at_s, quiet_s


class TimedKeys(Input):
    """The keys of another input, each with its time; that input does the rest.

    Args:
        source: Where they come from.
    """

    def __init__(self, source: Input) -> None:
        self._source = source

    @abstractmethod
    def quiet(self) -> float | None:
        """See :meth:`ArrivalReader.quiet`."""

    def detach(self) -> AbstractContextManager[None]:
        """Nothing is run in place of a screen."""
        return nullcontext()

    @property
    def closed(self) -> bool:
        """Whether the stream has ended."""
        return self._source.closed

    def fileno(self) -> int:
        """Return the descriptor of the source."""
        return self._source.fileno()

    def typeahead_hash(self) -> str:
        """Return the name under which keys of the source are kept."""
        return self._source.typeahead_hash()

    def raw_mode(self) -> AbstractContextManager[None]:
        """Let each key through as it is pressed."""
        return self._source.raw_mode()

    def cooked_mode(self) -> AbstractContextManager[None]:
        """Let whole lines through."""
        return self._source.cooked_mode()


class TimedInput(TimedKeys):
    """The keys of a terminal, or a pipe, of a POSIX system, each with its time.

    Args:
        source: The terminal.
    """

    def __init__(self, source: Input) -> None:
        super().__init__(source)
        self._reader = ArrivalReader(source.fileno())
        self._decoder = codecs.getincrementaldecoder("utf-8")("surrogateescape")
        self._pressed: list[KeyPress] = []
        self._parser = Vt100Parser(self._pressed.append)
        self._came = Arrival(b"", 0.0, 0.0)
        self._closed = False

    def quiet(self) -> float | None:
        """See :meth:`ArrivalReader.quiet`."""
        return self._reader.quiet()

    def read_keys(self) -> list[KeyPress]:
        """Return the keys that came."""
        keys: list[KeyPress] = []
        for came in self._reader.taken():
            self._closed |= not came.data
            self._came = came
            self._parser.feed(self._decoder.decode(came.data))
            keys += self._timed()
        return keys

    def flush_keys(self) -> list[KeyPress]:
        """Return the keys that can no longer be the beginning of a longer key."""
        self._parser.flush()
        return self._timed()

    def _timed(self) -> list[KeyPress]:
        keys = [TimedPress(one, self._came.at_s, self._came.quiet_s) for one in self._pressed]
        self._pressed.clear()
        return [*keys]

    @contextmanager
    def attach(self, input_ready_callback: Callable[[], None]) -> Iterator[None]:
        """Notify the running loop when there are keys."""
        loop = get_running_loop()

        def came() -> None:
            with suppress(RuntimeError):  # the loop is over
                loop.call_soon_threadsafe(input_ready_callback)

        with self._reader.following(came):
            yield

    @property
    def closed(self) -> bool:
        """Whether the stream has ended."""
        return self._closed


def _readable(*descriptors: int, wait_s: float | None = 0.0) -> list[int]:
    """Return the readable ones; a closed one counts, so that its end is found."""
    try:
        return select.select(descriptors, [], [], wait_s)[0]
    except (OSError, ValueError):
        return [descriptors[0]]


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
        """Read what is there; return whether there was anything. Any thread may read.

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
        """Return the keys that can no longer be the beginning of a longer key."""
        with self._lock:
            self._keep(self._source.flush_keys())
        return self.read_keys()

    @contextmanager
    def attach(self, input_ready_callback: Callable[[], None]) -> Iterator[None]:
        """Notify the running loop when there are keys."""
        loop, over = get_running_loop(), threading.Event()

        def follow() -> None:
            while not over.is_set():
                # An Event would wait 16 ms here; since Python 3.11, sleep is accurate.
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
    """Return a clock that is finer than the time between two keys of a scanner.

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
    """Return a function that reports whether the queue of a console holds anything."""
    import ctypes

    console: Any = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined,unused-ignore]
    count = ctypes.c_ulong()

    def waits() -> bool:
        console.GetNumberOfConsoleInputEvents(source.handle, ctypes.byref(count))
        return count.value > 0

    return waits
