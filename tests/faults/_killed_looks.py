"""A look through the controller's own camera (``vision-guide``) that is killed.

No tool is touched, nothing moves, an unconfirmed look blocks the next one until a person recovers,
and the next look shows the present picture, never the killed one's.
"""

from pathlib import Path

import pytest
from robolink_simulators.epson.vision_file import install_vision

import robolink
from robolink.errors import OutcomeUnknownError
from robolink.model import TIP, LookingController
from tests.faults._change_cell import EpsonChangeCell
from tests.faults._change_process import OLD

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
_PROGRAM_S = 10.0
"""The program on the controller has ended after this time, whoever started it."""


def furnish(cell: EpsonChangeCell) -> None:
    """Give the controller its vision system, and bring the tip to the camera."""
    cell.epson.load([PROGRAM])
    path = cell.folder / "vision.toml"
    path.write_text(VISION)
    install_vision(cell.epson, path)
    lead_tip(cell, 0.0)


def lead_tip(cell: EpsonChangeCell, beside_mm: float) -> None:
    """Bring the tip to the camera, or beside its middle."""
    world = cell.epson.world
    tip, there = world.tip_mm(), world.camera.middle_mm
    by_mm = (there[0] + beside_mm - tip[0], there[1] - tip[1], there[2] - tip[2])
    world.robot.carry(world.tips[1], by_mm)


def look(cell: EpsonChangeCell) -> tuple[float, float]:
    """Look for the tip and return its place, in mm."""
    with robolink.connect(cell.url, outcomes=cell.journal.log(cell.url)) as controller:
        assert isinstance(controller, LookingController)
        (spot,) = controller.look(TIP, program=7)
    return spot.x, spot.y


def check_killed_look(cell: EpsonChangeCell) -> None:
    """Check the leftovers of a killed look, recover as a person does, and look again."""
    cell.skip(_PROGRAM_S)
    cell.check_what_was_acknowledged_is_there()
    assert (cell.tools, cell.selected, cell.writes()) == (OLD, 1, [])
    assert cell.epson.machine.arm.moves_started == 0
    with cell.epson.lock:
        lead_tip(cell, BESIDE_MM)
    if cell.journal.open_markers():
        with pytest.raises(OutcomeUnknownError):
            look(cell)
        cell.command("resolve", "--yes")
    assert cell.journal.open_markers() == ()
    x_mm, y_mm, _ = cell.epson.world.tip_mm()
    assert look(cell) == pytest.approx((x_mm, y_mm), abs=1e-6)
