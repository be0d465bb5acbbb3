"""Which screen a state shows."""

from dataclasses import replace

from robolink.calibration_run import WriteSubject
from robolink.messages import tr
from robolink.runner import FitSubject, Question
from robolink_cli.wizard.screens.choice import check_screen, choice_screen
from robolink_cli.wizard.screens.end import ended_screen
from robolink_cli.wizard.screens.fit import fit_screen
from robolink_cli.wizard.screens.layout import BODY, Screen, broken, status_row, title_row
from robolink_cli.wizard.screens.move import moving_screen
from robolink_cli.wizard.screens.touch import touch_screen
from robolink_cli.wizard.screens.values import values_screen
from robolink_cli.wizard.state import CheckSubject, ChoiceSubject, WizardState


def screen_of(state: WizardState, now_s: float) -> Screen:
    """Return the screen of a state.

    Args:
        state: The state.
        now_s: The time, by the clock of its readings.
    """
    subject, question = state.subject, state.question
    if state.ended is not None:
        return ended_screen(state, state.ended)
    if question is None:
        return moving_screen(state, now_s)
    if state.at_place:
        return _with_heard(state, touch_screen(state, now_s))
    if isinstance(subject, ChoiceSubject):
        return _with_heard(state, choice_screen(state, subject, now_s))
    if question.kind is Question.YES_NO:
        match subject:
            case WriteSubject():
                return values_screen(state, subject)
            case CheckSubject():
                return _with_heard(state, check_screen(state, subject, now_s))
            case FitSubject():
                return fit_screen(state, subject)
            case _:
                pass
    return _question_screen(state, now_s)


def _with_heard(state: WizardState, screen: Screen) -> Screen:
    """Return a screen with the earlier messages, as many as fit, the last first.

    The work says it between two questions, when there is no screen that anybody could read.
    """
    rows = [row for remark in state.heard for row in broken(remark) if row.strip()]
    room = screen.room() - 1
    if not rows or room < 1:
        return screen
    return replace(screen, lines=(*screen.lines, "", *rows[-room:]))


def _question_screen(state: WizardState, now_s: float) -> Screen:
    """Return the screen of a question that has none of its own."""
    assert state.question is not None  # noqa: S101 - checked by the caller
    asked = ["", *broken(state.question.text), ""]
    keys: tuple[tuple[str, str], ...]
    if state.question.kind is Question.TEXT:
        asked.append(f"> {state.typed}_")
        keys = (("Enter", tr("Done")), ("Esc", tr("STOP")))
    else:
        asked += [
            f"{'>' if index == state.marked else ' '} {answer}"
            for index, answer in enumerate((tr("Yes"), tr("No")))
        ]
        keys = (("5", tr("Do it")), (tr("arrows"), tr("choose")), ("0", tr("STOP")))
    # The message before a question often gives the reason for it.
    before = [row for remark in state.remarks[-6:] for row in broken(remark)]
    room = max(0, BODY - len(asked) - 1)
    return Screen(
        title_row(state, tr("Question")),
        (*before[-room:], *asked),
        keys,
        status=status_row(state, now_s),
        message=state.message if state.message not in before else "",
    )
