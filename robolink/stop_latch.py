"""Stopped means stopped: the latch that everything sent by this process passes.

``stop()`` closes the latch before it waits for anything. From then on, until a person opens it
with ``release_stop()``, no movement, jog, write or program start leaves this process, whenever it
was begun. Whoever sends asks :meth:`StopLatch.admit` while he holds the lock of the exchange, so
that between the look and the send nothing fits: what was sent before the latch closed is met by
the stop that follows under the same lock, what comes after it is refused.

Two things are let through, and only in the thread that does them on purpose: the restoring of
tool, power and speed at the end of a procedure, and one roll-back of each tool of an open change.

How long a call waits for another thread, program or person stands here too: a stop ends the wait.
"""

import itertools
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from enum import Enum, auto
from types import TracebackType
from typing import Final, TypeVar

from robolink import runtime
from robolink.errors import (
    Concerning,
    ConfigError,
    ControllerError,
    LeaseHeldError,
    RobolinkError,
    StoppedError,
    UnclearAnswerError,
)
from robolink.interrupts import heed_while_waiting
from robolink.messages import joined, tr

__all__ = [
    "CommandClass",
    "LONGEST_WAIT_S",
    "Patience",
    "StopLatch",
]

_STOP_ENDS_S: Final = 10.0
"""Longest wait in s for the end of a stop before it is released: five to rest, and its link."""


class CommandClass(Enum):
    """What a request does to the machine."""

    LOOK = auto()
    """The command reads, logs in or out, or shows that this side is alive."""

    CALM = auto()
    """The command stops, ends or switches off something."""

    RESET = auto()
    """The command clears an error, or ends the hold of a stop."""

    RESTORE = auto()
    """The command selects a tool, or sets power or speed."""

    WRITE = auto()
    """The command writes or clears a tool."""

    ACT = auto()
    """Any other command: it moves, starts a program, or switches motors or an output on."""


class _Permits(threading.local):
    """What a thread may do under a stop."""

    restoring = writing = False
    calms: int | None = None


