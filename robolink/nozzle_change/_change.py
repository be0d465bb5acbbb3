"""The nozzle change: measure the new tip, write its offset, prove it, or put the old one back.

Order (design parts 4 and 8): read the old value; measure in Tool 0; propose; on a yes write
with compare-and-set and read back; turn about the new tip; keep, or write the old value back
once. Whatever happens, the tool, power mode and speed of before are put back at the end.
"""

from collections.abc import Callable

from robolink.calibration import VerifyResult, contact_pose, two_pose, verify_by_turning
from robolink.errors import DeclinedError, RobolinkError, VerifyError
from robolink.messages import tr
from robolink.model import Controller, Pose, ToolOffset, ToolReceipt
from robolink.nozzle_change._plan import ChangePlan, ChangeReport, Proposal
from robolink.runner import Operator, Runner, StepDone


class NozzleChange:
    """One nozzle change on one controller.

    Args:
        controller: A connected controller.
        operator: Who brings the tip onto the pin.
        plan: What to do, within which limits.
        show: Given the proposal to put before a person, before anything is written.
        on_step: Told of every step taken.
        on_result: Told of the write and of the verification as they end, whatever comes next.
    """

    def __init__(
        self,
        controller: Controller,
        plan: ChangePlan,
        *,
        operator: Operator,
        show: Callable[[Proposal], None],
        on_step: Callable[[StepDone], None] | None = None,
        on_result: Callable[[ToolReceipt | VerifyResult], None] = lambda _result: None,
    ) -> None:
        self._controller = controller
        self._plan = plan
        self._operator = operator
        self._show = show
        self._on_step = on_step
        self._on_result = on_result

    def run(self) -> ChangeReport:
        """Do it all. Ctrl-C before the verification has passed leaves the old value.

        Raises:
            CalibrationError: The measurement is not trusted; nothing was written.
            DeclinedError: The person said no; nothing was written.
            VerifyError: The tip drifts too far; the old value was put back.
            RobolinkError: Anything else that ended it, with the state it left.
        """
        controller, tool = self._controller, self._plan.tool
        before = controller.tools.read(tool)
        report: ChangeReport | None = None
        try:
            with controller.preserved(tr("calibrate tool {tool}", tool=tool)):
                report = self._carry_out(before)
        except KeyboardInterrupt:
            if report is not None:
                self._operator.tell(tr("Tool {tool} keeps the new value.", tool=tool))
            raise
        return report

    def _carry_out(self, before: ToolOffset | None) -> ChangeReport:
        controller, plan = self._controller, self._plan
        controller.tools.select(0)
        start = controller.groups[0].pose()
        runner = self._runner(start, None)
        result = runner.run(two_pose(plan.touch, stored=before))
        proposal = Proposal(plan.tool, before, result)
        self._show(proposal)
        proposal.require_plausible(
            plan.max_change_mm,
            remedy=tr(
                "Check that both poses touched the same point. If the change is real, allow it "
                "with --max-change."
            ),
        )
        question = tr("Write this to tool {tool}?", tool=plan.tool)
        if plan.ask_before_write and not runner.confirm(question):
            raise DeclinedError(
                tr("The proposal was not accepted."), remedy=tr("Nothing was written.")
            )
        receipt = self._write(proposal)
        verification = self._verify(start, proposal, receipt) if plan.verify else None
        return ChangeReport(proposal, receipt, verification)

    def _write(self, proposal: Proposal) -> ToolReceipt:
        tool, before, offset = proposal.tool, proposal.before, proposal.result.offset
        try:
            receipt = self._controller.tools.write(tool, offset, expected=before)
            self._on_result(receipt)
        except KeyboardInterrupt as error:
            # It was written and read back by now, or not begun; it was not verified.
            self._roll_back(ToolReceipt(tool, before, offset, offset), error)
            raise
        return receipt

    def _verify(self, start: Pose, proposal: Proposal, receipt: ToolReceipt) -> VerifyResult:
        plan, result = self._plan, proposal.result
        contact = contact_pose(result, tool=plan.tool)
        first, second = (pose.u_deg + result.offset.u_deg for pose in result.inputs)
        try:
            self._controller.tools.select(plan.tool)
            outcome = self._runner(start, result.offset).run(
                verify_by_turning(
                    plan.touch,
                    contact=contact,
                    angles_deg=((first + second) / 2, first),
                    tolerance_mm=plan.drift_tolerance_mm,
                )
            )
            self._on_result(outcome)
        except BaseException as error:
            self._roll_back(receipt, error)
            raise
        if not outcome.passed:
            failure = VerifyError(
                tr(
                    "The tip drifts {drift:.3f} mm when the tool turns; {limit:.3f} mm are "
                    "allowed.",
                    drift=outcome.max_drift_mm,
                    limit=plan.drift_tolerance_mm,
                ),
                remedy=tr("Check that the nozzle sits firmly and measure again."),
                controller=self._controller.identity,
            )
            self._roll_back(receipt, failure)
            raise failure
        return outcome

    def _roll_back(self, receipt: ToolReceipt, cause: BaseException) -> None:
        """Write the old value back, once; let ``cause`` say whether that was done."""
        tools, tool = self._controller.tools, receipt.tool
        if receipt.skipped:
            return
        try:
            if receipt.before is None:
                undone = tools.clear(tool, expected=receipt.read_back)
            else:
                undone = tools.write(tool, receipt.before, expected=receipt.read_back)
            if undone.skipped:
                note = tr("Tool {tool} holds its old value.", tool=tool)
            else:
                note = tr("The old value of tool {tool} was written back.", tool=tool)
        except RobolinkError as error:
            note = tr(
                "The old value of tool {tool} could NOT be written back: {error}",
                tool=tool,
                error=error,
            )
        if isinstance(cause, RobolinkError):
            cause.remedy = f"{cause.remedy} {note}".strip()
        self._operator.tell(note)

    def _runner(self, start: Pose, offset: ToolOffset | None) -> Runner:
        return Runner(
            self._controller,
            self._controller.groups[0],
            self._operator,
            self._plan.settings(start, offset),
            on_step=self._on_step,
        )
