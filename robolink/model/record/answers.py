"""What a person was asked, what was answered, and how: each an entry of the journal.

A value that is written may rest on an answer as much as on a touch: "is the new tip exactly as
long as the old one?" decides Z. So whatever asks, asks through a primitive that keeps the answer:
the runner of procedures, and the prompts of the command line. What was answered beforehand, by an
option or ``--yes``, is kept with the question that it answered.
"""

from enum import StrEnum

from robolink.messages import tr
from robolink.model.record.journal_entries import EntryKind, NewEntry


class AnsweredBy(StrEnum):
    """How a question was answered."""

    PERSON = "person"
    """Somebody was asked, and typed it or pressed a key."""

    STAND_IN = "stand-in"
    """The simulated person of a simulator: nobody was asked."""

    YES = "--yes"
    """With the command, for every question that a yes answers."""

    OPTION = "option"
    """With the command, by an option for this question."""

    RECIPE = "recipe"
    """By a key of the recipe."""

    COMMAND = "command"
    """The command itself is the consent: nobody was there to be asked."""

    PROGRAM = "program"
    """By the program that uses robolink."""


def answer_entry(
    question: str,
    answer: bool | str,
    by: AnsweredBy,
    *,
    tool: int | None = None,
    **details: object,
) -> NewEntry:
    """Return the record of an answer.

    Args:
        question: What was asked, as it was shown.
        answer: Whether it was a yes, or the word or text itself.
        by: How it was answered.
        tool: Number of the tool that it is about, ``None`` where it is about none or several.
        details: More for the record, plain JSON.

    Example:
        >>> from robolink.model import AnsweredBy, answer_entry
        >>> entry = answer_entry("Is the new tip as long?", True, AnsweredBy.PERSON, tool=1)
        >>> entry.details["answer"], entry.details["answered_by"]
        ('yes', 'person')
    """
    said = answer if isinstance(answer, str) else "yes" if answer else "no"
    verdict = answer if isinstance(answer, str) else tr("accepted") if answer else tr("declined")
    return NewEntry(
        EntryKind.DECISION,
        tool=tool,
        verdict=verdict,
        details={"question": question, "answer": said, "answered_by": str(by), **details},
    )


def answered_by_in_words(by: str) -> str:
    """Return how a question was answered, in words; as it is where it is none of ours."""
    words = {
        AnsweredBy.PERSON: tr("asked and answered"),
        AnsweredBy.STAND_IN: tr("answered by the simulated person"),
        AnsweredBy.YES: tr("not asked: a yes was given with the command"),
        AnsweredBy.OPTION: tr("not asked: answered by an option"),
        AnsweredBy.RECIPE: tr("not asked: answered by the recipe"),
        AnsweredBy.COMMAND: tr("not asked: the command is the consent"),
        AnsweredBy.PROGRAM: tr("not asked: answered by the program"),
    }
    return next((said for one, said in words.items() if one == by), by)
