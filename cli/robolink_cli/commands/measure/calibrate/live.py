"""A calibration in which the robot moves: plan, consent, measurement, proposal, write, proof."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from robolink.backup import keep_first_backup
from robolink.calibration import known_doubts
from robolink.calibration_run import (
    ChangePlan,
    ChangeReport,
    NozzleChange,
    Proposal,
    ToolReport,
    preview,
    require_inside,
    require_ready,
)
from robolink.messages import tr
from robolink.methods import find_method
from robolink.model import Controller
from robolink.procedures import TipSource
from robolink.transaction import Order, earlier_corrections
from robolink_cli.access.warnings import note_change
from robolink_cli.commands.measure.calibrate.listener import CalibrationListener
from robolink_cli.commands.measure.calibrate.request import CalibrationRequest
from robolink_cli.commands.measure.calibrate.stations import remark_on_pin
from robolink_cli.console.render import note
from robolink_cli.options.impact import ImpactRequest, impact_payload, show_impact
from robolink_cli.options.report import ReportDraft, reporting
from robolink_cli.prompts.operator import operator_at
from robolink_cli.prompts.present import present_desk
from robolink_cli.session.check_before_start import agree_to_procedure
from robolink_cli.session.context import guided_if_alone
from robolink_cli.session.opening import open_controller
from robolink_cli.session.ordering import ordered, show_done, with_order
from robolink_cli.views.fit import (
    report_payload,
    show_course,
    show_plan,
    show_report,
)
from robolink_cli.views.planned_steps import steps_payload


class _LiveListener(CalibrationListener):
    def __init__(self, draft: ReportDraft, plan: ChangePlan, impact: ImpactRequest | None) -> None:
        super().__init__(draft, plan.tools[0].criteria, impact)
        self._source = plan.tools[0].source

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        (proposal,) = proposals
        self.propose(
            proposal, source=self._source.sentence, warnings=known_doubts(proposal.result.warnings)
        )
        if self.impact is not None:
            show_impact(proposal.tool, self.impact)


class LiveCalibration:
    """One calibration of one tool by the robot, as a command runs it."""

    def __init__(
        self,
        controller: Controller,
        plan: ChangePlan,
        *,
        draft: ReportDraft,
        assist_url: str | None = None,
        impact: ImpactRequest | None = None,
        order: Order | None = None,
    ) -> None:
        self._controller = controller
        self._order = order
        self._plan = plan
        self._assist_url = assist_url
        self._listener = _LiveListener(draft, plan, impact)
        self._report: ToolReport | None = None

    @property
    def tool(self) -> int:
        """Number of the tool."""
        return self._plan.tools[0].tool

    def require_writable(self) -> None:
        """Refuse before anything moves what would be refused at the write; back up first.

        Raises:
            CalibrationError: A camera is not there, or means nothing.
            ConfigError: The backup before the first write cannot be stored.
            NotReadyError: The state forbids it.
        """
        require_ready(self._controller, self._plan)
        note_change(self._controller, self.tool, self._controller.tools.read(self.tool))
        keep_first_backup(self._controller, tell=note)

    def dry_run(self) -> dict[str, object]:
        """Return the foreseen steps with their requests and limit checks; reads only."""
        steps = steps_payload(self._controller, preview(self._controller, self._plan))
        return {"dry_run": True, "tool": self.tool, "steps": steps}

    def check_limits(self) -> int:
        """Show how it will go, and refuse a course that leads outside the limits; reads only.

        Returns how many movements are foreseen.

        Raises:
            LimitError: Names the step.
        """
        steps = preview(self._controller, self._plan)
        require_inside(self._controller, steps)
        show_course(steps)
        return sum(step.target is not None for step in steps)

    def run(self) -> dict[str, object]:
        """Measure, propose, write, verify; return the document of the whole."""
        self._listener.read_points(self._controller)
        with operator_at(self._assist_url, lambda: self.tool, self._controller.clock) as operator:
            change = NozzleChange(
                self._controller,
                self._plan,
                operator=operator,
                listener=self._listener,
                earlier=partial(earlier_corrections, self._controller),
                order=self._order,
                describe=self._document,
            )
            whole = change.run()
            self._listener.note_proved(whole)
            (self._report,) = whole.tools
        desk = present_desk()
        if desk is not None:
            desk.regard(whole)
        return self._document(whole)

    def _document(self, report: ChangeReport) -> dict[str, object]:
        impact = self._listener.impact
        return {
            **report_payload(report.tools[0]),
            "simulated": report.simulated,
            "source": {"kind": "live"},
            "impact": impact_payload(impact) if impact else None,
            "report": None,
        }

    def show_end(self) -> None:
        """Say how it ended."""
        if self._report is not None and present_desk() is None:
            show_report(self._report)


def calibrate_live(frame: CalibrationRequest, source: Callable[[Controller], TipSource]) -> None:
    """Let the robot take the measurements, then propose, write and verify.

    Raises:
        CalibrationError: A measurement is not trusted; nothing was written.
        DeclinedError: A person said no, or nobody could be asked.
        LimitError: The foreseen course leads outside the limits; nothing was moved.
        VerifyError: The tip drifts too far; the old value was put back.
    """
    # An order comes from a program, also where that has a terminal.
    alone = frame.assist is None and not frame.dry_run and frame.order is None
    guided_if_alone(
        frame.context,
        lambda: _calibrate(frame, source),
        job=tr("Measure tool {tool}", tool=frame.tool),
        alone=alone,
    )


def _calibrate(frame: CalibrationRequest, source: Callable[[Controller], TipSource]) -> None:
    context = frame.context
    job = "" if frame.dry_run else tr("calibrate tool {tool}", tool=frame.tool)
    with (
        open_controller(context, changes=not frame.dry_run, job=job) as controller,
        ordered(controller, frame.order, f"calibrate {frame.method}") as order,
    ):
        if order is not None and order.done is not None:
            payload = order.done.result
            show_done(order)
        else:
            payload = _measure(controller, frame, frame.plan(source(controller), controller), order)
    if frame.dry_run:
        context.emit("dry-run", payload, lambda: show_plan(payload))
    else:
        context.emit("calibration", with_order(payload, order), lambda: None)


def _measure(
    controller: Controller, frame: CalibrationRequest, plan: ChangePlan, order: Order | None
) -> Mapping[str, object]:
    """Carry it out, or look how it would go; return the document."""
    with reporting(frame.report, controller) as draft:
        remark_on_pin(frame, controller)
        live = LiveCalibration(
            controller,
            plan,
            draft=draft,
            assist_url=frame.assist,
            impact=frame.impact,
            order=order,
        )
        if frame.dry_run:
            return live.dry_run()
        live.require_writable()
        moves = live.check_limits()
        agree_to_procedure(
            controller,
            tr("to measure tool {tool}", tool=live.tool),
            moves=moves,
            speed_mm_s=frame.limits.speed_mm_s,
            box_mm=frame.limits.box.x_max_mm,
            yes=frame.yes,
            at=find_method(frame.method).needs.station,
            tools=(live.tool,),
        )
        payload = live.run()
        # Now, because Ctrl-C may come before the logout is answered.
        live.show_end()
    return {**payload, "report": draft.saved}
