"""config path, check, show: the cell files."""

from pathlib import Path

import click

from robolink_cli.console.render import emit_json, json_is_on
from robolink_cli.session.context import CliContext, controller_options, json_option


@click.group()
def config() -> None:
    """Look at the cell files: which there are, whether they are right, what they say."""


@config.command("path")
@json_option
def path() -> None:
    """Show the files that are looked at; the first that says something wins."""
    from robolink_cli.views.cells import files_payload, show_files

    payload = files_payload()
    if json_is_on():
        emit_json("robolink/config-path/1", {"files": payload})
    else:
        show_files(payload)


@config.command("check")
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path), required=False)
@json_option
def check(file: Path | None) -> int:
    """Check one cell FILE, or all that are in use, and say everything that is wrong."""
    from robolink_cli.views.cells import check_payload, show_check

    payload = check_payload(file)
    if json_is_on():
        emit_json("robolink/config-check/1", payload)
    else:
        show_check(payload)
    return 0 if payload["ok"] else 2


@config.command("show")
@click.argument("cell", required=False)
@click.option("--origin", is_flag=True, help="Say where each value came from.")
@controller_options
def show(context: CliContext, cell: str | None, origin: bool) -> None:
    """Show the cells, or all that is in force for one CELL.

    Options such as --timeout are counted in, so it shows what a command given the same ones
    would work with.
    """
    from robolink.config import find_cell, load_cells
    from robolink_cli.views.cells import cell_payload, cells_payload, show_cell, show_cells

    chosen = find_cell(cell) if cell else context.cell
    if chosen is None:
        payload = cells_payload(load_cells().values())
        context.emit("config-cells", payload, lambda: show_cells(payload))
    else:
        payload = cell_payload(chosen, context, origin=origin)
        context.emit("config-show", payload, lambda: show_cell(payload))
