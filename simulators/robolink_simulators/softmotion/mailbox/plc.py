"""A PLC: the axis group, its retained memory, and the mailbox program from start to start."""

from collections.abc import Mapping
from typing import ClassVar, Final, Protocol

from robolink.protocols.mailbox import (
    COMMAND_WORDS,
    DEVICE_START,
    RESPONSE,
    RESPONSE_WORDS,
    SLOT_WORDS,
    Capability,
    WordOrder,
    Words,
    next_number,
)
from robolink_simulators.device.wire_time import WireTime
from robolink_simulators.softmotion.catalogue import MachineModel
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox.exchange import Inbox
from robolink_simulators.softmotion.mailbox.image import UserUnits
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.outbox import HEAD, Outbox
from robolink_simulators.softmotion.mailbox.program import MailboxProgram
from robolink_simulators.softmotion.mailbox.retained import RetainedMemory
from robolink_simulators.softmotion.mailbox.tool_commands import ToolDesk

_PRESET_SLOT: Final = 1
_HEARTBEAT: Final = RESPONSE["plc_heartbeat"].word


class RunningProgram(Protocol):
    """A mailbox program from one PLC start to the next, as the rest of the PLC sees it."""

    @property
    def inbox(self) -> Inbox:
        """What clients have written."""

    @property
    def capabilities(self) -> Capability:
        """What it supports."""

    @property
    def holder(self) -> int:
        """Token of the owner, 0 for nobody."""

    permitted: bool
    """The machine's own permit (``xPermit``)."""

    def write(self, first: int, words: Words, now_ns: int) -> None:
        """Take what a client writes."""

    def run(self, now_ns: int) -> None:
        """Do what is due now."""

    def zero_inputs(self, now_ns: int) -> None:
        """Take the zeros that a fieldbus leaves when its watchdog expires."""

    def next_change(self, now_ns: int) -> int | None:
        """Return when ``run`` will next do something by itself, if ever."""

    def seize(self, now_ns: int) -> None:
        """Let an unknown client take the mailbox, because a person insists."""


