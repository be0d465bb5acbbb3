"""XYLim, XYLimClr and XYLimMode, and what they hold back (docs/reference/spel.md 7.2)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.defined.xy_limits import outside_limits_mm
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range
from robolink_simulators.epson.spel.session import Session

_LOOKS_A_LEG: Final = 200
"""Assumed: places of a leg that are looked at in mode 1."""

_SAME_MM: Final = 1e-6


def require_within_limits(session: Session, legs: Sequence[Leg], targets: Sequence[Leg]) -> None:
    """Hold a motion back that XYLim does not allow.

    The ends at targets count, and by mode 1 the whole way; a robot that stands outside may come
    nearer (documented).

    Args:
        session: Whose robot.
        legs: What it is about to travel.
        targets: Those of them that end at a target; none do of a motion to pulses (documented).

    Raises:
        OutOfReach: It would leave the limits; the number of that error is assumed.
    """
    limits = session.machine.kept.limits
    if not limits.defined:
        return
    if any(_outside_mm(session, leg, leg.duration_ns) for leg in targets):
        raise OutOfReach("A target lies outside the limits of XYLim")
    looks = [(leg, n) for leg in legs for n in range(_LOOKS_A_LEG + 1)] if limits.strict else ()
    before_mm: float | None = None
    for leg, look in looks:
        after_mm = _outside_mm(session, leg, leg.duration_ns * look // _LOOKS_A_LEG)
        if before_mm is not None and after_mm > before_mm + _SAME_MM:
            raise OutOfReach("The way leaves the limits of XYLim")
        before_mm = after_mm


def _outside_mm(session: Session, leg: Leg, elapsed_ns: int) -> float:
    return outside_limits_mm(session, leg.flange_at(elapsed_ns))


def _limits(machine: Machine, values: Sequence[Number]) -> str:
    if not values:
        return ", ".join(f"{value:.3f}" for value in machine.kept.limits.values) + CRLF
    machine.kept.limits.set(values)
    return ""


def _clear(machine: Machine, values: Sequence[Number]) -> str:
    if values:
        raise SpelRefusal(RefusalKind.SYNTAX, "XYLimClr takes nothing")
    machine.kept.limits.clear()
    return ""


def _mode(machine: Machine, values: Sequence[Number]) -> str:
    match values:
        case []:
            return f"{int(machine.kept.limits.strict)}{CRLF}"
        case [0 | 1 as mode]:
            machine.kept.limits.strict = bool(mode)
            return ""
        case [mode]:
            raise out_of_range(f"There is no XYLimMode {mode}")
    raise SpelRefusal(RefusalKind.SYNTAX, f"XYLimMode does not take {len(values)} values")


LIMIT_SETTINGS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {
    "xylim": _limits,
    "xylimclr": _clear,
    "xylimmode": _mode,
}
"""Keyword to what sets or shows it."""
