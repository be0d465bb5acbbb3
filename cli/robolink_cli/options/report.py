"""The report of a tool change: the options, and a page that is written however it ends."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import click

from robolink import __version__
from robolink.errors import ConfigError, JournalError
from robolink.messages import joined, tr
from robolink.model import json_value
from robolink_cli.console.render import note
from robolink_cli.options.declaration import CliOption

if TYPE_CHECKING:
    from robolink.calibration import Impact, VerifyResult
    from robolink.calibration_run import Proposal
    from robolink.model import Controller, ControllerFacts, Pose, ToolOffset, ToolReceipt
    from robolink.report import Outcome, Report, TouchOnRecord


LINK_REMARK: Final = "robolink.link_remark"
"""Key of the sentence on how the controller is reached, where a page has to say that."""


@dataclass(frozen=True, slots=True)
class ReportRequest:
    """Where a report is wanted, and whether it may replace a file."""

    path: Path
    replace: bool = False


ReportPath = Annotated[
    Path | None,
    CliOption(
        "--report",
        metavar="FILE.html",
        help="Write a page to keep: the offsets, the taught points as a table and a picture.",
    ),
]

ForceReport = Annotated[
    bool,
    CliOption(help="Let --report overwrite an existing file; forces nothing else."),
]


def report_request(path: Path | None, *, force: bool) -> ReportRequest | None:
    """Return what is wanted, checked before a connection is made; ``None`` for no report.

    Raises:
        ConfigError: The file cannot be written, or ``--force`` stands alone.
    """
    from robolink.files.named import require_free

    if path is None:
        if force:
            raise ConfigError(
                tr("--force needs --report."),
                remedy=tr("Leave it out; it forces nothing else."),
            )
        return None
    require_free(path, replace=force)
    return ReportRequest(path, replace=force)


class ReportDraft:
    """What is known of a tool change so far.

    There is something to report from :meth:`propose` on.
    """

    def __init__(
        self, controller: "Controller", facts: "ControllerFacts", *, simulated: bool
    ) -> None:
        self._controller = controller.identity
        self._outcomes, self._change = controller.outcomes, ""
        self._facts = facts
        self._simulated = simulated
        context = click.get_current_context(silent=True)
        remark = "" if context is None else context.meta.get(LINK_REMARK, "")
        self._of_link: tuple[str, ...] = (remark,) if remark else ()
        self._proposed: dict[str, Any] = {}
        self._receipt: ToolReceipt | None = None
        self._verification: VerifyResult | None = None
        self.saved: str | None = None

    @property
    def change(self) -> str:
        """Id of the change, empty for none."""
        return self._change

    @property
    def complete(self) -> bool:
        """Whether there is something to report."""
        return bool(self._proposed)

    def offer(
        self,
        tool: int,
        *,
        before: "ToolOffset | None",
        after: "ToolOffset",
        given: tuple[str, ...],
        impact: "Impact",
    ) -> None:
        """Note a typed offset of a dry run."""
        self._proposed = {
            "tool": tool,
            "before": before,
            "after": after,
            "determined": given,
            "source": tr("typed"),
            "impact": impact,
        }

    def propose(
        self,
        proposal: "Proposal",
        *,
        source: str,
        warnings: tuple[str, ...] = (),
        impact: "Impact | None" = None,
    ) -> None:
        """Note what was measured."""
        result = proposal.result
        self._change = self._outcomes.change
        self._proposed = {
            "tool": proposal.tool,
            "before": proposal.before,
            "after": result.offset,
            "determined": result.found,
            "method": result.method,
            "source": source,
            "warnings": warnings,
            "poses": result.inputs,
            "fit": result,
            "impact": impact,
            "touches": tuple(_touches(result.inputs)),
            "evidence": result.evidence.as_json() if result.evidence else {},
            "seating": json_value(proposal.seating),
        }

    def note_result(self, result: "ToolReceipt | VerifyResult") -> None:
        """Note what was written, or how the turn test ended."""
        from robolink.model import ToolReceipt

        if isinstance(result, ToolReceipt):
            self._receipt = result
        else:
            self._verification = result

    def finish(self, error: BaseException | None) -> "Report":
        """Return the report of a change that ended with ``error``, or well.

        What is on record is told from the record, as ``journal report`` tells it; an offset that
        was only looked at, and a dry run, are on none.
        """
        noted = self._noted(error)
        if not self._change:
            return noted
        from robolink_cli.access.change_page import report_on_record

        try:
            recorded = report_on_record(self._outcomes, self._change, noted.tool)
        except (ConfigError, JournalError) as failure:
            note(str(failure))
            return noted
        from robolink.report import Outcome

        # No record shows that nobody could be asked.
        open_end = recorded.outcome is Outcome.PROPOSED
        return replace(
            recorded,
            warnings=(*recorded.warnings, *self._of_link),
            outcome=noted.outcome if open_end else recorded.outcome,
            facts=noted.facts,
            impact=noted.impact,
            ending=noted.ending or recorded.ending,
            simulated=noted.simulated or recorded.simulated,
        )

    def _noted(self, error: BaseException | None) -> "Report":
        from robolink.report import Report
        from robolink.timing import wall_time

        return Report(
            made_at=wall_time().isoformat(timespec="seconds"),
            robolink_version=__version__,
            controller=self._controller,
            facts=self._facts,
            simulated=self._simulated,
            outcome=self._outcome(error),
            ending=_ending(error, self._proposed["tool"]),
            verification=self._verification,
            **self._proposed | {"warnings": self._proposed.get("warnings", ()) + self._of_link},
        )

    def _outcome(self, error: BaseException | None) -> "Outcome":
        from robolink.errors import CalibrationError, DeclinedError, VerifyError
        from robolink.report import Outcome

        receipt = self._receipt
        if isinstance(error, VerifyError):
            return Outcome.VERIFY_FAILED
        # After a write, these two words would state that nothing was written.
        if receipt is None and isinstance(error, DeclinedError):
            return Outcome.DECLINED
        if receipt is None and isinstance(error, CalibrationError):
            return Outcome.REFUSED
        if error is not None:
            return Outcome.UNFINISHED
        if receipt is None:
            return Outcome.PROPOSED
        if receipt.skipped:
            return Outcome.SKIPPED
        return Outcome.WRITTEN if self._verification is None else Outcome.VERIFIED


def _touches(poses: "Sequence[Pose]") -> "Iterator[TouchOnRecord]":
    """Yield how a person made each touch."""
    from robolink.procedures import jog_mm
    from robolink.report import TouchOnRecord
    from robolink.runner import TouchedAt

    for pose in poses:
        if isinstance(pose, TouchedAt):
            standoff_mm = None if pose.arrival is None else pose.standoff_mm
            yield TouchOnRecord(standoff_mm, jog_mm(pose), pose.seconds, pose.contact)


@contextmanager
def reporting(request: ReportRequest | None, controller: "Controller") -> "Iterator[ReportDraft]":
    """Collect what a command finds out, and write it at the end, whatever the end is.

    A report that cannot be written changes nothing about how the command ends: it is said.
    Nothing is written when the command ends before there is a proposal.
    """
    from robolink.model import ControllerFacts, says_it_is_simulated

    facts = ControllerFacts() if request is None else controller.facts()
    simulated = request is not None and says_it_is_simulated(controller, facts)
    draft = ReportDraft(controller, facts, simulated=simulated)
    try:
        yield draft
    except BaseException as error:
        _save(request, draft, error)
        raise
    _save(request, draft, None)


def _save(request: ReportRequest | None, draft: ReportDraft, error: BaseException | None) -> None:
    from robolink.report import save
    from robolink_cli.access.look_pictures import looks_of

    if request is None or not draft.complete:
        return
    try:
        looks = looks_of(draft.change)
        save(draft.finish(error), request.path, looks=looks, replace=request.replace)
    except ConfigError as failure:
        note(str(failure))
    else:
        draft.saved = str(request.path)
        note(tr("Report: {path}", path=request.path))


def _ending(error: BaseException | None, tool: int) -> str:
    from robolink.errors import OutcomeUnknownError, RobolinkError

    if error is None:
        return ""
    look = tr("'robolink tool get {tool}' shows what tool {tool} holds.", tool=tool)
    if isinstance(error, OutcomeUnknownError) or not isinstance(error, RobolinkError):
        said = error if isinstance(error, RobolinkError) else tr("It was interrupted.")
        return joined(" ", (str(said), look))
    return str(error)
