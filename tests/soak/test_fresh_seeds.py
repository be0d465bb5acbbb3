"""Histories of fresh seeds that broke a rule, cut to what it took: each rule holds in them now.

docs/reliability.md says of each what was wrong, in which of the two, and what holds now.
"""

import pytest

from tests.soak.adversary import drawn_history, live_through
from tests.soak.adversary.history import (
    CellKind,
    Deed,
    Disturbance,
    Habit,
    Hindrance,
    History,
    Hour,
)


def _wire(what, match, at, position):
    return Disturbance(Hindrance.WIRE, what, match, at, 0.0, position)


def _machine(what, match, at, position):
    return Disturbance(Hindrance.MACHINE, what, match, at, 0.0, position)


def _hand_types(at):
    return Disturbance(Hindrance.HAND, "type", "question", at, 0.01, None)


HISTORIES = (
    History(
        5034,
        CellKind.MODBUS_RTU,
        (
            Hour(
                4,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (
                    Disturbance(Hindrance.PRODUCTION, "", "WRITE_TOOL", 0, 3.0, None),
                    Disturbance(Hindrance.WIRE, "REORDER_WRITE", "WRITE_TOOL", 0, 5.0, 0),
                ),
            ),
        ),
    ),
    History(
        7171,
        CellKind.SOFTMOTION,
        (
            Hour(
                4,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (
                    Disturbance(Hindrance.ANOTHER_CLIENT, "", "WRITE_TOOL", 0, 5.0, None),
                    Disturbance(Hindrance.WIRE, "REORDER_WRITE", "WRITE_TOOL", 0, 0.05, 3),
                ),
            ),
        ),
    ),
    History(
        7187,
        CellKind.CANOPEN,
        (
            Hour(
                6,
                Deed.SET_TWO,
                Habit(),
                (
                    Disturbance(Hindrance.WIRE, "REORDER_WRITE", "WRITE_TOOL", 0, 20.0, 10),
                    Disturbance(Hindrance.WIRE, "DROP_REPLY", "WRITE_TOOL", 0, 0.0, None),
                ),
            ),
            Hour(
                7,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (),
            ),
        ),
    ),
    History(
        5031,
        CellKind.SOFTMOTION,
        (
            Hour(
                11,
                Deed.SET_TOOL,
                Habit(),
                (),
            ),
            Hour(
                18,
                Deed.SET_TOOL,
                Habit(),
                (Disturbance(Hindrance.SECOND_PERSON, "", "procedure", 0, 0.0, None),),
            ),
        ),
    ),
    History(
        6056,
        CellKind.REGISTER_MAP,
        (
            Hour(
                16,
                Deed.SET_TWO,
                Habit(),
                (Disturbance(Hindrance.POWER_CUT, "SYNC_LIES", "wire sent", 0, 0.0, None),),
            ),
            Hour(
                18,
                Deed.SET_TWO,
                Habit(),
                (Disturbance(Hindrance.STOP, "", "procedure", 0, 0.0, None),),
            ),
        ),
    ),
    History(
        7028,
        CellKind.REGISTER_MAP,
        (
            Hour(
                11,
                Deed.SET_TOOL,
                Habit(),
                (),
            ),
            Hour(
                12,
                Deed.UNDO,
                Habit(),
                (Disturbance(Hindrance.POWER_CUT, "SYNC_LIES", "fc16", 0, 0.0, None),),
            ),
            Hour(
                13,
                Deed.SET_TOOL,
                Habit(),
                (Disturbance(Hindrance.STOP, "", "fc16", 0, 0.0, None),),
            ),
        ),
    ),
    History(
        7176,
        CellKind.REGISTER_MAP,
        (
            Hour(
                15,
                Deed.SET_TWO,
                Habit(),
                (Disturbance(Hindrance.POWER_CUT, "SYNC_LIES", "fc16", 1, 0.0, None),),
            ),
            Hour(
                16,
                Deed.SET_TWO,
                Habit(),
                (Disturbance(Hindrance.KILL, "", "commit after", 2, 0.0, None),),
            ),
        ),
    ),
    History(
        7112,
        CellKind.MODBUS_TCP,
        (
            Hour(
                0,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (
                    Disturbance(Hindrance.POWER_CUT, "", "MOVE_LINEAR", 48, 0.0, None),
                    Disturbance(Hindrance.POWER_CUT, "SYNC_LIES", "lock 5205", 0, 0.0, None),
                ),
            ),
        ),
    ),
    History(
        919892694,
        CellKind.MODBUS_RTU,
        (
            Hour(
                0,
                Deed.SET_TOOL,
                Habit(),
                (Disturbance(Hindrance.DISK, "SYNC_FAILS", "commit before", 1, 0.0, None),),
            ),
        ),
    ),
    History(
        919892595,
        CellKind.SOFTMOTION,
        (
            Hour(
                4,
                Deed.SET_THEN_UNDO,
                Habit(),
                (Disturbance(Hindrance.MACHINE, "WORD_ORDER", "WRITE_TOOL", 2, 0.0, 2),),
            ),
        ),
    ),
    History(
        919892851,
        CellKind.SOFTMOTION,
        (
            Hour(
                4,
                Deed.SET_THEN_UNDO,
                Habit(),
                (Disturbance(Hindrance.STOP, "", "wire sent", 2, 0.0, None),),
            ),
        ),
    ),
    History(
        919893174,
        CellKind.MODBUS_RTU,
        (
            Hour(
                10,
                Deed.COMMAND,
                Habit(),
                (Disturbance(Hindrance.STOP, "", "procedure", 0, 0.0, None),),
                ("robot", "reset", "--yes"),
            ),
        ),
    ),
    History(
        730434096,
        CellKind.REGISTER_MAP,
        (
            Hour(
                10,
                Deed.SET_TWO,
                Habit(),
                (),
            ),
            Hour(
                17,
                Deed.UNDO,
                Habit(
                    person="anna",
                    stays_share=1.0,
                    types_ahead=False,
                    bias_mm=0.0,
                    tires_mm=0.0,
                    declines=False,
                    keeps=False,
                    impatient=True,
                ),
                (
                    Disturbance(Hindrance.LINE, "ADD_ANSWERED", "fc5", 0, 0.0, 32),
                    Disturbance(Hindrance.WIRE, "STALL", "fc5", 0, 2.0, 10),
                ),
            ),
        ),
    ),
    History(
        619593150,
        CellKind.EPSON,
        (
            Hour(
                5,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (),
            ),
            Hour(
                6,
                Deed.SET_TWO,
                Habit(),
                (
                    Disturbance(Hindrance.DISK, "UNWRITABLE", "commit before", 4, 0.0, None),
                    Disturbance(Hindrance.STOP, "", "exchange Print TLSet", 1, 0.01, None),
                ),
            ),
        ),
    ),
    History(
        919892864,
        CellKind.EPSON_SERIAL,
        (
            Hour(
                0,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (
                    Disturbance(Hindrance.HAND, "type", "question", 5, 0.0, None),
                    Disturbance(Hindrance.PENDANT, "", "Tool ", 1, 0.0, None),
                ),
            ),
        ),
    ),
    History(
        919892924,
        CellKind.EPSON_SERIAL,
        (
            Hour(
                10,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (
                    Disturbance(Hindrance.HAND, "type", "question", 2, 0.0, None),
                    Disturbance(Hindrance.PENDANT, "", "Go ", 0, 0.0, None),
                ),
            ),
        ),
    ),
    History(
        919892870,
        CellKind.EPSON,
        (
            Hour(2, Deed.CHANGE_NOZZLE, Habit(), ()),
            Hour(
                5,
                Deed.SELECT_TOOL,
                Habit(),
                (
                    Disturbance(Hindrance.FREEZE, "", "question", 0, 0.0, None),
                    Disturbance(Hindrance.DISK, "lost", "", 0, 0.0, None),
                ),
            ),
        ),
    ),
    History(
        919892798,
        CellKind.EPSON,
        (
            Hour(8, Deed.CHANGE_NOZZLE, Habit(), ()),
            Hour(
                9,
                Deed.SET_TWO,
                Habit(),
                (
                    Disturbance(Hindrance.HAND, "type", "question", 0, 0.0, None),
                    Disturbance(Hindrance.FREEZE, "", "question", 0, 0.0, None),
                    Disturbance(Hindrance.DISK, "lost", "", 0, 0.0, None),
                ),
            ),
        ),
    ),
    History(
        919892670,
        CellKind.EPSON,
        (
            Hour(
                14,
                Deed.COMMAND,
                Habit(),
                (Disturbance(Hindrance.STOP, "", "procedure", 0, 0.0, None),),
                ("robot", "motors", "off", "--yes"),
            ),
        ),
    ),
    History(
        919892577,
        CellKind.PROGRAM,
        (
            Hour(0, Deed.PRODUCE, Habit(), (_wire("BEND_ANSWERED", "", 7, 4),)),
            Hour(1, Deed.PRODUCE, Habit(), (_machine("RESTART", "SOLVE", 0, 0),)),
            Hour(2, Deed.PRODUCE, Habit(), (_machine("PIN_BUMPED", "POSE", 2, 1),)),
            Hour(
                3,
                Deed.PRODUCE,
                Habit("ben", impatient=True),
                (_wire("BEND_ANSWERED", "SOLVE", 0, 8),),
            ),
            Hour(4, Deed.PRODUCE, Habit(), (_wire("DROP_ASKED", "POSE", 3, 8),)),
            Hour(5, Deed.PRODUCE, Habit("ben"), ()),
            Hour(6, Deed.PRODUCE, Habit(), (_machine("TOUCH_BESIDE", "SOLVE", 0, 0),)),
            Hour(
                7,
                Deed.PRODUCE,
                Habit(keeps=True, impatient=True),
                (
                    Disturbance(Hindrance.POWER_CUT, "SYNC_LIES", "PROVE", 0, 0.0, None),
                    Disturbance(Hindrance.POWER_CUT, "SYNC_LIES", "commit after", 1, 0.0, None),
                    Disturbance(Hindrance.KILL, "", "VALUE", 0, 0.0, None),
                ),
            ),
        ),
    ),
    History(
        635312984,
        CellKind.EPSON_SERIAL,
        (
            Hour(
                12,
                Deed.COMMAND,
                Habit(),
                (Disturbance(Hindrance.STOP, "", "wire sent", 4, 0.0, None),),
                ("expert", "check-contract", "--yes"),
            ),
        ),
    ),
    History(
        242685805,
        CellKind.MODBUS_RTU,
        (
            Hour(17, Deed.SET_TOOL, Habit(), ()),
            Hour(
                18,
                Deed.SET_TWO,
                Habit(),
                (Disturbance(Hindrance.DISK, "UNWRITABLE", "commit before", 2, 0.0, None),),
            ),
        ),
    ),
    History(
        767170911,
        CellKind.SOFTMOTION,
        (
            Hour(
                19,
                Deed.CHANGE_NOZZLE,
                Habit("ben", keeps=True),
                (Disturbance(Hindrance.POWER_CUT, "", "lock 5205", 0, 0.0, None),),
            ),
        ),
    ),
    History(
        424472547,
        CellKind.CANOPEN,
        (
            Hour(
                16,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (
                    Disturbance(Hindrance.FREEZE, "", "question", 10, 0.0, None),
                    Disturbance(Hindrance.MACHINE, "RESTART", "write_command", 0, 20.0, None),
                ),
            ),
        ),
    ),
    History(
        552290885,
        CellKind.MODBUS_RTU,
        (
            Hour(
                12,
                Deed.COMMAND,
                Habit(),
                (Disturbance(Hindrance.STOP, "", "", 21, 0.0, None),),
                ("expert", "verify-controller"),
            ),
        ),
    ),
    History(
        30313,
        CellKind.EPSON_SERIAL,
        (
            Hour(4, Deed.UNDO, Habit(), ()),
            Hour(5, Deed.CHANGE_NOZZLE, Habit(), ()),
            Hour(6, Deed.CHANGE_NOZZLE, Habit(), (_hand_types(12),)),
            Hour(
                7,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (Disturbance(Hindrance.FREEZE, "", "question", 1, 0.0, None),),
            ),
            Hour(8, Deed.UNDO, Habit(), ()),
            Hour(9, Deed.CHANGE_NOZZLE, Habit(), ()),
            Hour(
                16,
                Deed.CHANGE_NOZZLE,
                Habit(impatient=True),
                (
                    _hand_types(6),
                    Disturbance(Hindrance.STOP, "", 'wire sent $Execute,"Move ', 13, 0.01, None),
                    _hand_types(9),
                    Disturbance(Hindrance.STOP, "", "lock Move ", 11, 20.0, None),
                ),
            ),
        ),
    ),
    History(
        691532353,
        CellKind.EPSON_SERIAL,
        (
            Hour(
                0,
                Deed.CHANGE_NOZZLE,
                Habit(),
                (Disturbance(Hindrance.PENDANT, "", "", 311, 0.0, None),),
            ),
        ),
    ),
    History(
        892864113,
        CellKind.EPSON_SERIAL,
        (
            Hour(12, Deed.CHANGE_NOZZLE, Habit(), ()),
            Hour(
                13,
                Deed.SET_TOOL,
                Habit(),
                (
                    Disturbance(Hindrance.STOP, "", "commit", 1, 0.0, None),
                    Disturbance(Hindrance.LINE, "SWAP_ANSWERED", "TLSet", 2, 0.0, 23),
                ),
            ),
        ),
    ),
)
HALF_A_FILE = drawn_history(919893192, 20)
"""A PLC over Modbus TCP, and a journal whose rows came back empty."""

LOST_RECORD = drawn_history(177058577, 20).without_hours(
    [hour for hour in range(20) if hour not in (8, 9)]
)
"""A program that calls back, and a journal that somebody has deleted."""
FROZEN_PROGRAM = drawn_history(919892947, 20).without_hours(
    [hour for hour in range(20) if hour not in (1, 2, 4)]
)
"""A hand cannot select a tool while the PLC's program stands still."""


@pytest.mark.soak
@pytest.mark.parametrize(
    "history",
    [*HISTORIES, HALF_A_FILE, LOST_RECORD, FROZEN_PROGRAM],
    ids=lambda history: str(history.seed),
)
def test_every_rule_holds_in_what_broke_one(history):
    story = live_through(history)
    assert story.broken == [], story.told()
