"""The length of each deed in requests and in points, so that faults are placed within it.

Measured: the least of three undisturbed runs of each (``python -m tests.soak.deed_lengths``). A
fault placed after the end of a deed never occurs, so places are drawn within its length.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from tests.soak.adversary.history import CellKind, Deed

_MEASURED: Final = """\
EPSON CHANGE_NOZZLE requests: * 172, TLSet 6, Tool_ 2, Move_ 17, Go_ 3, Login 1, Print Tool 65
EPSON CHANGE_NOZZLE points: * 1028, commit 128, commit after 64, wire sent 172, procedure 29,
    question 15, step 16, TLSet 26, Tool_ 13, Move_ 85, lock Move 17, lock TLSet 2
EPSON SET_TOOL requests: * 15, TLSet 4, Login 1
EPSON SET_TOOL points: * 83, commit 4, commit after 2, wire sent 15, procedure 3, question 1,
    TLSet 18, Tool_ 1, lock TLSet 2
EPSON SET_TWO requests: * 28, TLSet 7, Login 1, Print Tool 1
EPSON SET_TWO points: * 158, commit 12, commit after 6, wire sent 28, procedure 5, question 1,
    TLSet 32, Tool_ 1, lock TLSet 3
EPSON SELECT_TOOL requests: * 9, Login 1, Print Tool 2
EPSON SELECT_TOOL points: * 47, wire sent 9, procedure 1, question 1, Tool_ 1
EPSON UNDO requests: * 35, TLSet 9, Login 1, Print Tool 3
EPSON UNDO points: * 201, commit 18, commit after 9, wire sent 35, procedure 7, question 1,
    TLSet 38, Tool_ 2, lock TLSet 3
EPSON SET_THEN_UNDO requests: * 30, TLSet 12, Login 1, Print Tool 1
EPSON SET_THEN_UNDO points: * 179, commit 16, commit after 8, wire sent 30, procedure 10,
    question 3, TLSet 54, Tool_ 3, lock TLSet 6
EPSON MOVE_AND_LEAVE requests: * 30, Move_ 1, Login 1, Print Tool 6
EPSON MOVE_AND_LEAVE points: * 161, commit 8, commit after 4, wire sent 30, procedure 3,
    question 1, Tool_ 1, Move_ 5, lock Move 1
SOFTMOTION CHANGE_NOZZLE requests: * 616, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 17,
    MOVE_DIRECT 3, OWNERSHIP 2, read_slot 6, read_response 226, beat 289
SOFTMOTION CHANGE_NOZZLE points: * 1150, commit 144, commit after 72, wire sent 27, procedure
    30, question 15, step 16, WRITE_TOOL 6, SELECT_TOOL 12, MOVE_LINEAR 85, MOVE_DIRECT 15, lock
    2103 17, lock 5205 1
SOFTMOTION SET_TOOL requests: * 27, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 11
SOFTMOTION SET_TOOL points: * 55, commit 4, commit after 2, wire sent 3, procedure 3, question
    1, WRITE_TOOL 6, lock 5205 1
SOFTMOTION SET_TWO requests: * 42, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 19
SOFTMOTION SET_TWO points: * 91, commit 12, commit after 6, wire sent 4, procedure 5, question
    1, WRITE_TOOL 12, lock 5205 2
SOFTMOTION SELECT_TOOL requests: * 7, read_response 4
SOFTMOTION SELECT_TOOL points: * 13, procedure 1, question 1, SELECT_TOOL 1
SOFTMOTION UNDO requests: * 46, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 22
SOFTMOTION UNDO points: * 106, commit 18, commit after 9, wire sent 4, procedure 7, question 1,
    WRITE_TOOL 6, lock 5205 1
SOFTMOTION SET_THEN_UNDO requests: * 49, WRITE_TOOL 3, OWNERSHIP 2, read_slot 10, read_response
    22
SOFTMOTION SET_THEN_UNDO points: * 115, commit 16, commit after 8, wire sent 5, procedure 10,
    question 3, WRITE_TOOL 18, lock 5205 3
SOFTMOTION MOVE_AND_LEAVE requests: * 39, MOVE_LINEAR 1, OWNERSHIP 2, read_response 18
SOFTMOTION MOVE_AND_LEAVE points: * 81, commit 8, commit after 4, wire sent 4, procedure 3,
    question 1, SELECT_TOOL 1, MOVE_LINEAR 5, lock 2103 1
EPSON_SERIAL CHANGE_NOZZLE requests: * 166, TLSet 6, Tool_ 2, Move_ 17, Go_ 3, Login 1, Print
    Tool 65
