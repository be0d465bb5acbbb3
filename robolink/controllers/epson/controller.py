"""An EPSON controller on Remote Ethernet, and logging in to one."""

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from robolink.controllers.controller_core import ControllerCore
from robolink.controllers.epson.answers import NOT_EXECUTED, may_log_out, require_ready
from robolink.controllers.epson.condition import ConditionReader, EpsonAlarms
from robolink.controllers.epson.group import EpsonGroup
from robolink.controllers.epson.line import EpsonLine, open_line
from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.preserve import EpsonPreserver, EpsonResolver, PendingValues
from robolink.controllers.epson.rest import stop_over_new_link
from robolink.controllers.epson.session import (
    EpsonSession,
    alone,
    as_sent,
    command_class_of,
    execution,
    log_in,
)
from robolink.controllers.epson.singularities import EpsonPoints
from robolink.controllers.epson.tools import EpsonToolTable, PublishedTools, read_published
from robolink.controllers.epson.values import EpsonIo, EpsonVariables
from robolink.controllers.epson.vision_looks import EpsonLooks
from robolink.controllers.registry import ConnectionTerms
from robolink.controllers.stop_attempts import anew
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    NotReadyError,
    NotReadyReason,
    ReadBackError,
    RejectedError,
)
from robolink.messages import tr
from robolink.model import (
    Act,
    Capabilities,
    Controller,
    ControllerFacts,
    ControllerStatus,
    EntryKind,
    Marker,
    MarkerKind,
    MotionProfile,
    NewEntry,
    OutcomeLog,
    Secret,
    Spot,
    require_engineer,
)
from robolink.protocols import spel
from robolink.protocols.epson_text import Preference, Refusal, Reply, Request
from robolink.protocols.spel import Statement
from robolink.stop_latch import CommandClass
from robolink.timing import AnswerTimes
from robolink.transport import LinkUrl

if TYPE_CHECKING:  # pyright does not accept a cached_property as a property of Controller
    from builtins import property as cached_property
else:
    from functools import cached_property


