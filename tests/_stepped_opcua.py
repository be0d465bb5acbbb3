"""A PLC's OPC UA server in virtual time, without a socket or a thread; our client beside it.

Messages, sessions and nodes are those of the simulator's own server. Its event loop runs only
while a client sends or waits, on the clock that both share, so a run is the same each time and can
be forked in its middle.
"""

import asyncio
import os
import selectors
import weakref
from math import ceil
from typing import Any, Final

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.fieldbus.opcua_certificate import make_certificate
from robolink_simulators.hosting.fieldbus.opcua_server import SymbolServer
from robolink_simulators.hosting.fieldbus.opcua_symbols import MailboxSymbols, PublishedSymbols
from robolink_simulators.hosting.in_process.transport import InProcessTransport
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.plc.symbols import PlcSymbols
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.timing import NS_PER_S, Clock, Deadline
from robolink.transport import LinkUrl, parse_url
from robolink.transport._url import UrlOptions
from robolink.transport.opcua.channel import SecureChannel
from robolink.transport.opcua.client import OpcuaClient
from robolink.transport.opcua.mailbox import OpcuaMailboxLink, _mailbox_nodes
from robolink.transport.opcua.security import OpcuaSecurity, take_security
from robolink.transport.opcua.session import open_session
from robolink.transport.traffic import Traffic

UNSECURED: Final = "security=none&write_unsecured=yes"
"""The options of a URL that leads here."""

_PLACE: Final = ("127.0.0.1", 4840)


class SteppedOpcua:
    """Serves a PLC's mailbox, or the variables of its map.

    See :class:`robolink_simulators.hosting.addresses.WireDevice`.

    Args:
        simulator: The PLC. Its answers have to take time, or nothing passes while a client polls.
        clock: The time of all.
    """

    def __init__(self, simulator: SoftMotionSimulator | PlcSimulator, clock: ManualClock) -> None:
        assert simulator.answer_s
        published: PublishedSymbols
        if isinstance(simulator, PlcSimulator):
            published = PlcSymbols(simulator)
        else:
            published = MailboxSymbols(simulator, clock)
        self._simulator = simulator
        self._clock = clock
        self._loop = _SteppedLoop(clock)
        weakref.finalize(self, self._loop.close)
        time: Any = _SteppedTime(clock)
        listener: Any = _Listener()
        self._server = SymbolServer(
            published, time, make_certificate(_PLACE[0]), {}, failed=_pass_on
        )
        self._loop.run_until_complete(self._server.start(listener))

    def client(
        self, url: LinkUrl, security: OpcuaSecurity, *, timeout_s: float, clock: Clock | None = None
    ) -> OpcuaClient:
        """Stand for :func:`robolink.transport.opcua.opening.open_client`, on the shared clock."""
        del clock
        identity, lock = url.identity, self._simulator.lock

        def dialled(policy: Any, _deadline: Deadline) -> SecureChannel:
            transport = InProcessTransport(url, self, self._clock, lock, durable=True)
            return SecureChannel(transport, identity, policy, f"opc.tcp://{url.place}")

        deadline = Deadline.after(self._clock, timeout_s)
        return OpcuaClient(
            open_session(dialled, identity, security, deadline),
            identity=identity,
            clock=self._clock,
            timeout_s=timeout_s,
            secured=security.secured,
            may_write=security.may_write,
            traffic=Traffic(identity, self._clock),
        )

    def variables(self, address: str, timeout_s: float) -> OpcuaClient:
        """Open a client that neither signs nor encrypts."""
        url = parse_url(f"{address}?{UNSECURED}")
        return self.client(url, take_security(UrlOptions(url)), timeout_s=timeout_s)

    def mailbox(self, address: str, timeout_s: float) -> OpcuaMailboxLink:
        """Open a link to the mailbox, as our own opening does."""
        client = self.variables(address, timeout_s)
        nodes = _mailbox_nodes(client, "")
        return OpcuaMailboxLink(client, nodes, "", lambda again_s: self.mailbox(address, again_s))

    def connect(self, now_ns: int) -> "_Connection":
        """Accept one client."""
        self._simulator.advance(now_ns)
        connection = _Connection(self._loop)
        self._loop.call_soon(connection.begin)
        self._loop.catch_up()
        return connection

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self._simulator.advance(now_ns)
        self._loop.call_soon(self._server.look)
        self._loop.catch_up()

    def next_change(self) -> int | None:
        """Return when the PLC or its server will next do something by itself."""
        changes = (self._simulator.next_change(), self._loop.next_ns())
        return min((one for one in changes if one is not None), default=None)


