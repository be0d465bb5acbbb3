"""Arch, the statement (docs/reference/spel.md 7.1, 7.3)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.definitions.arches import Arch
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import Number


def _arch(machine: Machine, values: Sequence[Number]) -> str:
    arches = machine.kept.arches
    match values:
        case []:
            listed = enumerate(arches.all())
            return "".join(f"arch{n} ={a:9.3f}{b:9.3f}{CRLF}" for n, (a, b) in listed)
        case [number, depart, approach]:
            arches.set(int(number), Arch(float(depart), float(approach)))
            return ""
    raise SpelRefusal(RefusalKind.SYNTAX, f"Arch does not take {len(values)} values")


ARCH_SETTINGS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {"arch": _arch}
"""Keyword to what sets or shows it."""
