"""A movement under way: one pending Execute, watched by GetStatus, ended by Abort.

A straight movement until an input switches: ``Move ... Till`` or ``Find``.

Source: docs/reference/spel.md 7.1.

Power, speed and acceleration: set and read back, remembered and put back.
"""

from collections.abc import Iterable
from contextlib import suppress
from typing import Final

from robolink.controllers.epson.answers import ArmState, PowerAndSpeed, alike, numbers
from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.session import PendingExecute
from robolink.controllers.epson.singularities import printed_pose, read_position
from robolink.controllers.motion_group import not_ended_in_time, stopped_before_edge
from robolink.errors import (
    ControllerError,
    ControllerFaultError,
    NotReadyError,
    NotReadyReason,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
    TransportTimeoutError,
    UnclearAnswerError,
)
from robolink.messages import tr
from robolink.model import InputEdge, Marker, MotionOutcome, MotionProfile, Pose
from robolink.protocols import spel
from robolink.protocols.epson_text import ErrorCode, Refusal
from robolink.timing import Deadline

WATCH_S: Final = 0.4
"""Interval between looks at emergency stop, guard and fault, in s; the end shows by itself."""

_END_POLL_S: Final = 0.1


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
        """Whether its end was seen and handled."""
        return self._link.session.pending is not self._pending

    def wait(self, *, timeout_s: float) -> MotionOutcome:
        """Wait for the end; see :class:`robolink.model.Motion`.

        Raises:
            StoppedError: A stop came, whatever the movement did.
        """
        with self._link.latch.ending(self.statement), self._link.awaited():
            return self._awaited(timeout_s)

    def _awaited(self, timeout_s: float) -> MotionOutcome:
        unread: RemoteProtocolError | None = None
        try:
            with self._link.markers.doubt(self.statement):
                try:
                    arrived = self._watch(Deadline.after(self._link.clock, timeout_s))
                except RemoteProtocolError as error:
                    if not self._link.session.alive:
                        raise
                    # Flags that cannot be read leave the movement unwatched, not its end in doubt.
                    unread, arrived = error, False
        except KeyboardInterrupt:
            self._abort(anew=True)
            raise
        if not arrived:
            self.abort()
            raise unread or not_ended_in_time(self.statement, timeout_s)
        return self._settle()

    def abort(self) -> None:
        """Send Abort once and await the end of the movement.

        Raises:
            OutcomeUnknownError: No end was seen; the marker stays.
        """
        self._abort()

    def _abort(self, *, anew: bool = False) -> None:
        """Abort it, ``anew`` over a new link where the session is lost: a person wants it."""
        session = self._link.session
        with session.uninterrupted():
            with self._link.markers.doubt(self.statement):
                if self._pending.answer is None:
                    try:
                        with suppress(RejectedError):  # it has just ended by itself: wait for that
                            session.exchange("Abort")
                        self._end_within(session.timeout_s)
                    finally:
                        if anew:
                            self._link.stopped_anew()
            self._take_answer()

    def _watch(self, deadline: Deadline) -> bool:
        """Poll until the statement answers; False when the deadline passes first."""
        session = self._link.session
        while self._pending.answer is None:
            if deadline.expired:
                return False
            try:
                session.await_pending(wait_s=min(WATCH_S, deadline.remaining_s()))
                if self._pending.answer is not None or deadline.expired:
                    continue
                status = self._link.window.status()
                if status.emergency_stop or status.guard_open or status.fault:
                    # The controller ends the statement by itself; its answer must follow soon.
                    self._end_within(session.timeout_s)
                    break
            except (TransportError, RemoteProtocolError):
                if self._pending.answer is None:
                    raise
                break  # the session broke after the movement had reported its end
        return True

    def _end_within(self, timeout_s: float) -> None:
        session = self._link.session
        deadline = Deadline.after(session.clock, timeout_s)
        while self._pending.answer is None:
            if deadline.expired:
                session.close()
                raise TransportTimeoutError(
                    tr("The controller did not report the end of the statement."),
                    remedy=tr("Check cable and power of the controller, then try again."),
                    controller=session.identity,
                    request=self.statement,
                )
            session.await_pending(wait_s=min(_END_POLL_S, deadline.remaining_s()))

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
            # A controller that only gave up waiting (docs/reference/epson.md 1.6) may still be
            # moving. So may one that refuses while it runs, because the answer was to something
            # else, and one whose flags can no longer be read. The marker then stays.
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
        # The answer to an aborted statement is not documented (docs/reference/epson.md 1.6).
        aborted = pending.abort_requested
        if failed is not None and not (aborted and not isinstance(failed, ControllerFaultError)):
            raise failed
        return MotionOutcome.STOPPED if aborted else MotionOutcome.ARRIVED


