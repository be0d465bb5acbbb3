"""What a calibration shows and reports."""

from collections.abc import Mapping, Sequence

from robolink.calibration import (
    known_doubts,
    proved_statements,
    turn_test_headline,
    turn_test_sentences,
)
from robolink.calibration_run import (
    LimitVerdict,
    PlannedStep,
    Proposal,
    ToolReport,
    next_steps,
)
from robolink.messages import tr
from robolink.methods import NextStep
from robolink.model import ToolOffset, ToolReceipt, describe_offset
from robolink.runner import TeachPrompt
from robolink_cli.console.render import next_lines, note, say
from robolink_cli.prompts.present import present_desk
from robolink_cli.views.documents import (
    offset_payload,
    proposal_payload,
    receipt_payload,
    verification_payload,
)
from robolink_cli.views.fit import remarks, show_accuracy_rows, show_residuals
from robolink_cli.views.tables import show_change


def show_proposal(proposal: Proposal) -> None:
    """Show what was measured next to what is stored, how accurate it is, and what is in doubt."""
    show_change(
        proposal.tool,
        offset_payload(proposal.before),
        offset_payload(proposal.offset),
        after_name=tr("measured") if proposal.measured is None else tr("proposed"),
        unmeasured=proposal.kept,
    )
    result = proposal.result
    for remark in (*proposal.notes, *remarks(result)):
        say(f"  {remark}")
    if proposal.seating is not None:
        say(f"  {proposal.seating.sentence}")
    if result.residuals_mm:
        show_residuals(result)
    if result.accuracy is not None:
        show_accuracy_rows(result.accuracy)
    for sentence in known_doubts(result.warnings):
        say(f"  ! {sentence}")


def tell_written(receipt: ToolReceipt) -> None:
    """Tell whoever is guided what the controller reads back, before the turn test is made."""
    if present_desk() is None:
        return
    value = describe_offset(receipt.read_back or ToolOffset())
    told = tr(
        "Written. The controller now has tool {tool} = {value}.", tool=receipt.tool, value=value
    )
    note(told)


def show_verdicts(verdicts: Sequence[LimitVerdict]) -> None:
    """Show what the limits say about a proposal."""
    for verdict in verdicts:
        mark = tr("ok") if verdict.passed else tr("too much")
        say(
            tr(
                "  {name}: {found:.3f} mm, limit {limit:.3f} mm: {mark}",
                name=verdict.name,
                found=verdict.found_mm,
                limit=verdict.limit_mm,
                mark=mark,
            )
        )


def show_report(report: ToolReport) -> None:
    """Say what was written and how the verification ended."""
    tool, receipt = report.proposal.tool, report.receipt
    if receipt is None:
        return
    if receipt.skipped:
        say(tr("Tool {tool} has this value already. Nothing was written.", tool=tool))
    else:
        say(tr("Tool {tool} is written and read back.", tool=tool))
    if report.verification is None:
        say(tr("Not tested yet."))
    else:
        for drift in report.verification.drifts:
            say(
                tr(
                    "  at U {u:.1f}: {distance:.3f} mm off",
                    u=drift.u_deg,
                    distance=drift.distance_mm,
                )
            )
        say(turn_test_headline(report.verification))
        for sentence in turn_test_sentences(report.verification.judgement, report.proposal.result):
            say(f"  {sentence}")
        for sentence in proved_statements(report.proposal.result, report.verification):
            say(sentence)
    for line in next_lines(_steps(report)):
        say(line)


def judged_payload(proposal: Proposal, verdicts: Sequence[LimitVerdict]) -> dict[str, object]:
    """Return a proposal with what the limits say about it."""
    judged = [
        {
            "code": verdict.code,
            "found_mm": verdict.found_mm,
            "limit_mm": verdict.limit_mm,
            "passed": verdict.passed,
        }
        for verdict in verdicts
    ]
    return {**proposal_payload(proposal), "verdicts": judged}


def report_payload(report: ToolReport) -> dict[str, object]:
    """Return the document of a finished calibration."""
    return {
        **judged_payload(report.proposal, report.verdicts),
        "write": receipt_payload(report.receipt) if report.receipt else None,
        "verification": verification_payload(report.verification),
        **_following(report),
    }


def _steps(report: ToolReport) -> tuple[NextStep, ...]:
    """Return what a person does next with a tool that was written."""
    return next_steps(report.proposal.result, report.proposal.tool) if report.receipt else ()


def _following(report: ToolReport) -> dict[str, object]:
    steps = _steps(report)
    return {"next_steps": [step.as_json() for step in steps]} if steps else {}


def show_course(steps: Sequence[PlannedStep]) -> None:
    """Say how a measurement will go, before anybody is asked."""
    moves = sum(step.target is not None for step in steps)
    asks = sum(step.shown is TeachPrompt.PIN for step in steps)
    ways = sum(step.shown in (TeachPrompt.ALONG_X, TeachPrompt.ALONG_Z) for step in steps)
    if ways:
        plan = tr(
            "Touches of the pin by you: {asks}. Ways along the tool's axes shown by you: "
            "{ways}. Moves of the robot by itself: {moves}.",
            asks=asks,
            ways=ways,
            moves=moves,
        )
    elif asks:
        plan = tr(
            "Touches of the pin by you: {asks}. Moves of the robot by itself: {moves}.",
            asks=asks,
            moves=moves,
        )
    else:
        plan = tr("Moves of the robot by itself: {moves}. Nobody touches anything.", moves=moves)
    note(tr("{plan} All moves stay in the allowed area.", plan=plan))


def show_plan(payload: Mapping[str, object]) -> None:
    """Show a dry run."""
    say(tr("Dry run; nothing is sent. The measurement of tool {tool}:", tool=payload["tool"]))
    show_steps(payload["steps"])


def show_steps(steps: object) -> None:
    """Show the steps of :mod:`robolink_cli.views.planned_steps`."""
    assert isinstance(steps, list)  # noqa: S101 - made by planned_steps
    for number, step in enumerate(steps, start=1):
        say(f"{number:3}. {step['text']}")
        for request in step["requests"]:
            say(f"       {request}")
        if step["refusal"]:
            say(f"       {step['refusal']}")
    say(
        tr(
            "These steps measure. What is written afterwards, and the turn test if there is one, "
            "depend on the result."
        )
    )
