"""The command line knows a controller by what it says of itself, not by its URL."""

import json
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.backup import first_backup_path
from robolink.journal import open_journal
from robolink.model import Marker, MarkerKind


@pytest.fixture
def served(state_folder):
    simulator = EpsonSimulator(seed=4)
    with serve_tcp(simulator) as host:
        yield simulator, host.url, host.url.replace("127.0.0.1", "localhost")


def run(capsys, *arguments):
    code = main.run([*arguments])
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def test_the_other_spelling_is_said_once_and_shows_what_is_open(served, capsys):
    simulator, by_number, by_name = served
    assert run(capsys, "-c", by_number, "status")[0] == 0
    log = open_journal().log(by_number)
    details = {"tool": 1, "now": 0, "power_high": False, "speed_percent": [1, 1, 1]}
    details["speed_s_mm_s"] = [1, 1, 1]
    log.begin(Marker("a", MarkerKind.SELECTION, "calibration of tool 1", "then", details))
    log.close()
    simulator.machine.tools.select(0)
    code, _, err = run(capsys, "-c", by_name, "status")
    assert code == 0
    assert f"{by_name} is epson:" in err
    assert "calibration of tool 1" in err
    assert "one controller, one record" not in run(capsys, "-c", by_name, "status")[2]
    stood = simulator.machine.tip()
    assert run(capsys, "-c", by_name, "jog", "x+1", "--yes")[0] == 6
    assert simulator.machine.tip() == stood
    assert run(capsys, "-c", by_name, "recover")[0] == 0
    assert simulator.machine.tools.selected == 1
    assert open_journal().open_markers() == ()


def test_one_record_one_first_backup_and_one_undo_for_both_spellings(served, capsys):
    simulator, by_number, by_name = served
    before = simulator.machine.tools.get(1)
    assert run(capsys, "-c", by_number, "tool", "set", "1", "--x", "13", "--yes")[0] == 0
    (backup,) = first_backup_path("x").parent.iterdir()
    assert run(capsys, "-c", by_name, "tool", "set", "1", "--x", "14", "--yes")[0] == 0
    assert list(backup.parent.iterdir()) == [backup]
    kinds = {}
    for url in (by_number, by_name):
        code, out, _ = run(capsys, "journal", "list", "-c", url, "--json")
        assert code == 0
        kinds[url] = [entry["number"] for entry in json.loads(out)["entries"]]
    assert kinds[by_number] == kinds[by_name]
    assert len(kinds[by_number]) > 6
    assert run(capsys, "-c", by_number, "undo", "--tool", "1", "--yes")[0] == 0
    assert simulator.machine.tools.get(1) == replace(before, x_mm=13)


def test_doctor_names_an_address_at_which_what_is_open_can_be_settled(served, capsys):
    _, url, _ = served
    assert run(capsys, "-c", url, "status")[0] == 0
    log = open_journal().log(url)
    log.begin(Marker("a", MarkerKind.MOVE, "Move XY(1,2)", "then", {"target": [1, 2]}))
    log.close()
    _, out, err = run(capsys, "doctor")
    assert f'robolink -c "{url}" recover' in out + err


def test_an_address_that_was_never_met_is_told_from_an_empty_record(served, capsys):
    code, out, _ = run(capsys, "-c", served[1], "tool", "set", "1", "--x", "13", "--yes")
    assert code == 0
    code, out, _ = run(capsys, "journal", "list", "-c", "epson+tcp://10.9.9.9:5000")
    assert code == 0
    assert "by the addresses at which it was met" in out
