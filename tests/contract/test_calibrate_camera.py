"""``calibrate camera|camera-affine|board`` as typed commands, on both kinds of controllers."""

import json
import math
from functools import partial
from itertools import count

import pytest
from robolink_cli import main
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.hosting.in_process import softmotion as plc_in_process

from robolink.journal import memory_journal, open_journal
from robolink.model import EntryKind
from tests.contract._camera_cell import camera_model, camera_station, furnish
from tests.contract._sensor_cell import SensorCell
from tests.faults._nozzle_cell import OLD_TIP, served_cell

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

SIM = "SIM"
"""Placeholder for a cell's URL in the arguments below."""

_names = count()


HOSTING = {"epson": in_process, "softmotion": plc_in_process}


class Desk:
    """A simulated cell and the commands typed for it.

    Attributes:
        cell: The cell.
        at: The place of its camera, as an option gives it.
    """

    def __init__(self, kind, options, capsys):
        self._capsys = capsys
        name = f"calibrate-camera-{next(_names)}"
        self.url, hosting = f"{kind}+sim://{name}", HOSTING[kind]
        assert main.run(["-c", f"{self.url}{options}", "status"]) == 0
        simulator = hosting.simulator_named(name)
        self.forget = partial(hosting.unregister, name)
        self.cell = SensorCell(simulator, self.url, hosting.clock_of(name))
        station = camera_station(self.cell)
        self.at = f"{station.x_mm},{station.y_mm},{station.z_mm}"

    def run(self, *arguments):
        """Run a command in this process; return its exit code, document and messages."""
        self._capsys.readouterr()
        code = main.run(["-c", self.url, *(self.url if a == SIM else a for a in arguments)])
        shown = self._capsys.readouterr()
        document = json.loads(shown.out) if "--json" in arguments and shown.out else None
        return code, document, shown.err


