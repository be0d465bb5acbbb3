"""sim plc: serve a simulated PLC that keeps its tools where a map says."""

from pathlib import Path

import click

from robolink.messages import tr
from robolink_cli._context import json_option
from robolink_cli._sim_options import allow_remote_option, seed_option


@click.command("plc")
@click.option(
    "--map",
    "map_file",
    required=True,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The map; docs/plc-maps.md explains it.",
)
@click.option(
    "--modbus-tcp",
    "address",
    metavar="HOST:PORT",
    default="127.0.0.1:5020",
    show_default=True,
    help="Where to listen; port 0 takes a free one.",
)
@click.option(
    "--unit",
    type=click.IntRange(0, 255),
    default=1,
    show_default=True,
    help="The unit identifier that answers.",
)
@seed_option
@allow_remote_option
@json_option
def sim_plc(*, map_file: Path, address: str, unit: int, seed: int, allow_remote: bool) -> None:
    """Serve a simulated PLC with the registers of any map until Ctrl-C."""
    from robolink_simulators.plc import PlcSimulator, serve_plc

    from robolink.register_maps import load_map
    from robolink_cli._serving import Termination, announce, host_and_port

    listen = host_and_port(address, "--modbus-tcp")
    register_map = load_map(map_file)
    simulator = PlcSimulator(register_map, unit=unit, seed=seed)
    with (
        Termination() as stopped,
        serve_plc(simulator, map_file, *listen, allow_remote=allow_remote) as host,
    ):
        announce(
            {"url": host.url, "machine": register_map.name, "seed": seed},
            [
                tr("SIMULATED PLC: {name} (seed {seed}).", name=register_map.name, seed=seed),
                tr("  controller  {url}", url=host.url),
                tr("Try: robolink -c '{url}' plc check-map", url=host.url),
                tr("Ctrl-C ends it."),
            ],
        )
        stopped.wait()
