"""Something to be chosen from a list."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.model import AnsweredBy
from robolink.runner import OfferedChoice, Question, awaited_line
from robolink_cli.console.language import other_language, speak_from_now
from robolink_cli.prompts.present import AskingDesk
from robolink_cli.prompts.questions import keep_answer


@dataclass(frozen=True, slots=True)
class ChoiceSubject:
    """A list of which one is chosen.

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
    """Return the list of what the work lets a person choose; its first row is safe."""
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
"""The answer of a person who wants to read the other language."""


def choose_in_either_language(
    desk: AskingDesk, make: Callable[[], tuple[str, ChoiceSubject]], watch: Callable[[], object]
) -> int:
    """Have one chosen by a person who may change the language first; return its index.

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
    """Have one chosen; return its index.

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
