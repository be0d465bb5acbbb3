"""cell check and cell tools: their findings, their records, and the robot they apply to."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.cell.tip_switches import LightBeam

import robolink
from robolink.errors import DeclinedError
from robolink.journal import LeaseHolder, open_journal
from robolink.journal._lease_view import this_process
from robolink.model import EntryKind, Identity, Marker, MarkerKind, NewEntry
from robolink.stations import Found, StationKind, station_entry
from tests.cli.test_journal_statements import entries
from tests.drift._courses import course
from tests.faults._requests import changes

# cell check: its findings, its records, and that nothing on the controller changes.

ROOT = Path(__file__).parents[2]
PIN = '[cells.line3.stations.PIN-07]\nkind = "pin"\ncheck_every_days = 90\n'


@pytest.fixture
def cells(simulator, tmp_path, monkeypatch, capsys):
    """Write the cell file; return a runner of ``cell check`` that gives code, document and
    errors.
    """
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
    return list(open_journal().checks(newest_first=False))


def test_a_cell_in_order_ends_with_0_goes_on_record_and_is_not_touched(cells, simulator, capsys):
    code, document = cells()
    (cell,) = document["cells"]
    assert (code, document["ok"], cell["ok"], cell["findings"]) == (0, True, True, [])
    assert cell["tools"]["1"]["x_mm"] == 12.0
    assert cell["selected_tool"] == 1
    (entry,) = recorded()
    assert entry.verdict == "No problem found."
    assert entry.details["tools"]["1"][0] == 12.0
    requests = [text for _, direction, text in simulator.log if direction == ">"]
    assert requests
    assert changes(requests) == []
    assert simulator.machine.flash_writes == 0
    assert simulator.machine.arm.moves_started == 0
    assert main.run(["check"]) == 0
    assert "line3: no problem found (tools read: 15, stations: 0, " in capsys.readouterr().out
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
        "No problem found.",
        "The cell could not be checked",
    ]
    assert main.run(["check", "line3"]) == 0
    assert "away" not in capsys.readouterr().out
    assert cells(more=gone)[0] != 0
    assert main.run(["check"]) != 0
    lines = [line for line in capsys.readouterr().out.splitlines() if not line.startswith(" ")]
    assert lines[-2].startswith("line3: no problem found")
    assert lines[-1] == ("Cells: 3. No problem: 1. Need attention: 0. Not checked: 2. Busy: 0.")


def test_a_name_that_is_no_cell_stops_before_any_is_asked(cells, simulator, capsys):
    assert main.run(["check", "line3", "line9"]) == 2
    assert "line9" in capsys.readouterr().err
    assert recorded() == []


def test_a_plc_is_checked_alike(cells):
    url = "softmotion+sim://check?kinematics=Kin_Scara3_Z&seed=1"
    code, document = cells("plc", more=f'[cells.plc]\nurl = "{url}"\n')
    assert (code, found(document)) == (0, [])
    assert document["cells"][0]["controller"].startswith("softmotion")


def test_patterns_and_groups_name_cells_and_one_that_names_none_stops_it(cells, simulator, capsys):
    more = f'[cells.line4]\nurl = "{simulator.url}"\n[groups]\nnight = ["line4", "line3"]\n'
    _, document = cells("line*", more=more)
    assert [cell["cell"] for cell in document["cells"]] == ["line3", "line4"]
    _, document = cells("@night")
    assert [cell["cell"] for cell in document["cells"]] == ["line4", "line3"]
    before = len(recorded())
    for word, told in (("glue*", "glue*"), ("@nigth", "@night"), ("line9", "line9")):
        assert main.run(["check", "line3", word]) == 2
        assert told in capsys.readouterr().err
    assert len(recorded()) == before
    assert main.run(["cell", "list", "@night"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["line4", "line3"]
    assert main.run(["cell", "list", "glue*"]) == 2


def test_checks_on_record_are_shown_newest_first(cells, simulator, capsys):
    assert main.run(["journal", "checks"]) == 0
    assert "No check is on record here." in capsys.readouterr().out
    assert cells(more='[cells.away]\nurl = "epson+tcp://127.0.0.1:1"\n')[0] == 3
    assert main.run(["journal", "checks"]) == 0
    newest, oldest = sorted(capsys.readouterr().out.splitlines(), key=lambda line: "line3" in line)
    assert "away: The cell could not be checked: " in newest
    assert oldest.endswith("line3: No problem found.")
    assert main.run(["--json", "journal", "checks", "-c", "line3", "--limit", "5"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["checks"]
    assert (one["cell"], one["well"]) == ("line3", True)
    assert main.run(["--json", "journal", "list"]) == 0
    kinds = {entry["kind"] for entry in json.loads(capsys.readouterr().out)["entries"]}
    assert "check" not in kinds


def test_somebody_at_work_is_named_and_ends_with_5_after_all_else(cells, simulator, capsys):
    assert cells()[0] == 0
    own = this_process()
    ann = LeaseHolder(os_user="ann", host="pc-7", pid=own.pid, boot=own.boot)
    with open_journal().log(simulator.url, holder=ann).hold("a needle change"):
        code, document = cells()
        assert main.run(["check"]) == 5
        out = capsys.readouterr().out
        away = '[cells.away]\nurl = "epson+tcp://127.0.0.1:1"\n'
        assert cells(more=away)[0] == 3
    (cell,) = document["cells"]
    assert (code, cell["state"], cell["ok"]) == (5, "busy", False)
    assert "line3: somebody is working there; not checked." in out
    assert "a needle change" in out


@pytest.fixture
def watched(simulator, monkeypatch, tmp_path):
    """Two beams, a recipe that uses them, and a person at the terminal who confirms."""
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

        monkeypatch.setattr("robolink_cli.prompts.questions.person_here", lambda: True)
        monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
        monkeypatch.setattr("robolink_cli.commands.computer.cell_check.person_here", lambda: True)
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
    assert "without writing" in asked[0]
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
    (entry,) = recorded()
    assert entry.verdict == "The cell could not be checked: You said no."
    assert (entry.well, entry.details["error"]) == (False, "DeclinedError")
    assert entry.details["tools"]["1"][0] == 12.0


@pytest.mark.parametrize(("given", "role"), [("4711", "engineer"), ("", "operator")])
def test_who_measures_is_asked_for_a_badge_once(
    cells, watched, tmp_path, monkeypatch, capsys, given, role
):
    badges: list[str] = []

    def badge(question):
        badges.append(question)
        return given

    monkeypatch.setattr("robolink_cli.session.operator_identity.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.prompts.questions.asked_for_text", badge)
    watched(yes=False)
    with open(tmp_path / "cells.toml", "a") as file:
        file.write('[cells.line3.people]\n4711 = "engineer"\n')
    assert main.run(["check", "--measure", str(tmp_path / "beams.toml")]) == 9
    assert "You said no." in capsys.readouterr().out
    assert len(badges) == 1
    (entry,) = recorded()
    assert (entry.signature.operator, str(entry.signature.role)) == (given, role)


def test_a_recipe_by_which_a_person_touches_measures_nothing(cells, simulator, watched, tmp_path):
    asked = watched(yes=True)
    example = ROOT / "examples" / "recipes" / "scara-pin.toml"
    code, document = cells("--measure", str(example))
    assert code == 2
    assert "a person to touch" in document["cells"][0]["error"]["what"]
    assert asked == []
    assert simulator.machine.arm.moves_started == 0


# Two robots of one controller, each with a station of the same name.

URL = "epson+tcp://cell-5.plant:5000"
BOTH = "epson:RC1/T6-1+C8-2"
ROBOTS = ("epson:RC1/T6-1", "epson:RC1/C8-2")


def learnt(robot, x_mm, name="PIN-07"):
    log = open_journal().log(URL)
    log.ask(
        lambda: Identity(
            BOTH, URL, "epson@192.168.0.1:5000", robot=robot, robots=ROBOTS if robot else ()
        )
    )
    log.append(station_entry(Found(id=name, kind=StationKind.PIN, x_mm=x_mm, y_mm=0.0)))
    log.close()


@pytest.fixture
def run_with_robots(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    for robot, x_mm in zip(ROBOTS, (100.0, 250.0), strict=True):
        learnt(robot, x_mm)
    learnt(ROBOTS[1], 300.0, "PIN-08")

    def command(*words):
        code = main.run(["-c", URL, "station", *words])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return command


def places(run, *words):
    document = json.loads(run("list", "--json", *words)[1])
    return [(one["robot"], one["id"], one["x_mm"]) for one in document["stations"]]


def test_each_robots_places_are_listed_as_its_own(run_with_robots):
    first, second = ROBOTS
    expected = [(first, "PIN-07", 100.0), (second, "PIN-08", 300.0), (second, "PIN-07", 250.0)]
    assert sorted(places(run_with_robots)) == sorted(expected)
    assert places(run_with_robots, "--robot", "T6-1") == [(first, "PIN-07", 100.0)]
    assert [
        line.split()[:2] for line in run_with_robots("list")[1].splitlines() if "PIN" in line
    ] == [
        ["C8-2", "PIN-08"],
        ["C8-2", "PIN-07"],
        ["T6-1", "PIN-07"],
    ]


def test_one_station_of_several_robots_is_shown_by_the_name_of_the_robot(run_with_robots):
    code, _, err = run_with_robots("show", "PIN-07")
    assert code == 2
    assert "Several robots of this controller have a station PIN-07" in err
    for robot, x_mm in zip(ROBOTS, (100.0, 250.0), strict=True):
        shown = json.loads(run_with_robots("show", "PIN-07", "--robot", robot, "--json")[1])
        assert (shown["robot"], shown["x_mm"]) == (robot, x_mm)
    shown = json.loads(run_with_robots("show", "PIN-08", "--json")[1])
    assert (shown["robot"], shown["x_mm"]) == (ROBOTS[1], 300.0)
    code, _, err = run_with_robots("show", "PIN-07", "--robot", "G6-3")
    assert (code, "No robot 'G6-3' is on record here." in err) == (2, True)


def test_what_does_not_tell_its_robot_is_listed_under_the_controller(run_with_robots):
    learnt("", 77.0)
    assert (BOTH, "PIN-07", 77.0) in places(run_with_robots)
    assert json.loads(run_with_robots("show", "PIN-08", "--json")[1])["x_mm"] == 300.0


def test_the_beams_of_a_station_are_shown_as_a_cell_file_has_them(
    run_with_robots, monkeypatch, tmp_path, capsys
):
    (tmp_path / "robolink.toml").write_text(f"""
