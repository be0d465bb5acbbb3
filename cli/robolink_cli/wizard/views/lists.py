"""Views of a list, of the check list, and of a question without a picture."""

from robolink.locale.languages import ENGLISH
from robolink.messages import tr
from robolink.runner import Question
from robolink_cli.wizard.state import CheckPoint, CheckSubject, ChoiceSubject, Mark, WizardState
from robolink_cli.wizard.views.frame import JobStep, Part, leaves
from robolink_cli.wizard.views.records import (
    Action,
    CheckRow,
    CheckView,
    ChoiceView,
    ListRow,
    QuestionView,
    Weight,
)

_MOST_TOLD = 6
"""How many of the last messages stand above a question: one of them is often its reason."""


def choice_part(state: WizardState, subject: ChoiceSubject) -> Part:
    """Return the view of a list; a choice after the write belongs to the turn test."""
    assert state.question is not None  # noqa: S101 - checked by the caller
    details = subject.details or ((),) * len(subject.options)
    rows = tuple(
        ListRow(option, str(number), tuple(told))
        for number, (option, told) in enumerate(zip(subject.options, details, strict=True), 1)
    )
    does = subject.does or tr("Next")
    body = ChoiceView(
        subject.above, state.question.text, rows, state.marked, does, other_language=subject.other
    )
    other = (Action("language", language_label(subject.other), key="F2"),) if subject.other else ()
    step = JobStep.TURN_TEST if state.accepted else JobStep.CHOOSE
    return Part(subject.step, body, (*other, leaves(subject.leaves or tr("Leave"))), step)


def language_label(language: str) -> str:
    """Return a language's label beside the key that changes to it.

    Args:
        language: One of :data:`robolink.locale.languages.LANGUAGES`.
    """
    return tr("English") if language == ENGLISH else tr("Chinese")


def check_part(state: WizardState, subject: CheckSubject) -> Part:
    """Return the view of the check list."""
    left = len(subject.open_rows(state.checked))
    start = Action(
        "start",
        tr("Start moving ({n} open)", n=left) if left else tr("Start moving"),
        key="5",
        why_not=tr("Not yet: {n} open.", n=left) if left else "",
        weight=Weight.MAIN,
    )
    body = CheckView(check_rows(state, subject), subject.plan, left, state.marked)
    return Part(tr("Check"), body, (start, leaves(tr("Leave"))), JobStep.CHECK)


def check_rows(state: WizardState, subject: CheckSubject) -> tuple[CheckRow, ...]:
    """Return the points of a check list, as they stand."""
    return tuple(_row(point, state.checked) for point in subject.points)


def _row(point: CheckPoint, checked: frozenset[str]) -> CheckRow:
    confirmed = bool(point.name) and point.name in checked
    does = tr("Take it back") if confirmed else point.does
    mark = Mark.OK if confirmed else point.mark
    return CheckRow(str(mark), _word(mark), point.text, point.name, does, confirmed)


def _word(mark: Mark) -> str:
    match mark:
        case Mark.OK:
            return tr("OK")
        case Mark.LOOK:
            return tr("LOOK")
        case Mark.TO_DO:
            return tr("TO DO")
        case Mark.YOU:
            return tr("YOU")


def question_part(state: WizardState) -> Part:
    """Return the view of a question that has none of its own."""
    assert state.question is not None  # noqa: S101 - checked by the caller
    text = state.question.kind is Question.TEXT
    body = QuestionView(state.remarks[-_MOST_TOLD:], state.question.text, text)
    if text:
        answer = Action("answer", tr("Done"), key="Enter", weight=Weight.MAIN, field="text")
        return Part(tr("Question"), body, (answer, leaves(tr("STOP"), "Esc")))
    answers = (Action("yes", tr("Yes"), key="y"), Action("no", tr("No"), key="n"))
    return Part(tr("Question"), body, (*answers, leaves(tr("STOP"))))
