"""Asks a person to move the tool somewhere: jog steps, then a confirmation.

What is kept with the pose is how it was taken: after how long, and whether a contact input
switched meanwhile. What it proves is for the procedure to say (docs/reference/evidence.md 1).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from robolink.errors import (
    CalibrationError,
    ConfigError,
    DeclinedError,
    JournalError,
    NotReadyError,
    NotReadyReason,
)
from robolink.messages import listed, tr
from robolink.model import Controller, DigitalIo, InputEdge, MotionGroup, Pose
from robolink.runner._jog_steps import parse_steps
from robolink.runner._prompt_context import GuidedOperator, Operator, Question, TouchSubject
from robolink.runner._steps import (
    OLDEST_READING_S,
    Ask,
    NotYet,
    StepsTaken,
    TeachPrompt,
    TouchedAt,
    no_contact,
    old_reading,
    still_moving,
)
from robolink.timing import FASTEST_ANSWER_S, NS_PER_S

MOST_EARLY: Final = 3
"""Number of answers to one question that may come too early: beyond it a key is held down, or a
file is the input."""

MOST_NOT_YET: Final = 3
"""How often a place is requested again that does not count yet, before the measurement ends."""

AGAIN: Final = "taken_again"
"""Code of a person's request to repeat an earlier touch."""

MOST_REFUSED: Final = 10
"""This many useless answers in a row end a question: a person, or a substitute, would continue in
the same way.
"""

_QUESTIONS: Final = {
    TeachPrompt.PIN: Question.PLACE,
    TeachPrompt.ROOM: Question.ROOM,
    TeachPrompt.ALONG_X: Question.ALONG_X,
    TeachPrompt.ALONG_Z: Question.ALONG_Z,
}

Line = Callable[[Callable[[], object] | None], str]
"""Returns the next line typed, calling the function between two checks of the input."""


