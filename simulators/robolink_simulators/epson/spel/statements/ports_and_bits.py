"""Statements of virtual inputs, ports in decimal code, and inputs that latch a position.

Source: docs/reference/spel.md 7.1, 8.
"""

from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.print_format import CRLF
from robolink_simulators.epson.spel.expressions.values import out_of_range
from robolink_simulators.epson.spel.tree import KeywordStatement

_HIGHEST_BYTE: Final = 0xFF
_HIGHEST_WORD: Final = 0xFFFF
_HIGHEST_DECIMAL: Final = 99
_FEWEST_OF_A_LATCH: Final = 2


def _two(evaluator: Evaluator, command: KeywordStatement) -> tuple[int, int]:
    if len(command.arguments) != 2:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{command.name} takes a number and a value")
    first, second = command.arguments
    return evaluator.integer(first), evaluator.integer(second)


def _virtual(evaluator: Evaluator) -> None:
    """Inputs of a real controller are not set by a program (documented)."""
    if not evaluator.session.options.virtual_io:
        raise SpelRefusal(RefusalKind.VIRTUAL_IO_OFF, "Virtual I/O is off")


def _set_switch(evaluator: Evaluator, command: KeywordStatement) -> str:
    _virtual(evaluator)
    number, on = _two(evaluator, command)
    evaluator.session.machine.inputs.set(number, bool(on))
    return ""


def _set_byte(evaluator: Evaluator, command: KeywordStatement) -> str:
    _virtual(evaluator)
    port, value = _two(evaluator, command)
    if not 0 <= value <= _HIGHEST_BYTE:
        raise out_of_range(f"Not a byte: {value}")
    evaluator.session.machine.inputs.set_byte(port, value)
    return ""


def _set_word(evaluator: Evaluator, command: KeywordStatement) -> str:
    _virtual(evaluator)
    port, value = _two(evaluator, command)
    if not 0 <= value <= _HIGHEST_WORD:
        raise out_of_range(f"Not a word: {value}")
    inputs = evaluator.session.machine.inputs
    inputs.set_byte(2 * port, value & _HIGHEST_BYTE)
    inputs.set_byte(2 * port + 1, value >> 8)
    return ""


def _set_real(evaluator: Evaluator, command: KeywordStatement) -> str:
    """OutReal and SetInReal: a word port and the next take a number of 32 bits."""
    machine = evaluator.session.machine
    if command.name == "setinreal":
        _virtual(evaluator)
    if len(command.arguments) != 2:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{command.name} takes a number and a value")
    port, value = command.arguments
    bank = machine.inputs if command.name == "setinreal" else machine.outputs
    bank.set_real(evaluator.integer(port), float(evaluator.number(value)))
    return ""


def _decimal(evaluator: Evaluator, command: KeywordStatement) -> str:
    port, value = _two(evaluator, command)
    if not 0 <= value <= _HIGHEST_DECIMAL:
        raise SpelRefusal(RefusalKind.DECIMAL_OUT, f"Not two digits: {value}")
    evaluator.session.machine.outputs.set_byte(port, value // 10 << 4 | value % 10)
    return ""


def _reset_counter(evaluator: Evaluator, command: KeywordStatement) -> str:
    if len(command.arguments) != 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "CTReset takes an input")
    evaluator.session.machine.inputs.count_from_zero(evaluator.integer(command.arguments[0]))
    return ""


def set_latch(evaluator: Evaluator, command: KeywordStatement) -> None:
    """SetLatch input, edge[, times]: what LatchEnable looks out for."""
    numbers = [evaluator.integer(argument) for argument in command.arguments]
    if not _FEWEST_OF_A_LATCH <= len(numbers) <= _FEWEST_OF_A_LATCH + 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "SetLatch takes an input, an edge and a number")
    port, edge, *times = numbers
    if edge not in (0, 1):
        raise out_of_range(f"There is no edge {edge}")
    latch = evaluator.session.machine.robot.latch
    latch.set(port, rising=bool(edge), times=times[0] if times else 1)


def _enable_latch(evaluator: Evaluator, command: KeywordStatement) -> str:
    """LatchEnable On or Off, or show it; the format is assumed."""
    latch = evaluator.session.machine.robot.latch
    if not command.arguments:
        return ("ON" if latch.enabled else "OFF") + CRLF
    if len(command.arguments) > 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "LatchEnable takes On or Off")
    latch.enable(bool(evaluator.integer(command.arguments[0])))
    return ""


BIT_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "setsw": _set_switch,
    "setin": _set_byte,
    "setinw": _set_word,
    "setinreal": _set_real,
    "outreal": _set_real,
    "opbcd": _decimal,
    "ctreset": _reset_counter,
    "latchenable": _enable_latch,
}
"""Statement handlers by keyword."""
