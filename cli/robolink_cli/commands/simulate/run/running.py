"""Serving the cells of a file in one process, until all of them end together."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final

from robolink_simulators.control.cell import AnySimulator
from robolink_simulators.hosting.garbage import RareFullCollections

from robolink.errors import ConfigError, ConnectError, RobolinkError
from robolink.messages import joined, tr
from robolink_cli.commands.simulate.kinds.simulated_kind import ServedCell
from robolink_cli.commands.simulate.run.fleet import PlannedCell
from robolink_cli.commands.simulate.serving import Termination, announce, controlled
from robolink_cli.options.simulation import ServedLife

SCHEMA: Final = "robolink/sim-run/1"
"""Of the first line."""

_MOST_SHOWN: Final = 20


def made(cells: Sequence[PlannedCell]) -> Mapping[str, AnySimulator]:
    """Make the simulators of cells; no port is opened.

    Raises:
        ConfigError: One cannot be made; tells which.
    """
    simulators = dict[str, AnySimulator]()
    for cell in cells:
        try:
            simulators[cell.name] = cell.kind.make(**cell.given)
        except RobolinkError as error:
            raise ConfigError(_of_cell(cell, error), remedy=error.remedy) from error
    return simulators


def run_cells(path: Path, cells: Sequence[PlannedCell], life: ServedLife) -> None:
    """Serve cells until SIGTERM or Ctrl-C, and say where they are once all of them listen.

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
    except (ConfigError, ConnectError) as error:
        raise type(error)(_of_cell(cell, error), remedy=error.remedy) from error


def _failure(
    cells: Sequence[PlannedCell], simulators: Mapping[str, AnySimulator]
) -> ConfigError | None:
    """Return why a cell can go on no longer, ``None`` as long as all can."""
    for cell in cells:
        if (failed := simulators[cell.name].failure) is not None:
            return ConfigError(_of_cell(cell, failed), remedy=failed.remedy)
    return None


def _of_cell(cell: PlannedCell, error: RobolinkError) -> str:
    return joined(": ", (cell.name, error.what))


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
    """Let this process have as many sockets open as the system lets it."""
    try:
        import resource  # not on Windows, which has no such limit
    except ImportError:
        return
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):  # some systems name a limit that they do not grant
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
