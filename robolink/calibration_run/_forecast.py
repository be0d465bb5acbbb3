"""How long the robot will take for a recipe, said before it starts.

It comes from the last runs of the same recipe by the same robot: how long the robot worked, and for
how many answers of its controller it waited, which are counted at the answer time of now. Only the
way to the start is another one each time: it is calculated from movements of those runs. What no
run has shown is not guessed: it is left out, and that is said.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass
from itertools import islice
from statistics import median
from typing import TYPE_CHECKING, ClassVar, Final, Self

from robolink.calibration_run._plan import ChangePlan
from robolink.calibration_run._preview import PlannedStep
from robolink.controllers import JointRates
from robolink.errors import DocumentError, NotReadyError, RejectedError
from robolink.messages import joined, tr
from robolink.model import (
    Controller,
    EntryKind,
    MotionProfile,
    NewEntry,
    Path,
    Recorded,
    from_json,
    to_json,
)
from robolink.runner import ForeseesMovements, Rehearsal, RehearsedTime, RobotTime, way_between

if TYPE_CHECKING:
    from robolink.recipe import Recipe

_LAST: Final = 3
"""Number of recent runs whose median counts."""

_LOOKED_AT: Final = 60
"""Number of newest runs, of any recipe, among which they are looked for."""

_MOST_MOVES: Final = 60
"""Largest number of movements that a run records: the last ones."""

_ALIKE: Final = 0.1
"""Largest part by which the lengths of two like ways differ."""

_ALIKE_MM: Final = 5.0
"""The same, in mm: another nozzle is measured at another place."""

_ALIKE_DEG: Final = 2.0

_THERE_MM: Final = 0.02
"""Largest length of a way that takes no time but that of its answers, in mm and degrees."""


@dataclass(frozen=True, slots=True)
class Travel:
    """How much a robot moves in what is foreseen of a run.

    Attributes:
        moves: How many movements.
        straight_mm, joint_mm: How far, on straight paths and on others.
        turn_deg: How far it turns.
    """

    moves: int = 0
    straight_mm: float = 0.0
    joint_mm: float = 0.0
    turn_deg: float = 0.0

    @classmethod
    def of(cls, steps: Iterable[PlannedStep]) -> Self:
        """Return that of foreseen steps.

        Args:
            steps: The steps.
        """
        moves, straight_mm, joint_mm, turn_deg = 0, 0.0, 0.0, 0.0
        for step in steps:
            if step.target is None or step.start is None or step.profile is None:
                continue
            length_mm, angle_deg = way_between(step.start, step.target)
            moves, turn_deg = moves + 1, turn_deg + angle_deg
            if step.profile.path is Path.STRAIGHT:
                straight_mm += length_mm
            else:
                joint_mm += length_mm
        return cls(moves, straight_mm, joint_mm, turn_deg)

    def is_like(self, other: "Travel") -> bool:
        """Return whether it differs by no more than another nozzle makes it.

        Args:
            other: Another run's.
        """
        least = (0.0, _ALIKE_MM, _ALIKE_MM, _ALIKE_DEG)
        pairs = zip(astuple(self), astuple(other), least, strict=True)
        return self.moves == other.moves and all(
            abs(a - b) <= max(at_least, _ALIKE * max(a, b)) for a, b, at_least in pairs
        )


Timed = tuple[str, float, float, float]
"""A movement of a run: its path, how far it went in mm, by how much it turned, how long it took."""


@dataclass(frozen=True, slots=True)
class RunTimes:
    """How long the robot took in a run, as the journal has it.

    Attributes:
        mode: What kind of run it was: see :class:`RunForecaster`.
        work: Digest of what the robot does in it.
        speed_percent, speed_mm_s: How fast.
        travel: What was foreseen of it, from its start.
        robot_s: How long the robot took from its start to its end.
        answers: For how many answers it waited in that time.
        answer_s: How long an answer took, ``None`` where nobody knows.
        move_answers: For how many answers it waited with each movement.
        moves: The last movements that were measured.
    """

    mode: str
    work: str
    speed_percent: int
    speed_mm_s: float
    travel: Travel
    robot_s: float
    answers: float
    answer_s: float | None
    move_answers: float
    moves: tuple[Timed, ...]

    @classmethod
    def recorded(cls, entry: Recorded) -> "RunTimes | None":
        """Return what an entry holds; ``None`` for one of another form.

        Args:
            entry: The entry.
        """
        found = entry.details.get("times")
        try:
            return from_json(cls, found) if isinstance(found, dict) else None
        except DocumentError:
            return None

    def at(self, answer_s: float | None) -> float:
        """Return how long the robot takes if the controller answers in another time.

        Args:
            answer_s: That time; ``None`` for the one of then.
        """
        if answer_s is None or self.answer_s is None:
            return self.robot_s
        return max(0.0, self.robot_s + self.answers * (answer_s - self.answer_s))


@dataclass(frozen=True, slots=True)
class Forecast:
    """How long the robot will take.

    Attributes:
        about_s: Seconds from its start to its end, with the way to the start where that is known;
            ``None`` where there is no run like it.
        straight_s: What its straight movements take alone, as far as they are foreseen.
        with_journey: Whether the way to the start is in it.
        runs: How many earlier runs it rests on.
        changed: Whether there are earlier runs of this recipe, but of another form.
        answer_s: How long the controller takes to answer; ``None`` where nobody knows.
        left_out: How many movements are not in it, because nobody knows how fast they are.
    """

    json_version: ClassVar[int] = 2

    about_s: float | None
    straight_s: float
    with_journey: bool
    runs: int
    changed: bool
    answer_s: float | None
    left_out: int = 0

    @property
    def sentence(self) -> str:
        """The same for a person."""
        if self.about_s is not None and self.left_out:
            return tr(
                "The robot needs about {seconds} s, not counting moves of unknown speed ({count}) "
                "and what you do yourself.",
                seconds=_rounded(self.about_s),
                count=self.left_out,
            )
        if self.about_s is not None and self.with_journey:
            return tr(
                "The robot needs about {seconds} s, not counting what you do yourself.",
                seconds=_rounded(self.about_s),
            )
        if self.about_s is not None:
            return tr(
                "The robot needs about {seconds} s, not counting its move to the start and what "
                "you do yourself.",
                seconds=_rounded(self.about_s),
            )
        if self.changed:
            unknown = tr(
                "How long the robot needs is not known: the recipe, its speeds, its places or "
                "robolink itself changed since the last run."
            )
        else:
            unknown = tr("How long the robot needs is not known before the first run of this kind.")
        if self.straight_s < _SHORTEST_S:
            return unknown
        least = tr("Its straight moves alone take {seconds} s.", seconds=_rounded(self.straight_s))
        return joined(" ", (unknown, least))

    def as_json(self) -> dict[str, object]:
        """Return it for a program."""
        about_s, answer_s = self.about_s, self.answer_s
        return {
            "about_s": None if about_s is None else round(about_s, 1),
            "straight_moves_s": round(self.straight_s, 1),
            "with_move_to_start": self.with_journey,
            "earlier_runs": self.runs,
            "moves_left_out": self.left_out,
            "changed": self.changed,
            "answer_ms": None if answer_s is None else round(answer_s * 1000, 1),
        }


def _rounded(seconds: float) -> str:
    return f"{seconds:.0f}" if seconds >= _WHOLE_FROM_S else f"{seconds:.1f}"


@dataclass(frozen=True, slots=True)
class RunForecaster:
    """Foresees a run from earlier ones, and records it for later ones.

    Args:
        controller: The controller; its record is read, and nothing is asked.
        recipe: Name of the recipe.
        mode: What kind of run it is: a change, a reference, a check; with which other sensor.
        work: Digest of what the robot does; see :func:`work_digest`.
        plan: The plan.
        steps: The foreseen steps of the measurement.
        rehearse: Goes through the whole run, where it is not on record.
        rates: How fast the joints are, where the cell file says it.
    """

    controller: Controller
    recipe: str
    mode: str
    work: str
    plan: ChangePlan
    steps: Sequence[PlannedStep]
    rehearse: Callable[[], Rehearsal | None] = lambda: None
    rates: JointRates | None = None

    def forecast(self) -> Forecast | None:
        """Return how long the robot will take; ``None`` where nothing moves.

        Raises:
            JournalError: The record cannot be read.
        """
        if not self.plan.moves:
            return None
        answers = self.controller.answers
        answer_s = answers.median_s if answers else None
        runs = list(islice(self.controller.outcomes.recorded(kinds=(EntryKind.RUN,)), _LOOKED_AT))
        named = [(one.signature.recipe, RunTimes.recorded(one)) for one in runs]
        known = [(name, times) for name, times in named if times is not None]
        same = [times for name, times in known if (name, times.mode) == (self.recipe, self.mode)]
        journey, work = self._parts()
        travel = Travel.of(work)
        alike = [one for one in same if one.work == self.work and one.travel.is_like(travel)]
        about_s, with_journey, left_out = None, False, 0
        last = alike[:_LAST]
        if last:
            about_s = median(one.at(answer_s) for one in last)
            journey_s = self._journey_s(journey, [one for _, one in known], last[0], answer_s)
            with_journey = journey_s is not None
            about_s += journey_s or 0.0
        elif calculated := self._calculated([one for _, one in known]):
            about_s = calculated.seconds + calculated.answers * (answer_s or 0.0)
            with_journey, left_out = True, calculated.left_out
        return Forecast(
            about_s,
            Travel.of(one for one in self.steps if one.edge is None).straight_mm
            / self.plan.limits.speed_mm_s,
            with_journey,
            len(last),
            bool(same and not last),
            answer_s,
            left_out,
        )

    def entry(self, time: RobotTime, change: str) -> NewEntry | None:
        """Return the record of a run that has ended well; ``None`` for one that tells nothing.

        Args:
            time: How long it took.
            change: Id of the change.
        """
        if not (self.plan.moves and time.usual):
            return None
        answers, limits = self.controller.answers, self.plan.limits
        times = RunTimes(
            self.mode,
            self.work,
            limits.speed_percent,
            limits.speed_mm_s,
            Travel.of(self._parts()[1]),
            round(time.work.seconds, 3),
            round(time.work.answers, 1),
            answers.median_s if answers else None,
            round((time.journey.answers + time.work.answers) / max(1, time.movements), 2),
            tuple(
                (
                    str(one.path),
                    round(one.length_mm, 2),
                    round(one.turn_deg, 2),
                    round(one.seconds, 3),
                )
                for one in time.moves[-_MOST_MOVES:]
            ),
        )
        return NewEntry(
            EntryKind.RUN,
            change=change,
            verdict=tr("the robot took {seconds} s", seconds=_rounded(time.seconds)),
            details={"times": to_json(times)},
        )

    def _calculated(self, runs: Sequence[RunTimes]) -> RehearsedTime | None:
        """Return how long the run takes by its movements; ``None`` where nobody can tell."""
        rehearsal = self.rehearse()
        group = self.controller.groups[0] if rehearsal is not None else None
        if rehearsal is None or not isinstance(group, ForeseesMovements):
            return None
        try:
            times = group.movement_times(self.rates)
        except (RejectedError, NotReadyError):
            return None
        limits, moves = self.plan.limits, self._at_these_speeds(runs)
        return rehearsal.takes(
            times,
            MotionProfile(Path.JOINT, limits.speed_percent, limits.speed_mm_s),
            tools=len(self.plan.tools),
            otherwise=lambda path, way: _like_s(moves, path, way, limits.speed_mm_s),
        )

    def _at_these_speeds(self, runs: Sequence[RunTimes]) -> list[Timed]:
        """Return the movements of earlier runs at the speeds of this one."""
        limits = self.plan.limits
        speeds = limits.speed_percent, limits.speed_mm_s
        return [
            move
            for one in runs
            if (one.speed_percent, one.speed_mm_s) == speeds
            for move in one.moves
        ]

    def _parts(self) -> tuple[Sequence[PlannedStep], Sequence[PlannedStep]]:
        """Return the steps of the way to the start, and those from there on."""
        start, steps = self.plan.start, self.steps
        first = next((one.start for one in steps if one.start is not None), None)
        if start is None or first is None or first.coordinates() == start.coordinates():
            return (), steps
        ends = next((k for k, one in enumerate(steps, start=1) if one.target_is(start)), 0)
        return steps[:ends], steps[ends:]

    def _journey_s(
        self,
        journey: Sequence[PlannedStep],
        runs: Sequence[RunTimes],
        last: RunTimes,
        answer_s: float | None,
    ) -> float | None:
        """Return how long the way to the start takes; ``None`` where nobody knows."""
        moves, whole_s = self._at_these_speeds(runs), 0.0
        for step in journey:
            seconds = _move_s(step, moves, self.plan.limits.speed_mm_s)
            if seconds is None:
                return None
            whole_s += seconds + last.move_answers * (answer_s or 0.0)
        return whole_s


def _move_s(step: PlannedStep, moves: Sequence[Timed], speed_mm_s: float) -> float | None:
    """Return how long a movement takes, from others of the same robot at the same speeds."""
    if step.target is None or step.start is None or step.profile is None:
        return 0.0
    return _like_s(moves, step.profile.path, way_between(step.start, step.target), speed_mm_s)


def _like_s(
    moves: Sequence[Timed], path: Path, way: tuple[float, float], speed_mm_s: float
) -> float | None:
    """Return how long a way takes, from the times of others."""
    length_mm, turn_deg = way
    own = [(mm, deg, seconds) for of, mm, deg, seconds in moves if of == path]
    lengths = [(mm, seconds) for mm, deg, seconds in own if deg <= _ALIKE_DEG]
    turns = [(deg, seconds) for _, deg, seconds in own if deg > _ALIKE_DEG]
    along_s = _between(lengths, length_mm, _ALIKE_MM)
    if along_s is None and path is Path.STRAIGHT and lengths:
        longest_mm, seconds = max(lengths)
        along_s = seconds + (length_mm - longest_mm) / speed_mm_s
    around_s = _between(turns, turn_deg, _ALIKE_DEG)
    if around_s is None and path is Path.JOINT:
        around_s = _further(turns, turn_deg)
    if along_s is None and around_s is not None:
        # A way as long that took no longer than this turn shows that the turn takes longer.
        most_s = around_s * (1 + _ALIKE)
        least_mm = length_mm - max(_ALIKE_MM, _ALIKE * length_mm)
        shown = (mm >= least_mm and seconds <= most_s for mm, _, seconds in own)
        along_s = 0.0 if any(shown) else None
    return None if along_s is None or around_s is None else max(along_s, around_s)


def _further(turns: Sequence[tuple[float, float]], turn_deg: float) -> float | None:
    """Return the seconds of a turn beyond the known ones, by how they grow from one to the next.

    Two are needed that differ by half, and none is followed farther than three times the largest.
    """
    if not turns:
        return None
    largest_deg, most_s = max(turns)
    smaller = [one for one in turns if one[0] <= _HALF_OF_IT * largest_deg]
    if not smaller or turn_deg > _FARTHEST_TIMES * largest_deg:
        return None
    smaller_deg, less_s = max(smaller)
    return most_s + (turn_deg - largest_deg) * (most_s - less_s) / (largest_deg - smaller_deg)


_HALF_OF_IT: Final = 0.5
_FARTHEST_TIMES: Final = 3.0


def _between(points: Iterable[tuple[float, float]], at: float, alike: float) -> float | None:
    """Return the seconds at a size between those of two known ones; ``None`` beyond all."""
    if at <= _THERE_MM:
        return 0.0
    below, below_s = 0.0, 0.0
    for size, seconds in sorted(points):
        if size >= at:
            return below_s + (seconds - below_s) * (at - below) / (size - below)
        below, below_s = size, seconds
    return below_s if at - below <= max(alike, _ALIKE * at) and below else None


def work_digest(recipe: "Recipe", plan: ChangePlan, *, version: str) -> str:
    """Return what tells two runs apart whose robot does not do the same.

    Args:
        recipe: The recipe, as its file has it.
        plan: The plan.
        version: Version of robolink: another one may move differently.
    """
    said = [f"{name}={getattr(recipe, name)!r}" for name in sorted(_moves(recipe))]
    said += [version, f"{plan.limits.speed_percent} {plan.limits.speed_mm_s:g}"]
    return hashlib.sha256("\n".join(said).encode()).hexdigest()[:16]


def _moves(recipe: "Recipe") -> Iterator[str]:
    """Yield the fields of a recipe that say what the robot does."""
    yield from (name for name in type(recipe).model_fields if name not in _FOR_PEOPLE)


_FOR_PEOPLE: Final = frozenset({"name", "notes", "cells", "numbers", "accuracy", "prompts"})
"""Fields of a recipe that only people read, or that only judge."""

_WHOLE_FROM_S: Final = 9.95
"""Seconds from which they are shown without a decimal."""

_SHORTEST_S: Final = 0.5
"""Shortest time of the straight moves that is worth a sentence, in s."""
