"""Events of a wizard, and its actions: plain values, no terminal."""

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from robolink.model import Pose
from robolink.runner import Question

if TYPE_CHECKING:
    from robolink.calibration import Impact  # numpy, which a touch does without


@dataclass(frozen=True, slots=True)
class Reading:
    """What the controller reported a moment ago.

    Attributes:
        at_s: When it was read, by the monotonic clock of this computer.
        state: The one word for what it is doing.
        halted: Whether an emergency stop, an open guard or an error shows.
        pose: Where the selected frame is, ``None`` where it was not read.
        axes: Joint angles, in degrees, where they were read.
        follows: Whether the pose is that of now; else it is where a movement began.
        motors: Whether the motors are on, ``None`` where that was not read.
        low_power: Whether the controller is in Power Low, ``None`` where that was not read or
            there is no such thing.
    """

    at_s: float
    state: str
    halted: bool = False
    pose: Pose | None = None
    axes: tuple[float, ...] = ()
    follows: bool = True
    motors: bool | None = None
    low_power: bool | None = None


@dataclass(frozen=True, slots=True)
class CellIs:
    """News about the cell or the job, for the first row of every screen.

    Attributes:
        simulated: Whether the controller says of itself that nothing real moves.
        needle: Id of the needle or nozzle, empty where nobody was asked.
    """

    simulated: bool = False
    needle: str = ""


@dataclass(frozen=True, slots=True)
class TaughtPoints:
    """The taught points that a person named, and the effect of the new value there.

    Attributes:
        impact: That.
    """

    impact: "Impact"


@dataclass(frozen=True, slots=True)
class MovementHeld:
    """Something keeps a movement from beginning, or does so no longer.

    Attributes:
        why: What; empty for nothing.
    """

    why: str


@dataclass(frozen=True, slots=True)
class WasTold:
    """The work showed a message."""

    text: str


@dataclass(frozen=True, slots=True)
class WasRegarded:
    """The subject of what comes next."""

    subject: object


@dataclass(frozen=True, slots=True)
class WasAsked:
    """The work asks; answers to an earlier question no longer count.

    Attributes:
        number: Of the question; it grows.
        text: The question.
        kind: What kind of answer is wanted.
        at_s: When.
    """

    number: int
    text: str
    kind: Question
    at_s: float


@dataclass(frozen=True, slots=True)
class WaitsForAnswer:
    """The work has read the last answer and waits for the next one.

    Attributes:
        number: Of the question.
        at_s: Since when.
    """

    number: int
    at_s: float


@dataclass(frozen=True, slots=True)
class WasRead:
    """The controller was read."""

    reading: Reading


@dataclass(frozen=True, slots=True)
class KeyPressed:
    """One key, alone: input in a burst is no key.

    Attributes:
        name: ``0`` to ``9`` for the keypad with and without NumLock, ``main``, ``stop``, ``+``,
            ``-``, ``*``, ``/``, ``enter``, ``backspace``, or a letter.
        text: What it writes into a field, empty for nothing.
        at_s: When.
    """

    name: str
    text: str
    at_s: float


@dataclass(frozen=True, slots=True)
class LineTyped:
    """A whole line."""

    text: str
    at_s: float


@dataclass(frozen=True, slots=True)
class Pressed:
    """Something was pressed that a view showed.

    Attributes:
        number: Of the view that was there when the finger went down.
        action: Name of the action.
        value: What goes with it.
        at_s: When it arrived.
    """

    number: int
    action: str
    value: str
    at_s: float


@dataclass(frozen=True, slots=True)
class TooFast:
    """A burst of characters, as from a scanner or a paste, was ignored."""


@dataclass(frozen=True, slots=True)
class HasEnded:
    """The work has ended, and its last screen is shown.

    Attributes:
        ended: A :class:`~robolink_cli.wizard.state.LastScreen`.
    """

    ended: object


Happening = (
    WasTold
    | WasRegarded
    | WasAsked
    | WaitsForAnswer
    | WasRead
    | KeyPressed
    | LineTyped
    | Pressed
    | TooFast
    | HasEnded
)


@dataclass(frozen=True, slots=True)
class SendAnswer:
    """Answer a question."""

    number: int
    text: str


class WizardCommand(Enum):
    """What the flow requests besides an answer."""

    END_WORK = "end"
    """End the current work, like Ctrl-C."""

    LEAVE = "leave"
    """Leave the last screen."""

    BEGIN_AGAIN = "begin again"
    """Start the same job again, from its first question."""

    SHOW_REPORT = "show the report"
    """Write the report page about the finished change, and return to the last screen."""

    NEXT_TOOL = "next tool"
    """Choose another job, starting at the first list."""


@dataclass(frozen=True, slots=True)
class OffersAtTheEnd:
    """What the last screen offers beside leaving it, where the job is carried out.

    Attributes:
        offers: That.
    """

    offers: frozenset[WizardCommand]


@dataclass(frozen=True, slots=True)
class SaidAtTheEnd:
    """What the last screen says besides, and what stays when it is gone.

    Attributes:
        text: That.
    """

    text: str


Effect = SendAnswer | WizardCommand
