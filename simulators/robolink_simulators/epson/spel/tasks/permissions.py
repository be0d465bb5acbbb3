"""What a task may not do that goes on through an emergency stop, or in the background.

Source: docs/reference/spel.md 4.5.
"""

from typing import Final

from robolink_simulators.epson.spel.tasks.task import TaskKind
from robolink_simulators.epson.spel.tree import KeywordStatement, MotionStatement, Statement

_WORDS = """
    accel accels accelr arm armset base box boxclr plane planeclr cp ecp ecpset ecpclr fine home
    homeset inertia limz local motor power pulse range sfree slock speed speeds speedr tlset
    tlclr tool weight till find sense jtran arch armclr xylim xylimclr xylimmode limzmargin
    finedist performmode ptpboost qpdecelr qpdecels tclim tcspeed limittorque qp olaccel softcp
    speedrlimitation tc jrange ptran hordr finedist calib mcal mcordr homeclr
    syncrobots latchenable setlatch
"""
FORBIDDEN: Final = frozenset(_WORDS.split())
_ALONE: Final = frozenset({"home", "slock", "xylimclr", "mcal", "homeclr"})
"""Those that act without an argument; without one the others show what they set."""

_BOUND: Final = frozenset({TaskKind.NO_ABORT, TaskKind.BACKGROUND})


def forbidden_in(kind: TaskKind, statement: Statement) -> bool:
    """Tell whether a task of a kind may not carry a statement out."""
    if kind not in _BOUND:
        return False
    match statement:
        case MotionStatement():
            return True
        case KeywordStatement(name, arguments):
            return name in FORBIDDEN and bool(arguments or name in _ALONE)
    return False
