"""A movement of an axis group: the PLC accepts it, and heartbeats keep it going.

When it is likely to end, which decides how often the waiter looks, and nothing else.

How fast: the four numbers that go with a movement or a jog.

Source: docs/reference/softmotion.md 2.3.
"""

import math
from contextlib import suppress
from typing import Final

from robolink.controllers.motion_group import stopped_before_edge
from robolink.controllers.softmotion.answers import describe, is_own
from robolink.controllers.softmotion.condition import is_moving
from robolink.controllers.softmotion.heartbeat import (
    FIRST_LOOK_S,
    LOOK_S,
    ExpectedEnd,
    watch_period_s,
)
from robolink.controllers.softmotion.mailbox import Mailbox
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    MotionTimeoutError,
    RejectedError,
    RemoteProtocolError,
    StoppedError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.model import Marker, MotionOutcome, MotionProfile, Path, Pose
from robolink.protocols.mailbox import (
    Command,
    CommandState,
    ErrorClass,
    Finished,
    Four,
    GroupState,
    Opcode,
    Response,
)
from robolink.timing import NS_PER_S, Deadline
from robolink.transport import MailboxHead

_REST_S = 1.0
"""Longest time from the end of a movement to the stop of its group, in s."""

_ANSWERS = frozenset(ErrorClass) - {ErrorClass.NONE}
"""Refusals of the PLC itself; what stands before it refuses with other numbers."""

_LOOKS_APART = 10
"""Time between whole looks while nothing is new, in times that a whole look takes on the line."""

_HALT_S = 10.0
"""Longest time in which a halt stops a group, in s."""


