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
from tests.certificate.live import BEAM_NOISE, slips, wrong_by
from tests.contract._method_cell import method_cell
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


@pytest.mark.parametrize("kind", [pytest.param("epson", marks=pytest.mark.soak), "plc"])
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
        pytest.param(
            slips(0.04, -0.03), "proof_contradicts_repeatability", marks=pytest.mark.soak
        ),
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
