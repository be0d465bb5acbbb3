"""The connections of a simulated OPC UA server: what leaves on them leaves when the plan says."""

import asyncio
import socket
from collections.abc import Callable, Sequence
from typing import Any, Final, Protocol

from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.internal_server import InternalServer
from asyncua.server.server import Server
from asyncua.server.uaprocessor import UaProcessor

from robolink_simulators.faults import Departure
from robolink_simulators.faults.departing import DepartingReplies
from robolink_simulators.hosting.streams.tcp_host import NO_TIME

LOOK_S: Final = 0.05
"""Longest time in seconds until a change of pace is noticed."""


class TimedServer(Protocol):
    """The simulated time of a server, as its connections need it."""

    def now_ns(self) -> int:
        """Return the simulated time."""

    def real_seconds(self, until_ns: int) -> float:
        """Return how long it really takes until a simulated instant."""

    def let_answer_time_pass(self) -> None:
        """Let it pass where time stands still, since nothing else does."""


class PlannedWire:
    """Stands before a transport: what a processor writes leaves when the plan says.

    Args:
        transport: The connection.
        server: Whose.

    Attributes:
        departures: What leaves instead of the next answer; ``None`` for the answer itself.
        silent: Whether the next answer is never made.
        outbox: What is on its way.
    """

    def __init__(self, transport: asyncio.Transport, server: TimedServer) -> None:
        self._transport = transport
        self._server = server
        self._alarm: asyncio.TimerHandle | None = None
        self.departures: Callable[[bytes], Sequence[Departure]] | None = None
        self.silent = False
        self.outbox = DepartingReplies()

    def get_extra_info(self, name: str) -> Any:  # noqa: ANN401 - as asyncio declares it
        """Return what the transport knows."""
        return self._transport.get_extra_info(name)

    def write(self, data: bytes) -> None:
        """Send an answer as planned."""
        planned, self.departures = self.departures, None
        leaving = [(0.0, data)] if planned is None else planned(data)
        self.outbox.depart(leaving, self._server.now_ns())
        if planned is not None:
            self._server.let_answer_time_pass()
        self.pump()

    def pump(self) -> None:
        """Send what is due, and come back for what is not."""
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None
        if self._transport.is_closing():
            return
        now_ns = self._server.now_ns()
        if data := self.outbox.take(now_ns):
            self._transport.write(data)
        if self.outbox.ended(now_ns):
            self.end(reset=self.outbox.reset(now_ns))
        elif (change := self.outbox.next_change(now_ns)) is not None:
            wait_s = min(LOOK_S, self._server.real_seconds(change))
            self._alarm = asyncio.get_running_loop().call_later(wait_s, self.pump)

    def end(self, *, reset: bool = False) -> None:
        """End the connection from the server's side."""
        if reset:  # a linger time of zero resets the connection
            held: socket.socket = self._transport.get_extra_info("socket")
            held.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_TIME)
            self._transport.abort()
        else:
            self._transport.close()


class PlannedProcessor(UaProcessor):
    """Serves one connection."""

    def __init__(
        self,
        server: TimedServer,
        iserver: InternalServer,
        transport: asyncio.Transport,
        limits: Any,  # noqa: ANN401 - asyncua's
    ) -> None:
        self.wire = PlannedWire(transport, server)
        super().__init__(iserver, self.wire, limits)

    async def process(self, header: Any, body: Any) -> Any:  # noqa: ANN401 - asyncua's
        """Take a message, unless the connection carries nothing any more."""
        return True if self.wire.outbox.half_open else await super().process(header, body)

    def send_response(self, requesthandle: Any, *answer: Any, **kind: Any) -> None:  # noqa: ANN401 - asyncua's
        """Make an answer and send it, unless this one is never made."""
        silent, self.wire.silent = self.wire.silent, False
        if not silent:
            super().send_response(requesthandle, *answer, **kind)

    async def process_message(self, seqhdr: Any, body: Any) -> Any:  # noqa: ANN401 - asyncua's
        """Serve a request of a session, which then knows over which wire it came."""
        if self.session is not None:
            self.session.wire = self.wire
        return await super().process_message(seqhdr, body)


class _Connection(OPCUAProtocol):
    """One client."""

    server: TimedServer

    def connection_made(self, transport: Any) -> None:  # noqa: ANN401 - as asyncio declares it
        """Serve it by our processor."""
        super().connection_made(transport)
        if self.transport is not None:
            self.processor = PlannedProcessor(
                self.server, self.iserver, self.transport, self.limits
            )
            self.processor.set_policies(self.policies)


class SymbolListener(BinaryServer):
    """Takes connections on a socket that listens already."""

    def __init__(self, server: TimedServer, listener: socket.socket, asyncuas: Server) -> None:
        super().__init__(asyncuas.iserver, *listener.getsockname()[:2], asyncuas.limits)
        self._symbols = server
        self._listener = listener

    def _make_protocol(self) -> OPCUAProtocol:
        connection = _Connection(
            self.iserver, self._policies, self.clients, self.closing_tasks, self.limits
        )
        connection.server = self._symbols
        return connection

    async def start(self) -> None:
        """Listen."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._make_protocol, sock=self._listener)
        self.cleanup_task = asyncio.create_task(self._close_task_loop())
