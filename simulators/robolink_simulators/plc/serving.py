"""Serves the simulated PLC on a TCP port, loopback unless told otherwise."""

from pathlib import Path
from urllib.parse import quote

from robolink_simulators.clock import ScaledClock
from robolink_simulators.hosting._tcp_host import TcpHost
from robolink_simulators.plc.device import PlcSimulator


class PlcHost(TcpHost):
    """A TCP host whose URL names the map as well."""

    def __init__(
        self,
        simulator: PlcSimulator,
        map_file: Path,
        address: tuple[str, int],
        clock: ScaledClock,
        *,
        allow_remote: bool,
    ) -> None:
        self._options = f"?unit={simulator.unit}&map={quote(str(map_file.absolute()))}"
        super().__init__(
            simulator,
            "plc+modbus-tcp",
            address,
            clock=clock,
            lock=simulator.lock,
            allow_remote=allow_remote,
        )

    @property
    def url(self) -> str:
        """Where clients connect to, with the unit and the map."""
        return super().url + self._options


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
    """
    clock = clock or ScaledClock()
    return PlcHost(simulator, map_file, (host, port), clock, allow_remote=allow_remote)
