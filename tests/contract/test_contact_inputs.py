"""A missing contact input is reported before the robot moves or a person is asked."""

import json
import math

import pytest
from robolink_cli import main

import robolink
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.errors import ConfigError
from robolink.methods import TwoPoseSource
from robolink.model import InputEdge
from robolink.procedures import TouchPlan
from tests.contract._method_cell import method_cell, on
from tests.contract.test_third_kind import Fitter, install
from tests.contract.test_touches_not_made import RECIPE
from tests.contract.third_kind import BenchServer

pytestmark = pytest.mark.simulator_only

NOWHERE = "600"


LONG = pytest.mark.soak


@pytest.fixture
def cell(kind, tmp_path, monkeypatch):
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        yield cell


@pytest.fixture
def bench(monkeypatch, tmp_path):
    """A controller of a kind without inputs."""
    install(monkeypatch, ("bench", "bench_package.bench_controller:open_bench"))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with BenchServer() as server:
        server.machine.selected = 1
        server.machine.go(server.machine.tip(server.machine.tool))
        yield server


def learn(cell, *more):
    words = ("--tool", "1", "--assist", cell.cell.url, "--yes", "--json")
    return cell.run("station", "learn", "PIN-07", *words, *more)


def recipe(cell, folder):
    path = folder / "recipe.toml"
    path.write_text(RECIPE.format(kind=f'n-angle"\ncontact_input = {NOWHERE} #'))
    return cell.run("recalibrate", str(path), "--assist", cell.cell.url, "--yes", "--json")


@pytest.mark.parametrize(
    ("kind", "way"),
    [
        ("epson", "command"),
        ("plc", "recipe"),
        ("epson", "learn"),
        pytest.param("plc", "command", marks=LONG),
        pytest.param("epson", "recipe", marks=LONG),
        pytest.param("plc", "learn", marks=LONG),
    ],
)
def test_an_input_that_is_not_there_ends_it_with_the_robot_where_it_was(cell, tmp_path, way):
    asked = cell.world.operator.touches
    here = cell.world.robot.placement()
    if way == "command":
        done = cell.calibrate("two-pose", "--contact-input", NOWHERE)
    else:
        done = (
            recipe(cell, tmp_path) if way == "recipe" else learn(cell, "--contact-input", NOWHERE)
        )
    assert (done.code, done.document["error"]["kind"]) == (2, "ConfigError"), done.err
    assert f"input {NOWHERE}" in done.document["error"]["what"]
    assert cell.world.robot.placement() == here
    assert cell.world.operator.touches == asked
    assert "Jog the tip" not in done.err


@pytest.mark.parametrize(
    ("method", "more"),
    [
        ("two-pose", "--dry-run"),
        ("n-angle", "--yes"),
        pytest.param("two-pose", "--yes", marks=LONG),
        pytest.param("n-angle", "--dry-run", marks=LONG),
    ],
)
def test_a_controller_without_inputs_is_refused_with_the_plan(bench, capsys, method, more):
    here = bench.machine.tip(robolink.ToolOffset())
    words = ["-c", bench.url, "calibrate", method, "--tool", "1", "--contact-input", "3", "--json"]
    assert main.run([*words, more]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert (error["kind"], "no inputs" in error["what"]) == ("ConfigError", True)
    assert bench.machine.tip(robolink.ToolOffset()) == here
    # Without the input the same plan is valid.
    assert (
        main.run([*(word for word in words if word not in ("--contact-input", "3")), "--dry-run"])
        == 0
    )


def test_a_script_is_refused_in_the_same_words(bench):
    with robolink.connect(bench.url) as controller:
        source = TwoPoseSource(TouchPlan(contact=InputEdge(3)))
        person = Fitter(bench.machine, controller.clock)
        with pytest.raises(ConfigError, match="no inputs"):
            NozzleChange(controller, ChangePlan((ToolPlan(1, source),)), operator=person).run()
    assert not person.reads


@pytest.mark.parametrize("kind", on("epson"))
def test_the_document_says_how_each_touch_was_made_as_the_journal_does(cell):
    done = cell.calibrate("two-pose")
    assert done.code == 0, done.err
    measured, proved = done.document, done.document["verification"]
    (entry,) = cell.recorded(robolink.model.EntryKind.CALIBRATION)
    assert measured["touches"] == json.loads(json.dumps(entry.details["touches"]))
    assert measured["standoff_seed"] == entry.details["standoff_seed"]
    first, second = measured["touches"]
    assert (first["arrival"], first["jog_mm"]) == (None, None)
    assert second["arrival"]["u_deg"] == pytest.approx(measured["poses"][1]["u_deg"])
    assert second["jog_mm"] == pytest.approx(math.hypot(*second["standoff_mm"]), abs=0.8)
    assert second["answered_s"] > 0.3
    (entry,) = cell.recorded(robolink.model.EntryKind.VERIFY)
    assert proved["touches"] == json.loads(json.dumps(entry.details["touches"]))
    assert len(proved["touches"]) == len(proved["drifts"])
