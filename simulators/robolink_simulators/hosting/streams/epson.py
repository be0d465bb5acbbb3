"""Serves a simulated EPSON controller with Remote RS232 on a pseudo terminal."""

from urllib.parse import urlencode

from robolink.protocols.epson_binary import Dialect
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import serial_dialect
from robolink_simulators.epson.spel.parser import prepare
from robolink_simulators.hosting.streams.serial_host import (
    DeviceOnLine,
    LineHost,
    no_pseudo_terminal,
)
from robolink_simulators.hosting.streams.tcp_host import TcpHost as TcpHost

_SHOWN_BAUD = 115_200
"""Baud rate in the URL. A pseudo terminal has none, but a client must give one."""


def serve_serial(
    simulator: EpsonSimulator,
    *,
    baud: int = 0,
    clock: ScaledClock | None = None,
) -> "EpsonLineHost":
    """Serve a simulated controller at a serial line; close the host, or use it as a context.

    Args:
        simulator: What to serve.
        baud: As slowly as a line at this rate, in real time; 0 carries everything at once.
        clock: The simulated time; real time by default.

    Raises:
        ConnectError: This system has no pseudo terminals.
    """
    try:
        return EpsonLineHost(simulator, clock=clock or ScaledClock(), baud=baud)
    except (ImportError, AttributeError, OSError) as error:
        raise no_pseudo_terminal(error) from error


class EpsonLineHost(LineHost):
    """A controller at the far end of a serial cable.

    Attributes:
        url: Where a client finds it, with all that it must know of the dialect.
    """

    def __init__(self, simulator: EpsonSimulator, *, clock: ScaledClock, baud: int) -> None:
        face = DeviceOnLine(simulator, simulator.connect_serial)
        super().__init__(face, clock=clock, lock=simulator.lock, baud=baud)
        prepare()
        options = {"baud": str(baud or _SHOWN_BAUD), **_told(serial_dialect(simulator.options))}
        self.url = f"epson+serial://{self.cable.near}?{urlencode(options)}"
        simulator.url = simulator.url or self.url
        self.present(simulator, self.url)


def _told(dialect: Dialect) -> dict[str, str]:
    """Return the options that a client has to give, because they differ from the defaults."""
    usual = Dialect()
    return {
        name: str(value)
        for name, value in (
            ("numbers", dialect.numbers),
            ("nak_code", dialect.nak_code),
            ("letters", dialect.letters),
            ("word_port_bytes", dialect.word_port_bytes),
        )
        if value != getattr(usual, name)
    }


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
        simulator.url = self.url
        self.present(simulator, self.url)
