"""How one Modbus request and its answer pass on a serial line.

A serial frame carries no number: an answer of the same function and length that comes late
would pass for the next one (docs/reference/faults.md F02). So after anything doubtful,
and when it is opened, a line falls silent, throws away what it holds and asks a question whose
answer no earlier question can have. A server answers in order, so whatever was late has passed
when that answer comes.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from robolink.errors import RemoteProtocolError, TransportTimeoutError
from robolink.timing import NS_PER_S, Deadline
from robolink.transport.byte_stream import Transport
from robolink.transport.modbus import errors as errors
from robolink.transport.modbus.frames import (
    WRITE_COIL,
    Area,
    FrameError,
    Framing,
    ModbusReply,
    ModbusRequest,
)

_AROUND: Final = 3
"""Number of bytes around a PDU: the unit before and the checksum after."""


@dataclass(frozen=True, slots=True)
class RtuLine:
    """The special settings of one serial line.

    Attributes:
        character_s: How long one character takes.
        silence_s: Pause between frames: 3.5 characters, 1.75 ms above 19 200 baud
            (Modbus over serial line 1.02, 2.5.1.1).
        quiet_s: After something doubtful, this long without a byte counts as silent.
        echo: The adapter hears what it sends.
        probe_area: Where the probing question reads.
        probe_address: First address of it.
    """

    character_s: float
    silence_s: float
    quiet_s: float
    echo: bool
    probe_area: Area
    probe_address: int


class RtuExchange:
    """Accepts the first answer that fits, from a unit known to be in step.

    In step is a unit, not the line: units answer in their own time.
    """

    recovers: Final = True
    units: Final = range(1, 248)
    """Units that answer; 0 is a broadcast, which nobody answers."""

    # An answer that comes later than this number of requests is no longer expected.
    _REMEMBERED: Final = 16
    # Lengths not used for anything else on a mailbox, so that each identifies its request.
    _UNUSUAL: Final = range(3, 3 + 2 * (_REMEMBERED + 1), 2)

    # Sixteen of the longest frames: more late answers are not expected.
    _MOST_UNASKED_BYTES: Final = 256 * _REMEMBERED
    # Four of the longest frames in a row without the pause required after each.
    _MOST_WITHOUT_PAUSE: Final = 1024

    def __init__(
        self, transport: Transport, identity: str, line: RtuLine, framing: Framing
    ) -> None:
        self._transport = transport
        self._identity = identity
        self._line = line
        self._framing = framing
        self._buffer = bytearray()
        self._doubts: deque[ModbusRequest] = deque(maxlen=self._REMEMBERED)
        self._in_step: set[int] = set()
        self._quiet_since_ns = transport.clock.now_ns()
        self._unasked = 0

    def takes_s(self, sent_bytes: int, answered_bytes: int) -> float:
        """See :meth:`robolink.transport.modbus.client.Exchange.takes_s`."""
        framed = sent_bytes + answered_bytes + 2 * _AROUND
        return framed * self._line.character_s + 2 * self._line.silence_s

    def ask(self, request: ModbusRequest, deadline: Deadline) -> ModbusReply:
        """See :meth:`robolink.transport.modbus.client.Exchange.ask`."""
        self._unasked = 0
        if request.unit not in self._in_step:
            self._get_in_step(request.unit, deadline)
        reply = self._ask_once(request, deadline)
        while not request.is_answered_by(reply):
            reply = self._next(request, b"", deadline)
        self._settle(request.unit)
        return reply

    def get_in_step(self, unit: int, deadline: Deadline) -> None:
        """Let the line fall silent, then ask ``unit`` a question like no other.

        Raises:
            TransportTimeoutError: The question was not answered.
            RemoteProtocolError: It never fell silent, or what came is no Modbus, or has no end.
        """
        self._unasked = 0
        self._get_in_step(unit, deadline)

    def _get_in_step(self, unit: int, deadline: Deadline) -> None:
        self._fall_silent(deadline)
        probe = self._unlike_all_doubts(unit)
        # A refusal contains no length: it is proof only if no other request can have caused it.
        refusal_is_its_own = probe.function not in {doubt.function for doubt in self._doubts}
        reply = self._ask_once(probe, deadline)
        while not probe.is_answered_by(reply) or not (reply.refusal is None or refusal_is_its_own):
            reply = self._next(probe, b"", deadline)
        self._settle(unit)

    def _settle(self, unit: int) -> None:
        others = [doubt for doubt in self._doubts if doubt.unit != unit]
        self._doubts.clear()
        self._doubts.extend(others)
        self._in_step.add(unit)

    def _unlike_all_doubts(self, unit: int) -> ModbusRequest:
        doubted = {(doubt.function, doubt.count) for doubt in self._doubts}
        functions = {function for function, _ in doubted}
        first = self._line.probe_area
        other = Area.HOLDING if first is Area.INPUT else Area.INPUT
        area = next((area for area in (first, other) if area.read_function not in functions), first)
        function = area.read_function
        count = next(count for count in self._UNUSUAL if (function, count) not in doubted)
        return ModbusRequest(unit, function, area, self._line.probe_address, count)

    def _fall_silent(self, deadline: Deadline) -> None:
        self._transport.receive_waiting()  # data may have gathered for minutes, with pauses
        passed = 0
        while True:
            self._transport.clock.sleep(self._line.quiet_s)
            heard = self._transport.receive_waiting()
            if heard is None:
                return
            passed += len(heard)
            if passed > self._MOST_WITHOUT_PAUSE or deadline.expired:
                raise errors.restless(self._identity, passed, heard)

    def _count(self, data: bytes, request: ModbusRequest) -> None:
        """Raise RemoteProtocolError when more comes for one question than any device sends."""
        self._unasked += len(data)
        if self._unasked > self._MOST_UNASKED_BYTES:
            raise errors.flooding(self._identity, request, self._unasked, data)

    def _ask_once(self, request: ModbusRequest, deadline: Deadline) -> ModbusReply:
        self._buffer.clear()
        self._transport.receive_waiting()  # unrequested data answer nothing
        self._keep_distance()
        self._in_step.discard(request.unit)
        self._doubts.append(request)
        sent = self._framing.pack(request, 0)
        self._transport.send(sent, deadline=deadline)
        if self._line.echo:
            self._strip_echo(request, sent, deadline)
            sent = b""
        return self._next(request, sent, deadline)

    def _keep_distance(self) -> None:
        clock = self._transport.clock
        quiet_s = (clock.now_ns() - self._quiet_since_ns) / NS_PER_S
        clock.sleep(self._line.silence_s - quiet_s)

    def _strip_echo(self, request: ModbusRequest, sent: bytes, deadline: Deadline) -> None:
        while len(self._buffer) < len(sent):
            if not sent.startswith(self._buffer):
                raise self._echo_missing(request)
            self._receive(request, deadline)
        if not self._buffer.startswith(sent):
            raise self._echo_missing(request)
        del self._buffer[: len(sent)]

    def _echo_missing(self, request: ModbusRequest) -> RemoteProtocolError:
        return errors.echo_missing(self._identity, request, bytes(self._buffer))

    def _next(self, request: ModbusRequest, sent: bytes, deadline: Deadline) -> ModbusReply:
        """Return the next frame; ``sent`` must not come back as it is."""
        while True:
            if not self._could_be_echo(request, sent):
                try:
                    reply = self._framing.take(self._buffer)
                except FrameError as error:
                    raise errors.unintelligible(
                        self._identity, request, error.raw, serial=True
                    ) from error
                if reply is not None:
                    return reply
            self._receive(request, deadline)

    def _could_be_echo(self, request: ModbusRequest, sent: bytes) -> bool:
        """Whether to wait for more, because so far the line repeats what was sent."""
        if request.function == WRITE_COIL or not sent:  # its answer equals the request
            return False
        if self._buffer.startswith(sent):
            raise errors.echoing(self._identity, request, bytes(self._buffer))
        return sent.startswith(self._buffer)

    def _receive(self, request: ModbusRequest, deadline: Deadline) -> None:
        if deadline.expired:  # even if frames of other requests keep arriving
            raise errors.unanswered(self._identity, request, bytes(self._buffer), serial=True)
        try:
            came = self._transport.receive(deadline=deadline)
            self._count(came, request)
            self._buffer += came
        except TransportTimeoutError as error:
            held = bytes(self._buffer)
            raise errors.unanswered(self._identity, request, held, serial=True) from error
        finally:
            self._quiet_since_ns = self._transport.clock.now_ns()
