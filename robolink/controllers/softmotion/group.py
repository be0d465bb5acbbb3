"""The axis group behind one mailbox: where its tip is, and how to move it."""

import math
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Final

from robolink.controllers.motion_group import MotionGroupCore
from robolink.controllers.movement_time import AnswerCounts, JointRates, Way, ramped_s
from robolink.controllers.softmotion.answers import describe
from robolink.controllers.softmotion.commands import Require
from robolink.controllers.softmotion.condition import (
    is_moving,
    require_beats,
    require_enabled,
    require_permit,
    require_power,
    require_still,
    require_tool_known,
)
from robolink.controllers.softmotion.facts import block_name
from robolink.controllers.softmotion.jog import Jog, JogWatch
from robolink.controllers.softmotion.mailbox import Mailbox, SoftMotionIo
from robolink.controllers.softmotion.movement import (
    LATCH_CYCLE_S,
    SoftMotionMotion,
    SoftMotionMotionUntilInput,
    dynamics_of,
    run_up_mm,
    straight,
    up_to_an_edge,
)
from robolink.errors import (
    ConfigError,
    ControllerError,
    NotReadyError,
    ReadBackError,
    RemoteProtocolError,
    StoppedError,
    TransportError,
)
from robolink.messages import tr
from robolink.model import (
    InputEdge,
    MotionProfile,
    MotionTerms,
    Path,
    Pose,
    WorkBox,
    require_target,
)
from robolink.protocols.mailbox import (
    BufferMode,
    Command,
    CoordinateSystem,
    GroupState,
    Opcode,
    Response,
    Six,
    to_frame,
)


