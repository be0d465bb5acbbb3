"""A SoftMotion PLC in a virtual cell and its links: blocks, Modbus, CANopen, OPC UA."""

import struct
from collections.abc import Callable, Mapping, Sequence
from enum import Enum, auto
from typing import Final

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.frames import Frame
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.faults.fieldbus import Order
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.hosting.in_process.transport import LinePort
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.controllers import open_softmotion
from robolink.model import Controller, OutcomeLog, ToolOffset
from robolink.protocols.mailbox import Command, Opcode, WordOrder, Words, encode_command
from robolink.timing import NS_PER_S, Deadline
from robolink.transport import MailboxLink, parse_url
from robolink.transport.can.bus import CanLine
from robolink.transport.can.mailbox import CanopenMailboxLink
from robolink.transport.modbus.client import Exchange, ModbusClient
from robolink.transport.modbus.frames import Area, RtuFraming, TcpFraming
from robolink.transport.modbus.mailbox import MailboxPlaces, ModbusMailboxLink
from robolink.transport.modbus.rtu import RtuExchange, RtuLine
from robolink.transport.modbus.tcp import TcpExchange
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import CountedActs, Disturbance, Hindrance
from tests.soak.adversary.plant.lines import BentLine, BentTransport, TimedFrames
from tests.soak.adversary.plant.machine import (
    USUAL_TOOL,
    MachineState,
    PlantWithWorld,
    WireTap,
)
from tests.soak.adversary.plant.mailbox_tap import TappedMailboxLink, another_clients
from tests.soak.adversary.plant.stepped_can import SteppedCan

_TOKEN: Final = 0x50C0_0001
_PATIENCE_NS: Final = 60_000_000
"""A command has been read after this long."""


class _Stage(Enum):
    IDLE = auto()
    TAKING = auto()
    OWNING = auto()


class MailboxProduction:
    """A client that requests the mailbox politely, keeps it for a while and releases it.

    Its blocks go where robolink's go, so one of its acknowledgements may overwrite one that
    robolink waits for.

    Args:
        simulator: The PLC.
    """

    def __init__(self, simulator: SoftMotionSimulator) -> None:
        self._plc = simulator.plc
        self._sequence = 0
        self._stage = _Stage.IDLE
        self._due_ns = 0
        self._holds_ns = 0

    def begin(self, seconds: float, now_ns: int) -> None:
        """Request the mailbox, and keep it for this long if it is granted."""
        if self._stage is _Stage.IDLE:
            self._holds_ns = round(seconds * NS_PER_S)
            self._send(Opcode.OWNERSHIP, 1, now_ns)
            self._go_on(_Stage.TAKING, now_ns + _PATIENCE_NS)

    def look(self, now_ns: int) -> None:
        """Do the next due step."""
        if self._stage is _Stage.IDLE or now_ns < self._due_ns:
            return
        if self._plc.program.holder != _TOKEN:
            self._stage = _Stage.IDLE  # refused, or another one insisted
        elif self._stage is _Stage.TAKING:
            self._send(Opcode.READ_TOOL, 0, now_ns)
            self._go_on(_Stage.OWNING, now_ns + self._holds_ns)
        else:
            self._send(Opcode.OWNERSHIP, 0, now_ns)
            self._stage = _Stage.IDLE

    def _go_on(self, stage: _Stage, due_ns: int) -> None:
        self._stage, self._due_ns = stage, due_ns

    def _send(self, opcode: Opcode, operand: int, now_ns: int) -> None:
        self._sequence = self._sequence % 0xFFFF + 1
        command = Command(
            self._sequence,
            opcode,
            operands=(operand, 0, 0, 0),
            owner=_TOKEN,
            epoch=self._plc.memory.epoch,
        )
        self._plc.write(0, encode_command(command), now_ns)


_TIMEOUT_S: Final = 3.0
_TURN_S: Final = 0.008
"""The OPC UA server's time for an answer: two cycles of its PLC."""

_WATCHDOGS_MS: Final = (0, 2000, 0, 500)
"""Watchdogs of the fieldbus, by seed: silence after which it zeroes what clients write; 0 never."""

_ORDERS: Final[tuple[Order, ...]] = ("high_first", "pairs_swapped", "halves_swapped")
_NEEDS_RESTART: Final = frozenset(
    {PlcFaultAction.FREEZE_HEARTBEAT, PlcFaultAction.WORD_ORDER, PlcFaultAction.SHIFT_MAP}
)


