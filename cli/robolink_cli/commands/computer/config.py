"""cell list, show, people, files, validate: the named cells, and where they are defined."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import click

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import tr
from robolink_cli.access.cell import complete_cells
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, emit_json, json_is_on, note, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.prompts.questions import asked_for_text
from robolink_cli.session.context import CliContext, optional_controller

_LEFT_OUT = "-"
"""What a person types for an unknown value."""


@click.command("new")
@json_option
def new_cell(
    *,
    name: Annotated[str | None, CliArgument()] = None,
    url: Annotated[str | None, CliOption(metavar="URL", help="The controller's URL.")] = None,
    robot: Annotated[
        str | None,
        CliOption(
            metavar="MODEL",
            help="The robot model that the cell must have, as the controller reports it.",
        ),
    ] = None,
    remote_timeout_s: Annotated[
        float | None,
        NumberInside(min=0, min_open=True),
        CliOption("--time-out-set", help="The remote time-out that is set in an EPSON controller."),
    ] = None,
    read_by: Annotated[
        str | None,
        CliOption(
            metavar="WHO",
            help="Who read that time-out on the controller, and when; needed with it.",
        ),
    ] = None,
    file: Annotated[
        Path, CliOption(metavar=None, help="The cell file; its present content stays.")
    ] = Path("robolink.toml"),
) -> None:
    """Add a cell to a cell file; on a terminal it asks for what you left out.

    Connects to no controller. Never changes an existing cell.
    """
    from robolink.config import add_cell, content_with_cell

    asks = person_here() and not json_is_on()
    if not asks and (name is None or url is None):
        raise DeclinedError(
            tr("A cell needs a name and a URL, and there is nobody to ask."),
            remedy=tr("Write for example: robolink cell new line3 --url URL"),
        )
    name = _right(
        name,
        lambda: asked_for_text(tr("What is the cell called? For example: line3")),
        lambda typed: content_with_cell(file, typed, {}),
    )
    url = _right(
        url,
        lambda: asked_for_text(
            tr(
                "Where is the controller? For example: epson+tcp://192.168.0.1:5000 or "
                "softmotion+modbus-tcp://192.168.0.2"
            )
        ),
        lambda typed: content_with_cell(file, name, {"url": typed}),
    )
    said: dict[str, str | float] = {"url": url}
    robot = robot or (_if_known(tr("Which robot model must the cell have?")) if asks else None)
    if robot:
        said["robot"] = robot
    if remote_timeout_s is None and asks and url.startswith("epson+"):
        typed = _right(
            None,
            lambda: (
                _if_known(tr("Which remote time-out is set in the controller, in seconds?"))
                or _LEFT_OUT
            ),
            lambda typed: typed == _LEFT_OUT or _seconds(typed),
        )
        remote_timeout_s = None if typed == _LEFT_OUT else _seconds(typed)
    if remote_timeout_s is not None:
        said["remote_timeout_s"] = remote_timeout_s
        read_by = read_by or (
            asked_for_text(tr("Who read that time-out on the controller, and when?"))
            if asks
            else None
        )
    if read_by:
        said["remote_timeout_confirmed_by"] = read_by
    add_cell(file, name, said)
    if json_is_on():
        emit_json("robolink/cell-new/1", {"cell": name, "path": str(file)})
        return
    say(tr("Written: {path}", path=file))
    say(tr("Next: {command}", command=f'robolink -c "{name}" status'))


def _right(given: str | None, ask: Callable[[], str], check: Callable[[str], object]) -> str:
    """Return a given or typed value; after a wrong one tell the person, and ask again.

    Raises:
        ConfigError: What was given is wrong.
    """
    if given is not None:
        check(given)
        return given
    while True:
        typed = ask()
        try:
            check(typed)
        except ConfigError as error:
            note(error.what)
        except click.BadParameter as error:
            note(error.format_message())
        else:
            return typed


def _if_known(question: str) -> str | None:
    answer = asked_for_text(tr("{question} Type - if you do not know.", question=question))
    return None if answer == _LEFT_OUT else answer


def _seconds(text: str) -> float:
    return float(NumberInside(min=0, min_open=True).convert(text, None, None))


@click.command()
@json_option
def path() -> None:
    """Show the cell files that robolink reads; the first with a value wins."""
    from robolink_cli.views.cells import files_payload, show_files

    payload = files_payload()
    emit("config-path", {"files": payload}, lambda: show_files(payload))


@click.command()
@json_option
def check(
    *,
    file: Annotated[Path | None, CliArgument()] = None,
) -> int:
    """Check one cell FILE, or all that are in use, and list every error."""
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
    origin: Annotated[bool, CliOption(help="Show where each value comes from.")] = False,
) -> None:
    """Show the cells, or all settings of one CELL.

    Options such as --timeout count: it shows the settings of a command with the same options.
    """
    from robolink.config import find_cell, load_cells, use_journals_of
    from robolink_cli.views.cells import cell_payload, cells_payload, show_cell, show_cells

    chosen = find_cell(cell) if cell else context.cell
    if chosen is None:
        payload = cells_payload(load_cells().values())
        emit("config-cells", payload, lambda: show_cells(payload))
    else:
        use_journals_of([chosen])
        payload = cell_payload(chosen, context, origin=origin)
        emit("config-show", payload, lambda: show_cell(payload))


@click.command("list")
@json_option
def list_cells(
    *,
    cells: Annotated[
        tuple[str, ...], CliArgument(metavar="[CELL]...", shell_complete=complete_cells)
    ] = (),
) -> None:
    """List the cells that the cell files name, with their addresses; all, or those that you name.

    CELL is a name, a pattern in quotes ('line3-*') or a group of the cell file (@line3).
    """
    from robolink.config import select_cells
    from robolink_cli.views.cells import cells_payload, show_cells

    payload = cells_payload(select_cells(cells))
    emit("cells", payload, lambda: show_cells(payload))


@click.command()
@optional_controller
def people(
    context: CliContext,
    *,
    cell: Annotated[str | None, CliArgument()] = None,
) -> None:
    """List who works at one CELL, or at all cells, and in which role."""
    from robolink.config import find_cell, load_cells
    from robolink_cli.views.cells import people_payload, show_people

    chosen = find_cell(cell) if cell else context.cell
    payload = people_payload([chosen] if chosen else load_cells().values())
    emit("cell-people", payload, lambda: show_people(payload))
