"""Stopped means stopped: the latch that everything passes on its way out of this process.

``stop()`` closes the latch before it waits for anything. From then on, until a person opens it
with ``release_stop()``, no movement, jog, write or program start leaves this process, whenever it
was begun. Whoever sends asks :meth:`StopLatch.admit` while he holds the lock of the exchange, so
that between the look and the send nothing fits: what was sent before the latch closed is met by
the stop that follows under the same lock, what comes after it is refused.

Two things are let through, and only in the thread that does them on purpose: the restoring of
tool, power and speed at the end of a procedure, and one roll-back of each tool of an open change.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum, auto

from robolink import runtime
from robolink.errors import Concerning, ControllerError, StoppedError, UnclearAnswerError
from robolink.messages import tr

__all__ = [
    "CommandClass",
    "StopLatch",
]


class CommandClass(Enum):
    """What a request does to the machine."""

    LOOK = auto()
    """It reads, logs in or out, or shows that this side is alive."""

    CALM = auto()
    """It stops, ends or switches off."""

    RESET = auto()
    """It clears an error, or releases the hold of a stop."""

    RESTORE = auto()
    """It selects a tool, or sets power or speed."""

    WRITE = auto()
    """It writes or clears a tool."""

    ACT = auto()
    """Anything else: it moves, starts a program, switches motors or an output on."""


class StopLatch:
    """Open until somebody stops; closed until somebody releases it.

    Args:
        controller: Identity of the controller, for the errors.
    """

    def __init__(self, controller: str) -> None:
        self._controller = controller
        self._closed = False
        self._closings = 0
        self._stops = runtime.waiting_room()
        self._under_way = 0
        self._permits = threading.local()
        self._put_back: set[int] = set()
        self._tell: Callable[[str], None] | None = None

    def tell(self, told: Callable[[str], None]) -> None:
        """Tell ``told`` of each request that is admitted, where the link itself tells nothing."""
        self._tell = told

    @property
    def closed(self) -> bool:
        """Whether a stop is in force."""
        return self._closed

    @property
    def restores(self) -> bool:
        """Whether this thread is putting back what was in force before."""
        return self._permit("restoring")

    def close(self) -> None:
        """Hold everything back from now on; never waits."""
        self._closings += 1
        self._closed = True

    @contextmanager
    def stopping(self) -> Iterator[None]:
        """Close the latch, and surround the dialogue that brings the machine to rest."""
        self.close()
        with self._stops:
            self._under_way += 1
        try:
            yield
        finally:
            with self._stops:
                self._under_way -= 1
                self._stops.notify_all()

    def await_stops(self, timeout_s: float) -> None:
        """Let the stops that are under way in other threads end before the link is closed."""
        with self._stops:
            self._stops.wait_for(lambda: not self._under_way, timeout_s)

    def release(self) -> None:
        """Let things pass again, because a person says so."""
        self._put_back.clear()
        self._closed = False

    def admit(self, kind: CommandClass, request: str) -> None:
        """Hold ``request`` back if a stop forbids it; called under the lock of its exchange.

        Raises:
            StoppedError: It was not sent.
        """
        if self._closed:
            self._require_admitted(kind, request)
        if self._tell is not None:
            self._tell(request)

    def _require_admitted(self, kind: CommandClass, request: str) -> None:
        if kind in (CommandClass.LOOK, CommandClass.CALM):
            return
        if kind is CommandClass.RESET and self._permits.__dict__.get("calms") == self._closings:
            return
        if kind is CommandClass.RESTORE and self.restores:
            return
        if kind is CommandClass.WRITE and self._permit("writing"):
            return
        said = tr("{request} was not sent: the controller was stopped.", request=request)
        raise self._stopped(said, request)

    def require_open(self, request: str) -> None:
        """Refuse to begin, or to go on with, an operation of several exchanges.

        A thread that restores is let through; what it may send is decided by :meth:`admit`.

        Raises:
            StoppedError: A stop is in force.
        """
        if self._closed and not self.restores:
            raise self._stopped(tr("{request}: ended by a stop.", request=request), request)

    @contextmanager
    def watching(self, request: str) -> Iterator[None]:
        """Surround an operation that must not begin under a stop, nor end well under one.

        Raises:
            StoppedError: A stop was in force at its beginning, or came meanwhile.
        """
        self.require_open(request)
        with self.ending(request):
            yield

    @contextmanager
    def ending(self, request: str) -> Iterator[None]:
        """Surround what must not end well under a stop.

        Raises:
            StoppedError: A stop is in force at its end, be that a success or a "no" of the
                controller, which the stop explains.
        """
        with Concerning(self._controller, request):
            try:
                yield
            except (ControllerError, UnclearAnswerError):
                self.require_open(request)
                raise
            self.require_open(request)

    @contextmanager
    def calming(self, request: str) -> Iterator[None]:
        """Surround what may begin under a stop: a reset, or switching off.

        A stop that comes meanwhile ends it as it ends everything else, and no reset of before is
        sent after it: it would release what this stop holds. Where a person is asked about it
        first, a block around question and reset lets it count from the question.

        Raises:
            StoppedError: A stop came meanwhile.
        """
        permits, closed = self._permits.__dict__, self._closed
        before = permits.get("calms")
        began = permits["calms"] = self._closings if before is None else before
        try:
            if closed:
                yield
            else:
                with self.ending(request):
                    yield
            if self._closings != began:
                self.require_open(request)
        finally:
            permits["calms"] = before

    @contextmanager
    def restoring(self) -> Iterator[None]:
        """Let this thread select a tool and set power and speed although a stop is in force."""
        before = self.restores
        self._permits.restoring = True
        try:
            yield
        finally:
            self._permits.restoring = before

    @contextmanager
    def putting_back(self, tool: int) -> Iterator[None]:
        """Let this thread write the old value of ``tool`` although a stop is in force; once.

        Raises:
            StoppedError: That was done since the stop already.
        """
        if self._closed and tool in self._put_back:
            self.admit(CommandClass.ACT, tr("Tool {tool}, put back once more,", tool=tool))
        before = self._permit("writing")
        self._permits.writing = True
        try:
            with self.restoring():
                yield
        finally:
            self._permits.writing = before
            if self._closed:
                self._put_back.add(tool)

    def _permit(self, name: str) -> bool:
        return bool(self._permits.__dict__.get(name))

    def _stopped(self, said: str, request: str) -> StoppedError:
        remedy = tr(
            "The robot will not move by itself. When the cell is clear, release the stop and "
            "start again."
        )
        return StoppedError(said, remedy=remedy, controller=self._controller, request=request)
