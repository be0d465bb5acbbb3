"""A server of OPC UA inside this process: one whole dialogue, whose answers a test may alter."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from robolink.errors import TransportTimeoutError
from robolink.timing import Deadline
from robolink.transport.byte_stream import link_closed
from robolink.transport.opcua.security import OpcuaSecurity
from robolink.transport.traffic import Traffic
from tests.unit._scripted_can import FakeClock

if TYPE_CHECKING:
    from robolink.transport.opcua.client import OpcuaClient

IDENTITY = "plc+opcua://192.0.2.1:4840"
NODE = "ns=4;s=|var|PLC.Application.GVL.aTool1"
VALUES = [0.5 * number for number in range(6)]

Alter = Callable[[int, bytes], bytes]
"""Given the number of an answer and its bytes, returns what comes instead."""


class ScriptedTransport:
    """Answers each message with the next answer; without one, time passes until the deadline."""

    url = identity = IDENTITY
    place = "192.0.2.1:4840"
    durable = True

    def __init__(self, answers: list[bytes], alter: Alter = lambda number, data: data) -> None:
        self.clock = FakeClock()
        self.sent: list[bytes] = []
        self.closed = False
        self._answers, self._alter = answers, alter
        self.waiting = b""

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:
        self._require_open()
        number = len(self.sent)
        self.sent.append(data)
        if number < len(self._answers):
            self.waiting += self._alter(number, self._answers[number])

    def receive(self, *, deadline: Deadline) -> bytes:
        self._require_open()
        if not self.waiting:
            self.clock.sleep(deadline.remaining_s() + 0.001)
            raise TransportTimeoutError("nothing came")
        data, self.waiting = self.waiting, b""
        return data

    def receive_waiting(self) -> bytes | None:
        self._require_open()
        if not self.waiting:
            return None
        data, self.waiting = self.waiting, b""
        return data

    def wait_readable(self, *, deadline: Deadline) -> bool:
        return bool(self.waiting)

    def close(self) -> None:
        self.closed = True

    def _require_open(self) -> None:
        if self.closed:
            raise link_closed(IDENTITY)


def answered(number: int, answer: Any) -> Any:
    """Return an answer to a message."""
    from asyncua import ua
    from asyncua.common.connection import SecureConnection, TransportLimits
    from asyncua.crypto.security_policies import SecurityPolicyNone
    from asyncua.ua.ua_binary import struct_to_binary

    far = SecureConnection(SecurityPolicyNone(), TransportLimits())
    far.security_token.ChannelId, far.security_token.TokenId = 7, 13
    far._sequence_number = number - 1
    answer.ResponseHeader.RequestHandle = number
    return far.message_to_binary(struct_to_binary(answer), ua.MessageType.SecureMessage, number)


def aborted(number: int) -> bytes:
    """Return the chunk that ends the answer to a message, without an answer."""
    from asyncua import ua
    from asyncua.common.connection import SecureConnection, TransportLimits
    from asyncua.crypto.security_policies import SecurityPolicyNone
    from asyncua.ua.ua_binary import struct_to_binary

    far = SecureConnection(SecurityPolicyNone(), TransportLimits())
    far.security_token.ChannelId, far.security_token.TokenId = 7, 13
    far._sequence_number = number - 1
    why = ua.ErrorMessage(ua.StatusCode(ua.StatusCodes.BadResponseTooLarge), "too large")
    whole = far.message_to_binary(struct_to_binary(why), ua.MessageType.SecureMessage, number)
    return bytes(whole[:3] + b"A" + whole[4:])


def fault(number: int, name: str) -> Any:
    """Return the answer to a message that refuses it whole with a status code."""
    from asyncua import ua

    refusal = ua.ServiceFault()
    refusal.ResponseHeader.ServiceResult = ua.StatusCode(getattr(ua.StatusCodes, name))
    return answered(number, refusal)


def told_error(name: str) -> Any:
    """Return what a server says before it hangs up."""
    from asyncua import ua
    from asyncua.ua.ua_binary import uatcp_to_binary

    message = ua.ErrorMessage(ua.StatusCode(getattr(ua.StatusCodes, name)), "")
    return uatcp_to_binary(ua.MessageType.Error, message)


def dialogue(
    *, session_ms: float = 300_000.0, lifetime_ms: int = 3_600_000, status: str = "Good"
) -> list[bytes]:
    """Return the answers to: hello, channel, session, login, what a node is, a read, a write.

    Args:
        session_ms: How long a session without a request is kept.
        lifetime_ms: How long the channel's keys hold.
        status: Of the write.
    """
    from asyncua import ua
    from asyncua.common.connection import SecureConnection, TransportLimits
    from asyncua.crypto.security_policies import SecurityPolicyNone
    from asyncua.ua.ua_binary import struct_to_binary, uatcp_to_binary

    far = SecureConnection(SecurityPolicyNone(), TransportLimits())
    far.security_token.ChannelId, far.security_token.TokenId = 7, 13
    answers = [uatcp_to_binary(ua.MessageType.Acknowledge, ua.Acknowledge())]

    def add(answer: Any, kind: bytes = ua.MessageType.SecureMessage) -> None:
        number = len(answers)
        answer.ResponseHeader.RequestHandle = number
        answers.append(far.message_to_binary(struct_to_binary(answer), kind, number))

    def values(*given: Any) -> Any:
        results = [ua.DataValue(one) for one in given]
        return ua.ReadResponse(Results=results)

    opened = ua.OpenSecureChannelResponse()
    opened.Parameters.SecurityToken = far.security_token
    opened.Parameters.SecurityToken.RevisedLifetime = lifetime_ms
    add(opened, ua.MessageType.SecureOpen)
    created = ua.CreateSessionResponse()
    created.Parameters.AuthenticationToken = ua.NodeId(99, 1)
    created.Parameters.RevisedSessionTimeout = session_ms
    endpoint = ua.EndpointDescription(
        SecurityMode=ua.MessageSecurityMode.None_, SecurityPolicyUri=SecurityPolicyNone.URI
    )
    endpoint.UserIdentityTokens = [ua.UserTokenPolicy(PolicyId="anonymous")]
    created.Parameters.ServerEndpoints = [endpoint]
    add(created)
    add(ua.ActivateSessionResponse())
    array = ua.Variant(VALUES, ua.VariantType.Double)
    access = ua.Variant(3, ua.VariantType.Byte)
    add(
        values(
            ua.Variant(ua.NodeClass.Variable, ua.VariantType.Int32),
            ua.Variant(ua.QualifiedName("aTool1", 4)),
            ua.Variant(ua.NodeId(ua.ObjectIds.Double)),
            access,
            access,
            array,
        )
    )
    add(values(array))
    add(ua.WriteResponse(Results=[ua.StatusCode(getattr(ua.StatusCodes, status))]))
    return answers


def connected(transport: ScriptedTransport) -> "OpcuaClient":
    """Open a client on a transport."""
    from robolink.transport.opcua.channel import SecureChannel
    from robolink.transport.opcua.client import OpcuaClient
    from robolink.transport.opcua.session import open_session

    clock = transport.clock
    session = open_session(
        lambda policy, deadline: SecureChannel(transport, IDENTITY, policy, "opc.tcp://192.0.2.1"),
        IDENTITY,
        OpcuaSecurity(write_unsecured=True),
        Deadline.after(clock, 3),
    )
    traffic = Traffic(IDENTITY, clock, log=None)
    return OpcuaClient(
        session,
        identity=IDENTITY,
        clock=clock,
        timeout_s=3,
        secured=False,
        may_write=True,
        traffic=traffic,
    )
