"""Serves the simulated PLC on a TCP port, loopback unless told otherwise, or on a line."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final
from urllib.parse import quote, urlencode

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Secret
from robolink.register_maps import RegisterMap
from robolink.transport import parse_url
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.fieldbus.opcua import OpcuaHost
from robolink_simulators.hosting.modbus_frames import LineFrames
from robolink_simulators.hosting.streams.serial_host import (
    PTY_LINE,
    DeviceOnLine,
    LineHost,
    no_pseudo_terminal,
)
from robolink_simulators.hosting.streams.tcp_host import TcpHost
from robolink_simulators.plc.device import PlcSimulator
from robolink_simulators.plc.symbols import PlcSymbols

_DEFAULT_UNIT: Final = 1
_SIMULATED: Final = "&simulated=yes"
_UNITS_ON_A_LINE: Final = range(1, 248)


class PlcHost(TcpHost):
    """A TCP host whose URL names the map as well.

    Args:
        simulator: What to serve.
        map_file: The file of its map, for the URL.
        address: Address and port to bind to; port 0 for a free one.
        clock: The simulated time.
        allow_remote: Whether an address that other machines can reach is taken.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.

    Example:
        >>> from pathlib import Path
        >>> import robolink
        >>> from robolink.register_maps import load_map
        >>> from robolink_simulators.cell.clock import ScaledClock
        >>> from robolink_simulators.plc import PlcHost, PlcSimulator
        >>> from robolink_simulators.testkit.operator import written_map
        >>> path = written_map(Path.cwd())
        >>> plc, here = PlcSimulator(load_map(path), unit=3), ("127.0.0.1", 0)
        >>> with PlcHost(plc, path, here, ScaledClock(), allow_remote=False) as host:
        ...     with robolink.connect(host.url) as controller:
        ...         print(controller.tools.selected(), "unit=3" in host.url)
        1 True
    """

    def __init__(
        self,
        simulator: PlcSimulator,
        map_file: Path,
        address: tuple[str, int],
        clock: ScaledClock,
        *,
        allow_remote: bool,
    ) -> None:
        _require_registers(simulator)
        super().__init__(
            simulator,
            "plc+modbus-tcp",
            address,
            clock=clock,
            lock=simulator.lock,
            allow_remote=allow_remote,
        )
        self.url += f"?unit={simulator.unit}&{map_option(map_file)}"
        # A URL that leads out of this computer may be a machine's: it is not marked as simulated.
        self.url += _SIMULATED if parse_url(self.url).stays_here else ""
        self.present(simulator)


class PlcLineHost(LineHost):
    """A PLC on a serial line that knows its URL.

    Attributes:
        url: Where clients connect to, with the unit and the map.
    """

    def __init__(self, simulator: PlcSimulator, map_file: Path, clock: ScaledClock) -> None:
        _require_registers(simulator)
        super().__init__(plc_on_line(simulator), clock=clock, lock=simulator.lock)
        options = dict(PTY_LINE)
        if simulator.unit != _DEFAULT_UNIT:
            options["unit"] = str(simulator.unit)
        self.url = f"plc+modbus-rtu://{self.cable.near}?{urlencode(options)}&{map_option(map_file)}{_SIMULATED}"
        self.present(simulator)


def plc_on_line(simulator: PlcSimulator) -> DeviceOnLine:
    """Return the PLC as a line sees it."""
    return DeviceOnLine(simulator, lambda now_ns: simulator.connect(now_ns, LineFrames()))


def serve_plc(
    simulator: PlcSimulator,
    map_file: Path,
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    clock: ScaledClock | None = None,
    allow_remote: bool = False,
) -> PlcHost:
    """Serve a simulated PLC; close the host, or use it as a context manager.

    Args:
        simulator: What to serve.
        map_file: The file of its map, for the URL.
        host: Address to bind to.
        port: Port, 0 for a free one.
        clock: The simulated time; real time by default.
        allow_remote: Whether an address that other machines can reach is taken.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.

    Example:
        >>> from pathlib import Path
        >>> import robolink
        >>> from robolink.register_maps import load_map
        >>> from robolink_simulators.plc import PlcSimulator, serve_plc
        >>> from robolink_simulators.testkit.operator import written_map
        >>> path = written_map(Path.cwd())
        >>> with serve_plc(PlcSimulator(load_map(path), seed=7), path) as host:
        ...     with robolink.connect(host.url) as controller:
        ...         list(controller.tools.indices())
        [1, 2]
    """
    clock = clock or ScaledClock()
    return PlcHost(simulator, map_file, (host, port), clock, allow_remote=allow_remote)


def serve_plc_line(
    simulator: PlcSimulator, map_file: Path, *, clock: ScaledClock | None = None
) -> PlcLineHost:
    """Serve a simulated PLC over Modbus RTU on a pseudo terminal; close the host.

    Args:
        simulator: What to serve.
        map_file: The file of its map, for the URL.
        clock: The simulated time; real time by default.

    Raises:
        ConfigError: No unit on a line can have the simulator's number.
        ConnectError: This system has no pseudo terminals.

    Example:
        >>> from pathlib import Path
        >>> import robolink
        >>> from robolink.register_maps import load_map
        >>> from robolink_simulators.plc import PlcSimulator, serve_plc_line
        >>> from robolink_simulators.testkit.operator import written_map
        >>> path = written_map(Path.cwd())
        >>> with serve_plc_line(PlcSimulator(load_map(path)), path) as host:
        ...     with robolink.connect(host.url) as controller:
        ...         list(controller.tools.indices())
        [1, 2]
    """
    if simulator.unit not in _UNITS_ON_A_LINE:
        raise ConfigError(
            tr("There is no unit {unit} on a serial line.", unit=simulator.unit),
            remedy=tr("Give a unit from {first} to {last}.", first=1, last=247),
        )
    try:
        return PlcLineHost(simulator, map_file, clock or ScaledClock())
    except (ImportError, AttributeError, OSError) as error:
        raise no_pseudo_terminal(error) from error


def serve_plc_opcua(
    simulator: PlcSimulator,
    map_file: Path,
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    clock: ScaledClock | None = None,
    users: Mapping[str, Secret] | None = None,
    expired: bool = False,
    allow_remote: bool = False,
) -> OpcuaHost:
    """Serve a simulated PLC with a map of symbols over OPC UA; close the host.

    Args:
        simulator: What to serve.
        map_file: The file of its map, for the URL.
        host: Address to bind to.
        port: Port, 0 for a free one.
        clock: The simulated time; real time by default.
        users: Passwords by name; none lets everybody in, without a name.
        expired: Whether its certificate ended yesterday.
        allow_remote: Whether an address that other machines can reach is taken.

    Raises:
        ConfigError: The map names registers, the address is not loopback and ``allow_remote`` is
            off, or asyncua is missing.
        ConnectError: The port is taken, or the address is not this machine's.

    Example:
        >>> from pathlib import Path
        >>> from robolink.register_maps import load_symbol_map
        >>> from robolink_simulators.plc import PlcSimulator, serve_plc_opcua
        >>> from robolink_simulators.testkit.operator import written_symbol_map
        >>> path = written_symbol_map(Path.cwd())
        >>> with serve_plc_opcua(PlcSimulator(load_symbol_map(path)), path) as host:
        ...     host.url.partition("://")[0]
        'plc+opcua'
    """
    clock = clock or ScaledClock()
    options = {"map": str(map_file.absolute())}
    # A URL that leads out of this computer may be a machine's: it is not marked as simulated.
    if parse_url(f"plc+opcua://{f'[{host}]' if ':' in host else host}").stays_here:
        options["simulated"] = "yes"
    return OpcuaHost(
        simulator,
        PlcSymbols(simulator),
        "plc+opcua",
        (host, port),
        clock,
        users=users,
        expired=expired,
        options=options,
        allow_remote=allow_remote,
    )


def _require_registers(simulator: PlcSimulator) -> None:
    if not isinstance(simulator.register_map, RegisterMap):
        raise ConfigError(
            tr("{map} names symbols, not registers.", map=simulator.register_map.name),
            remedy=tr("Serve it over OPC UA, or give a map of registers (docs/plc-maps.md)."),
        )


def map_option(map_file: Path) -> str:
    """Return the option of a URL that names a map."""
    return f"map={quote(str(map_file.absolute()))}"
