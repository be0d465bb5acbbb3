"""Arm, ArmSet and ArmClr (docs/reference/spel.md 6.2, 7.3)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import Number

_COUNTS: Final = range(3, 6)
_COUNT_OF_SIX_AXES: Final = 12


def _listed(number: int, values: Sequence[float]) -> str:
    return f"Arm {number}: " + ", ".join(f"{value:.3f}" for value in values) + CRLF


def _arm(machine: Machine, values: Sequence[Number]) -> str:
    match values:
        case []:
            return f"{machine.kept.arms.selected}" + CRLF
        case [number]:
            if number and machine.model.six_axes:
                # Which of its twelve values are angles of which joints is not described.
                machine.kept.arms.values(int(number))
                raise SpelRefusal(RefusalKind.NOT_SIMULATED, "An added arm of six axes")
            machine.robot.put_in_force(int(number))
            return ""
    raise _miscounted("Arm", values)


def _arm_set(machine: Machine, values: Sequence[Number]) -> str:
    arms = machine.kept.arms
    match values:
        case []:
            return "".join(_listed(number, of_arm) for number, of_arm in arms.all().items())
        case [number]:
            return _listed(int(number), arms.values(int(number)))
    number, *given = values
    wanted = len(given) == _COUNT_OF_SIX_AXES if machine.model.six_axes else len(given) in _COUNTS
    if not wanted:
        raise _miscounted("ArmSet", values)
    arms.set(int(number), given)
    return ""


def _arm_clear(machine: Machine, values: Sequence[Number]) -> str:
    if len(values) != 1:
        raise _miscounted("ArmClr", values)
    machine.kept.arms.clear(int(values[0]))
    return ""


def _miscounted(word: str, values: Sequence[Number]) -> SpelRefusal:
    return SpelRefusal(RefusalKind.SYNTAX, f"{word} does not take {len(values)} values")


ARM_SETTINGS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {
    "arm": _arm,
    "armset": _arm_set,
    "armclr": _arm_clear,
}
"""Keyword to what sets or shows it."""
