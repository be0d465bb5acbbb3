"""What the PLC's program does: stores tools, takes new values over when asked."""

import random
from collections.abc import Mapping
from copy import deepcopy
from typing import Any, Generic, TypeVar

from robolink.register_maps import (
    ANGLES,
    AnyMap,
    CommitKind,
    PlacedNumber,
    PlacedSignal,
    SymbolMap,
    ToolSlot,
)
from robolink.timing import NS_PER_S
from robolink_simulators.plc.memory import PlcMemory
from robolink_simulators.state_files import drawn_number

Components = dict[str, float]
"""Components of an offset or a pose by name, in mm and degrees: only those in the map."""


MemoryT = TypeVar("MemoryT", bound=PlcMemory)
Slot = ToolSlot[PlacedNumber, PlacedSignal]


class PlcProgram(Generic[MemoryT]):
    """Tools, handshake and signals of one machine.

    Attributes:
        memory: What its server shows.
        cycle_s: How often the program runs where it counts its cycles, simulated seconds.
        in_force: What the machine works with, by tool.
        takeovers: How often values were taken over on a request.
        taken: How often they were taken over at all.
        answer_s: How long the program takes to answer a request, simulated seconds.
        refuse_with: Error number with which it refuses the next request, ``None`` for none.
        device_id: What tells this machine from every other one, kept over a restart.
        silent: Whether it lets requests stand without an answer.

    Args:
        register_map: Where everything stands.
        memory: Of that map.
        seed: Other tools.
    """

    def __init__(self, register_map: AnyMap, memory: MemoryT, seed: int = 1) -> None:
        self._map = register_map
        self._counts = register_map if isinstance(register_map, SymbolMap) else None
        self.memory = memory
        self.cycle_s = 0.004
        self._changes = 0
        self.in_force: dict[int, Components] = {}
        self.takeovers = self.taken = 0
        self.answer_s = 0.005
        self.refuse_with: int | None = None
        self.silent = False
        self.device_id = drawn_number()
        self._answer_at_ns: int | None = None
        chance = random.Random(f"plc {seed}")
        for slot in register_map.slots.values():
            self.set_tool(slot.tool, _some_tool(slot, chance))
        self._power_up()

    def set_tool(self, tool: int, components: Mapping[str, float]) -> None:
        """Let a person at the HMI give a tool other values."""
        slot = self._map.slots[tool]
        self._show(slot.components, components)
        self.memory.switch(slot.defined, True)
        self.in_force[tool] = self._stored(slot)
        self._count_change()

    def shown(self) -> dict[int, Components]:
        """Return the value in the registers, taken over or not."""
        return {slot.tool: self._stored(slot) for slot in self._map.slots.values()}

    def select(self, tool: int) -> None:
        """Let the machine select a tool."""
        self.memory.put(self._map.selected, tool)

    def place_flange(self, pose: Mapping[str, float]) -> None:
        """Let a person drive the head somewhere, mm and degrees by component."""
        self._show(self._map.flange, pose)

    def permit(self, on: bool) -> None:
        """Let the machine permit changes of offsets, or not."""
        self.memory.switch(self._map.permit, on)

    def written(self, now_ns: int) -> None:
        """React to what a client wrote."""
        commit = self._map.commit
        if commit.kind is CommitKind.NONE:
            self._take_over()
        elif not self.memory.is_on(commit.request):
            self._answer_at_ns = None
            for signal in (commit.answer, commit.busy, commit.error):
                self.memory.switch(signal, False)
            self._tell_error(0)
        elif self._idle and not self.silent:
            self.memory.switch(commit.busy, True)
            self._answer_at_ns = now_ns + round(self.answer_s * NS_PER_S)

    def advance(self, now_ns: int) -> None:
        """Answer a request whose time has come."""
        if self._counts is not None:
            cycles = int(now_ns / NS_PER_S / self.cycle_s)
            self.memory.put(self._counts.cycle_counter, cycles & 0xFFFFFFFF)
        if self._answer_at_ns is None or now_ns < self._answer_at_ns:
            return
        self._answer_at_ns = None
        commit = self._map.commit
        self.memory.switch(commit.busy, False)
        if self.refuse_with is not None:
            self._tell_error(self.refuse_with)
            self.memory.switch(commit.error, True)
            self.refuse_with = None
            return
        self._take_over()
        self.takeovers += 1
        self.memory.switch(commit.answer, True)

    def next_change(self) -> int | None:
        """Return when it will answer, if a request is in progress."""
        return self._answer_at_ns

    def moment(self) -> dict[str, Any]:
        """Return copies of its number, its tables, and its active values."""
        return {
            "device_id": self.device_id,
            "memory": self.memory.copied(),
            "in_force": deepcopy(self.in_force),
        }

    def put_back(self, moment: Mapping[str, Any]) -> None:
        """Restore what :meth:`moment` returned; a request in progress is dropped."""
        self.device_id, self._answer_at_ns = moment["device_id"], None
        self.memory.put_back(moment["memory"])
        self.in_force = deepcopy(moment["in_force"])

    @property
    def _idle(self) -> bool:
        commit = self._map.commit
        answered = self.memory.is_on(commit.answer) or self.memory.is_on(commit.error)
        return self._answer_at_ns is None and not answered

    def start_anew(self) -> None:
        """Switch the PLC off and on: its tools are retained, its signals are as at first."""
        self._answer_at_ns = None
        self.memory.switch(self._map.commit.request, False)
        for slot in self._map.slots.values():
            self._show(slot.components, self.in_force[slot.tool])
        self._power_up()

    def _power_up(self) -> None:
        if self._map.probe is not None:
            self.memory.show(self._map.probe.number, self._map.probe.value)
        self.memory.put_own_number(self.device_id)
        commit = self._map.commit
        for signal in (commit.answer, commit.busy, commit.error):
            self.memory.switch(signal, False)
        self.permit(True)
        self.select(min(self._map.slots))
        self.place_flange({"x": 300.0, "y": 100.0, "z": -20.0, "u": 0.0})

    def _take_over(self) -> None:
        self.taken += 1
        self.in_force = self.shown()
        self._count_change()

    def _tell_error(self, code: int) -> None:
        self.memory.put(self._map.commit.error_code, code)

    def _count_change(self) -> None:
        self._changes = self._changes + 1 & 0xFFFFFFFF
        if self._counts is not None:
            self.memory.put(self._counts.change_counter, self._changes)

    def _stored(self, slot: Slot) -> Components:
        return {name: self.memory.number(number) for name, number in slot.components.items()}

    def _show(self, places: Mapping[str, PlacedNumber], values: Mapping[str, float]) -> None:
        for name, number in places.items():
            self.memory.show(number, values.get(name, 0.0))


def _some_tool(slot: Slot, chance: random.Random) -> Components:
    """Return an offset that a nozzle may have, to a hundredth of a millimetre or degree."""
    most = {name: 90.0 if name in ANGLES else 20.0 for name in slot.components}
    return {name: round(chance.uniform(-limit, limit), 2) for name, limit in most.items()}
