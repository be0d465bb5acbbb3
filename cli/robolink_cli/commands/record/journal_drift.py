"""journal drift: how the tools of cells changed over time. Reads only, no controller."""

import datetime
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.drift import CellDrift, Chart, ChartPoint, last_statements
from robolink.messages import tr
from robolink.model import json_fields
from robolink.report import chart_title
from robolink_cli.commands.record.journal_lookup import (
    OfController,
    cell_meant,
    controller_meant,
    journal_to_read,
    place_to_read,
)
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit_json, json_is_on, say, table
from robolink_cli.options.consent import Overwrite
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.session.completion import complete_tool

if TYPE_CHECKING:
    from robolink.journal import Journal
    from robolink.model import Recorded


@click.command("drift", short_help="Show how each tool's offset moved, and what is unusual.")
@json_option
def drift(
    *,
    controller: OfController = None,
    tool: Annotated[
        int | None, CliOption(shell_complete=complete_tool, help="Only this tool.")
    ] = None,
    since: Annotated[
        datetime.datetime | None,
        click.DateTime(["%Y-%m-%d"]),
        CliOption(
            metavar="YYYY-MM-DD",
            help="Count only from this day on, after a repair or with another kind of "
            "nozzle (UTC).",
        ),
    ] = None,
    baseline: Annotated[
        int,
        click.IntRange(min=20, max=1000),
        CliOption(help="How many of the first changes set the limits."),
    ] = 20,
    plots: Annotated[bool, CliOption(help="Draw every chart, not only the unusual ones.")] = False,
    page: Annotated[
        Path | None, CliOption(help="Also write all charts to FILE, a page for a browser.")
    ] = None,
    force: Overwrite = False,
) -> int:
    """Show how each tool's offset moved from change to change, and what is unusual.

    Nozzles that wear, mounts that slip, pins that moved, an unusual last change. Only changes that
    were measured and kept count. Exit code 1 when something is unusual.
    """
    from robolink.journal import may_exist

    if page is not None:
        from robolink.files.named import require_free

        require_free(page, replace=force)
    meant = controller_meant(controller)
    begin = f"{since:%Y-%m-%d}" if since else ""
    cells: list[CellDrift] = []
    if may_exist(place_to_read(meant)):
        cells = _cells(journal_to_read(meant), meant, tool=tool, since=begin, baseline=baseline)
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
    """Return the drift of each controller that has measured changes, in the order of names."""
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
    """Return a controller's present name, from a former one."""
    return journal.names_of(name)[0]


def _write(cells: "list[CellDrift]", page: Path, *, replace: bool) -> None:
    from robolink import __version__
    from robolink.report import save_drift
    from robolink.timing import wall_time

    made_at = wall_time().astimezone(datetime.UTC).isoformat(timespec="seconds")
    save_drift(cells, page, made_at=made_at, robolink_version=__version__, replace=replace)


_ROWS: Final = 9
_COLUMNS: Final = 60
_LEAST_REACH_MM: Final = 0.005


def show_drift(cells: Sequence[CellDrift], *, all_plots: bool, called: str = "") -> None:
    """Print a table a controller, the charts of unusual values, and what they mean.

    Args:
        cells: The controllers.
        all_plots: Whether every chart is drawn.
        called: What a person calls the only one; empty where nobody named it.
    """
    for number, cell in enumerate(cells):
        if number:
            say("")
        _show_cell(cell, called if len(cells) == 1 else "", all_plots=all_plots)
    if not any(cell.findings for cell in cells):
        say(tr("Nothing is unusual."))


def _show_cell(cell: CellDrift, called: str, *, all_plots: bool) -> None:
    first, last = cell.changes[0].at[:10], cell.changes[-1].at[:10]
    title = tr(
        "{controller}: measured changes: {count}, {first} to {last}",
        controller=_named(cell, called),
        count=len(cell.changes),
        first=first,
        last=last,
    )
    if cell.charts:
        columns = (tr("what"), tr("values"), tr("mean mm"), tr("last mm"), tr("limits mm"), "")
        table(title, columns, [_row(chart) for chart in cell.charts])
    else:
        say(title)
        say(tr("A trend needs two measured changes of a tool."))
    for sentence in last_statements(cell.changes):
        say(sentence)
    for chart in cell.charts:
        if chart.limits_mm is None:
            say(
                tr(
                    "Limits need 20 changes; until then nothing is judged, except a nozzle "
                    "that is measured repeatedly."
                )
            )
            break
    for chart in cell.charts:
        if all_plots or _stands_out(cell, chart):
            say(f"\n{chart_title(chart)}")
            for line in plot_lines(chart):
                say(line)
            if told := mean_line(chart):
                say(told)
    for finding in cell.findings:
        say(f"\n{finding.sentence}\n  {finding.remedy}")


