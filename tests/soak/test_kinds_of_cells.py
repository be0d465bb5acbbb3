"""Every kind of cell: its deeds succeed undisturbed, and its defects are found."""

import os
import subprocess
import sys

import pytest

from robolink.model import Marker, MarkerKind, plain_offset
from robolink.serving._callback_journal import ProgramChange
from tests.soak.adversary import CellKind, live_through, run
from tests.soak.adversary.drawn_hours import deeds_of
from tests.soak.adversary.history import Habit, History, Hour
from tests.soak.known_defects import DEFECTS

pytestmark = pytest.mark.soak

SEEDS, HOURS = range(6), 10
BY_NAME = {defect.name: defect.replacements for defect in DEFECTS}
UNMARKED_WRITE = BY_NAME["a write leaves no durable mark"]
UNMARKED_MOVE = BY_NAME["a movement leaves no durable mark"]


def handed_out_without_a_marker(log, tool, before, requested):
    values = {"before": plain_offset(before), "requested": plain_offset(requested)}
    marker = Marker("none", MarkerKind.CHANGE, "none", "", {"tools": {str(tool): values}})
    return ProgramChange(log, marker)


UNMARKED_VALUE = {"robolink.serving._conversation.begin_change": handed_out_without_a_marker}


@pytest.mark.parametrize("kind", CellKind)
def test_undisturbed_deeds_come_off(kind):
    hours = (Hour(n, deed, Habit(), ()) for n, deed in enumerate([*deeds_of(kind)] * 2))
    story = live_through(History(3, kind, tuple(hours)))
    assert story.broken == [], story.told()
    assert all(ending.endswith(": done") for ending in story.endings)
    assert sum(story.endings.values()) == story.hours


@pytest.mark.parametrize("kind", CellKind)
def test_one_seed_is_one_history_in_every_process_and_kind(kind):
    program = (
        "from tests.soak.adversary import CellKind, run; "
        f"print(run(11, 3, kind=CellKind.{kind.name}).hash)"
    )
    told = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONHASHSEED": "12345"},
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    assert told.strip() == run(11, 3, kind=kind).hash


@pytest.mark.parametrize(
    ("kind", "replacements", "rule"),
    [
        (CellKind.EPSON_SERIAL, UNMARKED_MOVE, "MovesOnce"),
        (CellKind.MODBUS_TCP, UNMARKED_MOVE, "MovesOnce"),
        (CellKind.MODBUS_RTU, UNMARKED_MOVE, "MovesOnce"),
        (CellKind.CANOPEN, UNMARKED_MOVE, "MovesOnce"),
        (CellKind.OPCUA, UNMARKED_MOVE, "MovesOnce"),
        (CellKind.REGISTER_MAP, UNMARKED_WRITE, "OnlyWantedValues"),
        (CellKind.PROGRAM, UNMARKED_VALUE, "NothingWithoutRecord"),
    ],
)
def test_a_defect_is_found_in_every_kind_of_cell(kind, replacements, rule):
    found = set()
    for seed in SEEDS:
        found |= {one.rule for one in run(seed, HOURS, kind=kind, replacements=replacements).broken}
        if rule in found:
            return
    pytest.fail(f"{rule} was not broken, but {found}")
