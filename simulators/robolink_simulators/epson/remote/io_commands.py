"""Remote Ethernet's input, output and memory commands (docs/reference/epson.md 1.2).

Numbers count from 0. Bytes and words are read as hex digits and set as decimal numbers, as
clients do it (docs/reference/epson.md 1.2 note 5). GetIO reads inputs, SetIO sets outputs.
"""

from collections.abc import Callable

from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.refusals import number

Fields = tuple[str, ...]
"""What a served command answers; nothing stands for a lone ``0``."""

Served = Callable[..., Fields]
"""Carries a command out; takes its parameters as text."""


def io_commands(machine: Machine) -> dict[str, Served]:
    """Return the commands by lower-case name. A bit that does not exist raises Refusal."""
    return {
        **_getters("getio", machine.inputs),
        **_setters("setio", machine.outputs),
        **_getters("getmemio", machine.memory),
        **_setters("setmemio", machine.memory),
    }


def _getters(name: str, bank: BitBank) -> dict[str, Served]:
    def bit(at: str) -> Fields:
        return (str(int(bank.get(number(at)))),)

    def byte(at: str) -> Fields:
        return (f"{bank.get_byte(number(at)):02X}",)

    def word(at: str) -> Fields:
        low = 2 * number(at)
        return (f"{bank.get_byte(low + 1) << 8 | bank.get_byte(low):04X}",)

    return {name: bit, f"{name}byte": byte, f"{name}word": word}


def _setters(name: str, bank: BitBank) -> dict[str, Served]:
    def bit(at: str, value: str) -> Fields:
        bank.set(number(at), number(value, 1) == 1)
        return ()

    def byte(at: str, value: str) -> Fields:
        bank.set_byte(number(at), number(value, 0xFF))
        return ()

    def word(at: str, value: str) -> Fields:
        low, wanted = 2 * number(at), number(value, 0xFFFF)
        bank.set_byte(low, wanted & 0xFF)
        bank.set_byte(low + 1, wanted >> 8)
        return ()

    return {name: bit, f"{name}byte": byte, f"{name}word": word}
