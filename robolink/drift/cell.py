"""The course of one controller's tools, from its entries to findings."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from robolink.calibration import LEAST_BASELINE
from robolink.drift.charts import Chart, charts_of
from robolink.drift.findings import DriftFinding, findings_in
from robolink.drift.history import MeasuredChange, measured_changes
from robolink.model import Recorded, is_simulated_name


@dataclass(frozen=True, slots=True)
class CellDrift:
    """How the tools of one controller went.

    Attributes:
        controller: Its identity, as in the journal.
        changes: Its measured changes, oldest first.
        charts: What was drawn from them, tools first.
        findings: What somebody should look at; empty for a steady cell.
    """

    controller: str
    changes: tuple[MeasuredChange, ...]
    charts: tuple[Chart, ...]
    findings: tuple[DriftFinding, ...]

    @property
    def simulated(self) -> bool:
        """Whether it, or one of its changes, was simulated; else nothing says so."""
        simulated = any(change.simulated for change in self.changes)
        return simulated or is_simulated_name(self.controller)


def drift_of(
    controller: str,
    entries: Iterable[Recorded],
    *,
    finds_pin: Callable[[str], bool],
    tool: int | None = None,
    since: str = "",
    baseline: int = LEAST_BASELINE,
) -> CellDrift:
    """Return how the tools of one controller went.

    Args:
        controller: Its identity, for the reader.
        entries: Its entries of the kinds in :data:`robolink.drift.KINDS`, oldest first.
        finds_pin: Tells whether a method, by its name, finds its pin with the offset.
        tool: Only this tool; what several tools did alike is then not seen.
        since: Only changes with this label or a later one, ISO 8601; all by default. After a
            repair the charts begin anew there.
        baseline: How many of the first values the limits rest on; fewer than 20 draw none.

    Raises:
        ConfigError: ``baseline`` is less than 2.

    Example:
        >>> from robolink.drift import drift_of
        >>> cell = drift_of("cell-a", [], finds_pin=lambda method: True)
        >>> cell.charts, cell.findings
        ((), ())
    """
    changes = tuple(
        change
        for change in measured_changes(entries, finds_pin)
        if change.at >= since and tool in (None, change.tool)
    )
    charts = charts_of(changes, baseline=baseline)
    return CellDrift(controller, changes, charts, findings_in(charts, changes))
