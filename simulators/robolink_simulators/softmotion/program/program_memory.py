"""The retained variables of a program that is executed, as the simulator keeps them."""

from collections.abc import Mapping
from typing import Any, Final

from robolink.protocols.mailbox import SLOTS, Six, Slot, encode_slot
from robolink_simulators.softmotion.mailbox.retained import RetainedMemory
from robolink_simulators.structured_text import StructuredProgram

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
        """Return what a slot holds."""
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
        """Empty a slot; an empty one is not changed, nor counted."""
        slot = self.slot(number)
        if slot.defined:
            self._put(number, Slot(slot.counter % 0xFFFF + 1))

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what ``to_state`` gave.

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
