"""Screens (h) and (i) as lines: what stands at the end, printed where it stays."""

from robolink.messages import tr
from robolink.model import describe_offset
from robolink.nozzle_change import ChangeReport, ToolReport
from robolink_cli.wizard.screens.rows import mm
from robolink_cli.wizard.screens.touching import touch_title
from robolink_cli.wizard.state import WizardState


def done_lines(state: WizardState, report: ChangeReport) -> list[str]:
    """Return what was reached."""
    ended = tr("DONE")
    head = f"{state.header.cell}   {state.header.job}   {ended}"
    lines = [head, *(line for one in report.tools for line in _tool_lines(one))]
    lines.append(tr("Record: change {id} in the journal", id=report.change[:8]))
    if any(one.receipt is not None for one in report.tools):
        back = tr(
            'To take it back: robolink -c "{cell}" undo {id}',
            cell=state.header.cell,
            id=report.change[:8],
        )
        lines.append(back)
        lines.append(tr("Run the first part slowly and look at it."))
    return lines


def _tool_lines(report: ToolReport) -> list[str]:
    proposal, proof = report.proposal, report.verification
    if report.receipt is None:
        return [tr("Tool {t} is measured. Nothing was written.", t=proposal.tool)]
    value = describe_offset(proposal.offset)
    if proof is None:
        said = tr("Tool {t} is measured and written, not tested.", t=proposal.tool)
    else:
        said = tr("Tool {t} is measured, written and tested.", t=proposal.tool)
    lines = [said, tr("On the controller: tool {t} = {value}", t=proposal.tool, value=value)]
    if proof is not None:
        lines.append(
            tr(
                "Turn test: {mm} mm off at most (limit {limit} mm)",
                mm=mm(proof.max_drift_mm),
                limit=mm(proof.tolerance_mm),
            )
        )
    return lines


def stopped_lines(state: WizardState) -> list[str]:
    """Return where it ended early; why, and what stands, says how every command ends."""
    ended = tr("STOPPED")
    head = f"{state.header.cell}   {state.header.job}   {ended}"
    touch = state.touch
    if touch is None or not touch.number:
        return [head]
    return [head, tr("It ended here: {touch}.", touch=touch_title(touch))]
