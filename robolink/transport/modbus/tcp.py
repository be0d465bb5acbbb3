"""How one Modbus request and its answer pass over TCP."""

from typing import Final

from robolink.errors import TransportTimeoutError
from robolink.timing import Deadline
from robolink.transport.byte_stream import Transport
from robolink.transport.modbus import errors as errors
from robolink.transport.modbus.frames import FrameError, Framing, ModbusReply, ModbusRequest

_MOST_UNASKED_BYTES: Final = 16_384
"""Largest number of unrequested bytes: sixty of the longest frames. Late answers are fewer, because
the link is closed after a time-out. A server that sends more between a request and its answer will
not stop."""


class TcpExchange:
    """Accepts the answer that carries the number of the request; late ones are ignored."""

    recovers: Final = False
    units: Final = range(256)

    def __init__(self, transport: Transport, identity: str, framing: Framing) -> None:
        self._transport = transport
        self._identity = identity
        self._framing = framing
        self._buffer = bytearray()
        self._transaction = 0
        self._unasked = 0

    def takes_s(self, sent_bytes: int, answered_bytes: int) -> float:  # noqa: ARG002 - signature of all exchanges
        """See :meth:`robolink.transport.modbus.client.Exchange.takes_s`."""
        return 0.0

    def ask(self, request: ModbusRequest, deadline: Deadline) -> ModbusReply:
        """See :meth:`robolink.transport.modbus.client.Exchange.ask`."""
        # A connection that the server closed while idle is noticed before anything is sent.
        self._unasked = 0
        waiting = self._transport.receive_waiting()
        if waiting is not None:
            self._keep(waiting, request)
        begun = bool(self._buffer) and self._leave_out_old(request)
        self._transaction = self._transaction % 0xFFFF + 1
        frame = self._framing.pack(request, self._transaction)
        self._transport.send(frame, deadline=deadline)
        if begun:
            self._next(request, deadline)
        while True:
            reply = self._next(request, deadline)
            if reply.transaction != self._transaction:
                continue
            if not request.is_answered_by(reply):
                raise errors.mismatched(self._identity, request)
            return reply

    def _leave_out_old(self, request: ModbusRequest) -> bool:
        """Ignore whole frames that came before the request; return whether one more has begun.

        Each connection numbers from 1, so what a gateway has kept from an earlier one may carry
        the very number (docs/reference/faults.md F03).
        """
        try:
            while self._framing.take(self._buffer) is not None:
                pass
        except FrameError as error:
            raise errors.unintelligible(self._identity, request, error.raw, serial=False) from error
        return bool(self._buffer)

    def _next(self, request: ModbusRequest, deadline: Deadline) -> ModbusReply:
        while True:
            try:
                reply = self._framing.take(self._buffer) if self._buffer else None
            except FrameError as error:
                raise errors.unintelligible(
                    self._identity, request, error.raw, serial=False
                ) from error
            if reply is not None:
                return reply
            if deadline.expired:  # even if frames of other requests keep arriving
                raise errors.unanswered(self._identity, request, bytes(self._buffer), serial=False)
            try:
                self._keep(self._transport.receive(deadline=deadline), request)
            except TransportTimeoutError as error:
                held = bytes(self._buffer)
                raise errors.unanswered(self._identity, request, held, serial=False) from error

    def _keep(self, data: bytes, request: ModbusRequest) -> None:
        """Keep what came; the longest answer is far shorter than what one request accepts.

        Raises:
            TransportBrokenError: It was the end of the stream.
            RemoteProtocolError: It has no end.
        """
        if not data:
            raise errors.hung_up(self._identity)
        self._unasked += len(data)
        if self._unasked > _MOST_UNASKED_BYTES:
            raise errors.flooding(self._identity, request, self._unasked, data)
        self._buffer += data
