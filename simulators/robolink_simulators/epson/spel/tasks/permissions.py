"""What a task may not do that goes on through an emergency stop, or in the background.

Source: docs/reference/spel.md 4.5.
"""

from typing import Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.tasks.task import SpelTask, TaskKind
from robolink_simulators.epson.spel.tree import KeywordStatement, MotionStatement, Name, Statement

_WORDS = """
    accel accels accelr arm armset base box boxclr plane planeclr cp ecp ecpset ecpclr fine home
    homeset inertia limz local motor power pulse range sfree slock speed speeds speedr tlset
    tlclr tool weight till find sense jtran arch armclr xylim xylimclr xylimmode limzmargin
    finedist performmode ptpboost qpdecelr qpdecels tclim tcspeed limittorque qp olaccel softcp
    speedrlimitation tc jrange ptran hordr finedist calib mcal mcordr homeclr
    syncrobots latchenable setlatch curve localclr reset waitpos
"""
FORBIDDEN: Final = frozenset(_WORDS.split())
_ALONE: Final = frozenset({"home", "slock", "xylimclr", "mcal", "homeclr", "reset", "waitpos"})
"""Those that act without an argument; without one the others show what they set."""

BOUND: Final = frozenset({TaskKind.NO_ABORT, TaskKind.BACKGROUND})
"""Kinds of tasks that may not do all (p. 912 to 917)."""


def forbidden_in(kind: TaskKind, statement: Statement) -> bool:
    """Tell whether a task of a kind may not carry a statement out."""
    if kind not in BOUND:
        return False
    match statement:
        case MotionStatement():
            return True
        case KeywordStatement(name, arguments):
            if name == "reset" and arguments == (Name("error"),):
                return False
            return name in FORBIDDEN and bool(arguments or name in _ALONE)
    return False


def require_unbound(task: SpelTask) -> None:
    """Refuse what tasks may not that go on through an emergency stop, or in the background.

    Raises:
        Refusal: It is one of those.
    """
    if task.kind in BOUND:
        raise SpelRefusal(RefusalKind.NOT_IN_THIS_TASK, "Not allowed in this kind of task")


def require_advanced(task: SpelTask) -> None:
    """Refuse Cont, Reset Error and StartMain where the preference does not let programs say them.

    Source: docs/reference/spel.md 4.5.

    Raises:
        Refusal: It does not (which number that has is not told).
    """
    if not task.session.options.advanced_task_commands:
        raise SpelRefusal(RefusalKind.PREFERENCE_OFF, "Advanced task commands are not permitted")
