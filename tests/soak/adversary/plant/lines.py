"""Serial and Modbus lines of virtual cells, which carry bytes and alter them."""

from enum import StrEnum
from typing import Final

from robolink_simulators.hosting.fieldbus.mailbox_frames import MailboxFrames
from robolink_simulators.hosting.in_process.transport import InProcessTransport
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.timing import NS_PER_S, Clock, Deadline
from tests.soak.adversary.history import CountedActs, Disturbance


class LineBend(StrEnum):
    """The alteration of one frame on a line, and its direction."""

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
    """Alters frames as planned.

    Attributes:
        acts: The plans.
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
        """Return the part of a request that arrives."""
        due, self._of_request = self._of_request, []
        for disturbance in due:
            data = _bent(data, disturbance)
        return data

    def answered(self, data: bytes) -> bytes:
        """Return the part of an answer that arrives."""
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
    """A transport over a line that alters the traffic.

    Attributes:
        line: Alters the traffic; a transport without one carries everything unchanged.
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


_CHARACTER_BITS: Final = 11
_SILENCE: Final = 3.5
"""Characters of silence that end a frame (Modbus over serial line 1.02, 2.5.1.1)."""

_TURN_S: Final = 0.008
"""The server's time for an answer: two cycles of its PLC."""


class TimedFrames(MailboxFrames):
    """The registers of a PLC, which need the PLC's own time for an exchange.

    Args:
        simulator: The PLC.
        clock: The simulated time.
        unit: Its number on a line.
        baud: The rate of that line; 0 for TCP.
    """

    def __init__(
        self, simulator: SoftMotionSimulator, clock: Clock, *, unit: int, baud: int = 0
    ) -> None:
        super().__init__(simulator, clock, unit=unit if baud else None)
        self._simulator = simulator
        self._character_s = _CHARACTER_BITS / baud if baud else 0.0

    @property
    def silence_ns(self) -> int:
        """The silence of the line between frames."""
        return self._carried_ns(_SILENCE)

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self._simulator.advance(now_ns)
        super().advance(now_ns)

    def next_change(self) -> int | None:
        """Return the time of the next output, or of the PLC's next own action."""
        times = (self._simulator.next_change(), super().next_change())
        return min((time_ns for time_ns in times if time_ns is not None), default=None)

    def takes_ns(self, delay_s: float, characters: float) -> int:
        """Return the time of the PLC and its line for an exchange."""
        return round((_TURN_S + delay_s) * NS_PER_S) + self._carried_ns(characters + 2 * _SILENCE)

    def _carried_ns(self, characters: float) -> int:
        return round(characters * self._character_s * NS_PER_S)
