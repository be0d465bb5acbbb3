"""Serves a simulated PLC as an OPC UA server."""

import asyncio
import socket
import threading
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from robolink.errors import ConfigError
from robolink.interrupts import ClosedAtExit
from robolink.messages import tr
from robolink.model import Secret
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.device.hosted import HostedDevice
from robolink_simulators.hosting.fieldbus.opcua_symbols import MailboxSymbols, PublishedSymbols
from robolink_simulators.hosting.streams.tcp_host import listening
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

if TYPE_CHECKING:
    from robolink_simulators.hosting.fieldbus.opcua_server import SymbolServer

UNSECURED: Final[Mapping[str, str]] = {"security": "none", "write_unsecured": "yes"}
"""Options of the URL of a client that neither signs nor encrypts, and writes all the same."""


class OpcuaHost(ClosedAtExit):
    """An OPC UA server before a simulated PLC, in a thread of its own; a context manager.

    Args:
        simulator: The PLC.
        published: Its variables.
        scheme: Of the URLs that lead here.
        address: Host and port to bind to.
        clock: The simulated time.
        users: Passwords by name; none lets everybody in, without a name.
        expired: Whether its certificate ended yesterday.
        options: What every client must be told besides.
        allow_remote: Whether an address that other machines can reach is taken.

    Attributes:
        url: Where a client connects to without security, on this computer.
        secured_url: Where it connects to with security, with the certificate that it must find.
            Where no user is named it has the word by which a client writes without one.
        fingerprint: SHA-256 of that certificate.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off; or asyncua is missing.
        ConnectError: The port is taken, or the address is not this machine's.
    """

    def __init__(
        self,
        simulator: HostedDevice,
        published: PublishedSymbols,
        scheme: str,
        address: tuple[str, int],
        clock: ScaledClock,
        *,
        users: Mapping[str, Secret] | None = None,
        expired: bool = False,
        options: Mapping[str, str] | None = None,
        allow_remote: bool = False,
    ) -> None:
        certificates, servers = _asyncua()
        listener = listening(address, allow_remote=allow_remote)
        host, port = listener.getsockname()[:2]
        certificate = certificates.make_certificate(host, expired=expired)
        self.fingerprint: str = certificate.fingerprint
        place = f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"
        user = {"user": next(iter(users))} if users else {}
        told = {**(options or {}), **user}
        self.url = f"{place}?{urlencode({**told, **UNSECURED}, safe='/:')}"
        pinned = {"server_certificate": self.fingerprint}
        if not users:  # nobody has a name here, and a client without one writes only if it is told
            pinned["write_unsecured"] = "yes"
        self.secured_url = f"{place}?{urlencode({**told, **pinned}, safe='/:')}"
        self._simulator = simulator
        self._server: SymbolServer = servers.SymbolServer(
            published, clock, certificate, users or {}, failed=self._fail
        )
        self._woken = False
        self._closed = False
        self._loop = asyncio.new_event_loop()
        self._end: asyncio.Future[None] = self._loop.create_future()
        self._failure: BaseException | None = None
        started = threading.Event()
        self._thread = threading.Thread(
            target=self._run, args=(listener, started), name="opcua host", daemon=True
        )
        self._thread.start()
        started.wait()
        if self._failure is not None:
            self._thread.join()
            listener.close()
            raise self._failure
        simulator.keep_time(clock)
        simulator.watchers.append(self.wake)
        simulator.url = simulator.url or self.url

    @property
    def urls(self) -> dict[str, str]:
        """Where clients connect to, by link: signed and encrypted, and without."""
        return {"opcua": self.secured_url, "opcua-unsecured": self.url}

    def wake(self) -> None:
        """Let the PLC be checked again; any thread may call it."""
        if not (self._woken or self._closed):
            self._woken = True
            self._loop.call_soon_threadsafe(self._look)

    def close(self) -> None:
        """Stop serving. Idempotent."""
        if self._closed:
            return
        self._closed = True
        self._simulator.watchers.remove(self.wake)
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._finish)
        self._thread.join()
        if self._simulator.url == self.url:
            self._simulator.url = ""

    def _look(self) -> None:
        self._woken = False
        self._server.look()

    def _finish(self) -> None:
        if not self._end.done():
            self._end.set_result(None)

    def _fail(self, error: BaseException) -> None:
        """Report what the device raised, and serve it no more; in the thread of the loop."""
        details = (type(error), error, error.__traceback__, self._thread)
        threading.excepthook(threading.ExceptHookArgs(details))
        self._finish()

    def _run(self, listener: socket.socket, started: threading.Event) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._live(listener, started))

    async def _live(self, listener: socket.socket, started: threading.Event) -> None:
        try:
            await self._server.start(listener)
        except BaseException as error:
            self._failure = error
            return
        finally:
            started.set()
        await self._end
        await self._server.stop()


def serve_opcua(
    simulator: SoftMotionSimulator,
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    clock: ScaledClock | None = None,
    users: Mapping[str, Secret] | None = None,
    expired: bool = False,
    allow_remote: bool = False,
) -> OpcuaHost:
    """Serve the mailbox of a PLC over OPC UA.

    Args:
        simulator: The PLC.
        host: Address to bind to.
        port: Port, 0 for a free one.
        clock: The simulated time; real time by default.
        users: Passwords by name; none lets everybody in, without a name.
        expired: Whether its certificate ended yesterday.
        allow_remote: Whether an address that other machines can reach is taken.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off; or asyncua is missing.
        ConnectError: The port is taken, or the address is not this machine's.
    """
    clock = clock or ScaledClock()
    return OpcuaHost(
        simulator,
        MailboxSymbols(simulator, clock),
        "softmotion+opcua",
        (host, port),
        clock,
        users=users,
        expired=expired,
        allow_remote=allow_remote,
    )


def _asyncua() -> tuple[Any, Any]:
    """Return the modules that need asyncua, and what it brings.

    Raises:
        ConfigError: It is not installed.
    """
    try:
        from robolink_simulators.hosting.fieldbus import opcua_certificate, opcua_server
    except ImportError as error:
        raise ConfigError(
            tr("OPC UA takes the package asyncua, which is missing: {cause}.", cause=error),
            remedy=tr("Install it: pip install 'robolink[opcua]'."),
        ) from error
    return opcua_certificate, opcua_server
