"""A secure channel on a TCP connection: one request at a time, each with one deadline.

asyncua makes and takes apart messages and their security; it moves no bytes here. Its own client
is asynchronous, reads the server once a second by itself, renews channels in a task and has hung
for ever when a connection was made again (opcua-asyncio 1660), so connections, deadlines and the
question whose answer an answer is are ours (docs/decisions/0012-modbus-and-canopen-libraries.md).
A channel is renewed within the next request after three quarters of its lifetime. Between requests
nothing is sent.

Source: OPC 10000-6, 6.7 (secure conversation) and 7.1 (connection protocol).
"""

import logging
from typing import Any, Final, TypeVar, cast

from asyncua import ua
from asyncua.common.connection import SecureConnection, TransportLimits
from asyncua.common.utils import Buffer, create_nonce
from asyncua.crypto.security_policies import SecurityPolicy
from asyncua.ua.ua_binary import (
    header_from_binary,
    nodeid_from_binary,
    struct_from_binary,
    struct_to_binary,
    uatcp_to_binary,
)

from robolink.errors import RobolinkError, TransportTimeoutError
from robolink.messages import tr
from robolink.timing import NS_PER_S, Deadline
from robolink.transport.byte_stream import Transport
from robolink.transport.opcua import errors as errors
from robolink.transport.opcua.values import BoundedBuffer

# Without a handler it writes to standard error; here, every failure is an exception.
logging.getLogger("asyncua").addHandler(logging.NullHandler())

_BUFFER: Final = 65_535
"""Largest chunk that is sent or taken, in bytes."""
_LEAST_BUFFER: Final = 8192
"""Smallest chunk that both ends have to take (OPC 10000-6, 7.1.2.3)."""
_MOST_CHUNKS: Final = 256
_MOST_BYTES: Final = _BUFFER * _MOST_CHUNKS
_HEADER_BYTES: Final = 8
_LIFETIME_MS: Final = 3_600_000
_RENEWED_AFTER: Final = 0.75
_NS_PER_MS: Final = 1_000_000

_KINDS: Final = frozenset({b"ACK", b"ERR", b"MSG", b"OPN"})
_ABORTED: Final = b"A"
"""Fourth byte of a chunk after which no more of its message comes (OPC 10000-6, 6.7.3)."""
_FAULT: Final = ua.FourByteNodeId(ua.ObjectIds.ServiceFault_Encoding_DefaultBinary)

_AnswerT = TypeVar("_AnswerT")


def status_of(status: ua.StatusCode) -> errors.ReportedStatus:
    """Return a status code with its name and what it means."""
    return errors.ReportedStatus(status.value, status.name, status.doc)


