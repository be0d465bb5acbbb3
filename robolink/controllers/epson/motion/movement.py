"""A movement under way: one pending Execute, watched by GetStatus, ended by Abort."""

from contextlib import suppress

from robolink.controllers.epson.link.link import EpsonLink
from robolink.controllers.epson.link.session import PendingExecute
from robolink.controllers.motion_group import not_ended_in_time
from robolink.errors import (
    ControllerFaultError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
    TransportTimeoutError,
    UnclearAnswerError,
)
from robolink.messages import tr
from robolink.model import Marker, MotionOutcome, Pose
from robolink.protocols.epson_text import ErrorCode, Refusal
from robolink.timing import Deadline

POLL_S = 0.1
"""How often the status is read while the robot moves."""


class EpsonMotion:
    """A movement under way. Wait on it.

    Attributes:
        target: Where it goes.
        statement: What was sent.
    """

    def __init__(
        self,
        target: Pose,
        pending: PendingExecute,
        marker: Marker,
        *,
        link: EpsonLink,
    ) -> None:
        self.target = target
        self.statement = pending.statement
        self._pending = pending
        self._marker = marker
        self._link = link

    @property
    def settled(self) -> bool:
        """Whether its end was seen and taken."""
        return self._link.session.pending is not self._pending

    def wait(self, *, timeout_s: float) -> MotionOutcome:
        """Wait for the end; see :class:`robolink.model.Motion`.

        Raises:
            StoppedError: A stop came, whatever the movement did.
        """
        with self._link.latch.ending(self.statement), self._link.awaited():
            return self._awaited(timeout_s)

    def _awaited(self, timeout_s: float) -> MotionOutcome:
        try:
            with self._link.markers.doubt(self.statement):
                arrived = self._watch(Deadline.after(self._link.clock, timeout_s))
        except KeyboardInterrupt:
            self.abort()
            raise
        if not arrived:
            self.abort()
            raise not_ended_in_time(self._link.identity, self.statement, timeout_s)
        return self._settle()

    def abort(self) -> None:
        """Send Abort once and await the end of the movement.

        Raises:
            OutcomeUnknownError: No end was seen; the marker stays.
        """
        session = self._link.session
        with session.uninterrupted():
            with self._link.markers.doubt(self.statement):
                if self._pending.answer is None:
                    # A refusal may mean that it has just ended by itself; its end is awaited.
                    with suppress(RejectedError):
                        session.exchange("Abort")
                    self._end_within(session.timeout_s)
            self._take_answer()

    def _watch(self, deadline: Deadline) -> bool:
        """Poll until the statement answers; False when the deadline passes first."""
        session = self._link.session
        while self._pending.answer is None:
            if deadline.expired:
                return False
            try:
                status = self._link.window.status()
                if status.emergency_stop or status.guard_open or status.fault:
                    # The controller ends the statement by itself; its answer must follow soon.
                    self._end_within(session.timeout_s)
                    break
                session.await_pending(wait_s=min(POLL_S, deadline.remaining_s()))
            except (TransportError, RemoteProtocolError):
                if self._pending.answer is None:
                    raise
                break  # the session was over after the end of the movement was announced
        return True

    def _end_within(self, timeout_s: float) -> None:
        session = self._link.session
        deadline = Deadline.after(session.clock, timeout_s)
        while self._pending.answer is None:
            if deadline.expired:
                session.close()
                raise TransportTimeoutError(
                    tr("The controller did not announce the end of the statement."),
                    controller=session.identity,
                    request=self.statement,
                )
            session.await_pending(wait_s=min(POLL_S, deadline.remaining_s()))

    def _take_answer(self) -> None:
        with self._link.session.uninterrupted():
            self._link.session.finish(self._pending)
            self._link.markers.clear(self._marker)

    def _runs_on(self) -> bool:
        """Whether something runs on the controller although the statement was refused."""
        return not self._pending.abort_requested and self._link.window.status().running

    def _settle(self) -> MotionOutcome:
        pending, answer = self._pending, self._pending.answer
        assert answer is not None  # noqa: S101 - _watch returned True
        with self._link.session.uninterrupted():
            self._link.session.finish(pending)
            # A controller that only gave up waiting (docs/reference/epson.md 1.6) may be moving
            # still; so may one that refuses while it runs, because the answer was to something
            # else, and one whose flags cannot be asked any more. The marker stays then.
            gave_up = isinstance(answer, Refusal) and answer.code == ErrorCode.TIMED_OUT
            failed: RobolinkError | None = None
            with self._link.markers.doubt(self.statement):
                try:
                    self._link.window.check(self.statement, answer)
                except UnclearAnswerError as error:
                    if gave_up and not pending.abort_requested:
                        raise self._link.markers.unproved(self.statement, error) from error
                    failed = error
                except (RejectedError, ControllerFaultError) as error:
                    if isinstance(error, RejectedError) and self._runs_on():
                        raise self._link.markers.unproved(self.statement, error) from error
                    failed = error
            self._link.markers.clear(self._marker)
        # How an aborted statement is answered is not documented (docs/reference/epson.md 1.6).
        aborted = pending.abort_requested
        if failed is not None and not (aborted and not isinstance(failed, ControllerFaultError)):
            raise failed
        return MotionOutcome.STOPPED if aborted else MotionOutcome.ARRIVED
