"""``recalibrate`` at named stations: one touch with Z, a bumped pin, recorded beams, a retake."""

import json
import logging
import re
import sys
from pathlib import Path

import pytest
from robolink_cli.prompts import operator as _operator

from robolink.model import EntryKind, ToolOffset
from robolink.report import reports_of
from robolink.report.sections.evidence import interval_sentences
from robolink.report.sections.offsets import offsets
from tests.contract._method_cell import method_cell, on
from tests.unit.test_logging import listening

pytestmark = pytest.mark.simulator_only

EXAMPLE = Path(__file__).parents[2] / "examples" / "recipes" / "needle-one-touch.toml"

TWO_TOOLS = """
schema = "robolink/recipe/1"
name = "two needles, one touch each"
basis = "difference"
z = "measured"
[source]
kind = "one-touch"
[station]
id = "PIN-07"
[[tools]]
number = 1
[[tools]]
number = 2
[tolerances]
sigma_mm = 0.01
"""

AT_STATION = """
schema = "robolink/recipe/1"
name = "at a station"
basis = "absolute"
z = "{z}"
[source]
{source}
[station]
id = "{station}"
[[tools]]
number = 1
"""


@pytest.fixture(params=on("plc"))
def cell(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch) as cell:
        yield cell


def recalibrate(cell, path, *more):
    assist = ("--assist", cell.cell.url, "--yes", "--json")
    return cell.run("recalibrate", str(path), *assist, *more)


def written(path, text):
    path.write_text(text)
    return path


def example_for(cell, folder):
    """Return the shipped recipe; its safe pose is that of a simulated EPSON cell."""
    if hasattr(cell.cell.simulator, "machine"):
        return EXAMPLE
    lines = EXAMPLE.read_text().splitlines()
    text = "\n".join(line for line in lines if not line.startswith("safe = "))
    return written(folder / "one-touch.toml", text)


def test_the_example_changes_a_needle_with_z_inside_the_stated_interval(cell, tmp_path, capsys):
    path = example_for(cell, tmp_path)
    refused = recalibrate(cell, path, "--nozzle", "N-0")
    assert refused.code == 7
    assert refused.document["error"]["code"] == "no_last_touch"
    full = ("--station", "PIN-07", "--count", "4", "--no-verify")
    assert cell.calibrate("n-angle", *full).code == 0
    value, tip = cell.stored, cell.truth
    cell.lengthen(0.35, 0.25, -0.3)
    began_ns = cell.clock.now_ns()
    done = recalibrate(cell, path, "--nozzle", "N-1")
    took_s = (cell.clock.now_ns() - began_ns) / 1e9
    assert done.code == 0, done.err
    (tool,) = done.document["tools"]
    changed = [b - a for a, b in zip(tip.components(), cell.truth.components(), strict=True)]
    halves = tool["fit"]["half_width95"]
    for axis, change in zip("xyz", changed, strict=False):
        moved_mm = tool["proposed"][f"{axis}_mm"] - getattr(value, f"{axis}_mm")
        half_mm = tool["change_z_half95_mm"] if axis == "z" else halves[f"{axis}_mm"]
        assert abs(moved_mm - change) <= half_mm
    assert tool["verification"]["passed"]
    assert any("never measured" in note for note in tool["notes"])
    ended = cell.recorded(EntryKind.DONE)[0]
    assert ended.signature.nozzle == "N-1"
    assert 0.5 * took_s < float(str(ended.details["took_s"])) <= took_s + 0.1
    with capsys.disabled():
        sys.stdout.write(
            f"\nneedle change by one touch, with proof: {took_s:.1f} s of robot time\n"
        )


