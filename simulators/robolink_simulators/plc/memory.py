"""The four tables of a Modbus server, as large as a map needs them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from robolink.register_maps import RegisterTable, Signal

_BEYOND: Final = 16
"""How far behind the last place of a map a table goes on."""


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
        """Return what stands there.

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
        """Return a copy of all that stands in them."""
        return dict(self._values)

    def put_back(self, values: Mapping[tuple[RegisterTable, int], int]) -> None:
        """Take over what :meth:`copied` gave."""
        self._values = dict(values)

    def is_on(self, signal: Signal | None) -> bool:
        """Tell whether a signal is on; none is off."""
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
