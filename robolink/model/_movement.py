"""Movements, the limits inside which they are allowed, and the inputs at which some end."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import Final, Protocol

from robolink.errors import ConfigError, LimitError, NotReadyError, NotReadyReason
from robolink.messages import tr
from robolink.model._geometry import Pose, require_numbers

_LIMITS: Final = ("x_min_mm", "x_max_mm", "y_min_mm", "y_max_mm", "z_min_mm", "z_max_mm")


@dataclass(frozen=True, slots=True)
class InputEdge:
    """What a movement waits for.

    Attributes:
        number: The input as its controller counts: from 0 on an EPSON controller, from 1 in a
            PLC's mailbox.
        falling: Whether it is to go off, not on.
        run_on: Whether the movement continues to its target after the edge.
    """

    number: int
    falling: bool = False
    run_on: bool = False

    def awaited(self, on: bool) -> bool:
        """Return whether an input that is ``on`` shows what the movement waits for."""
        return on is not self.falling

    def require_ahead(self, on: bool, *, controller: str, request: str) -> None:
        """Refuse an input that already shows what the movement waits for.

        An EPSON controller would treat such a movement as finished at once, and a PLC would drive
        on to the target, the tip perhaps in contact (docs/reference/spel.md 7.1,
        docs/reference/mailbox.md).

        Args:
            on: Whether the input is on before the movement begins.
            controller: The controller, for the error.
            request: The request, for the error.

        Raises:
            NotReadyError: Names the input.

        Example:
            >>> from robolink.model import InputEdge
            >>> InputEdge(3).require_ahead(False, controller="cell-a", request="move until input 3")
        """
        if self.awaited(on):
            raise NotReadyError(
                tr(
                    "Input {number} is {state} before the movement begins.",
                    number=self.number,
                    state=tr("on") if on else tr("off"),
                ),
                reason=NotReadyReason.EDGE_PASSED,
                remedy=tr(
                    "Nothing moved. Check the number of the input, clean the sensor, and "
                    "move the tip away from it."
                ),
                controller=controller,
                request=request,
            )


class MotionUntilInput(Protocol):
    """A straight movement until an input switches, under way. Someone must wait on it."""

    def wait(self, *, timeout_s: float) -> Pose | None:
        """Wait for the end and return where the tip was at the edge.

        Returns:
            ``None`` when the input did not switch on the way; the movement has then arrived.
            A controller that cannot latch the place reads it at rest just past the edge: both
            edges of a beam, and both directions, are then late by the same amount.

        Raises:
            StoppedError: It was stopped before.
            ControllerFaultError: The controller went into error.
            OutcomeUnknownError: The link fell silent; the movement may go on.
            MotionTimeoutError: It did not end in time and was aborted.
        """


class Path(StrEnum):
    """How the robot moves to a target."""

    JOINT = "joint"
    STRAIGHT = "straight"


@dataclass(frozen=True, slots=True)
class MotionProfile:
    """How fast to move. Power is always low.

    ``speed_percent`` rules joint moves, ``speed_mm_s`` straight ones; it is read before each move,
    and set where it differs.

    Raises:
        ConfigError: There is no such path, or a speed is no number.
    """

    path: Path = Path.JOINT
    speed_percent: int = 5
    speed_mm_s: float = 20.0

    def __post_init__(self) -> None:
        if type(self.path) is not Path:  # a plain string would count as the other path
            try:
                object.__setattr__(self, "path", Path(self.path))
            except ValueError:
                raise ConfigError(
                    tr("There is no path {given!r}.", given=self.path),
                    remedy=tr("Nothing moved. Give Path.JOINT or Path.STRAIGHT."),
                ) from None
        require_numbers(self, "speed_percent", "speed_mm_s")


@dataclass(frozen=True, slots=True)
class WorkBox:
    """The box that no target may leave, in base coordinates of the frame that moves.

    A plan defines it around the start place of the frame (:meth:`reaching`), and moves it there
    once that place is known (:meth:`about`).

    Raises:
        ConfigError: A limit is no number.
    """

    x_min_mm: float = -math.inf
    x_max_mm: float = math.inf
    y_min_mm: float = -math.inf
    y_max_mm: float = math.inf
    z_min_mm: float = -math.inf
    z_max_mm: float = math.inf

    def __post_init__(self) -> None:
        require_numbers(self, *_LIMITS)

    @classmethod
    def reaching(cls, sideways_mm: float, *, down_mm: float, up_mm: float) -> "WorkBox":
        """Return the box that reaches so far from a place that is not yet known.

        Args:
            sideways_mm: In X and Y, to either side.
            down_mm: Below the place.
            up_mm: Above it.

        Example:
            >>> from robolink.model import WorkBox
            >>> box = WorkBox.reaching(30, down_mm=2, up_mm=50)
            >>> box.height_mm, box.x_max_mm
            (52, 30)
        """
        return cls(-sideways_mm, sideways_mm, -sideways_mm, sideways_mm, -down_mm, up_mm)

    @classmethod
    def around(cls, pose: Pose, *, xy_mm: float, below_mm: float, above_mm: float) -> "WorkBox":
        """Return the box that reaches ``xy_mm`` sideways, down and up from ``pose``.

        Args:
            pose: The place in its middle.
            xy_mm: Reach in X and Y, to either side.
            below_mm: Reach below the place.
            above_mm: Reach above it.

        Example:
            >>> from robolink import Pose
            >>> from robolink.model import WorkBox
            >>> box = WorkBox.around(Pose(300, 100, -60, 0), xy_mm=30, below_mm=2, above_mm=50)
            >>> box.x_max_mm, box.z_min_mm
            (330, -62)
        """
        return cls.reaching(xy_mm, down_mm=below_mm, up_mm=above_mm).about(pose)

    @property
    def height_mm(self) -> float:
        """How far it reaches from its lowest to its highest place."""
        return self.z_max_mm - self.z_min_mm

    def about(self, pose: Pose) -> "WorkBox":
        """Return the same box about a place; so far it had none."""
        return WorkBox(
            pose.x_mm + self.x_min_mm,
            pose.x_mm + self.x_max_mm,
            pose.y_mm + self.y_min_mm,
            pose.y_mm + self.y_max_mm,
            pose.z_mm + self.z_min_mm,
            pose.z_mm + self.z_max_mm,
        )

    def larger(self, *, sideways_mm: float = 0.0, up_mm: float = 0.0) -> "WorkBox":
        """Return the box enlarged by so much, to all sides and up."""
        return WorkBox(
            self.x_min_mm - sideways_mm,
            self.x_max_mm + sideways_mm,
            self.y_min_mm - sideways_mm,
            self.y_max_mm + sideways_mm,
            self.z_min_mm,
            self.z_max_mm + up_mm,
        )

    def holds(self, target: Pose) -> bool:
        """Return whether a target lies inside."""
        return (
            self.x_min_mm <= target.x_mm <= self.x_max_mm
            and self.y_min_mm <= target.y_mm <= self.y_max_mm
            and self.z_min_mm <= target.z_mm <= self.z_max_mm
        )

    def check(self, target: Pose) -> None:
        """Refuse a target outside the box.

        Raises:
            ConfigError: It is no pose.
            LimitError: Names the axis, the value and the limit.
        """
        if not isinstance(target, Pose):  # and a pose holds numbers
            raise ConfigError(
                tr("A target is a Pose of numbers, not {given!r}.", given=target),
                remedy=tr("Nothing moved. Write Pose(x, y, z, u), in mm and degrees."),
            )
        if self.holds(target):
            return
        for axis in "xyz":
            value = getattr(target, f"{axis}_mm")
            low, high = getattr(self, f"{axis}_min_mm"), getattr(self, f"{axis}_max_mm")
            if not low <= value <= high:
                raise LimitError(
                    tr(
                        "{axis} {value:.3f} would leave the allowed area ({low:.3f} to "
                        "{high:.3f} mm). Nothing moved.",
                        axis=axis.upper(),
                        value=value,
                        low=low,
                        high=high,
                    ),
                    remedy=tr("Jog closer to the pin and start again, or widen the allowed area."),
                )


_USUAL: Final = MotionProfile()


def require_target(target: Pose, box: WorkBox, profile: MotionProfile = _USUAL) -> None:
    """Refuse a movement whose arguments are not what they stand for, or that leaves the box.

    Args:
        target: Where it goes.
        box: What it may not leave.
        profile: How fast it goes, and on which path.

    Raises:
        ConfigError: It names the argument.
        LimitError: The target lies outside.

    Example:
        >>> from robolink import Pose
        >>> from robolink.model import WorkBox, require_target
        >>> require_target(Pose(300, 0, 0, 0), WorkBox(x_max_mm=200))
        Traceback (most recent call last):
        robolink.errors.LimitError: X 300.000 would leave the allowed area (-inf to 200.000 mm). \
