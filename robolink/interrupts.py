"""Ctrl-C between exchanges, never inside one.

A KeyboardInterrupt between a request and its answer would leave the answer in the pipe, to
be taken for the answer to the next question. So while a session is open, SIGINT goes through
a handler that raises KeyboardInterrupt as usual, except inside an exchange: there it is held
back until the exchange, which a deadline bounds, has ended.

The handler is swapped when the first session opens and not once per exchange, because two calls
of ``signal.signal`` would cost more than everything else that the driver does in one. All
sessions of a process share it: a program may hold an EPSON robot and a PLC at a time.
"""

import signal
import threading
from types import FrameType, TracebackType


class _Handler:
    """The one SIGINT handler of this process, for all gates.

    Attributes:
        gates: How many gates are open.
        depth: How many times the main thread is inside one.
        held: Whether SIGINT came while it was.
    """

    def __init__(self) -> None:
        self.gates = 0
        self.depth = 0
        self.held = False

    def install(self) -> bool:
        """Watch SIGINT for one gate more; False where that is not possible."""
        if threading.current_thread() is not threading.main_thread():
            return False
        current = signal.getsignal(signal.SIGINT)
        if current is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._interrupted)
        elif current != self._interrupted:
            return False  # the program has a handler of its own
        self.gates += 1
        return True

    def remove(self) -> None:
        """Watch for one gate less; the last one gives SIGINT back."""
        self.gates -= 1
        if self.gates == 0 and signal.getsignal(signal.SIGINT) == self._interrupted:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def _interrupted(self, number: int, frame: FrameType | None) -> None:
        if self.depth:
            self.held = True
        else:
            signal.default_int_handler(number, frame)


_handler = _Handler()


class InterruptGate:
    """Holds back SIGINT while the main thread is inside the gate; a context manager.

    It may be entered inside itself, and inside another one, because some operations are several
    exchanges: a write is not done before it has been read back, and a movement is not under way
    before whoever could abort it knows of it. The outermost end lets Ctrl-C out.

    It stands aside where it is not needed: outside the main thread, where Python delivers no
    signals, and where the program has a SIGINT handler of its own.
    """

    def __init__(self) -> None:
        self._open = False
        self._depth = 0

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C came inside the gate and waits for its end."""
        return bool(self._depth) and _handler.held

    def open(self) -> None:
        """Start to watch SIGINT, if this is the main thread and the program does not."""
        if not self._open:
            self._open = _handler.install()

    def close(self) -> None:
        """Stop watching. Idempotent; from another thread the handler just stays harmless."""
        if self._open and threading.current_thread() is threading.main_thread():
            self._open = False
            _handler.remove()

    def __enter__(self) -> None:
        if self._open and threading.get_ident() == _MAIN:
            self._depth += 1
            _handler.depth += 1

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._depth and threading.get_ident() == _MAIN:
            self._depth -= 1
            _handler.depth -= 1
            if _handler.held and not _handler.depth:
                _handler.held = False
                raise KeyboardInterrupt


_MAIN = threading.main_thread().ident
