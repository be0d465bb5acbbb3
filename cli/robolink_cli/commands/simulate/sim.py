"""sim: serve a simulated controller for anybody's client."""

from pathlib import Path
from typing import Any

import click

from robolink.messages import declared
from robolink_cli.commands.simulate.run.sim_run import sim_run
from robolink_cli.commands.simulate.sim_plc import sim_plc
from robolink_cli.commands.simulate.sim_softmotion import softmotion
from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import (
    SECTIONS,
    ServedLife,
    life_options,
    one_place,
    project_options,
    serial_option,
    simulation_options,
    tcp_option,
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


@sim.command(
    cls=SectionedCommand,
    sections=SECTIONS,
    short_help="Serve a simulated EPSON controller until Ctrl-C.",
)
@tcp_option("127.0.0.1:5000", declared("Where to listen; port 0 takes a free one."), one_place)
@serial_option(
    declared("Remote RS232 on a pseudo terminal, whose path is printed, in place of --tcp."),
    one_place,
)
@click.option(
    "--baud",
    type=click.IntRange(0, 4_000_000),
    metavar="N",
    default=0,
    show_default=True,
    help="How slow that line is, in real time; 0 carries everything at once.",
)
@click.option(
    "--robot",
    metavar="MODEL",
    default="T6-602S",
    show_default=True,
    shell_complete=_complete_robot,
    help="Model of the robot, for example RS4-C351S or C8-C901S; several with commas between.",
)
@click.option(
    "--password-env",
    metavar="VAR",
    help="Environment variable that holds the password clients must give.",
)
@click.option(
    "--profile",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Cell profile written by verify-controller; --option overrules it.",
)
@click.option(
    "--replay",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Serve a dialogue that --record has written, in place of a simulator.",
)
@click.option(
    "--program",
    "programs",
    multiple=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="SPEL+ program (.prg) that Start runs: main, or mainN. May be repeated.",
)
@click.option(
    "--points",
    multiple=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Point file (.pts) of the programs. May be repeated.",
)
@project_options
@simulation_options
@life_options
@json_option
def epson(
    *,
    address: str,
    replay: Path | None,
    allow_remote: bool,
    life: ServedLife,
    **more: Any,  # noqa: ANN401 - the other options
) -> None:
    """Serve a simulated EPSON controller with Remote Ethernet, or RS232, until Ctrl-C.

    A second port, assist, stands in for the person at the cell: it looks at the tip, knows
    the truth, and presses the emergency stop.
    """
    if replay is not None:
        from robolink_cli.commands.simulate.replaying import serve_recording
        from robolink_cli.commands.simulate.serving import Termination, host_and_port

        listen = host_and_port(address, "--tcp")
        with Termination() as stopped:
            serve_recording(replay, listen, allow_remote=allow_remote, wait=stopped.wait)
        return
    from robolink_cli.commands.simulate.kinds.epson import EPSON_KIND
    from robolink_cli.commands.simulate.kinds.simulated_kind import serve_alone

    serve_alone(EPSON_KIND, life, {"address": address, "allow_remote": allow_remote, **more})


@sim.command(short_help="Be the person at a simulated cell.")
@click.argument("url")
@click.argument("act")
@click.argument("values", nargs=-1, metavar="[NAME=NUMBER]...")
@json_option
def assist(url: str, act: str, values: tuple[str, ...]) -> None:
    """Be the person at a simulated cell: press its buttons, teach its points, see its truth.

    URL is the assist URL that 'robolink sim' prints. Acts are for example press_estop,
    release_estop, open_guard, teach, auto, teach_point number=901 u_deg=180, truth; an unknown
    one lists them all.
    """
    from robolink_cli.commands.simulate.assisting import do_act

    do_act(url, act, values)


@sim.command(short_help="Do something to a simulated controller past the wire.")
@click.argument("act")
@click.argument("values", nargs=-1, metavar="[NAME=VALUE]...")
@click.option(
    "--at",
    "url",
    metavar="URL",
    envvar="ROBOLINK_CONTROL",
    show_envvar=True,
    required=True,
    help="The control URL that 'robolink sim' prints.",
)
@json_option
def ctl(act: str, values: tuple[str, ...], url: str) -> None:
    """Do something to a simulated controller and its cell past the wire.

    ACT is for example truth, press_estop, add_fault action=drop_reply match=TLSet, log, reset,
    set_clock factor=0, step seconds=2. An unknown one lists them all, and docs/control-api.md
    explains each.
    """
    from robolink_cli.commands.simulate.assisting import do_controlled

    do_controlled(url, act, values)
