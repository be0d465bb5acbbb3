"""The page about how the tools of cells went over their changes."""

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from markupsafe import Markup

from robolink.drift import CellDrift
from robolink.files.named import save_named
from robolink.messages import tr
from robolink.report._page import POLICY, templates
from robolink.report.pictures.control_chart import chart_drawing, chart_title
from robolink.report.sections.summary import simulated_band, simulated_verdict


def render_drift(cells: Sequence[CellDrift], *, made_at: str, robolink_version: str) -> str:
    """Return the control charts of cells as one HTML page, in Unicode.

    Args:
        cells: Each with one measured change or more.
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What makes the page.

    Example:
        >>> from robolink.drift import CellDrift, MeasuredChange
        >>> from robolink.report import render_drift
        >>> at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
        >>> change = MeasuredChange(7, at, "c-1", 1, "N-0815", "PIN-07", tip_mm, None, 0.05)
        >>> cell = CellDrift("cell-a", (change,), charts=(), findings=())
        >>> page = render_drift([cell], made_at="2026-11-23T08:00:00Z", robolink_version="0.1.0")
        >>> "Nothing stands out" in page
        True
    """
    band = simulated_band(any(cell.simulated for cell in cells))
    found = sum(len(cell.findings) for cell in cells)
    verdict = tr("To look at: {count}", count=found) if found else tr("Nothing stands out")
    style = files("robolink.report").joinpath("style.css").read_text(encoding="utf-8")
    return (
        templates()
        .get_template("drift.html")
        .render(
            title=tr(
                "Tool offsets over time: {cell}",
                cell=", ".join(cell.controller for cell in cells),
            ),
            policy=POLICY,
            style=Markup(style),
            tone="bad" if found else "good",
            verdict=simulated_verdict(verdict) if band else verdict,
            band=band,
            cells=cells,
            chart_drawing=chart_drawing,
            chart_title=chart_title,
            made_at=made_at,
            robolink_version=robolink_version,
        )
    )


def save_drift(
    cells: Sequence[CellDrift],
    path: Path,
    *,
    made_at: str,
    robolink_version: str,
    replace: bool = False,
) -> None:
    """Write that page; it is whole and on the disk when this returns.

    Args:
        cells: Each with one measured change or more.
        path: Where.
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What makes the page.
        replace: Whether a file that is there may go.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.

    Example:
        >>> from pathlib import Path
        >>> from robolink.drift import CellDrift, MeasuredChange
        >>> from robolink.report import save_drift
        >>> at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
        >>> change = MeasuredChange(7, at, "c-1", 1, "N-0815", "PIN-07", tip_mm, None, 0.05)
        >>> cell = CellDrift("cell-a", (change,), charts=(), findings=())
        >>> path = Path("drift.html")
        >>> save_drift([cell], path, made_at="2026-11-23T08:00:00Z", robolink_version="0.1.0")
        >>> path.read_text(encoding="utf-8")[:15]
        '<!DOCTYPE html>'
    """
    page = render_drift(cells, made_at=made_at, robolink_version=robolink_version)
    save_named(path, page.encode("utf-8"), replace=replace)