class EpsonController(ControllerCore):
    """A logged-in EPSON controller. Use it as a context manager.

    Attributes:
        tools: Tools 1 to 15.
        groups: The one robot that Execute acts on.

    Args:
        session: A session that has logged in.
        outcomes: Where doubtful outcomes of this controller are kept.
        remote_timeout_s: The remote time-out set on the controller, as a person states it;
            0 (never) forbids motion.
        acceleration_mm_s2: Highest acceleration of straight movements, as the cell states it;
            ``None`` leaves AccelS alone.

    Example:
        >>> from robolink.controllers import EpsonController
        >>> from robolink.controllers.epson.line import open_line
        >>> from robolink.controllers.epson.session import log_in
        >>> from robolink.journal import memory_journal
        >>> line = open_line("epson+sim://session-example", timeout_s=1)
        >>> session = log_in(line, None, timeout_s=1)
        >>> outcomes = memory_journal("session-example").log("session-example")
        >>> with EpsonController(session, outcomes, remote_timeout_s=60) as controller:
        ...     controller.status().ready
        True
    """

    OF_KIND: ClassVar = Capabilities(
        tool_write=True,
        motion=True,
        motors=True,
        low_power=True,
        acceleration=True,
        looks=True,
        io=True,
        points=True,
        variables=True,
        alarms=True,
    )
    tools: EpsonToolTable
    groups: tuple[EpsonGroup]

    def __init__(
        self,
        session: EpsonSession,
        outcomes: OutcomeLog,
        *,
        remote_timeout_s: float,
        acceleration_mm_s2: int | None = None,
    ) -> None:
        link = self._link = EpsonLink(session, outcomes)
        group = EpsonGroup(
            link, remote_timeout_s=remote_timeout_s, acceleration_mm_s2=acceleration_mm_s2
        )
        self.groups = (group,)
        super().__init__(link, capabilities=self.OF_KIND, tools=EpsonToolTable(link))

    @cached_property
    def io(self) -> EpsonIo:
        """Inputs, outputs and memory bits."""
        return EpsonIo(self._link)

    @cached_property
    def points(self) -> EpsonPoints:
        """The taught points of the current robot; read only."""
        return EpsonPoints(self._link.window)

    @cached_property
    def variables(self) -> EpsonVariables:
        """The project's Global Preserve variables."""
        return EpsonVariables(self._link)

    @cached_property
    def alarms(self) -> EpsonAlarms:
        """The active alarms."""
        return EpsonAlarms(self._link)

    @cached_property
    def resolver(self) -> EpsonResolver:
        """Finishes or undoes interrupted jobs."""
        values = PendingValues(self.io, self.variables)
        group = self.groups[0]
        return EpsonResolver(self._link, self.tools, self._preserver, group=group, values=values)

    @cached_property
    def _preserver(self) -> EpsonPreserver:
        return EpsonPreserver(self._link, self.tools, self.groups[0])

    @cached_property
    def _looks(self) -> EpsonLooks:
        return EpsonLooks(self._link, self.variables)

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""
        return self._link.session.exchanges

    @property
    def answers(self) -> AnswerTimes:
        """How long it takes to answer."""
        return self._link.session.answers

    def published_tools(self) -> PublishedTools | None:
        """Read the tools as the companion program published them; allowed while production runs.

        Returns:
            ``None`` where the project publishes none.

        Raises:
            ToolError: The table was being changed, or is of another version.
        """
        return read_published(self.variables)

    def require_looks(self) -> None:
        """Check that the project publishes looks of its vision system; reads only.

        Raises:
            ConfigError: It does not hold robolink_vision.prg.
        """
        self._looks.require_program()

    def look(self, mark: int, *, program: int) -> tuple[Spot, ...]:
        """Run the vision program and return what it saw, X and Y of the base in mm.

        Args:
            mark: The tip (0), or the number of a fiducial.
            program: Number of the function that is started: 7 for main7.

        Raises:
            NotReadyError: The state forbids it.
            ControllerFaultError: The look ended with an error.
            RejectedError: The controller refused; nothing was started.
            OutcomeUnknownError: No answer came, or the program did not end; motion is blocked
                until a person has looked.
        """
        return self._looks.look(mark, program=program)

    def facts(self) -> ControllerFacts:
        """Read which controller and robots these are; allowed while production runs."""
        return self._link.facts.read()

    def error_text(self, code: int) -> str:
        """Return the controller's own text for an error number, empty where it has none."""
        return self._link.window.error_text(code)

    def reset_fault(self) -> None:
        """Send Reset at a person's request; it may switch outputs off.

        Raises:
            NotReadyError: A reset cannot help now (serious error, guard open, a program is
                running, no remote control).
            ControllerFaultError: The error or the emergency stop is still there afterwards.
        """
        link, window = self._link, self._link.window
        with link.lock.held("Reset", calming=True), link.latch.restoring():
            self._require_resettable(window.status())
            link.session.exchange("Reset")
            status = window.status()
            if status.emergency_stop:
                raise ControllerFaultError(
                    tr("The emergency stop is still pressed after the reset."),
                    code=status.code,
                    remedy=tr("Release the button, then reset again."),
                )
            if status.fault or status.serious_fault:
                raise ControllerFaultError(
                    tr("The reset did not clear error {code:04d}.", code=status.code),
                    code=status.code,
                    remedy=tr("Remove the cause; a serious error needs the power switched off."),
                )
            if status.remote and status.ready:
                self.groups[0].settings.slow_down(MotionProfile())

    def motors(self, on: bool) -> None:
        """Switch the motors of the current robot, and confirm it.

        Raises:
            NotReadyError: The state forbids it.
            ReadBackError: The motors are not as asked.
        """
        name, group = "SetMotorsOn" if on else "SetMotorsOff", self.groups[0]
        with self._link.lock.held(name, calming=not on, leased=False):
            self._link.window.require_ready(name)
            self._link.session.exchange(name, str(self.robot_number()))
            found = group.settings.slow_down(MotionProfile()).motors_on if on else group.motors_on()
            if found is not on:
                raise ReadBackError(
                    tr("The motors are not on.") if on else tr("The motors are not off."),
                    remedy=tr("Nothing was repeated. Check the controller."),
                )

    def robot_number(self) -> int:
        """Read which robot motors and statements act on."""
        (number,) = self._link.session.exchange("GetCurRobot").fields
        return spel.parse_integer(number)

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the requests of an action, as sent on the wire."""
        if act is Act.STOP:
            return tuple(as_sent(Request(request)) for request in ("Abort", "Stop"))
        if act is Act.RESET:
            return (as_sent(Request("Reset")),)
        name = "SetMotorsOn" if act is Act.MOTORS_ON else "SetMotorsOff"
        return (as_sent(Request(name, (str(self.robot_number()),))),)

    def execute_raw(self, statement: str) -> str:
        """Run a SPEL+ statement as typed, and record it.

        Only here does text that a person typed reach the controller, past the typed builders
        (docs/reference/rules.md 8): marked before, and on record after. It
        has to be answered within the time-out, so it is not for movements.

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
        request, link, markers = _typed_statement(statement), self._link, self._link.markers
        with link.lock.held(request):
            # Checked before an engineer's consent is recorded.
            markers.require_settled(request)
            link.window.require_ready(request)
            if command_class_of(execution(request)) is CommandClass.ACT:
                link.window.require_abort()
            require_engineer(markers.outcomes, tr("run {statement!r} as typed", statement=request))
            with link.uninterrupted(), markers.ledger.block():
                marker = markers.begin(MarkerKind.SET, request, {"raw": True})
                link.forget_robot()
                with markers.doubt(request):
                    with markers.unless_stopped(marker):
                        answer = link.session.ask(execution(request))
                    self._require_run(request, answer, marker)
                markers.ledger.proved(marker, None)
                printed = answer.text or "" if isinstance(answer, Reply) else ""
                markers.clear(marker, _raw_entry(marker, verdict=tr("carried out"), said=printed))
        return printed

    def preferences(self) -> frozenset[Preference] | None:
        """Read the active preferences; asked once a connection.

        Returns:
            ``None`` where the firmware does not tell them.
        """
        return self._link.preferences.read()

    def condition(self) -> dict[str, object]:
        """Read error text, alarms, preferences, the selected tool, motors and power."""
        reader = ConditionReader(self._link, self.alarms, self.tools, self.groups[0])
        return reader.read(published=self.published_tools)

    def _require_resettable(self, status: ControllerStatus) -> None:
        # The emergency-stop flag stays on after the release until the reset
        # (docs/reference/epson.md 1.7), so it must not prevent the reset.
        if status.serious_fault or status.running or not status.remote:
            require_ready(status, controller=self._link.identity, request="Reset")
        if status.guard_open:
            raise NotReadyError(
                tr("The safety guard is open."),
                reason=NotReadyReason.GUARD_OPEN,
                remedy=tr("Close it before the reset."),
            )

    def _require_run(self, statement: Statement, answer: Reply | Refusal, marker: Marker) -> None:
        """Raise unless it ran; a plain refusal closes the marker."""
        if isinstance(answer, Reply) and (answer.text is not None or answer.fields == ("0",)):
            return
        try:
            raise self._link.window.failure(statement, answer)
        except (RejectedError, ControllerFaultError) as error:
            if error.code in NOT_EXECUTED and isinstance(error, RejectedError):
                self._link.markers.clear(marker, _raw_entry(marker, verdict=error.what))
            raise

    def _read_status(self) -> ControllerStatus:
        return self._link.window.status()

    def _take_leave(self) -> None:
        """Abort what nobody waited on, and log out if that is harmless."""
        if self._link.session.alive:
            self.groups[0].abort_unfinished()
            if may_log_out(self.status()):
                self._link.session.exchange("Logout")

    def _close_link(self) -> None:
        self._link.session.close()


