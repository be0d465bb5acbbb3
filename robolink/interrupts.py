"""Ctrl-C between exchanges, never inside one.

A KeyboardInterrupt between a request and its answer would leave the answer in the pipe, to
be taken for the answer to the next question. So while a session is open, SIGINT goes through
a handler that raises KeyboardInterrupt as usual, except inside an exchange: there it is held
back until the exchange, which a deadline bounds, has ended.

The handler is swapped once per session and not once per exchange, because two calls of
``signal.signal`` would cost more than everything else that the driver does in one.
"""

import signal
import threading
from types import FrameType, TracebackType


class InterruptGate:
    """Holds back SIGINT while the main thread is inside the gate; a context manager.

    It may be entered inside itself, because some operations are several exchanges: a write
    is not done before it has been read back, and a movement is not under way before whoever
    could abort it knows of it. The outermost end lets Ctrl-C out.

    It stands aside where it is not needed: outside the main thread, where Python delivers no
    signals, and where the program has a SIGINT handler of its own.
    """

    def __init__(self) -> None:
        self._open = False
        self._depth = 0
        self._held = False

    def open(self) -> None:
        """Start to watch SIGINT, if this is the main thread and nobody else does."""
        if (
            threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        ):
            signal.signal(signal.SIGINT, self._interrupted)
            self._open = True

    def close(self) -> None:
        """Give SIGINT back. Idempotent; from another thread the handler just stays harmless."""
        if self._open and threading.current_thread() is threading.main_thread():
            if signal.getsignal(signal.SIGINT) == self._interrupted:
                signal.signal(signal.SIGINT, signal.default_int_handler)
            self._open = False

    def __enter__(self) -> None:
        if self._open and threading.get_ident() == _MAIN:
            self._depth += 1

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._depth and threading.get_ident() == _MAIN:
            self._depth -= 1
            if self._held and not self._depth:
                self._held = False
                raise KeyboardInterrupt

    def _interrupted(self, number: int, frame: FrameType | None) -> None:
        if self._depth:
            self._held = True
        else:
            signal.default_int_handler(number, frame)


_MAIN = threading.main_thread().ident
