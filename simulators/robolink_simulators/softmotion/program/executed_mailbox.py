"""A mailbox program that is executed from its text, on the simulated axis group."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from robolink import runtime
from robolink.protocols.mailbox import (
    COMMAND,
    Capability,
    Command,
    Opcode,
    WordOrder,
    Words,
    encode_command,
)
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.mailbox.exchange import Inbox
from robolink_simulators.softmotion.mailbox.image import UserUnits
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.program.foreign_blocks import MotionBlocks, reading_blocks
from robolink_simulators.softmotion.program.foreign_types import (
    AXIS_GROUP,
    READ_MODE,
    SYMBOLS,
    ErrorNumbers,
    foreign_types,
    kinematics_types,
)
from robolink_simulators.softmotion.signals import SIGNALS
from robolink_simulators.structured_text import SourceText, StructuredProgram
from robolink_simulators.structured_text.data_types import DataType
from robolink_simulators.structured_text.program import ForeignParts

MAIN: Final = "RL_PRG"
SYMBOLS_OF_MAILBOX: Final = "RL_Symbols"
"""The list that a program for OPC UA has in the place of addresses."""
FIRST_LEFT_OUT: Final = 25
"""Number of cycles skipped at first while nothing happens. It doubles each time."""

_GOING: Final = 1
_REPLY: Final = 9
"""Indices in RL_Call: ``_GOING`` for a command in progress, ``_REPLY`` for the adapter's reply."""
_ENDED: Final = 10
"""Lowest state of a command that has ended."""
_HEARTBEAT: Final = 9
_CLIENT_HEARTBEAT: Final = COMMAND["client_heartbeat"].word
_TOOL_SLOT: Final = 11
_CAPABILITIES: Final = 90
_CRC: Final = 110
_A_STRANGER: Final = 0x5EE7_0001
_US: Final = 1000
_SETTLE_CYCLES: Final = 6


