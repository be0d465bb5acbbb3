"""Stations of six-axis arms near a singular position are found before anything moves."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.epson.arm.robots import Joints

from robolink.model import ToolOffset
from tests.contract._camera_cell import furnish
from tests.contract._method_cell import CELL, method_cell
from tests.contract.test_calibrate_six_axes import interval_mm

pytestmark = pytest.mark.simulator_only

EXAMPLES = Path(__file__).parents[2] / "examples" / "recipes"
TABLE, CEILING = "C8-C901S", "CX4-A601SR"
LEANING = ToolOffset(30.0, 0.0, 120.0)
"""A tip 30 mm from the axis of the flange."""
PLACES = {
    "wrist": (
        TABLE,
        (0.0, -25.0, -57.0, 0.0, -8.0, 0.0),
        r"Joint 5 would be at -\d\.\d degrees",
    ),
    "elbow": (TABLE, (0.0, -88.6, 84.0, 0.0, -85.4, 0.0), "cannot reach"),
    "shoulder": ("CX4-A601S", (0.0, 65.651, -27.855, 0.0, -127.796, 0.0), "cannot reach"),
    "wrist under a ceiling": (CEILING, (0.0, -25.0, -57.0, 0.0, -8.0, 0.0), "Joint 5 would be"),
    "elbow under a ceiling": (CEILING, (0.0, -75.2, 77.6, 0.0, 87.6, 0.0), "cannot reach"),
}
"""The tool points down in each: joint 5 nearly at 0; the arm nearly stretched; the wrist 26 mm in
front of the axis of joint 1, so that it would have to pass behind it.
"""


@pytest.fixture
def at(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch, seed=8) as cell:
        yield cell


def cell_file():
    return Path(os.environ["ROBOLINK_CONFIG"])


def stand(at, joints, tip=None):
    """Put the arm at a place, with all stations of the cell at its tip."""
    simulator, cell = at.cell.simulator, at.cell
    simulator.machine.arm.place(Joints(*joints), simulator.now_ns)
    if tip is not None:
        simulator.machine.tools.set(1, tip)
        at.world.tips[1] = replace(tip, x_mm=tip.x_mm + 0.2, y_mm=tip.y_mm - 0.15)
    x_mm, y_mm, z_mm = at.world.tip_mm()
    at.world.pin_mm = (x_mm + 3.0, y_mm - 3.0, z_mm - 4.0)
    at.world.camera.middle_mm = (x_mm + 2.0, y_mm - 2.0, z_mm - 5.0)
    cell.__post_init__()
    text = CELL.format(url=cell.url, beams=cell.place_mm, plate=cell.plate)
    cell_file().write_text(text)
    at.mount()


def refused(at, done):
    """Check that nothing moved, and return the reason."""
    assert done.code == 2, done.out + done.err
    assert at.cell.simulator.machine.arm.moves_started == 0
    return json.loads(done.out)["error"]["what"]


def crossing(at):
    return at.calibrate("beams", "--station", "BEAMS-02")


def touching(at):
    return at.calibrate("z-touch", "--station", "PLATE")


def looking(at):
    place = ",".join(map(str, at.world.camera.middle_mm))
    sensor = ("--station", "CAM", "--sensor", at.cell.url)
    return at.calibrate("camera-affine", "--at", place, *sensor)


def a_board(at):
    furnish(at.cell, board_held=True)
    fiducials = [f"--fiducial={x},{y}" for x, y in at.world.board.drawing_mm]
    return looking_at(at, "board", *fiducials)


def looking_at(at, method, *more):
    x_mm, y_mm, z_mm = at.world.camera.middle_mm
    station = '\n[cells.a.stations.CAM]\nkind = "camera"\n'
    station += f"x_mm = {x_mm}\ny_mm = {y_mm}\nz_mm = {z_mm}\n"
    station += "mm_per_px = [[0.01, 0.0], [0.0, 0.01]]\norigin_mm = [0.0, 0.0]\n"
    path = cell_file()
    path.write_text(path.read_text() + station)
    return at.calibrate(method, *more, "--station", "CAM", "--sensor", at.cell.url)


def a_recipe(at):
    """A recipe that measures there."""
    x, y, z, u, v, w = at.world.robot.flange().coordinates()
    place = f"{{ x_mm = {x}, y_mm = {y}, z_mm = {z}, u_deg = {u}, v_deg = {v}, w_deg = {w} }}"
    safe = place.replace(f"z_mm = {z}", f"z_mm = {z + 20}")
    text = (EXAMPLES / "five-axes-pivot.toml").read_text(encoding="utf-8")
    text = re.sub(r"\nsafe = .*", f"\nsafe = {safe}", text)
    text = re.sub(r"\napproach = .*", f"\napproach = {place}", text)
    path = cell_file().with_name("recipe.toml")
    path.write_text(text)
    words = ("--assist", at.cell.url, "--yes", "--json", "--nozzle", "N-1")
    return at.run("recalibrate", str(path), *words)


MEASURES = (crossing, touching, looking, a_board, a_recipe)
ADAPTS = {("shoulder", touching), ("shoulder", a_recipe), ("elbow under a ceiling", a_recipe)}
"""With vertical moves and other tilts the arm can measure there."""

TURNS_TOO_FAR = {("elbow", crossing), ("elbow under a ceiling", crossing)}
"""The arm can measure there, and cannot turn the tool as far as the test of the new tip asks."""

QUICK = {("wrist", looking), ("elbow", touching), ("shoulder", crossing), ("wrist", a_recipe)}


def cases():
    """Return each measurement at each place; all but a few only in the long tests."""
    return [
        pytest.param(
            robot,
            measure,
            joints,
            why,
            id=f"{place}-{measure.__name__}",
            marks=() if (place, measure) in QUICK else pytest.mark.soak,
        )
        for place, (robot, joints, why) in PLACES.items()
        for measure in MEASURES
        if (place, measure) not in ADAPTS | TURNS_TOO_FAR
    ]


@pytest.mark.parametrize(("at", "measure", "joints", "why"), cases(), indirect=["at"])
def test_a_station_near_a_singular_place_is_refused_before_anything_moves(at, measure, joints, why):
    stand(at, joints)
    assert re.search(why, refused(at, measure(at)))


@pytest.mark.soak
@pytest.mark.parametrize(
    ("at", "joints"),
    [PLACES[place][:2] for place, _ in sorted(TURNS_TOO_FAR, key=str)],
    indirect=["at"],
)
def test_where_the_turn_test_is_out_of_reach_the_old_value_comes_back(at, joints):
    stand(at, joints)
    before = at.cell.simulator.machine.tools.get(1)
    done = crossing(at)
    assert done.code == 2, done.out + done.err
    error = json.loads(done.out)["error"]
    assert "cannot reach" in error["what"]
    assert "The old value of tool 1 is back." in error["what"]
    assert error["stands"]["settled"]
    assert at.cell.simulator.machine.tools.get(1) == before


FAR_OUT = (0.0, -68.483, 43.963, 0.0, -65.48, 0.0)
"""Tool down, 52 mm from the limit of reach: with a tip 30 mm beyond the flange, three eighths of a
turn about it are within reach, half a turn is not.
"""


@pytest.mark.parametrize("at", [TABLE], indirect=True)
def test_two_touches_half_a_turn_apart_are_refused_before_the_tool_turns(at):
    stand(at, FAR_OUT, LEANING)
    done = at.calibrate("two-pose", "--station", "PIN-07")
    assert done.code == 2
    assert "Turning in the air. The robot cannot reach" in json.loads(done.out)["error"]["what"]
    assert "Turning in the air." not in done.err


@pytest.mark.parametrize("at", [TABLE], indirect=True)
def test_touches_at_angles_turn_half_as_far_where_the_arm_ends(at):
    stand(at, FAR_OUT, LEANING)
    done = at.calibrate("n-angle", "--station", "PIN-07", "--count", "4")
    assert done.code == 0, done.err[-900:]
    assert "The robot takes a different path" in done.err
    for axis in ("x", "y"):
        wrong = done.document["proposed"][f"{axis}_mm"] - getattr(at.truth, f"{axis}_mm")
        assert abs(wrong) <= interval_mm(done.document["fit"], axis)
