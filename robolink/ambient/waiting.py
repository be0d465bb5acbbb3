"""What threads wait at, as :mod:`threading` has it."""

from collections.abc import Callable
from types import TracebackType
from typing import Protocol


class WaitingLock(Protocol):
    """A lock at which a thread may have to wait; a context manager."""

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """Take it; False where that takes longer than allowed."""

    def release(self) -> None:
        """Give it back."""

    def __enter__(self) -> bool: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class WaitingRoom(Protocol):
    """A condition variable: a lock, and threads that wait inside it for news."""

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for news; False where none came within ``timeout`` seconds."""

    def wait_for(self, predicate: Callable[[], bool], timeout: float | None = None) -> bool:
        """Wait until ``predicate`` holds, ``timeout`` seconds at most; return whether it does."""

    def notify_all(self) -> None:
        """Let everybody who waits look again."""

    def __enter__(self) -> bool: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
