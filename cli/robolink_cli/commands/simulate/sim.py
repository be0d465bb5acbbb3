"""sim: serves a simulated controller for any client."""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import click

from robolink_cli.commands.simulate.sim_run import sim_run
from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import (
    EXISTING_FILE,
    SECTIONS,
    AllowRemote,
    AnswerTime,
    ExchangeTime,
    FaultPlan,
    ModbusPlaces,
    OpcuaPlace,
    Pace,
    ProjectOptions,
    Seed,
    ServedLife,
    SimulationOptions,
    one_place,
)


@click.command(
    "plc",
    cls=SectionedCommand,
    sections=SECTIONS,
    short_help="Serve a simulated PLC with the registers or symbols of any map.",
)
@json_option
def sim_plc(
    *,
    map_file: Annotated[Path, CliOption("--map", help="The map; docs/plc-maps.md explains it.")],
    places: ModbusPlaces,
    opcua: OpcuaPlace,
    unit: Annotated[
        int,
        click.IntRange(0, 255),
        CliOption(help="The unit identifier that answers; 1 to 247 on a serial line."),
    ] = 1,
    most_registers: Annotated[
        int,
        click.IntRange(4, 125),
        CliOption(help="How many registers one read may ask for; some servers allow 61 or 50."),
    ] = 125,
    seed: Seed = 1,
    speed: Pace = 1.0,
    exchange: ExchangeTime = None,
    answer_ms: AnswerTime = 0.0,
    faults: FaultPlan = None,
    allow_remote: AllowRemote = False,
    life: ServedLife,
) -> None:
    """Serve a simulated PLC with the registers or symbols of any map until Ctrl-C.

    You can give both Modbus links; they belong to the same PLC. A map of symbols is served over
    OPC UA, on 127.0.0.1:4840 unless you say otherwise.
    """
    from robolink_cli.commands.simulate.plc import PLC_KIND
    from robolink_cli.commands.simulate.simulated_kind import serve_alone

    options = {
        "map_file": map_file,
        **places.by_name_of_today(),
        **opcua._asdict(),
        "unit": unit,
        "most_registers": most_registers,
        "seed": seed,
        "speed": speed,
        "exchange": exchange,
        "answer_ms": answer_ms,
        "faults": faults,
        "allow_remote": allow_remote,
    }
    serve_alone(PLC_KIND, life, options)


def _complete_kinematics(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the kinematics whose names begin so, for TAB."""
    from robolink_simulators.softmotion.catalogue import complete_kinematics

    return complete_kinematics(start)


class _SoftMotionOptions(NamedTuple):
    """The options of a simulated SoftMotion PLC, besides Modbus."""

    can: Annotated[
        str | None,
        CliOption(
            metavar="INTERFACE:CHANNEL",
            help="Act as a CANopen node, for example on udp_multicast:239.74.163.2:43113 "
            "or socketcan:vcan0.",
        ),
    ] = None
    unit: Annotated[
        int, click.IntRange(1, 247), CliOption(help="Unit identifier on the serial line.")
    ] = 1
    node: Annotated[
        int, click.IntRange(1, 127), CliOption(help="Number of the node on the CAN bus.")
    ] = 5
    kinematics: Annotated[
        str,
        CliOption(
            metavar="NAME[+ORIENTATION]",
            shell_complete=_complete_kinematics,
            help="Kinematics of the axis group; TAB completes the names. Or module:Class "
            "for your own, which may be in the present folder.",
        ),
    ] = "Kin_Scara3_Z"
    parameters: Annotated[
        tuple[str, ...],
        CliOption(
            "--param",
            metavar="NAME=VALUE",
            help="A parameter of the kinematics or a drive, for example dArmLength1=250. May be "
            "repeated.",
        ),
    ] = ()
    program: Annotated[
        Path | None,
        click.Path(exists=True, file_okay=False, path_type=Path),
        CliOption(
            metavar="DIR",
            help="Execute the program in this folder, as 'plc export' writes it, changed or not.",
        ),
    ] = None


@click.command(cls=SectionedCommand, sections=SECTIONS)
@json_option
def softmotion(
    *,
    places: ModbusPlaces,
    opcua: OpcuaPlace,
    given: _SoftMotionOptions,
    simulation: SimulationOptions,
    life: ServedLife,
) -> None:
    """Serve a simulated SoftMotion PLC with a mailbox until Ctrl-C.

    You can give several buses; they belong to the same PLC. The assist port plays the person at
    the machine.
    """
    from robolink_cli.commands.simulate.simulated_kind import serve_alone
    from robolink_cli.commands.simulate.softmotion import SOFTMOTION_KIND

    where = {**places.by_name_of_today(), **opcua._asdict()}
    options = {**where, **given._asdict(), **simulation._asdict()}
    serve_alone(SOFTMOTION_KIND, life, options)


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
    """The options of a simulated EPSON controller."""

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
            help="Remote RS232 on a pseudo terminal, whose path is printed, instead of --tcp.",
        ),
    ] = None
    baud: Annotated[
        int,
        click.IntRange(0, 4_000_000),
        CliOption(help="Baud rate of that line, in real time; 0 sends everything at once."),
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
        CliOption(help="Cell profile written by verify-controller; --option overrides it."),
    ] = None
    replay: Annotated[
        Path | None,
        EXISTING_FILE,
        CliOption(help="Replay a dialogue that --record has written, instead of a simulator."),
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

    A second port, assist, plays the person at the cell: it looks at the tip, knows its true
    position, and presses the emergency stop.
    """
    if given.replay is not None:
        from robolink_cli.commands.simulate.service import (
            Termination,
            host_and_port,
            serve_recording,
        )

        listen = host_and_port(given.address, "--tcp")
        with Termination() as stopped:
            serve_recording(
                given.replay, listen, allow_remote=simulation.allow_remote, wait=stopped.wait
            )
        return
    from robolink_cli.commands.simulate.epson import EPSON_KIND
    from robolink_cli.commands.simulate.simulated_kind import serve_alone

    options = {**given._asdict(), **project._asdict(), **simulation._asdict()}
    del options["replay"]
    serve_alone(EPSON_KIND, life, options)


@sim.command(short_help="Play the person at a simulated cell.")
@json_option
def assist(
    *,
    url: Annotated[str, CliArgument()],
    act: Annotated[str, CliArgument()],
    values: Annotated[tuple[str, ...], CliArgument(metavar="[NAME=NUMBER]...")] = (),
) -> None:
    """Play the person at a simulated cell: press its buttons, teach its points, see its true state.

    URL is the assist URL that 'robolink sim' prints. Acts are for example press_estop,
    release_estop, open_guard, teach, auto, teach_point number=901 u_deg=180, truth; an unknown
    one lists all of them.
    """
    from robolink_cli.commands.simulate.acts import do_act

    do_act(url, act, values)


@sim.command(short_help="Change a simulated controller directly, not through its connection.")
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
    """Change a simulated controller and its cell directly, not through its connection.

    ACT is for example truth, press_estop, add_fault action=drop_reply match=TLSet, log, reset,
    set_clock factor=0, step seconds=2. An unknown one lists all of them, and docs/control-api.md
    explains each.
    """
    from robolink_cli.commands.simulate.acts import do_controlled

    do_controlled(url, act, values)
