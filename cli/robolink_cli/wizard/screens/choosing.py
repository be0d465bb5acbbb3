"""Screens (a) and (j): a list of which one is chosen."""

from typing import Final

from robolink.locale.languages import ENGLISH
from robolink.messages import tr
from robolink_cli.wizard.choices import ChoiceSubject
from robolink_cli.wizard.screens.layout import BODY, Screen, broken
from robolink_cli.wizard.screens.rows import JobStep, status_row, title_row
from robolink_cli.wizard.state import WizardState

_LEAST_SHOWN: Final = 3
"""So many options stand on the screen, however much there is to be read above them."""


def choice_screen(state: WizardState, subject: ChoiceSubject, now_s: float) -> Screen:
    """Return the screen of a list; where it is longer than the screen, the part about the mark."""
    assert state.question is not None  # noqa: S101 - looked at by whoever calls
    above = [row for line in subject.above for row in broken(line)]
    most = BODY - 2 - min(_LEAST_SHOWN, len(subject.options))
    if len(above) > most:
        # What is chosen from has to be seen.
        above = [*above[: most - 1], "..."]
    told = [row for line in _details(state, subject) for row in broken(line)]
    room = max(_LEAST_SHOWN, BODY - len(above) - 2 - (len(told) + 1 if told else 0))
    first = max(0, min((state.marked or 0) - room // 2, len(subject.options) - room))
    rows = []
    for index, option in enumerate(subject.options[first : first + room], start=first):
        sign = ">" if index == state.marked else " "
        rows.append(f"{sign} {option}")
    keys = (
        ("5", subject.does or tr("Next")),
        (tr("arrows"), tr("choose")),
        *((("F2", language_label(subject.other)),) if subject.other else ()),
        ("0", subject.leaves or tr("Leave")),
    )
    return Screen(
        # What is chosen after the write belongs to the turn test.
        title_row(state, subject.step, JobStep.TURN_TEST if state.accepted else JobStep.CHOOSE),
        (*above, "", state.question.text, *rows, *(["", *told] if told else ())),
        keys,
        status=status_row(state, now_s) if state.reading is not None else "",
        message=state.message,
    )


def language_label(language: str) -> str:
    """Return what a language is called beside the key that changes to it.

    Args:
        language: One of :data:`robolink.locale.languages.LANGUAGES`.
    """
    return tr("English") if language == ENGLISH else tr("Chinese")


def _details(state: WizardState, subject: ChoiceSubject) -> tuple[str, ...]:
    """Return what is to be read of the marked option."""
    if state.marked is None or not subject.details:
        return ()
    return subject.details[state.marked]