class SoftMotionMotion:
    """A movement under way. Wait on it: the PLC halts a movement on which nobody waits.

    Attributes:
        target: Where it goes.
        command: What was sent, with its number.
        rest: The snapshot with which the wait for its end was over; ``None`` before.

    Args:
        target: Where it goes.
        command: What was sent, with its number.
        marker: Of the movement.
        mailbox: Where it was sent.
        accepted: The snapshot that shows that the PLC accepted it.
        queued: Whether it begins behind another movement.
    """

    def __init__(
        self,
        target: Pose,
        command: Command,
        marker: Marker,
        mailbox: Mailbox,
        *,
        accepted: Response,
        queued: bool,
    ) -> None:
        self.target = target
        self.command = command
        self._marker = marker
        self._mailbox = mailbox
        self._seen = accepted
        self._begun_ns = mailbox.clock.now_ns()
        # On a serial line beats are due all the time, and whole looks, which show the way, rare.
        known = not queued and not mailbox.wire.whole_look_s
        self._expected = _expected_end(command, accepted, self._begun_ns) if known else None
        self._request = describe(command)
        self._halted = False
        self._end: Finished | None = None
        self.rest: Response | None = None

    @property
    def settled(self) -> bool:
        """Whether its end was seen and handled."""
        return self._end is not None

    def wait(self, *, timeout_s: float) -> MotionOutcome:
        """Wait for the end; see :class:`robolink.model.Motion`.

        Raises:
            StoppedError: A stop came, whatever the movement did.
        """
        with self._mailbox.wire.latch.ending(self._request):
            end = self.await_end(timeout_s)
            if end.state == CommandState.DONE:
                return MotionOutcome.ARRIVED
            return self._stopped(end)

    def abort(self) -> None:
        """Halt the group once and await the end of the movement.

        Raises:
            OutcomeUnknownError: No end was seen; the marker stays.
        """
        mailbox = self._mailbox
        with (
            mailbox.uninterrupted(),
            mailbox.markers.doubt(self._request),
            mailbox.wire.attended(),
        ):
            if self._end is None and mailbox.wire.motions.end_of(self.command.sequence) is None:
                self._halted = True
                self._halt()
            if not self._watch(Deadline.after(mailbox.wire.clock, _HALT_S)):
                raise mailbox.wire.ended(
                    TransportTimeoutError(
                        tr("The PLC did not finish {request!r}.", request=self._request),
                        remedy=tr("Press the emergency stop if the robot still moves."),
                    )
                )
            self._take_end()
        self._await_rest()

    def _halt(self) -> None:
        """Halt the group; stop it where a stop got lost before, or the PLC answers no halt.

        The movement may have just ended by itself or by a stop. A stop under way ends it too, and a
        halt after that would only hide the end of the stop.
        """
        mailbox = self._mailbox
        mailbox.wire.motions.give_up()
        if mailbox.wire.latch.under_way:
            return
        if not mailbox.wire.latch.closed:
            try:
                mailbox.commands.carry_out(Command(0, Opcode.HALT))
            except ControllerFaultError:
                return
            except RejectedError as refusal:
                if refusal.code in _ANSWERS:
                    return
            except (TransportTimeoutError, RemoteProtocolError, StoppedError):
                if not mailbox.wire.alive:
                    raise
            else:
                return
        with suppress(RejectedError):
            mailbox.commands.bring_to_rest()

    def await_end(self, timeout_s: float) -> Finished:
        """Wait for the end, whatever it is; raises like :meth:`wait` except for how it ended."""
        mailbox = self._mailbox
        if self._end is not None:
            return self._end
        try:
            with mailbox.markers.doubt(self._request), mailbox.wire.attended():
                ended = self._watch(Deadline.after(mailbox.wire.clock, timeout_s))
        except KeyboardInterrupt:
            self.abort()
            raise
        if not ended:
            self.abort()
            raise MotionTimeoutError(
                tr(
                    "{request!r} did not end within {timeout_s:.0f} s; robolink stopped it.",
                    request=self._request,
                    timeout_s=timeout_s,
                ),
                remedy=tr("Check where the robot is ('robolink robot where') before you continue."),
            )
        end = self._take_end()
        self._await_rest()
        return end

    def _stopped(self, end: Finished) -> MotionOutcome:
        if end.state == CommandState.ABORTED and (
            self._halted or end.error_class == ErrorClass.NONE
        ):
            return MotionOutcome.STOPPED
        now = self._mailbox.snapshots.take()
        raise self._mailbox.commands.motion_failure(self._request, now, end.error_class)

    def _watch(self, deadline: Deadline) -> bool:
        """Beat and look until the end is known; False when the deadline passes first."""
        mailbox, sequence = self._mailbox, self.command.sequence
        if self.settled:
            return True
        since_s = (mailbox.clock.now_ns() - self._begun_ns) / NS_PER_S
        if since_s > FIRST_LOOK_S and not mailbox.wire.whole_look_s:
            self._seen = mailbox.snapshots.take()  # nobody has looked for a while
        while mailbox.wire.motions.end_of(sequence) is None:
            if mailbox.wire.motions.missing(sequence, self._seen):
                raise mailbox.wire.ended(self._vanished())
            if deadline.expired:
                return False
            self._seen = mailbox.snapshots.watched(self, wait_s=self._patience_s(deadline))
            if self._on_course is not None:
                self._on_course.saw(self._seen.tcp, mailbox.clock.now_ns())
        return True

    def pause_s(self, now_ns: int) -> float:
        """See :class:`~robolink.controllers.softmotion.snapshots.MotionWatch`."""
        if self._on_course is not None:
            return self._on_course.pause_s(now_ns)
        return watch_period_s((now_ns - self._begun_ns) / NS_PER_S)

    def foresees(self, head: MailboxHead) -> bool:
        """See :class:`~robolink.controllers.softmotion.snapshots.MotionWatch`."""
        seen = self._seen
        if head[:4] == (seen.ack_head, seen.state, seen.error_class, seen.group_state):
            return True
        return (
            (head.ack, head.error_class) == (self.command.sequence, ErrorClass.NONE)
            and head.state in (CommandState.BUFFERED, CommandState.ACTIVE)
            and head.group_state in (GroupState.STANDBY, GroupState.MOVING)
        )

    @property
    def _on_course(self) -> ExpectedEnd | None:
        """When it is likely to end, as long as nothing here ends it early."""
        return None if self._halted or self._mailbox.wire.latch.closed else self._expected

    def _patience_s(self, deadline: Deadline) -> float:
        """Return how long to do without a whole look while the head shows nothing unforeseen.

        Of a single movement it shows the end (it is the last command), and whatever else ends it:
        so on a slow line the whole block, which keeps the beat waiting, is read rarely.
        """
        wire, expected = self._mailbox.wire, self._on_course
        if wire.whole_look_s and wire.motions.alone:
            patience_s = max(LOOK_S, _LOOKS_APART * wire.whole_look_s)
        elif expected is not None:
            patience_s = expected.patience_s(wire.clock.now_ns())
        else:
            patience_s = LOOK_S
        return min(patience_s, deadline.remaining_s())

    def _take_end(self) -> Finished:
        if self._end is None:
            end = self._mailbox.wire.motions.end_of(self.command.sequence)
            assert end is not None  # noqa: S101 - _watch has seen it
            with self._mailbox.uninterrupted():
                self._mailbox.wire.motions.forget(self.command.sequence)
                self._mailbox.markers.clear(self._marker)
                self._end = end
        return self._end

    def _await_rest(self) -> None:
        """Let the group stop unless more is in progress.

        It counts as moving for a cycle longer than its last movement
        (docs/reference/softmotion.md 2.2), and a program that watches an input may call that
        movement done while it still brakes.
        """
        wire, snapshots = self._mailbox.wire, self._mailbox.snapshots
        deadline = Deadline.after(wire.clock, _REST_S)
        now = self._seen if self._shows_end(self._seen) else snapshots.take()
        while is_moving(now) and not wire.motions.unfinished and not deadline.expired:
            now = snapshots.news(now, wait_s=deadline.remaining_s())
        self.rest = now

    def _shows_end(self, now: Response) -> bool:
        ends = self._mailbox.wire.motions.ends_in(now)
        return any(end.sequence == self.command.sequence for end in ends)

    def _vanished(self) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr("The PLC shows neither {request!r} nor how it ended.", request=self._request),
            remedy=tr("Another client has moved the group meanwhile."),
        )


