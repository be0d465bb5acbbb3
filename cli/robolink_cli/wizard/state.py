"""The state of a wizard."""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from robolink.calibration_run import ChangeReport, WriteSubject
from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.model import AnsweredBy, Pose
from robolink.runner import (
    FINEST_STEP,
    FitSubject,
    JogRange,
    OfferedChoice,
    Question,
    TouchSubject,
    awaited_line,
)
from robolink_cli.console.language import other_language, speak_from_now
from robolink_cli.prompts.current_desk import AskingDesk
from robolink_cli.prompts.questions import keep_answer
from robolink_cli.wizard.happenings import Reading, WasAsked, WizardCommand

if TYPE_CHECKING:
    from robolink.calibration import Impact


@dataclass(frozen=True, slots=True)
class ChoiceSubject:
    """A list from which one row is chosen.

    Attributes:
        step: What stands at the right of the first row.
        above: What is to be read before.
        options: What there is to choose from.
        marked: Index of the one that is marked first; ``None`` where nothing says which.
        does: What the main key is called.
        leaves: What the stop key is called.
        details: What is to be read of each option while it is marked; empty for nothing.
        enters: Whether ENTER takes the marked row as the main key does; not where a row writes.
        safe: Index of the row that ENTER takes all the same, and an empty line too; ``None`` for
            none.
        other: The language that a key changes to; empty where none does.
    """

    step: str
    above: tuple[str, ...]
    options: tuple[str, ...]
    marked: int | None = 0
    does: str = ""
    leaves: str = ""
    details: tuple[tuple[str, ...], ...] = ()
    enters: bool = True
    safe: int | None = None
    other: str = ""


def subject_of(offered: OfferedChoice) -> ChoiceSubject:
    """Return the list of a person's choices in the work; its first row is safe."""
    return ChoiceSubject(
        offered.title,
        (),
        tuple(row.does for row in offered.rows),
        does=tr("Do it"),
        leaves=offered.rows[0].does,
        details=tuple((row.detail,) for row in offered.rows),
        enters=False,
        safe=0,
    )


CHANGE_LANGUAGE: Final = "language"
"""The answer that switches to the other language."""


def choose_in_either_language(
    desk: AskingDesk, make: Callable[[], tuple[str, ChoiceSubject]], watch: Callable[[], object]
) -> int:
    """Let a person choose, who may switch the language first; return the index.

    Args:
        desk: Where.
        make: Makes the question and the list, in the language that is spoken by then.
        watch: Called while nobody answers.

    Raises:
        DeclinedError: The person leaves.
    """
    while True:
        question, subject = make()
        answer = _answered(desk, question, replace(subject, other=other_language()), watch)
        if answer != CHANGE_LANGUAGE:
            return _index(answer, subject)
        speak_from_now(other_language())


def choose(
    desk: AskingDesk, question: str, subject: ChoiceSubject, watch: Callable[[], object]
) -> int:
    """Let a person choose; return the index.

    Args:
        desk: Where.
        question: What is asked.
        subject: The list.
        watch: Called while nobody answers.

    Raises:
        DeclinedError: The person leaves.
    """
    index = _index(_answered(desk, question, subject, watch), subject)
    keep_answer(question, subject.options[index], AnsweredBy.PERSON)
    return index


def _answered(
    desk: AskingDesk, question: str, subject: ChoiceSubject, watch: Callable[[], object]
) -> str:
    desk.regard(subject)
    desk.ask(question, Question.TEXT)
    return awaited_line(desk, watch)


def _index(answer: str, subject: ChoiceSubject) -> int:
    if answer.isdigit() and 1 <= int(answer) <= len(subject.options):
        return int(answer) - 1
    raise DeclinedError(tr("You left without choosing."), remedy=tr("Nothing was sent."))


STEP_SIZES: Final = (0.01, 0.1, 0.5, 1.0, 5.0)
"""Jog steps in mm, and in degrees for U. The largest is the runner's limit."""

USUAL_SIZE: Final = 1

ARMED_AFTER_S: Final = 0.3
"""Time in seconds for which keys are ignored after a question has appeared: they were meant for the
previous screen.
"""