class ExecutedMailbox:
    """One mailbox program, executed in the cycles of its task.

    Args:
        group: The axis group.
        units: Of the mailbox.
        kinematics: The word that names the kinematics.
        sources: The program.
        options: The PLC's habits.

    Attributes:
        structured: The program.
        inbox: What clients have written.
        cycles: Cycles executed since the program was loaded.
        stands: Whether none is executed, as in a PLC that was stopped.

    Raises:
        StructuredTextError: A text is not in the subset.
    """

    def __init__(
        self,
        group: AxisGroup,
        units: UserUnits,
        kinematics: int,
        sources: Sequence[SourceText],
        options: PlcOptions,
    ) -> None:
        self.inbox = Inbox(WordOrder.LOW_FIRST)
        self.cycles = 0
        self.stands = False
        self._overrun = self._paced = 0
        # A PLC's clock starts at power-on, at an unknown time. From this clock the program
        # draws its number if none is given.
        self._began_us = 0 if options.mailbox.device_id else _US * runtime.random_number(31)
        self._group = group
        self._units = units
        self._kinematics = kinematics
        self._numbers = ErrorNumbers(options.group.numbers)
        self._cycle_ns = options.mailbox.program_cycle_us * 1000
        self._scanned_ns = -self._cycle_ns
        self._restless = True
        self._left_out = FIRST_LEFT_OUT
        self._permitted = True
        self._tool = group.tool
        self.structured = StructuredProgram(sources, MAIN, foreign=self._foreign(sources))
        self._shown = ("outbox", "slotWords")
        self._by_symbols = uses_symbols(sources)
        if self._by_symbols:
            self._shown = (f"{SYMBOLS_OF_MAILBOX}.response", f"{SYMBOLS_OF_MAILBOX}.slots")
        self._seen: object = ()

    @property
    def permitted(self) -> bool:
        """The machine's own permit (``xPermit``)."""
        return self._permitted

    @permitted.setter
    def permitted(self, on: bool) -> None:
        self._permitted, self._restless = on, True

    @property
    def capabilities(self) -> Capability:
        """What the program supports."""
        return Capability(self.words[_CAPABILITIES])

    @property
    def holder(self) -> int:
        """Token of the owner, 0 for nobody."""
        return int(self.structured.value("core.holder"))

    @property
    def selected(self) -> int:
        """The slot that was selected last, 0 for none."""
        return self.words[_TOOL_SLOT]

    @property
    def framed(self) -> Words:
        """The response between two counts of cycles, as a program for OPC UA shows it."""
        shown = self.structured.value(self._shown[0])
        if self._by_symbols:
            return tuple(shown)
        count = self.cycles & 0xFFFF
        return (count, *shown, count)

    @property
    def words(self) -> Words:
        """Response, slots and device block, one behind the other."""
        return (*self.framed[1:-1], *self.structured.value(self._shown[1]))

    def start(self, now_ns: int) -> None:
        """Give every variable what it holds at first; the first cycle is due."""
        self.structured.restart()
        self.inbox.zero()
        self._tool = self._group.tool
        self._wire()
        self._scanned_ns = now_ns // self._cycle_ns * self._cycle_ns - self._cycle_ns

    def tell_before(self, command: Words) -> None:
        """Carry out a command before time begins, as somebody did earlier today."""
        self.inbox.write(0, command)
        for _ in range(_SETTLE_CYCLES):
            self._scan(self._scanned_ns)
        self.inbox.zero()

    def seize(self, now_ns: int) -> None:
        """Let an unknown client take the mailbox, because a person insists."""
        self.refresh(now_ns)
        before = self.inbox.words
        command = Command(0xFFFF, Opcode.OWNERSHIP, operands=(1, 1, 0, 0), owner=_A_STRANGER)
        self.inbox.write(0, encode_command(command))
        self._scan(self._scanned_ns)
        self.inbox.write(0, before)
        self._restless = True

    def write(self, first: int, words: Words, now_ns: int) -> None:
        """Accept a client's write; the program sees it in the next cycle."""
        self.refresh(now_ns)
        self.inbox.write(first, words)
        self._restless = True

    def zero_inputs(self, now_ns: int) -> None:
        """Take the zeros that a fieldbus leaves when its watchdog expires."""
        self.refresh(now_ns)
        self.inbox.zero()
        self._restless = True

    def run(self, now_ns: int) -> None:
        """Do what is due now."""
        if now_ns >= self._due_ns:
            self._catch_up(now_ns)

    def refresh(self, now_ns: int) -> None:
        """Execute the cycle that began last, unless done, because somebody reads."""
        self._catch_up(now_ns)
        self._left_out = FIRST_LEFT_OUT

    def _catch_up(self, now_ns: int) -> None:
        began_ns = now_ns // self._cycle_ns * self._cycle_ns
        if began_ns > self._scanned_ns and not self.stands:
            self._scan(began_ns)

    def keep_pace(self, took_ns: int) -> None:
        """Skip cycles when one took more than half of the period to calculate.

        Args:
            took_ns: The simulated time that went by meanwhile.
        """
        if self.cycles != self._paced:
            self._paced = self.cycles
            self._overrun = 2 * took_ns // self._cycle_ns

    def next_change(self, now_ns: int) -> int | None:
        """Return when the next cycle is due that is not skipped."""
        return max(self._due_ns, (now_ns // self._cycle_ns + 1) * self._cycle_ns)

    @property
    def _due_ns(self) -> int:
        """When the next cycle begins that is not skipped; past when the program was stopped."""
        waits = 1 if self._restless else self._left_out
        return self._scanned_ns + max(waits, 1 + self._overrun) * self._cycle_ns

    def _scan(self, began_ns: int) -> None:
        self._scanned_ns = began_ns
        self.cycles += 1
        program, group = self.structured, self._group
        self._put_inbox()
        program.put("RL_Machine.xPermit", self._permitted)
        program.put("RL_Machine.xPowered", group.status().powered)
        program.put("RL_Machine.xAxisMoves", any(axis.moving_alone for axis in group.axes))
        program.put("RL_Machine.xImaged", self._imaged())
        if group.tool is not self._tool:
            program.put("RL_Machine.xForeignTool", True)
        inputs = [group.inputs.read(number, group.values) for number in range(SIGNALS)]
        program.put("RL_Machine.inputs", inputs)
        program.cycle(began_ns // _US + self._began_us)
        self._tool = group.tool
        self._switch_outputs()
        self._judge_rest()

    def _put_inbox(self) -> None:
        words = list(self.inbox.words)
        if not self._by_symbols:
            self.structured.put("inbox", words)
            return
        self.structured.put(f"{SYMBOLS_OF_MAILBOX}.heartbeat", words[_CLIENT_HEARTBEAT])
        words[_CLIENT_HEARTBEAT] = 0  # the array's own counts for nothing
        self.structured.put(f"{SYMBOLS_OF_MAILBOX}.command", words)

    def _switch_outputs(self) -> None:
        for number, on in enumerate(self.structured.value("RL_Machine.outputs")):
            if self._group.outputs.read(number) is not on:
                self._group.outputs.switch(number, on)

    def _judge_rest(self) -> None:
        """Skip a cycle when this one was like the one before and nothing is in progress."""
        words = self.framed[1:-1]
        still = (*words[:_HEARTBEAT], *words[_HEARTBEAT + 1 : _CRC])
        calls, seen = self._calls(), self._seen
        going = any((going or reply) and not (going and reply >= _ENDED) for going, reply in calls)
        moving = self._group.state is SmcGroupState.MOVING or not self._group.motion.resting
        self._seen = (still, calls)  # a held stop continues after its end was replied
        self._restless = self._seen != seen or going or moving
        self._left_out = FIRST_LEFT_OUT if self._restless else 2 * self._left_out

    def _calls(self) -> Sequence[tuple[bool, int]]:
        try:
            calls: Sequence[Sequence[Any]] = self.structured.value("calls")
        except KeyError:  # a program with another structure
            return ()
        return [(call[_GOING], call[_REPLY]) for call in calls]

    def _imaged(self) -> bool:
        rotation = self._group.flange().rotation
        return self._group.kinematics.orientation_image(rotation) is not None

    def _wire(self) -> None:
        """Give the program what an integrator writes into RL_Machine."""
        program, kinds = self.structured, self._group.kinematics.kinds
        given: Mapping[str, object] = {
            "xSimulated": True,
            "kinematics": self._kinematics,
            "axisCount": len(kinds),
            "unitMm": self._units.unit_um / 1000.0,
        }
        for name, value in given.items():
            program.put(f"RL_Machine.{name}", value)
        for name, number in self._numbers.members().items():
            program.put(f"RL_Machine.numbers.{name}", number)

    def _foreign(self, sources: Sequence[SourceText]) -> ForeignParts:
        own = kinematics_types(self._group.kinematics.name)
        blocks = MotionBlocks(self._units, self._numbers, self._group.kinematics)
        types: dict[str, DataType] = {**foreign_types(), **own}
        types |= blocks.blocks(list(own.values())[-1])
        types |= reading_blocks(self._units, self._numbers)
        symbols = {**SYMBOLS, READ_MODE: _read_modes(sources)}
        groups = dict.fromkeys(_group_names(sources), (AXIS_GROUP, self._group))
        return ForeignParts(types, symbols, groups)


def uses_symbols(sources: Sequence[SourceText]) -> bool:
    """Return whether a program gets its commands over OPC UA, from the list of symbols."""
    return any(f"{SYMBOLS_OF_MAILBOX}.command" in source.text for source in sources)


def _group_names(sources: Sequence[SourceText]) -> Sequence[str]:
    """Return what a program calls its axis group: the integrator writes the name of his own."""
    given = (re.findall(r"\bAxisGroup\s*:=\s*(\w+)", source.text) for source in sources)
    return [name for names in given for name in names]


def _read_modes(sources: Sequence[SourceText]) -> Sequence[str]:
    """Return the symbols of SMC_READ_TOOL_MODE in the order of the adapter's lines.

    No document names them: whatever the text calls them are the set tool, that of the active
    movement and that of the movement commanded last, one after the other.
    """
    named = (re.findall(r"SMC_READ_TOOL_MODE\.(\w+)", source.text) for source in sources)
    return [name for names in named for name in names]
