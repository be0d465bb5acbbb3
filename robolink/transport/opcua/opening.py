"""From a URL to an OPC UA client."""

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.package_log import PackageLog
from robolink.timing import Clock, Deadline, SystemClock
from robolink.transport._url import LinkUrl, UrlOptions
from robolink.transport.opcua.security import (
    NO_SECURITY,
    OpcuaSecurity,
    completed,
    take_security,
)
from robolink.transport.tcp import TcpTransport, dial
from robolink.transport.traffic import Traffic

if TYPE_CHECKING:
    from asyncua.crypto.security_policies import SecurityPolicy

    from robolink.model import Secret
    from robolink.transport.opcua.client import OpcuaClient
    from robolink.transport.opcua.server_certificate import OfferedCertificate
    from robolink.transport.opcua.session import ChannelOpener

_LOG: Final = PackageLog(__package__)
_PORT: Final = 4840


def open_opcua(
    url: LinkUrl,
    *,
    timeout_s: float = 3.0,
    clock: Clock | None = None,
    password: "Secret | None" = None,
    stopping: bool = False,
) -> "OpcuaClient":
    """Open a client for ``KIND+opcua://host:4840``.

    Args:
        url: A path is part of the server's endpoint. Options are those of
            :func:`~robolink.transport.opcua.security.take_security`.
        timeout_s: Longest wait for the connection, and for each exchange.
        clock: Keeps the deadlines.
        password: Of the user whom the URL names.
        stopping: Whether this is for a stop, which no date of a certificate holds back.

    Raises:
        ConfigError: The URL or an option is wrong, a certificate is missing, has ended or is
            another one than was kept, or asyncua is not installed.
        ConnectError: No connection could be made.
        LoginRefusedError: The server does not let this user in.
        RejectedError: It refuses the session, or offers less than was asked for.
        TransportError, RemoteProtocolError: The server does not answer, or not in OPC UA.
    """
    options = UrlOptions(url)
    asked = take_security(options)
    options.finish()
    security = completed(asked, password, url.identity, stopping=stopping)
    return open_client(url, security, timeout_s=timeout_s, clock=clock)


def open_client(
    url: LinkUrl, security: OpcuaSecurity, *, timeout_s: float, clock: Clock | None = None
) -> "OpcuaClient":
    """Open a client; options of ``url`` have been taken, and ``security`` is complete.

    See :func:`open_opcua`.
    """
    clock = clock or SystemClock()
    server, dialled = _dialler(url, timeout_s, clock)
    from robolink.transport.opcua.client import OpcuaClient
    from robolink.transport.opcua.session import open_session

    deadline = Deadline.after(clock, timeout_s)
    session = open_session(dialled, server.identity, security, deadline)
    return OpcuaClient(
        session,
        identity=server.identity,
        clock=clock,
        timeout_s=timeout_s,
        secured=security.secured,
        may_write=security.may_write,
        traffic=Traffic(server.identity, clock, log=_LOG),
    )


def ask_certificate(url: LinkUrl, *, timeout_s: float = 3.0) -> "OfferedCertificate":
    """Return the certificate with which a server offers what ``url`` asks for.

    For a person who compares it: nobody logs in, and whoever answers may be anybody.

    Args:
        url: As of a controller; its option ``security`` counts.
        timeout_s: Longest wait.

    Raises:
        ConfigError: The URL is wrong or asks for no security, or asyncua is not installed.
        ConnectError: No connection could be made.
        RejectedError: The server offers less than was asked for.
        TransportError, RemoteProtocolError: It does not answer, or not in OPC UA.
    """
    security = take_security(UrlOptions(url))
    if security.policy == NO_SECURITY:
        raise ConfigError(
            tr("With security=none no certificate is compared."),
            remedy=tr("Leave security=none out of the URL."),
        )
    clock = SystemClock()
    server, dialled = _dialler(url, timeout_s, clock)
    from robolink.transport.opcua.server_certificate import read_server_certificate
    from robolink.transport.opcua.session import offered_certificate

    deadline = Deadline.after(clock, timeout_s)
    der = offered_certificate(dialled, server.identity, security, deadline)
    return read_server_certificate(der, server.identity)


def _dialler(url: LinkUrl, timeout_s: float, clock: Clock) -> "tuple[LinkUrl, ChannelOpener]":
    """Return the server of a URL, and what dials it.

    Raises:
        ConfigError: The URL names no host, or asyncua is not installed.
    """
    if not url.host:
        raise ConfigError(
            tr("{identity} names no host.", identity=url.identity),
            remedy=tr("Write for example {scheme}://192.168.0.2:4840.", scheme=url.scheme),
        )
    require_asyncua()
    from robolink.transport.opcua.channel import SecureChannel

    server = replace(url, port=url.port or _PORT, options={})
    reached = replace(server, path="")
    endpoint_url = f"opc.tcp://{server.place}"

    def dialled(policy: "SecurityPolicy", deadline: Deadline) -> SecureChannel:
        connection = dial(reached, timeout_s=timeout_s, deadline=deadline)
        transport = TcpTransport(connection, reached, clock)
        return SecureChannel(transport, server.identity, policy, endpoint_url)

    return server, dialled


def require_asyncua() -> None:
    """Refuse a connection for which a package is missing.

    Raises:
        ConfigError: asyncua, or one that it needs, is not installed.
    """
    try:
        import asyncua  # noqa: F401 - the first import of it, which names what is missing
    except ImportError as error:
        raise ConfigError(
            tr("OPC UA takes the package asyncua, which is missing: {cause}.", cause=error),
            remedy=tr("Install it: pip install 'robolink[opcua]'."),
        ) from error
