"""Jogging: the group moves along chosen axes for a time, watched, and is stopped."""

from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Final

from robolink.controllers.softmotion.answers import (
    DISPOSSESSED,
    command_ended_early,
    describe,
    has_ended,
    is_own,
)
from robolink.controllers.softmotion.commands import Require
from robolink.controllers.softmotion.condition import is_moving
from robolink.controllers.softmotion.heartbeat import LOOK_S
from robolink.controllers.softmotion.mailbox import Mailbox
from robolink.controllers.softmotion.movement import factors, straight
from robolink.errors import (
    ConfigError,
    ControllerError,
    ControllerFaultError,
    LimitError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
    StoppedError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.model import Marker, MarkerKind, Pose, WorkBox
from robolink.protocols.mailbox import (
    Command,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    Finished,
    Four,
    Opcode,
    Response,
)
from robolink.timing import Deadline

_RAMP_S = 0.5
"""Time in s in which a jog reaches its speed, and comes to rest: a person watches where it goes."""

_REST_S = 5.0
"""Longest time in which a jog stops, in s."""

_BRAKING_S: Final = 1.0
"""Longest braking time after another client took the mailbox, in s; a longer movement is that
client's."""

_STRONGER: Final = (Command(0, Opcode.HALT), Command(0, Opcode.STOP))
"""Commands that stop the group if the end of a jog is refused."""

_AXES = range(6)
_LENGTHS = frozenset({0, 1, 2})


@dataclass(frozen=True, slots=True)
class Jog:
    """The direction and the speed of a jog.

    Axes are 0 to 5: X, Y, Z and turns about the X, Y, Z axis of ``system``, which are not
    Euler angles (docs/reference/softmotion.md 2.3); in ACS the machine's axes.

    Attributes:
        forward: Axes that go up.
        backward: Axes that go down.
        system: The coordinate system.
        speed_mm_s: Of X, Y and Z.
        speed_percent: Of turns, and of the machine's axes: of each axis's own limit.
    """

    forward: frozenset[int] = frozenset()
    backward: frozenset[int] = frozenset()
    system: CoordinateSystem = CoordinateSystem.MCS
    speed_mm_s: float = 5.0
    speed_percent: int = 2

    def draft(self, *, unit_um: float) -> Command:
        """Return the command that begins it.

        Raises:
            ConfigError: No axis, an unknown one, or one in both directions; lengths and turns
                together, which have no common speed; or an impossible speed.
        """
        axes = self.forward | self.backward
        if not axes or not axes <= set(_AXES) or self.forward & self.backward:
            raise ConfigError(
                tr("These axes cannot be jogged: {axes}.", axes=sorted(axes)),
                remedy=tr("Give axes from 0 to 5, each in one direction."),
            )
        operands = (_mask(self.forward), _mask(self.backward), self.system, 0)
        return Command(0, Opcode.JOG, operands=operands, dynamics=self._dynamics(axes, unit_um))

    def _dynamics(self, axes: frozenset[int], unit_um: float) -> Four:
        if self.system is CoordinateSystem.ACS or not axes & _LENGTHS:
            return factors(self.speed_percent)
        if axes <= _LENGTHS:
            return straight(self.speed_mm_s, unit_um=unit_um, ramp_s=_RAMP_S)
        raise ConfigError(
            tr("Lengths and turns cannot be jogged together."),
            remedy=tr("Jog along X, Y, Z first, then turn."),
        )


class JogWatch:
    """Starts a jog, keeps it going, watches it, and ends it.

    Args:
        mailbox: Where it is commanded.
        jog: Which way.
        box: Where the tip may be meanwhile.
        require: Refuses what a snapshot does not allow.
    """

    def __init__(self, mailbox: Mailbox, jog: Jog, box: WorkBox, require: Require) -> None:
        self._mailbox = mailbox
        self._box = box
        self._require = require
        self._end_draft = Command(0, Opcode.JOG, operands=(0, 0, jog.system, 0))
        self.draft = jog.draft(unit_um=mailbox.unit_um)
        self.request = describe(self.draft)
        self._marker: Marker | None = None
        self._command: Command | None = None

    def run(self, duration_s: float) -> Pose:
        """Jog for a time and return where the tip is then.

        The command is marked like a movement, although the PLC ends a jog by itself when the
        client falls silent.

        Raises:
            LimitError: The tip came out of the box; the jog was ended there.
            RejectedError: The PLC refused it, or ended it: the permit went, for example.
            ControllerFaultError: The group went into error, or somebody stopped it.
            StoppedError: A stop came.
            OutcomeUnknownError: No answer came.
        """
        with self._mailbox.wire.latch.ending(self.request):
            return self._jogged(duration_s)

    def _jogged(self, duration_s: float) -> Pose:
        with self._mailbox.markers.doubt(self.request):
            try:
                with self._mailbox.wire.attended():
                    self._begin(duration_s)
                    failure = self._hold(duration_s)
            except BaseException:
                if self._marker is not None and self._mailbox.wire.alive:
                    self._bring_to_rest()
                raise
            now = self._bring_to_rest(ended=isinstance(failure, ControllerError))
        if failure is None and self._taken_over(now):
            failure = self._ended_by_plc(now)
        if failure is not None:
            raise failure
        return self._pose(now)

    def _begin(self, duration_s: float) -> None:
        mailbox = self._mailbox
        with mailbox.uninterrupted():
            marker = mailbox.markers.begin(
                MarkerKind.MOVE, self.request, {"duration_s": duration_s}
            )
            if mailbox.wire.interrupted:
                mailbox.markers.clear(marker)
                raise KeyboardInterrupt  # held back until here: nothing moves after it
            self._marker = marker
            mailbox.wire.motions.jogging = True
            try:
                self._command, _ = mailbox.commands.start(self.draft, self._require, nullcontext)
            except (ControllerError, ConfigError, StoppedError):
                mailbox.wire.motions.jogging = False
                mailbox.markers.clear(marker)
                self._marker = None
                raise

    def _hold(self, duration_s: float) -> LimitError | ControllerError | None:
        """Keep it going for its time; return what ended it early, if anything did."""
        snapshots = self._mailbox.snapshots
        deadline = Deadline.after(self._mailbox.wire.clock, duration_s)
        now = snapshots.take()
        while not deadline.expired and not self._mailbox.wire.latch.closed:
            try:
                self._box.check(self._pose(now))
            except LimitError as error:
                return error
            ended = self._ended_by_plc(now)
            if ended is not None:
                return ended
            now = snapshots.news(now, wait_s=min(LOOK_S, deadline.remaining_s()))
        return self._ended_by_plc(now)

    def _ended_by_plc(self, now: Response) -> ControllerError | None:
        """Return why a jog has ended that nobody here ended, ``None`` if it has not.

        Its end stands in the head while it is the last command, and else among the last ends.
        """
        end = self._bad_end(now)
        command = self._command
        if end is None or command is None:
            return None
        if end.error_class == ErrorClass.NONE:
            return command_ended_early(command)
        return self._mailbox.commands.motion_failure(self.request, now, end.error_class)

    def _bad_end(self, now: Response) -> Finished | None:
        command = self._command
        if command is None:
            return None  # its start was not acknowledged
        ends = [end for end in now.finished if end.sequence == command.sequence]
        if is_own(command, now) and has_ended(now.state):
            ends.insert(0, Finished(command.sequence, now.state, now.error_class))
        bad = (end for end in ends if end.state != CommandState.DONE)
        return next(bad, None)

    def _taken_over(self, now: Response) -> bool:
        """Whether the PLC ended it because another client took the mailbox.

        What moves from then on is that client's.
        """
        end = self._bad_end(now)
        return end is not None and end.error_class in DISPOSSESSED

    def _bring_to_rest(self, *, ended: bool = False) -> Response:
        """End the jog, unless the PLC has, and see the group stopped. No more beats go out.

        Where the PLC does not take the end, the group is halted, and where it does not take that
        either, it is stopped and held; and without a beat it ends every jog by itself.
        """
        mailbox = self._mailbox
        marker, self._marker = self._marker, None
        with mailbox.uninterrupted():
            refusal = None if ended else self._end()
            now = self._await_rest()
            mailbox.wire.motions.jogging = False
            if marker is not None:
                mailbox.markers.clear(marker)
        if isinstance(refusal, ControllerError):
            raise refusal
        if refusal is not None:
            raise ControllerFaultError(
                tr(
                    "The PLC did not acknowledge the end of {jog}. The group was stopped.",
                    jog=self.request,
                ),
                remedy=tr("Check the link to the PLC before the next jog."),
            ) from refusal
        return now

    def _end(self) -> RobolinkError | None:
        """Send the end of the jog, or a stronger stop; return why the first was not accepted."""
        refusal: RobolinkError | None = None
        for draft in (self._end_draft, *_STRONGER):
            try:
                self._mailbox.commands.carry_out(draft)
            except (ControllerError, TransportTimeoutError, RemoteProtocolError) as error:
                if not self._mailbox.wire.alive:
                    raise
                refusal = refusal or error
            else:
                return refusal
        assert refusal is not None  # noqa: S101 - nothing was taken
        raise self._mailbox.wire.ended(self._unproved(refusal))

    def _await_rest(self) -> Response:
        mailbox = self._mailbox
        deadline = Deadline.after(mailbox.wire.clock, _REST_S)
        ours = Deadline.after(mailbox.wire.clock, _BRAKING_S)
        now = mailbox.snapshots.take()
        while is_moving(now):
            if ours.expired and self._taken_over(now):
                break
            if deadline.expired:
                raise mailbox.wire.ended(self._unproved(None))
            now = mailbox.snapshots.news(now)
        return now

    def _unproved(self, cause: RobolinkError | None) -> OutcomeUnknownError:
        error = OutcomeUnknownError(
            tr("The group did not stop after {jog}.", jog=self.request),
            remedy=tr(
                "Press the emergency stop if the robot still moves. Next: 'robolink "
                "recover'. The robot stays blocked until then."
            ),
        )
        error.__cause__ = cause
        return error

    def _pose(self, now: Response) -> Pose:
        return self._mailbox.pose(now.tcp, tool=now.tool_slot)


def _mask(axes: Iterable[int]) -> int:
    return sum(1 << axis for axis in axes)
