"""``recalibrate``: the example recipes and their settings, on a simulator."""

import json
import signal
from pathlib import Path

import pytest
from robolink_simulators.epson.memory.points import Point

from robolink.model import EntryKind, Pose, ToolOffset, rotate_xy
from tests.faults._nozzle_cell import OLD_TIP, cell_in_process, served_cell
from tests.faults._requests import changes

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

EXAMPLES = Path(__file__).parents[2] / "examples" / "recipes"
PIN = (300.0, 100.0, -60.0)

POINTS = """
schema = "robolink/recipe/1"
name = "points"
basis = "{basis}"
z = "{z}"
[source]
kind = "points"
[station]
id = "PIN"
[[tools]]
number = 1
points = [901, 902]
"""

TOUCH = """
schema = "robolink/recipe/1"
name = "touch"
basis = "{basis}"
z = "{z}"
[source]
kind = "two-pose"
[station]
id = "PIN"
{station}
[[tools]]
number = 1
{more}
"""


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with cell_in_process(tmp_path / "cell", monkeypatch) as cell:
        cell.simulator.machine.motors_on = True
        yield cell


@pytest.fixture
def served(tmp_path, monkeypatch):
    """The cell on a port, for another process and for one whole change over a socket."""
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        cell.simulator.machine.motors_on = True
        yield cell


@pytest.fixture
def recipe(tmp_path):
    def write(text, **values):
        values = {"basis": "absolute", "z": "kept", "station": "", "more": "", **values}
        path = tmp_path / "recipe.toml"
        path.write_text(text.format(**values))
        return str(path)

    return write


def assisted(cell, path, *more):
    return cell.run("recalibrate", path, "--assist", cell.assist_url, "--yes", *more)


def truth(cell, tool=1):
    return cell.simulator.world.tips[tool]


def aside(offset, tip):
    return pytest.approx(tip.components()[:2], abs=0.06) == offset.components()[:2]


def teach(cell, tip):
    """Teach P901 and P902 on the pin with this tip, in Tool 0."""
    for number, u_deg in ((901, 10.0), (902, -170.0)):
        x, y = rotate_xy(tip.x_mm, tip.y_mm, u_deg)
        pose = Pose(PIN[0] - x, PIN[1] - y, PIN[2] - tip.z_mm, u_deg)
        cell.simulator.machine.points.store(number, Point.at(pose))


def journal(cell, *kinds):
    return list(cell.journal.log(cell.url).recorded(kinds=kinds))


def test_a_scara_with_a_pin_and_a_person(served):
    cell = served
    done = assisted(cell, str(EXAMPLES / "scara-pin.toml"), "--nozzle", "N-7", "--operator", "anna")
    assert done.code == 0, done.err
    assert aside(cell.tool_1, truth(cell))
    cell.check_settings_are_those_of_before()
    (entry,) = journal(cell, EntryKind.DONE)
    assert entry.signature.operator == "anna"
    assert entry.signature.nozzle == "N-7"
    assert entry.signature.recipe == "Dispensing needle on the pin"
    assert len(entry.signature.recipe_hash) == 64
    assert entry.signature.station == "PIN-07"
    (calibration,) = journal(cell, EntryKind.CALIBRATION)
    assert len(calibration.details["poses"]) == 2
    assert "change up to 2 mm" in calibration.tolerance
    assert calibration.change == entry.change
    assert cell.journal.verify().problems == ()


def test_a_file_of_poses_stands_for_the_points_of_a_tool(cell, recipe, tmp_path):
    rows = []
    for u_deg in (10.0, -170.0):
        x, y = rotate_xy(12.3, -3.4, u_deg)
        rows.append(f"{(PIN[0] - x) / 1000:.7f};{(PIN[1] - y) / 1000:.7f};{u_deg};0;0")
    (tmp_path / "touches.csv").write_text("\n".join(["X;Y;A;B;C", *rows]).replace(".", ","))
    text = POINTS.replace("points = [901, 902]", 'poses = {{ file = "touches.csv"{more} }}')
    asked = cell.run("recalibrate", recipe(text), "--yes", "--json")
    assert asked.code == 2, asked.out
    assert json.loads(asked.out)["error"]["reason"] == "euler,length"
    path = recipe(text, more=', length = "m", euler = "kuka"')
    done = cell.run("recalibrate", path, "--yes")
    assert done.code == 0, done.err
    assert cell.tool_1.components()[:2] == pytest.approx((12.3, -3.4), abs=2e-3)
    assert cell.simulator.machine.arm.moves_started == 0