def _pass_on(error: BaseException) -> None:
    raise error


class _SteppedTime:
    """What :class:`robolink_simulators.cell.clock.ScaledClock` is to a server."""

    def __init__(self, clock: ManualClock) -> None:
        self.now_ns = clock.now_ns

    def exchanged(self) -> None:
        """Do nothing: time passes while clients wait."""

    def stepped(self, _seconds: float) -> bool:
        return False

    def real_seconds(self, until_ns: int) -> float:
        return max(0, until_ns - self.now_ns()) / NS_PER_S


class _Listener:
    def getsockname(self) -> tuple[str, int]:
        return _PLACE


class _SteppedLoop(asyncio.SelectorEventLoop):
    """Runs what is due and returns. Nothing of it is in the kernel, which a fork would share."""

    def __init__(self, clock: ManualClock) -> None:
        super().__init__(selectors.SelectSelector())
        self._virtual = clock
        self.make_protocol: Any = None
        self.set_exception_handler(lambda *_told: None)  # tasks that are left when it is closed

    def time(self) -> float:
        return self._virtual.now_ns() / NS_PER_S

    def _make_self_pipe(self) -> None:
        self._ssock = self._csock = None  # no other thread wakes it

    def _close_self_pipe(self) -> None:
        pass

    async def create_server(self, *where: Any, **_named: Any) -> Any:
        (self.make_protocol,) = where

    def next_ns(self) -> int | None:
        timers: Any = self._scheduled  # type: ignore[attr-defined]
        return ceil(timers[0].when() * NS_PER_S) if timers else None

    def catch_up(self) -> None:
        """Do all that can be done now."""
        while True:
            self.call_soon(self.stop)
            _running.append(self)
            try:
                self.run_forever()
            finally:
                _running.pop()
            due = self.next_ns()
            waiting = due is not None and due <= self._virtual.now_ns()
            if not (self._ready or waiting):  # type: ignore[attr-defined]
                return


_running: list[_SteppedLoop] = []


def _go_on_in_child() -> None:
    """Go on in a process that was forked by something that a loop does: to asyncio none runs."""
    if _running:
        asyncio._set_running_loop(_running[-1])


os.register_at_fork(after_in_child=_go_on_in_child)


class _Connection:
    """One client's connection, and the server's transport of it."""

    def __init__(self, loop: _SteppedLoop) -> None:
        self._loop = loop
        self._leaving = b""
        self.closed = False
        self.reset = False

    def begin(self) -> None:
        self._protocol = self._loop.make_protocol()
        self._protocol.connection_made(self)

    def receive(self, data: bytes, _now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that the client is gone."""
        if not data:
            self.close()
        elif not self.closed:
            self._loop.call_soon(self._protocol.data_received, data)
        self._loop.catch_up()

    def outgoing(self) -> bytes:
        taken, self._leaving = self._leaving, b""
        return taken

    # The server's side, as asyncio.Transport has it.

    def get_extra_info(self, name: str) -> Any:
        return self if name == "socket" else ("client", 0)

    def setsockopt(self, *_linger: object) -> None:
        """Do nothing: an abort is a reset here."""

    def is_closing(self) -> bool:
        return self.closed

    def write(self, data: bytes) -> None:
        self._leaving += data

    def abort(self) -> None:
        self.reset = not self.closed
        self.close()

    def close(self) -> None:
        if not self.closed:
            self.closed = True
            self._loop.call_soon(self._protocol.connection_lost, None)
