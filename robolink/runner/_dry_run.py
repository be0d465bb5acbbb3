"""Walks through a procedure without motion: its movements, and what blocks the arm."""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from itertools import repeat, starmap
from typing import TypeVar

from robolink.calibration import tip_pose
from robolink.errors import CalibrationError, LimitError
from robolink.messages import tr
from robolink.model import Controller, MotionGroup, Path, Pose, Spot, SpotUnit, ToolOffset
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
)

OptionT = TypeVar("OptionT")


@dataclass(frozen=True, slots=True)
class ForeseenStep:
    """A step of a procedure that was not taken.

    Attributes:
        step: Which.
        start: Where the frame is before it.
        known: Whether that is so; else a person brings the tip somewhere before, and it is taken
            to stay where it is.
    """

    step: Ask | Move | Seek | Look
    start: Pose
    known: bool

    @property
    def move(self) -> Move | None:
        """The movement, of a search too; ``None`` for a step that moves nothing itself."""
        step = self.step
        if isinstance(step, Seek):
            return Move(step.target, Path.STRAIGHT, step.purpose)
        return step if isinstance(step, Move) else None


def nothing_in_the_way(step: Consider, *, known: bool) -> tuple[str, ...]:  # noqa: ARG001 - the form of an answer
    """Answer that nothing is known to block any of the movements."""
    return ("",) * len(step.moves)


def foreseen_steps(
    procedure: Procedure[object],
    here: Pose,
    *,
    known: bool = True,
    consider: Callable[..., tuple[str, ...]] = nothing_in_the_way,
) -> Generator[ForeseenStep, None, tuple[Pose, bool]]:
    """Yield the steps of a procedure; return where they lead, and whether that is known.

    Args:
        procedure: What is followed; it is used up.
        here: Where the frame is.
        known: Whether that is so.
        consider: Answers what the procedure wants to know about movements.

    Raises:
        CalibrationError: It refuses before its first step.
        LimitError: It finds no way.

    Example:
        >>> from robolink.methods import measure_two_pose
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.runner import foreseen_steps
        >>> course = measure_two_pose(TouchPlan(nominal=True), stored=ToolOffset(12, -4, -20))
        >>> [type(one.step).__name__ for one in foreseen_steps(course, Pose(298, 99, -20, 0))]
        ['Ask', 'Move', 'Move', 'Move', 'Ask', 'Move']
    """
    try:
        step = next(procedure)
    except StopIteration:
        return here, known
    try:
        while True:
            if isinstance(step, (Notify, Confirm)):
                # The content depends on poses that nobody took.
                step = procedure.send(None)
                continue
            if isinstance(step, Consider):
                step = procedure.send(consider(step, known=known))
                continue
            yield ForeseenStep(step, here, known)
            answer = here
            if isinstance(step, Ask):
                known = known and step.foreseen is not None
                answer = here = step.foreseen or here
            elif isinstance(step, Look):
                answer = SeenAt.of(here, Spot(*step.expected_mm), SpotUnit.BASE_MM)
            else:
                answer = here = step.target
            step = procedure.send(answer)
    except (StopIteration, CalibrationError):
        # The poses are predicted, so a result from them means nothing.
        return here, known


def considered(step: Consider) -> Iterator[tuple[Move, Pose | None]]:
    """Yield each movement with its start."""
    yield from zip(step.moves, step.starts or repeat(None), strict=False)


def first_clear(
    options: Sequence[OptionT],
    steps: Callable[[OptionT], Procedure[object]],
    here: Pose,
) -> Procedure[OptionT]:
    """Return the first option whose movements are all possible. Nothing moves.

    Args:
        options: What there is to choose from, the best first.
        steps: Makes the steps of an option, to be followed on paper.
        here: Where the frame is.

    Raises:
        LimitError: None can; says why of the first.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import approach_path
        >>> from robolink.runner import first_clear
        >>> from robolink.testing import PaperCell
        >>> here = Pose(300, 100, 0, 0)
        >>> options = [Pose(310, 95, 0, 170), Pose(310, 95, 0, -170)]
        >>> def steps(target):
        ...     return approach_path(target, here=here, purpose="Turning.")
        >>> cell = PaperCell(here, ToolOffset())  # nothing is in the way there
        >>> cell.run(first_clear(options, steps, here)).u_deg
        170
    """
    refusals = list[tuple[Move, str]]()
    for option in options:
        foreseen = [one for one in foreseen_steps(steps(option), here) if one.move is not None]
        moves = tuple(one.move for one in foreseen if one.move is not None)
        told: tuple[str, ...] = yield Consider(moves, tuple(one.start for one in foreseen))
        in_the_way = zip(moves, told, strict=True)
        refusal = next(((move, why) for move, why in in_the_way if why), None)
        if refusal is None:
            if refusals:
                yield Notify(tr("The robot takes a different path: {why}", why=refusals[0][1]))
            return option
        refusals.append(refusal)
    move, why = refusals[0]
    raise LimitError(
        tr("{step} {refusal} Nothing moved for it.", step=move.purpose, refusal=why),
        remedy=tr(
            "Tilt or turn the tool another way at the first place, or put the "
            "reference point where the arm has room and stays away from its singular "
            "places."
        ),
    )


@dataclass(frozen=True, slots=True)
class ArmAhead:
    """An arm's answer about future movements of its flange.

    Attributes:
        group: The arm.
        tool: The selected tool now, for which its controller answers.
        selected: Its offset.
    """

    group: MotionGroup
    tool: int
    selected: ToolOffset | None

    @classmethod
    def of(cls, controller: Controller) -> "ArmAhead":
        """Return the arm of a controller, with the selected tool."""
        group = controller.groups[0]
        tool = group.pose().tool or 0
        return cls(group, tool, controller.tools.read(tool) if tool else None)

    def considered(self, step: Consider, *, known: bool) -> tuple[str, ...]:
        """Answer a procedure's question; nothing if its places are unknown."""
        # It is unknown where a person will have jogged the tip, and so is what is in the way.
        if not known:
            return nothing_in_the_way(step, known=known)
        return tuple(starmap(self.obstacle, considered(step)))

    def obstacle(self, move: Move, start: Pose | None) -> str:
        """Return why the arm cannot make a movement of the flange, empty if it can."""
        begin = None if start is None else self.tip(start)
        return self.group.obstacle(self.tip(move.target), move.path, start=begin)

    def tip(self, flange: Pose) -> Pose:
        """Return where the frame of the selected tool is with the flange at a pose.

        Args:
            flange: That pose.
        """
        if self.selected is None:
            return flange
        return tip_pose(flange, self.selected, tool=self.tool)