def test_poses_that_say_another_tool_than_the_recipe_are_refused(cell, recipe, tmp_path):
    (tmp_path / "touches.csv").write_text("x,y,u,tool\n287.5,103.25,0,3\n312.5,96.75,180,3\n")
    text = POINTS.replace("points = [901, 902]", 'poses = {{ file = "touches.csv" }}')
    text = text.replace('kind = "points"', 'kind = "points"\ntaught_tool = 2')
    refused = cell.run("recalibrate", recipe(text), "--yes", "--json")
    assert refused.code == 7, refused.out
    assert json.loads(refused.out)["error"]["code"] == "tool_pose"
    assert cell.tool_1 == OLD_TIP


def test_pendant_points_only_and_nothing_moves(served):
    cell = served
    path = str(EXAMPLES / "pendant-points.toml")
    teach(cell, ToolOffset(12.3, -3.4, -20))
    refused = cell.run("recalibrate", path, "--yes")
    assert refused.code == 9
    assert "fit only the tool value that they were taught with" in refused.err
    first = cell.run("recalibrate", path, "--yes", "--reference")
    assert first.code == 0, first.err
    assert cell.tool_1 == OLD_TIP
    assert cell.run("recalibrate", path, "--yes").code == 0
    assert cell.tool_1 == OLD_TIP
    teach(cell, ToolOffset(12.5, -3.5, -20))
    second = cell.run("recalibrate", path, "--yes", "--json")
    assert second.code == 0, second.err
    # The error of the stored offset stays: only the difference is written.
    expected = ToolOffset(OLD_TIP.x_mm + 0.2, OLD_TIP.y_mm - 0.1, OLD_TIP.z_mm)
    assert cell.tool_1.components() == pytest.approx(expected.components(), abs=2e-3)
    (tool,) = json.loads(second.out)["tools"]
    assert abs(tool["tip"]["x_mm"] - 12.5) <= tool["fit"]["half_width95"]["x_mm"] < 0.05
    assert cell.simulator.machine.arm.moves_started == 0
    assert not [text for text in changes(cell.requests) if "TLSet 1" not in text]
    # Nothing was verified; the kept value is the reference of the next change all the same.
    teach(cell, ToolOffset(12.4, -3.5, -20))
    third = cell.run("recalibrate", path, "--yes", "--json")
    assert third.code == 0, third.err
    assert cell.tool_1.x_mm == pytest.approx(OLD_TIP.x_mm + 0.1, abs=2e-3)
    # The chart shows the measured values, not the written ones.
    (charted,) = json.loads(cell.run("journal", "drift", "--json").out)["controllers"]
    assert json.loads(third.out)["simulated"] is charted["simulated"] is True
    tips = {c["axis"]: c["points"] for c in charted["charts"] if c["quantity"] == "tip"}
    assert set(tips) == {"x", "y"}, "Z was kept"
    assert [p["value_mm"] for p in tips["x"]][-2:] == pytest.approx([12.5, 12.4], abs=2e-3)


def test_two_nozzles_are_written_both_or_none(cell):
    cell.simulator.machine.tools.set(2, ToolOffset(12.4, -3.7, -20))
    cell.simulator.world.change_nozzle(2)
    machine = cell.simulator.machine
    kept = machine.tools.get(2)
    written: list[ToolOffset | None] = []

    def spoil_the_second_write(_number, text):
        if len(written) == 1:
            machine.tools.set(2, ToolOffset(1, 2, 3))
            written.append(None)
        elif text.startswith('$Execute,"TLSet 2, XY') and not written:
            written.append(machine.tools.get(1))

    with cell.simulator.lock:
        cell.simulator.on_request = spoil_the_second_write
    failed = assisted(cell, str(EXAMPLES / "two-nozzles.toml"))
    assert failed.code == 5, failed.err
    assert "reads back as X 1.000 Y 2.000 Z 3.000" in failed.err
    assert written[0] not in (None, OLD_TIP)
    assert cell.tool_1 == OLD_TIP
    assert machine.tools.get(2) == kept
    assert cell.open_markers() == ()
    cell.check_settings_are_those_of_before()
    assert {entry.tool for entry in journal(cell, EntryKind.ROLLED_BACK)} == {1, 2}
    assert "Outputs stay as the recipe switched them: 8 off" in failed.err


