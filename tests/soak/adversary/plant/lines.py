"""What carries bytes to the machines of virtual cells and bends them: serial and Modbus lines."""

from collections.abc import Callable
from enum import StrEnum
from typing import Final

from robolink_simulators.faults import LinkKind, PlcFault, PlcFaultAction
from robolink_simulators.faults.departing import DepartingReplies
from robolink_simulators.faults.plan import LinkEnd
from robolink_simulators.hosting.fieldbus.plc_registers import PlcRegisters
from robolink_simulators.hosting.in_process.transport import InProcessTransport
from robolink_simulators.plc.frames import (
    ILLEGAL_FUNCTION,
    Frames,
    LineFrames,
    PlcRequest,
    TcpFrames,
)
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.image import Bank
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.register_maps import RegisterTable
from robolink.timing import NS_PER_S, Clock, Deadline
from tests.soak.adversary.history import CountedActs, Disturbance


class LineBend(StrEnum):
    """What becomes of one frame on a line, and in which direction."""

    DROP_ASKED = "a byte of the request is lost"
    SWAP_ASKED = "two bytes of the request change places"
    FLIP_ASKED = "a bit of the request is bent"
    ADD_ASKED = "a byte comes into the request"
    DROP_ANSWERED = "a byte of the answer is lost"
    SWAP_ANSWERED = "two bytes of the answer change places"
    FLIP_ANSWERED = "a bit of the answer is bent"
    ADD_ANSWERED = "a byte comes into the answer"


_ASKED: Final = frozenset(bend for bend in LineBend if bend.name.endswith("_ASKED"))
_NOISE: Final = b"\x55"


class BentLine:
    """Bends frames as planned.

    Attributes:
        acts: What is planned.
    """

    def __init__(self) -> None:
        self.acts = CountedActs()
        self._of_request: list[Disturbance] = []
        self._of_answer: list[Disturbance] = []

    def announce(self, text: str) -> None:
        """Count a request that is about to be sent."""
        for disturbance in self.acts.due(text):
            bends = self._of_request if LineBend[disturbance.what] in _ASKED else self._of_answer
            bends.append(disturbance)

    def asked(self, data: bytes) -> bytes:
        """Return what arrives of a request."""
        due, self._of_request = self._of_request, []
        for disturbance in due:
            data = _bent(data, disturbance)
        return data

    def answered(self, data: bytes) -> bytes:
        """Return what arrives of an answer."""
        due, self._of_answer = self._of_answer, []
        for disturbance in due:
            data = _bent(data, disturbance)
        return data


def _bent(data: bytes, disturbance: Disturbance) -> bytes:
    if not data:
        return data
    position = disturbance.position
    place = len(data) // 2 if position is None else position % len(data)
    before, byte, after = data[:place], data[place], data[place + 1 :]
    match LineBend[disturbance.what]:
        case LineBend.DROP_ASKED | LineBend.DROP_ANSWERED:
            return before + after
        case LineBend.SWAP_ASKED | LineBend.SWAP_ANSWERED:
            return before + after[:1] + bytes([byte]) + after[1:]
        case LineBend.FLIP_ASKED | LineBend.FLIP_ANSWERED:
            return before + bytes([byte ^ 1 << (position or 0) % 8]) + after
        case _:
            return before + _NOISE + data[place:]


class BentTransport(InProcessTransport):
    """A transport over a line that bends what passes.

    Attributes:
        line: Bends it; a transport without one carries everything as it is.
    """

    line: BentLine | None = None

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:
        """See :meth:`robolink.transport.Transport.send`."""
        arrives = data if self.line is None else self.line.asked(data)
        super().send(arrives, deadline=deadline, secret=secret)

    def receive(self, *, deadline: Deadline) -> bytes:
        """See :meth:`robolink.transport.Transport.receive`."""
        while True:
            data = super().receive(deadline=deadline)
            arrived = data if self.line is None else self.line.answered(data)
            if arrived or not data:
                return arrived


_BANKS: Final = {RegisterTable.HOLDING: Bank.HOLDING, RegisterTable.INPUT: Bank.INPUT}
_CHARACTER_BITS: Final = 11
_SILENCE: Final = 3.5
"""Characters of silence that end a frame (Modbus over serial line 1.02, 2.5.1.1)."""
_TURN_S: Final = 0.008
"""How long the server takes for an answer: two cycles of its PLC."""
_SPLIT_S: Final = 0.01


