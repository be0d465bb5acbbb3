"""Serves a simulated PLC as a Modbus server, over TCP or a serial cable."""

from typing import Final
from urllib.parse import urlencode

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.fieldbus.mailbox_frames import MailboxFrames
from robolink_simulators.hosting.streams.serial_host import PTY_LINE, LineHost, no_pseudo_terminal
from robolink_simulators.hosting.streams.tcp_host import TcpHost
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_DEFAULT_UNIT: Final = 1


class ModbusTcpHost(TcpHost):
    """A PLC at a TCP port."""

    def __init__(
        self,
        simulator: SoftMotionSimulator,
        address: tuple[str, int],
        clock: ScaledClock,
        *,
        allow_remote: bool,
    ) -> None:
        self._frames = MailboxFrames(simulator, clock)
        super().__init__(
            self._frames,
            "softmotion+modbus-tcp",
            address,
            clock=clock,
            lock=simulator.lock,
            allow_remote=allow_remote,
        )
        self.url = self.url_at(address[0]) + _query(_client_options(simulator.options.mailbox))
        self.present(simulator, self.url)
        simulator.url = simulator.url or self.url

    def wake(self) -> None:
        """Let the PLC be checked again; any thread may call it."""
        with self._lock:
            self._frames.look()
        super().wake()


class ModbusLineHost(LineHost):
    """A PLC at the far end of a serial cable.

    Attributes:
        url: Where clients connect to, with what they must be told.
    """

    def __init__(
        self, simulator: SoftMotionSimulator, clock: ScaledClock, *, unit: int, baud: int
    ) -> None:
        frames = MailboxFrames(simulator, clock, unit=unit)
        super().__init__(frames, clock=clock, lock=simulator.lock, baud=baud)
        options = {**PTY_LINE, **_client_options(simulator.options.mailbox)}
        if baud:
            options["baud"] = str(baud)
        if unit != _DEFAULT_UNIT:
            options["unit"] = str(unit)
        self.url = f"softmotion+modbus-rtu://{self.cable.near}{_query(options)}"
        self.present(simulator, self.url)
        simulator.url = simulator.url or self.url


ModbusHost = ModbusTcpHost | ModbusLineHost


def serve_modbus_tcp(
    simulator: SoftMotionSimulator,
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    clock: ScaledClock | None = None,
    allow_remote: bool = False,
) -> ModbusTcpHost:
    """Serve a PLC over Modbus TCP; every unit is answered.

    Args:
        simulator: The PLC.
        host: Address to bind to.
        port: Port, 0 for a free one.
        clock: The simulated time; real time by default.
        allow_remote: Whether an address that other machines can reach is taken.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.
    """
    clock = clock or ScaledClock()
    return ModbusTcpHost(simulator, (host, port), clock, allow_remote=allow_remote)


def serve_modbus_rtu(
    simulator: SoftMotionSimulator,
    *,
    unit: int = _DEFAULT_UNIT,
    baud: int = 0,
    clock: ScaledClock | None = None,
) -> ModbusLineHost:
    """Serve a PLC over Modbus RTU on a pseudo terminal; other units are not answered.

    Args:
        simulator: The PLC.
        unit: Its number on the line.
        baud: As slowly as a line at this rate, in real time; 0 carries everything at once.
        clock: The simulated time; real time by default.

    Raises:
        ConnectError: This system has no pseudo terminals.
    """
    try:
        return ModbusLineHost(simulator, clock or ScaledClock(), unit=unit, baud=baud)
    except (ImportError, AttributeError, OSError) as error:
        raise no_pseudo_terminal(error) from error


def _client_options(options: MailboxOptions) -> dict[str, str]:
    """Return what a client must be told besides the address."""
    usual = MailboxOptions()
    names = ("command", "response", "slots", "registers")
    return {
        name: str(getattr(options, name))
        for name in names
        if getattr(options, name) != getattr(usual, name)
    }


def _query(options: dict[str, str]) -> str:
    return f"?{urlencode(options)}" if options else ""
