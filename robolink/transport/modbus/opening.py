"""From a URL to a Modbus client."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink.errors import Concerning, ConfigError, ConnectError, TransportTimeoutError
from robolink.messages import tr
from robolink.package_log import PackageLog
from robolink.timing import Clock, Deadline, SystemClock
from robolink.transport._url import LinkUrl, UrlOptions
from robolink.transport.byte_stream import logged
from robolink.transport.modbus.client import ModbusClient
from robolink.transport.modbus.frames import MOST_REGISTERS_READ, Area, RtuFraming, TcpFraming
from robolink.transport.modbus.tcp import TcpExchange
from robolink.transport.tcp import TcpTransport, dial

if TYPE_CHECKING:
    from robolink.transport.serial_port import SerialSettings

MOST_REGISTERS: Final = "most_registers"
"""URL option: the number of registers that the server returns in one read."""

TCP_MEDIUM: Final = "modbus-tcp"
RTU_MEDIUM: Final = "modbus-rtu"

_DEFAULT_UNITS: Final = {TCP_MEDIUM: 255, RTU_MEDIUM: 1}
"""Default unit, by medium: a TCP server that is no gateway has unit 255 (Modbus messaging on TCP/IP
1.0b)."""

_PORT: Final = 502
_FASTEST_TIMED_BAUD: Final = 19_200
_QUIET_CHARACTERS: Final = 10
_QUIET_S: Final = 0.02
"""Shortest pause that counts as silence, in s: USB adapters deliver data every 16 ms."""

_LOG: Final = PackageLog(__package__)

_NO_YES: Final = {"no": False, "yes": True}


@dataclass(frozen=True, slots=True)
class Probe:
    """A place that can be read, to find out whether a serial line is in step.

    Attributes:
        area: Input or holding registers.
        address: First address; up to 35 registers are read from it.
    """

    area: Area = Area.HOLDING
    address: int = 0


def open_modbus(
    url: LinkUrl, *, timeout_s: float = 3.0, clock: Clock | None = None
) -> ModbusClient:
    """Open a client for ``KIND+modbus-tcp://host:502`` or ``KIND+modbus-rtu:///dev/ttyUSB0``.

    Args:
        url: Options are ``unit`` and ``most_registers`` (125: how many the server gives in one
            read); on a serial line also ``baud`` (19200), ``parity`` (even,
            none or odd), ``stopbits`` (1, or 2 without parity: Modbus over serial line 1.02,
            2.5.1) and ``echo`` (yes when an RS-485 adapter hears itself).
        timeout_s: Longest wait for the connection, and for each answer.
        clock: Replaces the machine's clock.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: No connection; on a serial line also when the unit does not answer.
        RemoteProtocolError: What a serial line brings is no Modbus.
    """
    options = UrlOptions(url)
    return open_client(url, options, probe=Probe(), timeout_s=timeout_s, clock=clock)


def open_client(
    url: LinkUrl,
    options: UrlOptions,
    *,
    probe: Probe,
    timeout_s: float,
    clock: Clock | None,
) -> ModbusClient:
    """Open a client; ``options`` are those that the caller has left. See :func:`open_modbus`."""
    clock = clock or SystemClock()
    if url.medium == TCP_MEDIUM:
        return _open_tcp(url, options, timeout_s=timeout_s, clock=clock)
    return _open_rtu(url, options, probe=probe, timeout_s=timeout_s, clock=clock)


def _open_tcp(url: LinkUrl, options: UrlOptions, *, timeout_s: float, clock: Clock) -> ModbusClient:
    unit = options.take_int("unit", _DEFAULT_UNITS[TCP_MEDIUM], 0, 255)
    most = options.take_int(MOST_REGISTERS, MOST_REGISTERS_READ, 4, MOST_REGISTERS_READ)
    options.finish()
    if not url.host or url.path:
        raise ConfigError(
            tr("{identity} names no host.", identity=url.identity),
            remedy=tr("Write for example {scheme}://192.168.0.2:502.", scheme=url.scheme),
        )
    server = replace(url, port=url.port or _PORT, options={})
    deadline = Deadline.after(clock, timeout_s)
    connection = dial(server, timeout_s=timeout_s, deadline=deadline)
    transport = logged(TcpTransport(connection, server, clock), log=_LOG)
    identity = _identity(server, unit)
    exchange = TcpExchange(transport, identity, TcpFraming())
    return ModbusClient(
        transport,
        exchange,
        identity=identity,
        unit=unit,
        timeout_s=timeout_s,
        most_registers=most,
    )


def _open_rtu(
    url: LinkUrl,
    options: UrlOptions,
    *,
    probe: Probe,
    timeout_s: float,
    clock: Clock,
) -> ModbusClient:
    # Imported here, because TCP needs nothing of a serial line.
    from robolink.transport.modbus.rtu import RtuExchange, RtuLine
    from robolink.transport.serial_port import open_serial, take_settings

    unit = options.take_int("unit", _DEFAULT_UNITS[RTU_MEDIUM], 1, 247)
    settings = take_settings(options, baud=19_200, parity="even", stop_bits_without_parity="2")
    echo = options.take_choice("echo", "no", _NO_YES)
    most = options.take_int(MOST_REGISTERS, MOST_REGISTERS_READ, 4, MOST_REGISTERS_READ)
    options.finish()
    timed = settings.baud <= _FASTEST_TIMED_BAUD
    line = RtuLine(
        character_s=settings.character_s,
        silence_s=3.5 * settings.character_s if timed else 0.00175,
        quiet_s=max(_QUIET_CHARACTERS * settings.character_s, _QUIET_S),
        echo=echo,
        probe_area=probe.area,
        probe_address=probe.address,
    )
    line_itself = open_serial(url, settings, timeout_s=timeout_s, clock=clock)
    transport = logged(line_itself, log=_LOG)
    identity = _identity(url, unit)
    exchange = RtuExchange(transport, identity, line, RtuFraming())
    try:
        with Concerning(identity):
            exchange.get_in_step(unit, Deadline.after(clock, timeout_s))
    except TransportTimeoutError as error:
        transport.close()
        raise _nobody_there(error, url, unit, settings) from error
    except BaseException:
        transport.close()
        raise
    return ModbusClient(
        transport,
        exchange,
        identity=identity,
        unit=unit,
        timeout_s=timeout_s,
        most_registers=most,
    )


def _identity(url: LinkUrl, unit: int) -> str:
    return url.identity + (f"?unit={unit}" if unit != _DEFAULT_UNITS[url.medium] else "")


def _nobody_there(
    error: TransportTimeoutError, url: LinkUrl, unit: int, settings: "SerialSettings"
) -> ConnectError:
    return ConnectError(
        tr(
            "Unit {unit} does not answer on {identity} at {baud} baud, parity {parity}.",
            unit=unit,
            identity=url.identity,
            baud=settings.baud,
            parity=settings.parity,
        ),
        remedy=tr("Compare unit, baud, parity and stopbits with the PLC; check the cable (A, B)."),
        controller=url.identity,
        request=error.request,
        raw=error.raw,
    )