def test_every_event_is_one_json_line_and_the_last_is_the_result(cell, recipe):
    done = assisted(cell, recipe(TOUCH), "--jsonl")
    assert done.code == 0, done.err
    events = [json.loads(line) for line in done.out.splitlines()]
    assert {event["schema"] for event in events} == {"robolink/recalibration-event/1"}
    names = [event["event"] for event in events]
    assert names[0] == "start"
    assert names[-1] == "result"
    assert {"phase", "step", "proposal", "write", "verification"} <= set(names)
    assert names.count("result") == 1


@pytest.mark.parametrize("words", [(), ("--json",), ("--jsonl",)])
def test_an_error_ends_the_output_in_the_form_that_was_asked_for(cell, recipe, words):
    failed = cell.run("recalibrate", recipe(POINTS), "--yes", *words)
    assert failed.code == 7
    if words == ("--jsonl",):
        last = json.loads(failed.out.splitlines()[-1])
        assert (last["event"], last["exit_code"]) == ("error", 7)
        assert last["error"]["code"] == "undefined_point"
    elif words:
        assert json.loads(failed.out)["error"]["code"] == "undefined_point"
    assert ("Not taught on this controller: P901, P902" in failed.err) is (words != ("--json",))


def test_a_dry_run_shows_the_requests_and_sends_none(cell):
    shown = cell.run(
        "recalibrate", str(EXAMPLES / "two-nozzles.toml"), "--dry-run", "--assist", cell.assist_url
    )
    assert shown.code == 0, shown.err
    for words in ('$Execute,"Go XY(', "ask 'Lot of the new nozzles?'", "switch output 8 off"):
        assert words in shown.out
    assert changes(cell.requests) == []
    assert journal(cell) == []


def test_z_is_typed_for_each_tool(cell, recipe):
    missing = cell.run("recalibrate", recipe(TOUCH, z="typed"), "--yes")
    assert missing.code == 9
    assert "--z 1=MM" in missing.err
    wrong = assisted(cell, recipe(TOUCH, z="typed"), "--z", "1=long")
    assert wrong.code == 2
    assert cell.requests == []
    done = assisted(cell, recipe(TOUCH, z="typed"), "--z", "1=-20.75")
    assert done.code == 0, done.err
    assert cell.tool_1.z_mm == -20.75
    assert assisted(cell, recipe(TOUCH), "--z", "1=-20").code == 2


def test_a_typed_z_beyond_the_cell_takes_an_engineer(cell, recipe, tmp_path, monkeypatch):
    """The recipe does not judge a typed value, but the write refuses it all the same."""
    file, before = tmp_path / "robolink.toml", cell.tool_1
    people = '[cells.a.people]\nanna = "engineer"\nben = "operator"\n'
    file.write_text(
        f'[cells.a]\nurl = "{cell.url}"\nremote_timeout_s = 5\n'
        f'remote_timeout_confirmed_by = "anna"\nmax_change_mm = 3\n{people}'
    )
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    assist = ("--assist", cell.assist_url, "--yes", "--z", "1=-25")
    line = ("-c", "a", "recalibrate", recipe(TOUCH, z="typed"), *assist)
    refused = cell.run(*line, "--operator", "ben")
    assert refused.code == 9
    assert "ben may not accept a jump of tool 1 by 5" in refused.err
    assert cell.tool_1 == before
    done = cell.run(*line, "--operator", "anna")
    assert done.code == 0, done.err
    assert cell.tool_1.z_mm == -25.0


def test_z_is_measured_on_a_pin_of_known_height(cell, recipe):
    station = f"z_mm = {cell.simulator.world.pin_mm[2]}"
    done = assisted(cell, recipe(TOUCH, z="measured", station=station))
    assert done.code == 0, done.err
    assert cell.tool_1.z_mm == pytest.approx(truth(cell).z_mm, abs=0.06)


def test_z_is_measured_as_the_difference_of_two_contacts(cell, recipe):
    path = recipe(TOUCH, basis="difference", z="measured")
    reference = assisted(cell, path, "--reference")
    assert reference.code == 0, reference.err
    before = truth(cell)
    cell.simulator.world.change_nozzle(1)
    after = truth(cell)
    done = assisted(cell, path)
    assert done.code == 0, done.err
    moved = [b - a for a, b in zip(before.components()[:3], after.components()[:3], strict=True)]
    expected = [old + by for old, by in zip(OLD_TIP.components()[:3], moved, strict=True)]
    assert cell.tool_1.components()[:3] == pytest.approx(expected, abs=0.08)


