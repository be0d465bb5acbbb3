"""The registers of a simulated PLC behind Modbus frames: requests in, answers out, each in time."""

from dataclasses import replace
from typing import Final

from robolink.register_maps import RegisterTable
from robolink.timing import NS_PER_S, Clock
from robolink_simulators.faults import LinkKind, PlcFaultAction
from robolink_simulators.faults.departing import DepartingReplies
from robolink_simulators.faults.plan import LinkEnd
from robolink_simulators.hosting.fieldbus.plc_registers import WORD_BITS, PlcRegisters
from robolink_simulators.hosting.modbus_frames import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    Frames,
    LineFrames,
    PlcRequest,
    TcpFrames,
)
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.image import REGISTERS, Bank
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_BANKS: Final = {
    RegisterTable.COIL: Bank.HOLDING,
    RegisterTable.HOLDING: Bank.HOLDING,
    RegisterTable.DISCRETE: Bank.INPUT,
    RegisterTable.INPUT: Bank.INPUT,
}
_SILENCE_NS: Final = 50_000_000
"""Silence in ns that ends a frame: earlier data no longer belongs to it."""


class MailboxFrames:
    """A PLC as a client of Modbus sees it; implements ``hosting.addresses.WireDevice``.

    The PLC itself follows when it is asked.

    Args:
        simulator: The PLC.
        clock: The simulated time.
        unit: Its number on a line; ``None`` for TCP, where every unit is answered.

    Attributes:
        unit: See above.
        registers: Those of the PLC.
    """

    def __init__(
        self, simulator: SoftMotionSimulator, clock: Clock, *, unit: int | None = None
    ) -> None:
        self.unit = unit
        kind = LinkKind.MODBUS_TCP if unit is None else LinkKind.MODBUS_RTU
        self.registers = PlcRegisters(simulator, clock, kind)
        self._wire_time = simulator.wire_time
        self._seen = self.registers.ends
        self._links: list[MailboxFramesLink] = []

    @property
    def silence_ns(self) -> int:
        """How long a line is silent between frames."""
        return _SILENCE_NS

    def connect(self, now_ns: int) -> "MailboxFramesLink":
        """Accept a client, or listen at the line."""
        self.advance(now_ns)
        frames = TcpFrames() if self.unit is None else LineFrames()
        link = MailboxFramesLink(self, frames, now_ns)
        self._links = [*(one for one in self._links if not one.over), link]
        return link

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        for link in self._links:
            link.now_ns = max(link.now_ns, now_ns)

    def next_change(self) -> int | None:
        """Return when something leaves."""
        times = [link.next_change() for link in self._links]
        return min((time_ns for time_ns in times if time_ns is not None), default=None)

    def wire_ns(self, now_ns: int) -> int:
        """Return the time that passes on the wire."""
        return self._wire_time.at(now_ns)

    def takes_ns(self, delay_s: float, characters: float) -> int:  # noqa: ARG002 - of slow lines
        """Return how long an exchange of so many characters takes."""
        return round(delay_s * NS_PER_S)

    def look(self) -> None:
        """End connections when the PLC was restarted or its cable pulled; a line has none."""
        seen, self._seen = self._seen, self.registers.ends
        if self.unit is None and seen != self._seen:
            for link in self._links:
                link.end(None)


class MailboxFramesLink:
    """One connection, or the line; implements ``hosting.addresses.DeviceLink``.

    Args:
        device: Whose it is.
        frames: How requests and answers are wrapped.
        now_ns: The simulated time.
    """

    def __init__(self, device: MailboxFrames, frames: Frames, now_ns: int) -> None:
        self._device = device
        self._frames = frames
        self._outbox = DepartingReplies()
        self._heard_ns = device.wire_ns(now_ns)
        self.now_ns = now_ns
        self.over = False

    @property
    def closed(self) -> bool:
        """Whether the server has ended this connection, after what is outgoing."""
        return self._outbox.ended(self.now_ns)

    @property
    def reset(self) -> bool:
        """Whether it has ended it with a reset."""
        return self._outbox.reset(self.now_ns)

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that the client is gone."""
        before_ns, self._heard_ns = self._heard_ns, self._device.wire_ns(now_ns)
        self.now_ns = now_ns
        if not data:
            self.over = True
        if self.over or self._outbox.half_open:
            return
        if self._frames.shared and self._heard_ns - before_ns > self._device.silence_ns:
            self._frames.forget()
        self._frames.feed(data)
        try:
            while not self.over and (request := self._frames.take()) is not None:
                self._serve(request, len(data))
        except ValueError:
            self.end(None)

    def outgoing(self) -> bytes:
        """Take what has arrived at the client's end."""
        return self._outbox.take(self.now_ns)

    def next_change(self) -> int | None:
        """Return when the next of what is on its way arrives."""
        return None if self.over else self._outbox.next_change(self.now_ns)

    def end(self, how: LinkEnd | None) -> None:
        """End the connection from the server's side, once."""
        if not self.over:
            self._outbox.post(how, self.now_ns)
            self.over = True

    def _serve(self, request: PlcRequest, asked_bytes: int) -> None:
        if self._frames.shared and request.unit != self._device.unit:
            return
        if code := _refusal(request):
            frame = self._frames.refusal(request, code)
            self._send(frame, self._device.registers.late(), asked_bytes)
            return
        served = self._carried_out(request)
        if self._gone(served):
            return
        refused = served.meets(PlcFaultAction.MODBUS_EXCEPTION)
        frame = (
            self._frames.answer(request, served.words)
            if refused is None
            else self._frames.refusal(request, refused.code)
        )
        self._send(frame, served, asked_bytes)

    def _carried_out(self, request: PlcRequest) -> ServedAccess:
        registers, address, values = self._device.registers, request.address, request.values
        bits = request.table in (RegisterTable.COIL, RegisterTable.DISCRETE)
        if values is not None and request.then_read is not None:
            served = registers.write(address, values)
            return replace(served, words=tuple(registers.peek(Bank.HOLDING, *request.then_read)))
        if values is not None:
            return registers.switch(address, values) if bits else registers.write(address, values)
        read = registers.read_bits if bits else registers.read
        return read(_BANKS[request.table or RegisterTable.HOLDING], address, request.count)

    def _gone(self, served: ServedAccess) -> bool:
        """End the connection if that is planned; return whether no answer is sent."""
        if not self._frames.shared:
            if served.cut:
                self.end(None)
            elif served.meets(PlcFaultAction.RESET):
                self.end(LinkEnd.RESET)
            elif served.meets(PlcFaultAction.HALF_OPEN):
                self._outbox.half_open = True
        return self.over or self._outbox.half_open or not served.answered

    def _send(self, frame: bytes, served: ServedAccess, asked_bytes: int) -> None:
        takes_ns = self._device.takes_ns(served.delay_s, asked_bytes + len(frame))
        for late_s, piece in served.pieces(frame):
            self._outbox.post(piece, self.now_ns + takes_ns + round(late_s * NS_PER_S))


def _refusal(request: PlcRequest) -> int:
    """Return the code of a request that cannot be served; 0 if it can."""
    if request.illegal:
        return ILLEGAL_VALUE
    if request.then_read is not None and sum(request.then_read) > REGISTERS:
        return ILLEGAL_ADDRESS
    if request.table is None and request.then_read is None:
        return ILLEGAL_FUNCTION
    bits = request.table in (RegisterTable.COIL, RegisterTable.DISCRETE)
    most = REGISTERS * WORD_BITS if bits else REGISTERS
    return ILLEGAL_ADDRESS if request.address + request.count > most else 0
