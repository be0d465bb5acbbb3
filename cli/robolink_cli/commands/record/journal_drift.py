"""journal drift: how the tools of cells went over their changes. Reads only, no controller."""

import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from robolink.messages import declared, tr
from robolink_cli.access.cell import complete_cell
from robolink_cli.commands.record.journal_lookup import (
    cell_meant,
    controller_meant,
    journal_to_read,
)
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.shared import json_option
from robolink_cli.session.completing import complete_tool

if TYPE_CHECKING:
    from robolink.drift import CellDrift
    from robolink.journal import Journal
    from robolink.model import Recorded


@click.command("drift", short_help="Show how each tool's offset moved, and what stands out.")
@click.option(
    "-c",
    "--controller",
    metavar="CELL|URL",
    shell_complete=complete_cell,
    help=declared("Only of this controller; without it, of all."),
)
@click.option(
    "--tool", type=int, metavar="N", shell_complete=complete_tool, help=declared("Only this tool.")
)
@click.option(
    "--since",
    type=click.DateTime(["%Y-%m-%d"]),
    metavar="YYYY-MM-DD",
    help=declared(
        "Start again from this day, after a repair or with another kind of nozzle (UTC)."
    ),
)
@click.option(
    "--baseline",
    type=click.IntRange(min=20, max=1000),
    metavar="N",
    default=20,
    show_default=True,
    help=declared("On how many of the first changes the limits rest."),
)
@click.option("--plots", is_flag=True, help=declared("Draw every chart, not only what stands out."))
@click.option(
    "--page",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help=declared("Also write all charts to FILE, a page for a browser."),
)
@click.option("--force", is_flag=True, help=declared("Overwrite a file that is already there."))
@json_option
def drift(
    *,
    controller: str | None,
    tool: int | None,
    since: datetime.datetime | None,
    baseline: int,
    plots: bool,
    page: Path | None,
    force: bool,
) -> int:
    """Show how each tool's offset moved from change to change, and what stands out.

    Nozzles that wear, mounts that slip, pins that moved, a last change out of the ordinary. Only
    changes that were measured and kept count. Exit code 1 when something stands out.
    """
    from robolink.journal import default_location, may_exist
    from robolink_cli.commands.record.drift_views import drift_payload, show_drift

    if page is not None:
        from robolink.files.named import require_free

        require_free(page, replace=force)
    meant = controller_meant(controller)
    begin = f"{since:%Y-%m-%d}" if since else ""
    cells: list[CellDrift] = []
    if may_exist(default_location()):
        cells = _cells(journal_to_read(), meant, tool=tool, since=begin, baseline=baseline)
    if page is not None and cells:
        _write(cells, page, replace=force)
    if json_is_on():
        emit_json("robolink/drift/1", {**drift_payload(cells), "page": page and str(page)})
    elif not cells:
        say(tr("No measured change is on record here."))
    else:
        show_drift(cells, all_plots=plots, called=cell_meant(controller))
        if page is not None:
            say(tr("Page: {path}", path=page))
    return DIFFERENT if any(cell.findings for cell in cells) else 0


def _cells(
    journal: "Journal", controller: str | None, *, tool: int | None, since: str, baseline: int
) -> "list[CellDrift]":
    """Return the course of each controller that has measured changes, in the order of names."""
    from robolink.drift import KINDS, drift_of
    from robolink.methods import all_methods

    finding = {method.name for method in all_methods() if method.needs.finds_pin}
    by_controller: dict[str, list[Recorded]] = {}
    for entry in journal.entries(controller=controller, kinds=KINDS, newest_first=False):
        by_controller.setdefault(entry.controller, []).append(entry)
    one_name: dict[str, list[Recorded]] = {}
    for name, entries in by_controller.items():
        one_name.setdefault(_name_now(journal, name), []).extend(entries)
    cells = [
        drift_of(
            name,
            sorted(entries, key=lambda entry: entry.number),
            finds_pin=finding.__contains__,
            tool=tool,
            since=since,
            baseline=baseline,
        )
        for name, entries in sorted(one_name.items())
    ]
    return [cell for cell in cells if cell.changes]


def _name_now(journal: "Journal", name: str) -> str:
    """Return what a controller is called now that was called something else before."""
    return journal.names_of(name)[0]


def _write(cells: "list[CellDrift]", page: Path, *, replace: bool) -> None:
    from robolink import __version__
    from robolink.report import save_drift
    from robolink.timing import wall_time

    made_at = wall_time().astimezone(datetime.UTC).isoformat(timespec="seconds")
    save_drift(cells, page, made_at=made_at, robolink_version=__version__, replace=replace)
