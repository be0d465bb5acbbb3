"""cell list, show, people, files, validate: cells that have a name, and where it stands."""

from pathlib import Path
from typing import Annotated

import click

from robolink_cli.console.render import emit
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.session.context import CliContext, optional_controller


@click.command()
@json_option
def path() -> None:
    """Show the files that are looked at; the first that says something wins."""
    from robolink_cli.views.cells import files_payload, show_files

    payload = files_payload()
    emit("config-path", {"files": payload}, lambda: show_files(payload))


@click.command()
@json_option
def check(
    *,
    file: Annotated[Path | None, CliArgument()] = None,
) -> int:
    """Check one cell FILE, or all that are in use, and say everything that is wrong."""
    from robolink_cli.views.cells import check_payload, show_check

    payload = check_payload(file)
    emit("config-check", payload, lambda: show_check(payload))
    return 0 if payload["ok"] else 2


@click.command()
@optional_controller
def show(
    context: CliContext,
    *,
    cell: Annotated[str | None, CliArgument()] = None,
    origin: Annotated[bool, CliOption(help="Say where each value came from.")] = False,
) -> None:
    """Show the cells, or all that is in force for one CELL.

    Options such as --timeout are counted in, so it shows what a command given the same ones
    would work with.
    """
    from robolink.config import find_cell, load_cells
    from robolink_cli.views.cells import cell_payload, cells_payload, show_cell, show_cells

    chosen = find_cell(cell) if cell else context.cell
    if chosen is None:
        payload = cells_payload(load_cells().values())
        emit("config-cells", payload, lambda: show_cells(payload))
    else:
        payload = cell_payload(chosen, context, origin=origin)
        emit("config-show", payload, lambda: show_cell(payload))


@click.command("list")
@json_option
def list_cells() -> None:
    """List the cells that the cell files name, with their addresses."""
    from robolink.config import load_cells
    from robolink_cli.views.cells import cells_payload, show_cells

    payload = cells_payload(load_cells().values())
    emit("cells", payload, lambda: show_cells(payload))


@click.command()
@optional_controller
def people(
    context: CliContext,
    *,
    cell: Annotated[str | None, CliArgument()] = None,
) -> None:
    """List who works at one CELL, or at all, and in which role; an engineer may do everything."""
    from robolink.config import find_cell, load_cells
    from robolink_cli.views.cells import people_payload, show_people

    chosen = find_cell(cell) if cell else context.cell
    payload = people_payload([chosen] if chosen else load_cells().values())
    emit("cell-people", payload, lambda: show_people(payload))
