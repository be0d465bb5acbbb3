"""``recalibrate`` with a camera, on both kinds of controllers, and on a gantry with a probe."""

import json
import math
import sys
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.cell.tip_switches import TouchPlate
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.hosting.in_process import softmotion as plc_in_process

from robolink.journal import open_journal
from robolink.model import EntryKind
from robolink.recipe import load_recipe
from tests.contract._camera_cell import recipe_here
from tests.contract._sensor_cell import SensorCell
from tests.faults._nozzle_cell import OLD_TIP, served_cell

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

EXAMPLES = Path(__file__).parents[2] / "examples" / "recipes"
CAMERA = str(EXAMPLES / "pick-nozzle-camera.toml")
GANTRY = str(EXAMPLES / "gantry-touch-probe.toml")


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run a command in this process; return its exit code, document and messages."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))

    def run(*arguments):
        code = main.run(list(arguments))
        shown = capsys.readouterr()
        document = json.loads(shown.out) if "--json" in arguments and shown.out else None
        return code, document, shown.err

    return run


@pytest.fixture
def epson():
    """The cell for which the example was written, in virtual time."""
    url = "epson+sim://camera-recipe"
    yield url
    in_process.unregister("camera-recipe")


@pytest.fixture
def plc(run):
    """Return a simulated PLC by the name of its kinematics, in virtual time."""
    names = []

    def open_plc(kinematics):
        name = f"recipe-{kinematics.lower().replace('_', '-')}"
        names.append(name)
        url = f"softmotion+sim://{name}"
        assert run("-c", f"{url}?kinematics={kinematics}&seed=1", "status")[0] == 0
        return url, plc_in_process.simulator_named(name), plc_in_process.clock_of(name)

    yield open_plc
    for name in names:
        plc_in_process.unregister(name)


def told(capsys, what, seconds):
    with capsys.disabled():
        sys.stdout.write(f"\n{what}: {seconds:.1f} s of robot time\n")


def test_the_example_measures_writes_and_proves_a_nozzle(run, epson, capsys):
    url = f"{epson}?seed=1"
    code, document, messages = run(
        "-c", url, "recalibrate", CAMERA, "--sensor", epson, "--yes", "--json"
    )
    assert code == 0, messages
    simulator = in_process.simulator_named("camera-recipe")
    seconds = in_process.clock_of("camera-recipe").now_ns() / 1e9
    told(capsys, "pick nozzle, camera recipe", seconds)
    assert seconds < 8.0  # by the simulated clock: 7.90 s, the same in each run
    safe, stands = load_recipe(Path(CAMERA)).recipe.poses.safe, simulator.world.robot.flange()
    assert safe is not None
    assert stands.coordinates()[:3] == pytest.approx(safe.pose.coordinates()[:3], abs=0.01)
    assert stands.u_deg == pytest.approx(safe.u_deg + 90.0, abs=0.01)
    found, true = simulator.machine.tools.get(1), simulator.world.tips[1]
    assert found is not None
    (tool,) = document["tools"]
    assert tool["verification"]["passed"]
    for name in ("x_mm", "y_mm"):
        half_mm = tool["fit"]["half_width95"][name]
        assert abs(getattr(found, name) - getattr(true, name)) <= half_mm + 0.0005
        assert half_mm < 0.02
    assert math.hypot(found.x_mm - true.x_mm, found.y_mm - true.y_mm) < 0.005
    assert found.z_mm == OLD_TIP.z_mm


def test_a_served_cell_lends_its_camera_through_the_assist_port(tmp_path, monkeypatch):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        cell.simulator.machine.motors_on = True
        done = cell.run("recalibrate", CAMERA, "--sensor", cell.assist_url, "--yes")
        assert done.code == 0, done.err
        true = cell.simulator.world.tips[1]
        found = cell.tool_1
        assert found is not None
        assert math.hypot(found.x_mm - true.x_mm, found.y_mm - true.y_mm) < 0.01
        cell.check_settings_are_those_of_before()
        (measured,) = open_journal().log(cell.url).recorded(kinds=[EntryKind.CALIBRATION])
        token, _, place = cell.assist_url.removeprefix("assist+tcp://").partition("@")
        assert f"assist+tcp://{place}" in str(measured.details["source"])
        # Only the simulator needs to know how the camera was added.
        assert token not in json.dumps(measured.details)
        assert token not in done.out + done.err
        assert measured.details["method"] == "camera"
        spots = measured.details["spots"]
        assert isinstance(spots, list)
        assert [len(spot) for spot in spots] == [2, 2, 2, 2]
        assert measured.details["spots_in"] == "px"
        page = tmp_path / "change.html"
        shown = cell.run("report", measured.change, str(page))
        assert shown.code == 0, shown.err
        assert "camera" in page.read_text()


