"""A SoftMotion PLC in a virtual cell, and the mailbox link that leads to it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from robolink.controllers.softmotion import open_softmotion
from robolink.errors import TransportError
from robolink.model import Controller, OutcomeLog, ToolOffset
from robolink.protocols.mailbox import COMMAND, COMMAND_WORDS, Opcode, Words
from robolink.transport import MailboxHead
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.history import Disturbance, Hindrance
from robolink_simulators.soak.plant.machine import (
    MachineState,
    PlantMachine,
    SentKind,
    SentRequest,
    WireTap,
)
from robolink_simulators.soak.plant.seen_session import SeenSession, another_clients
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.words.exchange import ServedAccess

_KINDS: Final = {
    Opcode.MOVE_DIRECT: SentKind.MOVE,
    Opcode.MOVE_LINEAR: SentKind.MOVE,
    Opcode.MOVE_UNTIL_INPUT: SentKind.MOVE,
    Opcode.JOG: SentKind.MOVE,
    Opcode.CONTINUE: SentKind.MOVE,
    Opcode.WRITE_TOOL: SentKind.WRITE,
    Opcode.CLEAR_TOOL: SentKind.WRITE,
    Opcode.SELECT_TOOL: SentKind.SELECT,
    Opcode.STOP: SentKind.STOP,
    Opcode.HALT: SentKind.STOP,
}
_CHANGING: Final = (SentKind.MOVE, SentKind.WRITE)
_NEEDS_RESTART: Final = frozenset(
    {PlcFaultAction.FREEZE_HEARTBEAT, PlcFaultAction.WORD_ORDER, PlcFaultAction.SHIFT_MAP}
)
_I0, _OPCODE = COMMAND["i0"].word, COMMAND["opcode"].word


class SoftMotionPlant(PlantMachine):
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
        options = PlcOptions(mailbox=MailboxOptions(device_id=1000 + seed))
        self._simulator = SoftMotionSimulator(
            "Kin_Scara3_Z", seed=seed, options=options, world=WorldParameters()
        )
        self._simulator.present_ns = clock.now_ns
        self._simulator.durable = True
        self._simulator.on_request = self._requested
        self._planned: list[tuple[Disturbance, int]] = []
        self._rivals: list[tuple[Disturbance, int]] = []
        self._starts = self._simulator.plc.memory.boot_id
        self._strange = False

    @property
    def simulator(self) -> SoftMotionSimulator:
        """The simulated PLC."""
        return self._simulator

    def connect(self, process: VirtualProcess, outcomes: OutcomeLog) -> Controller:
        """Meet the mailbox."""
        link = TappedMailboxLink(self, self.clock, process, self.tap, self.address)
        return open_softmotion(link, outcomes=outcomes)

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
        if disturbance.kind is Hindrance.PENDANT:
            self._planned.append((disturbance, disturbance.at))
            return
        if disturbance.kind is Hindrance.ANOTHER_CLIENT:
            self._rivals.append((disturbance, disturbance.at))
            return
        self._simulator.faults.add(
            PlcFault(
                PlcFaultAction[disturbance.what],
                disturbance.at,
                disturbance.match,
                seconds=disturbance.seconds,
                position=disturbance.position,
            )
        )

    def disarm(self) -> int:
        """Forget what was planned; return how much was met."""
        faults = self._simulator.faults
        met = len(faults.fired)
        self._strange |= any(fault.action in _NEEDS_RESTART for fault in faults.fired)
        faults.clear()
        faults.fired.clear()
        self._planned.clear()
        self._rivals.clear()
        return met

    def taken_over(self, text: str) -> bool:
        """Tell whether another client's block takes the place of this one."""
        due = [one for one, left in self._rivals if one.match in text and not left]
        self._rivals = [
            (one, left - (one.match in text)) for one, left in self._rivals if one not in due
        ]
        return bool(due)

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
        self.touched.add(tool)

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

    def _requested(self, _number: int, text: str) -> None:
        waiting: list[tuple[Disturbance, int]] = []
        for disturbance, left in self._planned:
            if disturbance.match not in text:
                waiting.append((disturbance, left))
            elif left:
                waiting.append((disturbance, left - 1))
            else:
                slot = self._simulator.plc.memory.slot(1)
                if slot.defined:
                    old = _offset(slot.tool)
                    self.write_by_hand(1, ToolOffset(old.x_mm, old.y_mm, old.z_mm + 0.5))
        self._planned = waiting