def test_a_bumped_pin_shifts_all_tools_and_nothing_is_written(arm, tmp_path):
    with arm.cell.connected() as controller:
        controller.tools.write(2, ToolOffset(12.4, -3.7, -20.0), expected=None)
    arm.world.tips[2] = ToolOffset(12.3, -3.8, -20.2)
    for tool in (1, 2):
        full = ("--station", "PIN-07", "--count", "4", "--no-verify")
        assert arm.calibrate("n-angle", *full, tool=tool).code == 0
    held = [arm.held(tool) for tool in (1, 2)]
    path = written(tmp_path / "two.toml", TWO_TOOLS)
    arm.bump_pin(0.3, -0.2)
    with listening(logging.INFO) as heard:
        refused = recalibrate(arm, path)
    assert refused.code == 7, refused.err
    error = refused.document["error"]
    assert error["code"] == "station_moved"
    logged = "\n".join(record.getMessage() for record in heard)
    assert re.search(r"seems to have moved 0\.3\d\d mm, as tools 1, 2 show\.$", error["what"])
    assert "seems to have moved by X +0." in logged
    assert ": tools 1, 2 shifted alike" in logged
    assert [arm.held(tool) for tool in (1, 2)] == held
    assert {entry.details["code"] for entry in arm.recorded(EntryKind.REFUSED)} == {"station_moved"}
    arm.bump_pin(-0.3, 0.2)
    arm.lengthen(0.05, 0.2, 0.1, tool=1)
    arm.lengthen(-0.05, -0.1, 0.1, tool=2)
    done = recalibrate(arm, path)
    assert done.code == 0, done.err
    assert [tool["warnings"] for tool in done.document["tools"]] == [[], []]


EARLY_BEAMS = 'kind = "beams"\nrepeats = 3\nuntil_mm = 0.05\nretake = true'
EARLY_TOUCH = """kind = "z-touch"
input = 5
speeds_mm_s = [2, 1, 2, 1, 2, 1, 2, 1]
until_mm = 0.1
retake = true"""


def test_a_recipe_names_beams_and_a_surface_by_their_stations_and_may_end_early(arm, tmp_path):
    arm.mount()
    beams = AT_STATION.format(source=EARLY_BEAMS, station="BEAMS-02", z="kept")
    surface = AT_STATION.format(source=EARLY_TOUCH, station="PLATE", z="measured")
    for text, axes in ((beams, "xy"), (surface, "z")):
        done = recalibrate(arm, written(tmp_path / "recipe.toml", text))
        assert done.code == 0, done.err
        (tool,) = done.document["tools"]
        for axis in axes:
            true = getattr(arm.truth, f"{axis}_mm")
            assert tool["proposed"][f"{axis}_mm"] == pytest.approx(true, abs=0.02)
        assert "That is enough" in done.err
    # With --yes nobody is asked about the worst touch, so nobody declined to repeat it.
    said = [entry.details for entry in arm.recorded(EntryKind.DECISION)]
    assert not any("Repeat it" in str(one["question"]) for one in said)
    assert {one["answered_by"] for one in said} == {"--yes"}


@pytest.mark.parametrize(
    ("source", "station", "z", "why"),
    [
        ('kind = "beams"', "BEAMS-99", "kept", "No station of that name is known"),
        ('kind = "beams"', "PLATE", "kept", "of kind touch, not beams"),
        ('kind = "two-pose"', "PIN-07", "measured", "Its place is not known"),
    ],
)
def test_a_station_that_nobody_can_place_stops_the_recipe_first(
    arm, tmp_path, source, station, z, why
):
    text = AT_STATION.format(source=source, station=station, z=z)
    refused = recalibrate(arm, written(tmp_path / "recipe.toml", text))
    assert refused.code == 2
    assert why in refused.document["error"]["what"]
    assert arm.recorded() == []


def test_a_recipe_offers_the_worst_pose_again_and_the_answer_is_on_record(
    arm, tmp_path, monkeypatch
):
    source = 'kind = "n-angle"\ncount = 4\nretake = true\nuntil_mm = 1.0'
    text = AT_STATION.format(source=source, station="PIN-07", z="kept")
    path = written(tmp_path / "recipe.toml", text)
    monkeypatch.setattr("robolink_cli.prompts.questions.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr(
        "robolink_cli.commands.measure.recalibration.agree_to_motion", lambda *_, **__: None
    )
    monkeypatch.setattr("robolink_cli.commands.measure.recalibration.asked", lambda _: True)
    asked = []
    answer = _operator.AssistedOperator.ask

    def ask(operator, question, kind):
        asked.append(question)
        answer(operator, question, kind)

    monkeypatch.setattr(_operator.AssistedOperator, "ask", ask)
    done = arm.run("recalibrate", str(path), "--assist", arm.cell.url, "--jsonl")
    assert done.code == 0, done.err
    events = [json.loads(line) for line in done.out.splitlines()]
    kinds = [event.get("kind") for event in events if event["event"] == "step"]
    assert kinds.count("offer") == 3
    assert "remark" in kinds
    assert sum("Repeat it?" in question for question in asked) == 3
    said = [entry.details.get("question", "") for entry in arm.recorded(EntryKind.DECISION)]
    assert sum("Repeat it?" in str(question) for question in said) == 3


