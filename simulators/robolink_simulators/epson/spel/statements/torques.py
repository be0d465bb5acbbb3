"""ATCLR, ATRQ, PTCLR, PTRQ, OLRate, AvgSpeed, PeakSpeed: what is measured of the drives.

Source: docs/reference/spel.md 7.3, 7.4. Lists have two values a row and six on every robot, as
their samples; how wide their columns are is assumed.
"""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.drives.observer import DriveObserver, DriveQuantity
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.defined.torques import (
    DRIVE_VALUES,
    DriveValue,
    joint_number,
)
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import Number

_LISTED: Final = 6
_DECIMALS: Final = 3
_DECIMALS_OF_OVERLOAD: Final = 5
_BETWEEN: Final = 6

Setting = Callable[[Machine, Sequence[Number]], str]


def _clearing(quantity: DriveQuantity) -> Setting:
    def clear(machine: Machine, values: Sequence[Number]) -> str:
        joints = [joint_number(machine, int(value)) for value in values]
        machine.robot.observer.clear(quantity, joints or range(1, machine.model.axes + 1))
        return ""

    return clear


def _listing(tell: DriveValue, decimals: int = _DECIMALS) -> Setting:
    def show(machine: Machine, values: Sequence[Number]) -> str:
        observer, axes = machine.robot.observer, machine.model.axes
        if len(values) > 1:
            raise SpelRefusal(RefusalKind.SYNTAX, "One joint, or none for all of them")
        if values:
            return f"{tell(observer, joint_number(machine, int(values[0]))):.{decimals}f}" + CRLF
        told = [tell(observer, joint) for joint in range(1, axes + 1)]
        told += [0.0] * (_LISTED - axes)
        texts = [f"{value:{decimals + _BETWEEN}.{decimals}f}" for value in told]
        rows = ["".join(texts[at : at + 2]) for at in range(0, _LISTED, 2)]
        return "".join(row + CRLF for row in rows)

    return show


TORQUE_STATEMENTS: Final[dict[str, Setting]] = {
    **{quantity.value: _clearing(quantity) for quantity in DriveQuantity},
    **{word: _listing(DRIVE_VALUES[word]) for word in ("atrq", "ptrq", "avgspeed", "peakspeed")},
    "olrate": _listing(DriveObserver.overload, _DECIMALS_OF_OVERLOAD),
}
"""Keyword to what clears or shows it."""