class SoftMotionGroup(MotionGroupCore):
    """One axis group. Its poses are those of the selected tool in the machine frame (MCS).

    Args:
        mailbox: The mailbox.
        acceleration_mm_s2: Highest acceleration of straight movements, where the cell states one.
    """

    def __init__(self, mailbox: Mailbox, *, acceleration_mm_s2: int | None = None) -> None:
        super().__init__(mailbox)
        self._stated_mm_s2 = acceleration_mm_s2
        self._mailbox = mailbox
        self._current: list[SoftMotionMotion] = []

    @property
    def name(self) -> str:
        """``axis group``: a mailbox serves one."""
        return "axis group"

    def pose(self) -> Pose:
        """Read where the tip of the selected tool is now."""
        now = self._just_at_rest or self._mailbox.snapshots.take()
        return self._mailbox.pose(now.tcp, tool=now.tool_slot)

    def axes(self) -> dict[str, tuple[float, ...]]:
        """Read the axes of the machine, in the PLC's units and degrees."""
        now = self._mailbox.snapshots.take()
        return {"axes": now.axes[: now.axis_count]}

    def require_able(self, purpose: str) -> None:
        """Refuse if no movement could start now; see :class:`robolink.model.MotionGroup`."""
        with self._mailbox.asked(purpose):
            require_beats(self._mailbox.wire.whole_look_s)
            now = self._mailbox.snapshots.take()
            require_permit(now)
            require_enabled(now)
            require_power(now)

    def terms(self) -> MotionTerms:
        """Read what a person must know before the group moves."""
        return MotionTerms(
            tr("The axis group of {identity}", identity=self._mailbox.identity),
            tr("The PLC stops it if this computer sends nothing for half a second."),
            tr("The machine permits movements by this computer"),
        )

    def motors_on(self) -> bool:
        """Read whether the group is enabled."""
        return self._mailbox.snapshots.take().group_state != GroupState.DISABLED

    def enable(self) -> None:
        """Enable the group and confirm it; the drives are switched by the PLC's program.

        Raises:
            RejectedError: The PLC refused it.
            ReadBackError: It is still disabled.
        """
        self._switch(Opcode.ENABLE, enabled=True)

    def disable(self) -> None:
        """Disable the stopped group and confirm it; raises like :meth:`enable`."""
        self._switch(Opcode.DISABLE, enabled=False)

    def move_to(self, target: Pose, profile: MotionProfile, *, box: WorkBox) -> SoftMotionMotion:
        """Start one movement; see :class:`robolink.model.MotionGroup`.

        Wait on it: without the beats of ``wait`` the PLC halts it after half a second. Up to
        four may be under way, each beginning where the one before it ended.

        Raises:
            BusyError: The ends of four movements are not taken yet.
        """
        require_target(target, box, profile)
        return self._start(target, self._move_draft(target, profile))

    def requests_for(self, target: Pose, profile: MotionProfile) -> tuple[str, ...]:
        """Return what :meth:`move_to` would send besides its reads, in words."""
        return (describe(self._move_draft(target, profile)),)

    def move_until_input(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float, box: WorkBox
    ) -> SoftMotionMotionUntilInput:
        """Start a straight movement until an input switches (opcode 30008); see the model."""
        require_target(target, box)
        draft = self._until_draft(target, edge, speed_mm_s)
        on = SoftMotionIo(self._mailbox).read_input(edge.number)
        edge.require_ahead(on, controller=self._mailbox.identity, request=describe(draft))
        return SoftMotionMotionUntilInput(self._start(target, draft), self._mailbox)

    def requests_until(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float
    ) -> tuple[str, ...]:
        """Return what :meth:`move_until_input` would send besides its reads, in words."""
        return (describe(self._until_draft(target, edge, speed_mm_s)),)

    def run_up_mm(self, speed_mm_s: float) -> float:
        """Return the distance of the acceleration and jerk of such a movement."""
        return run_up_mm(speed_mm_s, self._stated_mm_s2)

    def movement_times(self, stated: JointRates | None = None) -> "SoftMotionTimes":
        """Return what tells how long movements will take.

        Args:
            stated: How fast the axes are at 100 %, by the cell file; ``None`` where nobody says it.
        """
        now = self._mailbox.snapshots.take()
        blocks = (block_name(now.position_kinematics), block_name(now.orientation_kinematics))
        return SoftMotionTimes("+".join(filter(None, blocks)), stated, self._stated_mm_s2)

    def edge_step_mm(self, speed_mm_s: float) -> float:
        """Return how far it goes in a cycle: the PLC notes an edge once a cycle."""
        return speed_mm_s * LATCH_CYCLE_S

    def jog(self, jog: Jog, *, duration_s: float, box: WorkBox) -> Pose:
        """Jog for a time, stop the group, and return where the tip is then.

        Raises:
            LimitError: The tip came out of the box; the jog was ended there.
            OutcomeUnknownError: An earlier job is unfinished, or no answer came.
        """
        watch = JogWatch(self._mailbox, jog, box, self._require_startable)
        with self._mailbox.lock.held(watch.request):
            self._prepare(watch.draft, watch.request, self._require_startable)
            return watch.run(duration_s)

    def stop(self) -> None:
        """Stop and stay stopped; from any thread, at any time, more than once.

        Until ``release_stop`` nothing acts from here, and until ``reset_fault`` nothing moves.

        Raises:
            OutcomeUnknownError: The group did not come to rest in time.
        """
        with self._mailbox.latch.stopping():
            self._mailbox.commands.bring_to_rest()

    def halt(self) -> None:
        """Stop the group, ending every movement; it may be moved again at once."""
        self._mailbox.commands.carry_out(Command(0, Opcode.HALT))

    def interrupt(self) -> None:
        """Pause the movement on its path; :meth:`resume` continues it."""
        self._mailbox.commands.carry_out(Command(0, Opcode.INTERRUPT))

    def resume(self) -> None:
        """Continue the interrupted movement; somebody must be waiting on it.

        Raises:
            OutcomeUnknownError: An earlier job is unfinished, or no answer came.
        """
        draft = Command(0, Opcode.CONTINUE)
        request = describe(draft)
        mailbox = self._mailbox
        with mailbox.asked(request):
            require_beats(mailbox.wire.whole_look_s)
            self._require_settled(request)
            mailbox.prepare(draft, request)
            with mailbox.markers.doubt(request):
                mailbox.commands.carry_out(draft)

    def abort_unfinished(self) -> None:
        """Halt what was sent here and whose end was not seen."""
        for motion in self._current:
            if not motion.settled:
                motion.abort()

    @property
    def _just_at_rest(self) -> Response | None:
        """The snapshot that showed the rest after our last movement, if it is the last of all."""
        rest = self._current[-1].rest if self._current else None
        known = self._mailbox.snapshots.of_this_step()
        return rest if rest is known and known is not None and not is_moving(known) else None

    def _start(self, target: Pose, draft: Command) -> SoftMotionMotion:
        """Start a movement inside the limits; see the model."""
        mailbox, request = self._mailbox, describe(draft)

        def require(now: Response) -> None:
            self._require_startable(now)
            require_tool_known(now)
            self._require_tool(target, now.tool_slot)

        try:
            with mailbox.lock.held(request):
                mailbox.wire.motions.require_room(request)
                now = self._prepare(draft, request, require)
                with mailbox.uninterrupted():
                    motion = self._started(target, draft, require, selected=now.tool_slot)
                    self._current = [*(m for m in self._current if not m.settled), motion]
                return motion
        except (KeyboardInterrupt, StoppedError):
            # The caller gets no motion object to wait on.
            self.abort_unfinished()
            raise

    def _started(
        self, target: Pose, draft: Command, require: Require, *, selected: int
    ) -> SoftMotionMotion:
        mailbox, request = self._mailbox, describe(draft)
        marker = self._marked(target, request, selected=selected)
        in_doubt = partial(mailbox.markers.doubt, request)
        queued = mailbox.wire.motions.going
        try:
            command, now = mailbox.commands.start(draft, require, in_doubt)
        except (
            ControllerError,
            ConfigError,
            StoppedError,
            KeyboardInterrupt,
            TransportError,
            RemoteProtocolError,
        ):
            mailbox.markers.clear(marker)  # it was not sent, or was refused
            raise
        return SoftMotionMotion(target, command, marker, mailbox, accepted=now, queued=queued)

    def _prepare(self, draft: Command, request: str, require: Require) -> Response:
        """Refuse early what may not start now, and own the mailbox; return what was looked at.

        It spares a marker, and allows nothing: what is required is required again of the snapshot
        just before the block (``CommandSender``). So the snapshot of this step will do, but for a
        refusal, which needs a new one.

        Raises:
            ConfigError: The line is too slow for any movement.
            NotReadyError: The group, its drives, the machine or another movement forbid it.
            OutcomeUnknownError: An earlier job is unfinished.
            LeaseHeldError, LeaseLostError: Another client owns the mailbox.
        """
        mailbox = self._mailbox
        require_beats(mailbox.wire.whole_look_s)
        self._require_settled(request)
        known = mailbox.snapshots.of_this_step()
        if known is not None and mailbox.wire.epoch:
            with suppress(NotReadyError):
                require(known)
                return known
        now = mailbox.prepare(draft, request)
        require(now)
        return now

    def _require_startable(self, now: Response) -> None:
        """Refuse a movement or jog that the state of the machine forbids.

        Raises:
            NotReadyError: The group, its drives, the machine or another movement forbid it.
        """
        require_permit(now)
        require_enabled(now)
        require_power(now)
        if not self._mailbox.wire.motions.going:
            require_still(now)

    def _require_settled(self, request: str) -> None:
        """Refuse ``request``, before the mailbox is taken, while a job is unfinished."""
        # Markers of our own movements under way do not count; an earlier open marker would have
        # prevented the first of these movements.
        if not self._mailbox.wire.motions.unread:
            self._mailbox.markers.require_settled(request)

    def _move_draft(self, target: Pose, profile: MotionProfile) -> Command:
        joint = profile.path is Path.JOINT
        return Command(
            0,
            Opcode.MOVE_DIRECT if joint else Opcode.MOVE_LINEAR,
            operands=(0, 0, CoordinateSystem.MCS, BufferMode.BUFFERED),
            pose=self._frame(target),
            dynamics=dynamics_of(
                profile, unit_um=self._mailbox.unit_um, acceleration_mm_s2=self._stated_mm_s2
            ),
        )

    def _until_draft(self, target: Pose, edge: InputEdge, speed_mm_s: float) -> Command:
        if edge.number < 1:
            raise ConfigError(
                tr("There is no input {number}.", number=edge.number),
                remedy=tr("The PLC's inputs count from 1."),
            )
        signed = -edge.number if edge.falling else edge.number
        return Command(
            0,
            Opcode.MOVE_UNTIL_INPUT,
            operands=(signed, int(edge.run_on), CoordinateSystem.MCS, BufferMode.BUFFERED),
            pose=self._frame(target),
            dynamics=up_to_an_edge(
                speed_mm_s, unit_um=self._mailbox.unit_um, acceleration_mm_s2=self._stated_mm_s2
            ),
        )

    def _frame(self, target: Pose) -> Six:
        if target.local:
            raise ConfigError(
                tr("The target is in local {local}; a PLC has no locals.", local=target.local),
                remedy=tr("Give it in the base frame."),
            )
        if not all(map(math.isfinite, target.coordinates())):
            raise ConfigError(
                tr("The target holds something that is not a number."),
                remedy=tr("Give finite decimal numbers."),
            )
        return to_frame(target.coordinates(), unit_um=self._mailbox.unit_um)

    def _switch(self, opcode: Opcode, *, enabled: bool) -> None:
        mailbox, draft = self._mailbox, Command(0, opcode)
        request = describe(draft)
        with mailbox.lock.held(request, calming=not enabled, leased=False):
            if self.motors_on() is enabled:
                return
            now = mailbox.prepare(draft, request)
            require_still(now)
            mailbox.commands.carry_out(draft)
            if self.motors_on() is not enabled:
                raise ReadBackError(
                    tr("The axis group did not change its state."),
                    remedy=tr("Nothing was repeated. Look at the PLC."),
                )