def _expected_end(command: Command, start: Response, now_ns: int) -> ExpectedEnd | None:
    """Return when a movement is likely to end; nothing where an edge ends it."""
    whole = command.opcode in (Opcode.MOVE_LINEAR, Opcode.MOVE_DIRECT)
    if not whole or not all(map(math.isfinite, start.tcp)):
        return None
    takes_s = 0.0
    if command.opcode == Opcode.MOVE_LINEAR:
        way = math.dist(start.tcp[:3], command.pose[:3])
        takes_s = shortest_time_s(way, command.dynamics)
    return ExpectedEnd(start.tcp, command.pose, now_ns, takes_s=takes_s)


class SoftMotionMotionUntilInput:
    """A straight movement until an input switches (opcode 30008). Wait on it."""

    def __init__(self, motion: SoftMotionMotion, mailbox: Mailbox) -> None:
        self._motion = motion
        self._mailbox = mailbox

    def wait(self, *, timeout_s: float) -> Pose | None:
        """Wait for the end and return where the tip was at the edge.

        Returns:
            ``None`` when the input did not switch on the way.

        Raises:
            ControllerError: It was stopped, refused, or ended by an error.
            MotionTimeoutError, OutcomeUnknownError: As for any movement.
        """
        request = describe(self._motion.command)
        with self._mailbox.asked(request):
            with self._mailbox.wire.latch.ending(request):
                end = self._motion.await_end(timeout_s)
            if end.error_class == ErrorClass.NO_EDGE:
                return None
            if self._motion.wait(timeout_s=timeout_s) is not MotionOutcome.ARRIVED:
                raise stopped_before_edge(self._mailbox.identity, request)
            return self._latched()

    def _latched(self) -> Pose:
        now = self._motion.rest or self._mailbox.snapshots.take()
        if not is_own(self._motion.command, now):
            raise RemoteProtocolError(
                tr("Another command came before the latched position was read."),
                remedy=tr("Repeat the measurement."),
            )
        target = self._motion.target
        return self._mailbox.pose(now.answer.pose, tool=target.tool)


RAMP_S: Final = 0.2
"""Time in s in which a straight movement reaches its speed, and again its acceleration: SoftMotion
requires all four numbers above 0. At 60 mm/s that is 240 mm/s2, about what an EPSON does with its
usual AccelS of 200. A harder start would gain little more: of 3.5 s that a needle on two beams
spends in ramps of half a second, these save 1.4 s."""

_PAST_AN_EDGE_MM: Final = 0.05
"""Distance in mm within which a tip stopped by an input comes to rest, apart from the PLC's cycle.
"""

_EDGE_RAMP_S: Final = 0.02
"""Time in s in which such a movement reaches its deceleration."""

LATCH_CYCLE_S: Final = 0.004
"""Longest usual cycle of a motion task, in s. A program records the position of an edge in the
cycle in which the edge is seen (the companion's program does), and the mailbox does not report the
cycle time."""

