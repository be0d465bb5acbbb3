"""Opens a CAN bus, and reads it in the caller's own thread.

python-can's Notifier reads in a thread that ends without a word at the first bus error
(docs/reference/faults.md F50). Here whoever waits for an answer reads the bus itself, so an
error reaches the one who waits, and there is no thread to stop.
"""

import logging
import threading
from typing import Any, Final

import can

from robolink.errors import (
    ConfigError,
    ConnectError,
    TransportBrokenError,
    TransportClosedError,
    TransportError,
)
from robolink.messages import tr
from robolink.timing import Deadline
from robolink.transport._url import LinkUrl
from robolink.transport._url_options import UrlOptions

# It writes to standard error when nobody listens; every failure is an exception here.
logging.getLogger("can").addHandler(logging.NullHandler())

SLICE_S: Final = 0.05
_MULTICAST_PORT: Final = 43113
_SOCKETCAND_PORT: Final = 29536
_BUS_OFF: Final = 0x40
"""In the identifier of an error frame, as Linux reports it (linux/can/error.h)."""


def open_can_bus(url: LinkUrl, options: UrlOptions, identifiers: tuple[int, ...]) -> "CanLine":
    """Open the bus that a ``KIND+can://CHANNEL`` URL names.

    Args:
        url: Host, port or path name the channel.
        options: ``interface`` (socketcan, slcan, socketcand, udp_multicast, virtual or any
            other of python-can), ``channel`` where the URL cannot spell it, ``bitrate``.
        identifiers: The only 11-bit identifiers that are wanted.

    Raises:
        ConfigError: The interface is not known, or lacks something.
        ConnectError: The interface cannot be opened.
    """
    interface = options.take_text("interface", "socketcan")
    settings = _settings(url, options, interface)
    options.finish()
    filters = [{"can_id": it, "can_mask": 0x7FF, "extended": False} for it in identifiers]
    try:
        bus = can.Bus(interface=interface, can_filters=filters, ignore_config=True, **settings)
    except (NotImplementedError, ImportError, TypeError, ValueError) as error:
        raise ConfigError(
            tr("The CAN interface {name!r} cannot be used: {cause}.", name=interface, cause=error),
            remedy=tr(
                "Check interface, channel and bitrate in the URL; udp_multicast needs "
                "'pip install robolink[udp-multicast]'."
            ),
            controller=url.identity,
        ) from error
    except (can.CanError, OSError) as error:
        raise ConnectError(
            tr(
                "The CAN bus {identity} cannot be opened: {cause}.",
                identity=url.identity,
                cause=error,
            ),
            remedy=tr("Check that the adapter is plugged in and that its interface is up."),
            controller=url.identity,
        ) from error
    return CanLine(bus, url.identity)


def _settings(url: LinkUrl, options: UrlOptions, interface: str) -> dict[str, Any]:
    channel = options.take_text("channel", url.path or url.host)
    if not channel:
        raise ConfigError(
            tr("{identity} names no CAN channel.", identity=url.identity),
            remedy=tr("Write for example {scheme}://can0?node=5.", scheme=url.scheme),
        )
    settings: dict[str, Any] = {"channel": channel}
    if interface == "udp_multicast":  # hop limit 0: frames never leave this computer
        settings |= {"port": url.port or _MULTICAST_PORT, "hop_limit": 0, "fd": False}
    elif interface == "socketcand":
        settings |= {"host": url.host, "port": url.port or _SOCKETCAND_PORT}
    bitrate = options.take_int("bitrate", 0, 0, 1_000_000)
    if bitrate:
        settings["bitrate"] = bitrate
    return settings


class CanLine:
    """A bus that whoever waits reads. Owns it; :meth:`close` may come from any thread."""

    def __init__(self, bus: can.BusABC, identity: str) -> None:
        self._bus = bus
        self._identity = identity
        self._closed = threading.Event()

    def receive(self, deadline: Deadline) -> can.Message | None:
        """Return the next frame, ``None`` when none came within a short slice or the deadline.

        Error frames that do not mean the end are frames like any other.

        Raises:
            TransportBrokenError: The bus or its adapter failed.
            TransportClosedError: The line was closed.
        """
        try:
            message = self._bus.recv(min(deadline.remaining_s(), SLICE_S))
        except (can.CanError, OSError, ValueError) as error:
            raise self._ended(error) from error
        if message and message.is_error_frame and message.arbitration_id & _BUS_OFF:
            raise self._bus_off()
        return message

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame with an 11-bit identifier, once. Raises as :meth:`receive`."""
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        try:
            self._bus.send(message)
        except (can.CanError, OSError, ValueError) as error:
            raise self._ended(error) from error

    def close(self) -> None:
        """Close. Idempotent."""
        if not self._closed.is_set():
            self._closed.set()
            self._bus.shutdown()

    def _ended(self, error: Exception) -> TransportError:
        if self._closed.is_set():
            return TransportClosedError(
                tr("The connection to {identity} is closed.", identity=self._identity),
                remedy=tr("Connect again."),
                controller=self._identity,
            )
        return TransportBrokenError(
            tr("The CAN bus {identity} failed: {cause}.", identity=self._identity, cause=error),
            remedy=tr("Check the adapter, the bit rate and the terminators, then connect again."),
            controller=self._identity,
        )

    def _bus_off(self) -> TransportBrokenError:
        return TransportBrokenError(
            tr("The CAN controller of {identity} went bus-off.", identity=self._identity),
            remedy=tr(
                "Too many transmissions failed: check bit rate, wiring and terminators, bring "
                "the interface up again, then connect again."
            ),
            controller=self._identity,
        )
