"""How long the robot and its controller take in a run, without the time of a person.

While a person is asked, and jogs, the time is the person's. All movements of a run and all its
questions pass the runner, so it is counted there and nowhere else. With it are
counted the answers of the controller that were waited for, so that a run can be foreseen for one
that answers faster or slower than it did then.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from robolink.calibration import tip_pose
from robolink.model import Controller, Path, Pose, ToolOffset, angle_difference_deg
from robolink.timing import NS_PER_S

_LAST_LOOK: Final = 3
"""Largest number of answers that a look at a movement waits for."""


@dataclass(frozen=True, slots=True)
class TimedMove:
    """A movement, and how long it took.

    Attributes:
        path: How the frame went.
        length_mm: How far.
        turn_deg: By how much it turned.
        seconds: How long its end was awaited.
    """

    path: Path
    length_mm: float
    turn_deg: float
    seconds: float


@dataclass(slots=True)
class TimeShare:
    """A part of the time of a run.

    Attributes:
        seconds: How long it took.
        answers: For how many answers of the controller it waited.
    """

    seconds: float = 0.0
    answers: float = 0.0


def way_between(start: Pose, target: Pose) -> tuple[float, float]:
    """Return how far apart two poses of a frame are, in mm and in degrees.

    Args:
        start: Where the frame is.
        target: Where it goes.

    Example:
        >>> from robolink.model import Pose
        >>> from robolink.runner import way_between
        >>> way_between(Pose(300, 100, -60, 170), Pose(303, 104, -60, -170))
        (5.0, 20.0)
    """
    here, there = start.coordinates(), target.coordinates()
    turns = (angle_difference_deg(a, b) for a, b in zip(here[3:], there[3:], strict=True))
    return math.dist(here[:3], there[:3]), max(map(abs, turns))


class RobotTime:
    """Counts the time of one run. For one thread.

    Args:
        controller: For its clock and its requests.
        start: Flange pose where the run begins, to which the robot goes from wherever it was left;
            ``None`` where it begins there.

    Attributes:
        work: The robot's time from its start to its end.
        journey: The robot's time on its way to the start.
        moves: The movements whose length is known, without those of a person.
        movements: How many there were in all.
        stands: Where the frame in force is, as read last.
        usual: Whether nothing was done that another run would not do: no measurement was repeated,
            and no offer was accepted.

    Example:
        >>> from robolink.controllers import SimpleController
        >>> from robolink.runner import RobotTime
        >>> time = RobotTime(SimpleController())
        >>> with time.person():
        ...     pass  # whatever happens here does not count
        >>> with time.counted():
        ...     pass
        >>> time.work.answers, time.usual
        (0.0, True)
    """

    def __init__(self, controller: Controller, start: Pose | None = None) -> None:
        self._controller = controller
        self._start, self._set_out = start, False
        self.work, self.journey, self._other = TimeShare(), TimeShare(), TimeShare()
        self.moves: list[TimedMove] = []
        self.movements = 0
        self.usual = True
        self._share = self._other
        self.stands: Pose | None = None
        self._seen_ns, self._seen = controller.clock.now_ns(), self._waited

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count the time of the block as the robot's."""
        with self._counting(self.work):
            yield

    @contextmanager
    def person(self) -> Iterator[None]:
        """Leave out the block: a person is asked, or jogs."""
        with self._counting(self._other):
            yield

    @contextmanager
    def journey_to(self, pose: Pose) -> Iterator[None]:
        """Count a way apart if it is the one to the start.

        Args:
            pose: Where it leads.
        """
        first, self._set_out = not self._set_out and pose == self._start, True
        with self._counting(self.journey if first else self._share):
            yield

    def now_in(self, tool: int, offset: ToolOffset) -> None:
        """Note that what follows moves in the frame of a tool, and no longer the flange.

        Args:
            tool: Its number.
            offset: Its offset.
        """
        if self.stands is not None and self.stands.tool == 0:
            self.stands = tip_pose(self.stands, offset, tool=tool)

    @contextmanager
    def awaiting(self, target: Pose | None = None, path: Path = Path.STRAIGHT) -> Iterator[None]:
        """Count the wait for the end of a movement, without the looks at it.

        Args:
            target: Where the frame goes; ``None`` for a search, which ends on its way.
            path: How.
        """
        self._settle()
        begun_ns, stood, answers = self._seen_ns, self.stands, self._controller.answers
        before = answers.waited if answers else 0
        try:
            yield
        finally:
            # What is asked meanwhile holds nothing up, but for the look that shows the end.
            last = min(_LAST_LOOK, answers.waited - before) if answers else 0
            self._seen = self._waited - last
        self._settle()
        self.movements += self._share is not self._other
        if target is None or stood is None or stood.tool != target.tool:
            return
        if self._share is not self._other:
            length_mm, turn_deg = way_between(stood, target)
            seconds = (self._seen_ns - begun_ns) / NS_PER_S
            self.moves.append(TimedMove(path, length_mm, turn_deg, seconds))

    @property
    def seconds(self) -> float:
        """How long the robot took in all."""
        return self.journey.seconds + self.work.seconds

    def unusual(self) -> None:
        """Note that something was repeated, or done in addition."""
        self.usual = False

    @contextmanager
    def _counting(self, share: TimeShare) -> Iterator[None]:
        self._settle()
        before = self._share
        # What a person does stays the person's, whatever is done for it.
        self._share = share if before is not self._other or share is self.work else before
        try:
            yield
        finally:
            self._settle()
            self._share = before

    @property
    def _waited(self) -> float:
        """For how many answers it waited so far.

        What is asked between the beginning of a movement and the wait for its end holds up a short
        movement, and not a long one: half of it counts.
        """
        answers = self._controller.answers
        return 0.0 if answers is None else answers.waited + answers.moving / 2

    def _settle(self) -> None:
        """Add what has passed since it was looked at last."""
        now_ns, now = self._controller.clock.now_ns(), self._waited
        self._share.seconds += (now_ns - self._seen_ns) / NS_PER_S
        self._share.answers += now - self._seen
        self._seen_ns, self._seen = now_ns, now
