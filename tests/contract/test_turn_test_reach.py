"""Whether the arm can make the turn test is asked before anything moves.

A station near the arm's limit lets the tip be measured, and then not be turned: the controller
refused the movement after the write, and went into error with an untested value in its table.
"""

import math
from contextlib import contextmanager
from contextlib import nullcontext as no_error
from dataclasses import replace
from unittest.mock import patch

import pytest
from robolink_simulators.epson.arm.kinematics import solve

from robolink.calibration_run import ChangePlan, Limits, ToolPlan
from robolink.calibration_run._preview import require_turn_test
from robolink.controllers import SimpleController
from robolink.errors import LimitError
from robolink.model import Hand, Path, Pose, ToolOffset, WorkBox
from robolink.runner import Move, Rehearsal
from tests.contract import _shipped_cells
from tests.contract._shipped_cells import touched

pytestmark = pytest.mark.simulator_only

TOWARD_DEG = -15.0
REACH_MM = 600.0
BEYOND = "Turn test: Moving above the beams. The robot cannot reach that place"


@contextmanager
def needle_at(radius_mm, tmp_path, *changes):
    """The cell of the needle with its beams so far from the robot's axis."""
    angle = math.radians(TOWARD_DEG)
    x_mm, y_mm = radius_mm * math.cos(angle), radius_mm * math.sin(angle)
    with (
        patch.object(_shipped_cells, "BEAMS_MM", (x_mm, y_mm, -106.0)),
        touched("needle-beams.toml") as cell,
    ):
        above = Pose(x_mm - 12.4, y_mm + 3.7, -80, 0)
        arm = cell.simulator.machine.arm
        parked = replace(above, x_mm=above.x_mm - 20)
        arm.place(solve(arm.model, parked, Hand.RIGHT), 0)
        text = cell.recipe.read_text()
        for before, after in (
            ("x_mm = 175.0", f"x_mm = {x_mm:.3f}"),
            ("y_mm = 488.0", f"y_mm = {y_mm:.3f}"),
            ("x_mm = 158.6, y_mm = 495.4", f"x_mm = {parked.x_mm:.1f}, y_mm = {parked.y_mm:.1f}"),
            ("x_mm = 165, y_mm = 490", f"x_mm = {above.x_mm:.1f}, y_mm = {above.y_mm:.1f}"),
            *changes,
        ):
            assert before in text
            text = text.replace(before, after)
        path = tmp_path / "far.toml"
        path.write_text(text)
        yield replace(cell, recipe=path), arm


def test_a_turn_test_out_of_reach_is_refused_before_anything_moves(tmp_path):
    with needle_at(REACH_MM + 4, tmp_path) as (cell, arm):
        for words in ((), ("--dry-run",)):
            done = cell.change(*words, *cell.words)
            assert done.code == 2
            assert BEYOND in done.document["error"]["what"]
            assert "Let the turn test turn the tool another way" in done.document["error"]["remedy"]
        assert not arm.moves_started
        # Without the turn test there is nothing that could not be done.
        unproved = replace(cell, recipe=tmp_path / "unproved.toml")
        text = cell.recipe.read_text().replace("[source]", "verify = false\n\n[source]")
        text = text.replace("drift_mm = 0.1", "")
        unproved.recipe.write_text(text)
        assert unproved.change(*unproved.words).code == 0


@pytest.mark.soak
@pytest.mark.parametrize(("aside_mm", "code"), [(-0.5, 0), (0.5, 2)])
def test_a_tip_that_this_change_may_find_is_enough_to_begin(tmp_path, aside_mm, code):
    # With the stored offset the last search of the test is just out of reach.
    with needle_at(REACH_MM - 1.3, tmp_path) as (cell, arm):
        tips, stored = cell.simulator.world.tips, cell.simulator.machine.tools.get(1)
        tips[1] = ToolOffset(12.3, -3.7 + aside_mm, -20.0)
        done = cell.change(*cell.words)
        assert (done.code, bool(arm.moves_started)) == (code, True), done.err
        if code:
            # The tip that was found could not be proved, so it is not written.
            assert done.document["error"]["what"].startswith("Turn test: ")
            assert "Nothing was written." in done.document["error"]["remedy"]
            assert cell.simulator.machine.tools.get(1) == stored


@pytest.mark.soak
def test_what_is_asked_costs_a_like_run_nothing(tmp_path):
    with needle_at(REACH_MM - 6, tmp_path) as (cell, _):
        asked = []
        cell.simulator.on_request = lambda _number, request: asked.append(str(request))
        for expected in (True, False):
            asked.clear()
            assert cell.change(*cell.words).code == 0
            assert any("TargetOK" in one for one in asked) is expected


def test_a_turn_test_outside_the_box_is_refused_whatever_the_tip():
    plan = ChangePlan((ToolPlan(1),), Limits(WorkBox.reaching(30, down_mm=30, up_mm=30)))
    with SimpleController(identity="turn-test-box") as controller:
        for further_mm, refused in ((0, False), (40, True)):
            rehearsal = Rehearsal(Pose(300, 0, 0, 0, tool=0))
            rehearsal.select(Pose(312, 0, -20, 0, tool=1), ToolOffset(12, 0, -20))
            target = Pose(330 + further_mm, 0, -20, 90, tool=1)
            rehearsal.run(turned_to(target))
            outcome = pytest.raises(LimitError, match=r"Turn test: Turning\. X")
            with outcome if refused else no_error():
                require_turn_test(controller, plan, rehearsal)


def turned_to(target):
    """A procedure of one movement."""
    yield Move(target, Path.JOINT, "Turning.")
