"""Makes TCP connections and puts their failures into words."""

import errno
import socket

from robolink.errors import ConfigError, ConnectError
from robolink.messages import tr
from robolink.timing import Deadline
from robolink.transport._url import LinkUrl
from robolink.transport.stream.keepalive import set_keepalive

_UNREACHABLE = (errno.EHOSTUNREACH, errno.ENETUNREACH, errno.ENETDOWN)


def require_tcp_url(url: LinkUrl) -> tuple[str, int]:
    """Return host and port of a TCP URL that has these and nothing else.

    Raises:
        ConfigError: Host or port is missing, or there is a path or an option.
    """
    if not url.host or url.port is None:
        raise ConfigError(
            tr("{identity} names no host and port.", identity=url.identity),
            remedy=tr("Write for example epson+tcp://192.168.0.1:5000."),
        )
    if url.path or url.options:
        extra = url.path or "?" + "&".join(url.options)
        raise ConfigError(
            tr("A {scheme} URL has no {extra!r}.", scheme=url.scheme, extra=extra),
            remedy=tr("End it after the port, for example epson+tcp://192.168.0.1:5000."),
        )
    return url.host, url.port


def dial(url: LinkUrl, *, timeout_s: float, deadline: Deadline) -> socket.socket:
    """Connect to the host and port of ``url``, trying each address the host name has.

    The operating system's name look-up cannot be interrupted; the deadline counts it, but
    does not cut it short.

    Raises:
        ConfigError: The URL is no TCP URL.
        ConnectError: Nobody answered before ``deadline``, which lies ``timeout_s`` ahead.
    """
    host, port = require_tcp_url(url)
    failure: OSError = TimeoutError()
    try:
        for family, kind, number, _, address in socket.getaddrinfo(
            _as_looked_up(host), port, type=socket.SOCK_STREAM
        ):
            if deadline.expired:
                break
            try:
                return _connect(socket.socket(family, kind, number), address, deadline)
            except OSError as error:
                failure = error
    except (socket.gaierror, UnicodeError) as error:
        raise ConnectError(
            tr("The host name {host!r} is not known.", host=host),
            remedy=tr("Check its spelling, or write the controller's IP address."),
            controller=url.identity,
        ) from error
    raise _connect_error(failure, url, timeout_s) from failure


def _as_looked_up(host: str) -> str | bytes:
    """Return the host as bytes where nothing of it has to be encoded: text loads tables of IDNA.

    A name whose length IDNA would refuse is left to it, so that it is refused as before.
    """
    ordinary = host.isascii() and all(0 < len(label) < 64 for label in host.split("."))
    return host.encode("ascii") if ordinary else host


def _connect(connection: socket.socket, address: object, deadline: Deadline) -> socket.socket:
    try:
        set_keepalive(connection)
        connection.settimeout(max(deadline.remaining_s(), 1e-3))  # 0 would mean non-blocking
        connection.connect(address)  # type: ignore[arg-type]
    except BaseException:
        connection.close()
        raise
    return connection


def _connect_error(error: OSError, url: LinkUrl, timeout_s: float) -> ConnectError:
    if isinstance(error, ConnectionRefusedError):
        what = tr("{identity} refuses connections.", identity=url.identity)
        remedy = tr(
            "The machine is there, but nothing listens on this port. Check the port "
            "number, and that the controller's remote control, or its Modbus server, "
            "is switched on."
        )
    elif isinstance(error, TimeoutError):
        what = tr(
            "{identity} did not answer within {timeout_s:g} s.",
            identity=url.identity,
            timeout_s=timeout_s,
        )
        remedy = tr("Check that the controller is on, its address, the cable and any firewall.")
    elif error.errno in _UNREACHABLE:
        what = tr("There is no route to {identity}.", identity=url.identity)
        remedy = tr("Check the cable and that this computer has an address in the same network.")
    else:
        what = tr(
            "No connection to {identity}: {cause}.",
            identity=url.identity,
            cause=error.strerror or error,
        )
        remedy = tr("Check the address, the port and this computer's network settings.")
    return ConnectError(what, remedy=remedy, controller=url.identity)
