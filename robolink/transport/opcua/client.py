"""Reads and writes nodes of one OPC UA server, whole, as ordinary calls.

Nothing is sent twice, and no connection is renewed by itself
(docs/decisions/0004-no-silent-retry.md). A node's own type is read first; each value that is read
or written is held against it. Values are written without timestamps, because some servers refuse
those, and whole, because some servers answer an index range by replacing the whole array.

Source: OPC 10000-4, 5.10 (read, write); docs/reference/mailbox.md.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final

from asyncua import ua

from robolink import runtime
from robolink.errors import Concerning, ConfigError, RejectedError
from robolink.messages import tr
from robolink.timing import Clock, Deadline
from robolink.transport.opcua import errors as errors
from robolink.transport.opcua.address_space import AddressSpace, NodeFacts, local, node_id
from robolink.transport.opcua.channel import status_of
from robolink.transport.opcua.session import OpcuaSession
from robolink.transport.opcua.structures import STRUCTURE
from robolink.transport.opcua.values import shape
from robolink.transport.traffic import Traffic

_READS: Final = 3
"""Most answers to a read that finds parts of two moments."""


class OpcuaClient:
    """Reads and writes the nodes of one server. Thread-safe: one exchange at a time.

    Args:
        session: Activated; owned by the client.
        identity: Names the far end: the URL without what does not identify it.
        clock: Keeps the deadlines.
        timeout_s: Longest time for one exchange.
        secured: Whether all is signed and encrypted, to a server whose certificate was compared.
        may_write: Whether this connection may write anything but a stop.
        traffic: Told what is read and written.

    Each method that asks the server raises:
        ConfigError: The node or the value makes no sense; nothing was asked.
        RejectedError: The server refused; it did nothing.
        TransportTimeoutError: No answer in time. A write may have been done.
        TransportBrokenError, TransportClosedError: The link has ended.
        RemoteProtocolError: The answer makes no sense, a node is not what it was, or the server
            leaves open what was done.
    """

    def __init__(
        self,
        session: OpcuaSession,
        *,
        identity: str,
        clock: Clock,
        timeout_s: float,
        secured: bool,
        may_write: bool,
        traffic: Traffic,
    ) -> None:
        self.identity, self.clock = identity, clock
        self.secured, self.may_write = secured, may_write
        self._session = session
        self._timeout_s = timeout_s
        self._traffic = traffic
        self._lock = runtime.lock()
        self._facts: dict[str, NodeFacts] = {}
        self._space = AddressSpace(session, identity)

    @property
    def place(self) -> str:
        """The address that answers, and its port."""
        return self._session.place

    def describe(self, node: str) -> NodeFacts:
        """Return what the server says of a node; it is asked once."""
        known = self._facts.get(node)
        if known is not None:
            return known
        with self._exchange() as deadline:
            (facts,) = self._space.described([self._space.resolved(node, deadline)], deadline)
            self._facts[node] = facts = replace(facts, node=node)
        return facts

    def find(self, path: str) -> tuple[NodeFacts, ...]:
        """Return the nodes at a way from Objects, of whose steps some may be ``*``."""
        with self._exchange() as deadline:
            return self._space.described(self._space.at(path, deadline), deadline)

    def browse(self, node: str | None = None, *, most: int = 1000) -> tuple[NodeFacts, ...]:
        """Return the nodes below ``node``, or below Objects, in the server's order.

        Args:
            node: Whose children.
            most: How many; there may be more where so many are returned.
        """
        with self._exchange() as deadline:
            above = ua.NodeId(ua.ObjectIds.ObjectsFolder)
            if node is not None:
                above = self._space.resolved(node, deadline)
            below = [reference.NodeId for reference in self._space.below(above, deadline, most)]
            found = self._space.described([local(one) for one in below], deadline, gaps=True)
            for one in found:  # what was checked here is what each value is held against
                if one.readable:  # else it is asked again, and says why
                    self._facts.setdefault(one.id, one)
            return found

    def read(
        self, nodes: Sequence[str], *, whole: Callable[[Any], bool] | None = None
    ) -> tuple[Any, ...]:
        """Return the values of nodes, asked for in one request, fresh from the PLC.

        A server may have read them at different instants. An array is a list, a structure a
        dictionary by field.

        Args:
            nodes: Which.
            whole: Tells a value of one moment from a torn one, after which all are read again, at
                most three times in all within the one deadline.

        Raises:
            RemoteProtocolError: A value was torn each time; as for each exchange.
        """
        facts = [self.describe(node) for node in nodes]
        request = ua.ReadRequest()
        request.Parameters.MaxAge = 0
        request.Parameters.TimestampsToReturn = ua.TimestampsToReturn.Neither
        request.Parameters.NodesToRead = [
            ua.ReadValueId(NodeId=node_id(one.id), AttributeId=ua.AttributeIds.Value)
            for one in facts
        ]
        told = errors.read_of(", ".join(nodes))
        with self._exchange() as deadline:
            for _ in range(_READS):
                found = self._space.ask(request, ua.ReadResponse, deadline, told, len(nodes))
                values = tuple(map(self._value, facts, found))
                for one, value in zip(facts, values, strict=True):
                    self._tell(self._traffic.received, one, value, told)
                if whole is None or all(map(whole, values)):
                    return values
            raise errors.torn(self.identity, told, _READS)

    def require_writable(self, node: str, *, stop: bool = False) -> NodeFacts:
        """Return what the server says of a node, or raise what :meth:`write` would."""
        if not stop:
            self._require_may_write()
        facts = self.describe(node)
        if not facts.writable:
            raise RejectedError(
                tr("{node} of {identity} cannot be written.", node=node, identity=self.identity),
                remedy=tr("Publish it for writing in the PLC, and let this user write it."),
                controller=self.identity,
            )
        return facts

    def write(self, node: str, value: object) -> None:
        """Write the whole value of one node, in the node's own type, once."""
        self.write_in_turn([(node, value)])

    def write_in_turn(
        self,
        values: Sequence[tuple[str, object]],
        *,
        stop: bool = False,
        admit: Callable[[], None] = lambda: None,
    ) -> None:
        """Write whole values, one request after another, within one deadline.

        Args:
            values: Nodes and their values. One that fails ends it: none after it is written.
            stop: Whether they stop a robot: a connection for reading only does that too.
            admit: Asked before the last of them. If it raises, that one is not written, and the
                connection stays: it has to carry a stop.
        """
        requests = [self._write_request(node, value, stop=stop) for node, value in values]
        objection: BaseException | None = None
        with self._exchange() as deadline:
            for (node, value), (facts, request) in zip(values, requests, strict=True):
                if request is requests[-1][1]:
                    try:
                        admit()
                    except BaseException as error:
                        objection = error
                        break
                told = errors.write_of(node)
                self._tell(self._traffic.sent, facts, value, told)
                (status,) = self._space.ask(
                    request, ua.WriteResponse, deadline, told, 1, write=True
                )
                if not status.is_good():
                    raise errors.refused_node(self.identity, node, status_of(status), write=True)
        if objection is not None:
            raise objection

    def _write_request(
        self, node: str, value: object, *, stop: bool
    ) -> tuple[NodeFacts, ua.WriteRequest]:
        facts = self.require_writable(node, stop=stop)
        variant = self._space.variant(facts, value)
        if variant is None:
            raise ConfigError(
                tr(
                    "{node} of {identity} is {type}; {value!r} does not fit.",
                    node=node,
                    identity=self.identity,
                    type=facts.type_name,
                    value=value,
                ),
                remedy=tr("Nothing was written. Check the value and its length."),
                controller=self.identity,
            )
        written = ua.WriteValue(
            NodeId=node_id(facts.id),
            AttributeId=ua.AttributeIds.Value,
            Value=ua.DataValue(variant, StatusCode=None),
        )
        request = ua.WriteRequest()
        request.Parameters.NodesToWrite = [written]
        return facts, request

    def _require_may_write(self) -> None:
        """Refuse a write where nobody is logged in, or nothing is signed and encrypted."""
        if not self.may_write:
            raise ConfigError(
                tr("{identity} is connected for reading only.", identity=self.identity),
                remedy=tr(
                    "Connect signed and encrypted, with a user; or add write_unsecured=yes to the "
                    "URL if everybody in this network may write there."
                ),
                controller=self.identity,
            )

    def close(self) -> None:
        """Close session and connection. Idempotent; any thread may call it at any time."""
        if self._lock.acquire(blocking=False):
            try:
                self._session.end()
            finally:
                self._lock.release()
        else:
            self._session.drop()

    @contextmanager
    def _exchange(self) -> Iterator[Deadline]:
        """Hold the lock and one deadline; after an error that is no refusal, close."""
        with Concerning(self.identity), self._lock:
            try:
                yield Deadline.after(self.clock, self._timeout_s)
            except (RejectedError, ConfigError):
                raise
            except BaseException:
                self._session.drop()
                raise

    def _value(self, facts: NodeFacts, found: ua.DataValue) -> object:
        if found.StatusCode is not None and not found.StatusCode.is_good():
            raise errors.refused_node(
                self.identity, facts.node, status_of(found.StatusCode), write=False
            )
        kind, lengths, fields, value = self._space.taken(facts.id, found.Value)
        if (kind, lengths, fields) != (facts.kind, facts.lengths, facts.fields):
            raise errors.changed_type(
                self.identity, facts.node, facts.type_name, shape(kind, lengths)
            )
        if kind == STRUCTURE and not fields:
            raise RejectedError(
                tr(
                    "{identity} does not define the structure of {node}.",
                    identity=self.identity,
                    node=facts.node,
                ),
                remedy=tr("Let the PLC publish type definitions, or an array instead."),
            )
        return value

    def _tell(
        self, tell: Callable[..., None], facts: NodeFacts, value: object, request: str
    ) -> None:
        data = _as_told(facts, value)
        self._traffic.count += len(data)
        if self._traffic.listened():
            tell(data, request=request)


def _as_told(facts: NodeFacts, value: Any) -> bytes:  # noqa: ANN401 - any value of a node
    """Return a value as it is told to a trace: words as on other links, all else as text."""
    if facts.kind == "UInt16":
        words = value if facts.lengths else [value]
        return b"".join(word.to_bytes(2) for word in words)
    return f"{facts.node}={value}".encode()