def open_epson_url(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
    """Connect to the controller at a URL; see :class:`~robolink.controllers.ControllerOpener`.

    Raises:
        LeaseHeldError: Nobody answers the login, and somebody else has the controller.
        RobolinkError: As :func:`open_epson`, and as the transport.
    """
    return alone(url, terms, lambda told: _opened(url, terms, told))


def _opened(url: LinkUrl, terms: ConnectionTerms, told: Callable[[OutcomeLog], None]) -> Controller:
    line = open_line(url, timeout_s=terms.timeout_s, clock=terms.clock)
    outcomes = terms.record_of(line.transport)
    told(outcomes)
    controller = open_epson(
        line,
        outcomes=outcomes,
        password=terms.password,
        timeout_s=terms.timeout_s,
        remote_timeout_s=terms.remote_timeout_s,
        acceleration_mm_s2=terms.acceleration_mm_s2,
    )
    controller.stops_anew(anew(stop_over_new_link, url, terms))
    return controller


def open_epson(
    line: EpsonLine,
    *,
    outcomes: OutcomeLog,
    password: Secret | None = None,
    timeout_s: float = 3.0,
    remote_timeout_s: float = 60.0,
    acceleration_mm_s2: int | None = None,
) -> EpsonController:
    """Log in and return the controller; the line is closed when that fails.

    Args:
        line: The line to the controller; it is closed with the controller.
        outcomes: Where doubtful outcomes of this controller are kept.
        password: Its remote password, ``None`` for none.
        timeout_s: Longest wait for one answer, seconds.
        remote_timeout_s: The remote time-out set on the controller, as a person states it, seconds;
            0 (never) forbids motion.
        acceleration_mm_s2: Highest acceleration of straight movements, as the cell states it;
            ``None`` leaves AccelS alone.

    Raises:
        LoginRefusedError: Wrong or missing password. One attempt is made.
        LoginUnansweredError: Nobody answers; another client may be logged in.

    Example:
        >>> from robolink.controllers import open_epson
        >>> from robolink.controllers.epson.line import open_line
        >>> from robolink.journal import memory_journal
        >>> line = open_line("epson+sim://login-example", timeout_s=1)
        >>> outcomes = memory_journal("login-example").log("login-example")
        >>> with open_epson(line, outcomes=outcomes) as controller:
        ...     controller.tools.indices()[-1]
        15
    """
    session = log_in(line, password, timeout_s=timeout_s)
    return EpsonController(
        session,
        outcomes,
        remote_timeout_s=remote_timeout_s,
        acceleration_mm_s2=acceleration_mm_s2,
    )


def _typed_statement(text: str) -> Statement:
    stripped = text.strip()
    if not stripped or not (stripped.isascii() and stripped.isprintable()):
        raise ConfigError(
            tr("robolink cannot send {text!r} as a statement.", text=text),
            remedy=tr("Write one line of printable ASCII."),
        )
    return Statement(stripped)


def _raw_entry(marker: Marker, *, verdict: str, said: str = "") -> NewEntry:
    return NewEntry(
        EntryKind.RAW,
        operation=marker.operation,
        verdict=verdict,
        details={"request": marker.request, "printed": said},
    )
