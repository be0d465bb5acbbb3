"""Which view a state shows."""

from dataclasses import replace

from robolink.calibration_run import WriteSubject
from robolink.messages import tr
from robolink.runner import FitSubject, MoveSubject, Question
from robolink_cli.wizard.state import CheckSubject, ChoiceSubject, WizardState
from robolink_cli.wizard.views.end import end_part
from robolink_cli.wizard.views.fit import fit_part
from robolink_cli.wizard.views.frame import Part, head_of, status_of
from robolink_cli.wizard.views.lists import check_part, choice_part, question_part
from robolink_cli.wizard.views.moving import moving_part, wait_part
from robolink_cli.wizard.views.place import place_part
from robolink_cli.wizard.views.records import Action, View
from robolink_cli.wizard.views.values import values_part


def view_of(state: WizardState, now_s: float) -> View:
    """Return the view of a state.

    Args:
        state: The state.
        now_s: The time, by the clock of its readings.
    """
    part = _part(state, now_s)
    waits = state.ended is not None or (state.question is not None and state.waits)
    return View(
        state.screen_number,
        waits,
        head_of(state, part.title, part.step),
        status_of(state.reading, now_s),
        part.body,
        part.actions if waits else tuple(_later(state, one) for one in part.actions),
        state.heard if state.ended is None and state.question is not None else (),
        state.message,
    )


def _part(state: WizardState, now_s: float) -> Part:
    subject, question = state.subject, state.question
    if state.ended is not None:
        return end_part(state, state.ended)
    if question is None:
        if isinstance(subject, MoveSubject):
            return moving_part(state, subject, now_s)
        return wait_part(state)
    if state.at_place:
        return place_part(state, now_s)
    if isinstance(subject, ChoiceSubject):
        return choice_part(state, subject)
    if question.kind is Question.YES_NO:
        match subject:
            case WriteSubject():
                return values_part(state, subject)
            case CheckSubject():
                return check_part(state, subject)
            case FitSubject():
                return fit_part(subject)
            case _:
                pass
    return question_part(state)


def _later(state: WizardState, action: Action) -> Action:
    """Return an action while the last answer is carried out: only the job can be ended."""
    if action.name == "leave" or action.why_not:
        return action
    why = tr("Wait: the robot is still moving.") if state.at_place else tr("Please wait")
    return replace(action, why_not=why)