@pytest.mark.soak
def test_the_same_recipe_serves_a_plc(run, plc, tmp_path, capsys):
    url, simulator, clock = plc("Kin_Scara3_Z")
    recipe = recipe_here(SensorCell(simulator, url, clock), Path(CAMERA), tmp_path)
    began_ns = clock.now_ns()
    code, document, messages = run(
        "-c", url, "recalibrate", str(recipe), "--sensor", url, "--yes", "--json"
    )
    assert code == 0, messages
    told(capsys, "pick nozzle on a PLC, camera recipe", (clock.now_ns() - began_ns) / 1e9)
    (tool,) = document["tools"]
    stored, true = simulator.plc.memory.defined()[1].tool, simulator.world.tips[1]
    for found_mm, true_mm, half_mm in zip(
        stored, (true.x_mm, true.y_mm), tool["fit"]["half_width95"].values(), strict=False
    ):
        assert abs(found_mm - true_mm) <= half_mm < 0.02
    assert tool["verification"]["passed"]


def test_the_next_nozzle_is_a_difference_that_a_moved_camera_does_not_shift(run, epson, tmp_path):
    text = Path(CAMERA).read_text().replace('basis = "absolute"', 'basis = "difference"')
    recipe = tmp_path / "difference.toml"
    # Seen from one angle, so that the camera's error stays in both.
    recipe.write_text(
        text.replace("[157.63,", "[157.93,")
        .replace("[0, 60, 120, 180]", "[0]")
        .replace("rms_mm = 0.02\ninterval_mm = 0.02\n", "")
        .replace("drift_mm = 0.05", "drift_mm = 1.0")
    )
    call = ("recalibrate", str(recipe), "--sensor", epson, "--yes")
    code, _, messages = run("-c", f"{epson}?seed=1", *call, "--reference")
    assert code == 0, messages
    simulator = in_process.simulator_named("camera-recipe")
    before, after = simulator.world.tips[1], simulator.world.change_nozzle()
    code, _, messages = run("-c", epson, *call)
    assert code == 0, messages
    now = simulator.machine.tools.get(1)
    assert now is not None
    assert now.x_mm - OLD_TIP.x_mm == pytest.approx(after.x_mm - before.x_mm, abs=0.01)
    assert now.y_mm - OLD_TIP.y_mm == pytest.approx(after.y_mm - before.y_mm, abs=0.01)


def test_the_gantry_measures_writes_and_proves_a_length(run, plc, capsys):
    url, simulator, clock = plc("Kin_Gantry3")
    simulator.world.connect(5, TouchPlate(33.0), noise_mm=0.002)
    began_ns = clock.now_ns()
    code, document, messages = run("-c", url, "recalibrate", GANTRY, "--yes", "--json")
    assert code == 0, messages
    seconds = (clock.now_ns() - began_ns) / 1e9
    told(capsys, "gantry, touch probe", seconds)
    assert seconds < 9.0  # by the simulated clock: 8.86 s, the same in each run
    (tool,) = document["tools"]
    stored = simulator.plc.memory.defined()[1].tool
    assert (
        abs(stored[2] - simulator.world.tips[1].z_mm) <= tool["fit"]["half_width95"]["z_mm"] < 0.04
    )
    assert stored[:2] == (12.0, -3.5)
    assert tool["verification"]["passed"]


@pytest.mark.parametrize(
    ("arguments", "code", "name"),
    [
        ((), 2, None),
        (("--sensor", "basler"), 7, "sensor_not_found"),
        (("--sensor", "epson+sim://nobody"), 2, None),
        (("--sensor", "assist+tcp://127.0.0.1:1"), 3, None),
    ],
)
def test_a_camera_that_cannot_be_used_is_told_before_anything_moves(
    run, epson, arguments, code, name
):
    ended, _, messages = run("-c", epson, "recalibrate", CAMERA, *arguments, "--yes")
    assert ended == code
    assert name is None or "No sensor is called" in messages
    assert in_process.simulator_named("camera-recipe").machine.arm.moves_started == 0


def test_a_nozzle_that_is_not_seen_ends_the_recipe_with_its_code(run, epson):
    url = f"{epson}?world.camera_miss_share=1.0"
    code, _, messages = run("-c", url, "recalibrate", CAMERA, "--sensor", epson, "--yes")
    assert code == 7
    assert "does not see the tip" in messages
    assert in_process.simulator_named("camera-recipe").machine.tools.get(1) == OLD_TIP
    assert messages.count("does not see the tip") == 2
