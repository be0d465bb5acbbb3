"""How long each deed is, counted in requests and in points: a fault is placed within it.

Measured: the least of three undisturbed runs of each (``python -m tests.soak.deed_lengths``).
What is placed behind the end of a deed is never met, so a place is drawn within its length.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from robolink_simulators.soak.history import CellKind, Deed

_MEASURED: Final = """\
EPSON CHANGE_NOZZLE requests: * 519, TLSet 6, Tool_ 2, Move_ 17, Go_ 3, Login 1, Print Tool 63
EPSON CHANGE_NOZZLE points: * 2753, commit 122, commit after 61, wire sent 519, procedure 27,
    question 15, step 14, TLSet 25, Tool_ 13, Move_ 85, lock Move 17, lock TLSet 2
EPSON SET_TOOL requests: * 14, TLSet 2, Login 1
EPSON SET_TOOL points: * 75, commit 4, commit after 2, wire sent 14, procedure 1, TLSet 9, lock
    TLSet 1
EPSON SET_TWO requests: * 26, TLSet 7, Login 1, Print Tool 1
EPSON SET_TWO points: * 144, commit 12, commit after 6, wire sent 26, procedure 2, TLSet 30,
    Tool_ 1, lock TLSet 3
EPSON SELECT_TOOL requests: * 5, Login 1, Print Tool 1
EPSON SELECT_TOOL points: * 26, wire sent 5, procedure 1, Tool_ 1
EPSON UNDO requests: * 35, TLSet 9, Login 1, Print Tool 3
EPSON UNDO points: * 194, commit 16, commit after 8, wire sent 35, procedure 3, TLSet 37, Tool_
    2, lock TLSet 3
SOFTMOTION CHANGE_NOZZLE requests: * 1725, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 19,
    MOVE_DIRECT 3, OWNERSHIP 2, read_slot 5, read_response 315, beat 306
SOFTMOTION CHANGE_NOZZLE points: * 2328, commit 130, commit after 65, wire sent 29, procedure
    29, question 17, step 14, WRITE_TOOL 5, SELECT_TOOL 12, MOVE_LINEAR 95, MOVE_DIRECT 15, lock
    2103 19, lock 5205 1
SOFTMOTION SET_TOOL requests: * 30, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 8
SOFTMOTION SET_TOOL points: * 52, commit 4, commit after 2, wire sent 3, procedure 1, WRITE_TOOL
    5, lock 5205 1
SOFTMOTION SET_TWO requests: * 42, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 12
SOFTMOTION SET_TWO points: * 80, commit 12, commit after 6, wire sent 4, procedure 2, WRITE_TOOL
    10, lock 5205 2
SOFTMOTION SELECT_TOOL requests: * 6, read_response 3
SOFTMOTION SELECT_TOOL points: * 10, procedure 1, SELECT_TOOL 1
SOFTMOTION UNDO requests: * 42, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 14
SOFTMOTION UNDO points: * 87, commit 16, commit after 8, wire sent 4, procedure 3, WRITE_TOOL 5,
    lock 5205 1
EPSON_SERIAL CHANGE_NOZZLE requests: * 515, TLSet 6, Tool_ 2, Move_ 17, Go_ 3, Login 1, Print
    Tool 63
EPSON_SERIAL CHANGE_NOZZLE points: * 2734, commit 122, commit after 61, wire sent 516, procedure
    27, question 15, step 14, TLSet 25, Tool_ 13, Move_ 85, lock Move 17, lock TLSet 2
EPSON_SERIAL SET_TOOL requests: * 14, TLSet 2, Login 1
EPSON_SERIAL SET_TOOL points: * 76, commit 4, commit after 2, wire sent 15, procedure 1, TLSet
    9, lock TLSet 1
EPSON_SERIAL SET_TWO requests: * 26, TLSet 7, Login 1, Print Tool 1
EPSON_SERIAL SET_TWO points: * 145, commit 12, commit after 6, wire sent 27, procedure 2, TLSet
    30, Tool_ 1, lock TLSet 3
EPSON_SERIAL SELECT_TOOL requests: * 6, Login 1, Print Tool 1
EPSON_SERIAL SELECT_TOOL points: * 32, wire sent 7, procedure 1, Tool_ 1
EPSON_SERIAL UNDO requests: * 35, TLSet 9, Login 1, Print Tool 3
EPSON_SERIAL UNDO points: * 195, commit 16, commit after 8, wire sent 36, procedure 3, TLSet 37,
    Tool_ 2, lock TLSet 3
MODBUS_TCP CHANGE_NOZZLE requests: * 1387, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 19,
    MOVE_DIRECT 3, OWNERSHIP 2, read_slot 5, read_response 284, beat 305
MODBUS_TCP CHANGE_NOZZLE points: * 1959, commit 130, commit after 65, wire sent 29, procedure
    29, question 17, step 14, WRITE_TOOL 5, SELECT_TOOL 12, MOVE_LINEAR 95, MOVE_DIRECT 15, lock
    2103 19, lock 5205 1
MODBUS_TCP SET_TOOL requests: * 20, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 8
MODBUS_TCP SET_TOOL points: * 42, commit 4, commit after 2, wire sent 3, procedure 1, WRITE_TOOL
    5, lock 5205 1
MODBUS_TCP SET_TWO requests: * 31, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 12
MODBUS_TCP SET_TWO points: * 69, commit 12, commit after 6, wire sent 4, procedure 2, WRITE_TOOL
    10, lock 5205 2
