"""The page of a plant's report: one HTML file that runs no script and loads nothing."""

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Final

from markupsafe import Markup

from robolink.files.named import save_named
from robolink.fleet.plant_view.plant_report import PlantReport
from robolink.fleet.states import JobState
from robolink.messages import tr
from robolink.report._page import POLICY, templates
from robolink.report.sections.summary import simulated_band, simulated_verdict
from robolink.version import VERSION

MOST_ROWS: Final = 60
"""Most rows of a table; a page of 2,000 cells is to be read. ``--json`` has all of them."""

MOST_NAMES: Final = 16
"""Most names of cells in one line."""


def render_plant(report: PlantReport) -> str:
    """Return the report as one HTML page, in Unicode.

    Args:
        report: What it says.
    """
    band = simulated_band(report.simulated)
    verdict = tr("Nothing needs a person") if report.in_order else tr("A person has to look")
    style = files("robolink.report").joinpath("style.css").read_text(encoding="utf-8")
    return (
        templates()
        .get_template("plant.html")
        .render(
            title=tr("Plant {plant}", plant=report.plant),
            policy=POLICY,
            style=Markup(style),
            tone="good" if report.in_order else "bad",
            verdict=simulated_verdict(verdict) if band else verdict,
            band=band,
            report=report,
            rows=MOST_ROWS,
            some=some_names,
            states=list(JobState),
            version=VERSION,
        )
    )


def save_plant(report: PlantReport, path: Path, *, replace: bool = False) -> None:
    """Write that page; on return it is complete and on the disk.

    Args:
        report: What it says.
        path: Where.
        replace: Whether a file that is there may go.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be written.
            What was there is unchanged.
    """
    save_named(path, render_plant(report).encode("utf-8"), replace=replace)


def some_names(names: Sequence[str], most: int = MOST_NAMES) -> str:
    """Return names in a line, and how many more there are."""
    shown = ", ".join(list(names)[:most])
    more = len(names) - most
    return tr("{names} and {more} more", names=shown, more=more) if more > 0 else shown
