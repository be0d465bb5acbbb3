"""Every live method on robots of each family, on a table and under a ceiling."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.epson.memory.points import Point

from robolink.calibration import rotation_of
from robolink.model import Pose, ToolOffset
from tests.contract._camera_cell import furnish
from tests.contract._method_cell import method_cell

pytestmark = pytest.mark.simulator_only

EXAMPLE = Path(__file__).parents[2] / "examples" / "recipes" / "five-axes-pivot.toml"
ROBOTS = ("C8-C901S", "C8-C1401CR", "C12-C1401S", "CX4-A601SR", "CX7-A701S")
PLANAR = ("GX4-C351S-L", "GX8-C652SR", "RS4-C351S", "RS6-C552C")


@pytest.fixture
def at(tmp_path, monkeypatch, request):
    with method_cell(request.param, tmp_path, monkeypatch) as cell:
        yield cell


def each(*names, chosen):
    """Run a test on several robots; on those that are not chosen in the long tests only."""
    robots = [
        pytest.param(name, marks=() if name in chosen else pytest.mark.soak) for name in names
    ]
    return pytest.mark.parametrize("at", robots, indirect=True)


def recovered(done, truth, axes="xy"):
    """Tell whether the truth lies in the stated interval, four times as wide for safety."""
    assert done.code == 0, done.err[-1500:] + done.out[-500:]
    document = done.document
    half = document["fit"]["half_width95"]
    for axis in axes:
        wrong = document["proposed"][f"{axis}_mm"] - getattr(truth, f"{axis}_mm")
        assert abs(wrong) <= 4 * half.get(f"{axis}_mm", 0.02) + 0.002, (axis, wrong, half)
    assert document["verification"]["passed"]
    return document


@each(*ROBOTS, chosen={"C8-C1401CR"})
def test_a_pivot_recovers_the_whole_tip(at):
    document = recovered(at.calibrate("pivot", "--count", "4"), at.truth, "xyz")
    assert document["measured"] == ["x_mm", "y_mm", "z_mm"]


@each(*ROBOTS, chosen={"C12-C1401S"})
def test_six_points_recover_the_orientation_too(at):
    furnish(at.cell, tool_u_deg=20.0, tool_v_deg=8.0, tool_w_deg=-5.0)
    truth = at.truth
    recovered(at.calibrate("six-point"), truth, "xyz")
    seen = rotation_of(Pose(0, 0, 0, *at.stored.components()[3:]))
    true = rotation_of(Pose(0, 0, 0, *truth.components()[3:]))
    assert abs(seen - true).max() < 0.01


@each(*ROBOTS, *PLANAR, chosen={"CX4-A601SR", "RS4-C351S"})
def test_angles_and_then_one_touch_recover_two_needles(at):
    recovered(at.calibrate("n-angle", "--station", "PIN-07", "--count", "4"), at.truth)
    before, tip = at.stored, at.truth
    at.lengthen(0.4, 0.3, -0.2)
    done = at.calibrate("one-touch", "--station", "PIN-07")
    assert done.code == 0, done.err
    for axis in ("x_mm", "y_mm", "z_mm"):
        change = getattr(at.truth, axis) - getattr(tip, axis)
        error = getattr(at.stored, axis) - getattr(before, axis) - change
        assert abs(error) <= 3 * done.document["fit"]["half_width95"][axis], axis


@each(*ROBOTS, *PLANAR, chosen={"C8-C901S"})
def test_beams_recover_the_tip(at):
    at.mount()
    recovered(at.calibrate("beams", "--station", "BEAMS-02"), at.truth)


@each(*ROBOTS, *PLANAR, chosen={"C8-C1401CR"})
def test_a_plate_recovers_the_length(at):
    at.mount()
    recovered(at.calibrate("z-touch", "--station", "PLATE"), at.truth, "z")


@each(*ROBOTS, *PLANAR, chosen={"CX7-A701S", "RS6-C552C"})
def test_a_camera_is_found_and_then_recovers_the_tip_and_a_board(at):
    place = ",".join(map(str, at.world.camera.middle_mm))
    usual = ("--station", "CAM", "--sensor", at.cell.url)
    recovered(at.calibrate("camera-affine", "--at", place, *usual), at.truth)
    at.world.change_nozzle()
    recovered(at.calibrate("camera", *usual), at.truth)
    furnish(at.cell, board_held=True)
    held = at.world.board
    fiducials = [f"--fiducial={x},{y}" for x, y in held.drawing_mm]
    done = at.calibrate("board", *fiducials, *usual)
    document = recovered(done, held.frame(at.truth))
    turned = document["proposed"]["u_deg"] - held.frame(at.truth).u_deg
    assert abs(turned) < 0.05


@each("C8-C901S", "CX4-A601SR", chosen={"CX4-A601SR"})
def test_what_a_write_does_at_taught_points_is_said_in_space(at):
    machine = at.cell.simulator.machine
    machine.points.store(3, Point.at(machine.tip()))
    before = machine.tip()
    document = recovered(at.calibrate("pivot", "--count", "4", "--impact", "1-5"), at.truth, "xyz")
    (entry,) = document["impact"]["points"]
    # The tip that is on the arm now stands that much beside the point with the old offset.
    change = [document["proposed"][f"{a}_mm"] - document["before"][f"{a}_mm"] for a in "xyz"]
    moved = rotation_of(before) @ change
    shown = [entry["dx_mm"], entry["dy_mm"], entry["dz_mm"]]
    assert shown == pytest.approx((-moved).tolist(), abs=2e-3)


@each("C8-C901S", "CX7-A701SR", chosen={"CX7-A701SR"})
def test_tools_on_one_head_are_measured_one_by_one(at):
    """A second needle, tilted on the flange: each is found, neither changes the other."""
    second = ToolOffset(-15.0, 8.0, 110.0, 0.0, 12.0, 0.0)
    at.world.tips[2] = replace(second, x_mm=second.x_mm + 0.3, z_mm=second.z_mm - 0.4)
    at.cell.simulator.machine.tools.set(2, second)
    recovered(at.calibrate("pivot", "--count", "4"), at.truth, "xyz")
    first = at.stored
    x_mm, y_mm, z_mm = at.world.tip_mm(2)
    at.world.pin_mm = (x_mm + 3.0, y_mm - 3.0, z_mm - 4.0)
    recovered(at.calibrate("pivot", "--count", "4", tool=2), at.world.tips[2], "xyz")
    assert at.held(2).components()[3:] == second.components()[3:]
    assert at.stored == first


@each("C8-C901S", "C8-C1401CR", "CX4-A601S", chosen={"C8-C901S"})
def test_a_recipe_measures_writes_and_proves(at, tmp_path):
    x, y, z, u, v, w = at.world.robot.flange().coordinates()
    safe = f"{{ x_mm = {x}, y_mm = {y}, z_mm = {z + 5}, u_deg = {u}, v_deg = {v}, w_deg = {w} }}"
    text = EXAMPLE.read_text(encoding="utf-8")
    for key in ("safe", "approach"):
        text = re.sub(rf"\n{key} = .*", f"\n{key} = {safe}", text)
    path = tmp_path / "six-axes.toml"
    path.write_text(text)
    words = ("recalibrate", str(path), "--assist", at.cell.url, "--yes", "--json")
    done = at.run(*words, "--nozzle", "N-1")
    assert done.code == 0, done.err
    (tool,) = done.document["tools"]
    halves = tool["fit"]["half_width95"]
    for axis, half in halves.items():
        assert abs(getattr(at.stored, axis) - getattr(at.truth, axis)) <= 2 * half < 0.1
    assert tool["verification"]["passed"]
