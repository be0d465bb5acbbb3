"""Without -c the only cell is used and named; a controller is identified by its own data."""

import json
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.backup import first_backup_path
from robolink.journal import open_journal
from robolink.model import Marker, MarkerKind
from tests.cli.test_command_names import run_on_terminal
from tests.contract._terminal import Terminal
from tests.faults._requests import changes

# Without ``-c`` the only cell is used and named; nothing is guessed, written or moved unasked.

URL = "epson+sim://only-cell"


@pytest.fixture(autouse=True)
def own_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ROBOLINK_CONTROLLER", raising=False)
    monkeypatch.delenv("ROBOLINK_CONFIG", raising=False)
    for place in ("user", "site"):
        folder = tmp_path / place
        monkeypatch.setattr(
            f"platformdirs.{place}_config_path", lambda *a, folder=folder, **k: folder
        )


@pytest.fixture
def cells(tmp_path):
    def write(*names):
        cells = "".join(
            f'[cells.{name}]\nurl = "{URL}"\nremote_timeout_s = 30\n'
            "remote_timeout_confirmed_by = 'me'\n"
            for name in names
        )
        (tmp_path / "robolink.toml").write_text(cells)

    return write


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=3)
    simulator.machine.motors_on = True
    register("only-cell", simulator)
    yield simulator
    unregister("only-cell")


LOOKS = (["status"], ["robot", "where"], ["tool", "list"], ["robot", "jog", "x+1", "--dry-run"])


@pytest.mark.parametrize("words", LOOKS, ids=" ".join)
def test_what_only_looks_takes_the_only_cell_and_says_it_first(cells, simulator, words):
    cells("line3")
    code, shown = run_on_terminal(*words)
    assert (code, shown[0]) == (0, "cell: line3")


def test_json_stays_one_document(cells, simulator, capsys):
    cells("line3")
    assert main.run(["--json", "status"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["schema"] == "robolink/status/1"
    assert err.splitlines()[0] == "cell: line3"


CHANGES = (
    ["tool", "set", "1", "--x", "12"],
    ["tool", "select", "0"],
    ["robot", "jog", "x+1"],
    ["robot", "motors", "off"],
    ["undo"],
    ["calibrate", "two-pose", "--tool", "1"],
)


@pytest.mark.parametrize("yes", [[], ["--yes"]], ids=["", "yes"])
@pytest.mark.parametrize("words", CHANGES, ids=" ".join)
def test_what_changes_something_takes_no_cell_where_nobody_is_asked(
    cells, simulator, capsys, words, yes
):
    cells("line3")
    assert main.run([*words, *yes]) == 2
    shown = capsys.readouterr().err
    assert "uses the only cell, line3, only if it can ask you first" in shown
    assert "-c line3" in shown
    assert changes(simulator.log) == []


def test_yes_on_a_terminal_is_no_answer_either(cells, simulator, monkeypatch):
    monkeypatch.setattr("robolink_cli.session.context.may_be_guided", lambda: True)
    cells("line3")
    code, shown = run_on_terminal("tool", "select", "0", "--yes")
    assert code == 2
    assert "No cell is named" in shown[0]
    assert simulator.machine.tools.selected == 1


def test_a_person_sees_which_cell_before_the_question(tmp_path):
    simulator = EpsonSimulator(seed=3)
    with serve_tcp(simulator) as host:
        (tmp_path / "robolink.toml").write_text(f'[cells.line3]\nurl = "{host.url}"\n')
        terminal = Terminal("tool", "select", "0")
        try:
            shown = terminal.wait_for(r"(?s)^(.*)\[y or n\]")[1]
            assert shown.startswith("cell: line3\r\n")
            terminal.press(b"n\n")
            assert terminal.end() == 9
        finally:
            terminal.close()
    assert simulator.machine.tools.selected == 1


@pytest.mark.parametrize("words", [*LOOKS, *CHANGES, ["stop"], ["robot", "release"]], ids=" ".join)
def test_of_several_cells_none_is_taken_and_all_are_named(cells, simulator, capsys, words):
    cells("line3", "line4")
    assert main.run(words) == 2
    assert "No cell is named, and there are several: line3, line4." in capsys.readouterr().err
    assert list(simulator.log) == []


def test_a_stop_takes_the_only_cell_and_says_it_when_the_robot_stands(cells, simulator, capsys):
    cells("line3")
    assert main.run(["stop"]) == 0
    out, err = capsys.readouterr()
    assert "only-cell: the robot has stopped" in out
    assert err.splitlines()[0] == "cell: line3"
    assert main.run(["stop", "--dry-run"]) == 0
    assert "cell: line3" in capsys.readouterr().err


def test_without_any_cell_it_says_how_one_is_named(capsys):
    assert main.run(["status"]) == 2
    assert "No controller is named.\n  Give -c CELL" in capsys.readouterr().err


def test_a_wrong_cell_file_is_told_not_passed_over(tmp_path, capsys):
    (tmp_path / "robolink.toml").write_text('[cells.line3]\nurl = "epson+tcp://h"\nspeeed = 1\n')
    assert main.run(["tool", "list"]) == 2
    shown = capsys.readouterr().err
    assert "cell: line3" in shown
    assert "speeed" in shown


def test_what_means_something_without_a_controller_stays_so(cells, capsys):
    cells("line3")
    assert main.run(["cell", "show"]) == 0
    assert "cell: line3" not in capsys.readouterr().err


# The command line identifies a controller by its own data, not by its URL.


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
    assert "by the addresses used so far" in out
