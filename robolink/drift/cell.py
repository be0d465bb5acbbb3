"""The course of one controller's tools, from its entries to findings."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from robolink.calibration import LEAST_BASELINE, stated_mm
from robolink.deprecation import without_sign
from robolink.drift.charts import Chart, charts_of
from robolink.drift.findings import DriftFinding, findings_in
from robolink.drift.history import MeasuredChange, measured_changes
from robolink.messages import tr
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


@without_sign
def last_statements(changes: Sequence[MeasuredChange]) -> Iterator[str]:
    """Yield a sentence for each tool whose last change has a statement on record.

    Args:
        changes: The changes of one controller, oldest first.

    Example:
        >>> from robolink.drift import MeasuredChange, last_statements
        >>> at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
        >>> change = MeasuredChange(7, at, "c-1", 1, "", "", tip_mm, None, 0.05, 0.024, 0.064)
        >>> list(last_statements([change]))
        ['Tool 1, last change: repeatable to +-0.024 mm, accurate to +-0.064 mm (95 %).']
    """
    for tool, last in sorted({change.tool: change for change in changes}.items()):
        if last.accurate_to_mm is None:
            continue
        accurate = stated_mm(last.accurate_to_mm)
        if last.repeatable_to_mm is None:
            yield tr(
                "Tool {tool}, last change: repeatable: not known, accurate to +-{u} mm (95 %).",
                tool=tool,
                u=accurate,
            )
        else:
            yield tr(
                "Tool {tool}, last change: repeatable to +-{r} mm, accurate to +-{u} mm (95 %).",
                tool=tool,
                r=stated_mm(last.repeatable_to_mm),
                u=accurate,
            )
