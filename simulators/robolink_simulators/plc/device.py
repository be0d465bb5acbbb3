"""The simulated PLC: a program behind a Modbus server."""

import threading

from robolink.register_maps import RegisterMap
from robolink_simulators.faults import Departure, FaultAction, FaultPlan
from robolink_simulators.faults.links import PLC_LINKS
from robolink_simulators.plc.frames import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    NO_SUCH_UNIT,
    Frames,
    PlcRequest,
    TcpFrames,
)
from robolink_simulators.plc.link import PlcLink
from robolink_simulators.plc.memory import OutsideError
from robolink_simulators.plc.program import PlcProgram


class PlcSimulator:
    """Serves the tables of a map, and runs the program behind them.

    Attributes:
        register_map: The map.
        unit: The unit that answers.
        program: Tools, handshake and signals.
        faults: What is to go wrong. Requests read ``fc16 100``: function and address.
        writes: The writing requests that were carried out, in the same words.
        lock: Held while it is touched.
        now_ns: The simulated time.

    Args:
        register_map: The map to serve.
        unit: The unit identifier; another one is answered with exception 11 over TCP, and not
            at all on a serial line.
        seed: Other tools.
    """

    def __init__(self, register_map: RegisterMap, *, unit: int = 1, seed: int = 1) -> None:
        self.register_map = register_map
        self.unit = unit
        self.program = PlcProgram(register_map, seed)
        self.faults = FaultPlan(seed=seed, links=PLC_LINKS)
        self.writes: list[str] = []
        self.lock = threading.RLock()
        self.now_ns = 0
        self._links: list[PlcLink] = []

    def connect(self, now_ns: int, frames: Frames | None = None) -> PlcLink:
        """Accept one client, over TCP unless its frames are named."""
        self.advance(now_ns)
        link = PlcLink(self, frames or TcpFrames())
        self._links = [*(other for other in self._links if not other.drained), link]
        return link

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self.now_ns = max(self.now_ns, now_ns)
        self.program.advance(self.now_ns)
        for link in self._links:
            link.catch_up()

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
        changes = [self.program.next_change(), *(link.next_change() for link in self._links)]
        return min((change for change in changes if change is not None), default=None)

    def serve(
        self, request: PlcRequest, frames: Frames, link: PlcLink, *, counted: bool = False
    ) -> list[Departure]:
        """Carry a request out and return what leaves for it, when."""
        if frames.shared and request.unit != self.unit:
            return []
        met = () if counted else self.faults.take(request.words)
        actions = {fault.action: fault for fault in met}
        if FaultAction.DISCONNECT_BEFORE in actions:
            return [(0.0, None)]
        if FaultAction.DROP_REQUEST in actions:
            return []
        if (stall := actions.get(FaultAction.STALL)) is not None:
            link.stall(request, stall.seconds)
            return []
        ignored = FaultAction.IGNORE_WRITE in actions
        reply = self._answer(request, frames, ignored=ignored)
        leaving = self.faults.departures(reply, met)
        if (again := actions.get(FaultAction.DUPLICATE_REQUEST)) is not None:
            leaving.append((again.seconds, self._answer(request, frames, ignored=ignored)))
        return leaving

    def _answer(self, request: PlcRequest, frames: Frames, *, ignored: bool) -> bytes:
        if request.unit != self.unit:
            return frames.refusal(request, NO_SUCH_UNIT)
        if request.table is None:
            return frames.refusal(request, ILLEGAL_FUNCTION)
        addresses = range(request.address, request.address + request.count)
        try:
            found = self.program.memory.read(request.table, addresses)
        except OutsideError:
            return frames.refusal(request, ILLEGAL_ADDRESS)
        if request.values is not None and not ignored:
            self.program.memory.write(request.table, request.address, request.values)
            self.writes.append(request.words)
            self.program.written(self.now_ns)
        return frames.answer(request, found)
