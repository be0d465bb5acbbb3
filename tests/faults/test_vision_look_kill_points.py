"""SIGKILL at each step of a look through the controller's own camera (``vision-guide``).

What must hold afterwards: no tool was touched, nothing moved, a look in doubt blocks the next one
until a person has settled it, and the next look tells what is before the camera then, never what
the killed one has seen. By default the steps about the start of the program are taken;
``ROBOLINK_ALL_KILL_POINTS=1`` takes all, ``pytest -s`` shows how many.
"""

import contextlib
import io
import os
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.epson.vision_file import install_vision

import robolink
from robolink.errors import OutcomeUnknownError
from robolink.model import TIP, LookingController
from tests.faults._change_cell import EpsonChangeCell, Step, WireStep, change_cell
from tests.faults._change_process import OLD

pytestmark = pytest.mark.timeout(3600)

PROGRAM = Path(__file__).parents[2] / "companions" / "epson" / "robolink_vision.prg"
VISION = """
schema = "robolink/vision/1"
[world]
camera_noise_px = 0.0
[[sequence]]
name = "findTip"
properties = { Calibration = "up" }
  [[sequence.object]]
  name = "tip"
  properties = { NumberToFind = 0 }
[[calibration]]
name = "up"
exact = true
"""
BESIDE_MM = 1.5


def furnish(cell: EpsonChangeCell) -> None:
    """Give the controller its vision system, and bring the tip before the camera."""
    cell.epson.load([PROGRAM])
    path = cell.folder / "vision.toml"
    path.write_text(VISION)
    install_vision(cell.epson, path)
    lead_tip(cell, 0.0)


def lead_tip(cell: EpsonChangeCell, beside_mm: float) -> None:
    world = cell.epson.world
    tip, there = world.tip_mm(), world.camera.middle_mm
    by_mm = (there[0] + beside_mm - tip[0], there[1] - tip[1], there[2] - tip[2])
    world.robot.carry(world.tips[1], by_mm)


def look(cell: EpsonChangeCell) -> tuple[float, float]:
    with robolink.connect(cell.url, outcomes=cell.journal.log(cell.url)) as controller:
        assert isinstance(controller, LookingController)
        (spot,) = controller.look(TIP, program=7)
    return spot.x, spot.y


def resolve(cell: EpsonChangeCell) -> None:
    """Settle what is in doubt, as a person who looked at the robot does."""
    said = io.StringIO()
    with (
        pytest.MonkeyPatch.context() as environment,
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(said),
    ):
        environment.setenv("ROBOLINK_JOURNAL", str(cell.folder / "journal.db"))
        environment.setenv("ROBOLINK_STATE_DIR", str(cell.folder))
        assert main.run(["-c", cell.url, "resolve", "--yes"]) == 0


def check_killed_look(cell: EpsonChangeCell, step: Step) -> None:
    furnish(cell)
    moves = cell.epson.machine.arm.moves_started
    cell.kill("look", step)
    cell.check_what_was_acknowledged_is_there()
    assert (cell.tools, cell.selected, cell.writes()) == (OLD, 1, [])
    assert cell.epson.machine.arm.moves_started == moves
    with cell.epson.lock:
        lead_tip(cell, BESIDE_MM)
    if cell.journal.open_markers():
        with pytest.raises(OutcomeUnknownError):
            look(cell)
        resolve(cell)
    assert cell.journal.open_markers() == ()
    x_mm, y_mm, _ = cell.epson.world.tip_mm()
    assert look(cell) == pytest.approx((x_mm, y_mm), abs=1e-6)


def matters(step: Step) -> bool:
    return isinstance(step, WireStep) and step.request.startswith("$Start")


def test_a_look_killed_at_each_step_is_never_taken_for_a_later_one(tmp_path):
    with change_cell(tmp_path / "whole") as cell:
        furnish(cell)
        all_steps = cell.steps_of("look")
        assert (cell.tools, cell.selected) == (OLD, 1)
    everything = os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1"
    steps = all_steps if everything else [step for step in all_steps if matters(step)]
    assert len(steps) > 1
    for number, step in enumerate(steps):
        with change_cell(tmp_path / str(number)) as cell:
            try:
                check_killed_look(cell, step)
            except AssertionError as error:
                error.add_note(f"killed at {step}")
                raise
    print(f"look: {len(steps)} kill points of {len(all_steps)}")  # noqa: T201 - for pytest -s