class TappedMailboxLink(InProcessMailboxLink):
    """A process's link to a PLC, on which the adversary sees everything.

    Args:
        plant: Where it leads.
        clock: The virtual time.
        process: Whose it is.
        tap: Told of everything.
        address: Its URL.
        timeout_s: Longest wait for an answer.
    """

    def __init__(
        self,
        plant: SoftMotionPlant,
        clock: ManualClock,
        process: VirtualProcess,
        tap: WireTap,
        address: str,
        timeout_s: float = 3.0,
    ) -> None:
        self._process = process
        self._tap = tap
        self._address = address
        self._plant = plant
        self._plc = plant.simulator
        self._seen = SeenSession()
        self._last = SentKind.OTHER
        super().__init__(address, self._plc, clock, timeout_s)

    def write_command(self, words: Sequence[int]) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`."""
        forbidden = self._seen.written(words, self._plant.rejected)
        sent = replace(_classified(words), forbidden=forbidden)
        self._tap.leaving(self._process, sent)
        self._last = sent.kind
        replaced = self._plant.taken_over(sent.text)
        self._exchange(lambda now_ns: self._arriving(words, now_ns, replaced=replaced))
        self._tap.passed(self._process, f"wire sent {sent.text}")

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`."""
        self._asks("read_head")
        return super().read_head()

    def read_response(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_response`."""
        self._asks("read_response")
        words = super().read_response()
        self._seen.answered(words)
        self._process.overtaken |= self._seen.overtaken and self._last in _CHANGING
        self._tap.passed(self._process, f"wire received {words[1]} {words[2]} {words[-2]:04x}")
        return words

    def read_slot(self, slot: int) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_slot`."""
        self._asks(f"read_slot {slot}")
        return super().read_slot(slot)

    def read_device(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_device`."""
        self._asks("read_device")
        return super().read_device()

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`."""
        self._asks("beat")
        super().beat(word)

    def reopened(self, *, timeout_s: float) -> "TappedMailboxLink":
        """See :meth:`robolink.transport.MailboxLink.reopened`."""
        return TappedMailboxLink(
            self._plant, self.clock, self._process, self._tap, self._address, timeout_s
        )

    def _arriving(self, words: Sequence[int], now_ns: int, *, replaced: bool) -> ServedAccess:
        served = self._plc.write(0, words, now_ns)
        if replaced:
            self._plc.write(0, another_clients(words), now_ns)
        return served

    def _exchange(self, serve: Callable[[int], ServedAccess]) -> Words:
        try:
            return super()._exchange(serve)
        except TransportError:
            self._process.cut_off = True
            raise

    def _asks(self, text: str) -> None:
        self._tap.leaving(self._process, SentRequest(SentKind.OTHER, text))


def _classified(words: Sequence[int]) -> SentRequest:
    opcode, operand = words[_OPCODE], words[_I0]
    try:
        name = Opcode(opcode).name
    except ValueError:
        name = str(opcode)
    kind = _KINDS.get(Opcode(opcode), SentKind.OTHER) if name != str(opcode) else SentKind.OTHER
    if opcode == Opcode.STOP and operand:
        kind = SentKind.OTHER  # it releases the hold
    if opcode == Opcode.JOG and not any(words[_I0 : _I0 + 2]):
        kind = SentKind.STOP  # it ends the jog
    tool = operand if kind in (SentKind.WRITE, SentKind.SELECT) else None
    carried = " ".join(f"{word:04x}" for word in words[_OPCODE : COMMAND_WORDS - 3])
    return SentRequest(kind, f"{name} {words[0]}: {carried}", tool)


def _offset(tool: Sequence[float]) -> ToolOffset:
    x_mm, y_mm, z_mm, *_ = tool
    return ToolOffset(x_mm, y_mm, z_mm)
