"""Screens (h) and (i): the end of a job."""

from robolink.messages import joined, tr
from robolink_cli.wizard.happenings import WizardCommand
from robolink_cli.wizard.screens.layout import Screen, keys_of, title_row
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.views.records import EndView, View


def end_screen(view: View, body: EndView) -> Screen:
    """Return the last screen."""
    return Screen(title_row(view.head), body.lines, keys_of(view), message=view.message)


def told_end(state: WizardState) -> str:
    """Return what can be typed at the end of a finished job."""
    words = []
    if WizardCommand.SHOW_REPORT in state.offers:
        words.append(tr("report = show the report."))
    if WizardCommand.NEXT_TOOL in state.offers:
        words.append(tr("next = next tool."))
    return joined(" ", (*words, tr("finish = leave.")))
