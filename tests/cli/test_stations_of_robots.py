"""Two robots of one controller, each with a place of a station of the same name."""

import json

import pytest
from robolink_cli import main

from robolink.journal import open_journal
from robolink.model import Identity
from robolink.stations import Found, StationKind, station_entry

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
def run(capsys, monkeypatch, tmp_path):
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


def test_each_robots_places_are_listed_as_its_own(run):
    first, second = ROBOTS
    expected = [(first, "PIN-07", 100.0), (second, "PIN-08", 300.0), (second, "PIN-07", 250.0)]
    assert sorted(places(run)) == sorted(expected)
    assert places(run, "--robot", "T6-1") == [(first, "PIN-07", 100.0)]
    assert [line.split()[:2] for line in run("list")[1].splitlines() if "PIN" in line] == [
        ["C8-2", "PIN-08"],
        ["C8-2", "PIN-07"],
        ["T6-1", "PIN-07"],
    ]


def test_one_station_of_several_robots_is_shown_by_the_name_of_the_robot(run):
    code, _, err = run("show", "PIN-07")
    assert code == 2
    assert "Several robots of this controller have a place of station PIN-07" in err
    for robot, x_mm in zip(ROBOTS, (100.0, 250.0), strict=True):
        shown = json.loads(run("show", "PIN-07", "--robot", robot, "--json")[1])
        assert (shown["robot"], shown["x_mm"]) == (robot, x_mm)
    shown = json.loads(run("show", "PIN-08", "--json")[1])
    assert (shown["robot"], shown["x_mm"]) == (ROBOTS[1], 300.0)
    code, _, err = run("show", "PIN-07", "--robot", "G6-3")
    assert (code, "No robot 'G6-3' is on record here." in err) == (2, True)


def test_what_does_not_tell_its_robot_is_listed_under_the_controller(run):
    learnt("", 77.0)
    assert (BOTH, "PIN-07", 77.0) in places(run)
    assert json.loads(run("show", "PIN-08", "--json")[1])["x_mm"] == 300.0


def test_the_beams_of_a_station_are_shown_as_a_cell_file_has_them(
    run, monkeypatch, tmp_path, capsys
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
