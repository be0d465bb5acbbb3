"""What a look at a cell found, for people, for programs and for the record."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from robolink.messages import tr
from robolink.model import EntryKind, NewEntry, ToolOffset


class InspectionCode(StrEnum):
    """What was found; what the charts show has the codes of :class:`robolink.drift.DriftCode`."""

    CONTROLLER_IN_ERROR = "controller_in_error"
    UNSETTLED = "unsettled"
    TOOLS_NOT_READ = "tools_not_read"
    TOOL_CHANGED = "tool_changed"
    STATION_DUE = "station_due"
    TIP_MOVED = "tip_moved"
    TIP_NOT_MEASURED = "tip_not_measured"


@dataclass(frozen=True, slots=True)
class InspectionFinding:
    """One thing that somebody should see to.

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
    """What a look at a cell found.

    Attributes:
        controller: Its identity.
        tools: The tools that were read, ``None`` for an undefined one; empty where none could be.
        selected: The selected tool, ``None`` where that cannot be told.
        stations: Names of the stations that are known.
        changes: How many measured changes are on record.
        findings: What somebody should see to; empty when all is well.
    """

    controller: str
    tools: Mapping[int, ToolOffset | None]
    selected: int | None
    stations: tuple[str, ...]
    changes: int
    findings: tuple[InspectionFinding, ...]

    def with_findings(self, more: Iterable[InspectionFinding]) -> "Inspection":
        """Return the same with what else was found."""
        return replace(self, findings=(*self.findings, *more))

    @property
    def entry(self) -> NewEntry:
        """The same for the record."""
        found = [{"code": one.code, "subject": one.subject} for one in self.findings]
        values = {
            str(number): None if value is None else list(value.components())
            for number, value in self.tools.items()
        }
        verdict = (
            tr("Needs attention: {codes}.", codes=", ".join(one.code for one in self.findings))
            if self.findings
            else tr("In order.")
        )
        return NewEntry(
            EntryKind.CHECK,
            verdict=verdict,
            details={
                "findings": found,
                "tools": values,
                "selected_tool": self.selected,
                "stations": list(self.stations),
                "changes": self.changes,
            },
        )