_AXES_OF_FLANGE: Final = {
    "Kin_Gantry3": (0, 1, 2),
    "Kin_Gantry3+Kin_CAxis": (0, 1, 2, 3),
    "Kin_5Axes": (0, 1, 2, 3, 4),
}
"""By kinematics: which coordinate of the flange each axis moves (docs/reference/softmotion.md 3.3).

The inclination of Kin_5Axes moves X, Y and Z too, by its dToolLength, which the mailbox does not
report; those axes are not the ones that take longest then."""

_REPORTED_AFTER_S: Final = 0.014
"""Time in s by which a movement is longer than its profile: a PLC begins it in its next cycle, and
reports the end two cycles later, of 4 ms each."""

_SEEN_AFTER_S: Final = 0.03
"""The same for one whose end is not known beforehand, and is looked for less often."""


@dataclass(frozen=True, slots=True)
class SoftMotionTimes:
    """Implements :class:`robolink.controllers.MovementTimes`.

    Attributes:
        kinematics: Names of its blocks.
        rates: How fast the axes are at 100 %; ``None`` where nobody says it.
        acceleration_mm_s2: Highest acceleration of straight movements, where the cell states one.
    """

    kinematics: str
    rates: JointRates | None
    acceleration_mm_s2: int | None = None

    @property
    def answers(self) -> AnswerCounts:
        """For how many answers each is waited for: snapshots, blocks, and looks at the end."""
        return AnswerCounts(run=40.0, tool=50.0, select=4.0, move=2.8, search=3.5)

    def move_s(self, way: Way) -> float | None:
        """Return the seconds of a movement; see :class:`robolink.controllers.MovementTimes`."""
        if way.profile.path is Path.STRAIGHT:
            return self._straight_s(way, up_to_edge=False)
        moved = _AXES_OF_FLANGE.get(self.kinematics)
        if moved is None or self.rates is None:
            return None
        before, after = way.start.coordinates(), way.end.coordinates()
        deltas = [after[n] - before[n] for n in moved]
        share = way.profile.speed_percent / 100
        seconds = self.rates.takes_s(deltas, share, share)
        return None if seconds is None else seconds + _SEEN_AFTER_S

    def search_s(self, way: Way) -> float | None:
        """Return those of one that an input ends, which brakes harder."""
        return self._straight_s(way, up_to_edge=True)

    def _straight_s(self, way: Way, *, up_to_edge: bool) -> float | None:
        if not way.length_mm and way.turn_deg:
            return None  # it is as fast as the axes
        numbers = up_to_an_edge if up_to_edge else straight
        speed, rise, fall, _ = numbers(
            way.profile.speed_mm_s,
            unit_um=_UM_PER_MM,
            acceleration_mm_s2=self.acceleration_mm_s2,
        )
        return ramped_s(way.length_mm, speed, rise, fall) + _REPORTED_AFTER_S


_UM_PER_MM: Final = 1000.0