def test_a_reference_does_not_stand_for_a_tool_that_somebody_changed(cell, recipe):
    path = recipe(TOUCH, basis="difference")
    assert assisted(cell, path, "--reference").code == 0
    cell.simulator.machine.tools.set(1, ToolOffset(12.2, -3.5, -20))
    refused = assisted(cell, path)
    assert refused.code == 7
    assert "belongs to X 12.000" in refused.err


def test_a_tool_that_somebody_else_changed_is_named_with_the_usual_causes(cell, recipe):
    assert assisted(cell, recipe(TOUCH)).code == 0
    cell.simulator.machine.tools.set(1, ToolOffset(12.2, -3.5, -20))
    done = assisted(cell, recipe(TOUCH))
    assert done.code == 0, done.err
    for words in ("mm away", "a program that runs TLSet", "on the pendant", "restored project"):
        assert words in done.err


def test_a_target_outside_the_box_is_refused_before_anything_moves(cell, recipe):
    more = "approach = { x_mm = 300, y_mm = 300, z_mm = -80, u_deg = 0 }\n[box]\nsideways_mm = 20"
    refused = assisted(cell, recipe(TOUCH, more=more))
    assert refused.code == 2, refused.err
    assert cell.moves_requested == 0


def test_a_measurement_that_is_refused_is_taken_again_and_then_ends_the_change(cell, recipe):
    source = '[refusal]\naction = "measure_again"\nattempts = 3\n[tolerances]\nrms_mm = 0.001'
    path = Path(recipe(TOUCH, more=source))
    path.write_text(path.read_text().replace('"two-pose"', '"n-angle"\ncount = 3'))
    refused = assisted(cell, str(path), "--jsonl")
    assert refused.code == 7, refused.err
    events = [json.loads(line) for line in refused.out.splitlines()]
    again = [event["again"] for event in events if event["event"] == "refused"]
    assert again == [True, True, False]
    assert cell.tool_1 == OLD_TIP
    assert len(journal(cell, EntryKind.REFUSED)) == 3
    assert all(entry.details["poses"] for entry in journal(cell, EntryKind.REFUSED))


def test_corrections_that_grow_on_one_nozzle_are_refused(cell, recipe):
    world = cell.simulator.world
    for step, (dx, code) in enumerate([(0.2, 0), (0.3, 7)]):
        world.tips[1] = ToolOffset(cell.tool_1.x_mm + dx, cell.tool_1.y_mm, cell.tool_1.z_mm)
        before = cell.tool_1
        done = assisted(cell, recipe(TOUCH), "--nozzle", "N-1")
        assert done.code == code, (step, done.err)
    assert "The correction grew" in done.err
    assert cell.tool_1 == before
    # Another nozzle may be farther off.
    assert assisted(cell, recipe(TOUCH), "--nozzle", "N-2").code == 0


def test_a_jump_takes_an_engineer(cell, recipe, tmp_path, monkeypatch):
    cell.simulator.world.tips[1] = ToolOffset(15.5, -3.5, -20)
    (tmp_path / "robolink.toml").write_text(
        f'[cells.a]\nurl = "{cell.url}"\nremote_timeout_s = 60.0\n'
        'remote_timeout_confirmed_by = "me"\n'
        '[cells.a.people]\nanna = "engineer"\n"4711" = "operator"\n'
    )
    monkeypatch.chdir(tmp_path)
    path = recipe(TOUCH)

    def run(*words):
        return assisted(cell, path, "-c", "a", *words)

    refused = run("--operator", "anna")
    assert refused.code == 7
    assert "Allow a real change with --accept-jump." in refused.err
    assert run("--operator", "4711", "--accept-jump", "5").code == 9
    assert run("--accept-jump", "5").code == 9
    assert run("--operator", "eve").code == 2
    assert cell.tool_1 == OLD_TIP
    done = run("--operator", "anna", "--accept-jump", "5")
    assert done.code == 0, done.err
    decisions = [entry.verdict for entry in journal(cell, EntryKind.DECISION)]
    assert any("accept a jump of tool 1 by" in verdict for verdict in decisions)


