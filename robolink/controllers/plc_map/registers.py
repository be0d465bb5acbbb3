"""Registers and coils of a Modbus server as the places of a map.

Wrong word order and addresses off by one are the mistakes that users of Modbus report most
(docs/reference/softmotion.md 4.4); both make plausible numbers.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby, product
from typing import Final, Protocol

from robolink.controllers.plc_map.places import TRIES, Places
from robolink.errors import RejectedError, RemoteProtocolError, ToolError
from robolink.messages import tr
from robolink.register_maps import (
    Cells,
    MapProbe,
    MapSlot,
    Number,
    RegisterMap,
    RegisterTable,
    Signal,
    Word,
    describe_place,
    span_of,
)
from robolink.stop_latch import CommandClass
from robolink.timing import Clock


class RegisterClient(Protocol):
    """What the driver needs of a Modbus client, as ``open_modbus`` returns one."""

    @property
    def identity(self) -> str:
        """Which PLC this is."""

    @property
    def place(self) -> str:
        """Where it was reached, the same for each spelling of the URL."""

    @property
    def clock(self) -> Clock:
        """The clock on which its time passes."""

    @property
    def most_registers(self) -> int:
        """How many registers it returns in one read."""

    def read_holding(self, address: int, count: int) -> tuple[int, ...]:
        """Return holding registers."""

    def read_input(self, address: int, count: int) -> tuple[int, ...]:
        """Return input registers."""

    def read_coils(self, address: int, count: int) -> tuple[bool, ...]:
        """Return coils."""

    def read_discrete(self, address: int, count: int) -> tuple[bool, ...]:
        """Return discrete inputs."""

    def write_registers(self, address: int, values: Sequence[int]) -> None:
        """Write holding registers in one request."""

    def write_coil(self, address: int, value: bool) -> None:
        """Write one coil."""

    def close(self) -> None:
        """Close."""


class Registers(Places):
    """The tables of one PLC; see :class:`.Places`."""

    def __init__(self, client: RegisterClient, register_map: RegisterMap) -> None:
        super().__init__(client.identity, client.place, client.clock)
        self._client = client
        self._map = register_map

    def require_fit(self) -> None:
        """Accept every server: registers have no types and no names."""

    def once(self, components: Mapping[str, Number]) -> Cells:
        """See :meth:`Places.once`; the registers between them are read, too."""
        table, span = _stretch(components)
        return dict(zip(span, self.read(table, span), strict=True))

    def stable(self, components: Mapping[str, Number]) -> Cells:
        """See :meth:`Places.stable`."""
        table, span = _stretch(components)
        return dict(zip(span, self.read_twice(table, span), strict=True))

    def read(self, table: RegisterTable, addresses: range) -> tuple[int, ...]:
        """Return the registers: in one request, or in parts if the server returns fewer.

        Parts may be of different moments: whoever needs them to belong together reads twice.
        """
        readers = {
            RegisterTable.HOLDING: self._client.read_holding,
            RegisterTable.INPUT: self._client.read_input,
            RegisterTable.COIL: self._client.read_coils,
            RegisterTable.DISCRETE: self._client.read_discrete,
        }
        words = table in (RegisterTable.HOLDING, RegisterTable.INPUT)
        most = self._client.most_registers if words else len(addresses)
        found: list[int] = []
        for start in range(addresses.start, addresses.stop, most):
            with self.gate:
                self.exchanges += 1
                sent_ns = self.clock.now_ns()
                found += map(int, readers[table](start, min(most, addresses.stop - start)))
                self.answers.answered(sent_ns)
        return tuple(found)

    def read_twice(self, table: RegisterTable, addresses: range) -> tuple[int, ...]:
        """Return the registers as soon as two reads agree.

        A server may change registers between the words of one answer
        (docs/reference/softmotion.md 4.1, docs/reference/faults.md F31).

        Raises:
            RemoteProtocolError: No two reads in a row agree.
        """
        found = self.read(table, addresses)
        for _ in range(TRIES):
            before, found = found, self.read(table, addresses)
            if found == before:
                return found
        raise RemoteProtocolError(
            tr(
                "The registers from {place} on change at every reading.",
                place=describe_place(table, addresses.start),
            ),
            remedy=tr(
                "Compare the map's addresses with the PLC's; or another program writes them."
            ),
        )

    def word(self, word: Word) -> int:
        """Return the number in one register."""
        return self.read(word.table, range(word.address, word.address + 1))[0]

    def is_on(self, signal: Signal | None) -> bool:
        """Return whether a signal is on; one that the map does not have is off."""
        if signal is None:
            return False
        found = self.read(signal.table, range(signal.address, signal.address + 1))[0]
        if signal.bit is not None:
            found = found >> signal.bit & 1
        return found == signal.on

    def switch(self, signal: Signal, on: bool, *, kind: CommandClass = CommandClass.WRITE) -> None:
        """Switch a coil, or write a whole register.

        Args:
            signal: Which one.
            on: Whether on.
            kind: What that does to the machine; a request that is taken back calms.

        Raises:
            StoppedError: A stop forbids it; it was not sent.
        """
        value = signal.on if on else signal.off
        with self._admitted(signal.place, kind):
            self.exchanges += 1
            if signal.table is RegisterTable.COIL:
                self._client.write_coil(signal.address, bool(value))
            else:
                self._client.write_registers(signal.address, [value])

    def tell(self, word: Word, value: int) -> None:
        """See :meth:`Places.tell`."""
        self._write(word.address, [value])

    def write(self, cells: Cells) -> None:
        """See :meth:`Places.write`: one request for each stretch of neighbours (function 16)."""
        for address, values in _stretches(cells):
            self._write(address, values)

    def write_requests(self, cells: Cells) -> tuple[str, ...]:
        """See :meth:`Places.write_requests`."""
        return tuple(
            tr(
                "write {place}: {values}",
                place=describe_place(RegisterTable.HOLDING, address),
                values=" ".join(f"{value:04X}" for value in values),
            )
            for address, values in _stretches(cells)
        )

    def require_writable(self, slot: MapSlot) -> None:
        """See :meth:`Places.require_writable`."""
        if not slot.writable:
            raise ToolError(
                tr("Tool {tool} is in input registers, which are read-only.", tool=slot.tool),
                remedy=tr("Change it at the HMI, or map holding registers."),
            )

    def own_number(self) -> str | None:
        """See :meth:`Places.own_number`."""
        number = self._map.device_id
        if number is None:
            return None
        words = self.read_twice(number.table, number.registers)
        return "".join(f"{word:04X}" for word in words) if any(words) else ""

    def diagnosis(self, probe: MapProbe[Number]) -> str:
        """See :meth:`Places.diagnosis`: which word order or shift would fit."""
        return _diagnosis(self, probe)

    def _write(self, address: int, words: Sequence[int]) -> None:
        with self._admitted(describe_place(RegisterTable.HOLDING, address), CommandClass.WRITE):
            self.exchanges += 1
            self._client.write_registers(address, words)

    def close(self) -> None:
        """Close the link. Idempotent."""
        self._client.close()
        self.gate.close()


def _stretch(components: Mapping[str, Number]) -> tuple[RegisterTable, range]:
    return next(iter(components.values())).table, span_of(components)


def _stretches(cells: Cells) -> Iterator[tuple[int, list[int]]]:
    """Return the stretches of neighbouring registers, each with its first address."""
    for _, stretch in groupby(enumerate(sorted(cells)), key=lambda pair: pair[1] - pair[0]):
        addresses = [address for _, address in stretch]
        yield addresses[0], [int(cells[address]) for address in addresses]


_AROUND: Final = 8
"""Number of registers before and after its declared place that are searched."""


def _diagnosis(registers: Registers, probe: MapProbe[Number]) -> str:
    number = probe.number
    found = _found(registers, probe)
    if found is None:
        return tr("Check the unit in the URL, the map's addresses, and whether the PLC runs.")
    hints = []
    if found.address != number.address:
        hints.append(
            tr(
                "It was found at {place}: the addresses are off by {shift:+d}.",
                place=describe_place(found.table, found.address),
                shift=number.address - found.address,
            )
        )
    if found.low_word_first != number.low_word_first:
        order = "low_first" if found.low_word_first else "high_first"
        hints.append(tr('Set word_order = "{order}".', order=order))
    if found.swapped_bytes != number.swapped_bytes:
        order = "little" if found.swapped_bytes else "big"
        hints.append(tr('Set byte_order = "{order}".', order=order))
    return " ".join(hints)


def _found(registers: Registers, probe: MapProbe[Number]) -> Number | None:
    """Search for the constant in every order, nearest first."""
    number = probe.number
    count = len(number.registers)
    start = max(0, number.address - _AROUND)
    stop = min(0x10000, number.registers.stop + _AROUND)
    try:
        words = registers.read(number.table, range(start, stop))
    except RejectedError:  # the table may end sooner; then read only the declared place
        start, stop = number.registers.start, number.registers.stop
        words = registers.read(number.table, number.registers)
    places = sorted(range(start, stop - count + 1), key=lambda at: abs(at - number.address))
    for at, low_first, swapped in product(places, (True, False), (False, True)):
        tried = replace(number, address=at, low_word_first=low_first, swapped_bytes=swapped)
        if words[at - start : at - start + count] == tried.encode(probe.value):
            return tried
    return None
