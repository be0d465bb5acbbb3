"""A SoftMotion PLC in a virtual cell, and the mailbox link that leads to it."""

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from robolink.controllers import open_softmotion
from robolink.model import Controller, OutcomeLog, ToolOffset
from robolink.protocols.mailbox import WordOrder, Words
from robolink.transport import MailboxLink
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.frames import Frame
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.faults.fieldbus import Order
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.history import Disturbance, Hindrance
from robolink_simulators.soak.plant.counted_acts import CountedActs
from robolink_simulators.soak.plant.machine import (
    USUAL_TOOL,
    MachineState,
    PlantWithWorld,
    WireTap,
)
from robolink_simulators.soak.plant.mailbox_tap import TappedMailboxLink
from robolink_simulators.soak.plant.production import MailboxProduction
from robolink_simulators.soak.plant.seen_session import another_clients
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_TIMEOUT_S: Final = 3.0
_WATCHDOGS_MS: Final = (0, 2000, 0, 500)
"""Of the fieldbus, by seed: silence after which it zeroes what clients write; 0 never."""

_ORDERS: Final[tuple[Order, ...]] = ("high_first", "pairs_swapped", "halves_swapped")
_NEEDS_RESTART: Final = frozenset(
    {PlcFaultAction.FREEZE_HEARTBEAT, PlcFaultAction.WORD_ORDER, PlcFaultAction.SHIFT_MAP}
)


class SoftMotionPlant(PlantWithWorld):
    """A PLC with the mailbox program and a SCARA behind it.

    Args:
        clock: The virtual time.
        tap: Told of everything on the wire.
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
        """Meet the mailbox."""
        return open_softmotion(self.tapped(self.link(), process), outcomes=outcomes)

    def link(self) -> MailboxLink:
        """Open a link to the mailbox."""
        return InProcessMailboxLink(self.address, self._simulator, self.clock, _TIMEOUT_S)

    def tapped(self, link: MailboxLink, process: VirtualProcess) -> MailboxLink:
        """Let the adversary see what passes on a link."""
        return TappedMailboxLink(link, process, self.tap, self)

    def openings(self, process: VirtualProcess) -> Mapping[str, Callable[..., object]]:
        """See ``PlantMachine.openings``."""

        def opened(_url: object, **_terms: object) -> MailboxLink:
            return self.tapped(self.link(), process)

        return {"robolink.transport.open_quick_link": opened}

    def announce(self, text: str, words: Sequence[int] = ()) -> None:
        """Count a request before it leaves; a rival's block may take the place of this one."""
        self._taken_over = another_clients(words) if self._rivals.due(text) and words else ()

    def hang_up(self, process: VirtualProcess) -> None:
        """A mailbox does not see that a client is gone; it hears no beat any more."""

    def state(self) -> MachineState:
        """Return its slots and the selected one."""
        plc = self._simulator.plc
        self._simulator.advance(self.clock.now_ns())
        tools = {n: _offset(slot.tool) for n, slot in plc.memory.defined().items()}
        if plc.memory.boot_id != self._starts:
            self._starts, self.moved_itself = plc.memory.boot_id, True
        return MachineState(tools, plc.tools.selected)

    def mistook(self, asked: ToolOffset, held: ToolOffset) -> bool:
        """Tell whether it read an offset in an order of words that a fault let it take on."""
        pairs = list(zip(asked.components(), held.components(), strict=True))
        return any(all(b in _readings(a, order) for a, b in pairs) for order in self._laid)

    def flange(self) -> Frame:
        """Return where the flange is."""
        self._simulator.advance(self.clock.now_ns())
        return self._simulator.plc.group.flange()

    def tip(self) -> Frame:
        """Return where the tip of the slot in force is."""
        self._simulator.advance(self.clock.now_ns())
        return self._simulator.plc.group.tcp()

    @property
    def moving(self) -> bool:
        """Whether the group moves."""
        self._simulator.advance(self.clock.now_ns())
        return not self._simulator.plc.group.motion.resting

    @property
    def movements(self) -> int:
        """How many movements the group has begun."""
        return self._simulator.plc.group.movements_started

    def arm(self, disturbance: Disturbance) -> None:
        """Plan a fault of the fieldbus, or what happens to the PLC."""
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
        """Forget what was planned; return how much was met."""
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
        """How many damaged blocks the mailbox has counted."""
        return self._simulator.plc.program.inbox.rejected

    def write_by_hand(self, tool: int, offset: ToolOffset) -> None:
        """Let the machine's own program write a slot."""
        x, y, z, a, b, c = self._simulator.plc.memory.slot(tool).tool
        del x, y, z
        values = (offset.x_mm, offset.y_mm, offset.z_mm, a, b, c)
        self._simulator.plc.memory.define(tool, values, "by hand")
        self.note_hand(tool, offset)

    def choose_by_hand(self, which: int) -> int | None:
        """Let somebody put another slot in force, unless the program stands that would do it."""
        return None if self._simulator.plc.frozen else super().choose_by_hand(which)

    def select_by_hand(self, tool: int) -> None:
        """Let the machine's own program put a slot in force."""
        self._simulator.advance(self.clock.now_ns())
        self._simulator.plc.tools.preselect(tool)

    def finest(self, value: float) -> float:  # noqa: ARG002 - as the base has it
        """See ``PlantMachine.finest``: an LREAL, in the units of the mailbox."""
        return 2e-9

    def advance(self) -> None:
        """Let time pass; the machine's own program goes on, too."""
        super().advance()
        self._production.look(self.clock.now_ns())

    def repair(self) -> None:
        """Release, permit, let the program go on."""
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
    """Return how a value reads in another order of its words; a zero may have either sign."""
    meant = (value,) if value else (0.0, -0.0)
    words = [struct.unpack("<4H", struct.pack("<d", one)) for one in meant]
    return [struct.unpack("<d", struct.pack("<4H", *order.arrange(one)))[0] for one in words]


def _offset(tool: Sequence[float]) -> ToolOffset:
    x_mm, y_mm, z_mm, a_deg, b_deg, c_deg = tool
    return ToolOffset(x_mm, y_mm, z_mm, a_deg, b_deg, c_deg)
