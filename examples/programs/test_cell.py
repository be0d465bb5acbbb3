"""A cell's own tests: its recipe and its production script, before they reach the robot.

    pip install robolink pytest
    pytest test_cell.py

They run on simulated controllers, side by side if you like (pytest-xdist). Put the model of your
robot, your recipe and your script in place of those here; your controller may be a PLC as well
(softmotion_sim, softmotion_cell, plc_sim).
"""

import json
import sys
from typing import Any

import pytest
from change_and_try import change
from robolink_simulators.testkit.served import SimulatedCell

import robolink
from robolink import ToolOffset
from robolink.errors import OutcomeUnknownError

pytestmark = pytest.mark.robolink(robot="T6-602S", seed=7)

NEW = {1: ToolOffset(12.3, -3.7, -20.0), 2: ToolOffset(40.0, 0.5, -21.5)}
GOOD = [sys.executable, "-c", ""]
BAD = [sys.executable, "-c", "raise SystemExit(1)"]


def stored(cell: SimulatedCell) -> dict[str, Any]:
    """What the controller really holds, by tool."""
    found: dict[str, Any] = cell.truth()["stored"]
    return found


def test_a_good_part_keeps_both_offsets(epson_sim: SimulatedCell) -> None:
    with robolink.connect(epson_sim.url) as controller:
        assert change(controller, NEW, GOOD)
    assert stored(epson_sim)["1"]["x_mm"] == 12.3
    assert stored(epson_sim)["2"]["z_mm"] == -21.5
    epson_sim.wire.assert_sent("TLSet 1, XY", times=1)
    epson_sim.motions.assert_none()


def test_a_bad_part_puts_both_back(epson_sim: SimulatedCell) -> None:
    before = stored(epson_sim)
    with robolink.connect(epson_sim.url) as controller:
        assert not change(controller, NEW, BAD)
    assert stored(epson_sim) == before


def test_a_write_whose_answer_is_lost_is_not_sent_again(epson_sim: SimulatedCell) -> None:
    epson_sim.do("add_fault", action="drop_reply", match="TLSet 2, XY")
    with pytest.raises(OutcomeUnknownError):
        with robolink.connect(epson_sim.url) as controller:
            change(controller, NEW, GOOD)
    epson_sim.wire.assert_sent("TLSet 2, XY", times=1)


def test_an_emergency_stop_before_the_write_leaves_all_as_it_was(epson_sim: SimulatedCell) -> None:
    before = stored(epson_sim)
    epson_sim.operator.when("TLSet 1, XY", "press_estop")
    with pytest.raises(robolink.RobolinkError):
        with robolink.connect(epson_sim.url) as controller:
            change(controller, NEW, GOOD)
    assert stored(epson_sim) == before


def test_the_recipe_finds_the_tip(epson_cell: SimulatedCell) -> None:
    """A whole needle change, as the technician starts it; the simulated person touches the pin."""
    ended = epson_cell.run("change", str(epson_cell.recipe), *epson_cell.by_hand)
    assert ended.exit_code == 0, ended.messages
    assert json.loads(ended.out)["tools"][0]["verification"]["passed"]
    tip = epson_cell.truth()["tips"]["1"]
    assert stored(epson_cell)["1"]["x_mm"] == pytest.approx(tip["x_mm"], abs=0.1)
    assert stored(epson_cell)["1"]["y_mm"] == pytest.approx(tip["y_mm"], abs=0.1)