LEAST_WAY_MM: Final = 0.02
"""Shortest path in mm that counts as a movement: readings of one position differ by less
(docs/reference/evidence.md 1).
"""

_PLACES: Final = frozenset({Question.PLACE, Question.ROOM, Question.ALONG_X, Question.ALONG_Z})


@dataclass(frozen=True, slots=True)
class Jogging:
    """The steps of a person at one place.

    Attributes:
        size: Index of the step size.
        quarters: By how many quarter turns the arrows are turned.
        steps: Steps made since the question.
        longest: The longest part of the last one, mm or degrees.
        ended_s: When it ended.
    """

    size: int = USUAL_SIZE
    quarters: int = 0
    steps: int = 0
    longest: float = 0.0
    ended_s: float = -math.inf

    @property
    def step(self) -> float:
        """The step size."""
        return STEP_SIZES[self.size]

    @property
    def coarse(self) -> bool:
        """Whether the last step was too long to take the place."""
        return self.longest > FINEST_STEP + 1e-9


@dataclass(frozen=True, slots=True)
class Header:
    """The first row of every screen.

    Attributes:
        cell: Name of the cell, or how the controller is reached.
        job: What is done.
        simulated: Whether nothing real moves.
        command: What is typed to begin the same job once more, empty where nobody typed it.
        needle: Id of the needle or nozzle, empty where nobody was asked.
        steps: How many steps the job has that are numbered in that row, 0 for none.
    """

    cell: str
    job: str
    simulated: bool = False
    command: str = ""
    needle: str = ""
    steps: int = 0


@dataclass(frozen=True, slots=True)
class LastScreen:
    """How the work ended, for the last screen.

    Attributes:
        done: Whether it was carried out.
        lines: What the screen says.
        kept: What stays on the terminal when the screen is gone; how every command ends is said
            besides.
        at_s: When.
        headed: Whether it was carried out, stopped, or never begun, as the first row says it.
        again: Whether the job may be begun once more from here.
        blocked: Whether the robot accepts only ``recover``.
    """

    done: bool
    lines: tuple[str, ...]
    kept: tuple[str, ...]
    at_s: float
    headed: str = ""
    again: bool = True
    blocked: bool = False


