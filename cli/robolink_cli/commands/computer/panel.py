"""panel: serves pages on which cells are shown, and needles changed, with a finger."""

import json
import os
import sys
from contextlib import ExitStack
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink.model import Secret
from robolink_cli.commands.simulate.service import host_and_port
from robolink_cli.console.language import language_now
from robolink_cli.console.output import hand_over
from robolink_cli.console.render import json_is_on, note, say
from robolink_cli.lazy_group import LazyGroup
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import LINE, json_option

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink_cli.commands.simulate.panel_cells import DemoCells
    from robolink_cli.panel.board import PanelCell
    from robolink_cli.panel.serving import PanelPlace, Served

NEEDED: Final = ("starlette", "uvicorn", "websockets")
"""Packages of the extra, without which no page is served."""


_ACCESS: Final = "robolink_cli.commands.computer.panel_access"

SUBCOMMANDS: Final = {
    "pin": (f"{_ACCESS}:pin", declared("Set the PIN of a person, or of this computer.")),
    "tablets": (f"{_ACCESS}:tablets", declared("List the paired tablets; forget one.")),
    "token": (
        "robolink_cli.commands.computer.panel_tokens:token",
        declared("Tokens of line computers, which order jobs: give list revoke"),
    ),
    "cert": (f"{_ACCESS}:cert", declared("Make a certificate, for tablets on the network.")),
}
"""What else there is about the panel, as :class:`~robolink_cli.lazy_group.LazyGroup` takes it."""


@click.group(cls=LazyGroup, lazy=SUBCOMMANDS, invoke_without_command=True)
@json_option
def panel(
    *,
    cells: Annotated[
        Path | None,
        click.Path(exists=True, dir_okay=False, path_type=Path),
        CliOption(metavar="FILE", help="Show the cells of this cell file, and no others."),
    ] = None,
    listen: Annotated[
        str,
        CliOption(
            metavar="HOST:PORT",
            help="Where browsers connect; port 0 takes a free one. Another address than this "
            "computer's own needs TLS, and each tablet is paired first.",
        ),
    ] = "127.0.0.1:8421",
    certificate: Annotated[
        Path | None,
        click.Path(exists=True, dir_okay=False, path_type=Path),
        CliOption("--tls-cert", metavar="FILE", help="Certificate, with its chain, as PEM."),
    ] = None,
    key: Annotated[
        Path | None,
        click.Path(exists=True, dir_okay=False, path_type=Path),
        CliOption("--tls-key", metavar="FILE", help="Its key, as PEM."),
    ] = None,
    plant: Annotated[
        str, LINE, CliOption(metavar="NAME", help="The plant whose plans people begin here.")
    ] = "plant",
    demo: Annotated[
        bool,
        CliOption(help="Show simulated cells of three kinds, which are served meanwhile."),
    ] = False,
) -> None:
    """Serve pages for a tablet at the cell until Ctrl-C. They show, they ask, and STOP.

    Each job runs in a process of its own, which ends in order when the panel does. The panel
    itself is connected to no controller.
    """
    if click.get_current_context().invoked_subcommand is not None:
        return
    require_packages(NEEDED)
    if os.name != "posix":
        raise ConfigError(
            tr("The panel needs Linux or macOS: jobs cannot be started from it here."),
            remedy=tr("Tablets of any kind can open its pages."),
        )
    if demo and cells is not None:
        raise click.UsageError(tr("--demo has cells of its own: leave --cells out."))
    host, port = host_and_port(listen, "--listen")
    with ExitStack() as stack:
        simulated = _demo(stack) if demo else None
        if simulated is not None:
            cells = simulated.cells_file
        if cells is not None:
            os.environ["ROBOLINK_CONFIG"] = str(cells.absolute())
        place, names = _place(host, port, certificate, key)
        served = _served(cells, names, simulated=demo)
        from robolink_cli.panel.guard.audit import Audit
        from robolink_cli.panel.serving import run

        audit = Audit({cell.name: cell.url for cell in served.cells})
        stack.callback(audit.close)
        served = replace(served, audit=audit, plant=plant)
        run(served, place, lambda url: _announce(url, served, simulated))


def require_packages(names: tuple[str, ...]) -> None:
    """Refuse to go on without packages of the extra.

    Raises:
        ConfigError: One is missing; says how it is installed.
    """
    missing = [name for name in names if find_spec(name) is None]
    if missing:
        raise ConfigError(
            tr("The panel needs packages that are missing: {names}.", names=", ".join(missing)),
            remedy=tr("Run: python -m pip install 'robolink[panel]'"),
        )


