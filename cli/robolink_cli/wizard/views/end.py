"""The view of how a job ended."""

from collections.abc import Iterator

from robolink.messages import tr
from robolink_cli.wizard.happenings import WizardCommand
from robolink_cli.wizard.state import LastScreen, WizardState
from robolink_cli.wizard.views.frame import Part, leaves
from robolink_cli.wizard.views.records import Action, AngleRow, EndView, Weight


def end_part(state: WizardState, ended: LastScreen) -> Part:
    """Return the view of the end."""
    if ended.done:
        actions = (Action("finish", tr("Finish"), key="5", weight=Weight.MAIN), *_offered(state))
    else:
        again = Action("begin_again", tr("Start again"), key="5", weight=Weight.MAIN)
        actions = (*((again,) if ended.again else ()), leaves(tr("Leave")))
    return Part(ended.headed, _body(state, ended), actions)


def _offered(state: WizardState) -> Iterator[Action]:
    if WizardCommand.SHOW_REPORT in state.offers:
        yield Action("report", tr("Show the report"), key=".")
    if WizardCommand.NEXT_TOOL in state.offers:
        yield Action("next", tr("Next tool"), key="+")


def _body(state: WizardState, ended: LastScreen) -> EndView:
    report = state.report
    change = "" if report is None else report.change
    tested = [one for one in (report.tools if report is not None else ()) if one.verification]
    if not tested:
        return EndView(ended.done, ended.headed, ended.lines, ended.blocked, change)
    (proof, before_mm), *_ = ((one.verification, one.proposal.change_mm) for one in tested)
    assert proof is not None  # noqa: S101 - those without one were left out
    within = proof.tolerance_mm
    angles = tuple(
        AngleRow(
            one.u_deg,
            one.distance_mm,
            tr("OK") if one.distance_mm <= within else tr("over the limit"),
            one.distance_mm <= within,
        )
        for one in proof.drifts
    )
    return EndView(
        ended.done,
        ended.headed,
        ended.lines,
        ended.blocked,
        change,
        angles,
        before_mm,
        proof.max_drift_mm,
        within,
    )
