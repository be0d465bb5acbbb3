"""From a URL to an open transport.

Media that this package brings stand in a table and are imported when they are named; all
others, the bundled simulators among them, are found by the name of their full scheme in the
entry-point group ``robolink.transports``.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.plug_ins import PlugInError, find_plug_in
from robolink.timing import Clock
from robolink.transport._mailbox_link import MailboxLink
from robolink.transport._url import LinkUrl, parse_url
from robolink.transport.byte_stream import Transport, logged

if TYPE_CHECKING:
    from robolink.model import Secret
    from robolink.transport.modbus.client import ModbusClient
    from robolink.transport.opcua.client import OpcuaClient

TRANSPORTS_GROUP = "robolink.transports"

_MEDIA = {
    "tcp": ("robolink.transport.tcp", "open_tcp"),
    "serial": ("robolink.transport.serial_port", "open_serial_line"),
}
_MAILBOX_MEDIA = {
    "modbus-tcp": ("robolink.transport.modbus.mailbox", "open_modbus_link"),
    "modbus-rtu": ("robolink.transport.modbus.mailbox", "open_modbus_link"),
    "can": ("robolink.transport.can.mailbox", "open_canopen_link"),
    "opcua": ("robolink.transport.opcua.mailbox", "open_opcua_link"),
}
_REGISTER_MEDIA = {
    "modbus-tcp": ("robolink.transport.modbus.opening", "open_modbus"),
    "modbus-rtu": ("robolink.transport.modbus.opening", "open_modbus"),
}
_NODE_MEDIA = {
    "opcua": ("robolink.transport.opcua.opening", "open_opcua"),
}

_loaded: Final[dict[str, Callable[..., Any]]] = {}
"""Loaded entry points, by scheme: finding one reads the metadata of every installed package, and an
imported one stays the same until the process ends."""


class TransportOpener(Protocol):
    """What a medium, or an entry point of the group, provides."""

    def __call__(self, url: LinkUrl, *, timeout_s: float, clock: Clock | None) -> Transport:
        """Open a transport to ``url`` within ``timeout_s``."""


def open_transport(
    url: str | LinkUrl, *, timeout_s: float = 3.0, clock: Clock | None = None
) -> Transport:
    """Open a transport to a controller.

    Args:
        url: For example ``epson+tcp://192.168.0.1:5000``.
        timeout_s: Longest wait for the connection.
        clock: Replaces the machine's clock; a simulator brings its own.

    Raises:
        ConfigError: The URL is wrong, or nothing knows its scheme.
        ConnectError: No connection could be made.

    Example:
        >>> from robolink.timing import Deadline
        >>> from robolink.transport import open_transport
        >>> line = open_transport("epson+sim://transport-example")
        >>> deadline = Deadline.after(line.clock, 1)
        >>> line.send(b"$Login" + bytes([13, 10]), deadline=deadline)
        >>> line.receive(deadline=deadline)[:8]
        b'#Login,0'
        >>> line.close()
    """
    link = parse_url(url) if isinstance(url, str) else url
    opener = cast(TransportOpener, _find(link, _MEDIA))
    return logged(opener(link, timeout_s=timeout_s, clock=clock))


def open_mailbox_link(
    url: str | LinkUrl,
    *,
    timeout_s: float = 3.0,
    clock: Clock | None = None,
    password: "Secret | None" = None,
    stopping: bool = False,
) -> MailboxLink:
    """Open a link to a PLC mailbox.

    Args:
        url: For example ``softmotion+modbus-tcp://192.168.0.2:502``.
        timeout_s: Longest wait for the connection, and for each exchange.
        clock: Replaces the machine's clock; a simulator brings its own.
        password: Of the user whom an OPC UA URL names.
        stopping: Whether this is for a stop: then no date of a certificate holds it back.

    Raises:
        ConfigError: The URL is wrong, nothing knows its scheme, or an OPC UA server is not the one
            whose certificate was compared.
        ConnectError: No connection could be made, or nobody answers.
        LoginRefusedError: An OPC UA server does not let its user in.
        TransportBrokenError: The bus or the line failed meanwhile.
        RemoteProtocolError: What answers makes no sense.

    Example:
        >>> from robolink.transport import open_mailbox_link
        >>> link = open_mailbox_link("softmotion+sim://mailbox-link-example", timeout_s=1)
        >>> link.read_head().heartbeat >= 0
        True
        >>> link.close()
    """
    link = parse_url(url) if isinstance(url, str) else url
    login = {"password": password, "stopping": stopping} if link.medium in _NODE_MEDIA else {}
    opener = _find(link, _MAILBOX_MEDIA)
    opened: MailboxLink = opener(link, timeout_s=timeout_s, clock=clock, **login)
    if link.medium in _MAILBOX_MEDIA:
        return opened  # its bytes are traced
    from robolink.transport.word_traffic import WordTraffic

    return WordTraffic(opened)


def open_modbus(
    url: str | LinkUrl, *, timeout_s: float = 3.0, clock: Clock | None = None
) -> "ModbusClient":
    """Open a client for the registers and coils of a Modbus server.

    Args:
        url: For example ``plc+modbus-tcp://192.168.0.2:502?unit=1``.
        timeout_s: Longest wait for the connection, and for each answer.
        clock: Replaces the machine's clock.

    Raises:
        ConfigError: The URL is wrong, or nothing knows its scheme.
        ConnectError: No connection could be made, or nobody answers.
        RemoteProtocolError: What answers is no Modbus.

    Example:
        >>> from pathlib import Path
        >>> from robolink.register_maps import load_map
        >>> from robolink.transport import open_modbus
        >>> from robolink_simulators.plc import PlcSimulator, serve_plc
        >>> from robolink_simulators.testkit.operator import written_map
        >>> path = written_map(Path.cwd())
        >>> with serve_plc(PlcSimulator(load_map(path), seed=1), path) as host:
        ...     client = open_modbus(host.url.partition("&map")[0], timeout_s=1)
        ...     len(client.read_holding(100, 4))
        ...     client.close()
        4
    """
    link = parse_url(url) if isinstance(url, str) else url
    opened: ModbusClient = _find(link, _REGISTER_MEDIA)(link, timeout_s=timeout_s, clock=clock)
    return opened


def open_opcua(
    url: str | LinkUrl,
    *,
    timeout_s: float = 3.0,
    clock: Clock | None = None,
    password: "Secret | None" = None,
) -> "OpcuaClient":
    """Open a client for the nodes of an OPC UA server.

    Args:
        url: For example ``plc+opcua://192.168.0.2:4840?security=none``.
        timeout_s: Longest wait for the connection, and for each answer.
        clock: Replaces the machine's clock.
        password: Of the user whom the URL names.

    Raises:
        ConfigError: The URL is wrong, a certificate is missing or another one than was kept, or
            asyncua is not installed.
        ConnectError: No connection could be made.
        LoginRefusedError: The server does not let this user in.
        RejectedError: It refuses the session, or offers less than was asked for.
        TransportError, RemoteProtocolError: It does not answer, or not in OPC UA.

    Example:
        >>> from robolink.transport import open_opcua
        >>> from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
        >>> from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
        >>> with serve_opcua(SoftMotionSimulator(seed=1)) as host:
        ...     client = open_opcua(host.url)
        ...     client.describe("/DeviceSet/*/*/*/*/*/command").type_name
        ...     client.close()
        'UInt16[64]'
    """
    link = parse_url(url) if isinstance(url, str) else url
    opener = _find(link, _NODE_MEDIA)
    opened: OpcuaClient = opener(link, timeout_s=timeout_s, clock=clock, password=password)
    return opened


def _find(link: LinkUrl, media: Mapping[str, tuple[str, str]]) -> Callable[..., Any]:
    if link.medium in media:
        module, name = media[link.medium]
        return cast(Callable[..., Any], getattr(import_module(module), name))
    if link.scheme not in _loaded:
        _loaded[link.scheme] = _load(link, media)
    return _loaded[link.scheme]


def _load(link: LinkUrl, media: Mapping[str, tuple[str, str]]) -> Callable[..., Any]:
    try:
        found = find_plug_in(TRANSPORTS_GROUP, link.scheme)
    except PlugInError as error:
        raise ConfigError(
            tr(
                "The part that connects to {kind!r} cannot be loaded: {cause}.",
                kind=link.scheme,
                cause=error,
            ),
            remedy=tr("Reinstall robolink, or the package that provides this scheme."),
        ) from error.origin
    if found is None:
        from importlib import metadata  # slower to import than the rest of this package

        known = {f"{link.kind}+{medium}" for medium in media}
        known |= metadata.entry_points(group=TRANSPORTS_GROUP).names
        raise ConfigError(
            tr("robolink has no connection of the kind {scheme!r}.", scheme=link.scheme),
            remedy=known_names(sorted(known), link.scheme),
        )
    return cast(Callable[..., Any], found)
