"""Screens (a) and (j): a list from which a person chooses."""

from typing import Final

from robolink.locale.languages import ENGLISH
from robolink.messages import tr
from robolink_cli.console.tables import padded
from robolink_cli.wizard.screens.layout import BODY, JobStep, Screen, broken, status_row, title_row
from robolink_cli.wizard.state import CheckPoint, CheckSubject, ChoiceSubject, Mark, WizardState

_LEAST_SHOWN: Final = 3
"""Fewest options on the screen, however long the text above them."""


def choice_screen(state: WizardState, subject: ChoiceSubject, now_s: float) -> Screen:
    """Return the screen of a list; if it is too long, the part around the mark."""
    assert state.question is not None  # noqa: S101 - checked by the caller
    above = [row for line in subject.above for row in broken(line)]
    most = BODY - 2 - min(_LEAST_SHOWN, len(subject.options))
    if len(above) > most:
        # The options must be visible.
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
        # A choice after the write belongs to the turn test.
        title_row(state, subject.step, JobStep.TURN_TEST if state.accepted else JobStep.CHOOSE),
        (*above, "", state.question.text, *rows, *(["", *told] if told else ())),
        keys,
        status=status_row(state, now_s) if state.reading is not None else "",
        message=state.message,
    )


def language_label(language: str) -> str:
    """Return a language's label beside the key that changes to it.

    Args:
        language: One of :data:`robolink.locale.languages.LANGUAGES`.
    """
    return tr("English") if language == ENGLISH else tr("Chinese")


def _details(state: WizardState, subject: ChoiceSubject) -> tuple[str, ...]:
    """Return the details of the marked option."""
    if state.marked is None or not subject.details:
        return ()
    return subject.details[state.marked]


def check_screen(state: WizardState, subject: CheckSubject, now_s: float) -> Screen:
    """Return the screen of the check list."""
    left = len(subject.open_rows(state.checked))
    start = tr("Start moving ({n} open)", n=left) if left else tr("Start moving")
    rows, marked = subject.rows, state.marked
    here = rows[marked] if marked is not None and marked < len(rows) else None
    listed = [
        row
        for point in subject.points
        for row in point_rows(point, state.checked, marked=point is here)
    ]
    listed.append(f"{'>' if marked == len(rows) else ' '}{' ' * 7}{start}")
    return Screen(
        title_row(state, tr("Check"), JobStep.CHECK),
        (*listed, "", *broken(subject.plan), tr("Keep a hand near the emergency stop.")),
        (*_main(state, here, start), (tr("arrows"), tr("choose")), ("0", tr("Leave"))),
        status=status_row(state, now_s),
        message=state.message,
    )


def _main(state: WizardState, here: CheckPoint | None, start: str) -> tuple[tuple[str, str], ...]:
    """Return what the main key does on the marked row; nothing without one."""
    if state.marked is None:
        return ()
    if here is None:
        return (("5", start),)
    return (("5", tr("Take it back") if here.name in state.checked else here.does),)


def mark_of(point: CheckPoint, checked: frozenset[str]) -> str:
    """Return the word for the state of a point."""
    if point.mark is Mark.OK or point.name in checked:
        return tr("OK")
    if point.mark is Mark.LOOK:
        return tr("LOOK")
    return tr("TO DO") if point.mark is Mark.TO_DO else tr("YOU")


def point_rows(point: CheckPoint, checked: frozenset[str], *, marked: bool) -> list[str]:
    """Return a point, broken to two rows where it is long."""
    first, *rest = broken(point.text, 71)
    row = f"{'>' if marked else ' '}{padded(mark_of(point, checked), 7)}{first}"
    return [row, *(f"         {more}" for more in rest)]