def _row(chart: Chart) -> tuple[str, ...]:
    limits = chart.limits_mm
    return (
        chart_title(chart),
        str(len(chart.points)),
        f"{chart.centre_mm:.3f}",
        f"{chart.points[-1].value_mm:.3f}",
        f"{limits[0]:.3f} .. {limits[1]:.3f}" if limits else tr("none yet"),
        _state(chart),
    )


def _state(chart: Chart) -> str:
    if chart.limits_mm is None:
        return ""
    if chart.last.mean_outside:
        return tr("shifting")
    return tr("last one outside") if chart.last.outside else tr("as usual")


def _stands_out(cell: CellDrift, chart: Chart) -> bool:
    return any(
        chart.subject in finding.subject and chart.axis in finding.shift_mm
        for finding in cell.findings
    )


def plot_lines(chart: Chart) -> Iterator[str]:
    """Yield the chart of the newest values, one character a value, oldest at the left.

    ``o`` is a value, ``X`` one outside the limits, ``+`` the same nozzle measured again; a row of
    dashes is a limit, one of dots the mean.
    """
    points = chart.points[-_COLUMNS:]
    limits = chart.limits_mm or ()
    shown = [point.value_mm for point in points] + list(limits)
    reach = max(_LEAST_REACH_MM, *(abs(value - chart.centre_mm) for value in shown))

    def row_of(value: float) -> int:
        return round((_ROWS - 1) / 2 * (1 - (value - chart.centre_mm) / reach))

    ruled = {row_of(chart.centre_mm): ".", **{row_of(limit): "-" for limit in limits}}
    named = {row_of(chart.centre_mm): chart.centre_mm, **{row_of(limit): limit for limit in limits}}
    for row in range(_ROWS):
        ground = ruled.get(row, " ")
        cells = (_mark(p) if row_of(p.value_mm) == row else ground for p in points)
        label = f"{named[row]:9.3f} " if row in named else " " * 10
        yield (label + "".join(cells)).rstrip()


def mean_line(chart: Chart) -> str:
    """Return the weighted mean and its limits; empty where there is none."""
    last, limits = chart.last, chart.mean_limits_mm
    if last.mean_mm is None or limits is None:
        return ""
    facts = {"mean": f"{last.mean_mm:.3f}", "low": f"{limits[0]:.3f}", "high": f"{limits[1]:.3f}"}
    if last.mean_outside:
        return tr("Weighted mean {mean} mm, outside its limits {low} to {high} mm.", **facts)
    return tr("Weighted mean {mean} mm, within its limits {low} to {high} mm.", **facts)


def _mark(point: ChartPoint) -> str:
    if point.outside:
        return "X"
    return "+" if point.repeat else "o"


def drift_payload(cells: Sequence[CellDrift]) -> dict[str, object]:
    """Return charts and findings as plain JSON values."""
    told = ("code", "subject", "since", "change", "shift_mm")
    return {
        "controllers": [
            {
                **json_fields(cell, "controller", "simulated"),
                "change_count": len(cell.changes),
                "charts": [_chart(chart) for chart in cell.charts],
                "findings": [
                    {
                        **json_fields(finding, *told, text="sentence"),
                        "remedy": finding.remedy,
                    }
                    for finding in cell.findings
                ],
            }
            for cell in cells
        ]
    }


def _chart(chart: Chart) -> dict[str, object]:
    return {
        **json_fields(chart, "quantity", "subject"),
        "axis": chart.axis or None,
        "baseline_count": chart.baseline,
        **json_fields(chart, "centre_mm", "sigma_mm", "limits_mm", "mean_limits_mm"),
        "points": [
            {
                **json_fields(point.change, "at", "change"),
                "nozzle": point.change.nozzle or None,
                **json_fields(point, "value_mm", "repeat", "outside", "mean_mm", "mean_outside"),
                **json_fields(point.change, "repeatable_to_mm", "accurate_to_mm"),
            }
            for point in chart.points
        ],
    }


def _named(cell: CellDrift, called: str) -> str:
    """Return a cell by its name and its controller, and whether that is simulated."""
    name = f"{called} ({cell.controller})" if called else cell.controller
    return f"{name} ({tr('SIMULATED')})" if cell.simulated else name