class SoftMotionPlant(PlantWithWorld):
    """A PLC with the mailbox program and a SCARA behind it.

    Args:
        clock: The virtual time.
        tap: Receives all wire traffic.
        seed: Decides its world.
    """

    kind = "softmotion"
    numbered = True
    address = "softmotion+sim://cell"

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap)
        watchdog_ms = _WATCHDOGS_MS[seed // 2 % len(_WATCHDOGS_MS)]
        options = PlcOptions(mailbox=MailboxOptions(device_id=1000 + seed, watchdog_ms=watchdog_ms))
        self._simulator = SoftMotionSimulator(
            "Kin_Scara3_Z", seed=seed, options=options, world=WorldParameters()
        )
        x, y, z, a, b, c = USUAL_TOOL.components()
        self._simulator.plc.memory.define(2, (x, y, z, a, b, c), "second")
        self._simulator.present_ns = clock.now_ns
        self._simulator.durable = True
        self._simulator.on_request = self._requested
        self._simulator.on_reply = self._replied
        self._production = MailboxProduction(self._simulator)
        self._rivals = CountedActs()
        self._taken_over: Words = ()
        self._starts = self._simulator.plc.memory.boot_id
        self._strange = False
        self._laid: set[WordOrder] = set()

    @property
    def simulator(self) -> SoftMotionSimulator:
        """The simulated PLC."""
        return self._simulator

    def connect(self, process: VirtualProcess, outcomes: OutcomeLog) -> Controller:
        """Open a session with the mailbox."""
        return open_softmotion(self.tapped(self.link(), process), outcomes=outcomes)

    def link(self) -> MailboxLink:
        """Open a link to the mailbox."""
        return InProcessMailboxLink(self.address, self._simulator, self.clock, _TIMEOUT_S)

    def tapped(self, link: MailboxLink, process: VirtualProcess) -> MailboxLink:
        """Let the adversary see the traffic of a link."""
        return TappedMailboxLink(link, process, self.tap, self)

    def openings(self, process: VirtualProcess) -> Mapping[str, Callable[..., object]]:
        """See ``PlantMachine.openings``."""

        def opened(_url: object, **_terms: object) -> MailboxLink:
            return self.tapped(self.link(), process)

        return {"robolink.transport.open_mailbox_link": opened}

    def announce(self, text: str, words: Sequence[int] = ()) -> None:
        """Count a request before it leaves; another client's block may take its place."""
        self._taken_over = another_clients(words) if self._rivals.due(text) and words else ()

    def hang_up(self, process: VirtualProcess) -> None:
        """Do nothing: a mailbox notices only that the heartbeat has ended."""

    def state(self) -> MachineState:
        """Return its slots and the selected one."""
        plc = self._simulator.plc
        self._simulator.advance(self.clock.now_ns())
        tools = {n: _offset(slot.tool) for n, slot in plc.memory.defined().items()}
        if plc.memory.boot_id != self._starts:
            self._starts, self.moved_itself = plc.memory.boot_id, True
        return MachineState(tools, plc.tools.selected)

    def mistook(self, asked: ToolOffset, held: ToolOffset) -> bool:
        """Return whether it read an offset in a word order that a fault made it accept."""
        pairs = list(zip(asked.components(), held.components(), strict=True))
        return any(all(b in _readings(a, order) for a, b in pairs) for order in self._laid)

    def flange(self) -> Frame:
        """Return the flange pose."""
        self._simulator.advance(self.clock.now_ns())
        return self._simulator.plc.group.flange()

    def tip(self) -> Frame:
        """Return the pose of the selected slot's tip."""
        self._simulator.advance(self.clock.now_ns())
        return self._simulator.plc.group.tcp()

    @property
    def moving(self) -> bool:
        """Whether the group moves."""
        self._simulator.advance(self.clock.now_ns())
        return not self._simulator.plc.group.motion.resting

    @property
    def movements(self) -> int:
        """The number of movements that the group has begun."""
        return self._simulator.plc.group.movements_started

    def arm(self, disturbance: Disturbance) -> None:
        """Plan a fault of the fieldbus or the PLC."""
        if disturbance.kind in (Hindrance.PENDANT, Hindrance.PRODUCTION):
            self.acts.plan(disturbance)
            return
        if disturbance.kind is Hindrance.ANOTHER_CLIENT:
            self._rivals.plan(disturbance)
            return
        self._simulator.faults.add(
            PlcFault(
                PlcFaultAction[disturbance.what],
                disturbance.at,
                disturbance.match,
                seconds=disturbance.seconds,
                position=disturbance.position,
                order=_ORDERS[(disturbance.position or 0) % len(_ORDERS)],
            )
        )

    def disarm(self) -> int:
        """Drop the plans; return how many occurred."""
        faults = self._simulator.faults
        met = len(faults.fired)
        self._laid |= {
            WordOrder[fault.order.upper()]
            for fault in faults.fired
            if fault.action is PlcFaultAction.WORD_ORDER
        }
        self._strange |= any(fault.action in _NEEDS_RESTART for fault in faults.fired)
        faults.clear()
        faults.fired.clear()
        return met + self.acts.clear() + self._rivals.clear()

    @property
    def rejected(self) -> int:
        """The number of damaged blocks that the mailbox has counted."""
        return self._simulator.plc.program.inbox.rejected

    def write_by_hand(self, tool: int, offset: ToolOffset) -> None:
        """Let the machine's own program write a slot."""
        x, y, z, a, b, c = self._simulator.plc.memory.slot(tool).tool
        del x, y, z
        values = (offset.x_mm, offset.y_mm, offset.z_mm, a, b, c)
        self._simulator.plc.memory.define(tool, values, "by hand")
        self.note_hand(tool, offset)

    def choose_by_hand(self, which: int) -> int | None:
        """Let somebody select another slot, unless the program that would do it has stopped."""
        return None if self._simulator.plc.frozen else super().choose_by_hand(which)

    def select_by_hand(self, tool: int) -> None:
        """Let the machine's own program select a slot."""
        self._simulator.advance(self.clock.now_ns())
        self._simulator.plc.tools.preselect(tool)

    def finest(self, value: float) -> float:  # as the base has it
        """See ``PlantMachine.finest``: an LREAL, in the units of the mailbox."""
        return 2e-9

    def advance(self) -> None:
        """Advance the time, and with it the machine's own program."""
        super().advance()
        self._production.look(self.clock.now_ns())

    def repair(self) -> None:
        """Release, permit, restart the program."""
        panel = self._simulator.panel
        panel.release_estop()
        panel.give_permit()
        if self._simulator.plc.frozen:
            panel.thaw()
        if self._strange:
            self._strange = False
            panel.lay_words("low_first")
            panel.shift_map(0)
            panel.restart()

    def _replied(self, _number: int, text: str) -> None:
        if self._taken_over and text.startswith("write_command"):
            words, self._taken_over = self._taken_over, ()
            self._simulator.plc.write(0, words, self.clock.now_ns())

    def _requested(self, _number: int, text: str) -> None:
        now_ns = self.clock.now_ns()
        self._production.look(now_ns)
        for disturbance in self.acts.due(text):
            if disturbance.kind is Hindrance.PRODUCTION:
                self._production.begin(disturbance.seconds, now_ns)
                continue
            slot = self._simulator.plc.memory.slot(1)
            if slot.defined:
                old = _offset(slot.tool)
                self.write_by_hand(1, ToolOffset(old.x_mm, old.y_mm, old.z_mm + 0.5))


def _readings(value: float, order: WordOrder) -> list[float]:
    """Return the values that another word order gives; a zero may have either sign."""
    meant = (value,) if value else (0.0, -0.0)
    words = [struct.unpack("<4H", struct.pack("<d", one)) for one in meant]
    return [struct.unpack("<d", struct.pack("<4H", *order.arrange(one)))[0] for one in words]


def _offset(tool: Sequence[float]) -> ToolOffset:
    x_mm, y_mm, z_mm, a_deg, b_deg, c_deg = tool
    return ToolOffset(x_mm, y_mm, z_mm, a_deg, b_deg, c_deg)


_NODE: Final = 5


class CanopenPlant(SoftMotionPlant):
    """A PLC with its mailbox on CANopen, built from the same parts as :class:`SoftMotionPlant`."""

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._bus = SteppedCan(self.simulator, clock, node=_NODE)
        self._open: dict[int, MailboxLink] = {}

    def link(self) -> MailboxLink:
        """Attach an adapter and open a session with the node."""
        return self._met(start=True)

    def tapped(self, link: MailboxLink, process: VirtualProcess) -> MailboxLink:
        """See :meth:`SoftMotionPlant.tapped`."""
        self._open[process.number] = link
        return super().tapped(link, process)

    def hang_up(self, process: VirtualProcess) -> None:
        """Close the adapter of a process that died, as the system does."""
        link = self._open.pop(process.number, None)
        if link is not None:
            link.close()

    def _met(self, *, start: bool) -> CanopenMailboxLink:
        link = CanopenMailboxLink(
            CanLine(self._bus.attach(), self.address),
            _NODE,
            lambda _timeout_s: self._met(start=False),
            identity=self.address,
            durable=True,
            timeout_s=_TIMEOUT_S,
            clock=self.clock,
        )
        try:
            link.meet(start=start)
        except BaseException:
            link.close()
            raise
        return link


BAUD: Final = 38_400
CHARACTER_S: Final = 11 / BAUD

_UNIT: Final = 1
_PLACES: Final = MailboxPlaces(command=0, response=0, slots=112, area=Area.INPUT)
RTU_LINE: Final = RtuLine(
    character_s=CHARACTER_S,
    silence_s=0.00175,
    quiet_s=0.02,
    echo=False,
    probe_area=Area.INPUT,
    probe_address=0,
)


class ModbusTcpPlant(SoftMotionPlant):
    """A PLC with its mailbox on Modbus TCP, built like :class:`SoftMotionPlant`."""

    baud = 0

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._device = TimedFrames(self.simulator, clock, unit=_UNIT, baud=self.baud)

    def link(self) -> MailboxLink:
        """Open a separate connection."""
        transport = BentTransport(
            parse_url(self.address), self._device, self.clock, self.simulator.lock, durable=True
        )
        return self._mailbox(transport, TcpExchange(transport, self.address, TcpFraming()))

    def _mailbox(self, transport: BentTransport, exchange: Exchange) -> ModbusMailboxLink:
        client = ModbusClient(
            transport, exchange, identity=self.address, unit=_UNIT, timeout_s=_TIMEOUT_S
        )
        return ModbusMailboxLink(client, _PLACES, lambda _timeout_s: self._again())

    def _again(self) -> ModbusMailboxLink:
        link = self.link()
        assert isinstance(link, ModbusMailboxLink)  # for the type
        return link


class ModbusRtuPlant(ModbusTcpPlant):
    """A PLC with its mailbox on Modbus RTU, built like :class:`SoftMotionPlant`."""

    baud = BAUD

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._port = LinePort(self._device)
        self._line = BentLine()
        self._open: dict[int, MailboxLink] = {}

    def link(self) -> MailboxLink:
        """Open the port, and synchronize with the unit."""
        transport = BentTransport(
            parse_url(self.address), self._port, self.clock, self.simulator.lock, durable=True
        )
        transport.line = self._line
        exchange = RtuExchange(transport, self.address, RTU_LINE, RtuFraming())
        try:
            exchange.get_in_step(_UNIT, Deadline.after(self.clock, _TIMEOUT_S))
        except BaseException:
            transport.close()
            raise
        return self._mailbox(transport, exchange)

    def tapped(self, link: MailboxLink, process: VirtualProcess) -> MailboxLink:
        """See :meth:`SoftMotionPlant.tapped`."""
        self._open[process.number] = link
        return super().tapped(link, process)

    def announce(self, text: str, words: Sequence[int] = ()) -> None:
        """See :meth:`SoftMotionPlant.announce`; the line gets the request, too."""
        super().announce(text, words)
        self._line.announce(text)

    def hang_up(self, process: VirtualProcess) -> None:
        """Close the port of a process that died, as the system does."""
        link = self._open.pop(process.number, None)
        if link is not None:
            link.close()

    def arm(self, disturbance: Disturbance) -> None:
        """See :meth:`SoftMotionPlant.arm`; a line also alters bytes."""
        if disturbance.kind is Hindrance.LINE:
            self._line.acts.plan(disturbance)
        else:
            super().arm(disturbance)

    def disarm(self) -> int:
        """See :meth:`SoftMotionPlant.disarm`."""
        return super().disarm() + self._line.acts.clear()

    @property
    def bent(self) -> bool:
        """See ``PlantMachine.bent``; the line may have altered something, too."""
        return super().bent or bool(self._line.acts.met)


class OpcuaPlant(SoftMotionPlant):
    """A PLC with its mailbox behind an OPC UA server, built like :class:`SoftMotionPlant`."""

    address = "softmotion+opcua://cell"

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        from tests._stepped_opcua import SteppedOpcua  # a second, which other cells do not need

        super().__init__(clock, tap, seed)
        self.simulator.answer_s = _TURN_S
        self._server = SteppedOpcua(self.simulator, clock)
        self._open: dict[int, MailboxLink] = {}

    def link(self) -> MailboxLink:
        """Open a session of its own."""
        return self._server.mailbox(self.address, _TIMEOUT_S)

    def tapped(self, link: MailboxLink, process: VirtualProcess) -> MailboxLink:
        """See :meth:`SoftMotionPlant.tapped`."""
        self._open[process.number] = link
        return super().tapped(link, process)

    def hang_up(self, process: VirtualProcess) -> None:
        """Close the connection of a process that died, as the system does."""
        link = self._open.pop(process.number, None)
        if link is not None:
            link.close()
