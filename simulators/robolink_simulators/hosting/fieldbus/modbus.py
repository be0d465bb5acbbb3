"""Serves a simulated PLC as a Modbus server, over TCP or a serial cable."""

from typing import Final
from urllib.parse import urlencode

from robolink.interrupts import ClosedAtExit
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import LinkKind
from robolink_simulators.hosting.addresses import cannot_listen, require_loopback
from robolink_simulators.hosting.fieldbus.modbus_server import ModbusServerThread, SerialLine
from robolink_simulators.hosting.fieldbus.plc_registers import PlcRegisters
from robolink_simulators.hosting.streams.serial_host import (
    PTY_LINE,
    SerialCable,
    no_pseudo_terminal,
)
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_DEFAULT_UNIT: Final = 1


class ModbusHost(ClosedAtExit):
    """A Modbus server in front of a simulated PLC; a context manager.

    Args:
        simulator: The PLC.
        server: Serves its registers.
        url: Where clients connect to.
        cable: The serial cable between them, if any.
    """

    def __init__(
        self,
        simulator: SoftMotionSimulator,
        server: ModbusServerThread,
        url: str,
        cable: SerialCable | None = None,
    ) -> None:
        self._simulator = simulator
        self._server = server
        self._cable = cable
        self._seen = server.ends
        self.url = url
        simulator.watchers.append(self._look)

    def close(self) -> None:
        """Stop serving. Idempotent."""
        if self._look in self._simulator.watchers:
            self._simulator.watchers.remove(self._look)
            if self._simulator.url == self.url:
                self._simulator.url = ""
            self._server.close()
            if self._cable is not None:
                self._cable.close()

    def _look(self) -> None:
        """Cut connections when the PLC was started anew or its cable pulled; a line has none."""
        if self._cable is None and self._seen != self._server.ends:
            self._server.cut()
        self._seen = self._server.ends


def serve_modbus_tcp(
    simulator: SoftMotionSimulator,
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    clock: ScaledClock | None = None,
    allow_remote: bool = False,
) -> ModbusHost:
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
    require_loopback(host, allow_remote=allow_remote)
    clock = _presented(simulator, clock)
    try:
        server = ModbusServerThread(PlcRegisters(simulator, clock), clock, (host, port))
    except (OSError, OverflowError) as error:
        raise cannot_listen(host, port, error) from error
    shown = f"[{host}]" if ":" in host else host
    options = _client_options(simulator.options.mailbox)
    url = f"softmotion+modbus-tcp://{shown}:{server.port}{_query(options)}"
    simulator.url = simulator.url or url
    return ModbusHost(simulator, server, url)


def serve_modbus_rtu(
    simulator: SoftMotionSimulator,
    *,
    unit: int = _DEFAULT_UNIT,
    baud: int = 0,
    clock: ScaledClock | None = None,
) -> ModbusHost:
    """Serve a PLC over Modbus RTU on a pseudo terminal; other units are not answered.

    Args:
        simulator: The PLC.
        unit: Its number on the line.
        baud: As slowly as a line at this rate, in real time; 0 carries everything at once.
        clock: The simulated time; real time by default.

    Raises:
        ConnectError: This system has no pseudo terminals.
    """
    clock = _presented(simulator, clock)
    try:
        cable = SerialCable(baud)
        port = SerialLine(cable.far, unit)
        registers = PlcRegisters(simulator, clock, LinkKind.MODBUS_RTU)
        server = ModbusServerThread(registers, clock, port)
    except (ImportError, AttributeError, OSError) as error:
        raise no_pseudo_terminal(error) from error
    options = {**PTY_LINE, **_client_options(simulator.options.mailbox)}
    if baud:
        options["baud"] = str(baud)
    if unit != _DEFAULT_UNIT:
        options["unit"] = str(unit)
    url = f"softmotion+modbus-rtu://{cable.near}{_query(options)}"
    simulator.url = simulator.url or url
    return ModbusHost(simulator, server, url, cable)


def _presented(simulator: SoftMotionSimulator, clock: ScaledClock | None) -> ScaledClock:
    clock = clock or ScaledClock()
    simulator.keep_time(clock)
    return clock


def _client_options(options: MailboxOptions) -> dict[str, str]:
    """Return what a client must be told beside the address."""
    usual = MailboxOptions()
    names = ("command", "response", "slots", "registers")
    return {
        name: str(getattr(options, name))
        for name in names
        if getattr(options, name) != getattr(usual, name)
    }


def _query(options: dict[str, str]) -> str:
    return f"?{urlencode(options)}" if options else ""
