"""A procedure gone through beforehand, as it will be if the tip is where it is expected.

A preview follows each movement as far as it may go, since that is what limits are held against. How
long a run takes depends on where it will really go: a search ends at its edge, and what follows
depends on that. So here each step is answered with what is expected of it, and the procedure's own
mathematics decides how it continues. Nothing moves, and nobody is asked.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, Protocol, TypeVar, runtime_checkable

from robolink.calibration import flange_of
from robolink.controllers import JointRates, MovementTimes, Way
from robolink.model import Controller, MotionProfile, Path, Pose, Spot, SpotUnit, ToolOffset
from robolink.runner._dry_run import ArmAhead, nothing_in_the_way
from robolink.runner._robot_time import way_between
from robolink.runner._steps import (
    Ask,
    Confirm,
    Consider,
    Look,
    Move,
    Notify,
    Procedure,
    Seek,
    SeenAt,
    Step,
    TouchedAt,
)

T = TypeVar("T")

_ANSWERED_AFTER_S: Final = 4.0
"""Time in s that a person takes: longer than for an answer that was typed ahead. It counts
nowhere."""


class RehearsedKind(StrEnum):
    """What the robot does in a rehearsed step."""

    MOVE = "move"
    SEARCH = "search"
    LOOK = "look"
    SELECT = "select"


@dataclass(frozen=True, slots=True)
class RehearsedStep:
    """A step that the robot or its controller will take by itself.

    Attributes:
        kind: What it is.
        start, end: Where the frame that moves is before and after.
        frame: That frame, seen from the flange.
        path: How it goes.
        speed_mm_s: How fast a search goes; ``None`` for the speed of the run.
        purpose: What for, for a person.
        target: Where it was to go: where a search ends at the latest; ``None`` for no movement.
    """

    kind: RehearsedKind
    start: Pose
    end: Pose
    frame: ToolOffset
    path: Path = Path.STRAIGHT
    speed_mm_s: float | None = None
    purpose: str = ""
    target: Pose | None = None

    @property
    def goes(self) -> bool:
        """Whether the frame moves in it."""
        return self.kind in (RehearsedKind.MOVE, RehearsedKind.SEARCH)

    @property
    def farthest(self) -> Pose:
        """How far the frame may go."""
        return self.target or self.end

    def farthest_flange(self, dx_mm: float = 0.0, dy_mm: float = 0.0) -> Pose:
        """Return where the flange is then.

        Args:
            dx_mm: How far the frame is from its place, along X of the flange.
            dy_mm: The same along Y.
        """
        frame = self.frame
        beside = replace(frame, x_mm=frame.x_mm + dx_mm, y_mm=frame.y_mm + dy_mm)
        return flange_of(self.farthest, beside)

    def way(self, speeds: MotionProfile) -> Way:
        """Return the way of a movement.

        Args:
            speeds: How fast the robot goes in this run.
        """
        length_mm, turn_deg = way_between(self.start, self.end)
        start, end = (flange_of(pose, self.frame) for pose in (self.start, self.end))
        profile = MotionProfile(
            self.path, speeds.speed_percent, self.speed_mm_s or speeds.speed_mm_s
        )
        return Way(length_mm, turn_deg, start, end, profile)


@dataclass(frozen=True, slots=True)
class RehearsedTime:
    """How long the robot and its controller take for rehearsed steps.

    Attributes:
        seconds: All that is known of it, without answers.
        answers: For how many answers the controller is waited for.
        left_out: How many movements are not in it, because nobody knows how fast they are.
    """

    seconds: float
    answers: float
    left_out: int


@runtime_checkable
class TellsReach(Protocol):
    """A group whose controller tells whether the arm gets to a place."""

    def reaches(self, target: Pose) -> bool:
        """Read whether the frame of the selected tool can be there.

        Args:
            target: Where.
        """


@runtime_checkable
class ForeseesMovements(Protocol):
    """A group that tells how long its movements will take."""

    def movement_times(self, stated: JointRates | None = None) -> MovementTimes:
        """Read what tells it.

        Args:
            stated: How fast the joints are, where the cell file says it.
        """


class Rehearsal:
    """Goes through procedures one after the other.

    Args:
        here: Where the flange is.

    Attributes:
        began: Where the flange was at first.
        here: Where the frame that moves is.
        frame: That frame, seen from the flange.
        steps: What the robot will do.
        settle_s: How long is waited before each look of a camera.

    Example:
        >>> from robolink.methods import measure_two_pose
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.runner import Rehearsal
        >>> rehearsal, stored = Rehearsal(Pose(298, 99, -20, 0)), ToolOffset(12, -4, -20)
        >>> found = rehearsal.run(measure_two_pose(TouchPlan(nominal=True), stored=stored))
        >>> round(found.offset.x_mm, 3), [step.path.value for step in rehearsal.steps]
        (12.0, ['straight', 'joint', 'straight', 'straight'])
    """

    def __init__(self, here: Pose) -> None:
        self.here = self.began = here
        self.steps: list[RehearsedStep] = []
        self.settle_s = 0.0
        self.frame = ToolOffset()

    def select(self, here: Pose, frame: ToolOffset) -> None:
        """Let another frame move from now on.

        Args:
            here: Where it is.
            frame: Where it is seen from the flange.
        """
        self.here, self.frame = here, frame
        self.steps.append(RehearsedStep(RehearsedKind.SELECT, here, here, frame))

    def run(
        self,
        procedure: Procedure[T],
        *,
        consider: Callable[..., tuple[str, ...]] = nothing_in_the_way,
    ) -> T:
        """Go through a procedure, and return what it makes of the expected answers.

        Args:
            procedure: What is gone through; it is used up.
            consider: Answers what it wants to know about movements.

        Raises:
            CalibrationError: It makes nothing of them.
            LimitError: It finds no way.
        """
        try:
            step = next(procedure)
            while True:
                step = procedure.send(self._answer(step, consider))
        except StopIteration as finished:
            result: T = finished.value
            return result
        finally:
            procedure.close()

    def takes(
        self,
        times: MovementTimes,
        speeds: MotionProfile,
        *,
        tools: int,
        otherwise: Callable[[Path, tuple[float, float]], float | None] = lambda *_: None,
    ) -> RehearsedTime:
        """Return how long the robot and its controller take for the steps.

        Args:
            times: How long each movement takes.
            speeds: How fast.
            tools: How many tools are measured.
            otherwise: Tells the seconds of what ``times`` does not know, by the path and by how far
                the frame goes, in mm and degrees.

        Example:
            >>> from robolink.controllers.epson.arms import EpsonTimes
            >>> from robolink.model import MotionProfile, Pose
            >>> from robolink.procedures import approach_path
            >>> from robolink.runner import Rehearsal
            >>> rehearsal, above = Rehearsal(Pose(300, 100, 0, 0)), Pose(300, 100, 50, 0)
            >>> rehearsal.run(approach_path(above, here=rehearsal.here, purpose="Lifting."))
            >>> unknown_arm = EpsonTimes((200, 200), (10, 10), 100, None)
            >>> rehearsal.takes(unknown_arm, MotionProfile(speed_mm_s=50), tools=1).seconds
            1.25
        """
        counts = times.answers
        seconds, answers, left_out = 0.0, counts.run + tools * counts.tool, 0
        for step in self.steps:
            if step.kind is RehearsedKind.LOOK:
                seconds, answers = seconds + self.settle_s, answers + 1
                continue
            if step.kind is RehearsedKind.SELECT:
                answers += counts.select
                continue
            way = step.way(speeds)
            if step.kind is RehearsedKind.SEARCH:
                takes_s, answers = times.search_s(way), answers + counts.search
            else:
                takes_s, answers = times.move_s(way), answers + counts.move
                if takes_s is None:
                    takes_s = otherwise(step.path, (way.length_mm, way.turn_deg))
            left_out += takes_s is None
            seconds += takes_s or 0.0
        return RehearsedTime(seconds, answers, left_out)

    @property
    def turning(self) -> list[RehearsedStep]:
        """The movements of the turn tests: those of another frame than the flange."""
        return [step for step in self.steps if step.frame != ToolOffset() and step.goes]

    def beyond_reach(self, controller: Controller, slack_mm: float) -> RehearsedStep | None:
        """Return the first movement of a turn test that the arm cannot make; only reads.

        Args:
            controller: The controller, whose arm is asked; nothing is asked of one that cannot
                tell.
            slack_mm: How far the tip may be beside its place, X and Y of the flange: only if no tip
                on that circle lets the arm make all movements is one returned.
        """
        group, turning = controller.groups[0], self.turning
        if not turning or not isinstance(group, TellsReach):
            return None
        arm, refused, first = ArmAhead.of(controller), list[RehearsedStep](), None
        for dx_mm, dy_mm in _tips_about(slack_mm):
            asked = set[tuple[float, ...]]()
            for step in (*refused, *turning):
                flange = step.farthest_flange(dx_mm, dy_mm)
                place = tuple(round(at, 3) for at in flange.coordinates())
                if place in asked:
                    continue
                asked.add(place)
                if not group.reaches(arm.tip(flange)):
                    # What one tip cannot reach is asked first for the next.
                    refused, first = [step], first or step
                    break
            else:
                return None
        return first

    def _answer(self, step: Step, consider: Callable[..., tuple[str, ...]]) -> object:
        match step:
            case Consider():
                return consider(step, known=True)
            case Notify():
                return None
            case Confirm():
                return False
            case Look():
                self._did(RehearsedKind.LOOK, self.here, step.purpose)
                return SeenAt.of(self.here, *_seen(step))
            case Ask():
                self.here = step.foreseen or self.here
                contact = None if step.contact is None else True
                return TouchedAt.of(self.here, seconds=_ANSWERED_AFTER_S, contact=contact)
            case Move():
                end = step.target
                if step.aside_mm:
                    # Where beside it stops is drawn when it is taken; it is a way of its own.
                    end = replace(end, x_mm=end.x_mm + step.aside_mm)
                self._did(RehearsedKind.MOVE, end, step.purpose, path=step.path, target=step.target)
            case Seek():
                self._did(
                    RehearsedKind.SEARCH,
                    step.expected or step.target,
                    step.purpose,
                    speed_mm_s=step.speed_mm_s,
                    target=step.target,
                )
        return self.here

    def _did(
        self,
        kind: RehearsedKind,
        end: Pose,
        purpose: str,
        *,
        path: Path = Path.STRAIGHT,
        speed_mm_s: float | None = None,
        target: Pose | None = None,
    ) -> None:
        self.steps.append(
            RehearsedStep(kind, self.here, end, self.frame, path, speed_mm_s, purpose, target)
        )
        self.here = end


def _seen(step: Look) -> tuple[Spot, SpotUnit]:
    """Return where a mark is expected to be seen."""
    if not step.in_pixels:
        return Spot(*step.expected_mm), SpotUnit.BASE_MM
    x_mm, y_mm = step.expected_mm
    return Spot(x_mm / _USUAL_MM_PER_PX, y_mm / _USUAL_MM_PER_PX), SpotUnit.PIXEL


_USUAL_MM_PER_PX: Final = 0.02
"""How long a pixel is taken to be before it is measured, in mm; no movement depends on it."""


_DIRECTIONS: Final = 12
"""Number of tips around the expected one for which the arm is asked."""


def _tips_about(by_mm: float) -> Iterator[tuple[float, float]]:
    """Yield by how much a tip may be beside the expected one, which is the first."""
    yield 0.0, 0.0
    for number in range(_DIRECTIONS if by_mm else 0):
        angle = math.tau * number / _DIRECTIONS
        yield by_mm * math.cos(angle), by_mm * math.sin(angle)
