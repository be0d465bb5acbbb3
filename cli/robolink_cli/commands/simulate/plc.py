"""sim plc: serves a simulated PLC whose tools are where a map says."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import LinkKind
from robolink_simulators.plc import PlcSimulator, serve_plc, serve_plc_line

from robolink.messages import tr
from robolink.register_maps import load_map
from robolink_cli.commands.simulate.service import host_and_port
from robolink_cli.commands.simulate.simulated_kind import SimulatedKind, plan_faults
from robolink_cli.options.simulation import DEFAULT_ADDRESS


def make_plc(
    *,
    map_file: Path,
    unit: int,
    seed: int,
    most_registers: int,
    faults: Path | None,
    address: str | None,
    serial: str | None,
    answer_ms: float,
    cell: str = "",
    **_placing: Any,  # noqa: ANN401 - other options
) -> PlcSimulator:
    """Make a simulator from the options of ``sim plc``, which explain each.

    ``cell`` is its name among several, for what it tells meanwhile.

    Raises:
        ConfigError: One of them makes no sense.
    """
    simulator = PlcSimulator(
        load_map(map_file),
        unit=unit,
        seed=seed,
        most_registers=most_registers,
        answer_ms=answer_ms,
    )
    served = {LinkKind.PLC_RTU} if serial is not None else set()
    if address is not None or serial is None:
        served |= {LinkKind.PLC_TCP}
    plan_faults(simulator, faults, served, cell=cell)
    return simulator


def _place(
    stack: ExitStack,
    simulator: PlcSimulator,
    clock: ScaledClock,
    *,
    map_file: Path,
    address: str | None,
    serial: str | None,
    allow_remote: bool,
    **_making: Any,  # noqa: ANN401 - other options
) -> dict[str, str]:
    """Serve it on each bus."""
    if address is None and serial is None:
        address = DEFAULT_ADDRESS
    urls: dict[str, str] = {}
    if address is not None:
        listen = host_and_port(address, "--tcp")
        tcp = serve_plc(simulator, map_file, *listen, clock=clock, allow_remote=allow_remote)
        urls["modbus-tcp"] = stack.enter_context(tcp).url
    if serial is not None:
        line = serve_plc_line(simulator, map_file, clock=clock)
        urls["modbus-rtu"] = stack.enter_context(line).url
    return urls


def _title(simulator: PlcSimulator) -> str:
    name = simulator.register_map.name
    return tr("SIMULATED PLC: {name} (seed {seed}).", name=name, seed=simulator.seed)


PLC_KIND: Final = SimulatedKind(
    make_plc,
    _place,
    lambda simulator: {"machine": simulator.register_map.name},
    _title,
    person=False,
)
"""The simulator of ``sim plc``."""
