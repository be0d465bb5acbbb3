"""The OPC UA server in front of a PLC's variables.

asyncua keeps the address space and speaks the protocol. What it would do with a value is done
here instead: reads come from the memory of the PLC at the moment of the request, writes go there,
and answers leave when the plan of faults says. Everything runs in one event loop, which the host
owns.
"""

import asyncio
import logging
import socket
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any, Final

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession
from asyncua.server.server import Server
from asyncua.server.user_managers import UserManager
from asyncua.ua.ua_binary import uatcp_to_binary

from robolink.model import Secret
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import Departure
from robolink_simulators.hosting.fieldbus.opcua_certificate import ServerCertificate
from robolink_simulators.hosting.fieldbus.opcua_connections import (
    LOOK_S,
    PlannedProcessor,
    PlannedWire,
    SymbolListener,
)
from robolink_simulators.hosting.fieldbus.opcua_nodes import SAMPLE_S, OwnNodes, SymbolTree, Views
from robolink_simulators.hosting.fieldbus.opcua_symbols import (
    PublishedSymbols,
    ServedSymbols,
    Symbol,
    SymbolValue,
)
from robolink_simulators.hosting.fieldbus.opcua_tearing import place_in, torn_answer

logging.getLogger("asyncua").addHandler(logging.NullHandler())
logging.getLogger("asyncua").propagate = False  # it reports each refused login as a warning

MOST_NODES: Final = 100
"""Most nodes that one request may name: ``MaxNodesPerRead`` of CODESYS (documented)."""

_POLICIES: Final = (
    ua.SecurityPolicyType.NoSecurity,
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
)
_VALUE: Final = ua.AttributeIds.Value
_REFUSED: Final = {
    "OUT_OF_SERVICE": "BadOutOfService",
    "READ_ONLY": "BadNotWritable",
    "WRONG_TYPE": "BadTypeMismatch",
}
"""Status of each variable of a write that meets such a fault."""

_OTHER_KINDS: Final = {"Double": "Float", "Float": "Double", "UInt16": "Int32", "Boolean": "Byte"}
"""What a variable turns into whose type was changed; others turn into LINT."""


class _Users(UserManager):
    """Lets in whoever has a password here; everybody where no user was named."""

    def __init__(self, passwords: Mapping[str, Secret]) -> None:
        self._passwords = passwords

    def get_user(
        self,
        iserver: InternalServer,  # noqa: ARG002 - as asyncua declares it
        username: str | None = None,
        password: str | None = None,
        certificate: Any = None,  # noqa: ANN401, ARG002 - as asyncua declares it
    ) -> User | None:
        """Return the user, ``None`` for a stranger."""
        known = self._passwords.get(username or "")
        if self._passwords and (known is None or known.reveal() != password):
            return None
        return User(role=UserRole.User, name=username)


class _Session(InternalSession):
    """Reads and writes the variables in the PLC's memory; everything else as asyncua does it."""

    wire: PlannedWire

    @property
    def _server(self) -> "SymbolServer":
        server: SymbolServer = self.iserver.server
        return server

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        """Read attributes; those that are values of variables in one exchange."""
        asked = params.NodesToRead
        _require_few(asked)
        server = self._server
        symbols = {
            place: symbol
            for place, node in enumerate(asked)
            if node.AttributeId == _VALUE and (symbol := server.symbol(node.NodeId)) is not None
        }
        whole = {place: one for place, one in symbols.items() if not asked[place].IndexRange}
        found = await server.read(self, tuple(whole.values())) if whole else ()
        values = dict(zip(whole, found, strict=True))
        return [
            values[place]
            if place in values
            else _bad_value("BadIndexRangeInvalid")
            if place in symbols
            else self.aspace.read_attribute_value(node.NodeId, node.AttributeId)
            for place, node in enumerate(asked)
        ]

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Write variables in one exchange, all that may be written; nothing else can be."""
        asked = params.NodesToWrite
        _require_few(asked)
        objections = [self._server.objection(node) for node in asked]
        taken = [node for node, why in zip(asked, objections, strict=True) if why is None]
        refused = [node for node, why in zip(asked, objections, strict=True) if why is not None]
        self._server.note_refused(refused)
        told = iter(await self._server.write(self, taken) if taken else ())
        return [_status(next(told) if why is None else why) for why in objections]

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Watch nodes; variables are sampled from now on."""
        created: list[ua.MonitoredItemCreateResult] = await super().create_monitored_items(params)
        self._server.sample()
        return created


def _require_few(nodes: Sequence[object]) -> None:
    if len(nodes) > MOST_NODES:
        raise ServiceError(ua.StatusCodes.BadTooManyOperations)


