"""A camera turned since its calibration: its results do not stay written."""

from dataclasses import replace

import pytest

from tests.contract.test_calibrate_camera import SIM, desk

__all__ = ["desk"]

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]


@pytest.mark.parametrize("what", ["turned", "nearer"])
def test_what_was_seen_through_it_is_contradicted_by_its_own_turn_test(desk, what):
    """The results are 0.025 and 0.055 mm wrong, in a turn test with a limit of 0.2 mm."""
    opened = desk()
    usual = ("--tool", "1", "--station", "CAM", "--sensor", SIM, "--yes", "--json")
    code, _, messages = opened.run("calibrate", "camera-affine", "--at", opened.at, *usual)
    assert code == 0, messages
    machine, world = opened.cell.simulator.machine, opened.cell.simulator.world
    before = machine.tools.get(1)
    optics = world.camera.optics
    world.camera.optics = {
        "turned": replace(optics, turn_deg=optics.turn_deg + 10),
        "nearer": replace(
            optics, um_per_px_x=optics.um_per_px_x / 1.25, um_per_px_y=optics.um_per_px_y / 1.25
        ),
    }[what]
    world.change_nozzle()
    code, document, messages = opened.run("calibrate", "camera", *usual)
    # Refused before the write, or undone after it.
    assert code in (7, 8), messages
    assert document["error"]["code"] in ("proof_contradicts_accuracy", "camera_changed")
    now = machine.tools.get(1)
    assert (now.x_mm, now.y_mm) == (before.x_mm, before.y_mm)
