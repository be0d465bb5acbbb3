"""What the PLC's program does: stores tools, takes new values over when asked."""

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from typing import Any, Final

from robolink.register_maps import (
    ANGLES,
    CommitKind,
    MapSlot,
    Number,
    RegisterMap,
    RegisterTable,
    Signal,
)
from robolink.timing import NS_PER_S
from robolink_simulators.hosting.modbus_frames import decode, encode
from robolink_simulators.state_files import drawn_number

_BEYOND: Final = 16
"""Number of registers that a table has after the last address of the map."""


class OutsideError(Exception):
    """An address that the server does not have."""


class Memory:
    """Registers and bits by address; all zero at first.

    Args:
        used: The places that a map takes.
    """

    def __init__(self, used: Iterable[tuple[RegisterTable, range]]) -> None:
        self._sizes = dict.fromkeys(RegisterTable, 0)
        for table, addresses in used:
            self._sizes[table] = max(self._sizes[table], addresses.stop + _BEYOND)
        self._values: dict[tuple[RegisterTable, int], int] = {}

    def read(self, table: RegisterTable, addresses: range) -> list[int]:
        """Return the values there.

        Raises:
            OutsideError: The table ends before.
        """
        self._require(table, addresses)
        return [self._values.get((table, address), 0) for address in addresses]

    def write(self, table: RegisterTable, address: int, values: Sequence[int]) -> None:
        """Store ``values`` from ``address`` on; raises as :meth:`read`."""
        self._require(table, range(address, address + len(values)))
        for offset, value in enumerate(values):
            self._values[table, address + offset] = value

    def copied(self) -> dict[tuple[RegisterTable, int], int]:
        """Return a copy of all values."""
        return dict(self._values)

    def put_back(self, values: Mapping[tuple[RegisterTable, int], int]) -> None:
        """Restore what :meth:`copied` returned."""
        self._values = dict(values)

    def is_on(self, signal: Signal | None) -> bool:
        """Return whether a signal is on; none is off."""
        if signal is None:
            return False
        value = self._values.get((signal.table, signal.address), 0)
        if signal.bit is not None:
            value = value >> signal.bit & 1
        return value == signal.on

    def switch(self, signal: Signal | None, on: bool) -> None:
        """Let the PLC's program switch a signal of its own."""
        if signal is None:
            return
        place = signal.table, signal.address
        if signal.bit is None:
            off = 1 - signal.on if signal.table.holds_bits else signal.off
            self._values[place] = signal.on if on else off
            return
        mask, bit = 1 << signal.bit, signal.on if on else 1 - signal.on
        self._values[place] = self._values.get(place, 0) & ~mask | bit << signal.bit

    def zero(self, table: RegisterTable) -> None:
        """Zero a whole table, as a watchdog does (docs/reference/softmotion.md 4.1)."""
        self._values = {place: v for place, v in self._values.items() if place[0] is not table}

    def _require(self, table: RegisterTable, addresses: range) -> None:
        if addresses.stop > self._sizes[table]:
            raise OutsideError


Components = dict[str, float]
"""Components of an offset or a pose by name, in mm and degrees: only those in the map."""


class PlcProgram:
    """Tools, handshake and signals of one machine.

    Attributes:
        in_force: What the machine works with, by tool.
        takeovers: How often values were taken over on a request.
        taken: How often they were taken over at all.
        answer_s: How long the program takes to answer a request, simulated seconds.
        refuse_with: Error number with which it refuses the next request, ``None`` for none.
        device_id: What tells this machine from every other one, kept over a restart.
        silent: Whether it lets requests stand without an answer.

    Args:
        register_map: Where everything stands.
        seed: Other tools.
    """

    def __init__(self, register_map: RegisterMap, seed: int = 1) -> None:
        self._map = register_map
        self.memory = Memory(_used(register_map))
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

    def shown(self) -> dict[int, Components]:
        """Return the value in the registers, taken over or not."""
        return {slot.tool: self._stored(slot) for slot in self._map.slots.values()}

    def select(self, tool: int) -> None:
        """Let the machine select a tool."""
        if self._map.selected is not None:
            self.memory.write(self._map.selected.table, self._map.selected.address, [tool])

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
            number = self._map.probe.number
            self.memory.write(number.table, number.address, encode(number, self._map.probe.value))
        place = self._map.device_id
        if place is not None:
            shifts = range(16 * (place.count - 1), -1, -16)
            words = [self.device_id >> shift & 0xFFFF for shift in shifts]
            self.memory.write(place.table, place.address, words)
        commit = self._map.commit
        for signal in (commit.answer, commit.busy, commit.error):
            self.memory.switch(signal, False)
        self.permit(True)
        self.select(min(self._map.slots))
        self.place_flange({"x": 300.0, "y": 100.0, "z": -20.0, "u": 0.0})

    def _take_over(self) -> None:
        self.taken += 1
        self.in_force = self.shown()

    def _tell_error(self, code: int) -> None:
        word = self._map.commit.error_code
        if word is not None:
            self.memory.write(word.table, word.address, [code])

    def _stored(self, slot: MapSlot) -> Components:
        return {
            name: decode(number, self.memory.read(number.table, number.registers))
            for name, number in slot.components.items()
        }

    def _show(self, places: Mapping[str, Number], values: Mapping[str, float]) -> None:
        for name, number in places.items():
            self.memory.write(number.table, number.address, encode(number, values.get(name, 0.0)))


def _some_tool(slot: MapSlot, chance: random.Random) -> Components:
    """Return an offset that a nozzle may have, to a hundredth of a millimetre or degree."""
    most = {name: 90.0 if name in ANGLES else 20.0 for name in slot.components}
    return {name: round(chance.uniform(-limit, limit), 2) for name, limit in most.items()}


def _used(register_map: RegisterMap) -> Iterator[tuple[RegisterTable, range]]:
    commit = register_map.commit
    numbers = [n for slot in register_map.slots.values() for n in slot.components.values()]
    numbers += register_map.flange.values()
    if register_map.probe is not None:
        numbers.append(register_map.probe.number)
    yield from ((number.table, number.registers) for number in numbers)
    if register_map.device_id is not None:
        yield register_map.device_id.table, register_map.device_id.registers
    single = [
        commit.request,
        commit.answer,
        commit.busy,
        commit.error,
        commit.error_code,
        commit.tool_number,
        register_map.permit,
        register_map.selected,
        *(slot.defined for slot in register_map.slots.values()),
        *(one.signal for one in register_map.inputs.values()),
    ]
    for place in single:
        if place is not None:
            yield place.table, range(place.address, place.address + 1)
