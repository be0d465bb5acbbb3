"""A serial port as a transport.

pyserial waits a short slice at a time and the deadline is looked at between slices: to change
its own time-out would set up the whole port anew. So a deadline may be overrun by one slice.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from robolink.errors import (
    ConfigError,
    ConnectError,
    TransportBrokenError,
    TransportError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.timing import Clock, Deadline, SystemClock
from robolink.transport._url import LinkUrl, UrlOptions
from robolink.transport.byte_stream import link_closed

_SLICE_S: Final = 0.02
_CHUNK_BYTES: Final = 4096


def _settings_refused() -> tuple[type[Exception], ...]:
    """Return what POSIX raises when a device takes no such settings, as a pty may."""
    try:
        import termios
    except ImportError:
        return ()
    return (termios.error,)


_REFUSALS: Final[tuple[type[Exception], ...]] = (OSError, *_settings_refused())

_PARITIES: Final[Mapping[str, Literal["N", "E", "O"]]] = {"even": "E", "none": "N", "odd": "O"}
_STOP_BITS: Final[Mapping[str, Literal[1, 2]]] = {"1": 1, "2": 2}
_SERVERS: Final = {"socket": "socket", "rfc2217": "rfc2217"}
_BAUD_RATES: Final = (300, 4_000_000)


@dataclass(frozen=True, slots=True)
class SerialSettings:
    """How a serial line is set.

    Attributes:
        baud: Bits per second.
        parity: None, even or odd.
        stop_bits: 1 or 2.
    """

    baud: int
    parity: Literal["N", "E", "O"]
    stop_bits: Literal[1, 2]

    @property
    def character_s(self) -> float:
        """How long one character of 8 data bits takes, in seconds."""
        return (9 + (self.parity != "N") + self.stop_bits) / self.baud


def take_settings(
    options: UrlOptions, *, baud: int | None, parity: str, stop_bits_without_parity: str = "1"
) -> SerialSettings:
    """Take ``baud``, ``parity`` and ``stopbits`` from the options of a URL.

    Args:
        options: Those that nobody has taken yet.
        baud: Where the URL names none; ``None`` where it has to.
        parity: Where the URL names none: even, none or odd.
        stop_bits_without_parity: Where the URL names none and there is no parity.

    Raises:
        ConfigError: One is missing, or cannot be.
    """
    rate = options.take_int("baud", baud, *_BAUD_RATES)
    checked = options.take_choice("parity", parity, _PARITIES)
    usual = stop_bits_without_parity if checked == "N" else "1"
    return SerialSettings(rate, checked, options.take_choice("stopbits", usual, _STOP_BITS))


def open_serial_line(
    url: LinkUrl, *, timeout_s: float, clock: Clock | None = None
) -> "SerialTransport":
    """Open a line of bytes: a port of this machine, or one of a device server.

    Args:
        url: ``KIND+serial:///dev/ttyUSB0?baud=38400``, ``KIND+serial://COM3?baud=38400``, or
            ``KIND+serial://host:4001?server=socket`` where a device server owns the port.
            ``server=rfc2217`` sets baud rate, parity and stop bits there; with ``socket`` they
            are set on the server itself. ``baud`` has to be said, for the factory setting of no
            remote port is known; ``parity`` is none and ``stopbits`` 1 unless said.
        timeout_s: Longest wait for the line to take what is sent.
        clock: Replaces the machine's clock.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: The port, or the server, is missing, forbidden or used by another program.
    """
    options = UrlOptions(url)
    settings = take_settings(options, baud=None, parity="none")
    clock = clock or SystemClock()
    if url.port is None:
        options.finish()
        return open_serial(url, settings, timeout_s=timeout_s, clock=clock)
    server = options.take_choice("server", "", _SERVERS)
    options.finish()
    host = f"[{url.host}]" if ":" in url.host else url.host
    far = f"{server}://{host}:{url.port}"
    return _opened(far, replace(url, options={}), settings, timeout_s=timeout_s, clock=clock)


def serial_device(url: LinkUrl) -> str:
    """Return the port of ``KIND+MEDIUM:///dev/ttyUSB0`` or ``KIND+MEDIUM://COM3``.

    Raises:
        ConfigError: It names none, or more than one thing.
    """
    device = url.path or url.host.upper()
    if not device or (url.path and url.host) or url.port is not None:
        raise ConfigError(
            tr("{identity} names no serial port.", identity=url.identity),
            remedy=tr("Write for example {scheme}:///dev/ttyUSB0.", scheme=url.scheme),
        )
    return device


def open_serial(
    url: LinkUrl, settings: SerialSettings, *, timeout_s: float, clock: Clock
) -> "SerialTransport":
    """Open a serial port for this process alone.

    Args:
        url: Names the port in its path, or on Windows in its host.
        settings: Baud rate, parity and stop bits.
        timeout_s: Longest wait for the port to take what is sent.
        clock: Keeps the deadlines.

    Raises:
        ConfigError: The URL names no port, or the port cannot be set like this.
        ConnectError: The port is missing, forbidden or used by another program.
    """
    return _opened(serial_device(url), url, settings, timeout_s=timeout_s, clock=clock)


def _opened(
    device: str, url: LinkUrl, settings: SerialSettings, *, timeout_s: float, clock: Clock
) -> "SerialTransport":
    import serial

    more: dict[str, object] = {}
    if not device.startswith("rfc2217:"):
        more["write_timeout"] = timeout_s  # pyserial sets none there
    if "://" not in device:
        more["exclusive"] = True  # a device server limits its port to one client itself
    try:
        port = serial.serial_for_url(
            device,
            settings.baud,
            parity=settings.parity,
            stopbits=settings.stop_bits,
            timeout=_SLICE_S,
            **more,
        )
    except ValueError as error:
        raise ConfigError(
            tr("{device} cannot be set like this: {cause}.", device=device, cause=error),
            remedy=tr("Check baud, parity and stopbits in the URL."),
            controller=url.identity,
        ) from error
    except _REFUSALS as error:
        cause = getattr(error, "strerror", None) or error
        raise ConnectError(
            tr("{device} cannot be opened: {cause}.", device=device, cause=cause),
            remedy=tr(
                "Check that it is plugged in, that you may use it and that no other program "
                "does; 'robolink cell ports' lists the ports."
            ),
            controller=url.identity,
        ) from error
    return SerialTransport(port, url, clock)


class SerialTransport:
    """Implements :class:`~robolink.transport.Transport` on an open port, and owns it."""

    durable: bool = True
    """True: a device on a cable outlives this process."""

    def __init__(self, port: Any, url: LinkUrl, clock: Clock) -> None:  # noqa: ANN401 - pyserial has no types
        self._port = port
        self.url = self.identity = url.identity
        self.place, self.clock = url.place, clock
        self._closed = False

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:  # noqa: ARG002 - pyserial has its own write time-out; nothing is recorded here
        """See :meth:`robolink.transport.Transport.send`."""
        from serial import SerialTimeoutException

        try:
            self._port.write(data)
        except SerialTimeoutException as error:
            raise self._timed_out() from error
        except (OSError, TypeError) as error:
            raise self._ended(error) from error

    def receive(self, *, deadline: Deadline) -> bytes:
        """See :meth:`robolink.transport.Transport.receive`; a port has no end of stream."""
        while True:
            try:
                first: bytes = self._port.read(1)
                if first:
                    return first + self._waiting()
            except (OSError, TypeError) as error:
                raise self._ended(error) from error
            if deadline.expired:
                raise self._timed_out()

    def receive_waiting(self) -> bytes | None:
        """See :meth:`robolink.transport.Transport.receive_waiting`."""
        try:
            return self._waiting() or None
        except (OSError, TypeError) as error:
            raise self._ended(error) from error

    def wait_readable(self, *, deadline: Deadline) -> bool:
        """See :meth:`robolink.transport.Transport.wait_readable`."""
        while not self._closed:
            try:
                if self._port.in_waiting:
                    return True
            except (OSError, TypeError):
                return True
            if deadline.expired:
                return False
            self.clock.sleep(min(deadline.remaining_s(), _SLICE_S))
        return True

    def close(self) -> None:
        """See :meth:`robolink.transport.Transport.close`."""
        self._closed = True
        self._port.close()

    def _waiting(self) -> bytes:
        count = min(self._port.in_waiting, _CHUNK_BYTES)
        waiting: bytes = self._port.read(count) if count else b""
        return waiting

    def _timed_out(self) -> TransportTimeoutError:
        return TransportTimeoutError(
            tr("{identity} did not answer in time.", identity=self.identity),
            remedy=tr("Check the cable, the baud rate and the parity."),
            controller=self.identity,
        )

    def _ended(self, error: Exception) -> TransportError:
        # On a port closed by another thread, pyserial raises TypeError.
        if self._closed or isinstance(error, TypeError):
            return link_closed(self.identity)
        return TransportBrokenError(
            tr("The connection to {identity} broke: {cause}.", identity=self.identity, cause=error),
            remedy=tr("Check that the adapter is still plugged in, then connect again."),
            controller=self.identity,
        )
