"""sim run: serve all simulated cells of a file from one process."""

from dataclasses import replace
from pathlib import Path

import click

from robolink.messages import tr
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import ServedLife, life_options


@click.command("run", short_help="Serve many simulated controllers, as a file says.")
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--check", "only_checked", is_flag=True, help="Only check the file; serve nothing.")
@click.option(
    "--wait-ready",
    is_flag=True,
    help="Serve in the background: print one JSON line once all cells listen, and end with 0; "
    "'pid' in it is the process that serves, which SIGTERM ends.",
)
@life_options
@json_option
def sim_run(*, file: Path, only_checked: bool, wait_ready: bool, life: ServedLife) -> int:
    """Serve many simulated controllers of all kinds, as a file says, until Ctrl-C.

    The first line names every cell with its URLs, its control URL and the folder for what its
    clients keep on record; with --json it is one JSON document. docs/simulated-fleet.md explains
    the file.
    """
    from robolink_cli.commands.simulate.run.background import parent_of_starter, start_and_wait
    from robolink_cli.commands.simulate.run.cells_file import read_cells

    cells = read_cells(file, _serving_commands())
    if only_checked:
        names = [cell.name for cell in cells]
        if json_is_on():
            emit_json("robolink/sim-cells-check/1", {"file": str(file), "cells": names})
        else:
            say(tr("{path} is right: {count} cells.", path=file, count=len(names)))
        return 0
    if wait_ready:
        return start_and_wait([str(file), *_as_typed(life)])
    from robolink_cli.commands.simulate.run.running import run_cells

    run_cells(file, cells, replace(life, parent=parent_of_starter()))
    return 0


def _serving_commands() -> dict[str, click.Command]:
    """Return the commands beside this one: what they take, the file may say."""
    parent = click.get_current_context().parent
    group = parent and parent.command
    return dict(group.commands) if isinstance(group, click.Group) else {}


def _as_typed(life: ServedLife) -> list[str]:
    typed = ["--control", life.control]
    if life.with_parent:
        typed.append("--with-parent")
    if life.idle_exit_s is not None:
        typed += ["--idle-exit", str(life.idle_exit_s)]
    return typed
