"""What all kinds of controllers share, whatever they drive.

A kind brings a :class:`~.driver_link.DriverLink`, a tool table, what moves, and how its state is
read. Markers, latch, ledger, recovery, and what happens at the end of a connection are here.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import TracebackType
from typing import TYPE_CHECKING, Final, Self

from robolink.controller_outcome import note_outcome
from robolink.controllers.driver_link import DriverLink, DriverPart, advise_emergency_stop
from robolink.controllers.preserving import Preserver
from robolink.controllers.resolving import MarkerResolver
from robolink.errors import RemoteProtocolError, RobolinkError, TransportError
from robolink.model import (
    Act,
    AlarmList,
    Capabilities,
    ControllerFacts,
    ControllerStatus,
    DigitalIo,
    Marker,
    MarkerKind,
    MotionGroup,
    NewEntry,
    PointReader,
    Resolver,
    ToolTable,
    VariableTable,
)
from robolink.timing import AnswerTimes
from robolink.transport.traffic import present_listeners

if TYPE_CHECKING:  # pyright does not accept a cached_property as a property of Controller
    from builtins import property as cached_property
else:
    from functools import cached_property


_STOPS_S: Final = 5.0
"""Longest wait, when closing, for stops under way in other threads, in s."""


class ControllerCore(DriverPart, ABC):
    """Implements :class:`robolink.model.Controller`; each kind of controller adds its own part.

    Attributes:
        identity: How it is reached: the URL, with those options only that tell far ends apart.
        clock: The clock on which its time passes.
        latch: What holds everything back from :meth:`stop` until :meth:`release_stop`.
        change_guard: Refuses writes that move a tip farther than the cell allows.
        patience: How long a call waits that would be refused because somebody else is at work.
        outcomes: The doubtful outcomes and the unfinished procedures of this controller.
        ledger: What was done to it since connecting, and how much of that is confirmed.
        capabilities: What can be asked for.
        tools: The tool offsets.
        groups: What moves.

    Args:
        link: The controller, connected.
        capabilities: What can be asked for.
        tools: The tool offsets.

    Example:
        >>> from robolink.controllers import ControllerCore
        >>> from robolink.journal import memory_journal
        >>> from robolink.model import Capabilities, ControllerStatus
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> from robolink.controllers.simple_controller import SimpleLink
        >>> from robolink.timing import SystemClock
        >>> class Acme(ControllerCore):  # with the tools of another, for the example
        ...     groups, exchanges = (), 0
        ...     def _read_status(self):
        ...         return ControllerStatus(remote=True, ready=True)
        ...     def _close_link(self): ...
        >>> url, able = "acme+usb://core-example", Capabilities(tool_write=True)
        >>> link = SimpleLink(SimpleMachine(), url, memory_journal(url).log(url), SystemClock())
        >>> with Acme(link, capabilities=able, tools=SimpleController().tools) as controller:
        ...     controller.status().ready, controller.capabilities.motion
        (True, False)
    """

    tools: ToolTable
    groups: Sequence[MotionGroup] = ()
    _closed = False

    def __init__(
        self,
        link: DriverLink,
        *,
        capabilities: Capabilities,
        tools: ToolTable,
    ) -> None:
        super().__init__(link)
        self._listeners = present_listeners()
        self.identity = link.identity
        self.clock = link.clock
        self.latch = link.latch
        self.change_guard = link.change_guard
        self.patience = link.lock.patience
        self.outcomes = link.markers.outcomes
        self.ledger = link.markers.ledger
        self.capabilities = capabilities
        self.tools = tools

    def __repr__(self) -> str:
        """Show which controller, and its state as last read; asks nothing."""
        seen = self.ledger.seen
        if self._closed:
            state = "closed"
        elif self.latch.closed:
            state = "held by a stop"
        elif seen is None:
            state = "state not read"
        else:
            state = f"{seen[0].state.value} when read last"
        return f"<{type(self).__name__} {self.identity}: {state}>"

    # What each kind must provide.

    @property
    @abstractmethod
    def exchanges(self) -> int:
        """Requests sent so far."""

    @abstractmethod
    def _read_status(self) -> ControllerStatus:
        """Read the state flags."""

    @abstractmethod
    def _close_link(self) -> None:
        """Close the link. Idempotent."""

    def _take_leave(self) -> None:
        """Do what is proper before the link is closed; errors are ignored."""

    # What a kind may have; created only when a command needs it.

    @property
    def traffic_bytes(self) -> int | None:
        """Bytes sent and received so far; see :class:`robolink.model.Controller`."""
        return self._listeners.count if self._listeners and self._listeners.links else None

    @property
    def answers(self) -> AnswerTimes | None:
        """How long it takes to answer; not measured here."""
        return None

    @property
    def io(self) -> DigitalIo | None:
        """Inputs and outputs."""
        return None

    @property
    def points(self) -> PointReader | None:
        """Points that a person taught."""
        return None

    @property
    def variables(self) -> VariableTable | None:
        """Variables of the machine's program."""
        return None

    @property
    def alarms(self) -> AlarmList | None:
        """Alarms beside the error state."""
        return None

    @cached_property
    def resolver(self) -> Resolver:
        """Finishes or undoes interrupted jobs."""
        return MarkerResolver(self._driver, self.tools, self._preserver)

    @cached_property
    def _preserver(self) -> Preserver:
        """Restores what procedures change."""
        return Preserver(self._driver, self.tools, self.groups)

    def condition(self) -> Mapping[str, object]:
        """Read more about the state than the flags show, plain JSON."""
        return {}

    def facts(self) -> ControllerFacts:
        """Read which controller and robots these are."""
        return ControllerFacts()

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the requests of an action, as sent on the wire. Reads at most."""
        raise self._driver.lacks(str(act))

    def reset_fault(self) -> None:
        """Clear an error because a person asked for it."""
        raise self._driver.lacks(str(Act.RESET))

    def motors(self, on: bool) -> None:
        """Switch the motors on or off."""
        raise self._driver.lacks(str(Act.MOTORS_ON if on else Act.MOTORS_OFF))

    # What is the same for all kinds.

    def status(self) -> ControllerStatus:
        """Read the state flags; others see by this that the process is alive."""
        self._driver.markers.beat()
        status = self._read_status()
        self.ledger.saw_status(status, self.clock.now_ns())
        return status

    def stop(self) -> None:
        """Stop everything; from any thread, at any time, more than once.

        From its first instant on no movement, jog, write or program start leaves this process until
        :meth:`release_stop`; whoever is at work gets StoppedError. Where an answer was lost, and
        the session with it, the stop goes out over a new link.

        Raises:
            OutcomeUnknownError: Rest was not seen; the message says to use the emergency stop.
            RobolinkError: It was not confirmed; the message says the same.
        """
        with self.latch.stopping():
            try:
                self._bring_to_rest()
            except RobolinkError as error:
                advise_emergency_stop(error)
                raise
        self._driver.decided("stop acknowledged: it rests", str(Act.STOP))

    def _bring_to_rest(self) -> None:
        """Stop all groups: over a new link where an answer was lost that the session needed."""
        if not self.groups:
            raise self._driver.lacks(str(Act.STOP))
        try:
            for group in self.groups:
                group.stop()
        except (TransportError, RemoteProtocolError):
            if self._closed or not self._driver.stopped_anew():
                raise

    def stops_anew(self, stop: Callable[[], ControllerStatus]) -> None:
        """Let a stop whose session is over go out over a new link.

        Args:
            stop: Stops the controller over a link of its own.
        """
        self._driver.stop_anew = stop

    def release_stop(self) -> None:
        """Release a stop at a person's request: this process may act again."""
        self.latch.release()

    def take_over(self, reason: str) -> None:
        """Take the controller over from the user who has it locked; see the model."""
        self.outcomes.take_over(reason)

    def require_settled(self, request: str) -> None:
        """Refuse ``request`` while an earlier job is unfinished.

        Raises:
            OutcomeUnknownError: Names it.
        """
        with self._driver.asked(request):
            self._driver.markers.require_settled(request)

    def begin(
        self,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        """Store the durable marker of a procedure; see the model."""
        with self._driver.asked(request):
            return self._driver.markers.begin(kind, request, details, operation=operation)

    def finish(self, marker: Marker, *entries: NewEntry) -> None:
        """Remove the marker of a procedure, and record how it ended."""
        self._driver.markers.clear(marker, *entries)

    @contextmanager
    def procedure(self, request: str, *, wait_s: float | None = None) -> Iterator[None]:
        """Let only this thread change something in the block; see the model."""
        with (
            self._driver.lock.procedure(request, wait_s=wait_s) as leased,
            self._driver.signs_of_life.shown() if leased else nullcontext(),
        ):
            yield

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Delay Ctrl-C for a block that must be completed."""
        return self._driver.uninterrupted()

    def signs_of_life(self) -> AbstractContextManager[None]:
        """Show others within the block that this process is at work; see the model."""
        return self._driver.signs_of_life.shown()

    def preserved(self, reason: str) -> AbstractContextManager[None]:
        """Restore, at the end of the block, the tool and what goes with it; see the model."""
        return self._preserver.preserved(reason)

    def close(self) -> None:
        """End what nobody waited on, leave in order, close. Idempotent."""
        self.latch.await_stops(_STOPS_S)
        try:
            if not self.latch.severed:
                self._take_leave()
        except RobolinkError:
            pass  # the link is closing in any case; markers keep what is in doubt
        except BaseException as error:
            # Ctrl-C while closing: the work is done, and its outcome must be reported.
            note_outcome(error, self.ledger.outcome())
            raise
        finally:
            self._closed = True
            self._close_link()
            self.outcomes.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
        if error is not None:
            note_outcome(error, self.ledger.outcome())
