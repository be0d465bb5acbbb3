"""A Modbus server without a socket, in front of a simulated PLC: bytes in, bytes out."""

import struct
from collections import deque
from typing import Final, cast

from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.hosting.fieldbus.plc_registers import PlcRegisters
from robolink_simulators.hosting.in_process.transport import InProcessTransport
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.image import Bank

from robolink.timing import Clock
from robolink.transport import LinkUrl
from robolink.transport.modbus.client import ModbusClient
from robolink.transport.modbus.frames import Area, TcpFraming
from robolink.transport.modbus.mailbox import MailboxPlaces, ModbusMailboxLink
from robolink.transport.modbus.tcp import TcpExchange
from tests.faults.small.wire import ModbusFrames, Wire

_TAKES_NS: Final = 20_000_000
"""The server's time for an answer: two cycles of its PLC."""

_BANKS: Final = {3: Bank.HOLDING, 4: Bank.INPUT}
_WRITE: Final = 16
_UNIT: Final = 255


class ModbusFarEnd:
    """Implements ``hosting.addresses.WireDevice`` for functions 3, 4 and 16."""

    def __init__(self, simulator: SoftMotionSimulator, clock: ManualClock) -> None:
        self._simulator = simulator
        self._links: list[_Connection] = []
        # Registers ask a clock for nothing but the time.
        self.registers = PlcRegisters(simulator, cast(ScaledClock, clock))

    def connect(self, now_ns: int) -> "_Connection":
        """Accept one client."""
        link = _Connection(self.registers)
        self._links.append(link)
        return link

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self._simulator.advance(now_ns)
        for link in self._links:
            link.now_ns = now_ns

    def next_change(self) -> int | None:
        """Return the time of the next answer, or of the PLC's next own action."""
        times = [self._simulator.next_change(), *(link.next_change() for link in self._links)]
        return min((time_ns for time_ns in times if time_ns is not None), default=None)


class _Connection:
    closed = False

    def __init__(self, registers: PlcRegisters) -> None:
        self._registers = registers
        self._leaving: deque[tuple[int, bytes]] = deque()
        self.now_ns = 0

    def receive(self, data: bytes, now_ns: int) -> None:
        self.now_ns = now_ns
        if data:
            self._leaving.append((now_ns + _TAKES_NS, self._answered(data)))

    def outgoing(self) -> bytes:
        ready = b""
        while self._leaving and self._leaving[0][0] <= self.now_ns:
            ready += self._leaving.popleft()[1]
        return ready

    def next_change(self) -> int | None:
        return self._leaving[0][0] if self._leaving else None

    def _answered(self, request: bytes) -> bytes:
        number, _, _, unit, function, address, count = struct.unpack_from(">HHHBBHH", request)
        if function == _WRITE:
            self._registers.write(address, struct.unpack_from(f">{count}H", request, 13))
            body = struct.pack(">BHH", function, address, count)
        else:
            words = self._registers.read(_BANKS[function], address, count).words
            body = struct.pack(f">BB{count}H", function, 2 * count, *words)
        return struct.pack(">HHHB", number, 0, len(body) + 1, unit) + body


class _WiredMailbox(ModbusMailboxLink):
    durable = False


def open_wired(
    link_url: LinkUrl, simulator: SoftMotionSimulator, wire: Wire, clock: ManualClock
) -> ModbusMailboxLink:
    """Open a mailbox whose Modbus frames pass over ``wire``, with the real Modbus client."""
    transport = InProcessTransport(link_url, wire, clock, simulator.lock)
    identity = link_url.identity
    exchange = TcpExchange(transport, identity, TcpFraming())
    client = ModbusClient(transport, exchange, identity=identity, unit=_UNIT, timeout_s=3.0)

    def again(_timeout_s: float) -> ModbusMailboxLink:
        return open_wired(link_url, simulator, wire, clock)

    return _WiredMailbox(client, MailboxPlaces(0, 0, 112, Area.INPUT), again)


def plc_wire(simulator: SoftMotionSimulator, clock: Clock) -> Wire:
    """Return the wire to a PLC."""
    return Wire(ModbusFarEnd(simulator, cast(ManualClock, clock)), ModbusFrames())