class PlaceQuestion:
    """One question for a place.

    Args:
        step: What is asked.
        controller: For its clock and its inputs.
        group: What moves.
        operator: Who is asked.
        jog: Takes typed steps; returns whether another question came between.
        line: Fetches what is typed.
        runs: Tells whether the controller was at work when it was looked at last.
        typed: Reads a typed pose, given where the frame is; ``None`` where none is taken.
        guided: The operator, if it is shown what it is asked about.
    """

    def __init__(
        self,
        step: Ask,
        *,
        controller: Controller,
        group: MotionGroup,
        operator: Operator,
        jog: Callable[[str], bool],
        line: Line,
        runs: Callable[[], bool],
        typed: Callable[[str, Pose], Pose] | None = None,
        guided: GuidedOperator | None = None,
    ) -> None:
        self._step = step
        self._controller = controller
        self._group = group
        self._operator = operator
        self._jog = jog
        self._line = line
        self._runs = runs
        subject = step.subject
        types = isinstance(subject, TouchSubject) and subject.types
        self._typed = typed if types else None
        edge = step.contact
        self._contact = _ContactWatch(inputs_of(controller), edge) if edge else None
        self._asked_ns = 0
        self._steps = StepsTaken(controller.clock)
        self._guided = guided

    def answer(self) -> TouchedAt:
        """Ask until the person confirms the place; return the pose, and how it was taken.

        Raises:
            CalibrationError: ``typed_ahead``; ``taken_again`` where the person wants an earlier
                touch again; and what is not taken however often it is said, by its own code.
            ConfigError: The controller has no inputs, and one is to show contact.
            DeclinedError: The person ended it, or gets nowhere.
        """
        self._ask()
        early = refused = hasty = 0
        while True:
            word = self._line(self._contact.look if self._contact else None).strip().lower()
            if word in ("q", "quit", "abort"):
                raise ended_by_operator()
            if self._step.evidence and self._seconds < FASTEST_ANSWER_S:
                early += 1
                self._refuse_early(early)
            elif word in ("", "done") or word.startswith("pose"):
                try:
                    touch, why = self._looked_at(word.removeprefix("pose"))
                except ConfigError as error:
                    refused = self._refuse(error, refused)
                    continue
                if why is None:
                    return touch
                hasty += 1
                self._refuse_hasty(why, hasty)
            elif word.startswith("again") and (again := self._again(word)) is not None:
                raise again
            else:
                refused = self._jogged(word, refused)

    def _ask(self) -> None:
        subject = self._step.subject
        if isinstance(subject, TouchSubject):
            subject = replace(subject, types=self._typed is not None)
        if self._guided is not None:
            self._guided.regard(subject)
        self._operator.ask(self._step.instruction, _QUESTIONS[self._step.shown])
        self._asked_ns = self._controller.clock.now_ns()
        if self._contact:
            self._contact.look()

    @property
    def _seconds(self) -> float:
        return (self._controller.clock.now_ns() - self._asked_ns) / NS_PER_S

    def _again(self, word: str) -> "TakenAgainError | None":
        """Return the answer to this question that repeats an earlier touch.

        ``again`` alone is the one before, ``again 1`` the first; ``None`` where there is none.
        """
        subject = self._step.subject
        if not isinstance(subject, TouchSubject) or subject.number < 2 or subject.proof:
            return None
        named = word.removeprefix("again").strip() or str(subject.number - 1)
        if not subject.retakes:
            return TakenAgainError(1)
        if not named.isdigit() or not 1 <= int(named) < subject.number:
            return None
        return TakenAgainError(int(named))

    def _looked_at(self, word: str) -> tuple[TouchedAt, NotYet | None]:
        """Return where the tip is, by the controller or a person, and why not yet.

        Raises:
            ConfigError: What was typed is no pose that is taken.
        """
        seconds = self._seconds
        before_ns = self._controller.clock.now_ns()
        switched = self._contact.switched() if self._contact else None
        here = self._group.pose()
        if word in ("", "done"):
            touch = TouchedAt.of(here, seconds=seconds, contact=switched)
        else:
            touch = TouchedAt.of(self._pose_typed(word, here), seconds=seconds, typed=True)
        took_s = (self._controller.clock.now_ns() - before_ns) / NS_PER_S
        return touch, self._not_yet(touch, took_s)

    def _pose_typed(self, word: str, here: Pose) -> Pose:
        if self._typed is None:
            raise ConfigError(
                tr("A pose is typed only at a touch that a turn test proves afterwards."),
                remedy=tr("Jog the tip onto it, then take it."),
            )
        return self._typed(word, here)

    def _not_yet(self, touch: TouchedAt, took_s: float) -> NotYet | None:
        step = self._step
        if not step.evidence:
            return None
        why = None
        if self._guided is not None:
            self._group.require_able(step.instruction)
            why = self._steps.too_soon()
            if why is None and not touch.typed:
                why = self._without_contact()
            if why is None and took_s > OLDEST_READING_S:
                why = old_reading(took_s)
        if why is None and self._runs():
            why = still_moving()
        if why is None and not touch.contact and step.shown is TeachPrompt.PIN:
            why = self._steps.too_coarse()
        return why or (step.judge(touch) if step.judge is not None else None)

    def _without_contact(self) -> NotYet | None:
        """Report at once what the check of the touch would say about it."""
        edge = self._step.contact
        if edge is None or self._contact is None or self._contact.look():
            return None
        return no_contact(edge.number)

    def _refuse_hasty(self, why: NotYet, hasty: int) -> None:
        if hasty == MOST_NOT_YET:
            raise CalibrationError(
                why.code,
                why.sentence,
                remedy=tr(
                    "Nothing was written. Measure again, and jog each time until the tip is on it."
                ),
            )
        self._operator.tell(why.sentence)

    def _refuse_early(self, early: int) -> None:
        if early == MOST_EARLY:
            raise CalibrationError(
                "typed_ahead",
                tr(
                    "{count} answers came within {least:g} s of the question, too early "
                    "for anybody to have read it.",
                    count=early,
                    least=FASTEST_ANSWER_S,
                ),
                remedy=tr("Answer by hand, after you have looked at the tip."),
            )
        self._operator.tell(
            tr("That came before the question could be read and was ignored. Again:")
        )
        self._ask()

    def _jogged(self, word: str, refused: int) -> int:
        """Jog; return how many jogs in a row have now been refused."""
        try:
            again = self._jog(word)
            self._steps.add(parse_steps(word))
            if again:
                self._ask()
        except ConfigError as error:
            return self._refuse(error, refused)
        except NotReadyError as error:
            if error.reason is not NotReadyReason.NOT_PERMITTED:
                raise
            self._operator.tell(str(error))  # nothing was sent, and nothing is wrong with the step
        return 0

    def _refuse(self, error: ConfigError, refused: int) -> int:
        """Report why an answer is refused; return how many in a row have now been refused."""
        if isinstance(error, JournalError):
            raise error  # not a person's mistake: the record can no longer be kept
        # A typing mistake ends nothing; the limits held and nothing was sent.
        if refused + 1 == MOST_REFUSED:
            raise self._gets_nowhere(error) from error
        self._operator.tell(str(error))
        return refused + 1

    def _gets_nowhere(self, error: ConfigError) -> DeclinedError:
        return DeclinedError(
            listed(
                tr("{count} jogs in a row were refused; the last one:", count=MOST_REFUSED),
                filter(None, (error.what, error.remedy)),
            ),
            remedy=tr("The robot is where the last jog left it; start again."),
            controller=self._controller.identity,
        )


class TakenAgainError(CalibrationError):
    """A person wants to repeat an earlier touch.

    A procedure that does not hear it ends, and is begun anew.

    Attributes:
        number: Which touch, from 1.
    """

    def __init__(self, number: int) -> None:
        super().__init__(
            AGAIN,
            tr("Repeat touch {k}.", k=number),
            remedy=tr("Nothing was written."),
        )
        self.number = number


class _ContactWatch:
    """Watches the contact input while a person is asked."""

    def __init__(self, io: DigitalIo, edge: InputEdge) -> None:
        self._io = io
        self._edge = edge
        self._was_off = False

    def look(self) -> bool:
        """Read the input; return whether it shows contact."""
        on = self._edge.awaited(self._io.read_input(self._edge.number))
        self._was_off |= not on
        return on

    def switched(self) -> bool:
        """Return whether it shows contact now, and did not since the question."""
        return self.look() and self._was_off


def inputs_of(controller: Controller) -> DigitalIo:
    """Return the inputs of a controller, one of which shows contact.

    Raises:
        ConfigError: It has none.
    """
    if controller.io is None:
        raise ConfigError(
            tr("This controller has no inputs, so it has no contact input."),
            remedy=tr("Measure without a contact input."),
        )
    return controller.io


def ended_by_operator() -> DeclinedError:
    """Return the end that a person requested; a caller that restores a value reports it itself."""
    return DeclinedError(tr("You stopped it."), remedy=tr("The robot has stopped."))