class Plc:
    """The controller, without its fieldbus. Time is given, never taken.

    Args:
        model: Kinematics and drives.
        parameters: Those of the kinematics.
        options: The PLC's habits.

    Attributes:
        group: The axis group.
        memory: The retained variables.
        tools: Slots and the selected tool.
        program: The mailbox program since the last start.
        starts: PLC starts so far.
        cuts: How often its cable was pulled; hosts end their connections then.
        shift: How many words behind what they mean clients read and write.
        estop_pressed: Whether the drives are kept without power.
        wire_time: By which its program counts the silence of clients, from the next start on.
        executes_program: Whether its mailbox program is executed from its own text.
    """

    executes_program: ClassVar[bool] = False

    def __init__(
        self, model: MachineModel, parameters: Mapping[str, float], options: PlcOptions
    ) -> None:
        self._options = options
        self.wire_time = WireTime()
        self._kinematics = model.kinematics
        self.group = AxisGroup(model.kinematics, model.limits, options.group)
        self.memory = RetainedMemory(options.mailbox.device_id)
        self._order = WordOrder[options.mailbox.word_order.upper()]
        self._units = UserUnits(options.mailbox.unit_um)
        self.tools = ToolDesk(self.group, self.memory, self._units, parameters)
        self._outbox = Outbox(
            self.group,
            self.memory,
            self.tools,
            self._units,
            order=self._order,
            identified=options.mailbox.identified,
        )
        self.starts = self.cuts = 0
        self.shift = 0
        self._beating_until_ns: int | None = None
        self.estop_pressed = False
        self._start_ns = 0
        self._frozen: Words | None = None
        self._modelled = self._new_program()
        self.program: RunningProgram = self._modelled

    @property
    def frozen(self) -> bool:
        """Whether the mailbox program is stopped."""
        return self._frozen is not None

    def start(self, now_ns: int) -> None:
        """Start the PLC: movements end, the tool is gone, nobody owns the mailbox.

        The machine's program switches the drives on. With the profile ``tools`` it also
        enables the group, because no client can (assumed).
        """
        self.group.restart(self._kinematics)
        self.starts += 1
        self._start_ns, self._frozen, self._beating_until_ns = now_ns, None, None
        self.tools.forget()
        permitted = self.program.permitted
        self._begin_program(now_ns)
        self.program.permitted = permitted
        self.group.power(on=not self.estop_pressed)
        if self._options.mailbox.profile == "tools":
            self.group.enable()

    def make_ready(self, tool: CoordRef) -> None:
        """Enable the group and select slot 1 with a tool, as somebody did earlier today."""
        if self.group.state is SmcGroupState.DISABLED:
            self.group.enable()
        self.tools.preset(_PRESET_SLOT, tool)

    def freeze(self, now_ns: int) -> None:
        """Stop the mailbox program; what moves continues."""
        self._frozen = self.output(now_ns)

    def freeze_heartbeat(self, now_ns: int) -> None:
        """Stop the heartbeat, and nothing else, until the next start."""
        self._beating_until_ns = now_ns

    def lay_words(self, order: WordOrder) -> None:
        """Lay values of several words in another order from now on."""
        self._order = order
        self._outbox.lay_words(order)
        self._modelled.inbox.lay_words(order)

    def thaw(self) -> None:
        """Continue the mailbox program."""
        self._frozen = None

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, which is at most :meth:`next_change`."""
        self.group.advance(now_ns)
        if not self.frozen:
            self.program.run(now_ns)

    def next_change(self, now_ns: int) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
        change = self.group.next_change()
        if self.frozen:
            return change
        look_ns = self.program.next_change(now_ns)
        if change is None or look_ns is None:
            return look_ns if change is None else change
        return min(change, look_ns)

    def keep_pace(self, took_ns: int) -> None:
        """Note how much simulated time passed while this computer calculated one step."""
        del took_ns  # only a program that is executed cycle by cycle uses it

    def output(self, now_ns: int) -> Words:
        """Return response, slots and device block, one behind the other."""
        return self._frozen or self._outbox.words(self._modelled, self._heartbeat(now_ns))

    def response(self, now_ns: int) -> Words:
        """Return the response block."""
        if self._frozen is not None:
            return self._frozen[:RESPONSE_WORDS]
        return self._outbox.response(self._modelled, self._heartbeat(now_ns))

    def framed(self, now_ns: int) -> Words:
        """Return the response between two counts of PLC cycles, as OPC UA shows it."""
        words = self.read(0, RESPONSE_WORDS, now_ns)
        count = words[_HEARTBEAT] if self.frozen else self._cycles(now_ns)
        return (count, *words, count)

    def read(self, first: int, count: int, now_ns: int) -> Words:
        """Return words of response, slots and device block."""
        if self.shift:
            shifted = self.output(now_ns)[first + self.shift :][:count]
            return shifted + (0,) * (count - len(shifted))
        slot, offset = divmod(first - RESPONSE_WORDS, SLOT_WORDS)
        if self._frozen is None and first + count <= HEAD.words:
            told = self._outbox.head(self._modelled, self._heartbeat(now_ns))
            return told[first : first + count]
        if first + count <= RESPONSE_WORDS:
            return self.response(now_ns)[first : first + count]
        if first >= DEVICE_START:
            return self._outbox.device()[first - DEVICE_START :][:count]
        if slot >= 0 and offset + count <= SLOT_WORDS:
            return self._outbox.slot(slot + 1)[offset : offset + count]
        return self.output(now_ns)[first : first + count]

    def write(self, first: int, words: Words, now_ns: int) -> None:
        """Take words of the command block that a client has written."""
        room = COMMAND_WORDS - first - self.shift
        if room > 0 and words:
            self.program.write(first + self.shift, words[:room], now_ns)

    def _heartbeat(self, now_ns: int) -> int:
        return self._cycles(now_ns if self._beating_until_ns is None else self._beating_until_ns)

    def _cycles(self, until_ns: int) -> int:
        cycle_ns = self._options.group.cycle_us * 1000
        return (until_ns - self._start_ns) // cycle_ns & 0xFFFF

    def _begin_program(self, now_ns: int) -> None:
        """Start the mailbox program anew; it counts the start."""
        del now_ns  # only a program that counts time uses it
        self.memory.boot_id = next_number(self.memory.boot_id)
        self._modelled = self._new_program()
        self.program = self._modelled

    def _new_program(self) -> MailboxProgram:
        program = MailboxProgram(
            self.group,
            self.memory,
            self.tools,
            self._units,
            options=self._options.mailbox,
            wire_time=self.wire_time,
        )
        program.inbox.lay_words(self._order)
        return program
