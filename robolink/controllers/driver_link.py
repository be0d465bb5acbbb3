"""What every part of a driver uses, and the one way in which it changes something.

The command classes of docs/reference/rules.md 1:

=====  ==========================================  =======================================
class  on an EPSON controller                      when no answer comes
=====  ==========================================  =======================================
READ   GetStatus, Print ..., TLSet, Where          ask again on a new link
SET    TLSet n, TLClr n, Tool n, SetIO ...         OutcomeUnknownError; read back, recover
MOVE   Go, Move                                    OutcomeUnknownError; never sent again
STOP   Abort, Stop                                 may be repeated
=====  ==========================================  =======================================

Speed, SpeedS, Power and the motors need no marker: they are read before each move,
and a lost answer leaves nothing that the next move would not set again.

Signs of life of an open block: that somebody is at work, although nothing is sent.

A change that is open while a person looks at the parts sends nothing, and who is silent for ten
seconds counts as gone: his lease may be taken (docs/reference/rules.md 6), and a PLC gives its
mailbox away (docs/reference/mailbox.md, "Owners"). So as long as a block is open, both are told
once a second that its program is there. That keeps nothing going: no command, and no heartbeat of a
movement. It ends with the block, with the thread that is in it, and with the process.
"""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cached_property, wraps
from types import FunctionType
from typing import Any, Final, Generic, TypeVar

from robolink import runtime
from robolink.controllers.markers import MarkerStore, ProcedureLock
from robolink.errors import (
    Concerning,
    ConfigError,
    ControllerFaultError,
    RejectedError,
    RobolinkError,
    UnclearAnswerError,
)
from robolink.messages import in_english, joined, tr
from robolink.model import (
    ChangeGuard,
    ControllerStatus,
    EntryKind,
    Marker,
    MarkerKind,
    NewEntry,
    OutcomeLog,
)
from robolink.package_log import PackageLog
from robolink.stop_latch import StopLatch
from robolink.timing import Clock
from robolink.transport.traffic import Traffic

_LOG: Final = PackageLog(__package__)

EVERY_S: Final = 1.0
"""Interval between signs of life, in s: a tenth of the silence after which a user counts as gone.
"""


