"""The camera ``vision-guide``: the driver starts the companion program and reads its look."""

from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.epson.camera_calibrations import VisionCalibration
from robolink_simulators.epson.vision_project import VisionObject, VisionProject, VisionSequence
from robolink_simulators.epson.vision_system import VisionSystem

from robolink.errors import CalibrationError, ConfigError, OutcomeUnknownError, StoppedError
from robolink.methods import CameraSource
from robolink.model import TIP, ControllerSensor, LookingController
from robolink.sensing import VisionGuideCamera, open_sensor, seen_once
from tests.contract._camera_cell import camera_station, furnish, recipe_here, stored_in
from tests.contract._sensor_cell import SensorCell, miss_mm, plc_sensor_cell, sensor_cell

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(60)]

PROGRAM = Path(__file__).parents[2] / "companions" / "epson" / "robolink_vision.prg"
FIND_ALL = {"NumberToFind": 0}


def install(cell: SensorCell, program: Path = PROGRAM) -> VisionSystem:
    """Put the companion program and a vision project into the simulated controller."""
    simulator = cell.simulator
    marked = {"Calibration": "up"}
    sequences = [
        VisionSequence("findTip", [VisionObject("tip", TIP, FIND_ALL)], marked),
        *(
            VisionSequence(f"SearchFid{n}", [VisionObject("Corr01", n, FIND_ALL)], marked)
            for n in (1, 2)
        ),
    ]
    calibration = VisionCalibration.of_camera(simulator.world.camera)
    project = VisionProject.of(sequences, up=calibration)
    vision = VisionSystem(project, lambda: simulator.world, simulator.options)
    simulator.load([program]).vision = vision
    return vision


