"""Whole tool changes over Remote RS232 on a pseudo terminal: stopped, disturbed.

``test_killed`` has the killed ones. A few stops are tried by default, all of them with
``ROBOLINK_ALL_KILL_POINTS=1``; ``pytest -s`` shows how many.
"""

import os
from contextlib import suppress

import pytest
from robolink_simulators.faults import Fault, FaultAction, LinkKind
from robolink_simulators.faults.links import links_of

import robolink
from robolink.errors import RobolinkError
from robolink.model import MarkerKind
from robolink.transaction import Wanted, change_tools
from tests.faults._change_cell import EpsonChangeCell, change_cell
from tests.faults._change_process import NEW, OLD
from tests.faults._kill_points import NOTHING_LEFT
from tests.faults._stop_placements import Placement, Placements

pytestmark = pytest.mark.timeout(3600)

EVERYTHING = os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1"
_FEW_STOPS = 2


def change(cell: EpsonChangeCell, placements: Placements | None = None) -> RobolinkError | None:
    """Change tool 1 in this process; return how it ended."""
    outcomes = cell.journal.log(cell.url)
    watched = Placements() if placements is None else placements
    with robolink.connect(cell.url, outcomes=outcomes, timeout_s=0.5) as controller:
        watched.place_on(controller)
        try:
            with watched.watching():
                change_tools(controller, [Wanted(1, NEW[1], OLD[1])])
        except RobolinkError as error:
            return error
    return None


def check_stopped(folder, at: Placement) -> None:
    with change_cell(folder, wire="serial") as cell:
        at_rest: list[int] = []
        placements = Placements(at, lambda: at_rest.append(len(cell.writes())))
        error = change(cell, placements)
        assert placements.acknowledged, placements.refused
        (before,) = at_rest
        after = cell.writes()[before:]
        assert len(after) <= 1, "more than one roll-back"
        assert not after or cell.tools[1] == OLD[1], "a write that is no roll-back"
        assert error is not None or cell.tools == {**OLD, 1: NEW[1]}
        cell.recover()
        assert NOTHING_LEFT in cell.recover()
        assert cell.tools in (OLD, {**OLD, 1: NEW[1]})
        cell.check_all_is_settled()


def test_a_stop_at_each_point_of_a_change_on_a_serial_line_ends_it(tmp_path):
    whole = Placements()
    with change_cell(tmp_path / "whole", wire="serial") as cell:
        assert change(cell, whole) is None
        assert cell.tools == {**OLD, 1: NEW[1]}
    points = list(whole.distinct)
    chosen = points if EVERYTHING else points[:: max(1, len(points) // _FEW_STOPS) | 1]
    for number, at in enumerate(chosen):
        try:
            check_stopped(tmp_path / str(number), at)
        except AssertionError as error:
            error.add_note(f"stopped at {at}")
            raise
    print(f"RS232, stop: {len(chosen)} placements of {len(points)}")  # noqa: T201 - for pytest -s


POSSIBLE = [action for action in FaultAction if LinkKind.EPSON_SERIAL in links_of(action)]
LATE_ANSWERS = 2
"""A delayed answer costs the session in which it arrives, and never more."""

USUAL = (FaultAction.DROP_REPLY, FaultAction.GARBLE_REPLY)


@pytest.mark.parametrize(
    "action",
    [pytest.param(a, marks=() if a in USUAL else pytest.mark.soak, id=a.name) for a in POSSIBLE],
)
def test_each_fault_of_a_serial_line_at_the_write_ends_old_or_new_and_is_told(tmp_path, action):
    with change_cell(tmp_path / "cell", wire="serial") as cell:
        cell.epson.faults.add(Fault(action, match="TLSet 1,", seconds=20.0))
        error = change(cell)
        assert cell.epson.faults.fired, "it did not happen"
        assert cell.tools in (OLD, {**OLD, 1: NEW[1]})
        open_kinds = {marker.kind for _, marker in cell.journal.open_markers()}
        if error is None:
            assert cell.tools[1] == NEW[1]
            assert not open_kinds
        elif cell.tools[1] == NEW[1]:
            assert open_kinds & {MarkerKind.CHANGE, MarkerKind.SET}, "a value nobody knows of"
        if action is FaultAction.SERIOUS_ERROR:
            cell.epson.restart()
        cell.epson.panel.release_estop()
        cell.epson.panel.close_guard()
        if cell.epson.condition.error:
            with robolink.connect(cell.url, outcomes=cell.journal.log(cell.url)) as controller:
                controller.reset_fault()
        for _ in range(LATE_ANSWERS):
            with suppress(AssertionError):
                cell.recover()
        assert NOTHING_LEFT in cell.recover()
        assert cell.tools in (OLD, {**OLD, 1: NEW[1]})
