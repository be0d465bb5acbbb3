"""A calibration from poses that exist already: nothing moves, no tool is selected."""

from robolink.calibration import Impact
from robolink.controllers.epson import EpsonController
from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.nozzle_change import (
    ChangeReport,
    PosesPlan,
    PosesProposal,
    Proposal,
    propose_from_poses,
    require_plausible,
    write_proposal,
)
from robolink_cli._calibrating import doubts, report_payload, show_proposal
from robolink_cli._consent import agree, on_terminal
from robolink_cli._context import CliContext, open_controller
from robolink_cli._impacting import ImpactRequest, impact_payload, judge, show_impact
from robolink_cli._pose_source import PoseSource
from robolink_cli._render import note, say
from robolink_cli._reporting import ReportRequest, reporting
from robolink_cli._safekeeping import back_up_first
from robolink_cli._views import proposal_payload


def calibrate_from_poses(
    context: CliContext,
    plan: PosesPlan,
    source: PoseSource,
    *,
    impact: ImpactRequest | None,
    report: ReportRequest | None,
    dry_run: bool,
    yes: bool,
) -> None:
    """Propose, ask, write and read back.

    Raises:
        CalibrationError: The poses give no trustworthy result; nothing was written.
        DeclinedError: A person said no, or nobody could be asked.
        ToolChangedError: The tool was changed meanwhile; nothing was written.
    """
    with open_controller(context) as controller, reporting(report, controller) as draft:
        if not dry_run:
            controller.require_settled(tr("calibrate tool {tool}", tool=plan.tool))
        proposed = propose_from_poses(controller, plan, source.poses(controller))
        points = impact.read(controller) if impact else None
        judged = judge(points, old=proposed.proposal.before, new=proposed.proposal.result.offset)
        extra = _extra(proposed, source, judged)
        draft.propose(
            proposed.proposal,
            source=source.sentence(plan.taught_tool),
            warnings=_doubts(proposed),
            impact=judged,
        )
        if not (dry_run and context.json):
            _show(proposed, judged)
        require_plausible(proposed)
        if dry_run:
            requests = _requests(controller, proposed.proposal)
        else:
            done = _write(controller, proposed.proposal, yes=yes)
            draft.note_result(done.receipt)
    extra["report"] = draft.saved
    if dry_run:
        _show_dry_run(context, requests, {**proposal_payload(proposed.proposal), **extra})
    else:
        context.emit("calibration", {**report_payload(done), **extra}, lambda: None)


def _extra(proposed: PosesProposal, source: PoseSource, judged: Impact | None) -> dict[str, object]:
    better = proposed.better
    return {
        "source": source.payload(proposed.plan.taught_tool),
        "tool_fits": [{"tool": fit.tool, "change_mm": fit.change_mm} for fit in proposed.fits],
        "better_tool": None if better is None else better.tool,
        "impact": impact_payload(judged) if judged else None,
    }


def _show(proposed: PosesProposal, judged: Impact | None) -> None:
    show_proposal(proposed.proposal)
    if "small_rotation" in proposed.proposal.result.warnings:
        say(tr("  the poses differ little in U; half a turn would be best"))
    if proposed.better is not None:
        _warn_of_other_tool(proposed)
    if judged is not None:
        show_impact(proposed.plan.tool, judged)


def _warn_of_other_tool(proposed: PosesProposal) -> None:
    assert proposed.better is not None  # noqa: S101 - asked by the caller
    note(
        tr(
            "Warning: these poses fit tool {better} much better than tool {taught}.\n"
            "  Taught with tool {better}, tool {tool} would have changed by {small:.3f} mm; "
            "taught with tool {taught}, by {large:.3f} mm.\n"
            "  If tool {better} was selected on the pendant, write nothing and give "
            "--taught-tool {better}.",
            better=proposed.better.tool,
            taught=proposed.plan.taught_tool,
            tool=proposed.plan.tool,
            small=proposed.better.change_mm,
            large=proposed.proposal.change_mm,
        )
    )


def _doubts(proposed: PosesProposal) -> tuple[str, ...]:
    known = doubts(proposed.proposal)
    if proposed.better is None:
        return known
    other = tr(
        "These poses fit tool {better} much better than tool {taught}.",
        better=proposed.better.tool,
        taught=proposed.plan.taught_tool,
    )
    return (*known, other)


def _requests(controller: EpsonController, proposal: Proposal) -> list[str]:
    statements = controller.tools.preview_write(proposal.tool, proposal.result.offset)
    return [controller.wire("Execute", statement) for statement in statements]


def _show_dry_run(context: CliContext, requests: list[str], payload: dict[str, object]) -> None:
    def show() -> None:
        if requests:
            say(tr("Dry run; this would be sent:"))
            say("\n".join(f"  {request}" for request in requests))
        else:
            say(tr("Dry run; the value is stored already, nothing would be sent."))

    context.emit("dry-run", {"dry_run": True, "requests": requests, **payload}, show)


def _write(controller: EpsonController, proposal: Proposal, *, yes: bool) -> ChangeReport:
    _agree_to_write(proposal.tool, yes=yes)
    back_up_first(controller)
    done = write_proposal(controller, proposal)
    # Now, because Ctrl-C may come before the logout is answered.
    _show_end(done)
    return done


def _agree_to_write(tool: int, *, yes: bool) -> None:
    """Ask before the write; off a terminal only ``--yes`` is consent.

    Nobody watched these poses being taken, so the command alone is not the consent.
    """
    if yes:
        return
    if not on_terminal():
        raise DeclinedError(
            tr("Tool {tool} would be written, and nobody can be asked here.", tool=tool),
            remedy=tr("Run it on a terminal, or give --yes. Nothing was written."),
        )
    agree(tr("Write this to tool {tool}?", tool=tool), yes=False)


def _show_end(report: ChangeReport) -> None:
    tool = report.receipt.tool
    if report.receipt.skipped:
        say(tr("Tool {tool} held this value already; nothing was written.", tool=tool))
    else:
        say(tr("Tool {tool} was written and read back.", tool=tool))
    say(
        tr(
            "Nothing moved, so it was not proved by turning about the new tip. To prove it, turn "
            "the tip on a pin in tool {tool}, or run 'robolink calibrate two-pose --tool {tool}'.",
            tool=tool,
        )
    )
