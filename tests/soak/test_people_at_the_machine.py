"""Acts of people at the machine while robolink asks, and the defects that only these show."""

import pytest

from tests.soak.adversary import CellKind, live_through
from tests.soak.adversary.history import Deed, Disturbance, Habit, Hindrance, History, Hour
from tests.soak.known_defects import DEFECTS

BY_NAME = {defect.name: defect.replacements for defect in DEFECTS}

SELECTS = Disturbance(Hindrance.HAND, "select", "question", 0, position=0)
SET_BACK = Disturbance(Hindrance.CLOCK, match="question", at=1, seconds=-86400.0)
GIVES_UP = Disturbance(Hindrance.MACHINE, "GIVES_UP", "Move ", 1)
FROZEN = Disturbance(Hindrance.FREEZE, match="question", at=2)
TYPES = Disturbance(Hindrance.HAND, "type", "question", 12)
STOPS_IT = Disturbance(Hindrance.STOP, match='wire sent $Execute,"Move ')
STOPS_BEFORE = Disturbance(Hindrance.STOP, match="lock Move ")
INTERRUPT = Disturbance(Hindrance.INTERRUPT, match="question", at=14)


def one_hour(deed, *disturbances, number=0, kind=CellKind.EPSON, seed=3):
    return History(seed, kind, (Hour(number, deed, Habit(), disturbances),))


SHOWN = {
    "undo sorts by the wall clock": ("AskedValue", one_hour(Deed.SET_THEN_UNDO, SET_BACK)),
    "typed values lose digits": (
        "AskedValue",
        one_hour(Deed.SET_TOOL, kind=CellKind.SOFTMOTION),
    ),
    "the selected tool is remembered within a session": (
        "StateIsTold",
        one_hour(Deed.SELECT_TOOL, SELECTS),
    ),
    "a movement that nobody waits on goes on when the session ends": (
        "NothingMovesOn",
        one_hour(Deed.MOVE_AND_LEAVE),
    ),
    "a marker outlives what it marks": ("NothingOutlives", one_hour(Deed.MOVE_AND_LEAVE)),
    "power and speed are not put back": ("AsBefore", one_hour(Deed.MOVE_AND_LEAVE)),
    "a pose is told a tenth of a millimetre off": ("ContractHolds", one_hour(Deed.MOVE_AND_LEAVE)),
    "a session leaves another robot in force": ("ContractHolds", one_hour(Deed.SELECT_TOOL)),
    "an EPSON stop that is refused while a movement runs is acknowledged": (
        "AtRestWhenStopped",
        one_hour(Deed.MOVE_AND_LEAVE, STOPS_IT, seed=1),
    ),
    "a stop holds nothing back": ("StillAfterStop", one_hour(Deed.MOVE_AND_LEAVE, STOPS_BEFORE)),
}
"""Defect, the rule that it breaks, and the hour in which it does."""

LONGER = {
    "a movement does not look at the selected tool": (
        "MovesInItsTool",
        one_hour(Deed.CHANGE_NOZZLE, Disturbance(Hindrance.HAND, "select", "question", 5)),
    ),
    "a controller that gives up waiting counts as one that refused": (
        "NothingMovesOn",
        one_hour(Deed.CHANGE_NOZZLE, GIVES_UP),
    ),
    "a frozen holder goes on after its lease was taken": (
        "NoWriteWithoutLease",
        one_hour(Deed.CHANGE_NOZZLE, FROZEN, kind=CellKind.SOFTMOTION),
    ),
    "a roll-back writes over what was typed by hand": (
        "ByHandStays",
        one_hour(Deed.CHANGE_NOZZLE, TYPES, INTERRUPT),
    ),
}


@pytest.mark.parametrize(
    "name", [*SHOWN, *(pytest.param(name, marks=pytest.mark.soak) for name in LONGER)]
)
def test_a_sound_driver_keeps_the_rule_and_one_with_the_defect_does_not(name):
    rule, history = {**SHOWN, **LONGER}[name]
    sound = live_through(history)
    assert sound.broken == [], sound.told()
    assert sound.checks[rule] > 0
    told = live_through(history, BY_NAME[name])
    assert rule in {one.rule for one in told.broken}, told.told()
