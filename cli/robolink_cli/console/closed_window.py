"""The window of a Windows console is closed: ends the work in order, in the time that is left.

Windows calls a handler in a thread of its own, and ends the process when that returns, after 5 s at
the latest ("HandlerRoutine callback function" of Microsoft's console documentation). So the handler
ends the work as SIGHUP does elsewhere and returns when the command is through.
"""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from robolink.interrupts import window_closed

_KINDS: Final = frozenset({2, 5, 6})
"""Console events: the window is closed, the user logs off, the computer shuts down."""

_PATIENCE_S: Final = 4.5


@contextmanager
def closing_in_order() -> Iterator[None]:
    """Let a closed window end the block in order, on Windows; elsewhere SIGHUP does."""
    if sys.platform != "win32" or threading.current_thread() is not threading.main_thread():
        yield
        return
    import ctypes

    closed, over = threading.Event(), threading.Event()

    def came(kind: int) -> bool:
        if kind not in _KINDS:
            return False
        closed.set()
        window_closed()
        over.wait(_PATIENCE_S)
        return True

    handler = ctypes.WINFUNCTYPE(ctypes.c_int, ctypes.c_ulong)(came)
    console = ctypes.windll.kernel32
    console.SetConsoleCtrlHandler(handler, True)
    try:
        yield
    finally:
        over.set()
        if not closed.is_set():
            # Otherwise Windows waits for that handler. Do not wait for Windows here: it may keep
            # the list of handlers locked meanwhile.
            console.SetConsoleCtrlHandler(handler, False)
