"""Arm, ArmDef and ArmSet, the functions (docs/reference/spel.md 6.2)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.session import Session


def _value(session: Session, arguments: Sequence[Value]) -> Value:
    number, which = (as_integer(argument) for argument in arguments)
    values = session.machine.kept.arms.values(number)
    if not 1 <= which <= len(values):
        raise out_of_range(f"An arm has no value {which}, only 1 to {len(values)}")
    return values[which - 1]


ARM_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "arm": (range(1), lambda s, _: s.machine.kept.arms.selected),
    "armdef": (range(1, 2), lambda s, a: s.machine.kept.arms.is_defined(as_integer(a[0]))),
    "armset": (range(2, 3), _value),
}
"""Name to the numbers of arguments allowed and the function."""
