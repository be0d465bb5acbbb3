"""The options that every command has that serves a simulated controller."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import click
from click.core import ParameterSource

from robolink.messages import declared, tr
from robolink_cli.console.help_pages import HelpSection
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import note
from robolink_cli.options.program_encoding import encoding_option

Judged = Callable[[click.Context, click.Parameter, Any], Any]
"""Is told an option and what was given for it; returns that, or refuses it."""

DEFAULT_ADDRESS: Final = "127.0.0.1:5020"
"""Where Modbus TCP is served when no bus is named."""

SECTIONS: Final[tuple[HelpSection, ...]] = (
    (
        declared("Where it is served"),
        frozenset({"--tcp", "--serial", "--baud", "--can", "--unit", "--node", "--allow-remote"}),
    ),
    (
        declared("What is simulated"),
        frozenset(
            {
                *("--robot", "--kinematics", "--param", "--map", "--seed", "--state", "--speed"),
                "--most-registers",
                "--exchange",
                *("--option", "--profile", "--world", "--password-env", "--replay", "--faults"),
            }
        ),
    ),
    (
        declared("Programs of the controller"),
        frozenset(
            {"--program", "--points", "--encoding", "--before", "--vision", "--com", "--files"}
        ),
    ),
    (
        declared("How it is controlled, and when it ends"),
        frozenset({"--control", "--with-parent", "--idle-exit"}),
    ),
)
"""The same headings on the help page of every simulator."""

F = TypeVar("F", bound=Callable[..., Any])


def simulation_options(function: F) -> F:
    """Add ``--seed``, ``--state``, the pace, ``--option``, ``--allow-remote``, ``--faults``,
    ``--world``.
    """  # noqa: D205 - one sentence over two lines
    options = (
        seed_option,
        click.option(
            "--state",
            type=click.Path(dir_okay=False, path_type=Path),
            metavar="FILE",
            help="File that keeps the tools over a restart, as flash or retained memory does.",
        ),
        pace_options,
        click.option(
            "--option",
            "options",
            multiple=True,
            metavar="NAME=VALUE",
            help="A habit of the device; a wrong name lists them all. May be repeated.",
        ),
        allow_remote_option,
        faults_option,
        click.option(
            "--world",
            multiple=True,
            metavar="NAME=VALUE",
            help="How imperfect the cell is, and how its camera is built; a wrong name lists all. "
            "May be repeated.",
        ),
    )
    for option in reversed(options):
        function = option(function)
    return function


@dataclass(frozen=True, slots=True)
class ServedLife:
    """How a served simulator is controlled, and when it ends by itself.

    Attributes:
        control: Where its control API listens, HOST:PORT.
        with_parent: Whether it ends when the process that started it has ended.
        idle_exit_s: After how many seconds without a request it ends; ``None`` for never.
        parent: The process meant by ``with_parent``; ``None`` for the one that started it.
    """

    control: str
    with_parent: bool
    idle_exit_s: float | None
    parent: int | None = None


def life_options(function: F) -> F:
    """Add ``--control``, ``--with-parent``, ``--idle-exit`` and hand them over as ``life``."""

    @wraps(function)
    def packed(*, control: str, with_parent: bool, idle_exit: float | None, **given: Any) -> Any:  # noqa: ANN401 - whatever the command takes
        return function(life=ServedLife(control, with_parent, idle_exit), **given)

    options = (
        click.option(
            "--control",
            metavar="HOST:PORT",
            default="127.0.0.1:0",
            show_default=True,
            help="Where the control API listens (docs/control-api.md); port 0 takes a free one.",
        ),
        click.option(
            "--with-parent",
            is_flag=True,
            help="End when the process that started this one has ended.",
        ),
        click.option(
            "--idle-exit",
            type=NumberInside(min=0.1),
            metavar="SECONDS",
            help="End when nobody has asked for anything for this long.",
        ),
    )
    command: Any = packed
    for option in reversed(options):
        command = option(command)
    return cast("F", command)


def tcp_option(
    default: str | None, help_text: str, callback: Judged | None = None
) -> Callable[[F], F]:
    """Return what adds ``--tcp``: the network address of a simulated controller.

    Args:
        default: Where it listens when nothing is said, ``None`` where other buses may be meant.
        help_text: What is served there.
        callback: Judges what was given.
    """
    return click.option(
        "--tcp",
        "address",
        metavar="HOST:PORT",
        default=default,
        show_default=default is not None,
        help=help_text,
        callback=callback,
    )


def serial_option(help_text: str, callback: Judged | None = None) -> Callable[[F], F]:
    """Return what adds ``--serial``: the serial line of a simulated controller.

    Args:
        help_text: What is served there.
        callback: Judges what was given.
    """
    return click.option("--serial", type=click.Choice(["pty"]), help=help_text, callback=callback)


def one_place(context: click.Context, given: click.Parameter, value: Any) -> Any:  # noqa: ANN401 - of either
    """Refuse ``--tcp`` beside ``--serial``, for a controller that has one of them.

    Where it has the serial line, the usual address is none: several cells may be without one.

    Raises:
        click.UsageError: Both were given.
    """
    sources = map(context.get_parameter_source, ("address", "serial"))
    if all(source is ParameterSource.COMMANDLINE for source in sources):
        raise click.UsageError(tr("--serial stands in place of --tcp: give one of them."))
    return None if given.name == "address" and context.params.get("serial") else value


def modbus_options(function: F) -> F:
    """Add ``--tcp`` and ``--serial`` of a PLC, and the names that they had."""

    @wraps(function)
    def merged(*, modbus_tcp: str | None, modbus_rtu: str | None, **given: Any) -> Any:  # noqa: ANN401 - whatever the command takes
        given["address"] = _renamed("--modbus-tcp", modbus_tcp, "--tcp", given["address"])
        given["serial"] = _renamed("--modbus-rtu", modbus_rtu, "--serial", given["serial"])
        return function(**given)

    options = (
        tcp_option(
            None,
            declared(
                "Serve Modbus TCP there; port 0 takes a free one. Without any bus: 127.0.0.1:5020."
            ),
        ),
        serial_option(declared("Serve Modbus RTU on a pseudo terminal, whose path is printed.")),
        click.option("--modbus-tcp", hidden=True),
        click.option("--modbus-rtu", type=click.Choice(["pty"]), hidden=True),
    )
    command: Any = merged
    for option in reversed(options):
        command = option(command)
    return cast("F", command)


def _renamed(before: str, old: str | None, now: str, new: str | None) -> str | None:
    """Return what was given by either name; say on a terminal which one it has now."""
    if old is None:
        return new
    if new is not None:
        raise click.UsageError(
            tr("{old} is now called {new}: give one of them.", old=before, new=now)
        )
    if sys.stderr.isatty():
        note(tr("{old} is now called {new}.", old=before, new=now))
    return old


def seed_option(function: F) -> F:
    """Add ``--seed``."""
    return click.option(
        "--seed",
        type=click.IntRange(min=0),
        metavar="N",
        default=1,
        show_default=True,
        help="Another cell: other tools, another tip.",
    )(function)


def pace_options(function: F) -> F:
    """Add ``--speed`` and ``--exchange``."""
    function = click.option(
        "--exchange",
        type=NumberInside(min=0, max=10),
        metavar="SECONDS",
        help="How much simulated time each request takes besides; without it 0, and 0.05 at "
        "--speed 0.",
    )(function)
    return click.option(
        "--speed",
        type=NumberInside(min=0, max=1000),
        default=1.0,
        show_default=True,
        metavar="FACTOR",
        help="How many times faster than real the simulated time passes. At 0 it passes with "
        "requests and steps of the control API alone.",
    )(function)


def allow_remote_option(function: F) -> F:
    """Add ``--allow-remote``."""
    return click.option(
        "--allow-remote", is_flag=True, help="Listen where other machines can reach it, too."
    )(function)


def faults_option(function: F) -> F:
    """Add ``--faults``."""
    return click.option(
        "--faults",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        metavar="FILE",
        help="What is planned to go wrong: a file, as docs/fault-plans.md explains.",
    )(function)


_PROJECT_OPTIONS: tuple[Callable[[Any], Any], ...] = (
    encoding_option,
    click.option(
        "--before",
        metavar="NAME",
        help="A function to run to its end first. It sets what the project keeps outside its "
        "programs, with HomeSet, TLSet, SetNet and SetCom.",
    ),
    click.option(
        "--vision",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        metavar="FILE",
        help="Vision project of the programs, for VRun; docs/spel-programs.md shows one.",
    ),
    click.option(
        "--com",
        "lines",
        multiple=True,
        metavar="NUMBER=DEVICE",
        help="Serial line of a port of OpenCom, as 1=/dev/pts/3; no other is reached. "
        "May be repeated.",
    ),
    click.option(
        "--files",
        "folder",
        type=click.Path(exists=True, file_okay=False, path_type=Path),
        metavar="DIR",
        help="Folder for the files that programs write and read; no other is reached. "
        "Without it they are gone at the end.",
    ),
)


def project_options(function: Any) -> Any:  # noqa: ANN401 - a decorator of click
    """Add what goes with programs.

    ``--encoding``, ``--before``, ``--vision``, ``--com`` and ``--files`` are given as
    ``encoding``, ``before``, ``vision``, ``lines`` and ``folder``.
    """
    for option in reversed(_PROJECT_OPTIONS):
        function = option(function)
    return function
