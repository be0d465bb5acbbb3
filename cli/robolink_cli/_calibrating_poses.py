"""A calibration from poses that exist already: nothing moves, no tool is selected."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from robolink.calibration import ToolFit
from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.model import Controller
from robolink.nozzle_change import (
    Bench,
    ChangePlan,
    Gate,
    GivenPoses,
    Listener,
    Moment,
    NozzleChange,
    Proposal,
    ToolPlan,
    ToolReport,
)
from robolink.transaction import earlier_corrections
from robolink_cli._calibrating import CalibrationListener
from robolink_cli._calibration_views import doubts, report_payload
from robolink_cli._consent import agree, on_terminal
from robolink_cli._context import CliContext, open_controller
from robolink_cli._impacting import ImpactRequest, impact_payload, show_impact
from robolink_cli._notices import note_change
from robolink_cli._operator import terminal
from robolink_cli._pose_source import PoseSource
from robolink_cli._render import note, say
from robolink_cli._reporting import Draft, ReportRequest, reporting
from robolink_cli._safekeeping import back_up_first
from robolink_cli._views import proposal_payload


@dataclass(frozen=True, slots=True)
class PosesPlan:
    """What to find out from poses that exist.

    Attributes:
        tool: Number of the tool whose nozzle was changed.
        taught_tool: The tool whose tip the poses describe; 0 when they are flange poses.
        gate: What is believed.
    """

    tool: int
    taught_tool: int
    gate: Gate


class _PosesListener(CalibrationListener):
    """Shows what the poses say, warns of another tool, and asks before the write."""

    def __init__(
        self,
        draft: Draft,
        plan: PosesPlan,
        given: GivenPoses,
        *,
        controller: Controller,
        impact: ImpactRequest | None,
        yes: bool,
    ) -> None:
        super().__init__(draft, impact)
        self._controller = controller
        self._plan = plan
        self._given = given
        self._yes = yes

    @property
    def better(self) -> ToolFit | None:
        """A tool that fits the poses much better than the one named."""
        return self._given.found.better if self._given.found else None

    @property
    def fits(self) -> tuple[ToolFit, ...]:
        """Which tools the poses may have been taught with, the likeliest first."""
        return self._given.found.fits if self._given.found else ()

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        (proposal,) = proposals
        note_change(self._controller, proposal.tool, proposal.before)
        self.propose(proposal, source=self._given.sentence, warnings=self._doubts(proposal))
        if "small_rotation" in proposal.result.warnings:
            say(tr("  the poses differ little in U; half a turn would be best"))
        if self.better is not None:
            _warn_of_other_tool(self._plan, self.better, proposal.change_mm)
        if self.impact is not None:
            show_impact(self._plan.tool, self.impact)

    def moment(self, moment: Moment, bench: Bench, tool: int | None = None) -> None:  # noqa: ARG002 - one tool only
        if moment is Moment.BEFORE_WRITE:
            _agree_to_write(self._plan.tool, yes=self._yes)
            back_up_first(bench.controller)

    def _doubts(self, proposal: Proposal) -> tuple[str, ...]:
        known = doubts(proposal)
        if self.better is None:
            return known
        other = tr(
            "These poses fit tool {better} much better than tool {taught}.",
            better=self.better.tool,
            taught=self._plan.taught_tool,
        )
        return (*known, other)


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
    with (
        open_controller(context, changes=not dry_run) as controller,
        reporting(report, controller) as draft,
    ):
        given = GivenPoses(
            lambda: source.poses(controller),
            taught_tool=plan.taught_tool,
            plausible_mm=plan.gate.limit_mm,
            sentence=source.sentence(plan.taught_tool),
        )
        listener = _PosesListener(draft, plan, given, controller=controller, impact=impact, yes=yes)
        listener.read_points(controller)
        if dry_run:
            payload = _dry_run(controller, plan, given, listener, quiet=context.json)
        else:
            done = _carry_out(controller, plan, given, listener)
            payload = report_payload(done)
            # Now, because Ctrl-C may come before the logout is answered.
            _show_end(done)
    extra = _extra(plan, source, listener) | {"report": draft.saved}
    if dry_run:
        _show_dry_run(context, {**payload, **extra})
    else:
        context.emit("calibration", {**payload, **extra}, lambda: None)


def _carry_out(
    controller: Controller, plan: PosesPlan, given: GivenPoses, listener: Listener
) -> ToolReport:
    one = ToolPlan(plan.tool, given, plan.gate, verify=False)
    change = NozzleChange(
        controller,
        ChangePlan((one,), ask_before_write=False),
        operator=terminal(),
        listener=listener,
        earlier=partial(earlier_corrections, controller),
    )
    (report,) = change.run().tools
    return report


def _dry_run(
    controller: Controller,
    plan: PosesPlan,
    given: GivenPoses,
    listener: Listener,
    *,
    quiet: bool,
) -> dict[str, object]:
    """Propose and judge; return the document with what would be sent."""
    before = controller.tools.read(plan.tool)
    given.found = given.find(controller, plan.tool, before)
    proposal = Proposal(plan.tool, before, given.found.result)
    if not quiet:
        listener.proposed([proposal])
    plan.gate.judge_change(proposal, remedy=given.remedy)
    requests = list(controller.tools.preview_write(plan.tool, proposal.offset))
    return {"dry_run": True, "requests": requests, **proposal_payload(proposal)}


def _extra(plan: PosesPlan, source: PoseSource, listener: _PosesListener) -> dict[str, object]:
    better, impact = listener.better, listener.impact
    return {
        "source": source.payload(plan.taught_tool),
        "tool_fits": [{"tool": fit.tool, "change_mm": fit.change_mm} for fit in listener.fits],
        "better_tool": None if better is None else better.tool,
        "impact": impact_payload(impact) if impact else None,
    }


def _warn_of_other_tool(plan: PosesPlan, better: ToolFit, change_mm: float | None) -> None:
    note(
        tr(
            "Warning: these poses fit tool {better} much better than tool {taught}.\n"
            "  Taught with tool {better}, tool {tool} would have changed by {small:.3f} mm; "
            "taught with tool {taught}, by {large:.3f} mm.\n"
            "  If tool {better} was selected on the pendant, write nothing and give "
            "--taught-tool {better}.",
            better=better.tool,
            taught=plan.taught_tool,
            tool=plan.tool,
            small=better.change_mm,
            large=change_mm,
        )
    )


def _show_dry_run(context: CliContext, payload: dict[str, object]) -> None:
    requests = payload["requests"]
    assert isinstance(requests, list)  # noqa: S101 - made by _dry_run

    def show() -> None:
        if requests:
            say(tr("Dry run; this would be sent:"))
            say("\n".join(f"  {request}" for request in requests))
        else:
            say(tr("Dry run; the value is stored already, nothing would be sent."))

    context.emit("dry-run", payload, show)


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


def _show_end(report: ToolReport) -> None:
    tool = report.proposal.tool
    if report.receipt is not None and report.receipt.skipped:
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