def _demo(stack: ExitStack) -> "DemoCells":
    """Serve simulated cells until a stack is closed, with a state folder and a PIN of their own."""
    from robolink_cli.commands.simulate.panel_cells import demo_cells
    from robolink_cli.panel.guard.people import NOBODY, Pins

    cells = stack.enter_context(demo_cells())
    os.environ["ROBOLINK_STATE_DIR"] = str(cells.state)
    os.environ["ROBOLINK_PLANT"] = ""  # what is done to these cells is copied nowhere
    stack.callback(os.chdir, os.getcwd())
    os.chdir(cells.folder)  # jobs find the recipes that lie there
    Pins().set(NOBODY, Secret(cells.pin))
    return cells


def _place(
    host: str, port: int, certificate: Path | None, key: Path | None
) -> "tuple[PanelPlace, tuple[str, ...]]":
    """Return where the panel is served, and the names of its certificate.

    Raises:
        ConfigError: Other computers could reach it, and there is no TLS; or the certificate cannot
            be used.
    """
    from robolink_cli.panel.guard.access import is_loopback
    from robolink_cli.panel.serving import PanelPlace

    if (certificate is None) != (key is None):
        raise click.UsageError(tr("--tls-cert and --tls-key go together."))
    if certificate is None and is_loopback(host):
        return PanelPlace(host, port), ()
    require_packages(("cryptography",))
    from robolink_cli.panel.guard import tls

    path, own_key = (certificate, key) if certificate and key else tls.own_files()
    if certificate is None and not path.exists():
        raise ConfigError(
            tr("Other computers can reach {host}, so the panel needs TLS there.", host=host),
            remedy=tr("Run 'robolink panel cert', or give --tls-cert and --tls-key."),
        )
    found = tls.load(path, own_key)
    name = found.names[0].replace("*", "panel") if host in ("0.0.0.0", "::") else ""
    return PanelPlace(host, port, str(found.path), str(found.key), name), found.names


def _served(cells_file: Path | None, names: tuple[str, ...], *, simulated: bool) -> "Served":
    """Return what the panel shows, and to whom.

    Raises:
        ConfigError: A cell file is wrong, or there is no cell.
    """
    from robolink.config import load_cell_files, settings_of_file, use_journals_of
    from robolink_cli.panel.serving import Served

    only = None if cells_file is None else set(settings_of_file(cells_file))
    files = load_cell_files()
    use_journals_of(files.cells.values(), files.journal)
    found = {name: cell for name, cell in files.cells.items() if only is None or name in only}
    for name, cell in tuple(found.items()):
        if "+sim://" in cell.url:
            del found[name]
            note(
                tr(
                    "{cell} is left out: it is simulated inside each command. Serve it with "
                    "'robolink sim'.",
                    cell=name,
                )
            )
    if not found:
        raise ConfigError(
            tr("There is no cell to show."),
            remedy=tr("To set one up: robolink cell new. To practise: robolink panel --demo"),
        )
    return Served(
        tuple(_shown(cell, simulated=simulated) for cell in found.values()),
        {name: cell.settings.people for name, cell in found.items()},
        names,
        groups=files.groups,
        language=language_now(),
    )


def _shown(cell: "Cell", *, simulated: bool) -> "PanelCell":
    from robolink_cli.panel.board import PanelCell

    settings = cell.settings
    return PanelCell(
        cell.name,
        cell.url,
        settings.watch_s,
        stations=tuple(settings.stations or ()),
        tool=settings.tool,
        simulated=simulated,
        configured=cell,
    )


def _announce(url: str, served: "Served", simulated: "DemoCells | None") -> None:
    """Tell where the panel is, once it listens."""
    if json_is_on():
        about = {"url": url, "cells": [cell.name for cell in served.cells], "pid": os.getpid()}
        demo = None if simulated is None else simulated.payload()
        hand_over(json.dumps({"schema": "robolink/panel/1", **about, "demo": demo}))
        return
    say(tr("Open {url} in a browser.", url=url))
    if simulated is not None:
        say(tr("SIMULATED: nothing real moves."))
        say(tr("PIN for moving and writing: {pin}", pin=simulated.pin))
        for assist in simulated.assists.values():
            command = f"robolink sim assist {assist} look"
            say(tr("To see how far a tip is from its pin: {command}", command=command))
    say(tr("Ctrl-C ends it."))
    sys.stdout.flush()
