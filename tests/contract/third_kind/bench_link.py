"""The exchanges on the wire: one at a time, and none that a stop forbids."""

import threading

from robolink.controllers import DriverLink
from robolink.errors import RejectedError, TransportBrokenError
from robolink.interrupts import InterruptGate
from robolink.model import OutcomeLog
from robolink.stop_latch import CommandClass, StopLatch
from robolink.timing import Deadline
from robolink.transport import Transport


class BenchLink(DriverLink):
    """One connection."""

    def __init__(self, transport: Transport, outcomes: OutcomeLog, *, timeout_s: float) -> None:
        self._transport = transport
        self._timeout_s = timeout_s
        self._wire = threading.Lock()
        self._own_gate = InterruptGate()
        self._own_gate.open()
        self.exchanges = 0
        latch = StopLatch(transport.identity)
        super().__init__(transport.identity, transport.clock, latch, outcomes, gate=self._own_gate)

    def ask(self, request: str, kind: CommandClass = CommandClass.LOOK) -> tuple[float, ...]:
        """Send one line and return the numbers of the answer.

        Raises:
            StoppedError: A stop forbids the exchange; nothing was sent.
            RejectedError: The machine refused.
            TransportError: The connection is lost.
        """
        deadline = Deadline.after(self.clock, self._timeout_s)
        with self.uninterrupted(), self._wire:
            self.latch.admit(kind, request)
            self.exchanges += 1
            self._transport.send(f"{request}\n".encode(), deadline=deadline)
            line = b""
            while not line.endswith(b"\n"):
                piece = self._transport.receive(deadline=deadline)
                if not piece:
                    raise TransportBrokenError("The bench closed the connection.")
                line += piece
        verdict, *words = line.decode().split()
        if verdict != "OK":
            raise RejectedError(f"The bench refused {request}.", code=1, request=request)
        return tuple(float(word) for word in words if word != "ready")

    def close(self) -> None:
        """Close the connection."""
        self._transport.close()
        self._own_gate.close()
