"""The standard function blocks on whose answers compilers agree.

Source: docs/reference/structured_text.md 2. F_TRIG and CTD differ and are not here.
"""

from collections.abc import Callable, Mapping
from typing import Final

from robolink_simulators.structured_text.data_types import (
    BOOL,
    ELEMENTARY,
    TIME,
    BlockType,
    DataType,
    Frame,
    TextVariable,
)
from robolink_simulators.structured_text.references import Runtime

_INT: Final = ELEMENTARY["INT"]
DIFFERING: Final = frozenset({"F_TRIG", "CTD", "CTUD"})
"""Blocks that compilers do not agree about, or that no judge was asked about."""

Pins = tuple[tuple[str, DataType, str], ...]

_TIMER: Final[Pins] = (
    ("in", BOOL, "var_input"),
    ("pt", TIME, "var_input"),
    ("q", BOOL, "var_output"),
    ("et", TIME, "var_output"),
    ("since", TIME, "private"),
    ("before", BOOL, "private"),
)


def standard_blocks(runtime: Runtime) -> Mapping[str, BlockType]:
    """Return the blocks by name; timers go by the clock of ``runtime``."""

    def on_delay(pins: Frame) -> None:
        if not pins[0]:
            pins[2], pins[3] = False, 0
        elif not pins[5]:
            pins[2], pins[3], pins[4] = pins[1] <= 0, 0, runtime.now_us
        else:
            pins[3] = min(runtime.now_us - pins[4], pins[1])
            pins[2] = runtime.now_us - pins[4] >= pins[1]
        pins[5] = pins[0]

    def off_delay(pins: Frame) -> None:
        if pins[0]:
            pins[2], pins[3] = True, 0
        elif pins[5]:
            pins[3], pins[4] = 0, runtime.now_us
        elif pins[2]:
            pins[3] = min(runtime.now_us - pins[4], pins[1])
            pins[2] = pins[3] < pins[1]
        pins[5] = pins[0]

    def pulse(pins: Frame) -> None:
        running = pins[2]
        if running:
            pins[3] = min(runtime.now_us - pins[4], pins[1])
            pins[2] = pins[3] < pins[1]
        elif pins[0] and not pins[5]:
            pins[2], pins[3], pins[4] = True, 0, runtime.now_us
        if not pins[2] and not pins[0]:
            pins[3] = 0
        pins[5] = pins[0]

    blocks = [
        _block("TON", _TIMER, on_delay),
        _block("TOF", _TIMER, off_delay),
        _block("TP", _TIMER, pulse),
        _block("R_TRIG", (("clk", BOOL, "var_input"), ("q", BOOL, "var_output"), _M), _rising),
        _block("CTU", _COUNTER, _count_up),
        _block("SR", (("s1", BOOL, "var_input"), ("r", BOOL, "var_input"), _Q1), _set_first),
        _block("RS", (("s", BOOL, "var_input"), ("r1", BOOL, "var_input"), _Q1), _reset_first),
    ]
    return {block.name: block for block in blocks}


_M: Final = ("before", BOOL, "private")
_Q1: Final = ("q1", BOOL, "var_output")
_COUNTER: Final[Pins] = (
    ("cu", BOOL, "var_input"),
    ("r", BOOL, "var_input"),
    ("pv", _INT, "var_input"),
    ("q", BOOL, "var_output"),
    ("cv", _INT, "var_output"),
    _M,
)


def _rising(pins: Frame) -> None:
    pins[1] = pins[0] and not pins[2]
    pins[2] = pins[0]


def _count_up(pins: Frame) -> None:
    if pins[1]:
        pins[4] = 0
    elif pins[0] and not pins[5] and pins[4] < pins[2]:
        pins[4] += 1
    pins[3] = pins[4] >= pins[2]
    pins[5] = pins[0]


def _set_first(pins: Frame) -> None:
    pins[2] = pins[0] or (not pins[1] and pins[2])


def _reset_first(pins: Frame) -> None:
    pins[2] = not pins[1] and (pins[0] or pins[2])


def _block(name: str, pins: Pins, run: Callable[[Frame], None]) -> BlockType:
    members = {pin: TextVariable(pin, of, slot, kind) for slot, (pin, of, kind) in enumerate(pins)}
    return BlockType(name, members, run)
