"""The steps that a procedure can ask for.

A procedure is a generator. It yields steps and is sent what came of them; its return value
is a proposal. It knows no controller, no clock and no person, so it can be tested by feeding
it numbers, shown before anything moves, and replayed from a record.

Why a place is not taken yet is said here too, and not by whoever shows the question, so that no
key, script or program comes past it. What a whole set of touches proves is for the procedure to say
(docs/reference/evidence.md 1); this is what can be seen while the tip is still there.
"""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import Any, Final, TypeVar

from robolink.messages import tr
from robolink.model import TIP, InputEdge, Path, Pose, Spot, SpotUnit
from robolink.runner._prompt_context import FitSubject, JogRange, TouchSubject
from robolink.timing import NS_PER_S, Clock

FINEST_STEP: Final = 0.1
"""Largest last step before a touch, in mm or degrees: with steps of a millimetre, a person stops up
to half a millimetre away (docs/decisions/0041)."""

SETTLING_S: Final = 0.3
"""Time in s after a step during which keys are ignored: they were pressed for what came before."""

OLDEST_READING_S: Final = 1.0
"""Longest time for reading a position, in s: after a longer one, the tip may have moved on."""

_ROUNDING: Final = 1e-9


@dataclass(frozen=True, slots=True)
class NotYet:
    """Why a place is refused.

    Attributes:
        code: By which a program knows it, and with which it ends when it is asked for again and
            again.
        sentence: For a person.
    """

    code: str
    sentence: str


Judge = Callable[[object], NotYet | None]
"""Says why a :class:`~robolink.runner.TouchedAt` does not count yet."""


class StepsTaken:
    """The steps of one question.

    Args:
        clock: The controller's.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._last = 0.0
        self._ended_ns: int | None = None

    def add(self, deltas: Mapping[str, float]) -> None:
        """Add a step that has just ended, mm and degrees by axis."""
        self._last = max(map(abs, deltas.values()), default=0.0)
        self._ended_ns = self._clock.now_ns()

    def too_coarse(self) -> NotYet | None:
        """Refuse a place that a long step reached."""
        if self._last <= FINEST_STEP + _ROUNDING:
            return None
        return NotYet(
            "coarse_step",
            tr(
                "Not yet: the last step was {mm} mm. Finish with 0.10 mm or less.",
                mm=f"{self._last:.2f}",
            ),
        )

    def too_soon(self) -> NotYet | None:
        """Refuse what a person cannot have meant."""
        ended_ns = self._ended_ns
        if ended_ns is None or (self._clock.now_ns() - ended_ns) / NS_PER_S >= SETTLING_S:
            return None
        return still_moving()


def still_moving() -> NotYet:
    """Return that the robot moves."""
    return NotYet("still_moving", tr("Wait: the robot is still moving."))


def no_contact(number: int) -> NotYet:
    """Return that the contact input shows no contact."""
    return NotYet(
        "not_touched",
        tr("Contact input {n} is off: the tip does not touch.", n=number),
    )


def old_reading(seconds: float) -> NotYet:
    """Return that the controller took too long to report where the tip is."""
    return NotYet("old_reading", tr("No reading from the controller for {s} s.", s=round(seconds)))


@dataclass(frozen=True, slots=True)
class Move:
    """Drive the selected frame to ``target``; answered with the pose that was reached.

    Attributes:
        target: Where to.
        path: How.
        purpose: What for, for a person.
        aside_mm: In a look ahead, how far beside the target it may go when it is taken.
        then: What follows it, for a person; empty where the procedure does not know yet.
    """

    target: Pose
    path: Path
    purpose: str
    aside_mm: float = 0.0
    then: str = ""


class TeachPrompt(Enum):
    """What a person shows with the pose to which they move the tool."""

    PIN = "pin"
    """The tip is on the reference point."""

    ROOM = "room"
    """The tip is in free space, with room to move along the axes of the tool."""

    ALONG_X = "along_x"
    """The tip has since moved along the tool's +X."""

    ALONG_Z = "along_z"
    """The tip has since moved along the tool's +Z."""


