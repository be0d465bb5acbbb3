"""Jogging: the group moves along chosen axes for a time, watched, and is brought to rest."""

from collections.abc import Iterable
from dataclasses import dataclass

from robolink.controllers.softmotion._answers import describe
from robolink.controllers.softmotion._condition import is_moving
from robolink.controllers.softmotion._dynamics import factors, straight
from robolink.controllers.softmotion._mailbox import Mailbox
from robolink.controllers.softmotion._snapshots import LOOK_S
from robolink.errors import (
    ConfigError,
    ControllerError,
    LimitError,
    StoppedError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.model import Marker, MarkerKind, Pose, WorkBox
from robolink.protocols.mailbox import Command, CoordinateSystem, Four, Opcode, Response
from robolink.timing import Deadline

_REST_S = 5.0
"""Longest time in which a jog comes to rest."""

_AXES = range(6)
_LENGTHS = frozenset({0, 1, 2})


@dataclass(frozen=True, slots=True)
class Jog:
    """Which way to jog, and how fast.

    Axes are 0 to 5: X, Y, Z and turns about the X, Y, Z axis of ``system``, which are not
    Euler angles (softmotion.md 0.4); in ACS the machine's axes.

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
                tr("No jog goes along these axes: {axes}.", axes=sorted(axes)),
                remedy=tr("Give axes from 0 to 5, each in one direction."),
            )
        operands = (_mask(self.forward), _mask(self.backward), self.system, 0)
        return Command(0, Opcode.JOG, operands=operands, dynamics=self._dynamics(axes, unit_um))

    def _dynamics(self, axes: frozenset[int], unit_um: float) -> Four:
        if self.system is CoordinateSystem.ACS or not axes & _LENGTHS:
            return factors(self.speed_percent)
        if axes <= _LENGTHS:
            return straight(self.speed_mm_s, unit_um=unit_um)
        raise ConfigError(
            tr("Lengths and turns cannot be jogged together."),
            remedy=tr("Jog along X, Y, Z first, then turn."),
        )


class JogWatch:
    """Begins a jog, keeps it going, watches it, and ends it.

    Args:
        mailbox: Where it is commanded.
        jog: Which way.
        box: Where the tip may be meanwhile.
    """

    def __init__(self, mailbox: Mailbox, jog: Jog, box: WorkBox) -> None:
        self._mailbox = mailbox
        self._box = box
        self._end_draft = Command(0, Opcode.JOG, operands=(0, 0, jog.system, 0))
        self.draft = jog.draft(unit_um=mailbox.unit_um)
        self.request = describe(self.draft)
        self._marker: Marker | None = None

    def run(self, duration_s: float) -> Pose:
        """Jog for a time and return where the tip is then.

        The command is marked like a movement, although the PLC ends a jog by itself when the
        client falls silent.

        Raises:
            LimitError: The tip came out of the box; the jog was ended there.
            RejectedError: The PLC refused it.
            OutcomeUnknownError: No answer came.
        """
        with self._mailbox.desk.doubt(self.request):
            try:
                self._begin(duration_s)
                outside = self._hold(duration_s)
            except KeyboardInterrupt:
                if self._marker is not None:
                    self._end()
                raise
            now = self._end()
        if outside is not None:
            raise outside
        return self._pose(now)

    def _begin(self, duration_s: float) -> None:
        mailbox = self._mailbox
        with mailbox.uninterrupted():
            marker = mailbox.desk.begin(MarkerKind.MOVE, self.request, {"duration_s": duration_s})
            if mailbox.wire.interrupted:
                mailbox.desk.clear(marker)
                raise KeyboardInterrupt  # held back until here: nothing moves after it
            self._marker = marker
            mailbox.wire.rides.jogging = True
            try:
                mailbox.orders.start(self.draft)
            except (ControllerError, ConfigError, StoppedError):
                mailbox.wire.rides.jogging = False
                mailbox.desk.clear(marker)
                raise

    def _hold(self, duration_s: float) -> LimitError | None:
        snapshots = self._mailbox.snapshots
        deadline = Deadline.after(self._mailbox.wire.clock, duration_s)
        now = snapshots.take()
        while not deadline.expired and not self._mailbox.wire.latch.closed:
            try:
                self._box.check(self._pose(now))
            except LimitError as error:
                return error
            now = snapshots.news(now, wait_s=min(LOOK_S, deadline.remaining_s()))
        return None

    def _end(self) -> Response:
        mailbox = self._mailbox
        marker, self._marker = self._marker, None
        with mailbox.uninterrupted():
            now = mailbox.orders.carry_out(self._end_draft)
            deadline = Deadline.after(mailbox.wire.clock, _REST_S)
            while is_moving(now):
                if deadline.expired:
                    raise mailbox.wire.ended(
                        TransportTimeoutError(
                            tr("The group did not come to rest after {jog}.", jog=self.request),
                            remedy=tr("Press the emergency stop if the robot still moves."),
                        )
                    )
                now = mailbox.snapshots.news(now)
            mailbox.wire.rides.jogging = False
            if marker is not None:
                mailbox.desk.clear(marker)
        return now

    def _pose(self, now: Response) -> Pose:
        return Pose(*self._mailbox.coordinates(now.tcp), tool=now.tool_slot)


def _mask(axes: Iterable[int]) -> int:
    return sum(1 << axis for axis in axes)
