"""sim softmotion: serve a simulated PLC with a mailbox."""

import sys
from pathlib import Path

import click

from robolink_cli.console.help_sections import SectionedCommand
from robolink_cli.options.simulation import (
    SECTIONS,
    ServedLife,
    life_options,
    modbus_options,
    simulation_options,
)
from robolink_cli.session.context import json_option


def _complete_kinematics(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the kinematics whose names begin so, for TAB."""
    from robolink_simulators.softmotion.catalogue import complete_kinematics

    return complete_kinematics(start)


@click.command(cls=SectionedCommand, sections=SECTIONS)
@modbus_options
@click.option(
    "--can",
    metavar="INTERFACE:CHANNEL",
    help="Be a CANopen node, for example on udp_multicast:239.74.163.2:43113 or socketcan:vcan0.",
)
@click.option(
    "--unit", type=click.IntRange(1, 247), default=1, show_default=True, help="On the serial line."
)
@click.option(
    "--node", type=click.IntRange(1, 127), default=5, show_default=True, help="On the CAN bus."
)
@click.option(
    "--kinematics",
    default="Kin_Scara3_Z",
    show_default=True,
    metavar="NAME[+ORIENTATION]",
    shell_complete=_complete_kinematics,
    help="Kinematics of the axis group; TAB completes the names. Or module:Class for one of your "
    "own, which may stand in the present folder.",
)
@click.option(
    "--param",
    "parameters",
    multiple=True,
    metavar="NAME=VALUE",
    help="A parameter of the kinematics or a drive, for example dArmLength1=250. May be repeated.",
)
@click.option(
    "--program",
    metavar="DIR",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Execute the program in this folder, as 'plc export' writes it, changed or not.",
)
@simulation_options
@life_options
@json_option
def softmotion(
    *,
    address: str | None,
    serial: str | None,
    can: str | None,
    unit: int,
    node: int,
    kinematics: str,
    parameters: tuple[str, ...],
    program: Path | None,
    seed: int,
    state: Path | None,
    speed: float,
    options: tuple[str, ...],
    world: tuple[str, ...],
    faults: Path | None,
    allow_remote: bool,
    life: ServedLife,
) -> None:
    """Serve a simulated SoftMotion PLC with a mailbox until Ctrl-C.

    Several buses may be given; one PLC stands behind them. The assist port stands in for the
    person at the machine.
    """
    from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
    from robolink_simulators.softmotion.mailbox.option_text import options_from_text
    from robolink_simulators.softmotion.mailbox.parameters import parameters_from_text
    from robolink_simulators.softmotion.program.plc_maker import plc_maker

    from robolink_cli.commands.simulate.planned_faults import plan_faults
    from robolink_cli.commands.simulate.serving import named_values, world_from
    from robolink_cli.commands.simulate.serving_softmotion import Buses, serve_plc

    if ":" in kinematics:
        sys.path.append(str(Path.cwd()))
    simulator = SoftMotionSimulator(
        kinematics,
        seed=seed,
        parameters=parameters_from_text(named_values(parameters, "--param dArmLength1=250")),
        options=options_from_text(named_values(options, "--option profile=tools")),
        state_path=state,
        world=world_from(world),
        make_plc=plc_maker(program),
    )
    buses = Buses(address, serial, can, unit=unit, node=node, allow_remote=allow_remote)
    plan_faults(simulator, faults, buses.kinds)
    serve_plc(simulator, buses, speed=speed, life=life)