MODBUS_TCP SELECT_TOOL requests: * 5, read_response 3
MODBUS_TCP SELECT_TOOL points: * 9, procedure 1, SELECT_TOOL 1
MODBUS_TCP UNDO requests: * 34, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 14
MODBUS_TCP UNDO points: * 79, commit 16, commit after 8, wire sent 4, procedure 3, WRITE_TOOL 5,
    lock 5205 1
MODBUS_RTU CHANGE_NOZZLE requests: * 1092, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 19,
    MOVE_DIRECT 3, OWNERSHIP 2, read_slot 5, read_response 206, beat 333
MODBUS_RTU CHANGE_NOZZLE points: * 1593, commit 136, commit after 68, wire sent 29, procedure
    29, question 17, step 14, WRITE_TOOL 5, SELECT_TOOL 12, MOVE_LINEAR 95, MOVE_DIRECT 15, lock
    2103 19, lock 5205 1
MODBUS_RTU SET_TOOL requests: * 21, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 8
MODBUS_RTU SET_TOOL points: * 42, commit 4, commit after 2, wire sent 3, procedure 1, WRITE_TOOL
    5, lock 5205 1
MODBUS_RTU SET_TWO requests: * 32, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 12
MODBUS_RTU SET_TWO points: * 69, commit 12, commit after 6, wire sent 4, procedure 2, WRITE_TOOL
    10, lock 5205 2
MODBUS_RTU SELECT_TOOL requests: * 6, read_response 3
MODBUS_RTU SELECT_TOOL points: * 9, procedure 1, SELECT_TOOL 1
MODBUS_RTU UNDO requests: * 35, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 14
MODBUS_RTU UNDO points: * 79, commit 16, commit after 8, wire sent 4, procedure 3, WRITE_TOOL 5,
    lock 5205 1
CANOPEN CHANGE_NOZZLE requests: * 818, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 19, MOVE_DIRECT
    3, OWNERSHIP 2, read_slot 5, read_response 271, snapshot 271, beat 240
CANOPEN CHANGE_NOZZLE points: * 1413, commit 130, commit after 65, wire sent 29, procedure 29,
    question 17, step 14, WRITE_TOOL 5, SELECT_TOOL 12, MOVE_LINEAR 95, MOVE_DIRECT 15, lock
    2103 19, lock 5205 1
CANOPEN SET_TOOL requests: * 24, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 8,
    snapshot 8
CANOPEN SET_TOOL points: * 44, commit 4, commit after 2, wire sent 3, procedure 1, WRITE_TOOL 5,
    lock 5205 1
CANOPEN SET_TWO requests: * 38, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 12,
    snapshot 12
CANOPEN SET_TWO points: * 71, commit 12, commit after 6, wire sent 4, procedure 2, WRITE_TOOL
    10, lock 5205 2
CANOPEN SELECT_TOOL requests: * 7, read_response 3, snapshot 3
CANOPEN SELECT_TOOL points: * 10, procedure 1, SELECT_TOOL 1
CANOPEN UNDO requests: * 43, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 14, snapshot
    14
CANOPEN UNDO points: * 83, commit 16, commit after 8, wire sent 4, procedure 3, WRITE_TOOL 5,
    lock 5205 1
REGISTER_MAP SET_TOOL requests: * 26, fc16 1, fc5 2, fc3 10
REGISTER_MAP SET_TOOL points: * 27, commit 4, commit after 2, wire sent 3, procedure 1, fc16 1,
    fc5 2
REGISTER_MAP SET_TWO requests: * 54, fc16 2, fc5 4, fc3 24
REGISTER_MAP SET_TWO points: * 62, commit 12, commit after 6, wire sent 6, procedure 2, fc16 2,
    fc5 4
REGISTER_MAP UNDO requests: * 55, fc16 2, fc5 4, fc3 24
REGISTER_MAP UNDO points: * 66, commit 16, commit after 8, wire sent 6, procedure 2, fc16 2, fc5
    4
PROGRAM PRODUCE requests: * 14, HELLO 1, BEGIN 1, POSE 5, SOLVE 1, WROTE 1, PROOF 2, JUDGE 1,
    KEPT 1
PROGRAM PRODUCE points: * 42, commit 14, commit after 7, wire sent 14, WELCOME 1, VALUE 1, PROVE
    1, KEEP 1
"""
"""Cell, deed, what is counted: each text that a request or a point may hold, and how many do.

``*`` stands for any; ``_`` for a space behind a text.
"""

Places = tuple[tuple[str, int], ...]
"""Texts, each with how many requests or points hold it; never none."""


@dataclass(frozen=True, slots=True)
class DeedLength:
    """How long a deed is.

    Attributes:
        requests: What the machine receives.
        points: What is passed in the process: locks, commits, exchanges, questions.
        commits: How often the journal is about to commit.
    """

    requests: Places
    points: Places
    commits: int


def length_of(kind: CellKind, deed: Deed) -> DeedLength:
    """Return how long a deed is in a kind of cell."""
    measured = _measured()
    requests = measured[f"{kind.name} {deed.name} requests"]
    points = measured[f"{kind.name} {deed.name} points"]
    return DeedLength(requests, points, dict(points).get("commit", 0) // 2)


@cache
def _measured() -> Mapping[str, Places]:
    found = {}
    for row in re.sub(r"\n +", " ", _MEASURED).splitlines():
        name, _, counts = row.partition(": ")
        found[name] = tuple(map(_place, counts.split(", ")))
    return found


def _place(text: str) -> tuple[str, int]:
    match, _, count = text.rpartition(" ")
    spelled = "" if match == "*" else match[:-1] + " " if match.endswith("_") else match
    return spelled, int(count)
