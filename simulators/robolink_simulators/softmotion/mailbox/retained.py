"""What a PLC retains over a restart: its number, the tool slots, and two counters."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from robolink import runtime
from robolink.messages import tr
from robolink.protocols.mailbox import (
    SLOTS,
    Six,
    Slot,
    encode_device_id,
    encode_slot,
    next_number,
)
from robolink_simulators.state_files import StateFile

SCHEMA: Final = "robolink/plc-state/1"


class RetainedMemory:
    """The retained variables of the mailbox program (docs/reference/mailbox.md).

    Attributes:
        boot_id: Counts PLC starts; 0 before the first.
        epoch: Counts owners.
        device_id: The PLC's own number, never 0.
        tool_changed: Whether a client has changed a tool since the machine's program took this
            back (``xToolChanged``); it blocks its cycle meanwhile.

    Args:
        device_id: Its number; 0 draws one that no other has.
    """

    def __init__(self, device_id: int = 0) -> None:
        self.device_id = device_id or runtime.random_number(32)
        self.boot_id = 0
        self.epoch = 0
        self.tool_changed = False
        self._slots = dict.fromkeys(SLOTS, Slot())

    def slot(self, number: int) -> Slot:
        """Return the content of a slot."""
        return self._slots[number]

    def defined(self) -> dict[int, Slot]:
        """Return the slots that hold a tool."""
        return {number: slot for number, slot in self._slots.items() if slot.defined}

    def define(self, number: int, tool: Six, name: str) -> None:
        """Put a tool into a slot.

        Raises:
            BlockError: The name is no printable ASCII.
        """
        slot = Slot(next_number(self._slots[number].counter), defined=True, tool=tool, name=name)
        encode_slot(slot)
        self._slots[number] = slot

    def clear(self, number: int) -> None:
        """Empty a slot; an empty one is neither changed nor counted."""
        slot = self._slots[number]
        if slot.defined:
            self._slots[number] = Slot(next_number(slot.counter))

    def to_state(self) -> dict[str, object]:
        """Return all of it, ready for JSON."""
        slots = {str(number): asdict(slot) for number, slot in self._slots.items() if slot.counter}
        return {
            "boot_id": self.boot_id,
            "epoch": self.epoch,
            "device_id": self.device_id,
            "tool_changed": self.tool_changed,
            "slots": slots,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            KeyError, TypeError, ValueError: It is no such state.
        """
        slots = {int(number): _slot(held) for number, held in state["slots"].items()}
        if not slots.keys() <= self._slots.keys():
            raise ValueError(sorted(slots))
        self._slots.update(slots)
        self.boot_id, self.epoch = int(state["boot_id"]), int(state["epoch"])
        self.tool_changed = bool(state.get("tool_changed", False))
        # A file of an earlier simulator has none; the number drawn at the start stays.
        device_id = int(state.get("device_id", self.device_id))
        encode_device_id(device_id)
        self.device_id = device_id


def _slot(held: Mapping[str, Any]) -> Slot:
    x, y, z, a, b, c = map(float, held["tool"])
    tool = (x, y, z, a, b, c)
    slot = Slot(int(held["counter"]), bool(held["defined"]), tool, str(held["name"]))
    encode_slot(slot)
    return slot


class RetainedFile(StateFile):
    """Keeps retained memory in a file.

    Args:
        path: Where; ``None`` keeps nothing.
        memory: What.
        machine: Name of the kinematics, which the file must fit.
    """

    def __init__(self, path: Path | None, memory: RetainedMemory, machine: str) -> None:
        super().__init__(path)
        self._memory = memory
        self._machine = machine

    def _document(self) -> dict[str, object]:
        return {"schema": SCHEMA, "machine": self._machine, "memory": self._memory.to_state()}

    def _take(self, document: Any) -> bool:  # noqa: ANN401 - whatever the file holds
        if document["schema"] != SCHEMA or document["machine"] != self._machine:
            raise ValueError(document["machine"])
        self._memory.restore(document["memory"])
        return False  # the PLC starts, and counts this start

    def _foreign(self, path: Path) -> str:
        return tr(
            "{path} is not a saved state of a simulated PLC with {machine}.",
            path=path,
            machine=self._machine,
        )
