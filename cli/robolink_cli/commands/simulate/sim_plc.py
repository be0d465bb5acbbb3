"""sim plc: serve a simulated PLC that keeps its tools where a map says."""

from pathlib import Path
from typing import Annotated

import click

from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import (
    SECTIONS,
    AllowRemote,
    ExchangeTime,
    FaultPlan,
    ModbusPlaces,
    Pace,
    Seed,
    ServedLife,
)


@click.command(
    "plc",
    cls=SectionedCommand,
    sections=SECTIONS,
    short_help="Serve a simulated PLC with the registers of any map.",
)
@json_option
def sim_plc(
    *,
    map_file: Annotated[Path, CliOption("--map", help="The map; docs/plc-maps.md explains it.")],
    places: ModbusPlaces,
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
    faults: FaultPlan = None,
    allow_remote: AllowRemote = False,
    life: ServedLife,
) -> None:
    """Serve a simulated PLC with the registers of any map until Ctrl-C.

    Both buses may be given; one PLC stands behind them.
    """
    from robolink_cli.commands.simulate.kinds.plc import PLC_KIND
    from robolink_cli.commands.simulate.kinds.simulated_kind import serve_alone

    options = {
        "map_file": map_file,
        **places.by_name_of_today(),
        "unit": unit,
        "most_registers": most_registers,
        "seed": seed,
        "speed": speed,
        "exchange": exchange,
        "faults": faults,
        "allow_remote": allow_remote,
    }
    serve_alone(PLC_KIND, life, options)