@dataclass(frozen=True, slots=True)
class Ask:
    """Let a person move the tool somewhere; answered with :class:`TouchedAt`, the pose then.

    When answers keep coming before anybody could have read the question, whoever runs the
    procedure throws CalibrationError ``typed_ahead`` into it. The frame is then where it was.

    Attributes:
        instruction: Where to, for a person.
        shown: What the pose shows then.
        foreseen: About where that is, for a look ahead; ``None`` for where the frame is already.
        contact: The input that shows contact with the pin, ``None`` where there is none.
        evidence: Whether anything rests on the answer, so that one that was typed ahead is none,
            and one that comes after a long step is not taken yet.
        subject: What a screen shows of it.
        judge: Says why a touch does not count yet, while the tip is still there; ``None`` for a
            place that proves nothing.
    """

    instruction: str
    shown: TeachPrompt = TeachPrompt.PIN
    foreseen: Pose | None = None
    contact: InputEdge | None = None
    evidence: bool = True
    subject: TouchSubject | JogRange | None = None
    judge: "Callable[[TouchedAt], NotYet | None] | None" = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Seek:
    """Drive the selected frame straight on until an input switches; answered with the pose then.

    When the input shows the edge already, or not on the way, whoever runs the procedure throws
    CalibrationError ``edge_passed`` or ``no_edge`` into it. The frame is then where it was, or
    at ``target``.

    Attributes:
        target: How far it goes at most.
        edge: What ends it.
        speed_mm_s: How fast it goes.
        purpose: What for, for a person.
        expected: About where the frame stops, to foresee how long it takes; ``None`` where nobody
            knows.
    """

    target: Pose
    edge: InputEdge
    speed_mm_s: float
    purpose: str
    expected: Pose | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Look:
    """Let the camera report where it sees a mark; answered with :class:`SeenAt`.

    When it sees none, or two, whoever runs the procedure throws CalibrationError
    ``tip_not_seen``, ``several_tips_seen`` and their like into it.

    Attributes:
        purpose: What for, for a person.
        expected_mm: Where in the base, X and Y, the mark should be.
        mark: The tip, or the number of a fiducial.
        pictures: How many are taken; the median of them counts.
        in_pixels: Whether the answer is in pixels of which nobody knows yet how long they are.
        awaited: Whether the mark has to be there: a camera that does not see it may be late.
        repeated: Whether it is one more look without a movement, which only a camera takes that
            works on pictures of its own (:class:`~robolink.model.LooksAtRest`); answered with
            ``None`` for others.
    """

    purpose: str
    expected_mm: tuple[float, float]
    mark: int = TIP
    pictures: int = 3
    in_pixels: bool = field(default=False, compare=False)
    awaited: bool = field(default=False, compare=False)
    repeated: bool = field(default=False, compare=False)


def _as_it_is(pose: Pose) -> dict[str, Any]:
    """Return every field of a pose by name; a field that poses gain later is among them."""
    return {field.name: getattr(pose, field.name) for field in fields(Pose)}


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenAt(Pose):
    """The pose of the selected frame, and where the camera saw the mark at that time.

    Attributes:
        spot: Where, in the camera's unit.
        unit: That unit.
        scatter: Standard deviation of one coordinate of one picture, in that unit; ``None`` where
            one picture was taken.
    """

    spot: Spot
    unit: SpotUnit
    scatter: float | None = None

    @classmethod
    def of(
        cls, pose: Pose, spot: Spot, unit: SpotUnit, *, scatter: float | None = None
    ) -> "SeenAt":
        """Return what was seen from ``pose``.

        Args:
            pose: Where the flange was.
            spot: What the camera saw.
            unit: The unit of that.
            scatter: Standard deviation of one coordinate of one picture.

        Example:
            >>> from robolink import Pose, Spot, SpotUnit
            >>> from robolink.runner import SeenAt
            >>> seen = SeenAt.of(Pose(300, 100, -60, 0), Spot(312.3, 96.3), SpotUnit.BASE_MM)
            >>> seen.x_mm, seen.spot.x
            (300, 312.3)
        """
        return cls(**_as_it_is(pose), spot=spot, unit=unit, scatter=scatter)


