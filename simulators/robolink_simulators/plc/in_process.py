"""``plc+sim://NAME?map=FILE``: PLCs with a register map, in this process and shared by name."""

from pathlib import Path
from typing import Final

from robolink.timing import Clock
from robolink.transport import LinkUrl
from robolink.transport.modbus.client import ModbusClient
from robolink.transport.modbus.frames import TcpFraming
from robolink.transport.modbus.tcp import TcpExchange
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.in_process.named import NamedSimulators
from robolink_simulators.hosting.in_process.transport import InProcessTransport
from robolink_simulators.option_values import require_known
from robolink_simulators.plc.device import PlcSimulator
from robolink_simulators.plc.serving import map_option

_named: Final = NamedSimulators[PlcSimulator]("plc+sim")


def open_plc(
    link_url: LinkUrl,
    *,
    timeout_s: float = 3.0,
    clock: Clock | None = None,  # noqa: ARG001 - simulated time is the simulator's own
) -> ModbusClient:
    """Connect to the registers of the PLC that was registered under that name.

    Args:
        link_url: As :func:`register` returns it, without the map, which the driver reads.
        timeout_s: Longest wait for an answer, in simulated time.
        clock: Not needed; part of the contract of an opener.

    Raises:
        ConfigError: Nothing was registered under it, or there is an option.
    """
    require_known(link_url.options, (), kind="PLC")
    simulator = _named.simulator(link_url.host)
    transport = InProcessTransport(link_url, simulator, _named.clock(link_url.host), simulator.lock)
    identity = link_url.identity
    return ModbusClient(
        transport,
        TcpExchange(transport, identity, TcpFraming()),
        identity=identity,
        unit=simulator.unit,
        timeout_s=timeout_s,
        most_registers=simulator.most_registers,
    )


def register(
    name: str, simulator: PlcSimulator, map_file: Path, *, clock: ManualClock | None = None
) -> str:
    """Serve a PLC under a name and return its URL, which names the file of its map.

    Raises:
        ConfigError: The name is taken.

    Example:
        >>> from pathlib import Path
        >>> import robolink
        >>> from robolink.register_maps import load_map
        >>> from robolink_simulators.plc.in_process import register, unregister
        >>> from robolink_simulators.plc import PlcSimulator
        >>> from robolink_simulators.testkit.operator import written_map
        >>> path = written_map(Path.cwd())
        >>> url = register("dispenser", PlcSimulator(load_map(path), seed=7), path)
        >>> with robolink.connect(url) as controller:
        ...     list(controller.tools.indices())
        [1, 2]
        >>> unregister("dispenser")
    """
    url = _named.register(name, simulator, clock=clock)
    simulator.url = f"{url}?{map_option(map_file)}"
    return simulator.url


unregister = _named.unregister
clock_of = _named.clock
