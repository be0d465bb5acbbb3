"""sim run: serves all simulated cells of a file from one process."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Annotated, Final

import click
from robolink_simulators.control.cell import AnySimulator
from robolink_simulators.hosting.garbage import RareFullCollections

from robolink.errors import ConfigError, ConnectError, RobolinkError
from robolink.messages import listed, tr
from robolink_cli.commands.simulate.cells_file import PlannedCell
from robolink_cli.commands.simulate.service import Termination, announce, controlled
from robolink_cli.commands.simulate.simulated_kind import ServedCell
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import ServedLife


@click.command("run", short_help="Serve many simulated controllers, listed in a file.")
@json_option
def sim_run(
    *,
    file: Annotated[Path, CliArgument()],
    only_checked: Annotated[
        bool, CliOption("--check", help="Only check the file; serve nothing.")
    ] = False,
    wait_ready: Annotated[
        bool,
        CliOption(
            help="Serve in the background: print one JSON line once all cells listen, and "
            "end with 0. Its 'pid' is the serving process; SIGTERM ends it."
        ),
    ] = False,
    life: ServedLife,
) -> int:
    """Serve many simulated controllers of all kinds, listed in a file, until Ctrl-C.

    The first line names every cell with its URLs, its control URL and the folder for its clients'
    records; with --json it is one JSON document. docs/fleet.md explains the file.
    """
    from robolink_cli.commands.simulate.cells_file import read_cells

    cells = read_cells(file, _serving_commands())
    if only_checked:
        names = [cell.name for cell in cells]
        if json_is_on():
            emit_json("robolink/sim-cells-check/1", {"file": str(file), "cells": names})
        else:
            say(tr("{path} is valid: {count} cells.", path=file, count=len(names)))
        return 0
    if wait_ready:
        return start_and_wait([str(file), *_as_typed(life)])

    run_cells(file, cells, life._replace(parent=parent_of_starter()))
    return 0


def _serving_commands() -> dict[str, click.Command]:
    """Return the commands beside this one: the file may hold what they take."""
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


SCHEMA: Final = "robolink/sim-run/1"
"""Schema of the first output line."""

_MOST_SHOWN: Final = 20


def made(cells: Sequence[PlannedCell]) -> Mapping[str, AnySimulator]:
    """Make the simulators of cells; opens no port.

    Raises:
        ConfigError: One cannot be made; tells which.
    """
    simulators = dict[str, AnySimulator]()
    for cell in cells:
        try:
            simulators[cell.name] = cell.kind.make(**cell.given)
        except RobolinkError as error:
            raise _of_cell(cell, error) from error
    return simulators


def run_cells(path: Path, cells: Sequence[PlannedCell], life: ServedLife) -> None:
    """Serve cells until SIGTERM or Ctrl-C, and show where they are once all listen.

    Args:
        path: Their file, for a person.
        cells: What to serve.
        life: Where they are controlled, and when they end by themselves.

    Raises:
        ConfigError: One cannot be made or served, or can keep its state no longer.
        ConnectError: A port is taken.
    """
    _raise_most_files()
    simulators = made(cells)
    with ExitStack() as stack:
        stopped = stack.enter_context(Termination(life))
        stack.enter_context(RareFullCollections())
        served = {cell.name: _served(stack, cell, simulators[cell.name]) for cell in cells}
        allowed = any(cell.given["allow_remote"] for cell in cells)
        controls = {name: one.controlled for name, one in served.items()}
        control = stack.enter_context(controlled(controls, life, allow_remote=allowed))
        about = {
            name: {
                **one.document(control.url_of(name)),
                "state_dir": str(Path(stopped.state_dir) / name),
            }
            for name, one in served.items()
        }
        document: dict[str, object] = {"control": control.url, "cells": about}
        lines = _told(path, about, control.url)
        announce(document, lines, stopped.state_dir, schema=SCHEMA)
        all_of_them = tuple(served.values())
        stopped.wait(
            lambda: sum(it.requests for it in all_of_them) + control.requests,
            lambda: _failure(cells, simulators),
        )


def _served(stack: ExitStack, cell: PlannedCell, simulator: AnySimulator) -> ServedCell:
    try:
        return cell.kind.serve(stack, simulator, cell.given, person=cell.assist)
    except ConfigError as error:
        raise _of_cell(cell, error) from error
    except ConnectError as error:
        raise ConnectError(_cannot_run(cell, error), remedy=error.remedy) from error


def _failure(
    cells: Sequence[PlannedCell], simulators: Mapping[str, AnySimulator]
) -> ConfigError | None:
    """Return why a cell cannot continue, ``None`` as long as all can."""
    for cell in cells:
        if (failed := simulators[cell.name].failure) is not None:
            return _of_cell(cell, failed)
    return None


def _of_cell(cell: PlannedCell, error: RobolinkError) -> ConfigError:
    return ConfigError(_cannot_run(cell, error), remedy=error.remedy)


def _cannot_run(cell: PlannedCell, error: RobolinkError) -> str:
    return listed(tr("The simulated cell {name} cannot run:", name=cell.name), [error.what])


def _told(path: Path, about: Mapping[str, Mapping[str, object]], control: str) -> list[str]:
    width = max(map(len, about))
    shown = list(about.items())[:_MOST_SHOWN]
    lines = [tr("SIMULATED: {count} cells of {path}. Nothing moves.", count=len(about), path=path)]
    lines += [f"  {name.ljust(width)}  {one['url']}" for name, one in shown]
    if len(about) > len(shown):
        lines.append("  " + tr("and {more} more", more=len(about) - len(shown)))
    lines.append(tr("  control  {url}", url=control))
    return [*lines, tr("Ctrl-C ends it.")]


def _raise_most_files() -> None:
    """Let this process open as many sockets as the system allows."""
    try:
        import resource  # not on Windows, which has no such limit
    except ImportError:
        return
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):  # some systems report a limit but do not grant it
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


PARENT: Final = "ROBOLINK_SIM_PARENT"
"""Environment variable with the number of the process whose end the started process waits for."""

_READY: Final = f'{{"schema": "{SCHEMA}"'
_LOOK_S: Final = 0.02
_MOST_S: Final = 120.0


def start_and_wait(arguments: Sequence[str]) -> int:
    """Start ``sim run`` beside this process and pass on its first line.

    Args:
        arguments: Of ``sim run``, without what led here.

    Returns:
        0 when all listen; else the exit code with which it ended, its message shown.

    Raises:
        ConnectError: Nothing came of it for two minutes; it was ended.
    """
    folder = Path(tempfile.mkdtemp(prefix="robolink-sim-log-"))
    log, errors = folder / "log.jsonl", folder / "messages.txt"
    with log.open("wb") as out, errors.open("wb") as messages:
        process = subprocess.Popen(
            [sys.executable, "-m", "robolink_cli", "--json", "sim", "run", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=messages,
            env={**os.environ, PARENT: str(os.getppid())},
            start_new_session=os.name != "nt",
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
    try:
        return _first_line(process, log, errors)
    except BaseException:  # leave no process whose first line was not read
        process.kill()
        process.wait()  # returns at once after the kill, and removes the zombie
        raise


def _first_line(process: "subprocess.Popen[bytes]", log: Path, errors: Path) -> int:
    began_s = time.monotonic()
    while time.monotonic() - began_s < _MOST_S:
        ended = process.poll()
        first, line_end, _ = log.read_text(encoding="utf-8").partition("\n")
        if ended is not None:
            _tell_end(log.read_text(encoding="utf-8"), errors.read_text(encoding="utf-8"))
            shutil.rmtree(log.parent, ignore_errors=True)  # its contents were shown
            return ended
        if line_end and first.startswith(_READY):
            hand_over(json.dumps({**json.loads(first), "log": str(log)}))
            return 0
        time.sleep(_LOOK_S)
    raise ConnectError(
        tr("The simulators did not listen within {seconds:g} s.", seconds=_MOST_S),
        remedy=tr("Their output is in {path}.", path=errors),
    )


def _tell_end(document: str, messages: str) -> None:
    """Report why nothing is served, as the process would have reported it itself."""
    if messages:
        show(messages.rstrip("\n"), beside=True)
    if json_is_on() or not document.startswith("{"):
        hand_over(document.rstrip("\n"))
        return
    if document.startswith(_READY):  # a line about listening may come before it
        _, _, document = document.partition("\n")
    error = json.loads(document).get("error") if document.strip() else None
    if error is not None:  # otherwise it was asked to end, or the system ended it
        show(f"robolink: {error['what']}\n  {error['remedy']}", beside=True)


def parent_of_starter() -> int | None:
    """Return the process whose end a started process waits for, ``None`` for its starter."""
    named = os.environ.get(PARENT, "")
    return int(named) if named.isascii() and named.isdigit() else None
