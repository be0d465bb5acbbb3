"""A PLC whose mailbox program is executed from its own text.

Theory of operation. The task runs at multiples of its period. At each, the inputs of the machine
are put where the project wires them, the program is executed once, and its outputs are taken. A
cycle in which nothing was written or read, nothing is under way and nothing has moved may be left
out: at first 25 in a row, then twice as many each time. Heartbeat and timers go on in such steps.
On a computer that needs more than half of the period for a cycle, as many are left out as it
takes to keep up with the time.
"""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.protocols.mailbox import (
    RESPONSE_WORDS,
    SLOTS,
    Command,
    Opcode,
    Six,
    Slot,
    WordOrder,
    Words,
    encode_command,
    encode_slot,
    next_number,
)
from robolink.protocols.mailbox.exports import SYMBOL_LIST
from robolink_simulators.not_now import NotNowError
from robolink_simulators.softmotion.catalogue import MachineModel
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.plc import Plc
from robolink_simulators.softmotion.mailbox.retained import RetainedMemory
from robolink_simulators.softmotion.program.executed_mailbox import (
    ExecutedMailbox,
    uses_symbols,
)
from robolink_simulators.structured_text import SourceText, StructuredProgram, TextDialect

if TYPE_CHECKING:
    from robolink_simulators.softmotion.mailbox.simulator import PlcMaker


_MEMORY: Final = "RL_Kept.memory"
_TOOL_CHANGED: Final = "RL_Kept.xToolChanged"
_NAME_WORDS: Final = 8


