"""Asking a person to bring the tool somewhere: jog steps, then the word that it is there.

What is kept with the pose is how it was taken: after how long, and whether a contact input
switched meanwhile. What it proves is for the procedure to say (docs/reference/evidence.md 1).
"""

from collections.abc import Callable
from typing import Final

from robolink.errors import CalibrationError, ConfigError, DeclinedError, JournalError
from robolink.messages import tr
from robolink.model import Controller, DigitalIo, InputEdge, MotionGroup
from robolink.runner._capture import (
    OLDEST_READING_S,
    NotYet,
    StepsTaken,
    no_contact,
    old_reading,
    still_moving,
)
from robolink.runner._jog_steps import parse_steps
from robolink.runner._operator import Operator, Question
from robolink.runner._steps import Ask, TeachPrompt, TouchedAt
from robolink.runner._subjects import GuidedOperator, TouchSubject, regard
from robolink.timing import FASTEST_ANSWER_S, NS_PER_S

MOST_EARLY: Final = 3
"""So many answers to one question that came too early: a key is held down, or a file is fed in."""

MOST_NOT_YET: Final = 3
"""So often a place is asked for that is not to be taken yet, before it ends the measurement."""

AGAIN: Final = "taken_again"
"""The code with which a person begins the touches anew."""

MOST_REFUSED: Final = 10
"""So many answers in a row that lead nowhere end a question: whoever answers, a person or what
stands in for one, would go on like that."""

_QUESTIONS: Final = {
    TeachPrompt.PIN: Question.PLACE,
    TeachPrompt.ROOM: Question.ROOM,
    TeachPrompt.ALONG_X: Question.ALONG_X,
    TeachPrompt.ALONG_Z: Question.ALONG_Z,
}

Line = Callable[[Callable[[], object] | None], str]
"""Returns the next line typed, calling the function between two looks at the input."""


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
    ) -> None:
        self._step = step
        self._controller = controller
        self._group = group
        self._operator = operator
        self._jog = jog
        self._line = line
        self._runs = runs
        edge = step.contact
        self._contact = _ContactWatch(inputs_of(controller), edge) if edge else None
        self._asked_ns = 0
        self._steps = StepsTaken(controller.clock)
        self._by_hand = isinstance(operator, GuidedOperator)

    def answer(self) -> TouchedAt:
        """Ask until the person says that it is there; return the pose, and how it was taken.

        Raises:
            CalibrationError: ``typed_ahead``; ``taken_again`` where the person begins anew; and
                what is not taken however often it is said, by its own code.
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
            elif word in ("", "done"):
                touch, why = self._looked_at()
                if why is None:
                    return touch
                hasty += 1
                self._refuse_hasty(why, hasty)
            elif word == "again" and self._may_begin_anew:
                raise _begun_anew()
            else:
                refused = self._jogged(word, refused)

    def _ask(self) -> None:
        regard(self._operator, [self._step.subject])
        self._operator.ask(self._step.instruction, _QUESTIONS[self._step.shown])
        self._asked_ns = self._controller.clock.now_ns()
        if self._contact:
            self._contact.look()

    @property
    def _seconds(self) -> float:
        return (self._controller.clock.now_ns() - self._asked_ns) / NS_PER_S

    @property
    def _may_begin_anew(self) -> bool:
        subject = self._step.subject
        return isinstance(subject, TouchSubject) and subject.number > 1 and not subject.proof

    def _looked_at(self) -> tuple[TouchedAt, NotYet | None]:
        """Return where the tip is, and why that does not count yet."""
        seconds = self._seconds
        before_ns = self._controller.clock.now_ns()
        switched = self._contact.switched() if self._contact else None
        touch = TouchedAt.of(self._group.pose(), seconds=seconds, contact=switched)
        took_s = (self._controller.clock.now_ns() - before_ns) / NS_PER_S
        return touch, self._not_yet(touch, took_s)

    def _not_yet(self, touch: TouchedAt, took_s: float) -> NotYet | None:
        step = self._step
        if not step.evidence:
            return None
        why = None
        if self._by_hand:
            self._group.require_able(step.instruction)
            why = self._steps.too_soon() or self._without_contact()
            if why is None and took_s > OLDEST_READING_S:
                why = old_reading(took_s)
        if why is None and self._runs():
            why = still_moving()
        if why is None and not touch.contact and step.shown is TeachPrompt.PIN:
            why = self._steps.too_coarse()
        return why or (step.judge(touch) if step.judge is not None else None)

    def _without_contact(self) -> NotYet | None:
        """Say at once what whoever judges the touch would say of it."""
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
                    "{count} answers came within {least:g} s of the question, before anybody could "
                    "have read it.",
                    count=early,
                    least=FASTEST_ANSWER_S,
                ),
                remedy=tr("Answer by hand, after you have looked at the tip."),
            )
        self._operator.tell(
            tr("That came before the question could be read, so it was not taken. Again:")
        )
        self._ask()

    def _jogged(self, word: str, refused: int) -> int:
        """Jog; return how many jogs in a row were refused now."""
        try:
            again = self._jog(word)
            self._steps.add(parse_steps(word))
            if again:
                self._ask()
        except JournalError:
            raise  # no mistake of the person's: the record cannot be kept any more
        except ConfigError as error:
            # A typing mistake ends nothing; the limits held and nothing was sent.
            if refused + 1 == MOST_REFUSED:
                raise self._gets_nowhere(error) from error
            self._operator.tell(str(error))
            return refused + 1
        return 0

    def _gets_nowhere(self, error: ConfigError) -> DeclinedError:
        return DeclinedError(
            tr(
                "{count} jogs in a row were refused; the last one: {cause}",
                count=MOST_REFUSED,
                cause=error.what,
            ),
            remedy=" ".join(
                (error.remedy, tr("The robot stands where the last jog left it; start again."))
            ).strip(),
            controller=self._controller.identity,
        )


def _begun_anew() -> CalibrationError:
    return CalibrationError(
        AGAIN,
        tr("The touches are begun again from the first."),
        remedy=tr("Nothing was written."),
    )


class _ContactWatch:
    """Watches the input that shows contact while a person is asked."""

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
        """Tell whether it shows contact now, and did not since the question."""
        return self.look() and self._was_off


def inputs_of(controller: Controller) -> DigitalIo:
    """Return the inputs of a controller, one of which is to show contact.

    Raises:
        ConfigError: It has none.
    """
    if controller.io is None:
        raise ConfigError(
            tr("This controller has no inputs, so none can show contact."),
            remedy=tr("Measure without a contact input."),
        )
    return controller.io


def ended_by_operator() -> DeclinedError:
    """Return the end that a person asked for."""
    return DeclinedError(
        tr("You stopped it."),
        remedy=tr("Nothing was written."),
    )