def test_a_z_that_nobody_measured_is_changed_and_never_stated(arm, tmp_path):
    """The stored Z is 0.36 off; one touch stated it to +-0.025."""
    full = ("--station", "PIN-07", "--count", "4", "--no-verify")
    assert arm.calibrate("n-angle", *full).code == 0
    off_mm = arm.stored.z_mm - arm.truth.z_mm
    assert abs(off_mm) > 0.3
    stored = arm.stored.z_mm
    arm.lengthen(0.2)
    done = recalibrate(arm, example_for(arm, tmp_path), "--nozzle", "N-1")
    assert done.code == 0, done.err
    (tool,) = done.document["tools"]
    assert tool["measured"] == ["x_mm", "y_mm"]
    assert tool["changed"] == ["z_mm"]
    assert set(tool["fit"]["half_width95"]) == {"x_mm", "y_mm"}
    assert tool["stored_z"] == {"value_mm": stored, "half95_mm": None, "entry": None}
    # The change is stated, and it is right.
    assert tool["change_z_mm"] == pytest.approx(tool["proposed"]["z_mm"] - stored, abs=2e-3)
    assert abs(tool["change_z_mm"] + 0.2) <= tool["change_z_half95_mm"]
    assert abs(arm.stored.z_mm - arm.truth.z_mm) > 3 * tool["change_z_half95_mm"]
    assert "change of Z (95 %): -0.2" in done.err or "change of Z (95 %): -0.1" in done.err
    said = arm.recorded(EntryKind.CALIBRATION)[0].details
    assert said["changed"] == ["z_mm"]
    assert said["change_z_mm"] == tool["change_z_mm"]
    assert len(said["half_width95"]) == 2
    change = arm.recorded(EntryKind.CALIBRATION)[0].change
    entries = [entry for entry in reversed(arm.recorded()) if entry.change == change]
    made = {"made_at": "2026-11-28T08:00:00Z", "robolink_version": "0.4", "check": "whole"}
    (report,) = reports_of(entries, **made)
    table = offsets(report)
    assert table is not None
    assert report.fit is not None
    (z,) = [one for one in table.own if one.axis.startswith("Z mm")]
    assert z.half95 is None
    assert "only its change" in z.axis
    assert "never measured" in interval_sentences(report.fit)[0]


def test_a_z_that_was_measured_has_its_interval_after_one_touch(arm, tmp_path):
    """Z comes from the height of a surface, X and Y from the pin; then the needle is changed."""
    arm.mount()
    arm.lengthen(-0.3)
    no_proof = ("--no-verify", "--nozzle", "N-0")
    assert arm.calibrate("z-touch", "--station", "PLATE", *no_proof).code == 0
    (measured,) = arm.recorded(EntryKind.CALIBRATION)
    full = ("n-angle", "--station", "PIN-07", "--count", "4", *no_proof)
    assert arm.calibrate(*full).code == 0
    for nozzle, by_mm in (("N-1", 0.2), ("N-2", -0.15)):
        arm.lengthen(by_mm)
        done = recalibrate(arm, example_for(arm, tmp_path), "--nozzle", nozzle)
        assert done.code == 0, done.err
        (tool,) = done.document["tools"]
        assert tool["changed"] == []
        assert tool["stored_z"]["entry"] == measured.number
        half = tool["fit"]["half_width95"]["z_mm"]
        assert abs(arm.stored.z_mm - arm.truth.z_mm) <= half
        assert half > tool["change_z_half95_mm"]
        assert f"the stored Z was measured: journal entry {measured.number}" in done.err
    # A typed number was not measured by anybody.
    assert arm.run("tool", "set", "1", "--z", str(arm.stored.z_mm + 0.01), "--yes").code == 0
    assert arm.calibrate(*full).code == 0
    arm.lengthen(0.1)
    done = recalibrate(arm, example_for(arm, tmp_path), "--nozzle", "N-3")
    assert done.code == 0, done.err
    assert done.document["tools"][0]["changed"] == ["z_mm"]
