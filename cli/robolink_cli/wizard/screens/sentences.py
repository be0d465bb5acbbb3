"""The same questions in sentences, for a face that draws nothing."""

import math

from robolink.calibration_run import WriteSubject
from robolink.locale.languages import ENGLISH
from robolink.messages import joined, tr
from robolink.model import describe_pose
from robolink.runner import FitSubject, Question, TouchSubject
from robolink_cli.wizard.screens.fit import fit_lines
from robolink_cli.wizard.screens.layout import WIDTH, broken
from robolink_cli.wizard.state import CheckSubject, ChoiceSubject, WizardState
from robolink_cli.wizard.views.fit import fit_view
from robolink_cli.wizard.views.frame import mm
from robolink_cli.wizard.views.lists import check_rows, language_label
from robolink_cli.wizard.views.place import angle_word, instruction, touch_title
from robolink_cli.wizard.views.values import taught_lines


def told_before(state: WizardState, width: int = WIDTH) -> list[str]:
    """Return what to read before a yes-or-no question.

    Args:
        state: The state.
        width: How many columns there are for what stands in columns.
    """
    match state.subject:
        case FitSubject() as fit:
            return fit_lines(fit_view(fit), width)
        case ChoiceSubject() as subject:
            rows = []
            for index, option in enumerate(subject.options):
                rows.append(f"  {index + 1} {option}")
                details = subject.details[index] if subject.details else ()
                rows += [f"    {detail}" for detail in details]
            return [*subject.above, *rows]
        case CheckSubject() as subject:
            numbers = {point.name: n for n, point in enumerate(subject.rows, start=1)}
            words = (row.word for row in check_rows(state, subject))
            points = [
                f"  {word}: {point.text}"
                + (f"  [{numbers[point.name]}] {point.does}" if point.name else "")
                for word, point in zip(words, subject.points, strict=True)
            ]
            return [*points, subject.plan, tr("Keep a hand near the emergency stop.")]
        case WriteSubject() as subject:
            return [row for line in taught_lines(state, subject) for row in broken(line)]
        case _:
            return []


def told_question(state: WizardState) -> str:
    """Return a question, and how it is answered."""
    question, subject = state.question, state.subject
    if question is None:
        return ""
    if state.at_place:
        return _place(state)
    if isinstance(subject, ChoiceSubject):
        return _choice(question.text, subject)
    if question.kind is Question.TEXT:
        return tr("{question} [Type or scan it, then Enter. To end: stop.]", question=question.text)
    if isinstance(subject, WriteSubject):
        numbers = ", ".join(map(str, subject.tools))
        write = tr("To write, type the tool number ({numbers}). n = do not write.", numbers=numbers)
        return joined(" ", (write, *_further(subject)))
    if isinstance(subject, CheckSubject):
        return tr("Type the number of a row, then y to start; n = leave.")
    if isinstance(subject, FitSubject) and subject.more:
        return tr("{question} [y, n, or more for one more touch]", question=question.text)
    return tr("{question} [y or n]", question=question.text)


def _choice(question: str, subject: ChoiceSubject) -> str:
    if subject.safe is not None:
        return tr(
            "{question} [Type the number of a row. Enter alone: {safe}.]",
            question=question,
            safe=subject.safe + 1,
        )
    if not subject.other:
        return tr("{question} [Type the number of a row. To leave: stop.]", question=question)
    english = subject.other == ENGLISH
    return tr(
        "{question} [Type the number of a row, or {word} to read {language}. To leave: stop.]",
        question=question,
        word="english" if english else "chinese",
        language=language_label(subject.other),
    )


def _further(subject: WriteSubject) -> list[str]:
    if subject.again is None:
        return []
    told = [tr("again = touch {k} again.", k=subject.again)]
    return [*told, tr("more = one more touch.")] if subject.can_add_touch else told


def _place(state: WizardState) -> str:
    title = touch_title(state.touch)
    head = f"{title}. {instruction(state)}" if state.touch is not None else instruction(state)
    touch, here = state.touch, told_where(state)
    if state.free_jog is not None:
        how = tr("Type steps (x+0.1 z-0.5), stop, or help.")
    elif touch is not None and touch.number > 1 and not touch.proof:
        how = tr("Type steps (x+0.1 z-0.5), take, again 1, stop, or help.")
    else:
        how = tr("Type steps (x+0.1 z-0.5), take, stop, or help.")
    return "\n".join(part for part in (*_angles(touch), head, here, how) if part)


def _angles(touch: TouchSubject | None) -> list[str]:
    """Return what the turn test has shown at each angle so far, a sentence each."""
    return [
        tr("At U {u} it was {mm} mm off: {word}.", u=f"{u:.1f}", mm=mm(off), word=word)
        for u, off, word in (
            (one.u_deg, one.off_mm, angle_word(one)) for one in (touch.earlier if touch else ())
        )
    ]


def told_where(state: WizardState) -> str:
    """Return where the selected frame is."""
    pose = state.pose
    if pose is None:
        return ""
    where = describe_pose(pose)
    if pose.tool:
        return tr("Tip {pose}.", pose=where)
    return tr("Flange {pose}.", pose=where)


def told_after_jog(state: WizardState) -> str:
    """Return where it is, and how far it came since the robot arrived."""
    way, where = state.way_mm(), told_where(state)
    if way is None:
        return where
    far = mm(math.hypot(*way))
    if state.free_jog is not None:
        since = tr("Since start {mm} mm.", mm=far)
    else:
        since = tr("Since arrival {mm} mm.", mm=far)
    return f"{where} {since}"
