"""An EPSON controller on Remote Ethernet."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Self

from robolink.controllers.epson.condition import ConditionReader
from robolink.controllers.epson.io.alarms import EpsonAlarms
from robolink.controllers.epson.io.bits import EpsonIo
from robolink.controllers.epson.io.pending_values import PendingValues
from robolink.controllers.epson.io.raw_statements import RawStatements
from robolink.controllers.epson.io.values import ValueSetter
from robolink.controllers.epson.io.variables import EpsonVariables
from robolink.controllers.epson.link.identity import FactReader, IdentityReader
from robolink.controllers.epson.link.preferences import Preferences
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.epson.link.stopping import REST_S
from robolink.controllers.epson.link.window import CommandWindow
from robolink.controllers.epson.motion.acts import EpsonActs
from robolink.controllers.epson.motion.group import EpsonGroup
from robolink.controllers.epson.motion.positions import EpsonPoints
from robolink.controllers.epson.tools.preserve import Preserver
from robolink.controllers.epson.tools.published import PublishedReader, PublishedTools
from robolink.controllers.epson.tools.resolve import EpsonResolver
from robolink.controllers.epson.tools.table import EpsonToolTable
from robolink.controllers.markers import MarkerStore, ProcedureLock
from robolink.errors import (
    RobolinkError,
)
from robolink.model import (
    Act,
    Capabilities,
    ControllerFacts,
    ControllerStatus,
    Ledger,
    Marker,
    MarkerKind,
    NewEntry,
    OutcomeLog,
)
from robolink.protocols.epson_text import Preference
from robolink.standing import note_standing
from robolink.stop_latch import StopLatch
from robolink.timing import Clock


class EpsonController:
    """A logged-in EPSON controller. Use it as a context manager.

    Attributes:
        io: Inputs, outputs and memory bits.
        variables: The project's Global Preserve variables.
        alarms: The alarms that stand.

    Args:
        session: A session that has logged in.
        outcomes: Where doubtful outcomes of this controller are kept.
        remote_timeout_s: The remote time-out set on the controller, as a person states it;
            0 (never) forbids motion.
    """

    def __init__(
        self, session: EpsonSession, outcomes: OutcomeLog, *, remote_timeout_s: float
    ) -> None:
        self._session = session
        self._outcomes = outcomes
        self._window = CommandWindow(session)
        outcomes.ask(IdentityReader(session, self._window).read)
        self._lock = ProcedureLock(session.identity, session.latch)
        self._markers = MarkerStore(session.identity, outcomes, session.latch)
        self._preferences = Preferences(session)
        self._group = EpsonGroup(
            session,
            self._window,
            self._markers,
            self._lock,
            preferences=self._preferences,
            remote_timeout_s=remote_timeout_s,
        )
        self._tools = EpsonToolTable(
            self._window, self._markers, self._lock, self._group.robot, self._preferences
        )
        self._preserver = Preserver(
            session,
            self._window,
            self._markers,
            self._lock,
            self._preferences,
            tools=self._tools,
            group=self._group,
        )
        self._acts = EpsonActs(session, self._window, self._lock, self._group)
        setter = ValueSetter(session, self._window, self._markers, self._lock)
        self.io = EpsonIo(session, self._window, setter)
        self.variables = EpsonVariables(session, setter)
        self._raw = RawStatements(session, self._window, self._markers, self._lock)
        self.alarms = EpsonAlarms(session, self._window, self._lock)
        self._resolver = EpsonResolver(
            self._markers,
            tools=self._tools,
            group=self._group,
            preserver=self._preserver,
            values=PendingValues(self.io, self.variables),
        )

    @property
    def identity(self) -> str:
        """The URL without its options; who answers there is ``outcomes.identity``."""
        return self._session.identity

    @property
    def clock(self) -> Clock:
        """The clock on which the controller's time passes."""
        return self._session.clock

    @property
    def capabilities(self) -> Capabilities:
        """Everything that this package can ask for."""
        return Capabilities(tool_write=True, motion=True, motors=True)

    @property
    def tools(self) -> EpsonToolTable:
        """Tools 1 to 15."""
        return self._tools

    @property
    def groups(self) -> Sequence[EpsonGroup]:
        """The one robot that Execute acts on."""
        return (self._group,)

    @property
    def points(self) -> EpsonPoints:
        """The taught points of the robot in force; read only."""
        return EpsonPoints(self._window)

    def published_tools(self) -> PublishedTools | None:
        """Read the tools as the companion program published them; legal while production runs.

        Returns:
            ``None`` where the project publishes none.

        Raises:
            ToolError: The table was being changed, or is of another version.
        """
        return PublishedReader(self.variables).read()

    @property
    def outcomes(self) -> OutcomeLog:
        """Open markers of this controller."""
        return self._outcomes

    @property
    def ledger(self) -> Ledger:
        """What was done here since connecting, and how much of it is proved."""
        return self._markers.ledger

    @property
    def resolver(self) -> EpsonResolver:
        """Settles what was begun and not proved finished."""
        return self._resolver

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""
        return self._session.exchanges

    def status(self) -> ControllerStatus:
        """Read the state flags; others see by it that this process is alive."""
        self._markers.beat()
        return self._window.status()

    def facts(self) -> ControllerFacts:
        """Read which controller and robots these are; legal while production runs."""
        return FactReader(self._session, self._window).read()

    def error_text(self, code: int) -> str:
        """Return the controller's own text for an error number, empty where it has none."""
        return self._window.error_text(code)

    @property
    def latch(self) -> StopLatch:
        """What holds everything back from :meth:`stop` until :meth:`release_stop`."""
        return self._session.latch

    def stop(self) -> None:
        """Bring everything to rest: Abort, Stop, and a status that shows it.

        May be called from any thread, whatever another one is doing. From its first instant on
        no movement, write or program start leaves this process until :meth:`release_stop`;
        whoever is at work gets StoppedError.

        Raises:
            OutcomeUnknownError: Rest was not seen; the message says to use the emergency stop.
            RobolinkError: It was not confirmed; the message says the same.
        """
        self._acts.stop()

    def release_stop(self) -> None:
        """Let this process act again after :meth:`stop`, because a person says so."""
        self._session.latch.release()

    def reset_fault(self) -> None:
        """Send Reset because a person asked for it; it may switch outputs off.

        Raises:
            NotReadyError: A reset cannot help now (serious error, guard open, a program is
                running, no remote control).
            ControllerFaultError: The error or the emergency stop is still there afterwards.
        """
        self._acts.reset()

    def motors(self, on: bool) -> None:
        """Switch the motors of the robot in force, and prove it.

        Raises:
            NotReadyError: The state forbids it.
            ReadBackError: The motors are not as asked.
        """
        self._acts.motors(on)

    def robot_number(self) -> int:
        """Read which robot motors and statements act on."""
        return self._acts.robot_number()

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the requests of an act, as they stand on the wire."""
        return self._acts.preview(act)

    def execute_raw(self, statement: str) -> str:
        """Run a SPEL+ statement as it was typed, and put it on record.

        Only here does text that a person typed reach the controller (design part 6). It has to
        be answered within the time-out, so it is not for movements.

        Args:
            statement: One line of SPEL+ as the command window takes it.

        Returns:
            What it printed, empty for nothing.

        Raises:
            NotAllowedError: The person is an operator.
            ConfigError: It is not one line of printable ASCII.
            NotReadyError: The state forbids it.
            RejectedError: The controller refused it.
            ControllerFaultError: It put the controller in error.
            OutcomeUnknownError: No answer came.
        """
        return self._raw.execute(statement)

    def preferences(self) -> frozenset[Preference] | None:
        """Read the preferences that are on; asked once a connection.

        Returns:
            ``None`` where the firmware does not tell them.
        """
        return self._preferences.read()

    def condition(self) -> dict[str, object]:
        """Read error text, alarms, preferences, the tool in force, motors and power."""
        reader = ConditionReader(
            self._window,
            alarms=self.alarms,
            tools=self._tools,
            group=self._group,
            preferences=self._preferences,
        )
        return reader.read(published=self.published_tools)

    def require_settled(self, request: str) -> None:
        """Refuse ``request`` while something earlier is unsettled.

        Raises:
            OutcomeUnknownError: Names it.
        """
        self._markers.require_settled(request)

    def begin(
        self,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        """Store the durable marker of a procedure; see the model."""
        return self._markers.begin(kind, request, details, operation=operation)

    def finish(self, marker: Marker, *entries: NewEntry) -> None:
        """Forget the marker of a procedure, and journal how it ended."""
        self._markers.clear(marker, *entries)

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Hold Ctrl-C back for a block that must be seen through."""
        return self._session.uninterrupted()

    def preserved(self, reason: str) -> AbstractContextManager[None]:
        """Put back the tool, power and speed in force; see the model."""
        return self._preserver.preserved(reason)

    def close(self) -> None:
        """Abort what nobody waited on, log out where that does no harm, close. Idempotent.

        Logging out while a task runs raises an error on the controller (epson.md 1.1), so
        the connection is just closed then. So it is when another device starts the cell: a
        task could begin between the look and the logout.
        """
        self._session.latch.await_stops(REST_S)
        try:
            if self._session.alive:
                self._group.abort_unfinished()
                status = self.status()
                if status.remote and not (status.running or status.paused):
                    self._session.exchange("Logout")
        except RobolinkError:
            pass  # the link is going away in any case; markers keep what is in doubt
        finally:
            self._session.close()
            self._outcomes.close()

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
            note_standing(error, self.ledger.standing())
