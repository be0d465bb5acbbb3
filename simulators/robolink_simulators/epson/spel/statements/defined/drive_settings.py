"""LimZMargin, QP, OLAccel, PTPBoost and their kin (docs/reference/spel.md 6.3, 7.2, 7.3)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.definitions.drive_settings import (
    DRIVE_SETTINGS,
    OF_SIX_AXES,
    DriveSetting,
)
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.joint_functions import another_robot
from robolink_simulators.epson.spel.expressions.printing import CRLF, number_text
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range


def _listed(setting: DriveSetting, values: Sequence[float]) -> str:
    if setting.switched and len(values) > 1:
        return ",".join("ON" if value else "OFF" for value in values) + CRLF
    if setting.switched and setting.listing != "{}":
        return setting.listing.format("ON" if values[0] else "OFF") + CRLF
    return ", ".join(map(_number, values)) + CRLF


def _number(value: float) -> str:
    return number_text(int(value) if value == int(value) else value)


def _setting(word: str) -> Callable[[Machine, Sequence[Number]], str]:
    """Return what sets or lists a setting.

    That several values are listed with commas is assumed.
    """
    setting = DRIVE_SETTINGS[word]

    def choose(machine: Machine, values: Sequence[Number]) -> str:
        drives = machine.robot.drives
        if word in OF_SIX_AXES and not machine.model.six_axes:
            raise another_robot(machine.model)
        if not values:
            return _listed(setting, drives.get(word))
        if word == "performmode" and len(values) == 2:
            drives, values = machine.numbered(int(values[1])).drives, values[:1]
        if len(values) not in drives.takes(word):
            raise SpelRefusal(RefusalKind.SYNTAX, f"{word} does not take {len(values)} values")
        if any(not setting.low <= value <= setting.high for value in values):
            raise out_of_range(f"Allowed are {setting.low:g} to {setting.high:g}")
        drives.set(word, tuple(map(float, values)))
        return ""

    return choose


DRIVE_STATEMENTS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {
    word: _setting(word) for word in DRIVE_SETTINGS
}
"""Keyword to what sets or shows it."""