class SignsOfLife:
    """Shows others that this process is alive while a block is open on a controller.

    Args:
        sign: Gives one, to the record and to the controller. It may fail: what is the matter
            then, the next act of whoever is in the block says.
    """

    def __init__(self, sign: Callable[[], None]) -> None:
        self._sign = sign
        self._lock = threading.Lock()
        self._inside: list[threading.Thread] = []
        self._end: Callable[[], None] = _nothing

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show it within the block; inner blocks add nothing."""
        here = threading.current_thread()
        with self._lock:
            first = not self._inside
            self._inside.append(here)
            if first:
                self._end = runtime.regularly(EVERY_S, self._one, "signs of life")
        try:
            yield
        finally:
            end: Callable[[], None] = _nothing
            with self._lock:
                self._inside.remove(here)
                if not self._inside:
                    end, self._end = self._end, _nothing
            end()

    def _one(self) -> None:
        # A thread that ended without leaving its block no longer counts as working.
        if any(thread.is_alive() for thread in self._inside):
            with suppress(RobolinkError):
                self._sign()


def _nothing() -> None:
    """End nothing."""


T = TypeVar("T")


class MarkedCommand(ABC, Generic[T]):
    """A command that is sent once, marked meanwhile, and confirmed by reading.

    Attributes:
        request: What is sent, as a person may read it.
        acknowledged: Whether the controller has said that it did it.

    Args:
        request: What is sent, as a person may read it.
    """

    def __init__(self, request: str) -> None:
        self.request = request
        self.acknowledged = False

    @property
    @abstractmethod
    def details(self) -> Mapping[str, object]:
        """Plain JSON values needed to recover it later."""

    @abstractmethod
    def send(self) -> None:
        """Send it; raises unless the controller accepted it."""

    @abstractmethod
    def read(self) -> T:
        """Read what it changes."""

    def told_by(self, found: T) -> str:
        """Return what the value read shows about an unclear answer.

        Empty where only a person can tell.
        """
        return ""

    def entries(self, marker: Marker, found: T) -> Iterable[NewEntry]:
        """Return what is recorded together with the end of the marker."""
        return ()

    def refusal(self, marker: Marker, error: RejectedError) -> Iterable[NewEntry]:
        """Return what is recorded when the controller did not do it."""
        tool = marker.details.get("tool")
        yield NewEntry(
            EntryKind.REFUSED,
            operation=marker.operation,
            tool=tool if isinstance(tool, int) else None,
            verdict=error.what,
            details={"request": marker.request, "code": error.code},
        )


class DriverLink:
    """A connected controller, as the parts of its driver see it.

    Attributes:
        identity: Which controller.
        clock: The clock on which its time passes.
        latch: Refuses requests while a stop is active.
        markers: The durable markers of what was begun.
        change_guard: Refuses writes that move a tip farther than the cell allows.
        lock: One procedure at a time.
        stop_anew: Stops it over a link of its own; ``None`` where there is no other.

    Args:
        identity: Which controller.
        clock: The clock on which its time passes.
        latch: Refuses requests while a stop is active.
        outcomes: Where the markers are kept.
        gate: Holds Ctrl-C back inside.

    Example:
        >>> from contextlib import nullcontext
        >>> from robolink.controllers import DriverLink
        >>> from robolink.journal import memory_journal
        >>> from robolink.stop_latch import StopLatch
        >>> from robolink.timing import SystemClock
        >>> url = "acme+tcp://192.168.0.9:7000"
        >>> outcomes = memory_journal(url).log(url)
        >>> link = DriverLink(url, SystemClock(), StopLatch(url), outcomes, gate=nullcontext())
        >>> with link.lock.held("a trial"):
        ...     link.markers.look()
    """

    def __init__(
        self,
        identity: str,
        clock: Clock,
        latch: StopLatch,
        outcomes: OutcomeLog,
        *,
        gate: AbstractContextManager[None],
    ) -> None:
        self.identity = identity
        self.clock = clock
        self.latch = latch
        self.markers = MarkerStore(identity, outcomes, latch, simulated=lambda: self.simulated)
        self.change_guard = ChangeGuard(outcomes, latch)
        self.lock = ProcedureLock(identity, latch, outcomes)
        self.stop_anew: Callable[[], ControllerStatus] | None = None
        self._gate = gate
        self._anew = runtime.lock()
        self._waiting: list[None] = []

    @property
    def session_over(self) -> bool:
        """Whether the link has ended for good, so that nothing more is sent over it."""
        return False

    def stopped_anew(self) -> bool:
        """Stop it over a link of its own, if the session is over and there can be another link.

        Returns:
            Whether it rests now.

        Raises:
            RobolinkError: Whether it stops is not known.
        """
        if not self.session_over or self.stop_anew is None:
            return False
        self.decided("the session is over; stopped over a new link", "Stop")
        with self._anew:  # one after another: a controller may answer one login only
            self.markers.ledger.saw_status(self.stop_anew(), self.clock.now_ns())
        return True

    @property
    def simulated(self) -> bool:
        """Whether the controller has said by now that nothing real moves; asks nothing."""
        return False

    @cached_property
    def signs_of_life(self) -> SignsOfLife:
        """Given while a block is open, to the record and to the controller."""
        return SignsOfLife(self._sign_of_life)

    @contextmanager
    def awaited(self) -> Iterator[None]:
        """Surround the wait for the end of a movement: it is watched meanwhile."""
        self._waiting.append(None)
        try:
            yield
        finally:
            self._waiting.pop()

    @property
    def waited_on(self) -> bool:
        """Whether a thread of this process waits for the end of a movement."""
        return bool(self._waiting)

    def show_life(self) -> None:
        """Show the controller that this process is there, if it supports that; not a command."""

    def _sign_of_life(self) -> None:
        """Give a sign of life, unless a movement was started here that nobody waits on."""
        if self.markers.moving and not self.waited_on:
            return
        self.markers.beat()
        self.show_life()

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Delay Ctrl-C over exchanges that belong together, then raise it."""
        return self._gate

    def was_not_executed(self, refusal: RejectedError) -> bool:
        """Whether a refusal confirms that nothing was done."""
        return True

    def lacks(self, what: str) -> ConfigError:
        """Return the error for something that this kind of controller does not have.

        Args:
            what: The thing, for a person.
        """
        return ConfigError(
            tr("{controller} has no {what}.", controller=self.identity, what=what),
            remedy=tr("This is for other kinds of controllers."),
            controller=self.identity,
        )

    def decided(self, text: str, request: str) -> None:
        """Log a decision about this controller; see ``robolink.package_log``.

        Args:
            text: A sentence.
            request: What it was decided about.
        """
        _LOG.decided(text, controller=self.identity, request=request)

    def asked(self, request: str) -> AbstractContextManager[None]:
        """Let each error that leaves the block name this controller and ``request``."""
        return Concerning(self.identity, request)

    def carry_out(self, command: MarkedCommand[T]) -> T:
        """Send a marked command, and return what is read afterwards.

        Ctrl-C waits for that. A plain refusal settles the marker; a fault does not, because a
        controller in error may refuse to show the value that would prove what happened. After
        an answer that says neither yes nor no, reading settles it.

        Raises:
            UnclearAnswerError: The answer told nothing; the message says what was read.
            OutcomeUnknownError: No answer came.
        """
        markers, ledger = self.markers, self.markers.ledger
        with self.uninterrupted(), ledger.block():
            marker = markers.begin(MarkerKind.SET, command.request, command.details)
            unclear: UnclearAnswerError | None = None
            try:
                with markers.doubt(command.request):
                    try:
                        with markers.unless_stopped(marker):
                            command.send()
                        command.acknowledged = True
                        ledger.answered(marker)
                        self.decided(f"accepted: {in_english(command.request)}", command.request)
                    except (RejectedError, ControllerFaultError) as error:
                        ledger.answered(marker)
                        if isinstance(error, RejectedError) and self.was_not_executed(error):
                            markers.clear(marker, *command.refusal(marker, error))
                        raise
                    except UnclearAnswerError as error:
                        ledger.answered(marker)
                        unclear = error
                    try:
                        found = command.read()
                    except RejectedError as error:  # to show a value undoes no write
                        raise markers.unproved(command.request, error) from error
                ledger.proved(marker, found)
                markers.clear(marker, *command.entries(marker, found))
            finally:
                markers.leave_open(marker)
        if unclear is not None:
            # An answer over such a link is not relied on, so this ends as a failure in any case.
            if shown := command.told_by(found):
                unclear.say_what_stands(shown)
                unclear.remedy = tr("Nothing was repeated. Check the cable, then try again.")
            raise unclear
        return found


