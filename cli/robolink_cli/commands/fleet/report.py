"""fleet report: one page about a plant, from what is on record there."""

import datetime
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import json_fields
from robolink.timing import wall_time
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit, say
from robolink_cli.options.consent import Overwrite
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import LINE, json_option
from robolink_cli.views.fleet import halt_payload, states_payload

if TYPE_CHECKING:
    from collections.abc import Iterable

    from robolink.config import Cell
    from robolink.fleet import PlantReport

_DAYS: Final = 30
_CHECK_DAYS: Final = 7


@click.command("report", short_help="Write a page about a plant: drift, recipes, plans.")
@json_option
def report(
    *,
    plant: Annotated[str, LINE, CliArgument()] = "plant",
    file: Annotated[Path | None, CliArgument()] = None,
    since: Annotated[
        datetime.datetime | None,
        click.DateTime(["%Y-%m-%d"]),
        CliOption(
            metavar="YYYY-MM-DD",
            help="Count changes and plans from this day on (UTC); the last 30 days unless given.",
        ),
    ] = None,
    check_days: Annotated[
        int,
        click.IntRange(min=0, max=3650),
        CliOption(help="After how many days without a check a cell is named."),
    ] = _CHECK_DAYS,
    force: Overwrite = False,
) -> int:
    """Write one HTML page about PLANT to FILE, to keep, mail or print.

    It reads the plant's copies of the journals, or where there are none the journals of this
    computer, and what its agents noted; no controller and no cell is asked. Exit code 1 when
    something on it needs a person.
    """
    from robolink.files.named import require_free
    from robolink.fleet.plant_view.report_page import save_plant

    path = file or Path(f"plant-{wall_time().astimezone():%Y-%m-%d}.html")
    require_free(path, replace=force)
    made = _made(plant, since, check_days)
    save_plant(made, path, replace=force)
    payload = {"file": str(path), **report_payload(made)}
    emit("fleet-report", payload, lambda: _show(made, path))
    return 0 if made.in_order else DIFFERENT


def _made(plant: str, since: datetime.datetime | None, check_days: int) -> "PlantReport":
    from robolink.config import use_journals_of_files
    from robolink.fleet import PlantNotes, default_plant, report_of
    from robolink.fleet.plant_view.copies import journals_of_plant

    now = wall_time()
    begin = f"{since or now - datetime.timedelta(days=_DAYS):%Y-%m-%d}"
    use_journals_of_files()
    with PlantNotes(default_plant(), plant) as notes:
        look = notes.look(most=0, since=begin)
    journals = journals_of_plant(_own_cells)
    made = report_of(look, journals, plant=plant, since=begin, now=now, check_days=check_days)
    known = made.cell_count or made.unheard or made.change_count or made.plans
    if not known:  # a page would say: all is well
        raise ConfigError(
            tr("Nothing is on record of a plant {plant}.", plant=plant),
            remedy=tr("No page was written. Its agent's name of the plant is meant."),
        )
    return made


def _own_cells() -> "Iterable[Cell]":
    from robolink.config import load_cell_files

    return load_cell_files().cells.values()


def report_payload(made: "PlantReport") -> dict[str, object]:
    """Return a report as plain JSON."""
    return {
        **json_fields(made, "plant", "since", "made_at", "simulated", "in_order"),
        **json_fields(made, "cell_count", "change_count"),
        **{name: dict(getattr(made, name)) for name in ("unsettled", "attention", "overdue")},
        "unheard_days": dict(made.unheard),
        "behind_days": dict(made.behind),
        "findings": [
            {
                "cell": one.cell,
                **json_fields(one.finding, "code", "subject", "since", "change", "shift_mm"),
                "text": one.finding.sentence,
                "remedy": one.finding.remedy,
            }
            for one in made.findings
        ],
        "trends": [{**asdict(one), "nozzle": one.nozzle or None} for one in made.trends],
        "corrections": [
            {
                **json_fields(one, "name", "hash", "count", "median_mm", "spread_mm"),
                "outliers": [{"cell": cell, "moved_mm": mm} for cell, mm in one.outliers],
            }
            for one in made.corrections
        ],
        "recipes": [{**asdict(one), "cells": list(one.cells)} for one in made.recipes],
        "plans": [
            {
                "plan": one.id,
                **json_fields(one, "kind", "name", "made_at", "finished"),
                "recipe_hash": one.recipe_hash or None,
                "cancelled_at": one.cancelled_at or None,
                "states": states_payload(one.counts),
                "halts": [halt_payload(halt) for halt in one.halts],
            }
            for one in made.plans
        ],
    }


def _show(made: "PlantReport", path: Path) -> None:
    for count, sentence in (
        (len(made.unsettled), tr("cells with an unfinished job")),
        (len(made.attention), tr("cells whose last check found something")),
        (len(made.overdue), tr("cells without a recent check")),
        (len(made.unheard), tr("cells not heard of for a day")),
        (len(made.behind), tr("cells whose newest changes are not copied")),
        (len(made.findings), tr("unusual charts")),
        (sum(bool(plan.standing) for plan in made.plans), tr("halted plans")),
        (sum(plan.left_count for plan in made.plans), tr("jobs refused, missed or unsettled")),
    ):
        if count:
            say(f"{count} {sentence}")
    say(tr("Report: {path}", path=path))