class SecureChannel:
    """Asks one question at a time; the caller holds a lock.

    After any error but a refusal of the server it cannot be used again: the caller closes it.

    Args:
        transport: Carries the bytes; owned by the channel.
        identity: Names the far end in errors.
        policy: Signs and encrypts.
        endpoint_url: ``opc.tcp://host:port``, as the server is told.

    Attributes:
        authentication_token: Of the session; stands in each request.
        idle_limit_ns: How long nothing may be asked before the server gives the session up.
    """

    def __init__(
        self, transport: Transport, identity: str, policy: SecurityPolicy, endpoint_url: str
    ) -> None:
        self._transport = transport
        self._identity = identity
        self._limits = TransportLimits(_BUFFER, _BUFFER, _MOST_CHUNKS, _MOST_BYTES)
        self._connection = SecureConnection(policy, self._limits)
        self.policy, self.endpoint_url = policy, endpoint_url
        self._buffer = bytearray()
        self._request_id = 0
        self._renewed_ns = self._answered_ns = 0
        self._lifetime_ns = 0
        self.idle_limit_ns = _LIFETIME_MS * _NS_PER_MS
        self.authentication_token = ua.NodeId()

    @property
    def transport(self) -> Transport:
        """What carries its bytes."""
        return self._transport

    def open(self, deadline: Deadline) -> None:
        """Open it: hello, and the first token.

        Raises:
            TransportError, RemoteProtocolError, RejectedError: As :meth:`ask`.
        """
        hello = ua.Hello(
            ReceiveBufferSize=_BUFFER,
            SendBufferSize=_BUFFER,
            MaxMessageSize=_MOST_BYTES,
            MaxChunkCount=_MOST_CHUNKS,
            EndpointUrl=self.endpoint_url,
        )
        self._transport.send(uatcp_to_binary(ua.MessageType.Hello, hello), deadline=deadline)
        kind, raw = self._next(deadline, tr("say hello"))
        if kind != b"ACK":
            raise errors.unintelligible(self._identity, kind.decode("ascii", "replace"), raw)
        acknowledge = self._parsed(ua.Acknowledge, Buffer(raw[_HEADER_BYTES:]))
        takes = acknowledge.ReceiveBufferSize or _BUFFER
        if takes < _LEAST_BUFFER:  # no request would fit into its chunks
            raise errors.unintelligible(self._identity, f"ReceiveBufferSize {takes}", raw)
        self._limits.max_send_buffer = min(_BUFFER, takes)
        self._get_token(ua.SecurityTokenRequestType.Issue, deadline)

    def ask(
        self,
        request: Any,  # noqa: ANN401 - asyncua's requests share no class
        answer: type[_AnswerT],
        deadline: Deadline,
        *,
        told: str,
        write: bool = False,
    ) -> _AnswerT:
        """Send ``request`` once and return its own answer.

        Args:
            request: One of asyncua's.
            answer: Class of the answer.
            deadline: Until when it has to be there, a renewal of the channel included.
            told: What is asked, for errors.
            write: Whether it changes something, so that a refusal has to say that it was not done.

        Raises:
            RejectedError: The server refused the whole request in an answer; it did nothing.
            TransportTimeoutError: No answer in time; it may have been carried out.
            TransportBrokenError, TransportClosedError: The link has ended.
            RemoteProtocolError: What came makes no sense.
        """
        self._notice_end(told)
        if deadline.expired:  # by earlier requests of the same exchange
            raise errors.unanswered(self._identity, told)
        now_ns = self._transport.clock.now_ns()
        age_ns, idle_ns = now_ns - self._renewed_ns, now_ns - self._answered_ns
        if idle_ns > self.idle_limit_ns or age_ns > self._lifetime_ns:
            raise errors.idle_too_long(self._identity, idle_ns / NS_PER_S)
        if age_ns > _RENEWED_AFTER * self._lifetime_ns:
            self._get_token(ua.SecurityTokenRequestType.Renew, deadline)
        body = self._exchange(request, ua.MessageType.SecureMessage, deadline, told)
        answered = self._answer(body, answer, told, write=write)
        self._answered_ns = self._transport.clock.now_ns()
        return answered

    def send_close(self, deadline: Deadline) -> None:
        """Tell the server that the channel ends; it answers nothing to that."""
        self._send(ua.CloseSecureChannelRequest(), ua.MessageType.SecureClose, deadline)

    def close(self) -> None:
        """Close the connection. Idempotent; any thread may call it at any time."""
        self._transport.close()

    def _get_token(self, kind: ua.SecurityTokenRequestType, deadline: Deadline) -> None:
        request = ua.OpenSecureChannelRequest()
        asked = request.Parameters
        asked.RequestType = kind
        asked.SecurityMode = self.policy.Mode
        asked.RequestedLifetime = _LIFETIME_MS
        asked.ClientNonce = create_nonce(self.policy.secure_channel_nonce_length)
        told = tr("open a secure channel")
        body = self._exchange(request, ua.MessageType.SecureOpen, deadline, told)
        given = self._answer(body, ua.OpenSecureChannelResponse, told).Parameters
        self._connection.set_channel(given, kind, asked.ClientNonce)
        if kind is ua.SecurityTokenRequestType.Renew:
            self._connection.revolve_tokens()
        self._renewed_ns = self._answered_ns = self._transport.clock.now_ns()
        self._lifetime_ns = (given.SecurityToken.RevisedLifetime or _LIFETIME_MS) * _NS_PER_MS

    def _exchange(self, request: Any, kind: bytes, deadline: Deadline, told: str) -> Buffer:  # noqa: ANN401 - as above
        self._send(request, kind, deadline)
        chunks, received = 0, 0
        while True:
            came, raw = self._next(deadline, told)
            chunks, received = chunks + 1, received + len(raw)
            if came != kind or chunks > _MOST_CHUNKS or received > _MOST_BYTES:
                raise errors.unintelligible(self._identity, came.decode("ascii"), raw[:256])
            try:
                buffer = Buffer(raw)
                message = self._connection.receive_from_header_and_body(
                    header_from_binary(buffer), buffer
                )
            except Exception as error:  # what a parser raises on bytes from anywhere
                raise errors.unintelligible(self._identity, error, raw[:256]) from error
            if message is None:  # one chunk of several, or the one that ends them without an answer
                if raw[3:4] == _ABORTED:
                    cause = tr("it gave up its answer ({request})", request=told)
                    raise errors.unintelligible(self._identity, cause, raw[:256])
                continue
            if message.request_id() != self._request_id:
                raise errors.unintelligible(self._identity, told, raw[:256])
            return BoundedBuffer(bytes(message.body()))

    def _send(self, request: Any, kind: bytes, deadline: Deadline) -> None:  # noqa: ANN401 - as above
        self._request_id += 1
        header = request.RequestHeader
        header.AuthenticationToken = self.authentication_token
        header.RequestHandle = self._request_id
        header.TimeoutHint = int(deadline.remaining_s() * 1000)
        data = self._connection.message_to_binary(
            struct_to_binary(request), message_type=kind, request_id=self._request_id
        )
        self._transport.send(data, deadline=deadline)

    def _answer(
        self, body: Buffer, answer: type[_AnswerT], told: str, *, write: bool = False
    ) -> _AnswerT:
        try:
            kind = nodeid_from_binary(body.copy())
        except Exception as error:  # as above
            raise errors.unintelligible(self._identity, error) from error
        fault = kind == _FAULT
        parsed: Any = self._parsed(ua.ServiceFault if fault else answer, body)
        if not fault and kind != type(parsed)().TypeId:
            raise errors.unintelligible(self._identity, kind.to_string())
        status = parsed.ResponseHeader.ServiceResult
        if fault or not status.is_good():
            raise errors.refused_service(self._identity, status_of(status), told, write=write)
        if parsed.ResponseHeader.RequestHandle != self._request_id:
            raise errors.unintelligible(self._identity, told)
        return cast(_AnswerT, parsed)

    def _parsed(self, what: type[_AnswerT], data: Buffer) -> _AnswerT:
        try:
            made: _AnswerT = struct_from_binary(what, data)
        except Exception as error:  # as above
            raise errors.unintelligible(self._identity, error, bytes(data)[:256]) from error
        return made

    def _notice_end(self, told: str) -> None:
        """Notice, before anything is sent, what came while idle: the end, or what nobody asked."""
        waiting = self._transport.receive_waiting()
        if waiting is not None:
            self._keep(waiting)
        raw = bytes(self._buffer)
        if raw[:3] == b"ERR":
            raise self._told_error(raw, told)
        if raw:
            raise errors.unintelligible(
                self._identity, raw[:3].decode("ascii", "replace"), raw[:256]
            )

    def _keep(self, data: bytes) -> None:
        if not data:
            raise errors.hung_up(self._identity)
        self._buffer += data

    def _next(self, deadline: Deadline, told: str) -> tuple[bytes, bytes]:
        """Return the kind of the next chunk, and the whole of it."""
        while True:
            kind, size = bytes(self._buffer[:3]), int.from_bytes(self._buffer[4:8], "little")
            if len(self._buffer) >= _HEADER_BYTES:
                if kind not in _KINDS or not _HEADER_BYTES <= size <= _BUFFER:
                    raise errors.unintelligible(
                        self._identity, kind.decode("ascii", "replace"), bytes(self._buffer[:256])
                    )
                if len(self._buffer) >= size:
                    raw = bytes(self._buffer[:size])
                    del self._buffer[:size]
                    if kind == b"ERR":
                        raise self._told_error(raw, told)
                    return kind, raw
            if deadline.expired:  # even if parts keep arriving
                raise errors.unanswered(self._identity, told)
            try:
                self._keep(self._transport.receive(deadline=deadline))
            except TransportTimeoutError as error:
                raise errors.unanswered(self._identity, told) from error

    def _told_error(self, raw: bytes, told: str) -> RobolinkError:
        """Return what an ``ERR`` says, which carries no signature on any channel.

        Anybody in between can send one, so that it refuses only while the channel is opened. Then
        it ends the connection, and leaves open what was done.
        """
        given = self._parsed(ua.ErrorMessage, BoundedBuffer(raw[_HEADER_BYTES:])).Error
        status = status_of(given)
        if self._lifetime_ns:
            return errors.ended(self._identity, status, told)
        return errors.refused_service(self._identity, status, told, write=False)