@dataclass(frozen=True, slots=True)
class WizardState:
    """Everything that a screen shows.

    Attributes:
        header: The first row.
        reading: The controller, as it was read last.
        question: What is asked, ``None`` while the work goes on by itself.
        waits: Whether the work waits for an answer; what is pressed meanwhile is dropped.
        subject: What the question, or the movement under way, is about.
        fit: How well the samples agree, as it was told last.
        checked: Which points of a check list the person has confirmed, by their names.
        carried: Whether the robot has moved by itself: a tip that was not jogged since then stands
            where the robot put it.
        accepted: Whether the person has let the new values be written.
        jogging: The steps made.
        typed: What stands in the field.
        typing: Whether the field of a pose is open at a touch.
        pose_typed: The pose that was typed there, and is taken next; empty for none.
        marked: Index of the marked row of a list, a check list or a question of yes or no.
        remarks: What was told last, oldest first.
        fresh: What of it was told since the last question, so that nobody had a screen to read it.
        heard: What was told before the present question: its screen shows it.
        page: Which part of a longer screen is shown, from 0.
        early_s: When the last key came that was too early for the field, ``-inf`` for none.
        message: The row above the keys.
        ending: Whether the work was told to end.
        impact: What the new value does at taught points, ``None`` where none were named.
        report: What was reached, ``None`` before the end.
        ended: The last screen, ``None`` before it.
        offers: What the last screen offers beside leaving it, where the job was carried out.
        closing: What it says besides how the job ended.
        wants: What the person chose there; ``None`` for leaving, and before.
        asked: Number of the last question, 0 before the first.
        held_back: What keeps the next movement from beginning; empty for nothing.
    """

    header: Header
    reading: Reading | None = None
    question: WasAsked | None = None
    waits: bool = False
    subject: object = None
    fit: FitSubject | None = None
    checked: frozenset[str] = frozenset()
    carried: bool = False
    accepted: bool = False
    jogging: Jogging = field(default_factory=Jogging)
    typed: str = ""
    typing: bool = False
    pose_typed: str = ""
    marked: int | None = None
    remarks: tuple[str, ...] = ()
    fresh: tuple[str, ...] = ()
    heard: tuple[str, ...] = ()
    page: int = 0
    early_s: float = -math.inf
    message: str = ""
    ending: bool = False
    impact: "Impact | None" = None
    report: ChangeReport | None = None
    ended: LastScreen | None = None
    offers: frozenset[WizardCommand] = frozenset()
    closing: tuple[str, ...] = ()
    wants: WizardCommand | None = None
    asked: int = 0
    held_back: str = ""

    def says(self, message: str) -> "WizardState":
        """Return the same with another message."""
        return replace(self, message=message)

    @property
    def screen_number(self) -> int:
        """Number of what can be pressed: of the question, or one more for the last screen."""
        if self.ended is not None:
            return self.asked + 1
        return 0 if self.question is None else self.question.number

    @property
    def at_place(self) -> bool:
        """Whether a person is moving the tip somewhere."""
        return self.question is not None and self.question.kind in _PLACES

    @property
    def touch(self) -> TouchSubject | None:
        """The requested touch."""
        subject = self.subject
        return subject if self.at_place and isinstance(subject, TouchSubject) else None

    @property
    def free_jog(self) -> JogRange | None:
        """The limits of jogging only."""
        subject = self.subject
        return subject if self.at_place and isinstance(subject, JogRange) else None

    @property
    def writing(self) -> WriteSubject | None:
        """The write in question."""
        subject, question = self.subject, self.question
        asks = question is not None and question.kind is Question.YES_NO
        return subject if asks and isinstance(subject, WriteSubject) else None

    @property
    def has_field(self) -> bool:
        """Whether characters go into a field."""
        question = self.question
        if isinstance(self.subject, ChoiceSubject):
            return False
        if self.typing:
            return True
        return self.writing is not None or (question is not None and question.kind is Question.TEXT)

    @property
    def pose(self) -> Pose | None:
        """Where the selected frame is."""
        return None if self.reading is None else self.reading.pose

    @property
    def arrival(self) -> Pose | None:
        """Where the robot was before the person jogged, if that is informative."""
        if self.free_jog is not None:
            return self.free_jog.start
        return None if self.touch is None else self.touch.arrival

    def way_mm(self) -> tuple[float, float, float] | None:
        """Return how far the tip was moved since the robot arrived, base axes."""
        arrival, pose = self.arrival, self.pose
        if arrival is None or pose is None:
            return None
        here, there = pose.coordinates()[:3], arrival.coordinates()[:3]
        return here[0] - there[0], here[1] - there[1], here[2] - there[2]


class Mark(StrEnum):
    """The state of a point of the list."""

    OK = "ok"
    TO_DO = "to do"
    YOU = "you"
    LOOK = "look"
    """Worth knowing, but nothing waits for it."""


@dataclass(frozen=True, slots=True)
class CheckPoint:
    """One point.

    Attributes:
        mark: How it stands.
        text: What it says.
        name: What it is known by while the list is gone through; empty for what is only read.
        does: What the main key does on its row.
    """

    mark: Mark
    text: str
    name: str = ""
    does: str = ""

    def is_open(self, confirmed: Collection[str]) -> bool:
        """Return whether something is still to be done or confirmed."""
        return self.mark is Mark.TO_DO or (self.mark is Mark.YOU and self.name not in confirmed)


@dataclass(frozen=True, slots=True)
class CheckSubject:
    """What is checked before the robot starts.

    Attributes:
        points: The list.
        plan: What the robot will do, a sentence.
    """

    points: tuple[CheckPoint, ...]
    plan: str

    @property
    def rows(self) -> tuple[CheckPoint, ...]:
        """The points that a person goes through; the starting row comes after them."""
        return tuple(point for point in self.points if point.name)

    def open_rows(self, confirmed: Collection[str]) -> tuple[int, ...]:
        """Return the indices of the rows that are still open."""
        return tuple(i for i, point in enumerate(self.rows) if point.is_open(confirmed))


SWITCH_ON = "motors"
"""The answer that has the motors switched on."""
