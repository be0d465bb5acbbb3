"""Screen (b): what is looked at before the robot starts."""

from robolink.messages import tr
from robolink_cli.console.columns import columns, padded
from robolink_cli.wizard.check_list import CheckPoint, CheckSubject, Mark
from robolink_cli.wizard.screens.layout import Screen, broken
from robolink_cli.wizard.screens.rows import JobStep, status_row, title_row
from robolink_cli.wizard.state import WizardState


def check_screen(state: WizardState, subject: CheckSubject, now_s: float) -> Screen:
    """Return the screen of the check list."""
    left = len(subject.open_keys(state.checked))
    rows = [row for point in subject.points for row in point_rows(point, state.checked)]
    start = tr("Start moving ({n} open)", n=left) if left else tr("Start moving")
    return Screen(
        title_row(state, tr("Check"), JobStep.CHECK),
        (*rows, "", *broken(subject.plan), tr("Keep a hand near the emergency stop.")),
        (("5", start), ("0", tr("Leave"))),
        status=status_row(state, now_s),
        message=state.message,
    )


def mark_of(point: CheckPoint, checked: frozenset[str]) -> str:
    """Return the word for how a point stands."""
    if point.mark is Mark.OK or point.key in checked:
        return tr("OK")
    if point.mark is Mark.LOOK:
        return tr("LOOK")
    return tr("TO DO") if point.mark is Mark.TO_DO else tr("YOU")


def point_rows(point: CheckPoint, checked: frozenset[str]) -> list[str]:
    """Return a point, broken to two rows where it is long."""
    key = f"[{point.key}] {point.does}" if point.key else ""
    first, *rest = broken(point.text, 71 - (columns(key) + 2 if key else 0))
    row = padded(f" {padded(mark_of(point, checked), 7)}{first}", 79 - columns(key)) + key
    return [row, *(f"         {more}" for more in rest)]
