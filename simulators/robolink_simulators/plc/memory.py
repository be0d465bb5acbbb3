"""What a PLC keeps at the places of a map: registers and coils, or the variables of a program."""

import struct
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Final

from robolink.register_maps import (
    Number,
    NumberType,
    RegisterMap,
    RegisterTable,
    Signal,
    SymbolCell,
    SymbolMap,
    SymbolNumber,
    SymbolSignal,
    SymbolWord,
    Word,
)
from robolink_simulators.hosting.modbus_frames import decode, encode

_BEYOND: Final = 16
"""Number of registers that a table has after the last address of the map."""


class OutsideError(Exception):
    """An address that the server does not have."""


class PlcMemory(ABC):
    """The memory behind one map, as its program sees it; what it holds is zero at first."""

    @abstractmethod
    def number(self, number: Any) -> float:  # noqa: ANN401 - each kind of place has its own
        """Return a length or an angle, in mm or degrees."""

    @abstractmethod
    def show(self, number: Any, value: float) -> None:  # noqa: ANN401 - as above
        """Let the program store a length or an angle."""

    @abstractmethod
    def is_on(self, signal: Any) -> bool:  # noqa: ANN401 - as above
        """Return whether a signal is on; none is off."""

    @abstractmethod
    def switch(self, signal: Any, on: bool) -> None:  # noqa: ANN401 - as above
        """Let the program switch a signal of its own; nothing where there is none."""

    @abstractmethod
    def word(self, word: Any) -> int:  # noqa: ANN401 - as above
        """Return a whole number."""

    @abstractmethod
    def put(self, word: Any, value: int) -> None:  # noqa: ANN401 - as above
        """Let the program store a whole number; nothing where there is no place for it."""

    @abstractmethod
    def put_own_number(self, value: int) -> None:
        """Store what tells this machine from every other one, if the map has it."""

    @abstractmethod
    def copied(self) -> object:
        """Return a copy of all values."""

    @abstractmethod
    def put_back(self, values: Any) -> None:  # noqa: ANN401 - what the same class has made
        """Restore what :meth:`copied` returned."""


class Memory(PlcMemory):
    """Registers and bits by address.

    Args:
        register_map: The map whose places it has.
    """

    def __init__(self, register_map: RegisterMap) -> None:
        self._own_number = register_map.device_id
        self._sizes = dict.fromkeys(RegisterTable, 0)
        for table, addresses in _used(register_map):
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

    def number(self, number: Number) -> float:
        """See :meth:`PlcMemory.number`."""
        return decode(number, self.read(number.table, number.registers))

    def show(self, number: Number, value: float) -> None:
        """See :meth:`PlcMemory.show`."""
        self.write(number.table, number.address, encode(number, value))

    def word(self, word: Word) -> int:
        """See :meth:`PlcMemory.word`."""
        return self._values.get((word.table, word.address), 0)

    def put(self, word: Word | None, value: int) -> None:
        """See :meth:`PlcMemory.put`."""
        if word is not None:
            self.write(word.table, word.address, [value])

    def put_own_number(self, value: int) -> None:
        """See :meth:`PlcMemory.put_own_number`."""
        place = self._own_number
        if place is not None:
            shifts = range(16 * (place.count - 1), -1, -16)
            self.write(place.table, place.address, [value >> shift & 0xFFFF for shift in shifts])

    def copied(self) -> dict[tuple[RegisterTable, int], int]:
        """Return a copy of all values."""
        return dict(self._values)

    def put_back(self, values: Mapping[tuple[RegisterTable, int], int]) -> None:
        """Restore what :meth:`copied` returned."""
        self._values = dict(values)

    def is_on(self, signal: Signal | None) -> bool:
        """See :meth:`PlcMemory.is_on`."""
        if signal is None:
            return False
        value = self._values.get((signal.table, signal.address), 0)
        if signal.bit is not None:
            value = value >> signal.bit & 1
        return value == signal.on

    def switch(self, signal: Signal | None, on: bool) -> None:
        """See :meth:`PlcMemory.switch`."""
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


_KINDS: Final = {
    NumberType.INT16: "Int16",
    NumberType.UINT16: "UInt16",
    NumberType.INT32: "Int32",
    NumberType.UINT32: "UInt32",
    NumberType.REAL: "Float",
    NumberType.LREAL: "Double",
}
_WORD: Final = "UInt32"
"""Type of a whole number for which the map has none: a UDINT."""


@dataclass(slots=True)
class SymbolVariable:
    """One variable of the program, which the server shows as one node.

    Attributes:
        kind: Built-in type of OPC UA, of an array that of its elements; empty for a structure.
        value: A number or a bool, a list of them, or a dictionary by field.
        kinds: Of a structure, the built-in type of each field.
        written: Whether a client may write it, as far as the map tells.
    """

    kind: str
    value: Any
    kinds: dict[str, str]
    written: bool = False


