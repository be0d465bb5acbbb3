"""sim: serve a simulated controller for anybody's client."""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import click

from robolink_cli.commands.simulate.run.sim_run import sim_run
from robolink_cli.commands.simulate.sim_plc import sim_plc
from robolink_cli.commands.simulate.sim_softmotion import softmotion
from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import (
    EXISTING_FILE,
    SECTIONS,
    ProjectOptions,
    ServedLife,
    SimulationOptions,
    one_place,
)


def _complete_robot(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the models whose names begin so, for TAB."""
    from robolink_simulators.epson.arm.robots import robot_names

    before, comma, last = start.rpartition(",")
    names = [name for name in robot_names() if name.casefold().startswith(last.casefold())]
    return [f"{before}{comma}{name}" for name in names]


@click.group()
@json_option
def sim() -> None:
    """Serve simulated controllers on this machine."""


sim.add_command(sim_plc)
sim.add_command(softmotion)
sim.add_command(sim_run)


class _EpsonOptions(NamedTuple):
    """What a simulated EPSON controller has for itself."""

    address: Annotated[
        str,
        CliOption(
            "--tcp",
            metavar="HOST:PORT",
            callback=one_place,
            help="Where to listen; port 0 takes a free one.",
        ),
    ] = "127.0.0.1:5000"
    serial: Annotated[
        Literal["pty"] | None,
        CliOption(
            callback=one_place,
            help="Remote RS232 on a pseudo terminal, whose path is printed, in place of --tcp.",
        ),
    ] = None
    baud: Annotated[
        int,
        click.IntRange(0, 4_000_000),
        CliOption(help="How slow that line is, in real time; 0 carries everything at once."),
    ] = 0
    robot: Annotated[
        str,
        CliOption(
            metavar="MODEL",
            shell_complete=_complete_robot,
            help="Model of the robot, for example RS4-C351S or C8-C901S; several with commas "
            "between.",
        ),
    ] = "T6-602S"
    password_env: Annotated[
        str | None,
        CliOption(
            metavar="VAR", help="Environment variable that holds the password clients must give."
        ),
    ] = None
    profile: Annotated[
        Path | None,
        EXISTING_FILE,
        CliOption(help="Cell profile written by verify-controller; --option overrules it."),
    ] = None
    replay: Annotated[
        Path | None,
        EXISTING_FILE,
        CliOption(help="Serve a dialogue that --record has written, in place of a simulator."),
    ] = None
    programs: Annotated[
        tuple[Path, ...],
        EXISTING_FILE,
        CliOption(
            "--program",
            help="SPEL+ program (.prg) that Start runs: main, or mainN. May be repeated.",
        ),
    ] = ()
    points: Annotated[
        tuple[Path, ...],
        EXISTING_FILE,
        CliOption(help="Point file (.pts) of the programs. May be repeated."),
    ] = ()


@sim.command(
    cls=SectionedCommand,
    sections=SECTIONS,
    short_help="Serve a simulated EPSON controller until Ctrl-C.",
)
@json_option
def epson(
    *,
    given: _EpsonOptions,
    project: ProjectOptions,
    simulation: SimulationOptions,
    life: ServedLife,
) -> None:
    """Serve a simulated EPSON controller with Remote Ethernet, or RS232, until Ctrl-C.

    A second port, assist, stands in for the person at the cell: it looks at the tip, knows
    the truth, and presses the emergency stop.
    """
    if given.replay is not None:
        from robolink_cli.commands.simulate.replaying import serve_recording
        from robolink_cli.commands.simulate.serving import Termination, host_and_port

        listen = host_and_port(given.address, "--tcp")
        with Termination() as stopped:
            serve_recording(
                given.replay, listen, allow_remote=simulation.allow_remote, wait=stopped.wait
            )
        return
    from robolink_cli.commands.simulate.kinds.epson import EPSON_KIND
    from robolink_cli.commands.simulate.kinds.simulated_kind import serve_alone

    options = {**given._asdict(), **project._asdict(), **simulation._asdict()}
    del options["replay"]
    serve_alone(EPSON_KIND, life, options)


@sim.command(short_help="Be the person at a simulated cell.")
@json_option
def assist(
    *,
    url: Annotated[str, CliArgument()],
    act: Annotated[str, CliArgument()],
    values: Annotated[tuple[str, ...], CliArgument(metavar="[NAME=NUMBER]...")] = (),
) -> None:
    """Be the person at a simulated cell: press its buttons, teach its points, see its truth.

    URL is the assist URL that 'robolink sim' prints. Acts are for example press_estop,
    release_estop, open_guard, teach, auto, teach_point number=901 u_deg=180, truth; an unknown
    one lists them all.
    """
    from robolink_cli.commands.simulate.assisting import do_act

    do_act(url, act, values)


@sim.command(short_help="Do something to a simulated controller past the wire.")
@json_option
def ctl(
    *,
    act: Annotated[str, CliArgument()],
    values: Annotated[tuple[str, ...], CliArgument(metavar="[NAME=VALUE]...")] = (),
    url: Annotated[
        str,
        CliOption(
            "--at",
            metavar="URL",
            envvar="ROBOLINK_CONTROL",
            show_envvar=True,
            help="The control URL that 'robolink sim' prints.",
        ),
    ],
) -> None:
    """Do something to a simulated controller and its cell past the wire.

    ACT is for example truth, press_estop, add_fault action=drop_reply match=TLSet, log, reset,
    set_clock factor=0, step seconds=2. An unknown one lists them all, and docs/control-api.md
    explains each.
    """
    from robolink_cli.commands.simulate.assisting import do_controlled

    do_controlled(url, act, values)