class EpsonMotionUntilInput:
    """Implements :class:`robolink.model.MotionUntilInput`.

    With ``run_on`` the position is the one that ``Find`` kept at the edge. Without, ``Till``
    keeps none: it is the measured position at rest, past the edge by the way of braking.

    Args:
        motion: The movement.
        edge: What ends it.
        link: The controller.
        accel_s_mm_s2: AccelS as the look before it showed it; ``None`` where no look shows it.
    """

    def __init__(
        self,
        motion: EpsonMotion,
        edge: InputEdge,
        link: EpsonLink,
        accel_s_mm_s2: tuple[float, float] | None = None,
    ) -> None:
        self._motion = motion
        self._edge = edge
        self._link = link
        self._accel_s_mm_s2 = accel_s_mm_s2

    def wait(self, *, timeout_s: float) -> Pose | None:
        """Wait for the end; see :class:`robolink.model.MotionUntilInput`.

        Raises:
            ControllerError: AccelS is not what it was before, so that nobody knows how fast the tip
                was at the edge.
        """
        if self._motion.wait(timeout_s=timeout_s) is not MotionOutcome.ARRIVED:
            raise stopped_before_edge(self._link.identity, self._motion.statement)
        window, tool = self._link.window, spel.print_selected_tool()
        accel = () if self._accel_s_mm_s2 is None else _ACCEL_S
        if self._edge.run_on:
            # FindPos of nothing found is an error of the controller (docs/reference/spel.md 7.1).
            met, *now = window.printed_numbers(spel.print_position_found(), *accel)
            self._require_kept(now)
            if not spel.parse_boolean(met):
                return None
            return read_position(window, spel.print_found_position())
        (met, selected, *now), point = window.printed_before_point(
            spel.print_till_on(), tool, *accel, point=spel.print_real_position()
        )
        self._require_kept(now)
        if not spel.parse_boolean(met):
            return None
        return printed_pose(point, tool=spel.parse_integer(selected))

    def _require_kept(self, printed: Iterable[str]) -> None:
        now, before = tuple(map(spel.parse_number, printed)), self._accel_s_mm_s2 or ()
        if not alike(now, before):
            raise ControllerError(
                tr(
                    "The acceleration changed during the movement: AccelS is {now} now, and was "
                    "{before}.",
                    now=numbers(now),
                    before=numbers(before),
                ),
                remedy=tr(
                    "The measurement does not count. Find the program or person that sets AccelS, "
                    "then measure again."
                ),
                controller=self._link.identity,
                request=self._motion.statement,
            )


_STATE: Final = (spel.print_selected_tool(), spel.print_motor(), spel.print_power())
_LOOKED_AT: Final = (*_STATE, spel.print_speed(1), spel.print_speed_s(1))
_ACCEL_S: Final = (spel.print_accel_s(1), spel.print_accel_s(2))
_ALL_ACCEL_S: Final = tuple(map(spel.print_accel_s, range(1, 7)))


