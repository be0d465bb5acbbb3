"""What a serial line does to bytes: it loses, swaps, bends and adds them."""

from enum import StrEnum
from typing import Final

from robolink.timing import Deadline
from robolink_simulators.hosting.in_process.transport import InProcessTransport
from robolink_simulators.soak.history import Disturbance
from robolink_simulators.soak.plant.counted_acts import CountedActs


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
