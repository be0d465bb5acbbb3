"""The simulated PLC: a program behind a Modbus server."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from math import isfinite
from typing import Any, Final, TypeVar

from robolink.model import ToolOffset
from robolink.register_maps import RegisterMap, RegisterTable, SymbolMap
from robolink.timing import NS_PER_S
from robolink_simulators.device.hosted import HostedDevice
from robolink_simulators.device.wire_record import MotionLog
from robolink_simulators.faults import Departure, FaultAction, FaultPlan
from robolink_simulators.faults.departing import DepartingReplies
from robolink_simulators.faults.links import PLC_LINKS
from robolink_simulators.hosting.modbus_frames import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    NO_SUCH_UNIT,
    Frames,
    PlcRequest,
    TcpFrames,
)
from robolink_simulators.plc.memory import Memory, OutsideError, SymbolMemory
from robolink_simulators.plc.program import PlcProgram


class MappedPlcPanel:
    """The machine's permit, and its cable. Any thread may act.

    Args:
        plc: The controller.
    """

    def __init__(self, plc: "PlcSimulator") -> None:
        self._plc = plc

    def give_permit(self) -> None:
        """Let the machine permit changes of offsets."""
        with self._plc.acting():
            self._plc.program.permit(True)

    def withdraw_permit(self) -> None:
        """Let the machine no longer permit changes of offsets."""
        with self._plc.acting():
            self._plc.program.permit(False)

    def cut_link(self) -> None:
        """Pull the cable of every client."""
        with self._plc.acting():
            self._plc.cut_links()


Answer = TypeVar("Answer")

_SILENCE_NS: Final = 50_000_000
"""Silence in ns that ends a frame on a line: 3.5 characters (Modbus over serial line 1.02,
2.5.1.1).

A simulated line delivers a frame at once and has no baud rate. The value is therefore longer than
on the slowest real line, so that a busy computer does not cut a frame in two.
"""


class PlcLink:
    """Implements :class:`~robolink_simulators.hosting.addresses.DeviceLink`.

    Args:
        plc: Who serves.
        frames: How requests and answers are wrapped.
    """

    def __init__(self, plc: "PlcSimulator", frames: Frames) -> None:
        self._plc = plc
        self._frames = frames
        self._outbox = DepartingReplies()
        self._late: list[PlcRequest] = []
        self._heard_ns = plc.wire_time.at(plc.now_ns)
        self._over = False

    @property
    def closed(self) -> bool:
        """Whether the PLC has ended this connection, after what is outgoing."""
        return self._outbox.ended(self._plc.now_ns)

    @property
    def reset(self) -> bool:
        """Whether it has ended it with a reset."""
        return self._outbox.reset(self._plc.now_ns)

    @property
    def drained(self) -> bool:
        """Whether nothing will happen on this connection any more."""
        return self._over and not self._late and self._outbox.empty(self._plc.now_ns)

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that the client is gone."""
        self._plc.advance(now_ns)
        if self._outbox.half_open:
            return
        if not data:
            self._over = True
        before_ns, self._heard_ns = self._heard_ns, self._plc.wire_time.at(self._plc.now_ns)
        if self._frames.shared and self._heard_ns - before_ns > _SILENCE_NS:
            self._frames.forget()
        self._frames.feed(data)
        try:
            self._answer_all()
        except ValueError:
            self._outbox.post(None, self._plc.now_ns)
            self._over = True

    def outgoing(self) -> bytes:
        """Take what is ready for the client, ``b""`` for nothing."""
        return self._outbox.take(self._plc.now_ns)

    def next_change(self) -> int | None:
        """Return when something leaves, or the link carries again."""
        return self._outbox.next_change(self._plc.now_ns)

    def cut(self) -> None:
        """End this connection, after what is sent now."""
        self._outbox.post(None, self._plc.now_ns)
        self._over = True

    def stall(self, request: PlcRequest, seconds: float) -> None:
        """Carry nothing for a while; then a request arrives, and what was sent after it."""
        self._outbox.stalled_until_ns = self._plc.now_ns + max(1, round(seconds * NS_PER_S))
        self._late.append(request)

    def catch_up(self) -> None:
        """Serve what was in transit while the link carried nothing."""
        if self._late and not self._stalled:
            late, self._late = self._late, []
            for request in late:
                self._depart(self._plc.serve(request, self._frames, self, counted=True))
            self._answer_all()

    @property
    def _stalled(self) -> bool:
        return self._plc.now_ns < self._outbox.stalled_until_ns

    def _answer_all(self) -> None:
        while not (self._over or self._stalled or self._outbox.half_open):
            if (request := self._frames.take()) is None:
                return
            self._depart(self._plc.serve(request, self._frames, self))

    def _depart(self, departures: Sequence[Departure]) -> None:
        if not self._outbox.depart(departures, self._plc.now_ns):
            self._over = True


_SEVERAL_COILS: Final = 15
"""The only function parsed here that this PLC does not support."""

