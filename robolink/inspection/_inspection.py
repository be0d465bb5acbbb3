"""Compares a cell with its record: is it as the last change left it, is anything due."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final

from robolink.backup import ToolState
from robolink.calibration_run import RecipeRun
from robolink.config import Cell
from robolink.drift import KINDS, drift_of
from robolink.errors import CalibrationError, NotReadyError
from robolink.messages import tr
from robolink.methods import all_methods
from robolink.model import (
    PROOFS,
    Controller,
    ControllerStatus,
    EntryKind,
    Recorded,
    ToolOffset,
    begun_in_words,
)
from robolink.stations import find_stations
from robolink.timing import local_label
from robolink.transaction import tools_changed_since

_READ: Final = tuple(dict.fromkeys((*KINDS, *PROOFS, EntryKind.STATION)))


class InspectionCode(StrEnum):
    """What was found; what the charts show has the codes of :class:`robolink.drift.DriftCode`."""

    CONTROLLER_IN_ERROR = "controller_in_error"
    UNSETTLED = "unsettled"
    TOOLS_NOT_READ = "tools_not_read"
    TOOL_CHANGED = "tool_changed"
    STATION_DUE = "station_due"
    TIP_MOVED = "tip_moved"
    TIP_NOT_MEASURED = "tip_not_measured"
    CERTIFICATE_ENDS = "certificate_ends"


@dataclass(frozen=True, slots=True)
class InspectionFinding:
    """One finding that needs attention.

    Attributes:
        code: What it is.
        subject: Number of a tool, name of a station, or of what was begun; empty for the cell.
        sentence: The same for a person.
        remedy: What to do; empty where the sentence says it.
    """

    code: str
    subject: str
    sentence: str
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Inspection:
    """What a check of a cell found.

    Attributes:
        controller: Its identity.
        tools: The tools that were read, ``None`` for an undefined one; empty where none could be.
        selected: The selected tool, ``None`` where that cannot be told.
        stations: Names of the stations that are known.
        changes: How many measured changes are on record.
        findings: What somebody should see to; empty when all is well.
    """

    controller: str
    tools: Mapping[int, ToolOffset | None] = field(hash=False)
    selected: int | None
    stations: tuple[str, ...]
    changes: int
    findings: tuple[InspectionFinding, ...]

    def with_findings(self, more: Iterable[InspectionFinding]) -> "Inspection":
        """Return the same with further findings."""
        return replace(self, findings=(*self.findings, *more))

    @property
    def verdict(self) -> str:
        """What was found, one sentence."""
        if self.findings:
            return tr("Needs attention: {codes}.", codes=", ".join(f.code for f in self.findings))
        return tr("No problem found.")

    @property
    def details(self) -> dict[str, object]:
        """The same for the record, plain JSON values."""
        return {
            "findings": [{"code": one.code, "subject": one.subject} for one in self.findings],
            "tools": {
                str(number): None if value is None else list(value.components())
                for number, value in self.tools.items()
            },
            "selected_tool": self.selected,
            "stations": list(self.stations),
            "changes": self.changes,
        }


def inspect(
    controller: Controller,
    tools: ToolState | NotReadyError,
    *,
    cell: Cell | None = None,
    since: str = "",
) -> Inspection:
    """Compare a cell with its record. Nothing is written, moved or recorded.

    Args:
        controller: The controller, connected.
        tools: Its tools and the selected one as they were read just now, or why they could not be:
            while production runs, an EPSON controller is asked for no tool.
        cell: The cell, whose file may declare stations.
        since: Changes with an earlier label (ISO 8601) are left out of the charts.

    Raises:
        JournalError: The record cannot be read.
        RobolinkError: The controller cannot be asked how it is.

    Example:
        >>> import robolink
        >>> from robolink.backup import read_tools
        >>> from robolink.inspection import inspect
        >>> with robolink.connect("epson+sim://inspect-example") as controller:
        ...     found = inspect(controller, read_tools(controller))
        >>> found.findings
        ()
    """
    # Read once: of each kind, or of each tool, the queries cost more than the check itself.
    newest_first = list(controller.outcomes.recorded(kinds=_READ))
    stations = find_stations(cell, _of_kinds((EntryKind.STATION,), newest_first))
    finding = {method.name for method in all_methods() if method.needs.finds_pin}
    course = drift_of(
        controller.identity,
        reversed(_of_kinds(KINDS, newest_first)),
        finds_pin=finding.__contains__,
        since=since,
    )
    read = {} if isinstance(tools, NotReadyError) else dict(tools.tools)
    selected = None if isinstance(tools, NotReadyError) else tools.selected
    findings = (
        *_in_error(controller.status()),
        *_unsettled(controller),
        *(_not_read(tools) if isinstance(tools, NotReadyError) else ()),
        *(
            InspectionFinding(
                InspectionCode.TOOL_CHANGED, str(one.tool), one.sentence, _put_back(one.tool)
            )
            for one in tools_changed_since(controller, read, newest_first)
        ),
        *(
            InspectionFinding(InspectionCode.STATION_DUE, name, station.remark())
            for name, station in stations.items()
            if station.remark()
        ),
        *(
            InspectionFinding(one.code, ", ".join(map(str, one.subject)), one.sentence, one.remedy)
            for one in course.findings
        ),
    )
    return Inspection(
        controller.identity, read, selected, tuple(stations), len(course.changes), findings
    )


def _of_kinds(kinds: Collection[EntryKind], entries: Iterable[Recorded]) -> list[Recorded]:
    return [entry for entry in entries if entry.kind in kinds]


def _in_error(status: ControllerStatus) -> Iterator[InspectionFinding]:
    if status.fault or status.serious_fault or status.emergency_stop:
        yield InspectionFinding(
            InspectionCode.CONTROLLER_IN_ERROR,
            "",
            tr(
                "The controller is not ready: {state} ({code:04d}).",
                state=status.state,
                code=status.code,
            ),
            tr("Remove the cause, then run 'robolink robot reset'."),
        )


def _not_read(error: NotReadyError) -> Iterator[InspectionFinding]:
    yield InspectionFinding(
        InspectionCode.TOOLS_NOT_READ,
        "",
        tr("The tools could not be compared: {what}", what=error.what),
        error.remedy,
    )


def _unsettled(controller: Controller) -> Iterator[InspectionFinding]:
    for marker in controller.outcomes.open_markers():
        yield InspectionFinding(
            InspectionCode.UNSETTLED,
            marker.operation[:8],
            tr(
                "Not finished since {when}: {request}.",
                when=local_label(marker.begun_at),
                request=begun_in_words(marker),
            ),
            tr("Next: robolink recover"),
        )


def _put_back(tool: int) -> str:
    return tr(
        "If nobody intended this, write the recorded value back with 'robolink tool set "
        "{tool}'; otherwise measure the tool again.",
        tool=tool,
    )


def measured_findings(run: RecipeRun) -> tuple[InspectionFinding, ...]:
    """Return which tips are not where their stored values put them.

    A tip counts as moved from the limit on that the turn test of the recipe has.

    Args:
        run: A run that only measures, after its preflight and after a person's yes.

    Raises:
        RobolinkError: The robot could not finish; nothing was written.
    """
    try:
        report = run.run()
    except CalibrationError as error:
        return (
            InspectionFinding(
                InspectionCode.TIP_NOT_MEASURED,
                "",
                tr("The measurement was refused: {what}", what=error.what),
                error.remedy,
            ),
        )
    limits = {plan.tool: plan.criteria.drift_tolerance_mm for plan in run.plan.tools}
    return tuple(
        InspectionFinding(
            InspectionCode.TIP_MOVED,
            str(one.proposal.tool),
            tr(
                "Tool {tool}: the tip is {found:.3f} mm from where its value puts it, limit "
                "{limit:.3f} mm.",
                tool=one.proposal.tool,
                found=one.proposal.change_mm,
                limit=limits[one.proposal.tool],
            ),
            tr("Is the needle straight and tight? Then measure it again: robolink change"),
        )
        for one in report.tools
        if (one.proposal.change_mm or 0.0) > limits[one.proposal.tool]
    )
