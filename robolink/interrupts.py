"""Ctrl-C, a termination, a closed window: between exchanges, never inside one.

A KeyboardInterrupt between a request and its answer would leave the answer in the pipe, to
be taken for the answer to the next question. So while a session is open, SIGINT goes through
a handler that raises KeyboardInterrupt as usual, except inside an exchange: there it is held
back until the exchange, which a deadline bounds, has ended.

A process that would rather be ended than killed has SIGTERM and SIGHUP take the same way for the
time of :func:`one_ending`, as every command does: the movement is aborted, tool, power and speed
are restored, and only then it ends. Without that they do what they always did: they kill, and
``recover`` finds what was left.

The handler is swapped when the first session opens and not once per exchange, because two calls
of ``signal.signal`` would cost more than everything else that the driver does in one. All
sessions of a process share it: a program may hold an EPSON robot and a PLC at a time.

However a block ends, what it holds is given back: :class:`ClosedAtExit`.
"""

import _thread
import signal
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from enum import StrEnum
from types import FrameType, TracebackType
from typing import Final, Self

from robolink import runtime

__all__ = [
    "EndedBy",
    "InterruptGate",
    "Interrupted",
    "end",
    "ended_by",
    "heard_by_this_thread",
    "heed",
    "heed_while_waiting",
    "one_ending",
    "output_closed",
    "seen_through",
    "window_closed",
]


class EndedBy(StrEnum):
    """What ended a command early."""

    CTRL_C = "SIGINT"
    TERMINATED = "SIGTERM"
    HUNG_UP = "SIGHUP"
    """The window was closed, or the connection to it was lost."""

    OUTPUT_CLOSED = "SIGPIPE"
    """Nobody reads the output any more; this arrives as a failed write, not as a signal."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, or what ends a command like it.

    Attributes:
        by: What it was.
    """

    def __init__(self, by: EndedBy) -> None:
        super().__init__(str(by))
        self.by = by


_PATIENCE_S: Final = 60.0
"""Time after which another Ctrl-C takes effect; cleaning up has much shorter deadlines."""


def _known(*names: str) -> dict[int, EndedBy]:
    """Return the signals that this system has; Windows ends a console with SIGBREAK."""
    by = {"SIGBREAK": EndedBy.TERMINATED}
    return {
        int(getattr(signal, name)): by.get(name) or EndedBy(name)
        for name in names
        if hasattr(signal, name)
    }


