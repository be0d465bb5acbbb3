"""sim plc: serve a simulated PLC that keeps its tools where a map says."""

from pathlib import Path
from typing import Any

import click

from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import (
    SECTIONS,
    ServedLife,
    allow_remote_option,
    faults_option,
    life_options,
    modbus_options,
    pace_options,
    seed_option,
)


@click.command(
    "plc",
    cls=SectionedCommand,
    sections=SECTIONS,
    short_help="Serve a simulated PLC with the registers of any map.",
)
@click.option(
    "--map",
    "map_file",
    required=True,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The map; docs/plc-maps.md explains it.",
)
@modbus_options
@click.option(
    "--unit",
    type=click.IntRange(0, 255),
    metavar="N",
    default=1,
    show_default=True,
    help="The unit identifier that answers; 1 to 247 on a serial line.",
)
@click.option(
    "--most-registers",
    type=click.IntRange(4, 125),
    metavar="N",
    default=125,
    show_default=True,
    help="How many registers one read may ask for; some servers allow 61 or 50.",
)
@seed_option
@pace_options
@faults_option
@allow_remote_option
@life_options
@json_option
def sim_plc(*, life: ServedLife, **given: Any) -> None:  # noqa: ANN401 - all other options
    """Serve a simulated PLC with the registers of any map until Ctrl-C.

    Both buses may be given; one PLC stands behind them.
    """
    from robolink_cli.commands.simulate.kinds.plc import PLC_KIND
    from robolink_cli.commands.simulate.kinds.simulated_kind import serve_alone

    serve_alone(PLC_KIND, life, given)
