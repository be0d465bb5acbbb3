"""cell check: what it finds, what it records, and that nothing on the controller changes."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.cell.tip_switches import LightBeam

from robolink.errors import DeclinedError
from robolink.journal import open_journal
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry
from tests.cli.test_journal_drift import entries
from tests.drift._courses import course
from tests.faults._requests import changes

ROOT = Path(__file__).parents[2]
PIN = '[cells.line3.stations.PIN-07]\nkind = "pin"\ncheck_every_days = 90\n'


@pytest.fixture
def cells(simulator, tmp_path, monkeypatch, capsys):
    """Write the cell file; return what runs ``cell check`` and gives code, document and errors."""
    file = tmp_path / "cells.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    stated = "remote_timeout_s = 60\nremote_timeout_confirmed_by = 'me'\n"
    file.write_text(f'[cells.line3]\nurl = "{simulator.url}"\n{stated}')

    def checked(*arguments, more=""):
        file.write_text(file.read_text() + more)
        code = main.run(["cell", "check", *arguments, "--json"])
        shown = capsys.readouterr()
        document = json.loads(shown.out)
        assert document["schema"] == "robolink/check/1"
        return code, document

    return checked


def found(document, cell=0):
    return [finding["code"] for finding in document["cells"][cell]["findings"]]


def recorded():
    return list(open_journal().entries(kinds=(EntryKind.CHECK,), newest_first=False))


def test_a_cell_in_order_ends_with_0_goes_on_record_and_is_not_touched(cells, simulator, capsys):
    code, document = cells()
    (cell,) = document["cells"]
    assert (code, document["ok"], cell["ok"], cell["findings"]) == (0, True, True, [])
    assert cell["tools"]["1"]["x_mm"] == 12.0
    assert cell["selected_tool"] == 1
    (entry,) = recorded()
    assert entry.verdict == "In order."
    assert entry.details["tools"]["1"][0] == 12.0
    requests = [text for _, direction, text in simulator.log if direction == ">"]
    assert requests
    assert changes(requests) == []
    assert simulator.machine.flash_writes == 0
    assert simulator.machine.arm.moves_started == 0
    assert main.run(["check"]) == 0
    assert "line3: in order (tools read: 15, stations: 0, " in capsys.readouterr().out
    assert len(recorded()) == 2


def test_a_tool_that_somebody_else_wrote_is_told_with_the_way_back(cells, simulator, run):
    assert run("tool", "set", "1", "--x", "12.5", "--yes")[0] == 0
    assert cells()[0] == 0
    assert run("expert", "execute-raw", "TLSet 1, XY(13,-3.5,-20,0)", "--yes")[0] == 0
    code, document = cells()
    assert (code, found(document)) == (1, ["tool_changed"])
    (finding,) = document["cells"][0]["findings"]
    assert finding["subject"] == "1"
    assert "0.500 mm away" in finding["sentence"]
    assert "'robolink tool set 1'" in finding["remedy"]
    assert run("tool", "set", "1", "--x", "12.5", "--yes")[0] == 0
    assert cells()[0] == 0


def test_a_station_that_was_never_learnt_and_work_left_open(cells, simulator):
    assert cells()[0] == 0
    log = open_journal().log(simulator.url)
    log.begin(Marker("a" * 32, MarkerKind.SET, "TLSet 1, XY(1)", "2026-01-01T00:00:00+00:00", {}))
    log.close()
    code, document = cells(more=PIN)
    assert (code, found(document)) == (1, ["unsettled", "station_due"])
    assert recorded()[-1].verdict == "Needs attention: unsettled, station_due."


def test_a_mount_that_slips_is_told_and_an_earlier_course_left_out(cells, simulator):
    assert cells()[0] == 0
    log = open_journal().log(simulator.url)
    for change in course(3, 34, shift=lambda index, _: (0.1 * (index >= 26), 0.0, 0.0)):
        log.append(*entries(change)[:2])
        tip = [change.tip_mm[axis] for axis in "xyz"] + [0.0] * 3
        kept = {"value": tip, "z_from": "kept"}
        log.append(NewEntry(EntryKind.DONE, change=change.change, tool=2, details=kept))
        log.append(NewEntry(EntryKind.DONE, change=change.change, tool=change.tool, details={}))
    log.close()
    code, document = cells()
    assert code == 1
    assert "mount_shifted" in found(document)
    code, document = cells("--since", "2100-01-01")
    assert "mount_shifted" not in found(document)


@pytest.mark.parametrize(
    ("act", "codes"),
    [
        ("press_estop", ["controller_in_error", "tools_not_read"]),
        ("start_production", ["tools_not_read"]),
    ],
)
def test_tools_that_cannot_be_read_now_are_told_beside_the_rest(cells, simulator, act, codes):
    getattr(simulator.panel, act)()
    code, document = cells(more=PIN)
    assert (code, found(document)) == (1, [*codes, "station_due"])
    assert document["cells"][0]["tools"] == {}


def test_one_cell_that_does_not_answer_leaves_the_others_looked_at(cells, simulator, capsys):
    gone = '[cells.gone]\nurl = "epson+sim://nobody-here?robot=none"\n'
    away = '[cells.away]\nurl = "epson+tcp://127.0.0.1:1"\n'
    code, document = cells(more=away)
    assert (code, document["ok"]) == (3, False)
    by_name = {cell["cell"]: cell for cell in document["cells"]}
    assert by_name["line3"]["ok"]
    assert by_name["away"]["error"]["kind"] == "ConnectError"
    assert by_name["away"].keys() == by_name["line3"].keys()
    assert by_name["away"]["tools"] is by_name["away"]["changes"] is None
    assert by_name["away"]["findings"] == []
    assert sorted(entry.verdict.split(":")[0] for entry in recorded()) == [
        "In order.",
        "The cell could not be looked at",
    ]
    assert main.run(["check", "line3"]) == 0
    assert "away" not in capsys.readouterr().out
    assert cells(more=gone)[0] != 0
    assert main.run(["check"]) != 0
    lines = [line for line in capsys.readouterr().out.splitlines() if not line.startswith(" ")]
    assert lines[-1].startswith("line3: in order")


def test_a_name_that_is_no_cell_stops_before_any_is_asked(cells, simulator, capsys):
    assert main.run(["check", "line3", "line9"]) == 2
    assert "line9" in capsys.readouterr().err
    assert recorded() == []


def test_a_plc_is_checked_alike(cells):
    url = "softmotion+sim://check?kinematics=Kin_Scara3_Z&seed=1"
    code, document = cells("plc", more=f'[cells.plc]\nurl = "{url}"\n')
    assert (code, found(document)) == (0, [])
    assert document["cells"][0]["controller"].startswith("softmotion")


@pytest.fixture
def watched(simulator, monkeypatch, tmp_path):
    """Two beams, a recipe that measures by them, and a person at the terminal who says yes."""
    for number, heading_deg in ((3, 2.0), (4, 91.0)):
        beam = LightBeam((175.0, 488.0, -106.0), heading_deg, radius_mm=0.1)
        simulator.world.connect(number, beam, latency_s=0.002, noise_mm=0.003)
    simulator.machine.motors_on = True
    example = ROOT / "examples" / "recipes" / "needle-beams.toml"
    (tmp_path / "beams.toml").write_bytes(example.read_bytes())
    asked: list[str] = []

    def answers(yes):
        def require_yes(question):
            asked.append(question)
            if not yes:
                raise DeclinedError("You said no.")

        monkeypatch.setattr("robolink_cli.prompts.questions.on_terminal", lambda: True)
        monkeypatch.setattr("robolink_cli.commands.computer.cell_check.on_terminal", lambda: True)
        monkeypatch.setattr("robolink_cli.prompts.questions.require_yes", require_yes)
        return asked

    return answers


def test_a_sensor_measures_after_a_yes_and_nothing_is_written(cells, simulator, watched):
    asked = watched(yes=True)
    simulator.machine.tools.set(1, simulator.world.tips[1])
    before = simulator.machine.tools.defined()
    code, document = cells("--measure", "beams.toml")
    assert (code, found(document)) == (0, [])
    assert len(asked) == 1
    assert "nothing is written" in asked[0]
    assert simulator.machine.arm.moves_started > 0
    tip = simulator.world.tips[1]
    simulator.machine.tools.set(1, replace(tip, x_mm=tip.x_mm + 0.16))
    code, document = cells("--measure", "beams.toml")
    assert (code, found(document)) == (1, ["tip_moved"])
    assert "limit 0.100 mm" in document["cells"][0]["findings"][0]["sentence"]
    assert not [text for _, way, text in simulator.log if way == ">" and "TLSet 1," in text]
    assert set(simulator.machine.tools.defined()) == set(before)
    assert simulator.machine.tools.selected == 1
    assert recorded()[-1].verdict == "Needs attention: tip_moved."


def test_nothing_moves_without_a_person_s_yes(cells, simulator, watched, tmp_path, capsys):
    moves = simulator.machine.arm.moves_started
    assert main.run(["check", "--measure", str(tmp_path / "beams.toml")]) == 9
    assert "run it on a terminal" in capsys.readouterr().err
    assert recorded() == []
    watched(yes=False)
    code, document = cells("--measure", "beams.toml")
    assert (code, document["cells"][0]["error"]["kind"]) == (9, "DeclinedError")
    assert document["cells"][0]["tools"]["1"]["x_mm"] == 12.0
    assert (document["ok"], document["cells"][0]["ok"]) == (False, False), "nobody looked further"
    assert simulator.machine.arm.moves_started == moves
    assert [entry.verdict for entry in recorded()] == ["In order."]


def test_a_recipe_by_which_a_person_touches_measures_nothing(cells, simulator, watched, tmp_path):
    asked = watched(yes=True)
    example = ROOT / "examples" / "recipes" / "scara-pin.toml"
    code, document = cells("--measure", str(example))
    assert code == 2
    assert "a person to touch" in document["cells"][0]["error"]["what"]
    assert asked == []
    assert simulator.machine.arm.moves_started == 0
