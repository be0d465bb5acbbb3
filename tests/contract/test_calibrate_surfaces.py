"""``plane-touch`` and ``sphere-touch`` live, on a PLC whose flange tilts."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.calibration_run import Limits
from tests._commands import run_command
from tests.calibration._surface_person import Ball, Plate, touches_of, touches_of_ball

pytestmark = pytest.mark.simulator_only

PLATE = Path(__file__).parents[2] / "examples" / "recipes" / "leaning-plate.toml"
BALL = PLATE.with_name("sphere.toml")
STORED = (12.0, -3.5, -20.0)
LEANING = WorldParameters(person_touches="plane", plane_lean_deg=20.0, plane_lean_toward_deg=30.0)


@pytest.fixture
def plc(serve_simulator, monkeypatch):
    """Opens a simulated five-axis machine in this process; ``url`` is its URL."""
    monkeypatch.setattr("robolink.calibration_run.Limits", partial(Limits, speed_percent=100))

    def open_machine(world=LEANING, kinematics="Kin_5Axes"):
        simulator = SoftMotionSimulator(kinematics, seed=4, world=world)
        serve_simulator(simulator)
        return simulator

    return open_machine


def run(simulator, *words):
    """Run a command; return its exit code, document and messages."""
    ended = run_command("-c", simulator.url, *words, "--json")
    return ended.code, ended.document, ended.err


def calibrate(simulator, method, *more):
    words = ("calibrate", method, "--tool", "1", "--assist", simulator.url, "--yes")
    return run(simulator, *words, "--speed", "100", *more)


def slot(simulator):
    """Return the lengths in the PLC's tool slot."""
    return simulator.plc.memory.slot(1).tool[:3]


def inside(simulator, tool):
    """Return whether each written length is within twice its interval of the truth.

    One in 20 lies outside a 95 % interval; a soak test counts them.
    """
    truth, half = simulator.world.tips[1].components()[:3], tool["fit"]["half_width95"].values()
    found = zip(slot(simulator), truth, half, strict=True)
    return all(abs(value - true) <= 2 * width for value, true, width in found)


def recalibrate(simulator, example, folder):
    """Run an example at full speed, which only shortens the test."""
    path, text = folder / example.name, example.read_text(encoding="utf-8")
    fast = text.replace("percent = 30", "percent = 100").replace("mm_s = 40", "mm_s = 100")
    path.write_text(fast, encoding="utf-8")
    words = ("recalibrate", str(path), "--assist", simulator.url, "--yes", "--nozzle", "N-1")
    return run(simulator, *words)


@pytest.mark.soak
def test_the_example_finds_the_whole_tip_on_a_leaning_plate_and_proves_it(plc, tmp_path):
    simulator = plc()
    code, document, said = recalibrate(simulator, PLATE, tmp_path)
    assert code == 0, said
    (tool,) = document["tools"]
    assert list(tool["fit"]["half_width95"]) == ["x_mm", "y_mm", "z_mm"]
    assert inside(simulator, tool)
    assert tool["verification"]["passed"]
    assert simulator.plc.group.values[4] == pytest.approx(0.0, abs=1e-6), "upright as before"


def test_the_example_finds_the_whole_tip_on_a_ball_and_proves_it(plc, tmp_path):
    simulator = plc(WorldParameters(person_touches="sphere"))
    code, document, said = recalibrate(simulator, BALL, tmp_path)
    assert code == 0, said
    (tool,) = document["tools"]
    assert inside(simulator, tool)
    assert tool["verification"]["passed"]


def test_who_begins_beside_the_top_of_a_ball_is_told_so(plc):
    simulator = plc(WorldParameters(person_touches="sphere"))
    code, document, _ = calibrate(simulator, "sphere-touch")
    assert (code, document["error"]["code"]) == (7, "off_top")
    assert slot(simulator) == STORED


def test_a_person_who_only_presses_enter_is_refused_and_nothing_is_proposed(plc):
    simulator = plc(replace(LEANING, person_stays_share=1.0, person_stays_from_touch=2))
    code, document, said = calibrate(simulator, "plane-touch")
    assert (code, document["error"]["code"]) == (7, "not_touched")
    assert "mm from the surface. Jog onto it" in said
    assert slot(simulator) == STORED


def test_five_axes_are_told_that_a_level_plane_shows_one_direction_less(plc):
    simulator = plc(WorldParameters(person_touches="plane"))
    code, document, _ = calibrate(simulator, "plane-touch")
    assert (code, document["error"]["code"]) == (7, "insufficient_rotation")
    assert "along Y of the flange" in document["error"]["what"]
    assert "Tilt the plane 15 to 30 degrees" in document["error"]["remedy"]
    assert simulator.world.operator.touches == 3
    assert slot(simulator) == STORED


def test_four_axes_are_refused_before_anything_moves(plc):
    simulator = plc(kinematics="Kin_Scara3_Z")
    code, document, _ = calibrate(simulator, "plane-touch")
    assert (code, document["error"]["code"]) == (7, "rank_deficient")
    assert simulator.plc.group.movements_started == 0


def test_a_look_before_shows_each_touch_and_moves_nothing(plc):
    simulator = plc()
    words = ("calibrate", "plane-touch", "--tool", "1", "--dry-run", "--tilt", "25")
    code, document, said = run(simulator, *words)
    assert code == 0, said
    steps = document["steps"]
    assert sum("onto the surface" in step["text"] for step in steps) == 10
    leaning = {round(step["target"]["v_deg"], 3) for step in steps if step["target"]}
    assert {-25.0, 0.0, 25.0} <= leaning
    assert not any(step["refusal"] for step in steps)
    assert simulator.plc.group.movements_started == 0


@pytest.mark.parametrize("method", ["plane-touch", "sphere-touch"])
def test_poses_of_a_file_give_the_tip_of_a_flange_that_points_down_and_leans(plc, tmp_path, method):
    simulator, path = plc(), tmp_path / "touches.csv"
    tip = simulator.world.tips[1]
    poses = touches_of(Plate(10.0, 40.0), tip, down=True)
    if method == "sphere-touch":
        poses = touches_of_ball(Ball(8.0), tip, down=True)
    rows = [",".join(f"{value:.4f}" for value in pose.coordinates()) for pose in poses]
    path.write_text("x_mm,y_mm,z_mm,u_deg,v_deg,w_deg\n" + "\n".join(rows) + "\n")
    words = ("calibrate", method, "--tool", "1", "--poses", str(path), "--dry-run")
    code, document, said = run(simulator, *words)
    assert code == 0, said
    found = [document["proposed"][name] for name in ("x_mm", "y_mm", "z_mm")]
    assert found == pytest.approx(tip.components()[:3], abs=0.005)


@pytest.mark.soak
def test_six_axes_find_the_tip_on_a_level_plane_by_its_contact(serve_simulator):
    world = WorldParameters(person_touches="plane", contact_input=7)
    simulator = EpsonSimulator("C8-C901S", seed=4, world=world)
    simulator.machine.motors_on = True
    serve_simulator(simulator)
    words = ("--contact-input", "7", "--count", "9", "--no-verify")
    code, document, said = calibrate(simulator, "plane-touch", *words)
    assert code == 0, said
    truth, half = simulator.world.tips[1].components()[:3], document["fit"]["half_width95"]
    held = simulator.machine.tools.get(1)
    assert held is not None
    for value, true, width in zip(held.components()[:3], truth, half.values(), strict=True):
        assert abs(value - true) <= width