MOST_WRITES: Final = 2000
MOST_REGISTERS_READ: Final = 125
"""Most registers that the standard allows in one read."""


class PlcSimulator(HostedDevice):
    """Serves the tables of a map, and runs the program behind them.

    Attributes:
        register_map: The map.
        unit: The unit that answers.
        program: Tools, handshake and signals.
        faults: What is to go wrong. Requests read ``fc16 100``: function and address.
        writes: The writing requests that were carried out, in the same words; at least the last
            :data:`MOST_WRITES`.
        panel: What a person, or the machine's own program, can do.
        starts: How often it was switched on.
        cuts: How often all its connections were ended.

    Args:
        register_map: The map to serve, of registers over Modbus or of symbols over OPC UA.
        unit: The unit identifier; another one is answered with exception 11 over TCP, and not
            at all on a serial line.
        seed: Other tools.
        most_registers: How many registers it gives in one read; more is refused with exception 3,
            as servers do that give 61 or 50.
        answer_ms: How long after a request arrives its answer leaves, in simulated milliseconds.

    Example:
        >>> from pathlib import Path
        >>> from robolink.register_maps import load_map
        >>> from robolink_simulators.plc import PlcSimulator
        >>> from robolink_simulators.testkit.operator import written_map
        >>> plc = PlcSimulator(load_map(written_map(Path.cwd())), unit=3)
        >>> link = plc.connect(now_ns=0)
        >>> link.receive(bytes.fromhex("0001 0000 0006 04 03 0064 0002"), now_ns=0)
        >>> link.outgoing().hex(" ")  # unit 4 is not there: exception 11
        '00 01 00 00 00 03 04 83 0b'
    """

    kind = "plc"

    def __init__(
        self,
        register_map: RegisterMap | SymbolMap,
        *,
        unit: int = 1,
        seed: int = 1,
        most_registers: int = MOST_REGISTERS_READ,
        answer_ms: float = 0.0,
    ) -> None:
        super().__init__(seed, answer_ms=answer_ms)
        self.most_registers = most_registers
        self.register_map = register_map
        self.unit = unit
        self.faults = FaultPlan(seed=seed, links=PLC_LINKS)
        self.panel = MappedPlcPanel(self)
        self._links: list[PlcLink] = []
        self._planned: list[tuple[int, Callable[[], None]]] = []
        self.cuts = 0
        self._make()

    def _make(self) -> None:
        used = self.register_map
        memory = SymbolMemory(used) if isinstance(used, SymbolMap) else Memory(used)
        self.program: PlcProgram[Any] = PlcProgram(used, memory, self.seed)
        self.writes: list[str] = []
        self.starts = 1

    @property
    def machine_name(self) -> str:
        """See :attr:`HostedDevice.machine_name`."""
        return f"{self.kind} {self.register_map.name}"

    def _counted(self) -> dict[str, int]:
        return {
            "moves_started": 0,  # this PLC has no axes
            "tool_writes": self.program.taken,
            "starts": self.starts,
            "touches": 0,
        }

    def _motion_log(self) -> MotionLog:
        return MotionLog()

    def restart(self) -> None:
        """Switch off and on: links are cut, what the PLC retains stays."""
        with self.acting():
            self.starts += 1
            self.program.start_anew()
            self.cut_links()

    def cut_links(self) -> None:
        """End every connection; whoever calls it is acting."""
        self.cuts += 1
        for link in self._links:
            link.cut()

    def act_after(self, seconds: float, act: Callable[[], None]) -> None:
        """Do something some time from now, not before the end of the present request."""
        self._planned.append((self.now_ns + max(1, round(seconds * NS_PER_S)), act))

    def exchange(self, shown: str, carry_out: Callable[[], Answer]) -> Answer:
        """Carry a request out between its hooks, and count it.

        Args:
            shown: What it is.
            carry_out: Does it, and returns what is answered.

        Returns:
            The answer. What a hook raises goes to the caller; the request is carried out before.

        Example:
            >>> from pathlib import Path
            >>> from robolink.register_maps import load_map
            >>> from robolink_simulators.plc import PlcSimulator
            >>> from robolink_simulators.testkit.operator import written_map
            >>> plc = PlcSimulator(load_map(written_map(Path.cwd())))
            >>> plc.exchange("fc4 0", lambda: (7,)), plc.exchanges
            ((7,), 1)
        """
        self._requests += 1
        number = self._requests
        try:
            if self.on_request is not None:
                self.on_request(number, shown)
        finally:
            answer = carry_out()
        self.exchanges += 1
        self.log.add(self.now_ns, "<", shown)
        if self.on_reply is not None:
            self.on_reply(number, shown)
        return answer

    def note_write(self, shown: str) -> None:
        """Note a writing request that was carried out, and let the program react."""
        self.writes.append(shown)
        if len(self.writes) > 2 * MOST_WRITES:
            del self.writes[:-MOST_WRITES]
        self.program.written(self.now_ns)

    def connect(self, now_ns: int, frames: Frames | None = None) -> PlcLink:
        """Accept one client, over TCP unless its frames are named."""
        self.advance(now_ns)
        link = PlcLink(self, frames or TcpFrames())
        self._links = [*(other for other in self._links if not other.drained), link]
        return link

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, stopping wherever something changes."""
        while True:
            before_ns = self.now_ns
            ahead = [change for change in self._changes() if before_ns < change < now_ns]
            self.now_ns = min(ahead, default=max(before_ns, now_ns))
            self.program.advance(self.now_ns)
            self._act_if_due()
            for link in self._links:
                link.catch_up()
            if not ahead:
                return

    def _act_if_due(self) -> None:
        due = [act for at_ns, act in self._planned if at_ns <= self.now_ns]
        self._planned = [one for one in self._planned if one[0] > self.now_ns]
        self._stepping = True
        try:
            for act in due:
                act()
        finally:
            self._stepping = False

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
        return min(self._changes(), default=None)

    def _changes(self) -> list[int]:
        changes = (
            *(at_ns for at_ns, _ in self._planned),
            self.program.next_change(),
            *(link.next_change() for link in self._links),
        )
        return [change for change in changes if change is not None]

    def serve(
        self, request: PlcRequest, frames: Frames, link: PlcLink, *, counted: bool = False
    ) -> list[Departure]:
        """Carry a request out and return what is sent for it, and when.

        Args:
            request: What a client asks.
            frames: How answers are wrapped for that client.
            link: Its connection, for a fault that stalls it.
            counted: Whether it met its faults before, so that it meets none again.

        Returns:
            Seconds from now and bytes of each piece; none where nothing is answered.

        Example:
            >>> from pathlib import Path
            >>> from robolink.register_maps import RegisterTable, load_map
            >>> from robolink_simulators.plc import PlcSimulator
            >>> from robolink_simulators.hosting.modbus_frames import PlcRequest, TcpFrames
            >>> from robolink_simulators.testkit.operator import written_map
            >>> plc, frames = PlcSimulator(load_map(written_map(Path.cwd()))), TcpFrames()
            >>> link = plc.connect(now_ns=0, frames=frames)
            >>> asked = PlcRequest(1, 1, 6, RegisterTable.HOLDING, 100, 1, values=(7,))
            >>> ((seconds, reply),) = plc.serve(asked, frames, link)
            >>> seconds, reply.hex(" ")  # it is written: the request comes back
            (0.0, '00 01 00 00 00 06 01 06 00 64 00 07')
        """
        if frames.shared and request.unit != self.unit:
            return []
        self.log.add(self.now_ns, ">", request.words)
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
        refusal = actions.get(FaultAction.MODBUS_EXCEPTION)

        def carried_out() -> bytes:
            if refusal is not None:
                return frames.refusal(request, refusal.code)
            return self._answer(request, frames, ignored=ignored)

        reply = self.exchange(request.words, carried_out)
        leaving = self.faults.departures(reply, met, after_s=self.answer_s)
        if (again := actions.get(FaultAction.DUPLICATE_REQUEST)) is not None:
            late_s = again.seconds + self.answer_s
            leaving.append((late_s, self._answer(request, frames, ignored=ignored)))
        return leaving

    def _answer(self, request: PlcRequest, frames: Frames, *, ignored: bool) -> bytes:
        if request.unit != self.unit:
            return frames.refusal(request, NO_SUCH_UNIT)
        if request.illegal:
            return frames.refusal(request, ILLEGAL_VALUE)
        if request.table is None or request.function == _SEVERAL_COILS:
            return frames.refusal(request, ILLEGAL_FUNCTION)
        words = request.table in (RegisterTable.HOLDING, RegisterTable.INPUT)
        if words and request.values is None and request.count > self.most_registers:
            return frames.refusal(request, ILLEGAL_VALUE)
        addresses = range(request.address, request.address + request.count)
        try:
            found = self.program.memory.read(request.table, addresses)
        except OutsideError:
            return frames.refusal(request, ILLEGAL_ADDRESS)
        if request.values is not None and not ignored:
            self.program.memory.write(request.table, request.address, request.values)
            self.note_write(request.words)
        return frames.answer(request, found)

    def _truth(self) -> dict[str, Any]:
        selected = self.register_map.selected
        return {
            "stored": {str(tool): _offset(held) for tool, held in self.program.in_force.items()},
            "selected_tool": selected and self.program.memory.word(selected),
        }

    def _renew(self) -> None:
        self.cut_links()
        self._planned.clear()
        self.faults.forget()
        self._make()

    def _moment(self) -> dict[str, Any]:
        return {"program": self.program.moment()}

    def _restore(self, held: Mapping[str, Any]) -> None:
        self.program.put_back(held["program"])


def _offset(components: Mapping[str, float]) -> dict[str, float | None]:
    """Return a tool for a report; a client may have written something that is not a number."""
    named = ((it.name, components.get(it.name[0], 0.0)) for it in fields(ToolOffset))
    return {name: value if isfinite(value) else None for name, value in named}
