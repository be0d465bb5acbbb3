"""Whether the PLC is the one of the map: its constant, and the number that it is known by.

Wrong word order and addresses off by one are the mistakes that users of Modbus report most
(docs/reference/softmotion.md 4.4); both make plausible numbers.
"""

from dataclasses import replace
from itertools import product
from typing import Final

from robolink.controllers.plc_map.registers import Registers
from robolink.errors import RejectedError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Identity
from robolink.register_maps import MapProbe, Number, RegisterMap, describe_place

_AROUND: Final = 8
"""How many registers before and behind its place it is looked for."""


def require_probe(registers: Registers, probe: MapProbe | None) -> None:
    """Read the constant, if there is one, and refuse a PLC in which it is another.

    Raises:
        RemoteProtocolError: It differs; says what the map should say, if that can be found.
    """
    if probe is None:
        return
    number = probe.number
    words = registers.read(number.table, number.registers)
    if words == number.encode(probe.value):
        return
    raise RemoteProtocolError(
        tr(
            "The probe at {place} should be {value:g}, but reads {found:g}.",
            place=number.place,
            value=probe.value,
            found=number.decode(words),
        ),
        remedy=tr("{diagnosis} Nothing was written.", diagnosis=_diagnosis(registers, probe)),
        controller=registers.identity,
    )


def _diagnosis(registers: Registers, probe: MapProbe) -> str:
    number = probe.number
    found = _found(registers, probe)
    if found is None:
        return tr("Check the unit in the URL, the map's addresses, and whether the PLC runs.")
    hints = []
    if found.address != number.address:
        hints.append(
            tr(
                "It was found at {place}: the addresses of this map are off by {shift:+d}.",
                place=describe_place(found.table, found.address),
                shift=number.address - found.address,
            )
        )
    if found.low_word_first != number.low_word_first:
        order = "low_first" if found.low_word_first else "high_first"
        hints.append(
            tr('The words are in the opposite order: word_order = "{order}".', order=order)
        )
    if found.swapped_bytes != number.swapped_bytes:
        order = "little" if found.swapped_bytes else "big"
        hints.append(tr('The bytes are swapped: byte_order = "{order}".', order=order))
    return " ".join(hints)


def _found(registers: Registers, probe: MapProbe) -> Number | None:
    """Look for the constant in every order, nearest first."""
    number = probe.number
    count = len(number.registers)
    start = max(0, number.address - _AROUND)
    stop = min(0x10000, number.registers.stop + _AROUND)
    try:
        words = registers.read(number.table, range(start, stop))
    except RejectedError:  # the table may end sooner; then its own place has to do
        start, stop = number.registers.start, number.registers.stop
        words = registers.read(number.table, number.registers)
    places = sorted(range(start, stop - count + 1), key=lambda at: abs(at - number.address))
    for at, low_first, swapped in product(places, (True, False), (False, True)):
        tried = replace(number, address=at, low_word_first=low_first, swapped_bytes=swapped)
        if words[at - start : at - start + count] == tried.encode(probe.value):
            return tried
    return None


class MapIdentityReader:
    """Reads the machine's own number, where the map says where it stands."""

    def __init__(self, registers: Registers, register_map: RegisterMap) -> None:
        self._registers = registers
        self._place = register_map.device_id

    def read(self) -> Identity:
        """Return who it is.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or the number does not stand
                still.
            RejectedError: The PLC has no such registers.
        """
        address, place = self._registers.identity, f"plc@{self._registers.place}"
        if self._place is None:
            return Identity(place, address, place)
        words = self._registers.read_twice(self._place.table, self._place.registers)
        if not any(words):
            # Zeroed by a watchdog, or the program has not started
            # (docs/reference/softmotion.md 4.1).
            return Identity(place, address, place, certain=False)
        return Identity(f"plc:{''.join(f'{word:04X}' for word in words)}", address, place)