class StopLatch:
    """Open until somebody stops; closed until somebody releases it.

    Args:
        controller: Identity of the controller, for the errors.
    """

    def __init__(self, controller: str) -> None:
        self._controller = controller
        self._severed = False
        self._count = itertools.count(1)
        self._closings = self._released = 0
        self._stops = runtime.waiting_room()
        self._under_way = 0
        self._permits = _Permits()
        self._put_back: set[int] = set()
        self._tell: Callable[[str], None] | None = None

    def tell(self, told: Callable[[str], None]) -> None:
        """Report each admitted request to ``told``, if the link itself reports nothing."""
        self._tell = told

    @property
    def closed(self) -> bool:
        """Whether a stop is active: it has closed since it was released, or for good."""
        return self._closings != self._released or self._severed

    @property
    def closings(self) -> int:
        """How often it has closed: a waiter sees from this that a stop came meanwhile."""
        return self._closings

    @property
    def restores(self) -> bool:
        """Whether this thread is restoring earlier settings."""
        return self._permits.restoring

    def close(self) -> None:
        """Refuse everything from now on; never waits."""
        # A number that no two threads share: a release never opens what closes just then.
        self._closings = next(self._count)

    @property
    def severed(self) -> bool:
        """Whether it stays closed, as :meth:`sever` says."""
        return self._severed

    def sever(self) -> None:
        """Close it for good; never waits. Nothing is restored or put back any more either.

        For who cuts off a thread that hangs: whenever that one wakes up, it finds a controller
        that somebody else may have recovered meanwhile. What stops, and looks, still passes.
        """
        self._severed = True
        self.close()

    @contextmanager
    def stopping(self) -> Iterator[None]:
        """Close the latch, and surround the dialogue that stops the machine."""
        self.close()
        with self._stops:
            self._under_way += 1
        try:
            yield
        finally:
            with self._stops:
                self._under_way -= 1
                self._stops.notify_all()

    @property
    def under_way(self) -> bool:
        """Whether a stop is in progress, in whatever thread."""
        return self._under_way > 0

    def await_stops(self, timeout_s: float) -> None:
        """Let stops in progress in other threads end before the link is closed."""
        with self._stops:
            self._stops.wait_for(lambda: not self._under_way, timeout_s)

    def release(self) -> None:
        """Release the latch at a person's request, once the stops in progress have ended.

        A movement that began while another thread still stops would be met by that stop halfway.
        Only what the person knew of is released: stops of before, in :meth:`calming` before it.

        Raises:
            StoppedError: A stop does not end, or another one came meanwhile.
        """
        known = self._closings if self._permits.calms is None else self._permits.calms
        with self._stops:
            if not self._stops.wait_for(lambda: not self._under_way, _STOP_ENDS_S):
                said = tr("{controller} is still being stopped.", controller=self._controller)
                remedy = tr("Look at the robot. Release the stop when it has ended.")
                raise self._stopped(said, remedy=remedy)
            if self._closings != known:
                said = tr("{controller} was stopped once more.", controller=self._controller)
                raise self._stopped(said)
            self._put_back.clear()
            self._released = known

    def admit(self, kind: CommandClass, request: str) -> None:
        """Refuse ``request`` if a stop forbids it; called under the lock of its exchange.

        Raises:
            StoppedError: It was not sent.
        """
        if self._closings != self._released or self._severed:
            self._require_admitted(kind, request)
        if self._tell is not None:
            self._tell(request)

    def _require_admitted(self, kind: CommandClass, request: str) -> None:
        free = kind in (CommandClass.LOOK, CommandClass.CALM)
        if free or (not self._severed and self._is_permitted(kind)):
            return
        said = tr("{request} was not sent: the controller was stopped.", request=request)
        raise self._stopped(said, request)

    def _is_permitted(self, kind: CommandClass) -> bool:
        """Whether this thread resets, restores or puts back on purpose."""
        if kind is CommandClass.RESET:
            return self._permits.calms == self._closings
        if kind is CommandClass.RESTORE:
            return self._permits.restoring
        return kind is CommandClass.WRITE and self._permits.writing

    def require_open(self, request: str) -> None:
        """Refuse to start, or to continue, an operation of several exchanges.

        A thread that restores is let through; what it may send is decided by :meth:`admit`.

        Raises:
            StoppedError: A stop is active.
        """
        if self.closed and not self.restores:
            raise self._stopped(tr("{request}: ended by a stop.", request=request), request)

    def require_unstopped(self, since: int, request: str) -> None:
        """Refuse to wait any longer once a stop came, even one that is released again.

        Args:
            since: What :attr:`closings` was when the wait began.
            request: What waits.

        Raises:
            StoppedError: A stop came; nothing was sent.
        """
        if self._closings != since:
            raise self._stopped(tr("{request}: ended by a stop.", request=request), request)

    def watching(self, request: str) -> AbstractContextManager[None]:
        """Surround an operation that must not start under a stop, nor end well under one.

        Raises:
            StoppedError: A stop was active at its beginning, or came meanwhile.
        """
        return _Watching(self, self._controller, request)

    def ending(self, request: str) -> AbstractContextManager[None]:
        """Surround what must not end well under a stop.

        Raises:
            StoppedError: A stop is active at its end, be that a success or a "no" of the
                controller, which the stop explains.
        """
        return _Ending(self, self._controller, request)

    @contextmanager
    def calming(self, request: str) -> Iterator[None]:
        """Surround what may start under a stop: a reset, or switching off.

        A stop that comes meanwhile ends it as it ends everything else, and no reset of before is
        sent after it: it would release what this stop holds. Where a person is asked about it
        first, a block around question and reset lets it count from the question.

        Raises:
            StoppedError: A stop came meanwhile.
        """
        permits, closed = self._permits, self.closed
        before = permits.calms
        began = permits.calms = self._closings if before is None else before
        try:
            if closed:
                yield
            else:
                with self.ending(request):
                    yield
            if self._closings != began:
                self.require_open(request)
        finally:
            permits.calms = before

    @contextmanager
    def restoring(self) -> Iterator[None]:
        """Let this thread select a tool and set power and speed although a stop is active."""
        before = self.restores
        self._permits.restoring = True
        try:
            yield
        finally:
            self._permits.restoring = before

    @contextmanager
    def putting_back(self, tool: int) -> Iterator[None]:
        """Let this thread write the old value of ``tool`` although a stop is active; once.

        Raises:
            StoppedError: That was done since the stop already.
        """
        if self.closed and tool in self._put_back:
            self.admit(CommandClass.ACT, tr("Tool {tool}, put back once more,", tool=tool))
        before = self._permits.writing
        self._permits.writing = True
        try:
            with self.restoring():
                yield
        finally:
            self._permits.writing = before
            if self.closed:
                self._put_back.add(tool)

    def _stopped(self, said: str, request: str = "", *, remedy: str = "") -> StoppedError:
        usual = tr("The robot will not move by itself. When the cell is clear, release the stop.")
        remedy = remedy or usual
        return StoppedError(said, remedy=remedy, controller=self._controller, request=request)


class _Ending(Concerning):
    """See :meth:`StopLatch.ending`. No generator: every movement and every write passes here."""

    __slots__ = ("_latch",)

    def __init__(self, latch: StopLatch, controller: str, request: str) -> None:
        super().__init__(controller, request)
        self._latch = latch

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None or isinstance(error, (ControllerError, UnclearAnswerError)):
            self._latch.require_open(self._request)
        super().__exit__(kind, error, trace)


class _Watching(_Ending):
    """See :meth:`StopLatch.watching`."""

    __slots__ = ()

    def __enter__(self) -> None:
        self._latch.require_open(self._request)


LONGEST_WAIT_S: Final = 86_400.0
"""Longest wait for a turn, in s: a day."""

LOOK_S: Final = 0.1
"""Interval, while waiting, between checks for a stop, for Ctrl-C, and for the end, in s."""

T = TypeVar("T")


