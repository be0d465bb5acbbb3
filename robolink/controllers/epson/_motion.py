"""The robot arm of an EPSON controller: one pending Execute, watched by GetStatus."""

from robolink.controllers.epson._guarded import MarkerDesk, ProcedureLock
from robolink.controllers.epson._robot import RobotFacts
from robolink.controllers.epson._session import EpsonSession, PendingExecute
from robolink.controllers.epson._settings import Settings
from robolink.controllers.epson._window import CommandWindow
from robolink.errors import (
    ControllerFaultError,
    MotionTimeoutError,
    NotReadyError,
    NotReadyReason,
    RejectedError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.model import (
    Marker,
    MarkerKind,
    MotionOutcome,
    MotionProfile,
    Path,
    Pose,
    WorkBox,
)
from robolink.protocols import spel
from robolink.timing import Deadline

POLL_S = 0.1
"""How often the status is read while the robot moves."""


class EpsonMotion:
    """A movement under way. Wait on it."""

    def __init__(
        self,
        target: Pose,
        pending: PendingExecute,
        marker: Marker,
        *,
        parts: "_Parts",
    ) -> None:
        self._target = target
        self._pending = pending
        self._marker = marker
        self._parts = parts

    @property
    def target(self) -> Pose:
        """Where it goes."""
        return self._target

    @property
    def settled(self) -> bool:
        """Whether its end was seen and taken."""
        return self._parts.session.pending is not self._pending

    def wait(self, *, timeout_s: float) -> MotionOutcome:
        """Wait for the end; see :class:`robolink.model.Motion`."""
        try:
            with self._parts.desk.doubt(self._pending.statement):
                arrived = self._watch(Deadline.after(self._parts.session.clock, timeout_s))
        except KeyboardInterrupt:
            self.abort()
            raise
        if not arrived:
            self.abort()
            raise MotionTimeoutError(
                tr(
                    "{statement!r} did not end within {timeout_s:.0f} s and was aborted.",
                    statement=self._pending.statement,
                    timeout_s=timeout_s,
                ),
                remedy=tr("Read where the robot is ('robolink where') before you go on."),
                controller=self._parts.session.identity,
                request=self._pending.statement,
            )
        return self._settle()

    def abort(self) -> None:
        """Send Abort once and await the end of the movement.

        Raises:
            OutcomeUnknownError: No end was seen; the marker stays.
        """
        session = self._parts.session
        with self._parts.desk.doubt(self._pending.statement):
            if self._pending.answer is None:
                request_abort(session)
                self._end_within(session.timeout_s)
        self._take_answer()

    def _watch(self, deadline: Deadline) -> bool:
        """Poll until the statement answers; False when the deadline passes first."""
        session = self._parts.session
        while self._pending.answer is None:
            if deadline.expired:
                return False
            status = self._parts.window.status()
            if status.emergency_stop or status.guard_open or status.fault:
                # The controller ends the statement by itself; its answer must follow soon.
                self._end_within(session.timeout_s)
                break
            session.await_pending(wait_s=min(POLL_S, deadline.remaining_s()))
        return True

    def _end_within(self, timeout_s: float) -> None:
        session = self._parts.session
        deadline = Deadline.after(session.clock, timeout_s)
        while self._pending.answer is None:
            if deadline.expired:
                session.close()
                raise TransportTimeoutError(
                    tr("The controller did not announce the end of the statement."),
                    controller=session.identity,
                    request=self._pending.statement,
                )
            session.await_pending(wait_s=min(POLL_S, deadline.remaining_s()))

    def _take_answer(self) -> None:
        self._parts.session.finish(self._pending)
        self._parts.desk.clear(self._marker)

    def _settle(self) -> MotionOutcome:
        answer, statement = self._pending.answer, self._pending.statement
        assert answer is not None  # noqa: S101 - _watch returned True
        self._take_answer()
        window = self._parts.window
        try:
            window.check(statement, answer)
        except (RejectedError, ControllerFaultError) as error:
            if self._pending.abort_requested and isinstance(error, RejectedError):
                return MotionOutcome.STOPPED
            raise
        return MotionOutcome.STOPPED if self._pending.abort_requested else MotionOutcome.ARRIVED


class _Parts:
    """What a motion needs of its controller."""

    def __init__(self, session: EpsonSession, window: CommandWindow, desk: MarkerDesk) -> None:
        self.session = session
        self.window = window
        self.desk = desk


class EpsonGroup:
    """The robot that the controller's Execute acts on."""

    def __init__(
        self,
        session: EpsonSession,
        window: CommandWindow,
        desk: MarkerDesk,
        lock: ProcedureLock,
        *,
        remote_timeout_s: float,
    ) -> None:
        self._parts = _Parts(session, window, desk)
        self._lock = lock
        self._robot = RobotFacts(window)
        self._settings = Settings(window, identity=session.identity)
        self._remote_timeout_s = remote_timeout_s
        self._current: EpsonMotion | None = None

    @property
    def name(self) -> str:
        """``robot``: the one in force on the controller."""
        return "robot"

    @property
    def settings(self) -> Settings:
        """Power and speed of this robot."""
        return self._settings

    @property
    def robot(self) -> RobotFacts:
        """Number and type of this robot."""
        return self._robot

    def pose(self) -> Pose:
        """Read the measured position of the tool in force (RealPos)."""
        window = self._parts.window
        window.require_ready("Print RealPos")
        tool = spel.parse_integer(window.printed(spel.print_selected_tool()))
        point = spel.parse_point(window.printed(spel.print_real_position()))
        x_mm, y_mm, z_mm, u_deg, *rest = point.coordinates
        v_deg, w_deg = rest or (0.0, 0.0)
        return Pose(
            x_mm, y_mm, z_mm, u_deg, v_deg, w_deg, hand=point.hand, local=point.local, tool=tool
        )

    def motors_on(self) -> bool:
        """Read whether the motors are on."""
        return spel.parse_integer(self._parts.window.printed(spel.print_motor())) != 0

    def joints(self) -> spel.PrintedWhere:
        """Read the commanded position in all three notations (Where)."""
        self._parts.window.require_ready("Where")
        return spel.parse_where(self._parts.window.printed(spel.where()))

    def move_to(self, target: Pose, profile: MotionProfile, *, box: WorkBox) -> EpsonMotion:
        """Start one movement; see :class:`robolink.model.MotionGroup`."""
        box.check(target)
        session, window, desk = self._parts.session, self._parts.window, self._parts.desk
        statement = self._statement_for(target, profile)
        with self._lock.held(statement):
            desk.require_settled(statement)
            self._require_supervision(statement)
            window.require_ready(statement)
            self._require_motors(statement)
            self._require_tool(target, statement)
            self._settings.slow_down(profile)
            marker = desk.begin(MarkerKind.MOVE, statement, {"target": list(target.coordinates())})
            with desk.doubt(statement):
                pending = session.start_execute(statement)
            self._current = EpsonMotion(target, pending, marker, parts=self._parts)
            return self._current

    def statements_for(self, target: Pose, profile: MotionProfile) -> tuple[spel.Statement, ...]:
        """Return what :meth:`move_to` would send besides its reads."""
        return (*self._settings.statements(profile), self._statement_for(target, profile))

    def stop(self) -> None:
        """Abort the movement of this session, or stop the controller's tasks."""
        request_abort(self._parts.session)

    def abort_unfinished(self) -> None:
        """Abort the last movement if nobody has seen its end."""
        if self._current is not None and not self._current.settled:
            self._current.abort()

    def _statement_for(self, target: Pose, profile: MotionProfile) -> spel.Statement:
        build = spel.move if profile.path is Path.STRAIGHT else spel.go
        return build(target, six_axes=self._robot.read().six_axes)

    def _require_supervision(self, statement: str) -> None:
        # With a remote time-out of 0 the robot may keep moving when this PC is gone
        # (epson.md 1.1). The value cannot be read over the wire; a person states it.
        if self._remote_timeout_s <= 0:
            raise NotReadyError(
                tr("The remote time-out of this controller is stated as 0 (never)."),
                reason=NotReadyReason.NO_REMOTE_TIMEOUT,
                remedy=tr(
                    "Set a time-out on the controller's Remote Ethernet page and state it with "
                    "--remote-timeout; without it a lost link leaves a moving robot unwatched."
                ),
                controller=self._parts.session.identity,
                request=statement,
            )

    def _require_motors(self, statement: str) -> None:
        if not self.motors_on():
            raise NotReadyError(
                tr("The motors are off."),
                reason=NotReadyReason.MOTORS_OFF,
                remedy=tr("Run 'robolink motors on' when the cell is clear."),
                controller=self._parts.session.identity,
                request=statement,
            )

    def _require_tool(self, target: Pose, statement: str) -> None:
        window = self._parts.window
        found = spel.parse_integer(window.printed(spel.print_selected_tool()))
        if target.tool is None or found != target.tool:
            raise NotReadyError(
                tr(
                    "The target is meant for tool {meant}, but tool {found} is in force.",
                    meant=target.tool,
                    found=found,
                ),
                reason=NotReadyReason.WRONG_TOOL,
                remedy=tr("Nothing was moved. Select the right tool first."),
                controller=self._parts.session.identity,
                request=statement,
            )


def request_abort(session: EpsonSession) -> None:
    """Stop: Abort our own running statement, or Stop the controller's tasks.

    Abort ends what Execute runs; Stop ends tasks (epson.md 1.2). Both may be repeated.
    """
    pending = session.pending
    if pending is not None and pending.answer is None:
        pending.abort_requested = True
        session.exchange("Abort")
    else:
        session.exchange("Stop")
