"""The person at the cell: how one is asked, and the subject of a question or a movement.

A terminal that shows one line after the other needs the sentence alone. A screen draws: where the
touches lie, how far each is off, where the arm goes. Both are asked the same questions and answer
with the same lines; what is drawn decides nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol, runtime_checkable

from robolink.model import InputEdge, Path, Pose, WorkBox

POLL_S: Final = 1.0
"""Longest time between two status reads while a person is asked, in s."""


class Question(Enum):
    """The kind of answer that is wanted."""

    PLACE = "place"
    """Jog steps until the tip is on the reference point, then an empty line."""

    ROOM = "room"
    """Jog steps until the tip has room to move along the axes of the tool, then an empty line."""

    ALONG_X = "along x"
    """Jog steps along the tool's +X, then an empty line."""

    ALONG_Z = "along z"
    """Jog steps along the tool's +Z, then an empty line."""

    YES_NO = "yes/no"

    TEXT = "text"
    """A line of text that is not empty; ``q`` alone ends."""

    CHOICE = "choice"
    """The number of a row; an empty line, or ``q``, selects the first, which is safe."""


class Operator(Protocol):
    """The person at the cell, or a substitute."""

    def tell(self, text: str) -> None:
        """Show something that needs no answer."""

    def ask(self, question: str, kind: Question) -> None:
        """Show what to do or decide; :meth:`poll` fetches the answer."""

    def poll(self, wait_s: float) -> str | None:
        """Return the next line of the answer, ``None`` if none came within ``wait_s``."""


def awaited_line(operator: Operator, look: Callable[[], object], *, wait_s: float = POLL_S) -> str:
    """Return the next typed line; read the controller while there is none.

    Whoever asks a person fetches the answer here: an idle client is cut off after the remote
    time-out (docs/reference/epson.md 1.1), and a person may take longer than that to look into the
    cell (docs/reference/rules.md 7).

    Args:
        operator: Who was asked.
        look: Reads the status; what it raises ends the question.
        wait_s: Longest time between two looks.

    Example:
        >>> from robolink.runner import awaited_line
        >>> class Person:  # implements robolink.Operator
        ...     lines = iter([None, "y"])
        ...     def poll(self, wait_s):
        ...         return next(self.lines)
        >>> awaited_line(Person(), lambda: print("a look"))
        a look
        'y'
    """
    while (line := operator.poll(wait_s)) is None:
        look()
    return line


@dataclass(frozen=True, slots=True)
class AngleShown:
    """What the touches of a turn test have shown at one angle.

    Attributes:
        u_deg: The angle U of the tool.
        off_mm: How far off the tip was there; of several touches, their mean.
        within: Whether that is surely inside the limit, or surely outside; ``None`` for so near to
            it that it is touched again.
    """

    u_deg: float
    off_mm: float
    within: bool | None


@dataclass(frozen=True, slots=True)
class TouchSubject:
    """A place to which a person moves the tip.

    Attributes:
        number: Which touch it is, from 1; 0 for a place that is no touch.
        total: How many are planned, ``None`` where nobody knows.
        arrival: Where the robot had stopped before, ``None`` where the person brings the tip from
            wherever it is.
        first_z_mm: Height of the first touch of an upright tool, ``None`` where nothing is
            compared with it.
        contact: The input that shows contact.
        limit_mm: How far the tip may be off where it is a touch of the turn test, else ``None``.
        retakes: Whether an earlier touch may be made again from here, alone; else all of them are
            begun again from the first.
        types: Whether the pose may be typed in place of being read.
        surface: Whether a surface is touched, and not a pin.
        earlier: What the touches of the turn test before this one have shown, each angle once, as
            far as one angle alone shows something.
    """

    number: int = 0
    total: int | None = None
    arrival: Pose | None = None
    first_z_mm: float | None = None
    contact: InputEdge | None = None
    limit_mm: float | None = None
    retakes: bool = False
    types: bool = False
    surface: bool = False
    earlier: tuple[AngleShown, ...] = ()

    @property
    def proof(self) -> bool:
        """Whether it is a touch of the turn test."""
        return self.limit_mm is not None


@dataclass(frozen=True, slots=True)
class JogRange:
    """Jogging only: nothing is measured, and it ends where the person leaves it.

    Attributes:
        start: Where the selected frame was when it began.
        box: Where it may go.
    """

    start: Pose
    box: WorkBox


@dataclass(frozen=True, slots=True)
class FitRow:
    """One sample of a fit.

    Attributes:
        number: Which one, from 1.
        where: What it is called, for a person: "Pose 3, at U 120.0".
        off_mm: How far it is off, along each axis of the base.
    """

    number: int
    where: str
    off_mm: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class FitSubject:
    """How well the samples so far agree.

    Attributes:
        rows: Each sample.
        rms_mm: Root mean square of how far they are off, ``None`` without a degree of freedom.
        repeatable_mm: What they are repeatable to in 95 %, all measured lengths together; ``None``
            where nobody knows.
        next_mm: What that becomes with one more.
        worst: Index of the one that fits worst, where it is offered to be taken again.
        limit_mm: The largest that is believed.
        more: Whether one more is offered.
    """

    rows: tuple[FitRow, ...]
    rms_mm: float | None
    repeatable_mm: float | None = None
    next_mm: float | None = None
    worst: int | None = None
    limit_mm: float = 0.15
    more: bool = False


@dataclass(frozen=True, slots=True)
class MoveSubject:
    """A movement that starts.

    Attributes:
        target: Where to.
        path: How.
        speed_mm_s: Fastest that a straight one goes.
        purpose: What for.
        then: What follows it; empty where nobody knows yet.
    """

    target: Pose
    path: Path
    speed_mm_s: float
    purpose: str
    then: str = ""


@dataclass(frozen=True, slots=True)
class JogSubject:
    """A step by a person.

    Attributes:
        before, after: Where the tip was and is, as it was read.
        longest: The longest part of the step, mm or degrees.
    """

    before: Pose
    after: Pose
    longest: float


@dataclass(frozen=True, slots=True)
class ChoiceRow:
    """One of several choices of a person.

    Attributes:
        does: What it does, a sentence.
        detail: What else is to be known of it, a sentence.
    """

    does: str
    detail: str


@dataclass(frozen=True, slots=True)
class OfferedChoice:
    """The choices of a person. The first row is the safe one, which ENTER alone chooses.

    Attributes:
        title: What the question belongs to.
        rows: The rows.
    """

    title: str
    rows: tuple[ChoiceRow, ...]


@runtime_checkable
class GuidedOperator(Operator, Protocol):
    """An operator that is shown the subject before a message or a question.

    A person sits at it: what a hand cannot do is not taken from it.
    """

    def regard(self, subject: object) -> None:
        """Note ``subject`` as the subject of what comes next; an unknown one is ignored."""


def regard(operator: Operator, subjects: Sequence[object]) -> None:
    """Show an operator the subject of what comes next, if the operator can show it."""
    if isinstance(operator, GuidedOperator):
        for subject in subjects:
            operator.regard(subject)
