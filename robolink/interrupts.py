"""Ctrl-C between exchanges, never inside one.

A KeyboardInterrupt between a request and its answer would leave the answer in the pipe, to
be taken for the answer to the next question. So it is held back for the length of one
exchange, which a deadline bounds, and raised right after.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_interrupt() -> Iterator[None]:
    """Hold back a SIGINT that arrives inside the block; raise KeyboardInterrupt at its end.

    Does nothing outside the main thread, where Python delivers no signals, and where the
    program has installed a handler of its own.
    """
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield
        return
    held = False

    def hold(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - signal's form
        nonlocal held
        held = True

    signal.signal(signal.SIGINT, hold)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if held:
            raise KeyboardInterrupt