class ProgramMemory(RetainedMemory):
    """Boot counter, epoch, number and slots where the program has them.

    Args:
        program: Holds ``RL_Kept.memory`` of the type RL_KeptMemory.
        device_id: The PLC's number; 0 lets the program draw one.
    """

    def __init__(self, program: StructuredProgram, device_id: int = 0) -> None:
        self._program = program
        super().__init__(device_id or 1)
        self.device_id = device_id

    @property
    def boot_id(self) -> int:
        """Counts PLC starts."""
        return int(self._program.value(f"{_MEMORY}.bootId"))

    @boot_id.setter
    def boot_id(self, number: int) -> None:
        self._program.put(f"{_MEMORY}.bootId", number)

    @property
    def epoch(self) -> int:
        """Counts owners."""
        return int(self._program.value(f"{_MEMORY}.epoch"))

    @epoch.setter
    def epoch(self, number: int) -> None:
        self._program.put(f"{_MEMORY}.epoch", number)

    @property
    def device_id(self) -> int:
        """The PLC's own number; 0 until a program draws it with its first command."""
        return int(self._program.value(f"{_MEMORY}.deviceId"))

    @device_id.setter
    def device_id(self, number: int) -> None:
        self._program.put(f"{_MEMORY}.deviceId", number)

    @property
    def tool_changed(self) -> bool:
        """Whether a client has changed a tool (``xToolChanged``)."""
        return bool(self._program.value(_TOOL_CHANGED))

    @tool_changed.setter
    def tool_changed(self, changed: bool) -> None:
        self._program.put(_TOOL_CHANGED, changed)

    def slot(self, number: int) -> Slot:
        """Return the content of a slot."""
        counter, filled, tool, words = self._held(number)
        letters = b"".join(word.to_bytes(2, "little") for word in words)
        name = letters.partition(b"\0")[0].decode("latin-1")
        x, y, z, a, b, c = tool
        return Slot(counter, defined=filled, tool=(x, y, z, a, b, c), name=name)

    def defined(self) -> dict[int, Slot]:
        """Return the slots that hold a tool."""
        found = {number: self.slot(number) for number in SLOTS}
        return {number: slot for number, slot in found.items() if slot.defined}

    def define(self, number: int, tool: Six, name: str) -> None:
        """Put a tool into a slot."""
        counter = self.slot(number).counter % 0xFFFF + 1
        self._put(number, Slot(counter, defined=True, tool=tool, name=name))

    def clear(self, number: int) -> None:
        """Empty a slot; an empty one is neither changed nor counted."""
        slot = self.slot(number)
        if slot.defined:
            self._put(number, Slot(slot.counter % 0xFFFF + 1))

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what ``to_state`` returned.

        Raises:
            KeyError, TypeError, ValueError: It is no such state.
        """
        plain = RetainedMemory(1)
        plain.restore(state)
        for number in SLOTS:
            self._put(number, plain.slot(number))
        self.boot_id, self.epoch = plain.boot_id, plain.epoch
        self.device_id, self.tool_changed = plain.device_id, plain.tool_changed

    def to_state(self) -> dict[str, object]:
        """Return all of it, ready for JSON."""
        self._slots = {number: self.slot(number) for number in SLOTS}
        return super().to_state()

    def _held(self, number: int) -> list[Any]:
        slots: list[list[Any]] = self._program.value(f"{_MEMORY}.slots")
        return slots[number - SLOTS.start]

    def _put(self, number: int, slot: Slot) -> None:
        encode_slot(slot)
        held = self._held(number)
        letters = slot.name.encode("ascii").ljust(2 * _NAME_WORDS, b"\0")
        held[0], held[1] = slot.counter, slot.defined
        held[2][:] = list(slot.tool)
        held[3][:] = [int.from_bytes(letters[at : at + 2], "little") for at in range(0, 16, 2)]


PROGRAM_SOURCES: Final = (
    ("robolink_core.st", TextDialect.COMMON),
    ("RL_Kept.st", TextDialect.CODESYS),
    ("RL_Machine.st", TextDialect.CODESYS),
    ("robolink_softmotion.st", TextDialect.CODESYS),
    ("robolink_program.st", TextDialect.CODESYS),
)
"""Source files that are executed, each with the dialect that it may use. In a program for OPC UA
the list of its symbols stands before the last."""

_SOMEBODY: Final = 0x5EE7_0002
_FIRST_SLOT: Final = 1


class StructuredPlc(Plc):
    """A controller, without its fieldbus, that executes Structured Text.

    Args:
        model: Kinematics and drives.
        parameters: Those of the kinematics.
        options: The PLC's habits; what only a modelled program has is refused.
        sources: The program.

    Raises:
        ConfigError: The program cannot be read, or an option does not go with one.
    """

    executes_program = True

    def __init__(
        self,
        model: MachineModel,
        parameters: Mapping[str, float],
        options: PlcOptions,
        sources: Iterable[SourceText],
    ) -> None:
        super().__init__(model, parameters, options)
        mailbox = options.mailbox
        if mailbox.word_order != "low_first" or not mailbox.identified:
            raise _not_in_a_program()
        self._executed = ExecutedMailbox(
            self.group, self._units, self.tools.kinematics_code, tuple(sources), options
        )
        self.memory = ProgramMemory(self._executed.structured, mailbox.device_id)
        self.program = self._executed

    def start(self, now_ns: int) -> None:
        """Start the PLC; the first cycle of the program finds the drives switched on."""
        super().start(now_ns)
        self._executed.refresh(now_ns)
        self._take_over()

    def make_ready(self, tool: CoordRef) -> None:
        """Enable the group; somebody takes the mailbox, selects slot 1 and releases it."""
        if self.group.state is SmcGroupState.DISABLED:
            self.group.enable()
        x, y, z, a, b, c = self._units.given(tool)
        self.memory.define(_FIRST_SLOT, (x, y, z, a, b, c), "nozzle")
        epoch_before = self.memory.epoch
        sequence, epoch = 1, 0
        wanted = ((Opcode.OWNERSHIP, 1), (Opcode.SELECT_TOOL, _FIRST_SLOT), (Opcode.OWNERSHIP, 0))
        for opcode, operand in wanted:
            command = Command(
                sequence, opcode, operands=(operand, 0, 0, 0), owner=_SOMEBODY, epoch=epoch
            )
            self._executed.tell_before(encode_command(command))
            sequence, epoch = next_number(sequence), self.memory.epoch
        self.memory.tool_changed = False  # the machine's program has seen the change
        self.memory.epoch = epoch_before
        self._take_over()

    def lay_words(self, order: WordOrder) -> None:
        """Refuse: the text of the program decides the order of its words."""
        del order
        raise _not_in_a_program()

    def freeze_heartbeat(self, now_ns: int) -> None:
        """Refuse: the heartbeat is the program's own."""
        del now_ns
        raise _not_in_a_program()

    def freeze(self, now_ns: int) -> None:
        """Stop the mailbox program; what moves continues."""
        super().freeze(now_ns)
        self._executed.stands = True

    def thaw(self) -> None:
        """Continue the mailbox program."""
        super().thaw()
        self._executed.stands = False

    def keep_pace(self, took_ns: int) -> None:
        """Let the program skip cycles on a computer that is too slow for all of them."""
        self._executed.keep_pace(took_ns)

    def output(self, now_ns: int) -> Words:
        """Return response, slots and device block, one behind the other."""
        if self._frozen is not None:
            return self._frozen
        self._executed.refresh(now_ns)
        self._take_over()
        return self._executed.words

    def response(self, now_ns: int) -> Words:
        """Return the response block."""
        return self.output(now_ns)[:RESPONSE_WORDS]

    def framed(self, now_ns: int) -> Words:
        """Return the response between two counts of cycles, which are the program's own."""
        self.output(now_ns)
        return self._executed.framed

    def read(self, first: int, count: int, now_ns: int) -> Words:
        """Return words of response, slots and device block."""
        shown = self.output(now_ns)[first + self.shift :][:count]
        return shown + (0,) * (count - len(shown)) if self.shift else shown

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, which is at most :meth:`next_change`."""
        super().advance(now_ns)
        self._take_over()

    def _take_over(self) -> None:
        self.tools.selected = self._executed.selected

    def _begin_program(self, now_ns: int) -> None:
        self._executed.start(now_ns)


def program_plc(
    sources: Iterable[SourceText],
) -> Callable[[MachineModel, Mapping[str, float], PlcOptions], Plc]:
    """Return what makes a PLC that executes these texts, for ``SoftMotionSimulator``."""
    texts = tuple(sources)
    return lambda model, parameters, options: StructuredPlc(model, parameters, options, texts)


def sources_in(folder: Path) -> tuple[SourceText, ...]:
    """Return the texts of a program that ``plc export`` wrote, changed or not.

    Raises:
        ConfigError: A file is missing, or cannot be read.
    """
    sources = [_source_in(folder, name, dialect) for name, dialect in PROGRAM_SOURCES]
    if uses_symbols(sources):
        sources.insert(-1, _source_in(folder, SYMBOL_LIST, TextDialect.CODESYS))
    return tuple(sources)


def _source_in(folder: Path, name: str, dialect: TextDialect) -> SourceText:
    try:
        text = read_named(folder / name).decode()
    except (OSError, UnicodeError) as error:
        raise ConfigError(
            tr("{path} cannot be read: {cause}.", path=folder / name, cause=error),
            remedy=tr("Name a folder that 'robolink expert plc export' has written."),
        ) from error
    return SourceText(name, text, dialect)


def _not_in_a_program() -> NotNowError:
    return NotNowError(
        tr("A program that is executed from its text cannot be changed like that."),
        remedy=tr("Change its text, or simulate without one."),
    )


def plc_maker(folder: Path | None) -> "PlcMaker":
    """Return what makes the controller of a ``SoftMotionSimulator``.

    The interpreter is loaded only where a program is to be executed.

    Args:
        folder: Holds a program as ``expert plc export`` writes it, changed or not; ``None`` for
            the modelled program.

    Raises:
        ConfigError: A file of the program is missing, or cannot be read.
    """
    if folder is None:
        return Plc
    return program_plc(sources_in(folder))
