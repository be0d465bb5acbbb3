"""A calibration on a terminal: who is asked, what is shown, what is reported."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

from robolink.calibration import Impact, TouchPlan, VerifyResult
from robolink.errors import ConfigError, ReservedToolError, ToolIndexError
from robolink.messages import tr
from robolink.model import Controller, Pose, ToolReceipt
from robolink.nozzle_change import (
    ChangePlan,
    Gate,
    Limits,
    Listener,
    NozzleChange,
    PinAndPerson,
    Proposal,
    ToolPlan,
    ToolReport,
    preview,
)
from robolink.runner import Operator
from robolink.transaction import earlier_corrections
from robolink_cli._calibration_views import doubts, report_payload, show_proposal, show_report
from robolink_cli._impacting import ImpactRequest, impact_payload, judge, show_impact
from robolink_cli._notices import note_change
from robolink_cli._operator import AssistedOperator, terminal
from robolink_cli._render import note
from robolink_cli._reporting import Draft
from robolink_cli._safekeeping import back_up_first
from robolink_cli._views import (
    pose_payload,
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
    jump_limit_mm: float,
) -> ChangePlan:
    """Return the plan that the options of the command describe.

    A larger ``max_change_mm`` than ``jump_limit_mm``, the cell's own, takes an engineer.

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
            remedy=tr("Choose a tool from 1 to 15."),
        )
    if clearance_mm >= lift_mm:
        raise ConfigError(
            tr("The clearance must be smaller than the lift."),
            remedy=tr("For example --lift 10 --clearance 2."),
        )
    source = PinAndPerson(TouchPlan(lift_mm=lift_mm, clearance_mm=clearance_mm, turn_deg=turn_deg))
    gate = Gate(
        max_change_mm=min(max_change_mm, jump_limit_mm),
        accepted_change_mm=max_change_mm,
        drift_tolerance_mm=tolerance_mm,
    )
    return ChangePlan(
        (ToolPlan(tool, source, gate, verify=not no_verify),),
        limits=Limits(box_mm=box_mm, speed_mm_s=speed_mm_s),
    )


class CalibrationListener(Listener):
    """Shows a calibration as it goes, and collects it for a report.

    Attributes:
        impact: What the change means for taught points, once it was proposed.
    """

    def __init__(self, draft: Draft, impact: ImpactRequest | None) -> None:
        self._draft = draft
        self._request = impact
        self._points: dict[int, Pose | None] | None = None
        self.impact: Impact | None = None

    def read_points(self, controller: Controller) -> None:
        """Read the taught points on which the change is to be judged."""
        if self._request is not None:
            self._points = self._request.read(controller)

    def wrote(self, receipt: ToolReceipt) -> None:
        """Note it for the report."""
        self._draft.note_result(receipt)

    def verified(self, tool: int, result: VerifyResult) -> None:  # noqa: ARG002 - one tool only
        """Note it for the report."""
        self._draft.note_result(result)

    def propose(self, proposal: Proposal, *, source: str, warnings: tuple[str, ...]) -> None:
        """Show the proposal and what it means for taught points."""
        self.impact = judge(self._points, old=proposal.before, new=proposal.offset)
        self._draft.propose(proposal, source=source, warnings=warnings, impact=self.impact)
        show_proposal(proposal)


class _LiveListener(CalibrationListener):
    def proposed(self, proposals: Sequence[Proposal]) -> None:
        (proposal,) = proposals
        source = tr("measured on the robot: one pin touched at two angles of U")
        self.propose(proposal, source=source, warnings=doubts(proposal))
        if self.impact is not None:
            show_impact(proposal.tool, self.impact)


class LiveCalibration:
    """One calibration of one tool by a person at a pin, as a command runs it."""

    def __init__(
        self,
        controller: Controller,
        plan: ChangePlan,
        *,
        draft: Draft,
        assist_url: str | None = None,
        impact: ImpactRequest | None = None,
    ) -> None:
        self._controller = controller
        self._plan = plan
        self._assist_url = assist_url
        self._listener = _LiveListener(draft, impact)
        self._report: ToolReport | None = None

    @property
    def tool(self) -> int:
        """Number of the tool."""
        return self._plan.tools[0].tool

    def require_writable(self) -> None:
        """Refuse before anything moves what would be refused at the write; back up first.

        Raises:
            ConfigError: The backup before the first write cannot be stored.
            OutcomeUnknownError: Something earlier is unsettled.
            NotReadyError: The state forbids it.
        """
        self._controller.require_settled(tr("calibrate tool {tool}", tool=self.tool))
        note_change(self._controller, self.tool, self._controller.tools.read(self.tool))
        back_up_first(self._controller)

    def dry_run(self) -> dict[str, object]:
        """Return the foreseen steps with their requests and limit checks; reads only."""
        steps = planned_steps(self._controller, self._plan)
        return {"dry_run": True, "tool": self.tool, "steps": steps}

    def run(self, *, ask_before_write: bool) -> dict[str, object]:
        """Measure, propose, write, verify; return the document of the whole."""
        self._listener.read_points(self._controller)
        with operator_at(self._assist_url, lambda: self.tool) as operator:
            change = NozzleChange(
                self._controller,
                replace(self._plan, ask_before_write=ask_before_write),
                operator=operator,
                listener=self._listener,
                earlier=partial(earlier_corrections, self._controller),
            )
            (self._report,) = change.run().tools
        impact = self._listener.impact
        return {
            **report_payload(self._report),
            "source": {"kind": "live"},
            "impact": impact_payload(impact) if impact else None,
        }

    def show_end(self) -> None:
        """Say how it ended."""
        if self._report is not None:
            show_report(self._report)


def planned_steps(controller: Controller, plan: ChangePlan) -> list[dict[str, object]]:
    """Return the foreseen steps of a plan with their requests and limit checks; reads only."""
    group = controller.groups[0]
    steps: list[dict[str, object]] = []
    for step in preview(controller, plan):
        requests = list(step.requests(group))
        target = pose_payload(step.target) if step.target else None
        steps.append(
            {"text": step.text, "target": target, "requests": requests, "refusal": step.refusal}
        )
    return steps


@contextmanager
def operator_at(assist_url: str | None, tool: Callable[[], int]) -> Iterator[Operator]:
    """Yield the person at the terminal, or a simulator's stand-in for one.

    Args:
        assist_url: The simulator's assist URL, ``None`` for a real person.
        tool: Tells which tip the stand-in is to look at.
    """
    if assist_url is None:
        yield terminal()
        return
    from robolink_simulators.assist import open_eyes

    with open_eyes(assist_url) as eyes:

        def look() -> tuple[float, float, float]:
            seen = eyes.look(tool())
            return seen.dx_mm, seen.dy_mm, seen.dz_mm

        yield AssistedOperator(look, note)