EPSON_SERIAL CHANGE_NOZZLE points: * 999, commit 128, commit after 64, wire sent 167, procedure
    29, question 15, step 16, TLSet 26, Tool_ 13, Move_ 85, lock Move 17, lock TLSet 2
EPSON_SERIAL SET_TOOL requests: * 14, TLSet 4, Login 1
EPSON_SERIAL SET_TOOL points: * 79, commit 4, commit after 2, wire sent 15, procedure 3,
    question 1, TLSet 18, Tool_ 1, lock TLSet 2
EPSON_SERIAL SET_TWO requests: * 27, TLSet 7, Login 1, Print Tool 1
EPSON_SERIAL SET_TWO points: * 154, commit 12, commit after 6, wire sent 28, procedure 5,
    question 1, TLSet 32, Tool_ 1, lock TLSet 3
EPSON_SERIAL SELECT_TOOL requests: * 10, Login 1, Print Tool 2
EPSON_SERIAL SELECT_TOOL points: * 53, wire sent 11, procedure 1, question 1, Tool_ 1
EPSON_SERIAL UNDO requests: * 34, TLSet 9, Login 1, Print Tool 3
EPSON_SERIAL UNDO points: * 197, commit 18, commit after 9, wire sent 35, procedure 7, question
    1, TLSet 38, Tool_ 2, lock TLSet 3
EPSON_SERIAL SET_THEN_UNDO requests: * 29, TLSet 12, Login 1, Print Tool 1
EPSON_SERIAL SET_THEN_UNDO points: * 175, commit 16, commit after 8, wire sent 30, procedure 10,
    question 3, TLSet 54, Tool_ 3, lock TLSet 6
EPSON_SERIAL MOVE_AND_LEAVE requests: * 29, Move_ 1, Login 1, Print Tool 6
EPSON_SERIAL MOVE_AND_LEAVE points: * 157, commit 8, commit after 4, wire sent 30, procedure 3,
    question 1, Tool_ 1, Move_ 5, lock Move 1
MODBUS_TCP CHANGE_NOZZLE requests: * 559, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 20,
    MOVE_DIRECT 3, OWNERSHIP 2, read_slot 6, read_response 224, beat 264
MODBUS_TCP CHANGE_NOZZLE points: * 1092, commit 152, commit after 76, wire sent 30, procedure
    33, question 18, step 16, WRITE_TOOL 6, SELECT_TOOL 12, MOVE_LINEAR 100, MOVE_DIRECT 15,
    lock 2103 20, lock 5205 1
MODBUS_TCP SET_TOOL requests: * 23, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 11
MODBUS_TCP SET_TOOL points: * 51, commit 4, commit after 2, wire sent 3, procedure 3, question
    1, WRITE_TOOL 6, lock 5205 1
MODBUS_TCP SET_TWO requests: * 38, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 19
MODBUS_TCP SET_TWO points: * 87, commit 12, commit after 6, wire sent 4, procedure 5, question
    1, WRITE_TOOL 12, lock 5205 2
MODBUS_TCP SELECT_TOOL requests: * 6, read_response 4
MODBUS_TCP SELECT_TOOL points: * 12, procedure 1, question 1, SELECT_TOOL 1
MODBUS_TCP UNDO requests: * 42, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 22
MODBUS_TCP UNDO points: * 102, commit 18, commit after 9, wire sent 4, procedure 7, question 1,
    WRITE_TOOL 6, lock 5205 1
MODBUS_TCP SET_THEN_UNDO requests: * 44, WRITE_TOOL 3, OWNERSHIP 2, read_slot 10, read_response
    22
MODBUS_TCP SET_THEN_UNDO points: * 110, commit 16, commit after 8, wire sent 5, procedure 10,
    question 3, WRITE_TOOL 18, lock 5205 3
MODBUS_TCP MOVE_AND_LEAVE requests: * 28, MOVE_LINEAR 1, OWNERSHIP 2, read_response 16
MODBUS_TCP MOVE_AND_LEAVE points: * 68, commit 8, commit after 4, wire sent 4, procedure 3,
    question 1, SELECT_TOOL 1, MOVE_LINEAR 5, lock 2103 1
MODBUS_RTU CHANGE_NOZZLE requests: * 1159, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 20,
    MOVE_DIRECT 3, OWNERSHIP 2, read_slot 6, read_response 193, beat 354
