"""fleet agent: the process that carries plans out."""

import json
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.output import hand_over
from robolink_cli.console.render import json_is_on, note, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import LINE, json_option
from robolink_cli.session.plant_outbox import copying_meanwhile

if TYPE_CHECKING:
    from robolink.fleet.agent import Agent

NEEDED: Final = ("dbos", "sqlalchemy")
"""Packages of the extra without which no agent runs."""

_SIGNALS: Final = ("SIGINT", "SIGTERM", "SIGHUP")
_PASSED_ON: Final = (
    *("ROBOLINK_CONFIG", "ROBOLINK_JOURNAL", "ROBOLINK_PASSWORD_FILE", "ROBOLINK_PLANT"),
    "ROBOLINK_STATE_DIR",
)
"""What says where cell files, record and plans are."""

Backups = Annotated[
    Path | None,
    click.Path(file_okay=False, path_type=Path),
    CliOption(
        metavar="FOLDER",
        help="Where backups are saved; fleet-backups in the state folder unless given.",
    ),
]


@click.command("agent", short_help="Carry out the plans of a plant, until it is ended.")
@json_option
def agent(
    *,
    plant: Annotated[str, LINE, CliArgument()] = "plant",
    backups: Backups = None,
    systemd: Annotated[
        bool, CliOption(help="Print a unit for systemd, which starts and watches it, and end.")
    ] = False,
) -> None:
    """Carry out the plans of PLANT at the cells of this computer's cell files, until Ctrl-C.

    It moves no robot: it saves backups, checks cells, reads charts and writes offsets. One agent a
    plant runs at a time; what one that was killed had begun, the next one goes on with. A watchdog
    starts that one: --systemd prints a unit. Ctrl-C and SIGTERM let the cells at work finish.
    """
    if systemd:
        hand_over(unit(plant, backups))
        return
    with agent_here(plant, backups) as made:
        if json_is_on():
            about = {"schema": "robolink/fleet-agent/1", "plant": plant, "pid": os.getpid()}
            hand_over(json.dumps(about))
        else:
            say(tr("Agent of plant {plant}. Ctrl-C ends it.", plant=plant))
            sys.stdout.flush()
        with copying_meanwhile(), ended_by_signals(made):
            made.run()


@contextmanager
def agent_here(
    plant: str, backups: Path | None = None, tell: Callable[[str], None] = note
) -> Iterator["Agent"]:
    """Have an agent for this computer's cells, which hears their stops within the block.

    Raises:
        ConfigError: The extra ``fleet`` is not installed.
    """
    require_packages()
    from robolink.files.durable import state_folder
    from robolink.fleet import default_plant
    from robolink.fleet.agent import Agent
    from robolink_cli.commands.fleet.acts import CellActs

    with CellActs(backups or state_folder("fleet-backups"), tell=tell) as acts:
        yield Agent(default_plant(), plant, acts, tell=tell)


def require_packages() -> None:
    """Refuse to go on without the packages of the extra.

    Raises:
        ConfigError: One is missing; says how it is installed.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise ConfigError(
            tr("An agent needs packages that are missing: {names}.", names=", ".join(missing)),
            remedy=tr("Run: python -m pip install 'robolink[fleet]'"),
        )


@contextmanager
def ended_by_signals(agent: "Agent") -> Iterator[None]:
    """End an agent in order at Ctrl-C, SIGTERM and a closed window, within the block."""

    def end(_number: int, _frame: object) -> None:
        agent.end()

    numbers = [getattr(signal, name) for name in _SIGNALS if hasattr(signal, name)]
    before: list[tuple[int, Any]] = [(number, signal.signal(number, end)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def unit(plant: str, backups: Path | None = None) -> str:
    """Return a unit of systemd that runs this agent as this user, from this folder.

    Raises:
        ConfigError: A password stands in what it would have to name.
    """
    from robolink.fleet.watchdog import UNIT
    from robolink.journal import this_process
    from robolink.journal._places import place_of

    words = [sys.executable, "-m", "robolink_cli", "fleet", "agent", plant]
    words += [] if backups is None else ["--backups", str(backups.absolute())]
    named = {name: os.environ[name] for name in _PASSED_ON if os.environ.get(name)}
    for name in {"ROBOLINK_JOURNAL", "ROBOLINK_PLANT"} & named.keys():
        if "://" in named[name] and place_of(named[name]).location != _with_driver(named[name]):
            raise ConfigError(
                tr("{name} holds a password, which a unit would show.", name=name),
                remedy=tr("Put it into the file .pgpass of this user, and leave it out there."),
            )
    return UNIT.format(
        plant=plant,
        user=this_process().os_user,
        folder=Path.cwd(),
        environment="".join(f'Environment="{name}={value}"\n' for name, value in named.items()),
        command=shlex.join(words),
    ).replace("%", "%%")


def _with_driver(url: str) -> str:
    return url.replace("postgresql://", "postgresql+psycopg://", 1)