class _Internal(InternalServer):
    """Knows its standard nodes at once, and makes sessions of our kind."""

    def __init__(self, server: "SymbolServer", users: Mapping[str, Secret]) -> None:
        super().__init__(user_manager=_Users(users))
        self.server = server
        self.disabled_clock = True  # the time is told when it is asked for

    async def load_standard_address_space(self, shelf_file: Any = None) -> None:  # noqa: ANN401, ARG002 - asyncua's
        """Take those that all servers of this process share."""
        self.aspace._nodes = OwnNodes()  # noqa: SLF001 - asyncua has no other way
        self.view_service = Views(self.aspace)

    def create_session(
        self,
        name: str,
        user: User = User(role=UserRole.Anonymous),  # noqa: B008 - as asyncua declares it
        external: bool = False,
    ) -> InternalSession:
        """Make a session."""
        return _Session(
            self, self.aspace, self.subscription_service, name, user=user, external=external
        )


class SymbolServer:
    """An OPC UA server with the variables of one PLC; all of it runs in one event loop.

    Args:
        published: The variables.
        clock: The simulated time.
        certificate: What it shows.
        users: Passwords by name; none lets everybody in, without a name.
        failed: Told of what a device raises; it is served no more then.
    """

    def __init__(
        self,
        published: PublishedSymbols,
        clock: ScaledClock,
        certificate: ServerCertificate,
        users: Mapping[str, Secret],
        *,
        failed: Callable[[BaseException], None],
    ) -> None:
        self._published = published
        self._clock = clock
        self._certificate = certificate
        self._failed = failed
        self._ends = published.ends
        self._sampler: asyncio.Task[None] | None = None
        self._late: asyncio.Future[ServedSymbols] | None = None
        self._closing: list[asyncio.Future[None]] = []
        self._server = Server(iserver=_Internal(self, users))
        if users:
            self._server.set_identity_tokens([ua.UserNameIdentityToken])
        else:
            self._server.set_identity_tokens([ua.AnonymousIdentityToken])

    def now_ns(self) -> int:
        """Return the simulated time."""
        return self._clock.now_ns()

    def real_seconds(self, until_ns: int) -> float:
        """Return how long it really takes until a simulated instant."""
        return self._clock.real_seconds(until_ns)

    def let_answer_time_pass(self) -> None:
        """Let it pass where time stands still, since nothing else does."""
        if answer_s := self._published.answer_s:
            self._clock.stepped(answer_s)

    async def start(self, listener: socket.socket) -> None:
        """Serve on a socket that listens already."""
        server = self._server
        host, port = listener.getsockname()[:2]
        server.set_endpoint(f"opc.tcp://{f'[{host}]' if ':' in host else host}:{port}")
        server.name = self._published.device
        server.set_security_policy(list(_POLICIES))
        await server.init()
        await server.set_application_uri(self._certificate.application_uri)
        self._tell_time()
        self._tell_limits()
        self._tree = SymbolTree(
            server.iserver.aspace,
            self._published,
            self._certificate.application_uri,
            self._shown,
        )
        await self._show(self._certificate)
        await server.iserver.start()
        server.bserver = SymbolListener(self, listener, server)
        server.bserver.set_policies(server._policies)  # noqa: SLF001
        await server.bserver.start()

    async def stop(self) -> None:
        """End all connections, and listen no more."""
        if self._sampler is not None:
            self._sampler.cancel()
        for transport in list(self._server.iserver.asyncio_transports):
            transport.abort()
        await self._server.stop()

    def symbol(self, number: ua.NodeId) -> Symbol | None:
        """Return the variable of a node, ``None`` for a node that is none."""
        return self._tree.symbols.get(number)

    def look(self) -> None:
        """End connections when the PLC was restarted or its cable pulled; send what is due."""
        seen, self._ends = self._ends, self._published.ends
        for wire in self._wires():
            if seen != self._ends:
                wire.end()
            else:
                wire.pump()
        if seen[0] != self._ends[0]:  # a PLC that has just started knows no session
            sessions = self._server.iserver._external_sessions  # noqa: SLF001 - asyncua has no other way
            self._closing = [
                asyncio.ensure_future(session.close_session(True))
                for session in list(sessions.values())
            ]

    def objection(self, node: ua.WriteValue) -> str | None:
        """Return the status of a write that a variable does not take, ``None`` if it takes it.

        A range of an array is refused: asyncua's own server would replace the whole array by it.
        Timestamps and a status are refused, as field reports say of CODESYS.
        """
        symbol, asked = self.symbol(node.NodeId), node.Value
        if symbol is None:
            known = node.NodeId in self._server.iserver.aspace
            return "BadNotWritable" if known else "BadNodeIdUnknown"
        if node.AttributeId != _VALUE or not symbol.writable:
            return "BadNotWritable"
        if node.IndexRange:
            return "BadIndexRangeInvalid"
        stamped = asked.SourceTimestamp or asked.ServerTimestamp
        if stamped or (asked.StatusCode is not None and asked.StatusCode.value):
            return "BadWriteNotSupported"
        sent = asked.Value
        fits = sent is not None and self._tree.taken(symbol, sent) is not None
        return None if fits else "BadTypeMismatch"

    def note_refused(self, nodes: Sequence[ua.WriteValue]) -> None:
        """Let the wire record have writes that no variable takes: they were sent all the same."""
        for node in nodes:
            symbol = self.symbol(node.NodeId)
            shown = node.NodeId.to_string() if symbol is None else symbol.path
            self._published.note(f"write {shown} (refused)", self.now_ns())

    async def read(self, session: _Session, symbols: Sequence[Symbol]) -> list[ua.DataValue]:
        """Serve a client that reads variables; raise what the plan has for the whole request."""
        served = await self._exchange(
            session, lambda now_ns, counted: self._published.read(symbols, now_ns, counted=counted)
        )
        values = await self._torn(served, symbols)
        self._plan(session.wire, served)
        if not values or served.meets("OUT_OF_SERVICE"):
            return [_bad_value("BadOutOfService")] * len(symbols)
        return [
            self._value_met(symbol, value, partial(served.meets, place=place))
            for place, (symbol, value) in enumerate(zip(symbols, values, strict=True))
        ]

    async def write(self, session: _Session, nodes: Sequence[ua.WriteValue]) -> list[str]:
        """Serve a client that writes variables; return a status for each."""
        values = [
            (symbol, value)
            for node in nodes
            if (symbol := self.symbol(node.NodeId)) is not None
            and (value := self._tree.taken(symbol, node.Value.Value)) is not None
        ]
        served = await self._exchange(
            session, lambda now_ns, counted: self._published.write(values, now_ns, counted=counted)
        )
        await self._torn(served, ())
        self._plan(session.wire, served)
        return [
            next((_REFUSED[name] for name in _REFUSED if served.meets(name, place)), "Good")
            for place in range(len(nodes))
        ]

    def _value_met(
        self, symbol: Symbol, value: SymbolValue, meets: Callable[[str], Any]
    ) -> ua.DataValue:
        """Return a value as the faults of its variable leave it."""
        if meets("WRONG_TYPE"):
            if symbol.fields:
                return _stamped(ua.Variant(0, ua.VariantType.Int64))
            kind = _OTHER_KINDS.get(symbol.kind, "Int64")
            return _stamped(self._tree.variant(symbol, value, kind))
        if (short := meets("SHORT_ARRAY")) and isinstance(value, tuple):
            value = value[: -1 if short.position is None else place_in(short, len(value))]
        return _stamped(self._tree.variant(symbol, value))

    async def _torn(
        self, served: ServedSymbols, symbols: Sequence[Symbol]
    ) -> Sequence[SymbolValue]:
        """Return what was read, with what the plan has come from later; nothing for a write."""
        fault = served.meets("TEAR_NODES") or served.meets("TEAR_ARRAY")
        later = served.values
        if fault is not None and later:
            await self._pass(fault.seconds or self._published.cycle_s)
            later = self._published.peek(symbols, self.now_ns())
        values, waiting = torn_answer(served, later)
        self._published.take_back(waiting)
        return values

    async def _exchange(
        self, session: _Session, serve: Callable[[int, bool], ServedSymbols]
    ) -> ServedSymbols:
        """Let a request be served, at once or after the link has carried nothing for a while."""
        self._clock.exchanged()
        wire = session.wire
        served = self._guarded(lambda: serve(self.now_ns(), False))
        if served.stalled_s is not None:
            ends_ns = self.now_ns() + max(1, round(served.stalled_s * NS_PER_S))
            wire.outbox.stalled_until_ns = ends_ns

            async def late() -> ServedSymbols:
                await self._until(ends_ns)
                return self._guarded(lambda: serve(self.now_ns(), True))

            # What is on its way arrives, even if its sender has left by then.
            self._late = asyncio.ensure_future(late())
            served = await asyncio.shield(self._late)
        if served.meets("EXPIRED_CERTIFICATE"):
            await self._show(self._certificate.expired())
        if served.meets("LOSE_SESSION"):
            await session.close_session(True)
            raise ServiceError(ua.StatusCodes.BadSessionIdInvalid)
        return served

    def _plan(self, wire: PlannedWire, served: ServedSymbols) -> None:
        """Let the next answer leave as planned; nothing else may be sent before it."""
        wire.departures = served.departures if served.answered else None
        wire.silent = not served.answered
        if served.meets("DROP_CHANNEL"):
            planned = served.departures

            def closing(data: bytes) -> Sequence[Departure]:
                (after_s, _), *_ = planned(data) or [(0.0, None)]
                return [(after_s, _closed_channel()), (after_s, None)]

            wire.departures = closing

    def _guarded(self, serve: Callable[[], ServedSymbols]) -> ServedSymbols:
        try:
            return serve()
        except BaseException as error:
            self._failed(error)
            raise

    async def _show(self, certificate: ServerCertificate) -> None:
        """Show another certificate from now on; open channels keep theirs."""
        server = self._server
        server.iserver.certificate = certificate.certificate
        server.iserver.private_key = certificate.key
        server.iserver.endpoints.clear()
        server._policies.clear()  # noqa: SLF001 - the list is the listener's too
        await server._setup_server_nodes()  # noqa: SLF001 - what its start does, but for listening

    async def _pass(self, seconds: float) -> None:
        """Let simulated time pass, on its own or by a step where it stands still."""
        if not self._clock.stepped(seconds):
            await self._until(self.now_ns() + round(seconds * NS_PER_S))

    async def _until(self, until_ns: int) -> None:
        while (left_s := self.real_seconds(until_ns)) > 0:
            await asyncio.sleep(min(LOOK_S, left_s))

    def sample(self) -> None:
        """Look at watched variables again and again, as long as one is watched."""
        if self._sampler is None or self._sampler.done():
            self._sampler = asyncio.create_task(self._sample())

    async def _sample(self) -> None:
        seen: dict[ua.NodeId, SymbolValue] = {}
        while watched := [number for number in self._tree.symbols if self._watchers(number)]:
            symbols = [self._tree.symbols[number] for number in watched]
            values = self._published.peek(symbols, self.now_ns())
            for number, symbol, value in zip(watched, symbols, values, strict=True):
                if seen.get(number) != value:
                    seen[number] = value
                    for handle, watcher in list(self._watchers(number).items()):
                        await watcher(handle, _stamped(self._tree.variant(symbol, value)))
            await asyncio.sleep(SAMPLE_S)

    def _watchers(self, number: ua.NodeId) -> dict[int, Callable[..., Any]]:
        watched = self._server.iserver.aspace[number].attributes[_VALUE]
        watchers: dict[int, Callable[..., Any]] = watched.datachange_callbacks
        return watchers

    def _wires(self) -> list[PlannedWire]:
        listener = self._server.bserver
        connected = [] if listener is None else [one.processor for one in listener.clients]
        return [one.wire for one in connected if isinstance(one, PlannedProcessor)]

    def _tell_limits(self) -> None:
        space = self._server.iserver.aspace
        for name in ("MaxNodesPerRead", "MaxNodesPerWrite"):
            place = getattr(ua.ObjectIds, f"Server_ServerCapabilities_OperationLimits_{name}")
            value = ua.Variant(MOST_NODES, ua.VariantType.UInt32)
            space[ua.NodeId(place)].attributes[_VALUE].value = ua.DataValue(value)

    def _tell_time(self) -> None:
        """Let the server tell the time when it is asked, instead of writing it every second."""
        status = ua.NodeId(ua.ObjectIds.Server_ServerStatus)
        space = self._server.iserver.aspace
        held = space[status].attributes[_VALUE].value

        def time_now(*_asked: object) -> ua.DataValue:
            return _stamped(ua.Variant(datetime.now(UTC), ua.VariantType.DateTime))

        def status_now(*_asked: object) -> ua.DataValue:
            held.Value.Value.CurrentTime = datetime.now(UTC)
            held.Value.Value.State = ua.ServerState.Running
            return held

        clock = ua.NodeId(ua.ObjectIds.Server_ServerStatus_CurrentTime)
        space.set_attribute_value_callback(clock, _VALUE, time_now)
        space[status].attributes[_VALUE].value_callback = status_now

    def _shown(self, number: ua.NodeId, _attribute: object) -> ua.DataValue:
        symbol = self._tree.symbols[number]
        (value,) = self._published.peek([symbol], self.now_ns())
        return _stamped(self._tree.variant(symbol, value))


def _status(name: str) -> ua.StatusCode:
    return ua.StatusCode(getattr(ua.StatusCodes, name))


def _closed_channel() -> bytes:
    message = ua.ErrorMessage(_status("BadSecureChannelClosed"), "the channel was closed")
    closing: bytes = uatcp_to_binary(ua.MessageType.Error, message)
    return closing


def _stamped(value: ua.Variant) -> ua.DataValue:
    now = datetime.now(UTC)
    return ua.DataValue(value, SourceTimestamp=now, ServerTimestamp=now)


def _bad_value(status: str) -> ua.DataValue:
    return ua.DataValue(StatusCode=_status(status))