MODBUS_RTU CHANGE_NOZZLE points: * 1675, commit 164, commit after 82, wire sent 30, procedure
    33, question 18, step 16, WRITE_TOOL 6, SELECT_TOOL 12, MOVE_LINEAR 100, MOVE_DIRECT 15,
    lock 2103 20, lock 5205 1
MODBUS_RTU SET_TOOL requests: * 24, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 11
MODBUS_RTU SET_TOOL points: * 51, commit 4, commit after 2, wire sent 3, procedure 3, question
    1, WRITE_TOOL 6, lock 5205 1
MODBUS_RTU SET_TWO requests: * 39, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 19
MODBUS_RTU SET_TWO points: * 87, commit 12, commit after 6, wire sent 4, procedure 5, question
    1, WRITE_TOOL 12, lock 5205 2
MODBUS_RTU SELECT_TOOL requests: * 7, read_response 4
MODBUS_RTU SELECT_TOOL points: * 12, procedure 1, question 1, SELECT_TOOL 1
MODBUS_RTU UNDO requests: * 43, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 22
MODBUS_RTU UNDO points: * 102, commit 18, commit after 9, wire sent 4, procedure 7, question 1,
    WRITE_TOOL 6, lock 5205 1
MODBUS_RTU SET_THEN_UNDO requests: * 45, WRITE_TOOL 3, OWNERSHIP 2, read_slot 10, read_response
    22
MODBUS_RTU SET_THEN_UNDO points: * 110, commit 16, commit after 8, wire sent 5, procedure 10,
    question 3, WRITE_TOOL 18, lock 5205 3
MODBUS_RTU MOVE_AND_LEAVE requests: * 33, MOVE_LINEAR 1, OWNERSHIP 2, read_response 15, beat 5
MODBUS_RTU MOVE_AND_LEAVE points: * 71, commit 8, commit after 4, wire sent 4, procedure 3,
    question 1, SELECT_TOOL 1, MOVE_LINEAR 5, lock 2103 1
CANOPEN CHANGE_NOZZLE requests: * 754, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 20, MOVE_DIRECT
    3, OWNERSHIP 2, read_slot 6, read_response 224, snapshot 224, beat 268
CANOPEN CHANGE_NOZZLE points: * 1128, commit 152, commit after 76, wire sent 30, procedure 33,
    question 18, step 16, WRITE_TOOL 6, SELECT_TOOL 12, MOVE_LINEAR 100, MOVE_DIRECT 15, lock
    2103 20, lock 5205 1
CANOPEN SET_TOOL requests: * 30, WRITE_TOOL 1, OWNERSHIP 2, read_slot 4, read_response 11,
    snapshot 11
CANOPEN SET_TOOL points: * 54, commit 4, commit after 2, wire sent 3, procedure 3, question 1,
    WRITE_TOOL 6, lock 5205 1
CANOPEN SET_TWO requests: * 52, WRITE_TOOL 2, OWNERSHIP 2, read_slot 9, read_response 19,
    snapshot 19
CANOPEN SET_TWO points: * 92, commit 12, commit after 6, wire sent 4, procedure 5, question 1,
    WRITE_TOOL 12, lock 5205 2
CANOPEN SELECT_TOOL requests: * 9, read_response 4, snapshot 4
CANOPEN SELECT_TOOL points: * 13, procedure 1, question 1, SELECT_TOOL 1
CANOPEN UNDO requests: * 59, WRITE_TOOL 1, OWNERSHIP 2, read_slot 10, read_response 22, snapshot
    22
CANOPEN UNDO points: * 107, commit 18, commit after 9, wire sent 4, procedure 7, question 1,
    WRITE_TOOL 6, lock 5205 1
CANOPEN SET_THEN_UNDO requests: * 60, WRITE_TOOL 3, OWNERSHIP 2, read_slot 10, read_response 22,
    snapshot 22
CANOPEN SET_THEN_UNDO points: * 114, commit 16, commit after 8, wire sent 5, procedure 10,
    question 3, WRITE_TOOL 18, lock 5205 3
CANOPEN MOVE_AND_LEAVE requests: * 37, MOVE_LINEAR 1, OWNERSHIP 2, read_response 16, snapshot 16
CANOPEN MOVE_AND_LEAVE points: * 72, commit 8, commit after 4, wire sent 4, procedure 3,
    question 1, SELECT_TOOL 1, MOVE_LINEAR 5, lock 2103 1
OPCUA CHANGE_NOZZLE requests: * 487, WRITE_TOOL 1, SELECT_TOOL 2, MOVE_LINEAR 20, MOVE_DIRECT 3,
    OWNERSHIP 2, read_slot 8, read_response 190, beat 258
