"""Serves a simulated EPSON controller on a TCP port, loopback unless told otherwise."""

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.spel.parse import prepare
from robolink_simulators.hosting.streams.tcp_host import TcpHost as TcpHost


def serve_tcp(
    simulator: EpsonSimulator,
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    clock: ScaledClock | None = None,
    allow_remote: bool = False,
) -> TcpHost:
    """Serve a simulated controller; close the host, or use it as a context manager.

    Args:
        simulator: What to serve.
        host: Address to bind to.
        port: Port, 0 for a free one.
        clock: The simulated time; real time by default.
        allow_remote: Whether an address that other machines can reach is taken.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.
    """
    clock = clock or ScaledClock()
    return _EpsonHost(simulator, (host, port), clock, allow_remote=allow_remote)


class _EpsonHost(TcpHost):
    """Tells the simulator where it is served, what time it is, and whom to wake."""

    def __init__(
        self,
        simulator: EpsonSimulator,
        address: tuple[str, int],
        clock: ScaledClock,
        *,
        allow_remote: bool,
    ) -> None:
        super().__init__(
            simulator,
            "epson+tcp",
            address,
            clock=clock,
            lock=simulator.lock,
            allow_remote=allow_remote,
        )
        prepare()
        self._simulator = simulator
        simulator.url = self.url
        simulator.keep_time(clock)
        simulator.watchers.append(self.wake)

    def close(self) -> None:
        """Stop serving and close every connection. Idempotent."""
        super().close()
        if self.wake in self._simulator.watchers:
            self._simulator.watchers.remove(self.wake)
            self._simulator.url = ""