class SymbolMemory(PlcMemory):
    """The variables of a program by node.

    Attributes:
        variables: By the whole name of the node.

    Args:
        symbol_map: The map whose places it has: a single value, an array or a flat structure each.

    Raises:
        ValueError: A place is deeper inside a structure.
    """

    def __init__(self, symbol_map: SymbolMap) -> None:
        self._map = symbol_map
        self.variables: dict[str, SymbolVariable] = {}
        for kind, place in _symbols(symbol_map):
            self._make(kind, place)
        commit = symbol_map.commit
        for slot in symbol_map.slots.values():
            for number in slot.components.values():
                self.variables[number.cell.node].written = True
        flags = [slot.defined for slot in symbol_map.slots.values()]
        for own in (*flags, commit.request, commit.tool_number):
            if own is not None:
                self.variables[own.cell.node].written = True

    def number(self, number: SymbolNumber) -> float:
        """See :meth:`PlcMemory.number`."""
        return float(self._get(number.cell)) * number.factor

    def show(self, number: SymbolNumber, value: float) -> None:
        """See :meth:`PlcMemory.show`; a whole number is the nearest one that fits."""
        raw = value / number.factor + 0.0
        if number.type.whole:
            bits = 16 * number.type.words
            lowest = -(1 << bits - 1) if number.type in _SIGNED else 0
            self._set(number.cell, round(min(max(raw, lowest), lowest + (1 << bits) - 1)))
        elif number.type is NumberType.REAL:
            self._set(number.cell, struct.unpack("<f", struct.pack("<f", raw))[0])
        else:
            self._set(number.cell, raw)

    def word(self, word: SymbolWord) -> int:
        """See :meth:`PlcMemory.word`."""
        return int(self._get(word.cell))

    def put(self, word: SymbolWord | None, value: int) -> None:
        """See :meth:`PlcMemory.put`."""
        if word is not None:
            self._set(word.cell, value)

    def put_own_number(self, value: int) -> None:
        """See :meth:`PlcMemory.put_own_number`."""
        self.put(self._map.device_id, value & 0xFFFFFFFF)

    def is_on(self, signal: SymbolSignal | None) -> bool:
        """See :meth:`PlcMemory.is_on`."""
        if signal is None:
            return False
        value = int(self._get(signal.cell))
        return (value if signal.bit is None else value >> signal.bit & 1) == signal.on

    def switch(self, signal: SymbolSignal | None, on: bool) -> None:
        """See :meth:`PlcMemory.switch`."""
        if signal is None:
            return
        held = self._get(signal.cell)
        if isinstance(held, bool):
            self._set(signal.cell, bool(signal.on if on else 1 - signal.on))
        elif signal.bit is None:
            self._set(signal.cell, signal.on if on else signal.off)
        else:
            bit = signal.on if on else 1 - signal.on
            self._set(signal.cell, held & ~(1 << signal.bit) | bit << signal.bit)

    def copied(self) -> dict[str, Any]:
        """Return a copy of all values."""
        return {node: deepcopy(one.value) for node, one in self.variables.items()}

    def put_back(self, values: Mapping[str, Any]) -> None:
        """Restore what :meth:`copied` returned."""
        for node, value in values.items():
            self.variables[node].value = deepcopy(value)

    def _make(self, kind: str, place: SymbolNumber | SymbolSignal | SymbolWord) -> None:
        node, steps = place.cell
        zero = False if kind == "Boolean" else 0.0 if kind in ("Float", "Double") else 0
        match steps:
            case ():
                self.variables.setdefault(node, SymbolVariable(kind, zero, {}))
            case (int(),):
                value = [zero] * (place.length or 0)
                self.variables.setdefault(node, SymbolVariable(kind, value, {}))
            case (str(name),):
                one = self.variables.setdefault(node, SymbolVariable("", {}, {}))
                one.value.setdefault(name, zero)
                one.kinds.setdefault(name, kind)
            case _:
                raise ValueError(f"{place.cell.place}: deeper than a field")

    def _get(self, cell: SymbolCell) -> Any:  # noqa: ANN401 - a bool or a number
        value = self.variables[cell.node].value
        return value[cell.steps[0]] if cell.steps else value

    def _set(self, cell: SymbolCell, value: Any) -> None:  # noqa: ANN401 - as above
        """Store a value in place of the former one, never into it: a reader may hold that."""
        one = self.variables[cell.node]
        if not cell.steps:
            one.value = value
            return
        made = one.value.copy()
        made[cell.steps[0]] = value
        one.value = made


_SIGNED: Final = (NumberType.INT16, NumberType.INT32)


def _symbols(
    symbol_map: SymbolMap,
) -> Iterable[tuple[str, SymbolNumber | SymbolSignal | SymbolWord]]:
    """Yield all places of a map with their built-in types; what has bits or a 2 is no BOOL."""
    commit = symbol_map.commit
    numbers = [n for slot in symbol_map.slots.values() for n in slot.components.values()]
    numbers += symbol_map.flange.values()
    if symbol_map.probe is not None:
        numbers.append(symbol_map.probe.number)
    yield from ((_KINDS[number.type], number) for number in numbers)
    signals = [
        *(commit.request, commit.answer, commit.busy, commit.error, symbol_map.permit),
        *(slot.defined for slot in symbol_map.slots.values()),
        *(one.signal for one in symbol_map.inputs.values()),
    ]
    named = [signal for signal in signals if signal is not None]
    wide = {it.cell for it in named if it.bit is not None or {it.on, it.off} - {0, 1}}
    yield from ((_WORD if it.cell in wide else "Boolean", it) for it in named)
    words = (
        *(commit.error_code, commit.tool_number, symbol_map.selected, symbol_map.device_id),
        *(symbol_map.cycle_counter, symbol_map.change_counter),
    )
    yield from ((_WORD, word) for word in words if word is not None)