@pytest.fixture
def cell(tmp_path, monkeypatch):
    """A cell whose own vision system is the only camera."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    with sensor_cell() as made:
        yield made


def wrong_mm(cell):
    """Return the error of the stored tool."""
    stored = stored_in(cell)
    assert stored is not None
    return miss_mm(stored, cell.truth)


def look_at(cell, controller):
    """Bring the tip to the camera, outside any procedure, and take a look."""
    with open_sensor("vision-guide") as camera:
        assert isinstance(camera, ControllerSensor)
        return seen_once(camera.beside(controller), TIP, pictures=1)


def lead_tip_to_camera(cell):
    """Move the arm so that the tip is in front of the lens."""
    world = cell.simulator.world
    tip, there = world.tip_mm(), world.camera.middle_mm
    by_mm = tuple(b - a for a, b in zip(tip, there, strict=True))
    world.robot.carry(cell.truth, by_mm)


CHANGED = {
    "tip_did_not_move": {"camera_still_share": 1.0},
    "camera_changed": {"camera_turn_deg": 13.0},
}


@pytest.mark.parametrize("code", CHANGED)
def test_a_still_spot_or_a_camera_that_was_turned_is_refused_there_too(cell, code):
    install(cell)
    furnish(cell, **CHANGED[code])
    before = stored_in(cell)
    with pytest.raises(CalibrationError) as refusal:
        cell.run(CameraSource("vision-guide", camera_station(cell, known=False)))
    assert refusal.value.code == code
    assert stored_in(cell) == before
    assert cell.simulator.machine.flash_writes == 0


def test_a_nozzle_is_measured_and_proved_through_the_controllers_own_camera(cell):
    vision = install(cell)
    station = camera_station(cell, known=False)
    cell.run(CameraSource("vision-guide", station))
    assert wrong_mm(cell) < 0.01
    assert vision.runs > 6
    assert cell.simulator.machine.tools.selected == 1


def test_the_command_takes_it_by_its_name(cell):
    install(cell)
    x_mm, y_mm, z_mm = cell.simulator.world.camera.middle_mm
    at = f"{x_mm},{y_mm},{z_mm}"
    usual = ("calibrate", "camera", "--tool", "1", "--at", at, "--station", "CAM")
    assert main.run(["-c", cell.url, *usual, "--sensor", "vision-guide?program=7", "--yes"]) == 0
    assert wrong_mm(cell) < 0.01


def test_a_recipe_takes_it_by_its_name(cell, tmp_path):
    vision = install(cell)
    example = Path(__file__).parents[2] / "examples/recipes/pick-nozzle-camera.toml"
    path = recipe_here(cell, example, tmp_path)
    text = path.read_text(encoding="utf-8").replace("[source]", '[source]\nsensor = "vision-guide"')
    assert "vision-guide" in text
    path.write_text(text, encoding="utf-8")
    assert main.run(["-c", cell.url, "recalibrate", str(path), "--yes"]) == 0
    assert wrong_mm(cell) < 0.01
    assert vision.runs > 6


def test_a_stop_holds_looks_back(cell):
    vision = install(cell)
    lead_tip_to_camera(cell)
    with cell.connected() as controller:
        controller.stop()
        with pytest.raises(StoppedError):
            look_at(cell, controller)
        assert vision.runs == 0


def test_each_look_is_a_new_picture_of_the_tip(cell):
    vision = install(cell)
    furnish(cell, camera_noise_px=0.0)
    lead_tip_to_camera(cell)
    x_mm, y_mm, _ = cell.simulator.world.tip_mm()
    with cell.connected() as controller:
        assert isinstance(controller, LookingController)
        for number in (1, 2):
            spot = look_at(cell, controller)
            assert (spot.x, spot.y) == pytest.approx((x_mm, y_mm), abs=1e-6)
            assert vision.runs == number


def test_two_candidates_are_two_and_a_miss_is_none(cell):
    install(cell)
    world = cell.simulator.world
    lead_tip_to_camera(cell)
    with cell.connected() as controller:
        world.tips[2] = replace(cell.truth, x_mm=cell.truth.x_mm + 1.0)
        with pytest.raises(CalibrationError) as several:
            look_at(cell, controller)
        assert several.value.code == "several_tips_seen"
        del world.tips[2]
        furnish(cell, camera_miss_share=1.0)
        with pytest.raises(CalibrationError) as none:
            look_at(cell, controller)
        assert none.value.code == "tip_not_seen"


def test_an_error_of_the_vision_system_is_told_and_blocks_nothing(cell):
    vision = install(cell)
    lead_tip_to_camera(cell)
    with cell.connected() as controller:
        vision.answers = False
        with pytest.raises(CalibrationError, match="7806") as failed:
            look_at(cell, controller)
        assert failed.value.code == "sensor_failed"
        vision.answers = True
        assert look_at(cell, controller)


@pytest.mark.parametrize(
    "body",
    ["  Print 1", "  Do While True\n    Wait 0.5\n  Loop", "  Error 8001"],
    ids=["publishes nothing", "never ends", "ends with an error"],
)
def test_a_program_that_does_not_look_is_no_camera(cell, tmp_path, body):
    text = PROGRAM.read_text(encoding="utf-8").replace("  Call RobolinkLook", body)
    other = tmp_path / "other.prg"
    other.write_text(text, encoding="utf-8")
    install(cell, other)
    with cell.connected() as controller, pytest.raises(OutcomeUnknownError):
        look_at(cell, controller)


def test_without_the_program_nothing_moves(cell):
    flange = cell.simulator.world.robot.flange()
    with pytest.raises(ConfigError, match=r"robolink_vision\.prg"):
        cell.run(CameraSource("vision-guide", camera_station(cell, known=False)))
    assert cell.simulator.world.robot.flange() == flange


def test_a_plc_has_no_such_camera():
    with plc_sensor_cell() as made, made.connected() as controller:
        with pytest.raises(ConfigError, match="no vision system"):
            VisionGuideCamera().beside(controller)


@pytest.mark.parametrize(
    "url", ["vision-guide?program=64", "vision-guide?program=x", "vision-guide?a=1"]
)
def test_a_name_that_makes_no_sense_is_refused(url):
    with pytest.raises(ConfigError), open_sensor(url):
        pass


def test_it_is_asked_through_its_controller_only():
    with open_sensor("vision-guide") as camera, pytest.raises(ConfigError):
        camera.see()