class MailboxFrames:
    """Implements ``hosting.addresses.WireDevice`` in front of a simulated PLC.

    Args:
        simulator: The PLC.
        clock: The simulated time.
        unit: Who answers.
        baud: Of a serial line, on which each byte takes its time; 0 for a network.
    """

    def __init__(
        self, simulator: SoftMotionSimulator, clock: Clock, *, unit: int, baud: int = 0
    ) -> None:
        self.unit = unit
        self.character_s = _CHARACTER_BITS / baud if baud else 0.0
        self.registers = PlcRegisters(
            simulator, clock, LinkKind.MODBUS_RTU if baud else LinkKind.MODBUS_TCP
        )
        self._simulator = simulator
        self._links: list[MailboxFramesLink] = []

    def connect(self, now_ns: int) -> "MailboxFramesLink":
        """Accept one client, or listen at the line."""
        self.advance(now_ns)
        frames = LineFrames() if self.character_s else TcpFrames()
        link = MailboxFramesLink(self, frames, now_ns)
        self._links = [*(one for one in self._links if not one.over), link]
        return link

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self._simulator.advance(now_ns)
        for link in self._links:
            link.now_ns = max(link.now_ns, now_ns)

    def next_change(self) -> int | None:
        """Return when something leaves, or the PLC does something by itself."""
        times = [self._simulator.next_change(), *(link.next_change() for link in self._links)]
        return min((time_ns for time_ns in times if time_ns is not None), default=None)


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
        self._heard_ns = now_ns
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
        silence_ns = now_ns - self._heard_ns
        self.now_ns = self._heard_ns = now_ns
        if not data:
            self.over = True
        if self.over or self._outbox.half_open:
            return
        if self._frames.shared and silence_ns > self._carried_ns(_SILENCE):
            self._frames.forget()
        self._frames.feed(data)
        try:
            while not self.over and (request := self._frames.take()) is not None:
                self._serve(request, len(data))
        except ValueError:
            self._end(None)

    def outgoing(self) -> bytes:
        """Take what has arrived at the client's end."""
        return self._outbox.take(self.now_ns)

    def next_change(self) -> int | None:
        """Return when the next of what is on its way arrives."""
        return None if self.over else self._outbox.next_change(self.now_ns)

    def _serve(self, request: PlcRequest, asked_bytes: int) -> None:
        if self._frames.shared and request.unit != self._device.unit:
            return
        bank = None if request.table is None else _BANKS.get(request.table)
        if bank is None or (request.values is not None and bank is not Bank.HOLDING):
            self._outbox.post(self._frames.refusal(request, ILLEGAL_FUNCTION), self.now_ns)
            return
        registers = self._device.registers
        served = (
            registers.read(bank, request.address, request.count)
            if request.values is None
            else registers.write(request.address, request.values)
        )
        if self._gone(served):
            return
        frame = self._frames.answer(request, served.words)
        takes_ns = round((_TURN_S + served.delay_s) * NS_PER_S)
        takes_ns += self._carried_ns(asked_bytes + len(frame) + 2 * _SILENCE)
        self._depart(frame, served.met, self.now_ns + takes_ns)

    def _gone(self, served: ServedAccess) -> bool:
        """End the connection where that is planned; tell whether no answer leaves."""
        if not self._frames.shared:
            if served.cut:
                self._end(None)
            elif served.meets(PlcFaultAction.RESET):
                self._end(LinkEnd.RESET)
            elif served.meets(PlcFaultAction.HALF_OPEN):
                self._outbox.half_open = True
        return self.over or self._outbox.half_open or not served.answered

    def _end(self, how: LinkEnd | None) -> None:
        self._outbox.post(how, self.now_ns)
        self.over = True

    def _depart(self, frame: bytes, met: tuple[PlcFault, ...], at_ns: int) -> None:
        late = b""
        for fault in met:
            middle = len(frame) // 2 if fault.position is None else fault.position % len(frame)
            late = frame[middle:] if fault.action is PlcFaultAction.SPLIT_REPLY else late
            frame = _CUTS[fault.action](frame, middle)
            if late:
                late_ns = at_ns + round((fault.seconds or _SPLIT_S) * NS_PER_S)
        self._outbox.post(frame, at_ns)
        if late:
            self._outbox.post(late, late_ns)

    def _carried_ns(self, characters: float) -> int:
        return round(characters * self._device.character_s * NS_PER_S)


_CUTS: Final[dict[PlcFaultAction, Callable[[bytes, int], bytes]]] = {
    PlcFaultAction.TRUNCATE_REPLY: lambda frame, middle: frame[:middle],
    PlcFaultAction.SPLIT_REPLY: lambda frame, middle: frame[:middle],
    PlcFaultAction.DUPLICATE_REPLY: lambda frame, _middle: frame + frame,
}