@pytest.fixture
def desk(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    desks = []

    def opened(kind="epson", options="?seed=1"):
        desks.append(Desk(kind, options, capsys))
        return desks[-1]

    yield opened
    for one in desks:
        one.forget()


def miss_mm(document, true):
    proposed = document["proposed"]
    return math.hypot(proposed["x_mm"] - true.x_mm, proposed["y_mm"] - true.y_mm)


@pytest.mark.parametrize("kind", [pytest.param("epson", marks=pytest.mark.soak), "softmotion"])
def test_a_camera_is_found_and_then_sees_the_next_nozzle(desk, kind):
    opened = desk(kind)
    cell = opened.cell
    usual = ("--tool", "1", "--station", "CAM", "--sensor", SIM, "--yes", "--json")
    code, found, messages = opened.run("calibrate", "camera-affine", "--at", opened.at, *usual)
    assert code == 0, messages
    assert miss_mm(found, cell.truth) < 0.008
    assert found["verification"]["passed"]
    true = camera_model(cell)
    assert found["camera"]["mirrored"] is true.mirrored
    assert found["camera"]["turn_deg"] == pytest.approx(true.turn_deg, abs=0.3)
    assert found["camera"]["rms_px"] < 0.5
    assert "micrometres per pixel" in messages
    if kind == "epson":
        cell.simulator.world.change_nozzle()
        code, seen, messages = opened.run("calibrate", "camera", *usual)
        assert code == 0, messages
        assert miss_mm(seen, cell.truth) < 0.008
        assert seen["method"] == "camera"
        assert max(map(abs, seen["camera_error_mm"])) < 0.02
        assert len(seen["fit"]["residuals_mm"]) == 4


def test_a_spot_that_stands_still_and_a_camera_that_changed_are_refused(desk):
    opened = desk()
    usual = ("--tool", "1", "--station", "CAM", "--sensor", SIM, "--yes", "--json")
    assert opened.run("calibrate", "camera-affine", "--at", opened.at, *usual)[0] == 0
    stored = opened.cell.stored
    opened.cell.simulator.world.change_nozzle()
    # Five places with four pictures each make the measurement.
    for from_picture, exit_code in ((1, 7), (21, 8)):
        furnish(opened.cell, camera_still_share=1.0, camera_still_from_picture=from_picture)
        code, document, messages = opened.run("calibrate", "camera", *usual)
        assert code == exit_code, messages
        assert document["error"]["code"] == "tip_did_not_move"
        assert "Clean window and tip" in document["error"]["remedy"]
        assert opened.cell.stored.rounded(3) == stored.rounded(3)
    changed = {"camera_um_per_px_x": 21.0, "camera_um_per_px_y": 21.0}
    furnish(opened.cell, camera_still_share=0.0, **changed)
    affine = ("calibrate", "camera-affine", "--at", opened.at)
    code, document, _ = opened.run(*affine, *usual)
    assert code == 7
    assert "The scale of the image changed by" in document["error"]["what"]
    assert opened.cell.stored.rounded(3) == stored.rounded(3)
    assert opened.run(*affine, "--new-camera", *usual)[0] == 0


def test_a_table_of_runout_is_shown_and_given_as_json(desk):
    opened = desk()
    usual = ("--tool", "1", "--station", "CAM", "--sensor", SIM, "--yes", "--json")
    assert opened.run("calibrate", "camera-affine", "--at", opened.at, *usual)[0] == 0
    furnish(opened.cell, wobble_mm=0.06)
    code, found, messages = opened.run("calibrate", "runout-table", *usual)
    assert code == 0, messages
    assert found["method"] == "runout-table"
    rows = found["runout_table"]
    assert len(rows) == 12
    assert max(math.hypot(row["dx_mm"], row["dy_mm"]) for row in rows) == pytest.approx(
        0.06, abs=0.012
    )
    assert found["verification"]["passed"]
    assert "the tip wobbles: it is at most 0.0" in messages


def test_a_board_is_measured_by_its_fiducials(desk):
    opened = desk(options="?world.board_held=true")
    cell = opened.cell
    affine = ("--tool", "1", "--station", "CAM", "--at", opened.at, "--sensor", SIM, "--yes")
    world = cell.simulator.world
    held, world.board = world.board, None
    assert opened.run("calibrate", "camera-affine", *affine)[0] == 0
    world.board = held
    fiducials = [f"--fiducial={x},{y}" for x, y in held.drawing_mm]
    code, document, messages = opened.run(
        "calibrate", "board", *fiducials, "--tool", "1", "--station", "CAM",
        "--sensor", SIM, "--yes", "--json",
    )  # fmt: skip
    assert code == 0, messages
    truth = held.frame(cell.truth)
    assert miss_mm(document, truth) < 0.01
    assert document["proposed"]["u_deg"] == pytest.approx(truth.u_deg, abs=0.02)
    assert document["verification"]["passed"]
    assert "Looking at fiducial 4." in messages
    # The consequences are printed, in the document, and recorded with the value.
    steps = document["next_steps"]
    assert [one["step"] for one in steps] == ["select", "jog", "teach"]
    commands = [one["command"] for one in steps]
    assert commands == ["robolink tool select 1", "robolink robot jog", "robolink robot where"]
    places = [messages.index(command) for command in ("Next:", *commands)]
    assert places == sorted(places)
    kept = memory_journal(opened.url).entries(kinds=(EntryKind.DONE,))
    assert next(iter(kept)).details["next_steps"] == steps
    # Each of them is a command that works as printed.
    assert opened.run("tool", "select", "1", "--yes")[0] == 0
    assert opened.run("robot", "jog", "x+1", "--yes")[0] == 0
    assert opened.run("robot", "where")[0] == 0


RECIPE = """
schema = "robolink/recipe/1"
name = "All else is on record"
basis = "absolute"
z = "kept"
[source]
kind = "camera"
[station]
id = "CAM"
[[tools]]
number = 1
"""


def test_a_served_cell_keeps_its_camera_on_record_under_the_name_in_the_cell_file(
    tmp_path, monkeypatch
):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        monkeypatch.chdir(tmp_path)
        cell.simulator.machine.motors_on = True
        x_mm, y_mm, z_mm = cell.simulator.world.camera.middle_mm
        (tmp_path / "robolink.toml").write_text(f'''
[cells.line3]
url = "{cell.url}"
remote_timeout_s = 60.0
remote_timeout_confirmed_by = "test"
[cells.line3.stations.CAM]
kind = "camera"
x_mm = {x_mm}
y_mm = {y_mm}
z_mm = {z_mm}
sensor = "{cell.assist_url}"
''')
        usual = ("--tool", "1", "--station", "CAM", "--yes")
        early = cell.run("-c", "line3", "calibrate", "camera", *usual)
        assert early.code == 7
        assert "camera-affine" in early.err
        done = cell.run("-c", "line3", "calibrate", "camera-affine", *usual)
        assert done.code == 0, done.err
        (kept,) = open_journal().log(cell.url).recorded(kinds=[EntryKind.STATION])
        assert kept.details["kind"] == "camera"
        shown = cell.run("-c", "line3", "station", "show", "CAM")
        assert "  mm_per_px = [[" in shown.out
        world = cell.run("sim", "assist", cell.assist_url, "set_world", "lean_deg=0")
        assert "board_held false" in world.out
        assert "contact_input none" in world.out
        cell.simulator.world.change_nozzle()
        (tmp_path / "nozzle.toml").write_text(RECIPE)
        done = cell.run("-c", "line3", "recalibrate", "nozzle.toml", "--yes")
        assert done.code == 0, done.err
        true = cell.simulator.world.tips[1]
        found = cell.tool_1
        assert found is not None
        assert math.hypot(found.x_mm - true.x_mm, found.y_mm - true.y_mm) < 0.015
        cell.check_settings_are_those_of_before()


AFFINE = ("calibrate", "camera-affine")
BOARD = ("calibrate", "board")


@pytest.mark.parametrize(
    ("options", "command", "code", "said"),
    [
        ("", (*AFFINE, "--sensor", "basler"), 7, "No sensor is called"),
        ("", (*AFFINE, "--sensor", SIM, "--span", "0"), 2, "must be at least 0.2"),
        ("", (*AFFINE, "--sensor", SIM, "--angles", "0,20"), 2, "spread over at least 30"),
        ("", (*AFFINE, "--sensor", SIM, "--angles", "0,361"), 2, "must be at most 360"),
        ("", AFFINE, 2, "which camera looks at"),
        ("?world.camera_miss_share=1", (*AFFINE, "--sensor", SIM), 7, "does not see the tip"),
        ("", ("calibrate", "camera", "--sensor", SIM), 7, "nothing says what they mean"),
        ("", (*BOARD, "--sensor", SIM, "--spacing", "3"), 2, "must be at least 5"),
        ("", (*BOARD, "--sensor", SIM), 2, "--fiducial: is missing: say where"),
        ("", (*BOARD, "--sensor", SIM, "--fiducial", "1"), 2, "must hold 2 numbers"),
    ],
)
def test_what_cannot_be_is_refused_with_its_code_and_nothing_is_written(
    desk, options, command, code, said
):
    opened = desk(options=options)
    cell = opened.cell
    usual = ("--tool", "1", "--station", "CAM", "--at", opened.at, "--yes")
    ended, _, messages = opened.run(*command, *usual)
    assert ended == code, messages
    assert said in messages
    assert cell.stored == OLD_TIP
    assert cell.simulator.machine.tools.selected == 1


def test_a_look_before_shows_every_step_and_moves_nothing(desk):
    opened = desk()
    code, document, _ = opened.run(
        *AFFINE, "--tool", "1", "--station", "CAM", "--at", opened.at, "--sensor", SIM,
        "--dry-run", "--json",
    )  # fmt: skip
    assert code == 0
    assert [step["text"] for step in document["steps"]].count("Looking at the tip.") == 8
    assert opened.cell.simulator.machine.arm.moves_started == 0