@pytest.mark.parametrize("nth", [2, 7, 12])
def test_ctrl_c_during_a_recipe_leaves_the_old_value_and_the_tool_selected(served, nth):
    from tests.faults._client_process import ClientProcess

    cell, moves = served, []

    def press(_number, text):
        if '"Move ' in text or '"Go ' in text:
            moves.append(text)
            if len(moves) == nth:
                client.signal(signal.SIGINT)

    path = str(EXAMPLES / "scara-pin.toml")
    with cell.simulator.lock:
        cell.simulator.on_request = press
        client = ClientProcess(
            [
                "-c",
                cell.url,
                "recalibrate",
                path,
                "--assist",
                cell.assist_url,
                "--yes",
                "--nozzle",
                "N",
                "--jsonl",
            ],
            environment={"ROBOLINK_STATE_DIR": str(cell.state_folder)},
            folder=cell.folder,
        )
    assert client.exit_code() == 130, client.err
    assert json.loads(client.out.splitlines()[-1])["event"] == "error"
    assert cell.tool_1 == OLD_TIP
    assert cell.open_markers() == ()
    cell.check_settings_are_those_of_before()


@pytest.mark.parametrize("nth", [1, 5, 10, 16])
def test_an_emergency_stop_during_a_recipe_repeats_nothing(cell, nth):
    moves = []

    def press(_number, text):
        if '"Move ' in text or '"Go ' in text:
            moves.append(text)
            if len(moves) == nth:
                cell.simulator.panel.press_estop()

    with cell.simulator.lock:
        cell.simulator.on_reply = None
        cell.simulator.on_request = press
    ended = assisted(cell, str(EXAMPLES / "scara-pin.toml"), "--nozzle", "N")
    assert ended.code in (5, 6), ended.err
    assert "mergency stop" in ended.err
    assert len(moves) == nth
    cell.simulator.panel.release_estop()
    assert cell.run("reset").code == 0
    assert cell.run("recover").code in (0, 6)
    assert cell.run("recover", "--yes").code == 0
    assert cell.tool_1 == OLD_TIP
    cell.check_settings_are_those_of_before()


@pytest.mark.parametrize(
    "command", [("tool", "get", "1"), ("tool", "set", "1", "--x", "12.3", "--yes")]
)
def test_whoever_looks_at_a_tool_is_told_that_somebody_else_changed_it(cell, command):
    assert cell.run("tool", "set", "1", "--x", "12.1", "--yes").code == 0
    assert "mm away" not in cell.run("tool", "get", "1").err
    cell.simulator.machine.tools.set(1, ToolOffset(12.6, -3.5, -20))
    shown = cell.run(*command)
    assert shown.code == 0, shown.err
    assert "That is 0.500 mm away" in shown.err
    assert "it was left with X 12.100" in shown.err


def test_a_raw_statement_is_for_engineers_and_on_record(cell, tmp_path, monkeypatch):
    (tmp_path / "robolink.toml").write_text(
        f'[cells.a]\nurl = "{cell.url}"\n[cells.a.people]\nanna = "engineer"\nben = "operator"\n'
    )
    monkeypatch.chdir(tmp_path)
    raw = ("execute-raw", "Print TLDef(1)", "--yes", "-c", "a")
    assert cell.run(*raw, "--operator", "ben").code == 9
    done = cell.run(*raw, "--operator", "anna")
    assert (done.code, done.out.strip()) == (0, "-1"), done.err
    (entry,) = journal(cell, EntryKind.RAW)
    assert (entry.signature.operator, entry.signature.role) == ("anna", "engineer")
    assert entry.details["request"] == "Print TLDef(1)"
    # A statement that caused a controller error: how far it got is unknown.
    failed = cell.run("execute-raw", "Tool 9", "--yes", "-c", "a", "--operator", "anna", "--json")
    error = json.loads(failed.out)["error"]
    assert (failed.code, error["kind"]) == (6, "ControllerFaultError")
    assert (error["controller_state"], error["stands"]["doubtful"]) == ("unknown", ["Tool 9"])


def test_a_calibration_without_a_recipe_names_nozzle_and_lot_too(cell):
    done = cell.run(*cell.calibration, "--nozzle", "N-9", "--lot", "L-3", "--operator", "anna")
    assert done.code == 0, done.err
    (entry,) = journal(cell, EntryKind.DONE)
    signature = entry.signature
    assert (signature.nozzle, signature.lot, signature.operator) == ("N-9", "L-3", "anna")