Nothing moved. Jog closer to the pin and start again, or widen the allowed area.
    """
    for name, value, kind in (("box", box, WorkBox), ("profile", profile, MotionProfile)):
        if not isinstance(value, kind):
            from robolink.model._arguments import not_of_class

            raise not_of_class(name, value, kind)
    box.check(target)


class MotionOutcome(Enum):
    """How a movement ended."""

    ARRIVED = "arrived"
    STOPPED = "stopped"


class Motion(Protocol):
    """A movement under way. Someone must wait on it."""

    @property
    def target(self) -> Pose:
        """Where it goes."""

    def wait(self, *, timeout_s: float) -> MotionOutcome:
        """Wait for the end; past ``timeout_s`` the movement is aborted.

        Raises:
            ControllerFaultError: The controller went into error, e-stop or guard included.
            OutcomeUnknownError: The link fell silent; the movement may go on.
            TransportTimeoutError: It did not arrive in time and was aborted.
        """


@dataclass(frozen=True, slots=True)
class MotionTerms:
    """What a person must know before an axis group moves.

    Attributes:
        who: What moves, and in which mode, to be followed by "will move".
        watch: What stops it when this computer falls silent, one sentence.
        able: What was checked and allows it to move, as :meth:`MotionGroup.require_able` does;
            empty if this kind of controller reports nothing of it. It is valid also while the
            motors are off.
    """

    who: str
    watch: str
    able: str = ""


class MotionGroup(Protocol):
    """Axes that move together: a robot arm or an axis group."""

    @property
    def name(self) -> str:
        """What a person calls it."""

    def pose(self) -> Pose:
        """Read where the frame of the selected tool is now (measured, not commanded)."""

    def move_to(self, target: Pose, profile: MotionProfile, *, box: WorkBox) -> Motion:
        """Start one movement of the frame ``target.tool``; sent at most once.

        Args:
            target: Where to move the frame ``target.tool``, base, mm and degrees.
            profile: How: path, speed and accelerations.
            box: Where it may go.

        Raises:
            LimitError: The target lies outside ``box``.
            NotReadyError: The state, the motors or the selected tool forbid it.
            OutcomeUnknownError: An earlier command on this controller is not recovered.

        Example:
            >>> import robolink
            >>> from dataclasses import replace
            >>> from robolink.model import MotionProfile, WorkBox
            >>> with robolink.connect("epson+sim://move-example") as controller:
            ...     controller.motors(on=True)
            ...     group = controller.groups[0]
            ...     here = group.pose()
            ...     box = WorkBox.around(here, xy_mm=5, below_mm=5, above_mm=5)
            ...     up = replace(here, z_mm=here.z_mm + 2)
            ...     motion = group.move_to(up, MotionProfile(), box=box)
            ...     print(motion.wait(timeout_s=30), round(group.pose().z_mm - here.z_mm, 1))
            MotionOutcome.ARRIVED 2.0
        """

    def move_until_input(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float, box: WorkBox
    ) -> MotionUntilInput:
        """Start one straight movement during which the controller watches an input.

        Sent at most once, and not at all if the input already shows what is waited for.

        Args:
            target: Where it ends when the input does not switch.
            edge: The input that ends it.
            speed_mm_s: Speed of the tip.
            box: Where it may go.

        Raises:
            ConfigError: There is no such input or speed.
            LimitError, NotReadyError, OutcomeUnknownError: As :meth:`move_to`.

        Example:
            >>> import robolink
            >>> from dataclasses import replace
            >>> from robolink.model import InputEdge, WorkBox
            >>> with robolink.connect("epson+sim://until-example") as controller:
            ...     controller.motors(on=True)
            ...     group = controller.groups[0]
            ...     here = group.pose()
            ...     box = WorkBox.around(here, xy_mm=5, below_mm=5, above_mm=5)
            ...     target = replace(here, z_mm=here.z_mm - 2)
            ...     motion = group.move_until_input(target, InputEdge(3), speed_mm_s=5, box=box)
            ...     print(motion.wait(timeout_s=30))  # nothing switches input 3 here
            None
        """

    def requests_until(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float
    ) -> tuple[str, ...]:
        """Return what :meth:`move_until_input` would send besides its reads.

        Args:
            target: Where it would end.
            edge: The input that would end it.
            speed_mm_s: Speed of the tip.

        Example:
            >>> import robolink
            >>> from robolink.model import InputEdge
            >>> with robolink.connect("epson+sim://requests-example") as controller:
            ...     group = controller.groups[0]
            ...     requests = group.requests_until(group.pose(), InputEdge(3), speed_mm_s=5)
            >>> any("Till" in request for request in requests)
            True
        """

    def requests_for(self, target: Pose, profile: MotionProfile) -> tuple[str, ...]:
        """Return what :meth:`move_to` would send besides its reads, as sent on the wire."""

    def obstacle(self, target: Pose, path: Path, *, start: Pose | None = None) -> str:
        """Return why the arm could not make this move, a sentence; empty if nothing is known.

        Reads only, and is no promise: it is for a caller that can choose another place, or need not
        begin. The places are those of the selected tool.

        Args:
            target: Where to.
            path: How.
            start: Where from, ``None`` if unknown; then only the end of a straight movement is
                checked.

        Example:
            >>> import robolink
            >>> from robolink.model import Path
            >>> with robolink.connect("epson+sim://obstacle-example") as controller:
            ...     group = controller.groups[0]
            ...     print(repr(group.obstacle(group.pose(), Path.STRAIGHT)))
            ''
        """

    def deceleration_mm_s2(self) -> float | None:
        """Read how it brakes in straight movements, ``None`` if it does not report that.

        With this it stops beyond the edge of an input that ends a movement.
        """

    def run_up_mm(self, speed_mm_s: float) -> float | None:
        """Read the distance in which a movement until an input reaches a speed, and stops from it.

        Args:
            speed_mm_s: The speed.

        Returns:
            The longer of both distances; ``None`` if it does not report them.
        """

    def edge_step_mm(self, speed_mm_s: float) -> float | None:
        """Return the step in which it reports where the edge of an input was, at a speed.

        Args:
            speed_mm_s: The speed.

        Returns:
            The step; ``None`` if unknown.
        """

    def require_able(self, purpose: str) -> None:
        """Refuse if no movement could start now; reads only.

        For a caller that asks a person first: otherwise the person would confirm a clear cell, and
        then read that the motors are off.

        Args:
            purpose: The purpose of the movement, in words.

        Raises:
            NotReadyError: The motors are off, or the state forbids every movement.
        """

    def terms(self) -> MotionTerms:
        """Read what a person must know before it moves."""

    def base(self) -> tuple[float, ...] | None:
        """Read the place of the base, from which positions count.

        Returns:
            X, Y, Z in mm and U, V, W in degrees, seen from the robot; ``None`` if this kind of
            controller reports none.
        """

    def axes(self) -> Mapping[str, tuple[float, ...]]:
        """Read the positions of the axes, by the names of their units."""

    def motors_on(self) -> bool | None:
        """Read whether its motors are on, ``None`` if this kind does not report it."""

    def low_power(self) -> bool | None:
        """Read whether it moves with low power, ``None`` if this kind has no such mode."""

    def stop(self) -> None:
        """Stop it; may be called from any thread, at any time, more than once."""

    def abort_unfinished(self) -> None:
        """End the movements that were started here and whose end nobody has seen."""
