"""A calibration in which the robot moves: plan, consent, measurement, proposal, write, test."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from robolink.backup import keep_first_backup
from robolink.calibration import Impact, VerifyResult, known_doubts
from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    ChangeReport,
    Listener,
    NozzleChange,
    Proposal,
    preview,
    require_inside,
    require_ready,
)
from robolink.messages import tr
from robolink.methods import find_method
from robolink.model import Controller, Pose, ToolReceipt
from robolink.procedures import TipSource
from robolink.transaction import Order, earlier_corrections
from robolink_cli.access.warnings import note_change
from robolink_cli.commands.measure.calibrate.request import CalibrationRequest, remark_on_pin
from robolink_cli.console.render import emit, note
from robolink_cli.options.impact import ImpactRequest, impact_payload, judge, show_impact
from robolink_cli.options.report import ReportDraft, reporting
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.prompts.operator import operator_at
from robolink_cli.session.check_before_start import agree_to_procedure
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import guided_if_alone
from robolink_cli.session.order import ordered, show_done, with_order
from robolink_cli.views.fit import (
    report_payload,
    show_course,
    show_plan,
    show_proposal,
    show_report,
    show_verdicts,
    steps_payload,
    tell_written,
)


class CalibrationListener(Listener):
    """Shows the progress of a calibration, and collects it for a report.

    Attributes:
        impact: What the change means for taught points, once it was proposed.
    """

    def __init__(
        self, draft: ReportDraft, criteria: AcceptanceCriteria, impact: ImpactRequest | None
    ) -> None:
        self._draft = draft
        self._criteria = criteria
        self._request = impact
        self._points: dict[int, Pose | None] | None = None
        self.impact: Impact | None = None

    def read_points(self, controller: Controller) -> None:
        """Read the taught points at which the change is judged."""
        if self._request is not None:
            self._points = self._request.read(controller)

    def wrote(self, receipt: ToolReceipt) -> None:
        """Note it for the report, and show it to a guided person."""
        tell_written(receipt)
        self._draft.note_result(receipt)

    def verified(self, tool: int, result: VerifyResult) -> None:  # noqa: ARG002 - one tool only
        """Note it for the report."""
        self._draft.note_result(result)

    def note_proved(self, done: ChangeReport) -> None:
        """Note the statement that is valid after the turn test, a wider one included."""
        for report in done.tools:
            if report.verification is not None:
                self._draft.note_result(report.verification)

    def propose(self, proposal: Proposal, *, source: str, warnings: tuple[str, ...]) -> None:
        """Show the proposal, the verdict, and its effect at taught points."""
        self.impact = judge(self._points, old=proposal.before, new=proposal.offset)
        desk = current_desk()
        if desk is not None and self.impact is not None:
            from robolink_cli.wizard.happenings import TaughtPoints

            desk.regard(TaughtPoints(self.impact))
        self._draft.propose(proposal, source=source, warnings=warnings, impact=self.impact)
        show_proposal(proposal)
        show_verdicts(self._criteria.verdicts(proposal))


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

    def document(self, report: ChangeReport) -> dict[str, object]:
        """Return the document of what was done."""
        return {
            **report_payload(report.tools[0]),
            "simulated": report.simulated,
            "source": {"kind": "live"},
            "impact": impact_payload(self.impact) if self.impact else None,
            "report": None,
        }


def calibrate_live(frame: CalibrationRequest, source: Callable[[Controller], TipSource]) -> None:
    """Let the robot take the measurements, then propose, write and verify.

    Raises:
        CalibrationError: A measurement is not trusted; nothing was written.
        DeclinedError: A person said no, or nobody could be asked.
        LimitError: The foreseen course leads outside the limits; nothing was moved.
        VerifyError: The tip drifts too far; the old value was restored.
    """
    # An order comes from a program, even if the program has a terminal.
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
        emit("dry-run", payload, lambda: show_plan(payload))
    else:
        emit("calibration", with_order(payload, order), lambda: None)


def _measure(
    controller: Controller, frame: CalibrationRequest, plan: ChangePlan, order: Order | None
) -> Mapping[str, object]:
    """Carry it out, or preview it; return the document."""
    with reporting(frame.report, controller) as draft:
        remark_on_pin(frame, controller)
        if frame.dry_run:
            steps = steps_payload(controller, preview(controller, plan))
            return {"dry_run": True, "tool": frame.tool, "steps": steps}
        _agree(controller, frame, plan)
        listener = _LiveListener(draft, plan, frame.impact)
        payload = _change(controller, frame, plan, listener, order)
    return {**payload, "report": draft.saved}


def _agree(controller: Controller, frame: CalibrationRequest, plan: ChangePlan) -> None:
    """Let the person agree; refuse what would be refused later, and back up.

    Raises:
        CalibrationError: A camera is not there, or means nothing.
        ConfigError: The backup before the first write cannot be stored.
        DeclinedError: The answer was no, or nobody could be asked.
        LimitError: The foreseen course leads outside the limits.
        NotReadyError: The state forbids it.
    """
    require_ready(controller, plan)
    note_change(controller, frame.tool, controller.tools.read(frame.tool))
    keep_first_backup(controller, tell=note)
    steps = preview(controller, plan)
    require_inside(controller, steps)
    show_course(steps)
    agree_to_procedure(
        controller,
        tr("to measure tool {tool}", tool=frame.tool),
        moves=sum(step.target is not None for step in steps),
        speed_mm_s=frame.limits.speed_mm_s,
        box_mm=frame.limits.box.x_max_mm,
        yes=frame.yes,
        at=find_method(frame.method).needs.station,
        tools=(frame.tool,),
    )


def _change(
    controller: Controller,
    frame: CalibrationRequest,
    plan: ChangePlan,
    listener: _LiveListener,
    order: Order | None,
) -> dict[str, object]:
    """Measure, propose, write, test; return the document of the whole."""
    listener.read_points(controller)
    with operator_at(frame.assist, lambda: frame.tool, controller.clock) as operator:
        change = NozzleChange(
            controller,
            plan,
            operator=operator,
            listener=listener,
            earlier=partial(earlier_corrections, controller),
            order=order,
            describe=listener.document,
        )
        report = change.run()
        listener.note_proved(report)
    # Now, because Ctrl-C may come before the logout is confirmed.
    desk = current_desk()
    if desk is None:
        show_report(report.tools[0])
    else:
        desk.regard(report)
    return listener.document(report)
