"""sim plc: serve a simulated PLC that keeps its tools where a map says."""

from contextlib import ExitStack
from pathlib import Path

import click

from robolink.messages import tr
from robolink_cli.console.help_sections import SectionedCommand
from robolink_cli.options.simulation import (
    DEFAULT_ADDRESS,
    SECTIONS,
    ServedLife,
    allow_remote_option,
    faults_option,
    life_options,
    modbus_options,
    seed_option,
    speed_option,
)
from robolink_cli.session.context import json_option


@click.command("plc", cls=SectionedCommand, sections=SECTIONS)
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
    default=1,
    show_default=True,
    help="The unit identifier that answers; 1 to 247 on a serial line.",
)
@seed_option
@speed_option
@faults_option
@allow_remote_option
@life_options
@json_option
def sim_plc(
    *,
    map_file: Path,
    address: str | None,
    serial: str | None,
    unit: int,
    seed: int,
    speed: float,
    faults: Path | None,
    allow_remote: bool,
    life: ServedLife,
) -> None:
    """Serve a simulated PLC with the registers of any map until Ctrl-C.

    Both buses may be given; one PLC stands behind them.
    """
    from robolink_simulators.cell.clock import SteeredClock
    from robolink_simulators.control.cell import ControlledCell
    from robolink_simulators.faults import LinkKind
    from robolink_simulators.plc import PlcSimulator, serve_plc, serve_plc_line

    from robolink.register_maps import load_map
    from robolink_cli.commands.simulate.planned_faults import plan_faults
    from robolink_cli.commands.simulate.serving import (
        Termination,
        announce,
        controlled,
        host_and_port,
    )

    if address is None and serial is None:
        address = DEFAULT_ADDRESS
    register_map = load_map(map_file)
    simulator, clock = PlcSimulator(register_map, unit=unit, seed=seed), SteeredClock(speed)
    served = {LinkKind.PLC_TCP} if address is not None else set()
    served |= {LinkKind.PLC_RTU} if serial is not None else set()
    plan_faults(simulator, faults, served)
    urls: dict[str, str] = {}
    with ExitStack() as stack:
        stopped = stack.enter_context(Termination(life))
        if address is not None:
            listen = host_and_port(address, "--tcp")
            tcp = serve_plc(simulator, map_file, *listen, clock=clock, allow_remote=allow_remote)
            urls["modbus-tcp"] = stack.enter_context(tcp).url
        if serial is not None:
            line = serve_plc_line(simulator, map_file, clock=clock)
            urls["modbus-rtu"] = stack.enter_context(line).url
        first = next(iter(urls.values()))
        cells = {"cell": ControlledCell(simulator, clock, urls)}
        control = stack.enter_context(controlled(cells, life, allow_remote=allow_remote))
        where = control.url_of("cell")
        announce(
            {
                "url": first,
                "urls": urls,
                "control": where,
                "machine": register_map.name,
                "seed": seed,
            },
            [
                tr("SIMULATED PLC: {name} (seed {seed}).", name=register_map.name, seed=seed),
                *(tr("  {bus}  {url}", bus=bus.ljust(10), url=url) for bus, url in urls.items()),
                tr("  control     {url}", url=where),
                tr('Try: robolink -c "{url}" expert plc check-map', url=first),
                tr("Ctrl-C ends it."),
            ],
            stopped.state_dir,
        )
        stopped.wait(lambda: simulator.log.added + control.requests)
