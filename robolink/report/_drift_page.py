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


def render_drift(cells: Sequence[CellDrift], *, made_at: str, robolink_version: str) -> str:
    """Return the control charts of cells as one HTML page, in Unicode.

    Args:
        cells: Each with one measured change or more.
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What makes the page.
    """
    found = sum(len(cell.findings) for cell in cells)
    style = files("robolink.report").joinpath("style.css").read_text(encoding="utf-8")
    return (
        templates()
        .get_template("drift.html")
        .render(
            title=tr("Tool offsets over time"),
            policy=POLICY,
            style=Markup(style),
            tone="bad" if found else "good",
            verdict=tr("To look at: {count}", count=found) if found else tr("Nothing stands out"),
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

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.
    """
    page = render_drift(cells, made_at=made_at, robolink_version=robolink_version)
    save_named(path, page.encode("utf-8"), replace=replace)