def require_wait(wait_s: float) -> float:
    """Return a wait in seconds.

    Raises:
        ConfigError: It is negative, longer than :data:`LONGEST_WAIT_S`, or no number.
    """
    if not 0 <= wait_s <= LONGEST_WAIT_S:
        raise ConfigError(
            tr("A wait of {seconds} s is not possible.", seconds=wait_s),
            remedy=tr(
                "Nothing was sent. Give 0 to {most:g} seconds; 0 means: do not wait.",
                most=LONGEST_WAIT_S,
            ),
        )
    return float(wait_s)


class _Calling:
    """The state of a thread's call for a block. No generator: each call to a driver passes here."""

    __slots__ = ("_before", "_calls", "_state")

    def __init__(self, calls: threading.local, state: dict[str, int | None]) -> None:
        self._calls, self._state = calls, state

    def __enter__(self) -> None:
        call = self._calls.__dict__
        self._before = dict(call)
        call.clear()
        call.update(self._state)

    def __exit__(self, *_: object) -> None:
        call = self._calls.__dict__
        call.clear()
        call.update(self._before)


class Patience:
    """How long a call waits that is refused because another user has the controller locked.

    One call waits that long in all: for another thread of this program, for another program that
    has the lease, for another owner of a PLC's mailbox. Nothing has been sent by then. A stop ends
    the wait with StoppedError, Ctrl-C with KeyboardInterrupt. The time is the computer's, even at a
    simulator whose own time is virtual: it is threads and programs that are waited for.

    Attributes:
        wait_s: For each call that does not say it itself; 0 refuses at once.
        tell: Told, in a sentence, who is waited for.

    Args:
        latch: Whose closing ends the wait.

    Example:
        >>> import robolink
        >>> with robolink.connect("epson+sim://patience-example", wait_s=5) as controller:
        ...     controller.patience.wait_s
        5.0
    """

    def __init__(self, latch: StopLatch) -> None:
        self.tell: Callable[[str], None] = lambda _sentence: None
        self._wait_s = 0.0
        self._latch = latch
        self._calls = threading.local()

    @property
    def wait_s(self) -> float:
        """See above."""
        return self._wait_s

    @wait_s.setter
    def wait_s(self, wait_s: float) -> None:
        self._wait_s = require_wait(wait_s)

    @property
    def waits(self) -> bool:
        """Whether the present call of this thread may wait, or might have."""
        return self._calls.__dict__.get("until_ns") is not None

    @property
    def left_s(self) -> float:
        """How much longer the present call of this thread may wait."""
        until_ns: int | None = self._calls.__dict__.get("until_ns")
        return 0.0 if until_ns is None else max(0, until_ns - runtime.monotonic_ns()) / 1e9

    def within(self, wait_s: float | None = None) -> AbstractContextManager[None]:
        """Surround one call; the calls inside it wait within the same seconds.

        Args:
            wait_s: How long it may wait; ``None`` for what is usual here.

        Raises:
            ConfigError: That is no wait.
        """
        if wait_s is None and "until_ns" in self._calls.__dict__:
            return nullcontext()
        seconds = self._wait_s if wait_s is None else require_wait(wait_s)
        until_ns = runtime.monotonic_ns() + int(seconds * 1e9) if seconds else None
        return _Calling(self._calls, {"until_ns": until_ns})

    def between(self) -> AbstractContextManager[None]:
        """Surround a user's code inside a block: each call there waits by itself."""
        return _Calling(self._calls, {})

    def watch(self, request: str, *, calming: bool = False) -> Callable[[], None]:
        """Start to wait; the returned function raises once a stop, or Ctrl-C, came.

        Args:
            request: What waits.
            calming: Whether that may begin while a stop is active, as a reset may.

        Raises:
            StoppedError: A stop is active.
        """
        if not calming:
            self._latch.require_open(request)
        since = self._latch.closings

        def look() -> None:
            heed_while_waiting()
            self._latch.require_unstopped(since, request)

        return look

    def until_free(self, attempt: Callable[[], T], request: str) -> T:
        """Repeat a call that is refused because another user has the lock, while time is left.

        Args:
            attempt: One attempt, which sends nothing when it is refused.
            request: What it is for.

        Raises:
            LeaseHeldError: The last attempt was refused so.
            StoppedError: A stop came.
        """
        look: Callable[[], None] | None = None
        while True:
            try:
                return attempt()
            except LeaseHeldError as held:
                left_s = self.left_s
                if not left_s:
                    raise
                if look is None:
                    look = self.watch(request)
                    self.tell(waiting_for(held, left_s))
            look()
            runtime.sleep(min(left_s, LOOK_S))
            look()


def waiting_for(refusal: RobolinkError, wait_s: float) -> str:
    """Return the sentence to show while waiting for another user.

    Args:
        refusal: Says who has it.
        wait_s: How long it is waited at most.
    """
    waiting = tr("Waiting for up to {seconds:.0f} s.", seconds=wait_s)
    return joined(" ", (refusal.what, waiting))
