"""Restored known defects are found; ``make soak`` prints the table of all."""

from contextlib import ExitStack
from functools import cache
from unittest import mock

import pytest

from tests._rows import each_row
from tests.soak.adversary import CellKind, live_through
from tests.soak.adversary.history import Deed, Disturbance, Habit, Hindrance, History, Hour
from tests.soak.known_defects import DEFECTS
from tests.soak.mutant_table import Search, table

INTERRUPT = Disturbance(Hindrance.INTERRUPT, match="question", at=5)
ONE_CHANGE = History(0, CellKind.EPSON, (Hour(0, Deed.CHANGE_NOZZLE, Habit(), (INTERRUPT,)),))


@cache
def undisturbed_by_defects():
    return live_through(ONE_CHANGE)


BY_NAME = {defect.name: defect for defect in DEFECTS}


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("a movement leaves no durable mark", "MovesOnce"),
        ("the tool of before is not selected again", "SameToolSelected"),
    ],
)
def test_a_defect_that_is_put_back_is_found_by_its_rule_and_only_with_it(name, rule):
    story = live_through(ONE_CHANGE, BY_NAME[name].replacements)
    assert rule in {one.rule for one in story.broken}, story.told()
    assert undisturbed_by_defects().broken == []


@each_row("name", BY_NAME)
def test_what_a_defect_replaces_is_there(name):
    with ExitStack() as stack:
        for place, replacement in BY_NAME[name].replacements.items():
            stack.enter_context(mock.patch(place, replacement))


def test_each_known_defect_has_one_name_and_a_miss_is_printed_as_one():
    assert len(BY_NAME) == len(DEFECTS)
    assert sum(bool(one.found_by) for one in DEFECTS) >= 20
    found = Search(DEFECTS[0], "StillAfterStop", 2, 24, 1.0)
    missed = Search(DEFECTS[1], "", 0, 200, 1.0)
    lines = list(table([found, missed]))
    assert "| StillAfterStop | 2 | 24 |" in lines[2]
    assert "**missed**" in lines[3]
    (sums,) = [line for line in lines if line.startswith("1 of 2 found")]
    assert "of those found from outside 1 of 2" in sums
