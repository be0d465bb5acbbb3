"""The same cells by command, by recipe and after a break: exit codes, and what is stored after."""

import contextlib
import io
import json
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.cell.tip_switches import LightBeam

from robolink.errors import VerifyError
from robolink.methods import BeamsSource
from robolink.model import ToolOffset, rotate_xy
from tests.certificate.live import BEAM_NOISE, slips, wrong_by
from tests.contract._method_cell import KINDS, method_cell
from tests.contract._sensor_cell import TOOL, miss_mm, sensor_cell
from tests.contract.test_proof_after_a_break import Later

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

NEEDLE = Path(__file__).parents[2] / "examples" / "recipes" / "needle-beams.toml"
CROSSING_MM = (175.0, 488.0, -106.0)
MOVED = wrong_by({"place_mm": (0.03, 0.04)})


def run(url, *words):
    """Run a command; return its exit code and its document."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        code = main.run(["-c", url, *words, "--yes", "--json"])
    return code, json.loads(out.getvalue())


@pytest.fixture
def needle(tmp_path, monkeypatch):
    """The cell of the shipped recipe."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with sensor_cell(3) as cell:
        cell.simulator.machine.motors_on = True
        for number, heading_deg in ((3, 2.0), (4, 91.0)):
            beam = LightBeam(CROSSING_MM, heading_deg)
            cell.simulator.world.connect(number, beam, latency_s=0.002, **BEAM_NOISE)
        yield cell


@pytest.mark.parametrize(
    "moved_mm",
    [(0.024, 0.018), pytest.param((-0.04, 0.0), marks=pytest.mark.soak)],
    ids=["by 0.03", "by 0.04"],
)
def test_the_needle_recipe_with_beams_that_were_moved_ends_with_8(needle, moved_mm):
    before = needle.stored
    wrong_by({"place_mm": moved_mm})(needle)
    code, document = run(needle.url, "recalibrate", str(NEEDLE))
    assert code == 8, document
    assert document["error"]["code"] == "proof_contradicts_repeatability"
    assert needle.stored == before


@pytest.mark.soak
def test_the_needle_recipe_with_beams_where_they_were_is_certified(needle):
    code, document = run(needle.url, "recalibrate", str(NEEDLE))
    assert code == 0, document
    (tool,) = document["tools"]
    assert tool["verification"]["passed"]
    assert not tool["verification"].get("judgement", {}).get("code")
    assert miss_mm(needle.stored, needle.truth) < 0.02


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
def test_a_command_with_beams_that_were_moved_ends_with_8(kind, tmp_path, monkeypatch):
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        cell.mount()
        before = cell.stored
        wrong_by({"place_mm": (0.05, 0.04)})(cell.cell)
        done = cell.calibrate("beams", "--station", "BEAMS-02")
        assert done.code == 8, done.err
        assert done.document["error"]["code"] == "proof_contradicts_accuracy"
        assert cell.stored == before


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        (wrong_by({"place_mm": (0.03, 0.04)}), "proof_contradicts_accuracy"),
        pytest.param(slips(0.04, -0.03), "proof_contradicts_repeatability", marks=pytest.mark.soak),
    ],
    ids=["moved", "slipped"],
)
def test_what_happened_before_a_turn_test_after_a_break_brings_the_old_value_back(
    wrong, code, tmp_path
):
    with sensor_cell(5) as cell:
        cell.mount_beams(cell.beams(radius_mm=0.1), **BEAM_NOISE)
        later = Later(cell, tmp_path)
        with later.connected() as controller:
            old = controller.tools.read(TOOL)
        wrong_before = code == "proof_contradicts_accuracy"
        if wrong_before:
            wrong(cell)
        later.broken_off(BeamsSource(cell.station))
        if not wrong_before:
            wrong(cell)
        with later.connected() as controller:
            with pytest.raises(VerifyError) as refused:
                later.finished(controller)
            assert refused.value.code == code
            assert controller.tools.same(controller.tools.read(TOOL), old)
            assert controller.outcomes.open_markers() == ()
        assert later.verified() == [False]


ONE_TOUCH = """
schema = "robolink/recipe/1"
name = "one touch"
basis = "difference"
z = "measured"
[source]
kind = "one-touch"
[station]
id = "PIN-07"
[[tools]]
number = 1
[tolerances]
sigma_mm = 0.01
"""


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
def test_one_touch_states_a_change_of_a_z_that_nobody_measured(kind, tmp_path, monkeypatch):
    """The stored Z is some tenths of a millimetre wrong, and so is the new one; nothing is said."""
    path = tmp_path / "one-touch.toml"
    path.write_text(ONE_TOUCH)
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        assert cell.calibrate("n-angle", "--station", "PIN-07", "--count", "4").code == 0
        stored, true = cell.stored, cell.truth
        assert abs(stored.z_mm - true.z_mm) > 0.2
        cell.lengthen(0.35, 0.25, -0.3)
        done = cell.run("recalibrate", str(path), "--assist", cell.cell.url, "--yes", "--json")
        assert done.code == 0, done.err
        (tool,) = done.document["tools"]
        assert set(tool["fit"]["half_width95"]) == {"x_mm", "y_mm"}
        assert abs(tool["change_z_mm"] - (cell.truth.z_mm - true.z_mm)) < (
            1.2 * tool["change_z_half95_mm"]
        )
        assert abs(cell.stored.z_mm - cell.truth.z_mm) > 0.2, "as wrong as it was"
        off_mm = miss_mm(cell.stored, cell.truth)
        assert off_mm < tool["fit"]["accuracy"]["within_mm"]


SMALL = ToolOffset(0.55, -0.7, -20.0)
"""A tool so short that poses of its tip and of the flange fit alike."""


@pytest.mark.parametrize("kind", [pytest.param("plc", marks=pytest.mark.soak), "epson"])
@pytest.mark.parametrize("tool", [None, 1])
def test_poses_of_a_small_tool_are_asked_about(kind, tool, tmp_path, monkeypatch):
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        tip = ToolOffset(0.7, -0.9, -20.0)
        cell.world.tips[1] = tip
        with cell.cell.connected() as controller:
            if hasattr(controller, "take"):
                controller.take()
            controller.tools.write(1, SMALL, expected=controller.tools.read(1))
        path = tmp_path / "poses.csv"
        path.write_text("x_mm,y_mm,z_mm,u_deg\n" + "\n".join(taught(tip)))
        said = () if tool is None else ("--taught-tool", str(tool))
        done = cell.run(
            "calibrate", "two-pose", "--tool", "1", "--poses", str(path), "--yes", "--json", *said
        )
        if tool is None:
            assert done.code == 7, done.err
            assert done.document["error"]["code"] == "taught_tool_unknown"
            assert cell.stored == SMALL
        else:
            assert done.code == 0, done.err
            assert miss_mm(cell.stored, tip) < 0.003


def taught(tip):
    """Yield the poses of two touches as a pendant with that tool selected shows them."""
    for u_deg in (10.0, -170.0):
        x, y = rotate_xy(tip.x_mm - SMALL.x_mm, tip.y_mm - SMALL.y_mm, u_deg)
        yield f"{300 - x:.4f},{100 - y:.4f},-60.0,{u_deg}"
