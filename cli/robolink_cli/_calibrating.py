"""A calibration on a terminal: who is asked, what is shown, what is reported."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

from robolink.calibration import Impact, TouchPlan
from robolink.controllers.epson import EpsonController
from robolink.errors import ConfigError, ReservedToolError, ToolIndexError
from robolink.messages import tr
from robolink.model import Pose
from robolink.nozzle_change import ChangePlan, ChangeReport, NozzleChange, Proposal, preview
from robolink.runner import Operator
from robolink_cli._impacting import ImpactRequest, impact_payload, judge, show_impact
from robolink_cli._operator import AssistedOperator, terminal
from robolink_cli._render import note, say
from robolink_cli._reporting import Draft
from robolink_cli._safekeeping import back_up_first
from robolink_cli._tables import show_change
from robolink_cli._views import (
    offset_payload,
    pose_payload,
    proposal_payload,
    receipt_payload,
    verification_payload,
)


def plan_from(
    tool: int,
    *,
    turn_deg: float,
    lift_mm: float,
    clearance_mm: float,
    speed_mm_s: float,
    box_mm: float,
    max_change_mm: float,
    tolerance_mm: float,
    no_verify: bool,
) -> ChangePlan:
    """Return the plan that the options of the command describe.

    Raises:
        ReservedToolError, ToolIndexError: There is no such tool to calibrate.
        ConfigError: The clearance is not below the lift.
    """
    if tool == 0:
        raise ReservedToolError(
            tr("Tool 0 is the flange itself and is never written."),
            remedy=tr("Choose a tool from 1 to 15."),
        )
    if not 1 <= tool <= 15:
        raise ToolIndexError(
            tr("There is no tool {tool}.", tool=tool),
            remedy=tr("EPSON controllers have tools 1 to 15."),
        )
    if clearance_mm >= lift_mm:
        raise ConfigError(
            tr("The clearance must be smaller than the lift."),
            remedy=tr("For example --lift 10 --clearance 2."),
        )
    return ChangePlan(
        tool,
        touch=TouchPlan(lift_mm=lift_mm, clearance_mm=clearance_mm, turn_deg=turn_deg),
        max_change_mm=max_change_mm,
        drift_tolerance_mm=tolerance_mm,
        verify=not no_verify,
        box_mm=box_mm,
        speed_mm_s=speed_mm_s,
    )


class Bench:
    """One calibration of one tool, as a command runs it."""

    def __init__(
        self,
        controller: EpsonController,
        plan: ChangePlan,
        *,
        draft: Draft,
        assist_url: str | None = None,
        impact: ImpactRequest | None = None,
    ) -> None:
        self._controller = controller
        self._plan = plan
        self._draft = draft
        self._assist_url = assist_url
        self._impact_request = impact
        self._points: dict[int, Pose | None] | None = None
        self._impact: Impact | None = None
        self._report: ChangeReport | None = None

    def require_writable(self) -> None:
        """Refuse before anything moves what would be refused at the write; back up first.

        Raises:
            ConfigError: The backup before the first write cannot be stored.
            OutcomeUnknownError: Something earlier is unsettled.
            NotReadyError: The state forbids it.
        """
        self._controller.require_settled(tr("calibrate tool {tool}", tool=self._plan.tool))
        self._controller.tools.read(self._plan.tool)
        back_up_first(self._controller)

    def dry_run(self) -> dict[str, object]:
        """Return the foreseen steps with their requests and limit checks; reads only."""
        group = self._controller.groups[0]
        steps: list[dict[str, object]] = []
        for step in preview(self._controller, self._plan):
            requests: list[str] = []
            if step.target is not None and step.profile is not None:
                requests = [
                    self._controller.wire("Execute", statement)
                    for statement in group.statements_for(step.target, step.profile)
                ]
            target = pose_payload(step.target) if step.target else None
            steps.append(
                {
                    "text": step.text,
                    "target": target,
                    "requests": requests,
                    "refusal": step.refusal,
                }
            )
        return {"dry_run": True, "tool": self._plan.tool, "steps": steps}

    def run(self, *, ask_before_write: bool) -> dict[str, object]:
        """Measure, propose, write, verify; return the document of the whole."""
        if self._impact_request is not None:
            self._points = self._impact_request.read(self._controller)
        with self._operator() as operator:
            change = NozzleChange(
                self._controller,
                replace(self._plan, ask_before_write=ask_before_write),
                operator=operator,
                show=self._show_proposal,
                on_result=self._draft.note_result,
            )
            self._report = change.run()
        return {
            **report_payload(self._report),
            "source": {"kind": "live"},
            "impact": impact_payload(self._impact) if self._impact else None,
        }

    def show_end(self) -> None:
        """Say how it ended."""
        if self._report is not None:
            show_report(self._report)

    @contextmanager
    def _operator(self) -> Iterator[Operator]:
        if self._assist_url is None:
            yield terminal()
            return
        from robolink_simulators.assist import open_eyes

        with open_eyes(self._assist_url) as eyes:

            def look() -> tuple[float, float, float]:
                seen = eyes.look(self._plan.tool)
                return seen.dx_mm, seen.dy_mm, seen.dz_mm

            yield AssistedOperator(look, note)

    def _show_proposal(self, proposal: Proposal) -> None:
        show_proposal(proposal)
        self._impact = judge(self._points, old=proposal.before, new=proposal.result.offset)
        if self._impact is not None:
            show_impact(proposal.tool, self._impact)
        self._draft.propose(
            proposal,
            source=tr("measured on the robot: one pin touched at two angles of U"),
            warnings=doubts(proposal),
            impact=self._impact,
        )


def show_proposal(proposal: Proposal) -> None:
    """Show what was measured next to what is stored."""
    show_change(
        proposal.tool,
        offset_payload(proposal.before),
        offset_payload(proposal.result.offset),
        after_name=tr("measured"),
        unmeasured=proposal.result.kept,
    )
    say(
        tr(
            "  two poses leave no residual: each placement error counts {gain:.2f} times",
            gain=proposal.result.sigma_gain,
        )
    )


def doubts(proposal: Proposal) -> tuple[str, ...]:
    """Return what a proposal leaves in doubt, as sentences for a report."""
    if "small_rotation" in proposal.result.warnings:
        return (tr("The poses differ little in U; half a turn would be best."),)
    return ()


def show_report(report: ChangeReport) -> None:
    """Say what was written and how the verification ended."""
    tool = report.receipt.tool
    if report.receipt.skipped:
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


def report_payload(report: ChangeReport) -> dict[str, object]:
    """Return the document of a finished calibration."""
    return {
        **proposal_payload(report.proposal),
        "write": receipt_payload(report.receipt),
        "verification": verification_payload(report.verification),
    }


def show_plan(payload: Mapping[str, object]) -> None:
    """Show a dry run."""
    steps = payload["steps"]
    assert isinstance(steps, list)  # noqa: S101 - made by Bench.dry_run
    say(tr("Dry run; nothing is sent. The measurement of tool {tool}:", tool=payload["tool"]))
    for number, step in enumerate(steps, start=1):
        say(f"{number:3}. {step['text']}")
        for request in step["requests"]:
            say(f"       {request}")
        if step["refusal"]:
            say(f"       {step['refusal']}")
