"""Which screen a state shows: the drawing of its view."""

from dataclasses import replace

from robolink.messages import tr
from robolink_cli.wizard.screens.choice import check_screen, choice_screen
from robolink_cli.wizard.screens.end import end_screen
from robolink_cli.wizard.screens.fit import fit_screen
from robolink_cli.wizard.screens.layout import (
    BODY,
    Screen,
    TerminalDraft,
    broken,
    keys_of,
    status_row,
    title_row,
)
from robolink_cli.wizard.screens.move import moving_screen, wait_screen
from robolink_cli.wizard.screens.touch import touch_screen
from robolink_cli.wizard.screens.values import values_screen
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.views.records import (
    CheckView,
    ChoiceView,
    EndView,
    FitView,
    MovingView,
    QuestionView,
    TouchView,
    ValuesView,
    View,
    WaitView,
)
from robolink_cli.wizard.views.view import view_of


def screen_of(state: WizardState, now_s: float) -> Screen:
    """Return the screen of a state.

    Args:
        state: The state.
        now_s: The time, by the clock of its readings.
    """
    return drawn(
        view_of(state, now_s), TerminalDraft(state.marked, state.typed, state.typing, state.page)
    )


def drawn(view: View, draft: TerminalDraft) -> Screen:
    """Return the drawing of a view.

    Args:
        view: What is shown.
        draft: What stands on the terminal besides.
    """
    match view.body:
        case EndView() as body:
            return end_screen(view, body)
        case MovingView() as body:
            return moving_screen(view, body)
        case WaitView() as body:
            return wait_screen(view, body)
        case TouchView() as body:
            return _with_heard(view, touch_screen(view, body, draft))
        case ChoiceView() as body:
            return _with_heard(view, choice_screen(view, body))
        case CheckView() as body:
            return _with_heard(view, check_screen(view, body))
        case ValuesView() as body:
            return values_screen(view, body, draft)
        case FitView() as body:
            return fit_screen(view, body)
        case QuestionView() as body:
            return _question_screen(view, body, draft)


def _with_heard(view: View, screen: Screen) -> Screen:
    """Return a screen with the earlier messages, as many as fit, the last first.

    The work says it between two questions, when there is no screen that anybody could read.
    """
    rows = [row for remark in view.heard for row in broken(remark) if row.strip()]
    room = screen.room() - 1
    if not rows or room < 1:
        return screen
    return replace(screen, lines=(*screen.lines, "", *rows[-room:]))


def _question_screen(view: View, body: QuestionView, draft: TerminalDraft) -> Screen:
    """Return the screen of a question that has none of its own."""
    asked = ["", *broken(body.question), ""]
    keys: tuple[tuple[str, str], ...]
    if body.text:
        asked.append(f"> {draft.typed}_")
        keys = keys_of(view)
    else:
        *answers, leave = view.actions
        asked += [
            f"{'>' if index == draft.marked else ' '} {answer.label}"
            for index, answer in enumerate(answers)
        ]
        keys = (("5", tr("Do it")), (tr("arrows"), tr("choose")), (leave.key, leave.label))
    # The message before a question often gives the reason for it.
    before = [row for remark in body.told for row in broken(remark)]
    room = max(0, BODY - len(asked) - 1)
    return Screen(
        title_row(view.head),
        (*before[-room:], *asked),
        keys,
        status=status_row(view.status),
        message=view.message if view.message not in before else "",
    )
