"""Rules of the adversary that no known defect breaks: each says so when it is broken."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.frames import Frame

from robolink.model import ToolOffset, plain_offset
from tests.soak.adversary import drawn_history
from tests.soak.adversary.books import BookedMarker
from tests.soak.adversary.cell import VirtualCell
from tests.soak.adversary.people import wish_of
from tests.soak.adversary.plant.epson import EpsonPlant
from tests.soak.adversary.plant.machine import USUAL_TOOL, SentKind, SentRequest
from tests.soak.adversary.rules import Rulebook

WRITE = SentRequest(SentKind.WRITE, '$Execute,"TLSet 2, XY(1, 2, 3, 0)"', 2)
MOVE = SentRequest(SentKind.MOVE, '$Execute,"Move XY(1, 2, 3, 0)"')


class OpenMarker:
    """A journal that holds one marker of a write of tool 2."""

    trusted, lost = True, False

    def __init__(self, requested):
        details = {"tool": 2, "before": None, "requested": plain_offset(requested)}
        self.marker = BookedMarker("one", "set", "TLSet 2", details)

    def markers(self):
        """Return it."""
        return [self.marker]

    def holder(self):
        """Return who holds the lease."""
        return {"pid": 101}

    def last_number(self):
        """Return the number of the newest entry."""
        return 0


@pytest.fixture
def begun():
    """Begin an hour with a line, and return its rules, its machine and what is broken in it."""

    def begin(line=(), *, requested=USUAL_TOOL):
        history = drawn_history(23, hours=2)
        hour = replace(history.hours[1], line=tuple(line))
        cell = VirtualCell(history, Path("disk"))
        plant = EpsonPlant(ManualClock(), cell, seed=23)
        rules = Rulebook(cell.story, plant, cast(Any, OpenMarker(requested)))
        rules.begin(hour, wish_of(hour))
        return rules, plant, lambda: [one.rule for one in cell.story.broken]

    return begin


@pytest.fixture
def process():
    return cast(
        Any,
        SimpleNamespace(number=101, held_back=False, stopped_ns=None, put_back=set(), alive=True),
    )


def controller(*, closed):
    return cast(Any, SimpleNamespace(latch=SimpleNamespace(closed=closed)))


@pytest.mark.parametrize(("line", "broken"), [(("--dry-run",), ["ContractHolds"]), ((), [])])
def test_a_dry_run_sends_nothing_that_writes(begun, process, line, broken):
    rules, _, found = begun(("tool", "set", "2", *line))
    rules.contract.leaving(process, WRITE)
    assert found() == broken
    rules.contract.left()
    rules.contract.leaving(process, WRITE)  # the people put something right
    assert found() == broken


@pytest.mark.parametrize(
    ("requested", "broken"), [(USUAL_TOOL, ["ContractHolds"]), (ToolOffset(1.0, 2.0, 3.0), [])]
)
def test_what_is_there_already_is_not_written_again(begun, process, requested, broken):
    rules, _, found = begun(requested=requested)
    rules.leaving(process, WRITE)
    assert found() == broken


def test_from_the_first_instant_of_a_stop_no_movement_leaves(begun, process):
    rules, _, found = begun()
    rules.contract.stopping(process)
    rules.contract.stops.leaving(process, WRITE)
    assert found() == []
    rules.contract.stops.leaving(process, MOVE)
    assert found() == ["StillAfterStop"]


def test_only_a_release_opens_the_latch(begun, process):
    rules, _, found = begun()
    rules.contract.stopping(process)
    rules.contract.has_stopped(process, controller(closed=True), acknowledged=True)
    rules.contract.has_reset(process, controller(closed=True))
    rules.contract.releasing(process)
    rules.contract.has_reset(process, controller(closed=False))
    assert found() == []
    rules.contract.stopping(process)
    rules.contract.has_reset(process, controller(closed=False))
    assert found() == ["StillAfterStop"]


def test_what_was_acknowledged_as_stopped_stands_until_something_is_sent(
    begun, process, monkeypatch
):
    rules, plant, found = begun()
    rules.stopped()
    rules.contract.passed()
    assert found() == []
    off = Frame((1.0, 0.0, 0.0)) @ plant.flange()
    monkeypatch.setattr(plant, "flange", lambda: off)
    rules.contract.stops.leaving(process, MOVE)
    rules.contract.passed()
    assert found() == []
    monkeypatch.undo()
    rules.stopped()
    monkeypatch.setattr(plant, "flange", lambda: off)
    rules.contract.passed()
    assert found() == ["AtRestWhenStopped"]
