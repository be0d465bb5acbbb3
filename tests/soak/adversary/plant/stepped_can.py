"""A CAN bus in this process in stepped time, with a simulated PLC as a CANopen node on it."""

from collections import deque
from typing import Any, Final, cast

import can
import canopen
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.fieldbus.canopen_node import LOOK_S, PERIOD_S, CanopenFace
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.timing import NS_PER_S

_FRAME_NS: Final = 250_000
"""The time of a frame at 500 kbit/s with its gaps, and of the stack behind it."""
_MOST_KEPT: Final = 512
"""Frames that an adapter keeps for a program that does not read; later ones are lost."""
_LOOK_NS: Final = round(LOOK_S * NS_PER_S)
_ROUNDS: Final = round(PERIOD_S / LOOK_S)
_SYNC_BITS: Final = 0x780


class SteppedCan:
    """The bus and its node. Time passes while a client sends, or waits for a frame.

    Args:
        simulator: The PLC.
        clock: The simulated time.
        node: Its number.
    """

    def __init__(self, simulator: SoftMotionSimulator, clock: ManualClock, *, node: int) -> None:
        self.clock = clock
        self.node = node
        self._simulator = simulator
        self._network = canopen.Network()
        self._network.bus = cast(can.BusABC, _NodeEnd(self))
        self._late_ns = 0
        self._looks = 0
        self._looked_ns = clock.now_ns()
        self._ends: list[SteppedCanBus] = []
        self._face = CanopenFace(simulator, node, clock, self._network, real_seconds=self._held)
        self._face.boot()

    def attach(self) -> "SteppedCanBus":
        """Attach an adapter."""
        end = SteppedCanBus(self)
        self._ends.append(end)
        return end

    def detach(self, end: "SteppedCanBus") -> None:
        """Detach an adapter."""
        self._ends = [one for one in self._ends if one is not end]

    def take_from_client(self, message: can.Message) -> None:
        """Carry a client's frame to the node, and the node's answers to all adapters."""
        with self._simulator.lock:
            self.clock.advance(_FRAME_NS / NS_PER_S)
            self.catch_up()
            self._late_ns = 0
            self._network.notify(message.arbitration_id, bytearray(message.data), 0.0)
            self._late_ns = 0

    def take_from_node(self, message: can.Message) -> None:
        """Carry a frame of the node to all adapters, after its planned delay."""
        at_ns = self.clock.now_ns() + self._late_ns + _FRAME_NS
        for end in self._ends:
            end.post(at_ns, message)

    def catch_up(self) -> None:
        """Run the node's overdue work. Long ago nobody listened: one look replaces many."""
        now_ns = self.clock.now_ns()
        if now_ns - self._looked_ns > _ROUNDS * _LOOK_NS:
            self._looked_ns, self._looks = now_ns, -1
        elif now_ns - self._looked_ns < _LOOK_NS:
            return
        else:
            self._looked_ns += (now_ns - self._looked_ns) // _LOOK_NS * _LOOK_NS
        self._looks += 1
        self._simulator.advance(now_ns)
        self._face.look(due=self._looks % _ROUNDS == 0)

    @property
    def next_look_ns(self) -> int:
        """The time of the node's next check for frames to send."""
        return self._looked_ns + _LOOK_NS

    def _held(self, seconds: float) -> float:
        """Delay the frames that the node sends now; nobody waits here."""
        self._late_ns = round(seconds * NS_PER_S)
        return 0.0


class _NodeEnd:
    """The bus as canopen sees it."""

    channel_info = "stepped"

    def __init__(self, wire: SteppedCan) -> None:
        self.send = wire.take_from_node


class SteppedCanBus(can.BusABC):
    """A client's adapter: python-can's interface, in which waiting advances simulated time."""

    def __init__(self, wire: SteppedCan) -> None:
        super().__init__(channel="stepped")
        self._wire = wire
        self._waiting: deque[tuple[int, can.Message]] = deque()
        self._shut = False

    def post(self, at_ns: int, message: can.Message) -> None:
        """Deliver a frame at a time, if it is for this listener."""
        own = message.arbitration_id & 0x7F == self._wire.node
        heard = message.arbitration_id & _SYNC_BITS in (0x180, 0x580, 0x700)
        if own and heard and len(self._waiting) < _MOST_KEPT:
            self._waiting.append(
                (max(at_ns, self._waiting[-1][0] if self._waiting else 0), message)
            )

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame."""
        self._require_open()
        self._wire.take_from_client(msg)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame; ``None`` if none came in time."""
        self._require_open()
        clock = self._wire.clock
        end_ns = clock.now_ns() + round((timeout or 0.0) * NS_PER_S)
        while True:
            self._wire.catch_up()
            now_ns = clock.now_ns()
            if self._waiting and self._waiting[0][0] <= now_ns:
                return self._waiting.popleft()[1]
            if now_ns >= end_ns:
                return None
            due = [end_ns, max(self._wire.next_look_ns, now_ns + 1)]
            if self._waiting:
                due.append(self._waiting[0][0])
            clock.advance_to(min(due))

    def _recv_internal(self, timeout: float | None) -> tuple[Any, bool]:
        return self.recv(timeout), True

    def shutdown(self) -> None:
        """Detach it."""
        if not self._shut:
            self._shut = True
            self._wire.detach(self)
            super().shutdown()

    def _require_open(self) -> None:
        if self._shut:
            message = "the adapter was unplugged"
            raise can.CanOperationError(message)
