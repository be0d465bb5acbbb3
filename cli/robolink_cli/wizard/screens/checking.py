"""Screen (b): what is looked at before the robot starts."""

from robolink.messages import tr
from robolink_cli.console.columns import padded
from robolink_cli.wizard.check_list import CheckPoint, CheckSubject, Mark
from robolink_cli.wizard.screens.layout import Screen, broken
from robolink_cli.wizard.screens.rows import JobStep, status_row, title_row
from robolink_cli.wizard.state import WizardState


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
    """Return what the main key does on the marked row; nothing where none is marked."""
    if state.marked is None:
        return ()
    if here is None:
        return (("5", start),)
    return (("5", tr("Take it back") if here.name in state.checked else here.does),)


def mark_of(point: CheckPoint, checked: frozenset[str]) -> str:
    """Return the word for how a point stands."""
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
