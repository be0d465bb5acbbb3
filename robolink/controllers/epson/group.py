"""The robot arm of an EPSON controller: where it is, and how to move it."""

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from robolink.controllers.epson.answers import ArmState
from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.movement import (
    EpsonMotion,
    EpsonMotionUntilInput,
    Settings,
)
from robolink.controllers.epson.rest import bring_to_rest
from robolink.controllers.epson.session import executes
from robolink.controllers.epson.singularities import SingularPlaces, read_position
from robolink.controllers.motion_group import MotionGroupCore
from robolink.errors import (
    NotReadyError,
    NotReadyReason,
    StoppedError,
)
from robolink.messages import joined, tr
from robolink.model import (
    InputEdge,
    MotionProfile,
    MotionTerms,
    Path,
    Pose,
    WorkBox,
    require_target,
)
from robolink.protocols import spel
from robolink.remedy_words import RemedyWord, remedy_word

if TYPE_CHECKING:
    from robolink.controllers.epson.arms import EpsonTimes
    from robolink.controllers.movement_time import JointRates

_PRINTED_MM: Final = 0.001
"""Last digit of a printed position, in mm: three decimals (docs/reference/spel.md 5.6)."""


class EpsonGroup(MotionGroupCore):
    """The robot that the controller's Execute acts on.

    Attributes:
        settings: Power, speed and acceleration of this robot.

    Args:
        link: The controller.
        remote_timeout_s: The remote time-out set on it, as a person states it.
        acceleration_mm_s2: Highest acceleration of straight movements, where the cell states one.
    """

    def __init__(
        self, link: EpsonLink, *, remote_timeout_s: float, acceleration_mm_s2: int | None = None
    ) -> None:
        super().__init__(link)
        self._link = link
        self.settings = Settings(link, acceleration_mm_s2=acceleration_mm_s2)
        self._remote_timeout_s = remote_timeout_s
        self._current: EpsonMotion | None = None

    @property
    def name(self) -> str:
        """``robot``: the current one of the controller."""
        return "robot"

    def pose(self) -> Pose:
        """Read the measured position of the selected tool (RealPos)."""
        window, query = self._link.window, spel.print_real_position()
        with window.proving_ready(query):
            return read_position(window, query)

    def motors_on(self) -> bool:
        """Read whether the motors are on."""
        (motor,) = self._link.window.printed_numbers(spel.print_motor())
        return spel.parse_integer(motor) != 0

    def joints(self) -> spel.PrintedWhere:
        """Read the commanded position in all three notations (Where)."""
        window, query = self._link.window, spel.where()
        with window.proving_ready(query):
            return spel.parse_where(window.printed(query))

    def move_to(self, target: Pose, profile: MotionProfile, *, box: WorkBox) -> EpsonMotion:
        """Start one movement; see :class:`robolink.model.MotionGroup`."""
        require_target(target, box, profile)
        motion, _ = self._start(target, profile, self._statement_for(target, profile))
        return motion

    def move_until_input(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float, box: WorkBox
    ) -> EpsonMotionUntilInput:
        """Start a straight movement until an input switches; see the model."""
        require_target(target, box)
        statement = self._statement_until(target, edge)
        profile = MotionProfile(Path.STRAIGHT, speed_mm_s=speed_mm_s)
        motion, found = self._start(target, profile, statement, edge)
        return EpsonMotionUntilInput(motion, edge, self._link, found.accel_s_mm_s2)

    def requests_until(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float
    ) -> tuple[str, ...]:
        """Return the most that :meth:`move_until_input` would send besides its reads."""
        profile = MotionProfile(Path.STRAIGHT, speed_mm_s=speed_mm_s)
        return executes((*self.settings.statements(profile), self._statement_until(target, edge)))

    def requests_for(self, target: Pose, profile: MotionProfile) -> tuple[str, ...]:
        """Return the most that :meth:`move_to` would send besides its reads, as sent on the wire.

        Power, speed and acceleration are sent only where a look shows that they differ.
        """
        return executes((*self.settings.statements(profile), self._statement_for(target, profile)))

    def obstacle(self, target: Pose, path: Path, *, start: Pose | None = None) -> str:
        """Return why six axes, or an RS, cannot make this move; other arms are not asked."""
        singular = self._singular
        if singular is None:
            return ""
        begin = None if start is None else self._flagged(start)
        return singular.obstacle(self._flagged(target), path, begin)

    def reaches(self, target: Pose) -> bool:
        """Read whether the frame of the selected tool can be somewhere (TargetOK).

        Args:
            target: Where; nothing moves.
        """
        query = spel.print_reachable(self._flagged(target), six_axes=self._six_axes)
        with self._link.window.proving_ready(query):
            return spel.parse_boolean(self._link.window.printed(query))

    def deceleration_mm_s2(self) -> float:
        """Read AccelS, or less where the cell states it: ``Till`` brakes with it.

        Source: docs/reference/spel.md 7.1.
        """
        _, braking_mm_s2 = self.settings.acceleration_mm_s2()
        return braking_mm_s2

    def run_up_mm(self, speed_mm_s: float) -> float:
        """Read AccelS, the less of both, or less where the cell states it.

        Straight movements speed up and brake with it.
        """
        return speed_mm_s**2 / (2 * min(self.settings.acceleration_mm_s2()))

    def movement_times(self, stated: "JointRates | None" = None) -> "EpsonTimes":
        """Read what tells how long movements will take.

        Args:
            stated: How fast the joints are at Speed 100 and Accel 100, by the cell file; ``None``
                for what is known of the robot's model.
        """
        from robolink.controllers.epson.arms.times import read_times  # a stop does without it

        accel_s = self.settings.acceleration_mm_s2()
        return read_times(self._link, accel_s, stated)

    def edge_step_mm(self, speed_mm_s: float) -> float:  # noqa: ARG002 - only the printed digits matter
        """Return the last digit of a position as it is printed."""
        return _PRINTED_MM

    def require_able(self, purpose: str) -> None:
        """Refuse if no movement could start now; see :class:`robolink.model.MotionGroup`."""
        with self._link.asked(purpose):
            self._require_supervision()
            self._link.window.require_ready(purpose)
            _require_motors(self.motors_on())

    def terms(self) -> MotionTerms:
        """Read what a person must know before the robot moves."""
        (number,) = self._link.session.exchange("GetCurRobot").fields
        watch = tr(
            "The controller stops when this PC is silent for {timeout:g} s.",
            timeout=self._remote_timeout_s,
        )
        base = self.base()
        if base is not None and any(base):
            moved = tr(
                "The controller's base (Base) is at {place} in the robot: positions "
                "taught or learnt with another base are somewhere else now.",
                place=" ".join(f"{axis} {at:g}" for axis, at in zip("XYZUVW", base, strict=True)),
            )
            watch = joined(" ", (watch, moved))
        return MotionTerms(
            tr("Robot {number}, in Power Low,", number=spel.parse_integer(number)),
            watch,
            tr("Emergency stop released, guard closed, no program running"),
        )

    def low_power(self) -> bool:
        """Read whether the controller is in Power Low, as for every movement of robolink."""
        return not self.settings.power_high()

    def base(self) -> tuple[float, ...] | None:
        """Read the place of the base, from which positions count.

        Returns:
            X, Y, Z in mm and U, V, W in degrees, seen from the robot; ``None`` where the
            controller shows something else than such numbers.

        Raises:
            RobolinkError: The controller does not take the statement now.
        """
        return spel.parse_base(self._link.window.printed(spel.show_base()))

    def axes(self) -> dict[str, tuple[float, ...]]:
        """Read the commanded joints and pulses."""
        printed = self.joints()
        return {"joints": tuple(printed.joints), "pulses": tuple(printed.pulses)}

    def stop(self) -> None:
        """Stop everything; from here on nothing acts before ``release_stop``.

        Raises:
            RejectedError: The controller takes no Stop from here.
            OutcomeUnknownError: It did not come to rest in time.
        """
        link = self._link
        with link.latch.stopping():
            bring_to_rest(link.session.exchange, link.clock, controller=link.identity)

    def abort_unfinished(self) -> None:
        """Abort the last movement unless its end was seen."""
        if self._current is not None and not self._current.settled:
            self._current.abort()

    def _start(
        self,
        target: Pose,
        profile: MotionProfile,
        statement: spel.Statement,
        edge: InputEdge | None = None,
    ) -> tuple[EpsonMotion, ArmState]:
        """Start a movement, and return it with what the last look before it showed."""
        link, window = self._link, self._link.window
        try:
            with link.lock.held(statement):
                # Checked before anything is set for the movement.
                link.markers.require_settled(statement)
                self._require_supervision()
                with window.proving_ready(statement):
                    found = self.settings.look()
                link.preferences.require_real_motion(statement)
                if edge is not None:
                    link.preferences.require_real_inputs(statement)
                _require_motors(found.motors_on)
                self._require_tool(target, found.tool)
                singular = self._singular
                if singular is not None:
                    singular.require_clear(self._flagged(target), profile.path)
                    found = self.settings.look()
                found = self.settings.slowed(profile, found, edge)
                _require_motors(found.motors_on)
                if edge is not None:
                    on = bool(found.sensed)
                    edge.require_ahead(on, controller=link.identity, request=statement)
                    self.settings.require_as_told(found, statement)
                with link.uninterrupted():
                    self._current = motion = self._started(target, statement, found.tool)
                return motion, found
        except (KeyboardInterrupt, StoppedError):
            # The caller gets no motion object to wait on.
            self.abort_unfinished()
            raise

    def _started(self, target: Pose, statement: spel.Statement, selected: int) -> EpsonMotion:
        session, markers = self._link.session, self._link.markers
        marker = self._marked(target, statement, selected=selected)
        if session.interrupted:
            # Ctrl-C came while the marker was stored: no movement may start after it.
            markers.clear(marker)
            raise KeyboardInterrupt
        with markers.doubt(statement), markers.unless_stopped(marker):
            pending = session.start_execute(statement)
        return EpsonMotion(target, pending, marker, link=self._link)

    def _statement_for(self, target: Pose, profile: MotionProfile) -> spel.Statement:
        build = spel.move if profile.path is Path.STRAIGHT else spel.go
        return build(self._flagged(target), six_axes=self._six_axes)

    def _statement_until(self, target: Pose, edge: InputEdge) -> spel.Statement:
        build = spel.move_find if edge.run_on else spel.move_till
        on, six_axes = not edge.falling, self._six_axes
        return build(self._flagged(target), edge.number, on=on, six_axes=six_axes)

    @property
    def _six_axes(self) -> bool:
        return self._link.robot.read().six_axes

    @property
    def _singular(self) -> SingularPlaces | None:
        """The singular places to avoid, ``None`` for an arm without any."""
        robot = self._link.robot.read()
        if not robot.six_axes and not robot.folds:
            return None
        return SingularPlaces(self._link.window, robot.six_axes)

    def _flagged(self, target: Pose) -> Pose:
        """Return a target of six axes with the present hand, elbow and wrist where it names none.

        Left out, the controller would take its own defaults and might turn the wrist over.
        """
        if not self._six_axes or (target.hand is not None and target.posture is not None):
            return target
        here = self.pose()
        return replace(
            target, hand=target.hand or here.hand, posture=target.posture or here.posture
        )

    def _require_supervision(self) -> None:
        # With a remote time-out of 0 the robot may keep moving after this PC is gone
        # (docs/reference/epson.md 1.1). The value cannot be read over the network; a person states
        # it.
        if self._remote_timeout_s <= 0:
            raise NotReadyError(
                tr("The remote time-out of this controller is stated as 0 (never)."),
                reason=NotReadyReason.NO_REMOTE_TIMEOUT,
                remedy=tr(
                    "Set one on the Remote Ethernet page and state it with {timeout}: without "
                    "it, nothing stops a moving robot when the link is lost.",
                    timeout=remedy_word(RemedyWord.REMOTE_TIMEOUT),
                ),
            )
        self._link.window.require_abort()


def _require_motors(on: bool) -> None:
    if not on:
        raise NotReadyError(
            tr("The motors are off."),
            reason=NotReadyReason.MOTORS_OFF,
            remedy=tr("Run 'robolink robot motors on' when the cell is clear."),
        )
