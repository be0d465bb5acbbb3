"""A calibration from poses that exist already: nothing moves, no tool is selected."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from robolink.backup import keep_first_backup
from robolink.calibration import ToolFit, known_doubts
from robolink.calibration_run import (
    ChangePlan,
    ChangeReport,
    DescribeReport,
    Listener,
    Moment,
    NozzleChange,
    Proposal,
    ToolReport,
    assessed_in_cell,
)
from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.methods import PointsSource
from robolink.model import Controller
from robolink.procedures import MeasurementContext, PoseMethod
from robolink.transaction import Order, earlier_corrections
from robolink_cli.access.warnings import note_change
from robolink_cli.commands.measure.calibrate.live import CalibrationListener
from robolink_cli.commands.measure.calibrate.request import CalibrationRequest, remark_on_pin
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, json_is_on, note, say
from robolink_cli.options.impact import impact_payload, show_impact
from robolink_cli.options.pose_source import PoseSource
from robolink_cli.options.report import ReportDraft, reporting
from robolink_cli.prompts.operator import terminal
from robolink_cli.prompts.questions import agree
from robolink_cli.session.connection import open_controller
from robolink_cli.session.order import ordered, show_done, with_order
from robolink_cli.views.fit import judged_payload, report_payload


class _PosesListener(CalibrationListener):
    """Shows the result of the poses, warns of another tool, and asks before the write."""

    def __init__(
        self,
        draft: ReportDraft,
        frame: CalibrationRequest,
        given: PointsSource,
        *,
        controller: Controller,
        taught_tool: int,
    ) -> None:
        super().__init__(draft, frame.criteria, frame.impact)
        self._controller = controller
        self._frame = frame
        self._given = given
        self._taught_tool = taught_tool

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
        if self.better is not None:
            self._warn_of_other_tool(self.better, proposal.change_mm)
        if self.impact is not None:
            show_impact(proposal.tool, self.impact)

    def moment(self, moment: Moment, bench: MeasurementContext, tool: int | None = None) -> None:  # noqa: ARG002 - one tool only
        if moment is Moment.BEFORE_WRITE:
            _agree_to_write(self._frame.tool, yes=self._frame.yes)
            keep_first_backup(bench.controller, tell=note)

    def _doubts(self, proposal: Proposal) -> tuple[str, ...]:
        known = known_doubts(proposal.result.warnings)
        if self.better is None:
            return known
        other = tr(
            "These poses fit tool {better} much better than tool {taught}.",
            better=self.better.tool,
            taught=self._taught_tool,
        )
        return (*known, other)

    def _warn_of_other_tool(self, better: ToolFit, change_mm: float | None) -> None:
        note(
            tr(
                "Warning: these poses fit tool {better} much better than tool {taught}.\n"
                "  If taught with tool {better}, tool {tool} has changed by {small:.3f} "
                "mm; if with tool {taught}, by {large:.3f} mm.\n"
                "  If tool {better} was selected on the pendant, write nothing and give "
                "--taught-tool {better}.",
                better=better.tool,
                taught=self._taught_tool,
                tool=self._frame.tool,
                small=better.change_mm,
                large=change_mm,
            )
        )


def calibrate_from_poses(
    frame: CalibrationRequest, source: PoseSource, method_for: Callable[[Controller], PoseMethod]
) -> None:
    """Propose, ask, write and read back.

    Raises:
        CalibrationError: The poses give no trustworthy result; nothing was written.
        DeclinedError: A person said no, or nobody could be asked.
        ToolChangedError: The tool was changed meanwhile; nothing was written.
    """
    with (
        open_controller(frame.context, changes=not frame.dry_run) as controller,
        ordered(controller, frame.order, f"calibrate {frame.method}") as order,
    ):
        if order is not None and order.done is not None:
            payload = order.done.result
            show_done(order)
        else:
            payload = _calibrate(controller, frame, source, method_for(controller), order)
    if frame.dry_run:
        _show_dry_run(payload)
    else:
        emit("calibration", with_order(payload, order), lambda: None)


def _calibrate(
    controller: Controller,
    frame: CalibrationRequest,
    source: PoseSource,
    method: PoseMethod,
    order: Order | None,
) -> Mapping[str, object]:
    """Carry it out, or show what it would do; return the document."""
    with reporting(frame.report, controller) as draft:
        remark_on_pin(frame, controller)
        # A pin that is recorded needs a height.
        needs = {*method.needs, "z_mm"} if frame.pin else {*method.needs}
        given = PointsSource(
            lambda: source.poses(controller, sorted(needs)),
            method,
            taught_tool=source.taught_tool,
            plausible_mm=frame.criteria.limit_mm,
            sentence=source.sentence,
            in_mm=source.kind == "points",
            axes_held=source.axes_held,
        )
        listener = _PosesListener(
            draft, frame, given, controller=controller, taught_tool=source.taught_tool or 0
        )
        listener.read_points(controller)

        def document(report: ChangeReport) -> dict[str, object]:
            tool, extra = report_payload(report.tools[0]), _extra(source, listener)
            return {**tool, "simulated": report.simulated, **extra, "report": None}

        if frame.dry_run:
            payload = _dry_run(controller, frame, given, listener) | _extra(source, listener)
        else:
            done = _carry_out(controller, frame, given, listener, order=order, describe=document)
            payload = document(done)
            # Now, because Ctrl-C may come before the logout is confirmed.
            _show_end(done.tools[0])
    return {**payload, "report": draft.saved}


def _carry_out(
    controller: Controller,
    frame: CalibrationRequest,
    given: PointsSource,
    listener: Listener,
    *,
    order: Order | None,
    describe: DescribeReport,
) -> ChangeReport:
    one = frame.tool_plan(given, controller, verify=False)
    attended = not frame.yes and bool(person_here())
    change = NozzleChange(
        controller,
        ChangePlan((one,), ask_before_write=False, attended=attended, agreed_by=None),
        operator=terminal(),
        listener=listener,
        earlier=partial(earlier_corrections, controller),
        order=order,
        describe=describe,
    )
    return change.run()


def _dry_run(
    controller: Controller, frame: CalibrationRequest, given: PointsSource, listener: Listener
) -> dict[str, object]:
    """Propose and judge; return the document with what would be sent."""
    before = controller.tools.read(frame.tool)
    given.found = given.find(controller, frame.tool, before)
    plan = frame.tool_plan(given, controller, verify=False)
    result, _ = assessed_in_cell(controller, plan, plan.named(given.found.result))
    proposal = Proposal(frame.tool, before, result)
    if not json_is_on():
        listener.proposed([proposal])
    frame.criteria.judge_fit(proposal.result)
    if refusal := frame.criteria.over_by_defaults(proposal.result, tool=frame.tool):
        raise refusal
    frame.criteria.judge_change(proposal, remedy=given.remedy)
    requests = list(controller.tools.preview_write(frame.tool, proposal.offset))
    judged = judged_payload(proposal, frame.criteria.verdicts(proposal))
    return {"dry_run": True, "requests": requests, **judged}


def _extra(source: PoseSource, listener: _PosesListener) -> dict[str, object]:
    better, impact = listener.better, listener.impact
    return {
        "source": source.payload(),
        "tool_fits": [{"tool": fit.tool, "change_mm": fit.change_mm} for fit in listener.fits],
        "better_tool": None if better is None else better.tool,
        "impact": impact_payload(impact) if impact else None,
    }


def _show_dry_run(payload: Mapping[str, object]) -> None:
    requests = payload["requests"]
    assert isinstance(requests, list)  # noqa: S101 - made by _dry_run

    def show() -> None:
        if requests:
            say(tr("Dry run; robolink would send:"))
            say("\n".join(f"  {request}" for request in requests))
        else:
            say(tr("Dry run; the value is stored already. robolink would send nothing."))

    emit("dry-run", payload, show)


def _agree_to_write(tool: int, *, yes: bool) -> None:
    """Ask before the write; off a terminal only ``--yes`` is consent.

    Nobody watched these poses being taken, so the command alone is not the consent.
    """
    question = tr(
        "robolink did not see these touches, and the new value is not tested. Write it to "
        "tool {tool} anyway? 'robolink undo' undoes it.",
        tool=tool,
    )
    if not yes and not person_here():
        raise DeclinedError(
            tr("This writes tool {tool}, but there is nobody to ask.", tool=tool),
            remedy=tr("Nothing was written. Add --yes, or run it on a terminal."),
        )
    agree(question, yes=yes)


def _show_end(report: ToolReport) -> None:
    tool = report.proposal.tool
    if report.receipt is not None and report.receipt.skipped:
        say(tr("Tool {tool} has this value already. Nothing was written.", tool=tool))
    else:
        say(tr("Written. The controller has stored tool {tool}.", tool=tool))
    say(
        tr(
            "Not tested yet. To test: robolink calibrate two-pose --tool {tool}",
            tool=tool,
        )
    )
