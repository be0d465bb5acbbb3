"""sim softmotion: serve a simulated PLC with a mailbox."""

from pathlib import Path
from typing import Any

import click

from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import (
    SECTIONS,
    ServedLife,
    life_options,
    modbus_options,
    simulation_options,
)


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
    "--unit",
    type=click.IntRange(1, 247),
    metavar="N",
    default=1,
    show_default=True,
    help="Unit identifier on the serial line.",
)
@click.option(
    "--node",
    type=click.IntRange(1, 127),
    metavar="N",
    default=5,
    show_default=True,
    help="Number of the node on the CAN bus.",
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
def softmotion(*, life: ServedLife, **given: Any) -> None:  # noqa: ANN401 - all other options
    """Serve a simulated SoftMotion PLC with a mailbox until Ctrl-C.

    Several buses may be given; one PLC stands behind them. The assist port stands in for the
    person at the machine.
    """
    from robolink_cli.commands.simulate.kinds.simulated_kind import serve_alone
    from robolink_cli.commands.simulate.kinds.softmotion import SOFTMOTION_KIND

    serve_alone(SOFTMOTION_KIND, life, given)
