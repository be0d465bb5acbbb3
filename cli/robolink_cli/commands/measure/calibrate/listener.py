"""Shows a calibration as it goes, and collects it for a report."""

from robolink.calibration import Impact, VerifyResult
from robolink.calibration_run import AcceptanceCriteria, ChangeReport, Listener, Proposal
from robolink.model import Controller, Pose, ToolReceipt
from robolink_cli.options.impact import ImpactRequest, judge
from robolink_cli.options.report import ReportDraft
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.views.fit import show_proposal, show_verdicts, tell_written


class CalibrationListener(Listener):
    """Shows a calibration as it goes, and collects it for a report.

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
        """Read the taught points on which the change is to be judged."""
        if self._request is not None:
            self._points = self._request.read(controller)

    def wrote(self, receipt: ToolReceipt) -> None:
        """Note it for the report, and tell whoever is guided."""
        tell_written(receipt)
        self._draft.note_result(receipt)

    def verified(self, tool: int, result: VerifyResult) -> None:  # noqa: ARG002 - one tool only
        """Note it for the report."""
        self._draft.note_result(result)

    def note_proved(self, done: ChangeReport) -> None:
        """Note the statement that stands after the turn test, a wider one included."""
        for report in done.tools:
            if report.verification is not None:
                self._draft.note_result(report.verification)

    def propose(self, proposal: Proposal, *, source: str, warnings: tuple[str, ...]) -> None:
        """Show the proposal, the verdict, and what it means for taught points."""
        self.impact = judge(self._points, old=proposal.before, new=proposal.offset)
        desk = current_desk()
        if desk is not None and self.impact is not None:
            from robolink_cli.wizard.happenings import TaughtPoints

            desk.regard(TaughtPoints(self.impact))
        self._draft.propose(proposal, source=source, warnings=warnings, impact=self.impact)
        show_proposal(proposal)
        show_verdicts(self._criteria.verdicts(proposal))
