"""The records of a screen: values, words in the language of the job, and what can be pressed.

A terminal and a page draw the same record. Nothing in it decides: a press goes back to the flow by
the name of its action, with the number of the question that was on the screen.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

ANSWERS_TEXT: Final = "answer"
"""Action of a field for a line of text."""


class Weight(StrEnum):
    """How much an action stands out."""

    MAIN = "main"
    PLAIN = "plain"
    LEAVES = "leaves"
    """It ends the job, or keeps the old value."""


@dataclass(frozen=True, slots=True)
class Action:
    """Something that can be pressed.

    Attributes:
        name: What a press is sent back as.
        label: What it is called.
        value: What goes with the press: the row of a list, the axis and step of a jog.
        key: The terminal's key for it; empty for none.
        why_not: Why it cannot be pressed now; empty where it can.
        weight: How much it stands out.
        field: What is typed and goes with the press as its value: ``tool``, ``text`` or ``pose``;
            empty for nothing.
    """

    name: str
    label: str
    value: str = ""
    key: str = ""
    why_not: str = ""
    weight: Weight = Weight.PLAIN
    field: str = ""


@dataclass(frozen=True, slots=True)
class Head:
    """The first row.

    Attributes:
        cell: Name of the cell.
        job: What is done.
        title: What the screen is called.
        step: Which numbered step it is, and of how many; ``None`` for none.
        simulated: Whether nothing real moves.
        needle: Id of the needle or nozzle; empty where nobody was asked.
    """

    cell: str
    job: str
    title: str
    step: tuple[int, int] | None = None
    simulated: bool = False
    needle: str = ""


@dataclass(frozen=True, slots=True)
class Status:
    """The controller, as it was read last.

    Attributes:
        state: The word for what it is doing.
        halted: Whether an emergency stop, an open guard or an error shows.
        age_s: How long ago it was read, in seconds, when this record was made.
        motors, low_power: ``None`` where that was not read.
        tool: Number of the selected tool, ``None`` where that was not read.
    """

    state: str
    halted: bool
    age_s: float
    motors: bool | None = None
    low_power: bool | None = None
    tool: int | None = None


@dataclass(frozen=True, slots=True)
class ListRow:
    """A row of a list.

    Attributes:
        text: What it says.
        value: What goes with the press of ``choose``.
        details: What is to be read of it.
    """

    text: str
    value: str
    details: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ChoiceView:
    """A list from which one row is chosen, by ``choose`` with the row's value.

    Attributes:
        above: What is to be read before.
        question: What is asked.
        rows: What there is.
        marked: Index of the row that is marked; ``None`` for none.
        does: What choosing is called.
        other_language: The language that ``language`` changes to; empty where it cannot.
    """

    above: tuple[str, ...]
    question: str
    rows: tuple[ListRow, ...]
    marked: int | None
    does: str
    other_language: str = ""


@dataclass(frozen=True, slots=True)
class CheckRow:
    """A point of the check list.

    Attributes:
        mark: ``ok``, ``to do``, ``you`` or ``look``.
        word: The mark in words.
        text: What it says.
        name: What goes with ``confirm``; empty for what is only read.
        does: What confirming it is called, or taking it back.
        confirmed: Whether the person has confirmed it.
    """

    mark: str
    word: str
    text: str
    name: str = ""
    does: str = ""
    confirmed: bool = False


@dataclass(frozen=True, slots=True)
class CheckView:
    """What is checked before the robot starts, by ``confirm`` and ``start``.

    Attributes:
        rows: The list.
        plan: What the robot will do.
        open: How many rows are still open.
        marked: Index of the row that is marked, of those with a name; their count for the start;
            ``None`` for none.
    """

    rows: tuple[CheckRow, ...]
    plan: str
    open: int
    marked: int | None = None


Point = tuple[float, float]
"""Base X and Y in mm."""


@dataclass(frozen=True, slots=True)
class ArmPicture:
    """The arm from above.

    Attributes:
        flange: Where it is.
        u_deg: The direction of its U.
        target: Where it goes.
        elbow: The elbow of a SCARA; ``None`` where none is known, and then no arm is drawn.
        follows: Whether the flange is that of now; else it is where the movement began.
    """

    flange: Point
    u_deg: float
    target: Point
    elbow: Point | None
    follows: bool


@dataclass(frozen=True, slots=True)
class MovingView:
    """The robot moves by itself.

    Attributes:
        purpose: What for.
        then: What follows; empty where nobody knows yet.
        told: Distance, turn and speed, a sentence each.
        picture: The arm; ``None`` without a position.
        left_s: About how long it still takes; ``None`` where that is not known.
        held: What keeps it from beginning; empty where it has begun.
    """

    purpose: str
    then: str
    told: tuple[str, ...]
    picture: ArmPicture | None
    left_s: float | None
    held: str = ""


@dataclass(frozen=True, slots=True)
class WaitView:
    """The work goes on without a question.

    Attributes:
        told: What was told last.
    """

    told: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CoordinateRow:
    """One coordinate.

    Attributes:
        name: ``X`` to ``W``.
        now: Where it is.
        since: How far from where the robot stopped; empty where that says nothing.
    """

    name: str
    now: str
    since: str = ""


@dataclass(frozen=True, slots=True)
class Arrow:
    """A key of the jog pad.

    Attributes:
        place: Where it is on the pad: ``right``, ``up``, ``left``, ``down``, ``above``, ``below``,
            ``turn+`` or ``turn-``.
        axis: What goes with ``jog`` before the step, and with a held press: ``x+``.
        label: What it is called: ``X+``.
    """

    place: str
    axis: str
    label: str


@dataclass(frozen=True, slots=True)
class JogPad:
    """How the tip is jogged: ``jog`` with ``x+0.1``, ``size`` with a step, ``turn`` for the arrows.

    Attributes:
        sizes: The steps, mm or degrees.
        size: The one in use.
        arrows: The keys, as they are turned.
        why_not: Why nothing can be jogged now; empty where it can.
    """

    sizes: tuple[float, ...]
    size: float
    arrows: tuple[Arrow, ...]
    why_not: str = ""


@dataclass(frozen=True, slots=True)
class AngleRow:
    """What the turn test showed at one angle."""

    u_deg: float
    off_mm: float
    word: str
    within: bool | None


@dataclass(frozen=True, slots=True)
class TouchView:
    """A person jogs the tip to a place, and takes it by ``take``.

    Attributes:
        instruction: What to do, a sentence each.
        where: What the coordinates are of, in words.
        rows: The coordinates; empty without a position.
        way: How far it was jogged, and in how many steps; empty where that says nothing.
        notes: Height against the first touch, how contact shows, the limits of a free jog.
        angles: What the turn test has shown so far.
        pad: The jog pad.
        typed: The pose that was typed and is taken next; empty for none.
        free: Whether nothing is measured: the person only jogs.
        contact: How contact shows; empty where nothing is touched. It is among the notes too, and
            so are the next three.
        height: Height against the first touch; empty where nothing is compared with it.
        lowest, highest: How far a free jog may go, X, Y and Z; empty for any other.
        next_u_deg: The angle at which the turn test is touched now; ``None`` where nobody knows.
    """

    instruction: tuple[str, ...]
    where: str
    rows: tuple[CoordinateRow, ...]
    way: str
    notes: tuple[str, ...]
    angles: tuple[AngleRow, ...]
    pad: JogPad
    typed: str = ""
    free: bool = False
    contact: str = ""
    height: str = ""
    lowest: tuple[str, ...] = ()
    highest: tuple[str, ...] = ()
    next_u_deg: float | None = None


@dataclass(frozen=True, slots=True)
class FitMark:
    """One touch of a fit.

    Attributes:
        number: Which one, from 1.
        where: What it is called.
        off_mm: How far it is off, along each axis of the base.
        away_mm: How far in all.
        side: The base axis and side on which it is off most.
        worst: Whether it fits worst and is offered to be taken again.
    """

    number: int
    where: str
    off_mm: tuple[float, ...]
    away_mm: float
    side: str
    worst: bool


@dataclass(frozen=True, slots=True)
class FitView:
    """How well the touches agree.

    Attributes:
        marks: Each touch.
        limit_mm: The largest that is believed.
        told: What it means, a sentence each.
        rms_mm: Root mean square, ``None`` without a degree of freedom.
        repeatable_mm: What they are repeatable to in 95 %; ``None`` where nobody knows.
    """

    marks: tuple[FitMark, ...]
    limit_mm: float
    told: tuple[str, ...]
    rms_mm: float | None
    repeatable_mm: float | None


@dataclass(frozen=True, slots=True)
class ValueRow:
    """One component of a tool: its name, before, new, and the change in words."""

    name: str
    before: str
    new: str
    change: str


@dataclass(frozen=True, slots=True)
class ToolValues:
    """What is to be written into one tool.

    Attributes:
        tool: Its number.
        rows: Its components.
        statements: Repeatability, accuracy, how far the tip moves.
        verdicts: What limits and doubts say: a mark (``ok`` or ``look``), its word and a sentence.
    """

    tool: int
    rows: tuple[ValueRow, ...]
    statements: tuple[str, ...]
    verdicts: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, slots=True)
class ValuesView:
    """New values before they are written, by ``write`` with the typed number of the tool.

    Attributes:
        tools: What is to be written.
        taught: What it does to programs, and which stations were found with a tool.
        asks: What has to be typed, in words.
    """

    tools: tuple[ToolValues, ...]
    taught: tuple[str, ...]
    asks: str


@dataclass(frozen=True, slots=True)
class QuestionView:
    """A question without a picture: ``yes`` or ``no``, or ``answer`` with a line of text.

    Attributes:
        told: What was told before it; often its reason.
        question: What is asked.
        text: Whether a line of text is wanted.
    """

    told: tuple[str, ...]
    question: str
    text: bool


@dataclass(frozen=True, slots=True)
class EndView:
    """How the job ended.

    Attributes:
        done: Whether it was carried out.
        headed: That in a word.
        lines: What is said.
        blocked: Whether the robot accepts only ``recover``.
        change: Id of the change; empty without one.
        angles: What the turn test showed, for a picture of before and after.
        before_mm: How far the old value was off the tip that was measured; ``None`` without an
            old value, or without a turn test.
        after_mm: How far the new one is off at most, by the turn test; ``None`` without one.
        limit_mm: What the turn test was held to; ``None`` without one.
    """

    done: bool
    headed: str
    lines: tuple[str, ...]
    blocked: bool = False
    change: str = ""
    angles: tuple[AngleRow, ...] = ()
    before_mm: float | None = None
    after_mm: float | None = None
    limit_mm: float | None = None


Body = (
    ChoiceView
    | CheckView
    | MovingView
    | WaitView
    | TouchView
    | FitView
    | ValuesView
    | QuestionView
    | EndView
)


@dataclass(frozen=True, slots=True)
class View:
    """One screen.

    Attributes:
        number: Of the question; presses with another one do nothing. 0 while nothing is asked.
        waits: Whether an answer is awaited; else the last one is being carried out.
        head: The first row.
        status: The controller; ``None`` before it was read.
        body: What is shown.
        actions: What can be pressed, beside the rows of a list and the jog pad.
        heard: What was told before the question.
        message: What became of the last press; empty for nothing.
    """

    number: int
    waits: bool
    head: Head
    status: Status | None
    body: Body
    actions: tuple[Action, ...] = ()
    heard: tuple[str, ...] = ()
    message: str = ""