OPCUA CHANGE_NOZZLE points: * 948, commit 148, commit after 74, wire sent 30, procedure 33,
    question 18, step 16, WRITE_TOOL 6, SELECT_TOOL 12, MOVE_LINEAR 100, MOVE_DIRECT 15, lock
    2103 20, lock 5205 1
OPCUA SET_TOOL requests: * 25, WRITE_TOOL 1, OWNERSHIP 2, read_slot 6, read_response 13, beat 3
OPCUA SET_TOOL points: * 48, commit 4, commit after 2, wire sent 3, procedure 3, question 1,
    WRITE_TOOL 6, lock 5205 1
OPCUA SET_TWO requests: * 40, WRITE_TOOL 2, OWNERSHIP 2, read_slot 11, read_response 21, beat 4
OPCUA SET_TWO points: * 83, commit 12, commit after 6, wire sent 4, procedure 5, question 1,
    WRITE_TOOL 12, lock 5205 2
OPCUA SELECT_TOOL requests: * 8, read_slot 2, read_response 6
OPCUA SELECT_TOOL points: * 12, procedure 1, question 1, SELECT_TOOL 1
OPCUA UNDO requests: * 45, WRITE_TOOL 1, OWNERSHIP 2, read_slot 12, read_response 25, beat 4
OPCUA UNDO points: * 100, commit 18, commit after 9, wire sent 4, procedure 7, question 1,
    WRITE_TOOL 6, lock 5205 1
OPCUA SET_THEN_UNDO requests: * 47, WRITE_TOOL 3, OWNERSHIP 2, read_slot 12, read_response 25,
    beat 5
OPCUA SET_THEN_UNDO points: * 107, commit 16, commit after 8, wire sent 5, procedure 10,
    question 3, WRITE_TOOL 18, lock 5205 3
OPCUA MOVE_AND_LEAVE requests: * 30, MOVE_LINEAR 1, OWNERSHIP 2, read_slot 2, read_response 20,
    beat 4
OPCUA MOVE_AND_LEAVE points: * 66, commit 8, commit after 4, wire sent 4, procedure 3, question
    1, SELECT_TOOL 1, MOVE_LINEAR 5, lock 2103 1
REGISTER_MAP SET_TOOL requests: * 31, fc16 1, fc5 2, fc3 14
REGISTER_MAP SET_TOOL points: * 36, commit 4, commit after 2, wire sent 3, procedure 3, question
    1, fc16 1, fc5 2
REGISTER_MAP SET_TWO requests: * 64, fc16 2, fc5 4, fc3 32
REGISTER_MAP SET_TWO points: * 74, commit 12, commit after 6, wire sent 6, procedure 5, question
    1, fc16 2, fc5 4
REGISTER_MAP UNDO requests: * 65, fc16 2, fc5 4, fc3 32
REGISTER_MAP UNDO points: * 79, commit 16, commit after 8, wire sent 6, procedure 6, question 1,
    fc16 2, fc5 4
REGISTER_MAP SET_THEN_UNDO requests: * 96, fc16 3, fc5 6, fc3 48
REGISTER_MAP SET_THEN_UNDO points: * 113, commit 16, commit after 8, wire sent 9, procedure 10,
    question 3, fc16 3, fc5 6
PROGRAM PRODUCE requests: * 14, HELLO 1, BEGIN 1, POSE 5, SOLVE 1, WROTE 1, PROOF 2, JUDGE 1,
    KEPT 1
PROGRAM PRODUCE points: * 42, commit 14, commit after 7, wire sent 14, WELCOME 1, VALUE 1, PROVE
    1, KEEP 1
"""
"""Cell, deed, the counted thing: each text of a request or a point, and its number.

``*`` stands for any text; ``_`` for a space after a text.
"""

Places = tuple[tuple[str, int], ...]
"""Texts, each with the number of requests or points that contain it; never zero."""


@dataclass(frozen=True, slots=True)
class DeedLength:
    """The length of a deed.

    Attributes:
        requests: The requests that the machine receives.
        points: The points passed in the process: locks, commits, exchanges, questions.
        commits: How often the journal is about to commit.
    """

    requests: Places
    points: Places
    commits: int


def length_of(kind: CellKind, deed: Deed) -> DeedLength:
    """Return the length of a deed in a kind of cell."""
    if deed is Deed.COMMAND:  # most are as short as this one
        deed = Deed.SET_TOOL
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