class Settings:
    """Reads, limits and restores power, speed and acceleration.

    Args:
        link: The controller.
        acceleration_mm_s2: Highest acceleration and deceleration of straight movements, as the cell
            states it. It is only ever lowered to this; ``None`` leaves AccelS alone.
    """

    def __init__(self, link: EpsonLink, *, acceleration_mm_s2: int | None = None) -> None:
        self._link = link
        self._window = link.window
        self._set_after = link.session.settings_reset
        self._stated_mm_s2 = acceleration_mm_s2
        self._told: tuple[float, float] | None = None

    def read(self, like: PowerAndSpeed | None = None) -> PowerAndSpeed:
        """Read the present power and speed, and the acceleration where the cell states one.

        Args:
            like: An earlier reading, perhaps of another process; what that holds is read.
        """
        each = (1, 2, 3)
        wanted = self._stated_mm_s2 if like is None else like.accel_s_mm_s2
        told = self._window.printed_numbers(
            spel.print_power(),
            *map(spel.print_speed, each),
            *map(spel.print_speed_s, each),
            *(() if wanted is None else _ALL_ACCEL_S),
        )
        power, a, b, c, *straight = told
        d, e, f, *accel = map(spel.parse_number, straight)
        percent = (spel.parse_integer(a), spel.parse_integer(b), spel.parse_integer(c))
        high = spel.parse_integer(power) != 0
        return PowerAndSpeed(high, percent, (d, e, f), tuple(accel) or None)

    def acceleration_mm_s2(self) -> tuple[float, float]:
        """Read how a straight movement will speed up and brake: AccelS, or less where stated.

        Where the cell states one, a movement that an input ends is refused from here on if AccelS
        is another by then (:meth:`require_as_told`).
        """
        found = self._window.printed_numbers(*_ACCEL_S)
        speeding_up, braking = map(spel.parse_number, found)
        if self._stated_mm_s2 is not None:
            speeding_up = min(speeding_up, self._stated_mm_s2)
            braking = min(braking, self._stated_mm_s2)
        self._told = speeding_up, braking
        return self._told

    def require_as_told(self, found: ArmState, request: str) -> None:
        """Refuse a movement with another acceleration than the one that was told last.

        The run-up of a crossing and the braking of a touch were calculated from that one.

        Args:
            found: What the last look showed.
            request: The movement.

        Raises:
            NotReadyError: Names both.
        """
        now, told = found.accel_s_mm_s2, self._told
        if now is None or told is None or alike(now, told):
            return
        raise NotReadyError(
            tr(
                "The run-up was calculated for an AccelS of {told}; now it is {now}.",
                told=numbers(told),
                now=numbers(now),
            ),
            reason=NotReadyReason.ACCELERATION,
            remedy=tr(
                "Nothing moved. Find the program or person that sets AccelS, then start again."
            ),
            controller=self._link.identity,
            request=request,
        )

    def look(self, edge: InputEdge | None = None) -> ArmState:
        """Read what a movement depends on.

        What the moves of this driver go by is read; departure and approach values count for Jump
        alone, which it never sends.

        Args:
            edge: What is to end it. Its input is read through Execute, so that it shows what the
                next statement will see.
        """
        accel = () if self._stated_mm_s2 is None else _ACCEL_S
        tool, motor, power, percent, straight, *more = self._window.printed_numbers(
            *_LOOKED_AT, *accel, *([spel.print_input(edge.number)] if edge else [])
        )
        found, sensed = more[: len(accel)], more[len(accel) :]
        return ArmState(
            tool=spel.parse_integer(tool),
            motors_on=spel.parse_integer(motor) != 0,
            power_high=spel.parse_integer(power) != 0,
            speed_percent=spel.parse_integer(percent),
            speed_mm_s=spel.parse_number(straight),
            sensed=spel.parse_integer(sensed[0]) != 0 if sensed else None,
            accel_s_mm_s2=(
                (spel.parse_number(found[0]), spel.parse_number(found[1])) if found else None
            ),
        )

    def statements(
        self, profile: MotionProfile, found: ArmState | None = None
    ) -> tuple[spel.Statement, ...]:
        """Return what sets Power Low, both speeds of a profile, and the acceleration if stated.

        Args:
            profile: The movement.
            found: What a look showed; without one the acceleration is the stated one, which is the
                most that is ever set.
        """
        stated = self._stated_mm_s2
        accel = () if stated is None else (spel.accel_s(stated, stated),)
        return (
            spel.power_low(),
            spel.speed(profile.speed_percent),
            spel.speed_s(profile.speed_mm_s),
            *(accel if found is None else found.lowered(stated)),
        )

    def slow_down(self, profile: MotionProfile, edge: InputEdge | None = None) -> ArmState:
        """Set Power Low, both speeds and the acceleration, and confirm it with a look.

        Args:
            profile: The movement.
            edge: As for :meth:`look`.

        Raises:
            NotReadyError: The controller does not show what was set; nothing may move.
        """
        # Counted before: what another thread stops meanwhile is set anew once more.
        resets = self._link.session.settings_reset
        # An acceleration is only lowered, so it takes a reading from after the reset.
        found = None if self._stated_mm_s2 is None else self.look()
        state = self._confirmed(profile, self.statements(profile, found), edge)
        self._set_after = resets
        return state

    def slowed(
        self, profile: MotionProfile, found: ArmState, edge: InputEdge | None = None
    ) -> ArmState:
        """Return a state with Power Low and the speed of a profile; what differs is set.

        Before a search the last look shows the input, too.

        Motor On and Reset put them back, Abort perhaps too (docs/reference/spel.md 6.3). So after
        one of these they are set anew, whatever is read.

        Args:
            profile: The movement.
            found: What the last look showed.
            edge: As for :meth:`look`.

        Raises:
            NotReadyError: As :meth:`slow_down`.
        """
        if self._set_after != self._link.session.settings_reset:
            return self.slow_down(profile, edge)
        differences = tuple(found.differences(profile, self._stated_mm_s2))
        if not differences and edge is None:
            return found
        return self._confirmed(profile, differences, edge)

    def _confirmed(
        self,
        profile: MotionProfile,
        statements: Iterable[spel.Statement],
        edge: InputEdge | None,
    ) -> ArmState:
        for statement in statements:
            self._window.command(statement)
        state = self.look(edge)
        left = tuple(state.differences(profile, self._stated_mm_s2))
        if left and left[0].startswith("AccelS"):
            raise NotReadyError(
                tr("The controller does not confirm the acceleration that was set."),
                reason=NotReadyReason.ACCELERATION,
                remedy=tr(
                    "Nothing moved. Find the program or person that sets AccelS, then start again."
                ),
                controller=self._link.identity,
                request=left[0],
            )
        if left:
            raise NotReadyError(
                tr("The controller does not confirm low power and the speed that was set."),
                reason=NotReadyReason.HIGH_POWER,
                remedy=tr("Nothing moved. Check the power mode on the controller."),
                controller=self._link.identity,
                request=spel.power_low(),
            )
        return state

    def restore(self, before: PowerAndSpeed) -> None:
        """Restore ``before`` and confirm it; nothing is sent if it is set already.

        Raises:
            NotReadyError: Another value is read back.
        """
        if before.is_shown_by(self.read(before)):
            return
        for statement in (
            spel.speed(*before.speed_percent),
            spel.speed_s(*before.speed_s_mm_s),
            spel.power_high() if before.power_high else spel.power_low(),
            *([spel.accel_s(*before.accel_s_mm_s2)] if before.accel_s_mm_s2 else []),
        ):
            # One garbled acknowledgement must not prevent the rest from being restored.
            with suppress(UnclearAnswerError):
                self._window.command(statement)
        if not before.is_shown_by(self.read(before)):
            raise NotReadyError(
                tr("robolink could not restore the previous power mode, speed and acceleration.")
                if before.accel_s_mm_s2
                else tr("robolink could not restore the previous power mode and speed."),
                reason=NotReadyReason.HIGH_POWER,
                remedy=tr("Check Power, Speed, SpeedS and AccelS before you start the cell.")
                if before.accel_s_mm_s2
                else tr("Check Power, Speed and SpeedS before you start the cell."),
                controller=self._link.identity,
            )

    def power_high(self) -> bool:
        """Read the power mode."""
        (power,) = self._window.printed_numbers(spel.print_power())
        return spel.parse_integer(power) != 0