@dataclass(frozen=True, slots=True, kw_only=True)
class TouchedAt(Pose):
    """The selected frame's pose at a person's confirmation, and how it got there.

    Attributes:
        seconds: From the question to the answer, by the controller's clock; ``None`` where nobody
            counted.
        contact: Whether the contact input was off after the question and on at the answer;
            ``None`` where there is none.
        arrival: Where the robot had stopped before, ``None`` where the person brought the tip
            from wherever it was.
        standoff_mm: How far from the expected contact that was, base: X, Y, Z.
        seed: From which the standoff was drawn, ``None`` where none was.
        typed: Whether a person typed the pose: nothing then shows that it was touched.
    """

    seconds: float | None = None
    contact: bool | None = None
    arrival: Pose | None = None
    standoff_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int | None = None
    typed: bool = False

    @classmethod
    def of(
        cls,
        pose: Pose,
        *,
        seconds: float | None = None,
        contact: bool | None = None,
        typed: bool = False,
    ) -> "TouchedAt":
        """Return what was shown at ``pose``; as it is where that is known already.

        Args:
            pose: Where the frame was.
            seconds: How long after the question the person answered, where that is known.
            contact: Whether a contact input was seen off and then on.
            typed: Whether a person typed the pose.

        Example:
            >>> from robolink import Pose
            >>> from robolink.runner import TouchedAt
            >>> TouchedAt.of(Pose(300, 100, -60, 0), seconds=4.5).seconds
            4.5
        """
        if isinstance(pose, cls):
            return pose
        return cls(**_as_it_is(pose), seconds=seconds, contact=contact, typed=typed)


@dataclass(frozen=True, slots=True)
class Consider:
    """Find out which movements are impossible; answered with one text for each of them.

    Nothing moves. The text says why not; it is empty where nothing is known against it, and in a
    look ahead, where the places are only foreseen.

    Attributes:
        moves: The movements, each for itself; their order does not count.
        starts: Where each of them begins, empty where nobody knows: a straight way is then looked
            at in its end alone.
    """

    moves: tuple[Move, ...]
    starts: tuple[Pose, ...] = ()


@dataclass(frozen=True, slots=True)
class Notify:
    """Show a person the progress; answered with ``None``.

    Attributes:
        text: In a sentence.
        fit: What a screen shows of it.
    """

    text: str
    fit: FitSubject | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Confirm:
    """Offer something that a person may accept; answered with whether they did.

    Where nobody is to be asked, the answer is ``False``: a measurement never depends on it.

    Attributes:
        question: What is offered.
        fit: What a screen shows of it.
        also: Further words that may answer it; it is answered with the word itself then.
    """

    question: str
    fit: FitSubject | None = field(default=None, compare=False)
    also: tuple[str, ...] = ()


TakenStep = Move | Ask | Seek | Look | Notify | Confirm
"""A step in the cell or for a person; it is reported and previewed."""


@dataclass(frozen=True, slots=True)
class StepDone:
    """A step that was taken.

    Attributes:
        step: Which one.
        pose: Where the frame was after it, ``None`` for a step that only concerns a person.
        accepted: Whether a person accepted an offer, ``None`` for other steps and where nobody was
            asked.
        word: The further word with which an offer was answered; empty for none.
    """

    step: TakenStep
    pose: Pose | None = None
    accepted: bool | None = None
    word: str = ""

    @property
    def answer(self) -> Pose | bool | str | None:
        """What the procedure is sent; an offer that nobody heard is declined."""
        if isinstance(self.step, Confirm):
            return self.word or self.accepted is True
        return self.pose


Step = TakenStep | Consider

T = TypeVar("T")

Procedure = Generator[Step, Any, T]
"""Yields steps, receives the answer of each step, returns a result. The type of an answer depends
on the step, which the type of a generator cannot express."""
