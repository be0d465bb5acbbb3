"""sim plc: serves a simulated PLC whose tools are where a map says: registers or symbols."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import LinkKind
from robolink_simulators.plc import PlcSimulator, serve_plc, serve_plc_line, serve_plc_opcua

from robolink.messages import tr
from robolink.register_maps import SymbolMap, load_plc_map
from robolink_cli.commands.simulate.service import host_and_port, opcua_users
from robolink_cli.commands.simulate.simulated_kind import SimulatedKind, plan_faults
from robolink_cli.options.simulation import DEFAULT_ADDRESS, DEFAULT_OPCUA


def make_plc(
    *,
    map_file: Path,
    unit: int,
    seed: int,
    most_registers: int,
    faults: Path | None,
    address: str | None,
    serial: str | None,
    opcua: str | None,
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
        load_plc_map(map_file),
        unit=unit,
        seed=seed,
        most_registers=most_registers,
        answer_ms=answer_ms,
    )
    plan_faults(simulator, faults, _links(simulator, address, serial, opcua), cell=cell)
    return simulator


def _links(
    simulator: PlcSimulator, address: str | None, serial: str | None, opcua: str | None
) -> set[LinkKind]:
    """Return the links on which it is served; the map decides where none is named."""
    named = {LinkKind.PLC_TCP: address, LinkKind.PLC_RTU: serial, LinkKind.PLC_OPCUA: opcua}
    links = {link for link, place in named.items() if place is not None}
    by_symbol = isinstance(simulator.register_map, SymbolMap)
    return links or {LinkKind.PLC_OPCUA if by_symbol else LinkKind.PLC_TCP}


def _place(
    stack: ExitStack,
    simulator: PlcSimulator,
    clock: ScaledClock,
    *,
    map_file: Path,
    address: str | None,
    serial: str | None,
    opcua: str | None,
    opcua_user: str | None,
    opcua_password_env: str | None,
    allow_remote: bool,
    **_making: Any,  # noqa: ANN401 - other options
) -> dict[str, str]:
    """Serve it on each bus."""
    users = opcua_users(opcua_user, opcua_password_env)
    links = _links(simulator, address, serial, opcua)
    urls: dict[str, str] = {}
    if LinkKind.PLC_TCP in links:
        listen = host_and_port(address or DEFAULT_ADDRESS, "--tcp")
        tcp = serve_plc(simulator, map_file, *listen, clock=clock, allow_remote=allow_remote)
        urls["modbus-tcp"] = stack.enter_context(tcp).url
    if serial is not None:
        line = serve_plc_line(simulator, map_file, clock=clock)
        urls["modbus-rtu"] = stack.enter_context(line).url
    if LinkKind.PLC_OPCUA in links:
        listen = host_and_port(opcua or DEFAULT_OPCUA, "--opcua")
        served = serve_plc_opcua(
            simulator, map_file, *listen, clock=clock, users=users, allow_remote=allow_remote
        )
        urls |= stack.enter_context(served).urls
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