_OF_A_SESSION: Final = _known("SIGINT")
_OF_A_COMMAND: Final = _known("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


def _usual(number: int) -> Callable[[int, FrameType | None], object] | signal.Handlers:
    """Return Python's default for a signal."""
    return signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL


class _Handler:
    """The one handler of this process, for all gates and for the command.

    Attributes:
        worker: The thread whose work is ended in place of the main thread's, ``None`` for none.
        depth: How many times the thread that is ended is inside a gate.
        held: What came while it was.
        ended_by: What ended the command that is under way, ``None`` while nothing has.
        closed: Whether the window was closed, on Windows, which has no signal for that.
    """

    def __init__(self) -> None:
        self._watchers: dict[int, int] = {}
        self._commands = 0
        self._ended_s = 0.0
        self.worker: int | None = None
        self.depth = 0
        self.held: EndedBy | None = None
        self.ended_by: EndedBy | None = None
        self.closed = False

    def watch(self, numbers: dict[int, EndedBy]) -> list[int]:
        """Handle the signals that nobody else handles; return which."""
        if threading.current_thread() is not threading.main_thread():
            return []
        taken = []
        for number in numbers:
            current = signal.getsignal(number)
            if current is _usual(number):
                signal.signal(number, self._came)
            elif current != self._came:
                continue  # the program handles the signal itself, or ignores it
            self._watchers[number] = self._watchers.get(number, 0) + 1
            taken.append(number)
        return taken

    def leave(self, numbers: list[int], *, for_good: bool = False) -> None:
        """Release one watcher; the last one restores the signals.

        Where the process ends nobody is to hear them, not even a session that was left open.
        """
        for number in numbers:
            self._watchers[number] -= 1
            if self._watchers[number] and not for_good:
                continue
            if signal.getsignal(number) == self._came:
                signal.signal(number, signal.SIG_IGN if for_good else _usual(number))

    def begin_command(self) -> EndedBy | None:
        """Let one ending count from now on; return what has ended the command around it."""
        outer, self.ended_by = self.ended_by, None
        self._commands += 1
        return outer

    def end_command(self, outer: EndedBy | None) -> None:
        """Go back to what was before :meth:`begin_command`."""
        self._commands -= 1
        self.ended_by = outer

    def arrived(self, by: EndedBy) -> None:
        """Raise :class:`Interrupted`, or delay it inside a gate.

        Of a command only the first ending is heard: a second Ctrl-C, or the hang-up that follows
        a closed output, must not break the cleaning up after the first.
        """
        if self._commands:
            now_s = runtime.monotonic_ns() / 1e9
            if self.ended_by is not None and now_s - self._ended_s < _PATIENCE_S:
                return
            self.ended_by, self._ended_s = self.ended_by or by, now_s
        if self.depth or self.worker is not None:
            self.held = self.held or by
        else:
            raise Interrupted(by)

    def _came(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - signature of a signal handler
        self.arrived(EndedBy.HUNG_UP if self.closed else _OF_A_COMMAND[number])

    def heard_here(self) -> bool:
        """Return whether this is the thread whose work is to end."""
        return threading.get_ident() == (_MAIN if self.worker is None else self.worker)

    def let_out(self) -> None:
        """Raise what was delayed, if anything was and no gate is closed.

        Raises:
            Interrupted: It was.
        """
        if self.held is not None and not self.depth:
            by, self.held = self.held, None
            raise Interrupted(by)


_handler = _Handler()


@contextmanager
def heard_by_this_thread() -> Iterator[None]:
    """Let a signal that would end the program end this worker thread's block.

    The main thread is then free to show a screen and to wait for keys. A signal, or :func:`end`,
    is raised here as :class:`Interrupted` where a gate opens, which is after the exchange that is
    under way, and where :func:`heed` is called: the same places at which Ctrl-C is let out of
    the main thread, so that what follows is cleaned up alike.
    """
    _handler.worker = threading.get_ident()
    try:
        yield
    finally:
        _handler.worker = None
        # The interrupt was meant for this work, which has ended.
        _handler.held = None


def heed() -> None:
    """End the work of this thread if that was asked for; for a wait outside a gate.

    Raises:
        Interrupted: It was.
    """
    if _handler.heard_here():
        _handler.let_out()


def heed_while_waiting() -> None:
    """End a wait in which nothing is in progress, inside a gate too.

    Raises:
        KeyboardInterrupt: Ctrl-C, or what ends a program like it, came and was held back.
    """
    heed()
    if _handler.heard_here() and _handler.held is not None:
        raise KeyboardInterrupt  # at its end, the gate raises the interrupt that was held back


def end(by: EndedBy) -> None:
    """End the work of :func:`heard_by_this_thread`, as the signal would.

    Raises:
        Interrupted: There is none, so that the main thread is ended.
    """
    _handler.arrived(by)


@contextmanager
def one_ending(*, last: bool = False) -> Iterator[None]:
    """End the block in order on Ctrl-C, SIGTERM or SIGHUP: by one :class:`Interrupted`.

    For a command or a script as a whole. What the program handles itself, or ignores as ``nohup``
    has it, is left alone. Outside the main thread nothing is changed.

    Args:
        last: Whether the process ends after the block, so that a signal that comes then does not
            change its exit code any more.
    """
    taken = _handler.watch(_OF_A_COMMAND)
    outer = _handler.begin_command() if taken else None
    try:
        yield
    finally:
        if taken:
            _handler.end_command(outer)
        _handler.leave(taken, for_good=last)


def output_closed() -> None:
    """End the command because nobody reads its output.

    Raises:
        Interrupted: At once, or where the gate that the main thread is in ends.
    """
    if threading.current_thread() is threading.main_thread():
        _handler.arrived(EndedBy.OUTPUT_CLOSED)


def window_closed() -> None:
    """End the command because its window was closed; for another thread than the main one.

    On Windows, where the main thread hears of it as of a Ctrl-Break.
    """
    if (number := getattr(signal, "SIGBREAK", None)) is not None:
        _handler.closed = True
        _thread.interrupt_main(number)


def ended_by() -> EndedBy | None:
    """Return what has ended the present command, ``None`` if nothing has."""
    return _handler.ended_by


class InterruptGate:
    """Delays what would end the program while the main thread is inside; a context manager.

    It may be entered inside itself, and inside another one, because some operations are several
    exchanges: a write is not done before it has been read back, and a movement is not under way
    before whoever could abort it knows of it. The outermost end lets Ctrl-C out.

    It stands aside where it is not needed: outside the main thread, where Python delivers no
    signals, but for a worker of :func:`heard_by_this_thread`; and where the program has a SIGINT
    handler of its own.
    """

    def __init__(self) -> None:
        self._taken: list[int] = []
        self._open = False
        self._depth = 0

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C or the like came inside the gate and waits for its end."""
        return bool(self._depth) and _handler.held is not None

    def open(self) -> None:
        """Start to watch SIGINT, if this is the main thread and the program does not."""
        if not self._open:
            self._taken = _handler.watch(_OF_A_SESSION)
            self._open = _handler.heard_here()

    def close(self) -> None:
        """Stop watching. Idempotent; from another thread the handler just stays harmless."""
        if self._open and _handler.heard_here():
            self._open = False
            _handler.leave(self._taken)
            self._taken = []

    def __enter__(self) -> None:
        if self._open and _handler.heard_here():
            self._depth += 1
            _handler.depth += 1

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._depth and _handler.heard_here():
            self._depth -= 1
            _handler.depth -= 1
            if _handler.held is not None:
                _handler.let_out()


class _SeenThrough(InterruptGate):
    """A gate that is open for one block."""

    def __enter__(self) -> None:
        if _handler.depth and _handler.heard_here():
            self._open = True  # the gate around this one watches already
        else:
            self.open()
        try:
            super().__enter__()
        except BaseException:  # Ctrl-C came before the block had begun
            self.close()
            raise

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            super().__exit__(kind, error, trace)
        finally:
            self.close()


def seen_through() -> AbstractContextManager[None]:
    """Delay Ctrl-C for a block that must be completed, whatever session is open.

    For what is stored and then noted in this process: an end in between would leave the two at
    odds. It is raised at the end of the block, or of the gate around it.

    Raises:
        Interrupted: It came meanwhile.
    """
    return _SeenThrough()


_MAIN = threading.main_thread().ident


class ClosedAtExit(ABC):
    """A context manager that the block uses itself, and whose end is its ``close``."""

    @abstractmethod
    def close(self) -> None:
        """Release what it holds. Idempotent."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