_UM_PER_MM: Final = 1000.0


def factors(percent: int) -> Four:
    """Return the factors of the axes' own limits, for direct movements.

    Raises:
        ConfigError: It is not 1 to 100.
    """
    if not 1 <= percent <= 100:
        raise ConfigError(
            tr("A speed of {percent} % is not possible.", percent=percent),
            remedy=tr("Give 1 to 100."),
        )
    return (percent / 100.0,) * 4


def straight(
    speed_mm_s: float,
    *,
    unit_um: float,
    acceleration_mm_s2: float | None = None,
    ramp_s: float = RAMP_S,
) -> Four:
    """Return velocity, acceleration, deceleration and jerk in the PLC's units.

    Acceleration and deceleration are lowered to what the cell states, if it states one.

    Args:
        speed_mm_s: How fast.
        unit_um: The PLC's unit of length, in micrometres.
        acceleration_mm_s2: The acceleration that the cell states, if it states one.
        ramp_s: In what time it reaches its speed, and again its acceleration.

    Raises:
        ConfigError: The speed is not above 0, or not finite.
    """
    if not 0 < speed_mm_s < float("inf"):
        raise ConfigError(
            tr("A speed of {speed} mm/s is not possible.", speed=speed_mm_s),
            remedy=tr("Give a number above 0."),
        )
    velocity = speed_mm_s * _UM_PER_MM / unit_um
    acceleration = _kept_to(acceleration_mm_s2, velocity / ramp_s, unit_um)
    return (velocity, acceleration, acceleration, acceleration / ramp_s)


def _kept_to(acceleration_mm_s2: float | None, usual: float, unit_um: float) -> float:
    """Return an acceleration in the PLC's units, lowered to the one that the cell states."""
    if acceleration_mm_s2 is None:
        return usual
    return min(usual, acceleration_mm_s2 * _UM_PER_MM / unit_um)


def up_to_an_edge(
    speed_mm_s: float, *, unit_um: float, acceleration_mm_s2: float | None = None
) -> Four:
    """Return the numbers of a movement that an input stops, the tip perhaps in contact.

    The acceleration is lowered to what the cell states, if it states one. The deceleration is not:
    the tip must not go deeper.

    Raises:
        ConfigError: The speed is not above 0, or not finite.
    """
    velocity, *_ = straight(speed_mm_s, unit_um=unit_um)
    deceleration = velocity * speed_mm_s / (2 * _PAST_AN_EDGE_MM)
    acceleration = _kept_to(acceleration_mm_s2, deceleration, unit_um)
    return (velocity, acceleration, deceleration, deceleration / _EDGE_RAMP_S)


def run_up_mm(speed_mm_s: float, acceleration_mm_s2: float | None = None) -> float:
    """Return the distance in which such a movement reaches its speed, and stops at the latest.

    With acceleration a and jerk j the speed v takes v/a + a/j, or 2 sqrt(v/j) where a is never
    reached, and half of v times that is the way.

    Raises:
        ConfigError: The speed is not above 0, or not finite.
    """
    velocity, acceleration, _, jerk = up_to_an_edge(
        speed_mm_s, unit_um=_UM_PER_MM, acceleration_mm_s2=acceleration_mm_s2
    )
    if velocity < acceleration**2 / jerk:
        took_s = 2 * math.sqrt(velocity / jerk)
    else:
        took_s = velocity / acceleration + acceleration / jerk
    return velocity * took_s / 2


def shortest_time_s(distance: float, dynamics: Four) -> float:
    """Return how long a straight movement takes at least, from rest to rest.

    Args:
        distance: Of its way, in the PLC's units.
        dynamics: Its numbers. The jerk does not count: whether a group keeps it is up to its
            profile (docs/reference/softmotion.md 2.3).
    """
    velocity, acceleration, *_ = dynamics
    if distance >= velocity**2 / acceleration:
        return distance / velocity + velocity / acceleration
    return 2 * math.sqrt(distance / acceleration)


def dynamics_of(
    profile: MotionProfile, *, unit_um: float, acceleration_mm_s2: float | None = None
) -> Four:
    """Return the numbers of a profile: factors for joint moves, else units per second."""
    if profile.path is Path.JOINT:
        return factors(profile.speed_percent)
    return straight(profile.speed_mm_s, unit_um=unit_um, acceleration_mm_s2=acceleration_mm_s2)
