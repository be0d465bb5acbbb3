"""Arch, the function (docs/reference/spel.md 7.1)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.session import Session


def _side(session: Session, arguments: Sequence[Value]) -> Value:
    number, side = (as_integer(argument) for argument in arguments)
    arch = session.machine.kept.arches.get(number)
    if arch is None or side not in (1, 2):
        raise out_of_range(f"There is no Arch({number}, {side})")
    return arch[side - 1]


ARCH_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "arch": (range(2, 3), _side),
}
"""Name to the numbers of arguments allowed and the function."""