def tell_requests(latch: StopLatch, identity: str, clock: Clock) -> None:
    """Report each request that a latch admits to the trace and the log, where no bytes are.

    Args:
        latch: It; a request is told as text.
        identity: Which controller.
        clock: Its.
    """
    traffic = Traffic(identity, clock, log=_LOG)

    def tell(request: str) -> None:
        if traffic.listened():
            said = in_english(request)
            traffic.sent(said.encode("utf-8", "replace"), request=said)

    latch.tell(tell)


class DriverPart:
    """A part of a driver that others call: each error that leaves it names the controller.

    That is seen to here for every public method of every kind, so nothing inside a driver that
    raises an error has to be told which controller it works for.

    Args:
        link: The controller.
    """

    def __init__(self, link: DriverLink) -> None:
        self._driver = link

    def __init_subclass__(cls, **options: object) -> None:
        super().__init_subclass__(**options)
        for name, member in tuple(vars(cls).items()):
            if isinstance(member, FunctionType) and not name.startswith("_"):
                setattr(cls, name, _naming_controller(member))

    def __repr__(self) -> str:
        """Show whose it is."""
        return f"<{type(self).__name__} of {self._driver.identity}>"


def _naming_controller(method: Callable[..., T]) -> Callable[..., T]:
    @wraps(method)
    def named(self: DriverPart, *args: Any, **options: Any) -> T:  # noqa: ANN401 - as the method
        try:
            return method(self, *args, **options)
        except RobolinkError as error:
            error.concern(self._driver.identity)
            raise

    return named


def advise_emergency_stop(error: RobolinkError) -> RobolinkError:
    """Put what a person must do first in front of the error of a stop."""
    first = tr("The stop is not confirmed: press the emergency stop.")
    error.remedy = joined(" ", filter(None, (first, error.remedy)))
    return error
