"""What a calibration shows and reports."""

from collections.abc import Mapping

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.nozzle_change import Proposal, ToolReport
from robolink_cli._render import say
from robolink_cli._tables import show_change
from robolink_cli._views import (
    offset_payload,
    proposal_payload,
    receipt_payload,
    verification_payload,
)


def show_proposal(proposal: Proposal) -> None:
    """Show what was measured next to what is stored."""
    show_change(
        proposal.tool,
        offset_payload(proposal.before),
        offset_payload(proposal.offset),
        after_name=tr("measured") if proposal.measured is None else tr("proposed"),
        unmeasured=proposal.kept,
    )
    for remark in (*proposal.notes, fit_sentence(proposal.result)):
        say(f"  {remark}")


def fit_sentence(result: CalibrationResult) -> str:
    """Return how far the measurement can be trusted, in one sentence."""
    if result.rms_mm is None:
        return tr(
            "two poses leave no residual: each placement error counts {gain:.2f} times",
            gain=result.sigma_gain,
        )
    return tr(
        "{count} poses agree within {rms:.3f} mm rms, {largest:.3f} mm at most",
        count=len(result.inputs),
        rms=result.rms_mm,
        largest=result.max_residual_mm,
    )


def doubts(proposal: Proposal) -> tuple[str, ...]:
    """Return what a proposal leaves in doubt, as sentences for a report."""
    if "small_rotation" in proposal.result.warnings:
        return (tr("The poses differ little in U; half a turn would be best."),)
    return ()


def show_report(report: ToolReport) -> None:
    """Say what was written and how the verification ended."""
    tool, receipt = report.proposal.tool, report.receipt
    if receipt is None:
        return
    if receipt.skipped:
        say(tr("Tool {tool} held this value already; nothing was written.", tool=tool))
    else:
        say(tr("Tool {tool} was written and read back.", tool=tool))
    if report.verification is None:
        say(tr("It was not verified."))
        return
    for drift in report.verification.drifts:
        say(
            tr(
                "  drift at U {u:.1f}: {distance:.3f} mm",
                u=drift.u_deg,
                distance=drift.distance_mm,
            )
        )
    say(
        tr(
            "Turned about the new tip it drifts {drift:.3f} mm at most ({limit:.3f} mm allowed).",
            drift=report.verification.max_drift_mm,
            limit=report.verification.tolerance_mm,
        )
    )


def report_payload(report: ToolReport) -> dict[str, object]:
    """Return the document of a finished calibration."""
    return {
        **proposal_payload(report.proposal),
        "write": receipt_payload(report.receipt) if report.receipt else None,
        "verification": verification_payload(report.verification),
    }


def show_plan(payload: Mapping[str, object]) -> None:
    """Show a dry run."""
    say(tr("Dry run; nothing is sent. The measurement of tool {tool}:", tool=payload["tool"]))
    show_steps(payload["steps"])


def show_steps(steps: object) -> None:
    """Show the steps of :func:`planned_steps`."""
    assert isinstance(steps, list)  # noqa: S101 - made by planned_steps
    for number, step in enumerate(steps, start=1):
        say(f"{number:3}. {step['text']}")
        for request in step["requests"]:
            say(f"       {request}")
        if step["refusal"]:
            say(f"       {step['refusal']}")
