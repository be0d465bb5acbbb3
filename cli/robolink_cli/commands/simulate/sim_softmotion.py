"""sim softmotion: serve a simulated PLC with a mailbox."""

from pathlib import Path
from typing import Annotated, NamedTuple

import click

from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import SECTIONS, ModbusPlaces, ServedLife, SimulationOptions


def _complete_kinematics(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the kinematics whose names begin so, for TAB."""
    from robolink_simulators.softmotion.catalogue import complete_kinematics

    return complete_kinematics(start)


class _SoftMotionOptions(NamedTuple):
    """What a simulated SoftMotion PLC has for itself, beside Modbus."""

    can: Annotated[
        str | None,
        CliOption(
            metavar="INTERFACE:CHANNEL",
            help="Be a CANopen node, for example on udp_multicast:239.74.163.2:43113 or "
            "socketcan:vcan0.",
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
            help="Kinematics of the axis group; TAB completes the names. Or module:Class for one "
            "of your own, which may stand in the present folder.",
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
    given: _SoftMotionOptions,
    simulation: SimulationOptions,
    life: ServedLife,
) -> None:
    """Serve a simulated SoftMotion PLC with a mailbox until Ctrl-C.

    Several buses may be given; one PLC stands behind them. The assist port stands in for the
    person at the machine.
    """
    from robolink_cli.commands.simulate.kinds.simulated_kind import serve_alone
    from robolink_cli.commands.simulate.kinds.softmotion import SOFTMOTION_KIND

    options = {**places.by_name_of_today(), **given._asdict(), **simulation._asdict()}
    serve_alone(SOFTMOTION_KIND, life, options)
