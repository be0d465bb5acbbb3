"""Ctrl-C between operations, where several exchanges make up one.

A write is not done before it has been read back, and a movement is not under way before it is
known to whoever could abort it. An interrupt in the middle of either would leave a marker that
nobody clears, or a robot that moves and that nobody watches.
"""

import threading
from types import TracebackType

from robolink.interrupts import InterruptGate


class OperationGate(InterruptGate):
    """An interrupt gate that may be entered inside itself; the outermost end lets Ctrl-C out."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def __enter__(self) -> None:
        if threading.get_ident() == _MAIN:
            self._depth += 1
        super().__enter__()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if threading.get_ident() == _MAIN:
            self._depth -= 1
            if self._depth:
                return
        super().__exit__(kind, error, trace)


_MAIN = threading.main_thread().ident