[cells.line3]
url = "{URL}"
stations.BEAMS-02 = {{ kind = "beams", z_mm = -106.0, beams = [
    {{ input = 3, x_mm = 175.0, y_mm = 488.0, direction_deg = 2.0 }},
    {{ input = 4, x_mm = 175.0, y_mm = 488.0, direction_deg = 91.0 }},
] }}
""")
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "robolink.toml"))
    assert main.run(["-c", "line3", "cell", "station", "show", "BEAMS-02"]) == 0
    shown = capsys.readouterr().out
    for number, direction in ((3, 2), (4, 91)):
        beam = f"input = {number}, x_mm = 175, y_mm = 488, direction_deg = {direction}"
        assert f"  beams = {{ {beam} }}\n" in shown
    assert "  off_when_broken = false\n" in shown


# One page of all tools of a cell: value, last change, age, due checks.

RECIPE = Path(__file__).parents[2] / "examples" / "recipes" / "needle-one-touch.toml"


def test_each_tool_is_shown_with_its_last_change_and_its_age(run, simulator):
    code, out, _ = run("cell", "tools")
    assert code == 0
    assert "never by robolink" in out
    assert run("tool", "set", "2", "--x", "5", "--y", "6", "--z", "-70", "--yes")[0] == 0
    code, out, _ = run("cell", "tools")
    assert "today" in out
    code, out, _ = run("--json", "cell", "tools")
    assert code == 0
    said = json.loads(out)
    assert said["schema"] == "robolink/cell-tools/1"
    assert said["selected_tool"] == 1
    assert said["tools"]["1"]["changed_at"] is None
    two = said["tools"]["2"]
    assert two["offset"]["z_mm"] == -70.0
    assert 0.0 <= two["age_days"] < 0.5
    assert (two["as_recorded"], two["due"]) == (True, [])

    simulator.machine.tools.set(2, simulator.machine.tools.get(1))
    two = json.loads(run("--json", "cell", "tools")[1])["tools"]["2"]
    assert two["as_recorded"] is False
    assert "it was left with" in two["due"][0]


def test_what_is_due_comes_from_the_recipes_and_the_record(run, simulator, tmp_path):
    (tmp_path / "a.toml").write_text(RECIPE.read_text(encoding="utf-8"), encoding="utf-8")
    touch = {
        "station": "PIN-07", "x_mm": 1.0, "y_mm": 2.0, "z_mm": 3.0, "u_deg": 0.0,
        "sigma_mm": 0.01, "changes": 16, "full_sigma_mm": 0.01, "touch_sigma_mm": 0.02,
    }  # fmt: skip
    value = list(simulator.machine.tools.get(1).components())
    with robolink.connect(simulator.url) as controller:
        details = {"touch": touch, "value": value}
        controller.outcomes.append(NewEntry(EntryKind.DONE, change="c", tool=1, details=details))
    one = json.loads(run("--json", "cell", "tools")[1])["tools"]["1"]
    assert one["changes_left"] == 4
    assert one["due"] == ["Tool 1: A full calibration is due after 4 more changes."]
    assert "Tool 1: A full calibration is due after 4 more changes." in run("cell", "tools")[1]
