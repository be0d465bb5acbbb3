"""The options of the commands that serve a simulated controller, in shared groups."""

import codecs
import sys
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import click
from click.core import ParameterSource

from robolink.messages import declared, tr
from robolink_cli.console.help_pages import HelpSection
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import note
from robolink_cli.options.declaration import CliOption

_PLAIN: Final = frozenset({"utf-8", "utf-8-sig"})


class _Encoding(click.ParamType[str]):
    """A code page that Python knows."""

    name = "encoding"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name, or refuse it."""
        try:
            codecs.lookup(value)
        except LookupError:
            self.fail(
                tr("There is no code page {name}. Examples: gbk, cp932, cp1250.", name=value),
                param,
                ctx,
            )
        return value


Encoding = Annotated[
    str | None,
    _Encoding(),
    CliOption(
        metavar="NAME",
        help="Code page of the files: utf-8, gbk, cp932, cp1250. Default: the first of "
        "UTF-8, cp932 and GBK that fits; robolink names it.",
    ),
]


def tell_encoding(taken: str | None, *, named: str | None) -> None:
    """Show which code page is used, if nobody named one and the text may look wrong."""
    if named is not None or taken in _PLAIN:
        return
    if taken is None:
        note(
            tr(
                "No code page fits all files, so letters that are not ASCII may look wrong. Name "
                "the code page with --encoding."
            )
        )
        return
    note(
        tr(
            "The files were read as {encoding}. If their text looks wrong, name another code page "
            "with --encoding.",
            encoding=taken,
        )
    )


DEFAULT_ADDRESS: Final = "127.0.0.1:5020"
"""Address at which Modbus TCP is served if no bus is given."""

DEFAULT_OPCUA: Final = "127.0.0.1:4840"
"""Address at which OPC UA is served if a map of symbols is given, and no bus."""

SECTIONS: Final[tuple[HelpSection, ...]] = (
    (
        declared("Where it is served"),
        frozenset(
            {
                *("--tcp", "--serial", "--baud", "--can", "--unit", "--node", "--allow-remote"),
                *("--opcua", "--opcua-user", "--opcua-password-env"),
                *("--camera", "--camera-folder", "--camera-gige"),
            }
        ),
    ),
    (
        declared("What is simulated"),
        frozenset(
            {
                *("--robot", "--kinematics", "--param", "--map", "--seed", "--state", "--speed"),
                "--most-registers",
                *("--exchange", "--answer-ms"),
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
"""Headings shared by the help pages of all simulators."""

EXISTING_FILE: Final = click.Path(exists=True, dir_okay=False, path_type=Path)

Seed = Annotated[
    int,
    click.IntRange(min=0),
    CliOption(help="Seed of the simulated cell: another seed has other tools and another tip."),
]

Pace = Annotated[
    float,
    NumberInside(min=0, max=1000),
    CliOption(
        "--speed",
        metavar="FACTOR",
        help="How many times faster than real time the simulation runs. At 0, time passes "
        "only with requests and steps of the control API.",
    ),
]

ExchangeTime = Annotated[
    float | None,
    NumberInside(min=0, max=10),
    CliOption(
        metavar="SECONDS",
        help="Extra simulated time of each request; default 0, or 0.05 at --speed 0.",
    ),
]

AnswerTime = Annotated[
    float,
    NumberInside(min=0, max=10_000),
    CliOption(
        "--answer-ms",
        metavar="MS",
        help="How long after a request the answer leaves, in simulated milliseconds; a real "
        "EPSON controller takes 5 to 50. What is requested begins at once.",
    ),
]

AllowRemote = Annotated[bool, CliOption(help="Also listen where other machines can connect.")]

FaultPlan = Annotated[
    Path | None,
    EXISTING_FILE,
    CliOption(metavar="FILE", help="File of planned faults (docs/fault-plans.md)."),
]


class SimulationOptions(NamedTuple):
    """The options of every simulated controller that a maker of robots or of controls sells."""

    seed: Seed = 1
    state: Annotated[
        Path | None,
        CliOption(help="File that keeps the tools over a restart, like flash or retained memory."),
    ] = None
    speed: Pace = 1.0
    exchange: ExchangeTime = None
    answer_ms: AnswerTime = 0.0
    options: Annotated[
        tuple[str, ...],
        CliOption(
            "--option",
            metavar="NAME=VALUE",
            help="A behaviour of the device; a wrong name lists all of them. May be repeated.",
        ),
    ] = ()
    allow_remote: AllowRemote = False
    faults: FaultPlan = None
    world: Annotated[
        tuple[str, ...],
        CliOption(
            metavar="NAME=VALUE",
            help="Errors of the simulated cell, and properties of its camera; a wrong name "
            "lists all. May be repeated.",
        ),
    ] = ()
    camera: Annotated[
        str | None,
        CliOption(
            metavar="HOST:PORT",
            help="Serve drawn pictures of the up-looking camera by HTTP there; port 0 takes a "
            "free one.",
        ),
    ] = None
    camera_folder: Annotated[
        Path | None,
        click.Path(exists=True, file_okay=False, path_type=Path),
        CliOption(
            metavar="DIR",
            help="Write a drawn picture into this folder every half second, the last 20 of them.",
        ),
    ] = None
    camera_gige: Annotated[
        str | None,
        CliOption(
            metavar="ADDRESS",
            help="Serve drawn pictures as a GigE Vision camera on this address, such as "
            "127.0.0.1; needs the library Aravis.",
        ),
    ] = None


class ServedLife(NamedTuple):
    """How a served simulator is controlled, and when it ends by itself.

    Attributes:
        control: Where its control API listens, HOST:PORT.
        with_parent: Whether it ends when the process that started it has ended.
        idle_exit_s: After how many seconds without a request it ends; ``None`` for never.
        parent: The process meant by ``with_parent``; ``None`` for the one that started it.
    """

    control: Annotated[
        str,
        CliOption(
            metavar="HOST:PORT",
            help="Where the control API listens (docs/control-api.md); port 0 takes a free one.",
        ),
    ] = "127.0.0.1:0"
    with_parent: Annotated[bool, CliOption(help="End when the parent process has ended.")] = False
    idle_exit_s: Annotated[
        float | None,
        NumberInside(min=0.1),
        CliOption(metavar="SECONDS", help="End when no request came for this long."),
    ] = None
    parent: int | None = None


def one_place(context: click.Context, given: click.Parameter, value: Any) -> Any:  # noqa: ANN401 - of either
    """Refuse ``--tcp`` beside ``--serial``, for a controller that has only one of them.

    Where it has the serial line, the usual address is none: several cells may be without one.

    Raises:
        click.UsageError: Both were given.
    """
    sources = map(context.get_parameter_source, ("address", "serial"))
    if all(source is ParameterSource.COMMANDLINE for source in sources):
        raise click.UsageError(tr("--serial and --tcp cannot be combined: give one of them."))
    return None if given.name == "address" and context.params.get("serial") else value


class ModbusPlaces(NamedTuple):
    """Where a PLC is served, by present or former option names."""

    address: Annotated[
        str | None,
        CliOption(
            "--tcp",
            metavar="HOST:PORT",
            help="Serve Modbus TCP there; port 0 takes a free one. Without any bus: "
            "127.0.0.1:5020.",
        ),
    ] = None
    serial: Annotated[
        Literal["pty"] | None,
        CliOption(help="Serve Modbus RTU on a pseudo terminal, whose path is printed."),
    ] = None
    modbus_tcp: Annotated[str | None, CliOption(hidden=True)] = None
    modbus_rtu: Annotated[Literal["pty"] | None, CliOption(hidden=True)] = None

    def by_name_of_today(self) -> dict[str, str | None]:
        """Return them by present names; a terminal shows the new name of a former one.

        Raises:
            click.UsageError: One was given by both names.
        """
        return {
            "address": _renamed("--modbus-tcp", self.modbus_tcp, "--tcp", self.address),
            "serial": _renamed("--modbus-rtu", self.modbus_rtu, "--serial", self.serial),
        }


class OpcuaPlace(NamedTuple):
    """Where a PLC is served over OPC UA, and who may come in."""

    opcua: Annotated[
        str | None,
        CliOption(
            metavar="HOST:PORT",
            help="Serve OPC UA there; port 0 takes a free one. Needs the package asyncua.",
        ),
    ] = None
    opcua_user: Annotated[
        str | None,
        CliOption(metavar="NAME", help="Let only this user in over OPC UA; without it anybody."),
    ] = None
    opcua_password_env: Annotated[
        str | None,
        CliOption(metavar="VAR", help="Environment variable that holds the user's password."),
    ] = None


def _renamed(before: str, old: str | None, now: str, new: str | None) -> str | None:
    """Return the value under either name; show the present name on a terminal."""
    if old is None:
        return new
    if new is not None:
        raise click.UsageError(
            tr("{old} is now called {new}: give one of them.", old=before, new=now)
        )
    if sys.stderr.isatty():
        note(tr("{old} is now called {new}.", old=before, new=now))
    return old


class ProjectOptions(NamedTuple):
    """The options that go with programs.

    Attributes:
        encoding: Code page of the files.
        before: A function that runs to its end first.
        vision: The vision project.
        lines: Port of OpenCom and device, ``NUMBER=DEVICE`` each.
        folder: Where programs write and read files.
    """

    encoding: Encoding = None
    before: Annotated[
        str | None,
        CliOption(
            metavar="NAME",
            help="A function to run first, to its end. It makes the settings that a "
            "project keeps outside its programs, with HomeSet, TLSet, SetNet and SetCom.",
        ),
    ] = None
    vision: Annotated[
        Path | None,
        EXISTING_FILE,
        CliOption(
            help="Vision project of the programs, for VRun; docs/spel-programs.md shows one."
        ),
    ] = None
    lines: Annotated[
        tuple[str, ...],
        CliOption(
            "--com",
            metavar="NUMBER=DEVICE",
            help="Serial line of a port of OpenCom, as 1=/dev/pts/3; programs reach no "
            "other. May be repeated.",
        ),
    ] = ()
    folder: Annotated[
        Path | None,
        click.Path(exists=True, file_okay=False, path_type=Path),
        CliOption(
            "--files",
            metavar="DIR",
            help="Folder for the files of the programs; they reach no other. Without it "
            "the files are deleted at the end.",
        ),
    ] = None
