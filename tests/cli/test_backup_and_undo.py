"""backup, restore, compare and undo on the command line."""

import json
from itertools import count

import pytest
from robolink_cli import main
from robolink_cli.prompts import questions
from robolink_cli.prompts import questions as consent
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.backup import load
from robolink.errors import DeclinedError
from robolink.journal import open_journal
from robolink.model import EntryKind, ToolOffset

# backup, restore and compare on the command line, and the backup made by itself.

_numbers = count()


def test_a_backup_says_what_it_saved_and_of_which_robot(run, tmp_path):
    code, out, _ = run("backup", "cell.json")
    assert code == 0
    assert "robot T6-602S, serial SIM00001" in out
    assert "1 of 15 tools are defined." in out
    assert "Tool 1 is selected." in out
    assert load(tmp_path / "cell.json").state.selected == 1


def test_a_backup_as_a_document(run):
    code, out, _ = run("backup", "cell.json", "--json")
    document = json.loads(out)
    assert (code, document["schema"]) == (0, "robolink/backup-saved/1")
    assert document["facts"]["robot_serials"] == ["SIM00001"]
    assert document["tools"]["2"] is None


def test_a_file_is_written_over_only_with_force(run, simulator, golden, tmp_path):
    simulator.machine.tools.set(2, ToolOffset(5))
    sent = simulator.exchanges
    code, _, err = run("backup", golden)
    assert (code, simulator.exchanges) == (2, sent)
    assert "exists already" in err
    assert run("backup", golden, "--force")[0] == 0
    assert load(tmp_path / golden).state.tools[2] == ToolOffset(5)


def test_compare_answers_0_when_equal_and_1_when_not(run, simulator, golden):
    code, out, _ = run("compare", golden)
    assert (code, out.startswith("Equal")) == (0, True)
    simulator.machine.tools.set(1, ToolOffset(12.1, -3.5, -20))
    simulator.machine.tools.set(9, ToolOffset(1))
    code, out, _ = run("compare", golden)
    assert code == 1
    assert [line.split() for line in out.splitlines() if "X mm" in line] == [
        ["1", "X", "mm", "12.000", "12.100", "+0.100", "0.0005", "<"]
    ]
    assert "undefined" in out
    assert "Different tools: 1, 9." in out


def test_a_tolerance_lets_small_differences_pass(run, simulator, golden):
    simulator.machine.tools.set(1, ToolOffset(12.1, -3.5, -20, 0.3))
    assert run("compare", golden, "--tolerance", "0.2")[0] == 1
    assert run("compare", golden, "--tolerance", "0.2", "--tolerance-deg", "0.5")[0] == 0


def test_compare_as_a_document(run, simulator, golden):
    simulator.machine.tools.set(1, ToolOffset(12.1, -3.5, -20))
    simulator.machine.tools.select(0)
    code, out, _ = run("compare", golden, "--json")
    document = json.loads(out)
    assert (code, document["schema"], document["equal"]) == (1, "robolink/compare/1", False)
    (tool,) = document["differing"]
    assert (tool["tool"], tool["found"]["x_mm"]) == (1, 12.1)
    assert [part["name"] for part in tool["components"] if not part["equal"]] == ["x_mm"]
    assert document["selected_tool"] == {
        "expected": 1,
        "found": 0,
        "equal": False,
        "counts": True,
    }


def test_another_tool_in_force_is_shown_and_may_be_ignored(run, simulator, golden):
    simulator.machine.tools.select(0)
    code, out, _ = run("compare", golden)
    assert code == 1
    assert "selected tool: 1 in the file, 0 on the controller" in out
    code, out, _ = run("compare", golden, "--ignore-selected")
    assert code == 0
    assert "selected tool: 1 in the file, 0 on the controller" in out


def test_one_golden_file_is_compared_with_many_cells(golden, capsys):
    codes = []
    for seed in (1, 2):
        other = EpsonSimulator(seed=seed)
        name = f"backup-{next(_numbers)}"
        url = register(name, other)
        if seed == 2:
            other.machine.tools.select(0)
            other.machine.tools.clear(1)
        codes.append(main.run(["compare", golden, "-c", url]))
        unregister(name)
    assert codes == [0, 1]


def test_a_file_that_is_wrong_is_refused_before_anything_is_sent(run, simulator, golden, tmp_path):
    (tmp_path / golden).write_text((tmp_path / golden).read_text().replace('"7"', '"77"'))
    sent = simulator.exchanges
    for command in ("compare", "restore"):
        code, _, err = run(command, golden)
        assert (code, simulator.exchanges) == (2, sent)
        assert "tools.77" in err


def test_a_restore_writes_what_differs_and_backs_up_first(run, simulator, golden, state_folder):
    simulator.machine.tools.set(1, ToolOffset(99))
    simulator.machine.tools.set(3, ToolOffset(5))
    code, out, err = run("restore", golden)
    assert code == 0
    assert "Tools restored and read back: 1, 3." in out
    (saved,) = (state_folder / "backups").iterdir()
    assert str(saved) in err
    assert load(saved).state.tools[1] == ToolOffset(99)
    assert run("compare", golden)[0] == 0
    written = simulator.machine.flash_writes
    code, out, err = run("restore", golden)
    assert (code, "already" in out, "saved in" in err) == (0, True, False)
    assert simulator.machine.flash_writes == written


def test_a_dry_run_shows_the_requests_and_writes_nothing(run, simulator, golden, state_folder):
    simulator.machine.tools.set(1, ToolOffset(99))
    simulator.machine.tools.set(3, ToolOffset(5))
    simulator.machine.tools.select(0)
    written = simulator.machine.flash_writes
    code, out, _ = run("restore", golden, "--selected", "--dry-run")
    assert code == 0
    assert out.splitlines() == [
        '$Execute,"TLSet 1, XY(12.000, -3.500, -20.000, 0.000)"',
        '$Execute,"Tool 1"',
        '$Execute,"TLClr 3"',
    ]
    assert simulator.machine.flash_writes == written
    assert not (state_folder / "backups").exists()


def test_only_named_tools_and_the_selection_are_restored_when_asked(run, simulator, golden):
    simulator.machine.tools.set(1, ToolOffset(99))
    simulator.machine.tools.set(3, ToolOffset(5))
    simulator.machine.tools.select(3)
    code, out, _ = run("restore", golden, "--tool", "1", "--json")
    document = json.loads(out)
    assert (code, document["schema"], document["selected_tool"]) == (0, "robolink/restore/1", 3)
    assert [receipt["tool"] for receipt in document["restored"]] == [1]
    code, _, err = run("restore", golden)
    assert code == 5
    assert "Tool 3 is selected" in err
    assert run("restore", golden, "--selected")[0] == 0
    assert simulator.machine.tools.selected == 1
    assert simulator.machine.tools.get(3) is None


@pytest.mark.parametrize("tool", ["0", "16"])
def test_a_tool_that_cannot_be_restored_is_a_mistake_in_the_command(run, golden, tool):
    assert run("restore", golden, "--tool", tool)[0] == 2


def test_another_controller_is_refused_unless_told(run, simulator, golden):
    simulator.machine.serial = "SIM00002"
    simulator.machine.tools.set(1, ToolOffset(99))
    code, _, err = run("restore", golden)
    assert code == 2
    assert "C-SIM00001 in the backup, C-SIM00002 here" in err
    assert simulator.machine.tools.get(1) == ToolOffset(99)
    assert run("restore", golden, "--other-controller")[0] == 0
    assert simulator.machine.tools.get(1).x_mm == 12


@pytest.mark.parametrize(
    "command",
    [["tool", "set", "2", "--x", "1"], ["tool", "clear", "1"], ["restore", "golden.json"]],
)
def test_no_write_is_made_when_the_first_backup_cannot_be_stored(
    run, simulator, golden, tmp_path, monkeypatch, command
):
    simulator.machine.tools.set(3, ToolOffset(5))
    simulator.machine.tools.select(0)
    (tmp_path / "state").mkdir(exist_ok=True)
    (tmp_path / "state" / "backups").write_text("in the way")
    written = simulator.machine.flash_writes
    code, _, err = run(*command)
    assert code == 2
    assert "cannot back up" in err
    assert simulator.machine.flash_writes == written


CALIBRATIONS = {
    # Nobody can be asked here, so the first one ends before anything moves.
    9: ["calibrate", "two-pose", "--tool", "1"],
    0: [
        *("calibrate", "two-pose", "--tool", "1", "--yes"),
        *("--pose", "288.1,103.5,0", "--pose", "311.9,96.5,180"),
    ],
}


@pytest.mark.parametrize("code", CALIBRATIONS)
def test_a_calibration_saves_the_tools_before_it_goes_on(run, simulator, state_folder, code):
    before = simulator.machine.tools.get(1)
    assert run(*CALIBRATIONS[code])[0] == code
    (saved,) = (state_folder / "backups").iterdir()
    assert load(saved).state.tools[1] == before
    assert (simulator.machine.tools.get(1) == before) is (code != 0)


def test_a_person_who_says_no_leaves_everything_as_it_was(run, simulator, golden, monkeypatch):
    def say_no(question):
        raise DeclinedError(question)

    monkeypatch.setattr(questions, "person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.stopping.notes.person_here", lambda: True)
    monkeypatch.setattr(questions, "require_yes", say_no)
    simulator.machine.tools.set(1, ToolOffset(99))
    code, out, err = run("restore", golden)
    assert (code, "99.000" in out, "Write these values" in err) == (9, True, True)
    assert simulator.machine.tools.get(1) == ToolOffset(99)


def test_the_first_write_says_where_the_tools_were_saved(run, simulator, state_folder):
    code, _, err = run("tool", "set", "2", "--x", "1")
    (saved,) = (state_folder / "backups").iterdir()
    assert (code, str(saved) in err) == (0, True)
    assert load(saved).state.tools[2] is None
    code, _, err = run("tool", "clear", "2")
    assert (code, "saved in" in err) == (0, False)


# undo on the command line: the table, the question, the write, the document.

OLD = ToolOffset(12.0, -3.5, -20.0)
NEW = ToolOffset(12.5, -3.0, -20.0)
SET = ("tool", "set", "1", "--x", "12.5", "--y", "-3", "--yes")


@pytest.fixture
def changed(run):
    """The id of a change of tool 1."""
    assert run(*SET)[0] == 0
    return next(open_journal().entries(kinds=[EntryKind.DONE])).change


def tool_1(simulator):
    return simulator.machine.tools.get(1)


def test_the_newest_change_is_undone_and_the_end_says_how_that_is_taken_back(
    run, simulator, changed
):
    code, out, _ = run("undo", "--yes")
    assert (code, tool_1(simulator)) == (0, OLD)
    assert f"undo the change {changed[:8]} of tool 1" in out
    shown = " ".join(out.split())
    assert "before 12.500 -3.000 -20.000" in shown
    assert "restored 12.000 -3.500 -20.000" in shown
    assert "change -0.500 -0.500 0.000" in shown
    again = out.rpartition(" undo ")[2][:8]
    assert run("undo", again, "--yes")[0] == 0
    assert tool_1(simulator) == NEW


def test_an_undo_as_a_document(run, simulator, changed):
    code, out, _ = run("undo", changed[:4], "--yes", "--json")
    document = json.loads(out)
    assert (code, document["schema"]) == (0, "robolink/undo/1")
    assert document["undone_change"] == changed
    (receipt,) = document["restored"]
    assert receipt["before"]["x_mm"] == 12.5
    assert receipt["read_back"]["x_mm"] == 12.0
    newest = next(open_journal().entries(kinds=[EntryKind.DONE]))
    assert document["change"] == newest.change


def test_a_change_may_be_named_by_the_number_of_an_entry(run, simulator, changed):
    number = next(open_journal().entries(kinds=[EntryKind.WRITE])).number
    assert run("undo", str(number), "--yes")[0] == 0
    assert tool_1(simulator) == OLD


def test_any_proved_value_comes_back_by_its_number(run, simulator, changed):
    number = next(open_journal().entries(kinds=[EntryKind.READ_BACK])).number
    assert run("tool", "set", "1", "--x", "13", "--yes")[0] == 0
    code, out, _ = run("undo", "--to", str(number), "--yes")
    assert (code, tool_1(simulator)) == (0, NEW)
    assert f"confirmed by entry {number} of" in out


def test_a_dry_run_shows_the_table_and_the_requests_and_sends_none(run, simulator, changed):
    written, entries = simulator.machine.flash_writes, open_journal().count()
    code, out, _ = run("undo", "--dry-run")
    assert code == 0
    assert "restored" in out
    assert '$Execute,"TLSet 1, XY(12.000, -3.500, -20.000, 0.000)"' in out
    code, out, _ = run("undo", "--dry-run", "--json")
    assert json.loads(out)["schema"] == "robolink/dry-run/1"
    assert (simulator.machine.flash_writes, open_journal().count()) == (written, entries)


@pytest.mark.parametrize("more", [[], ["--json"]])
def test_off_a_terminal_it_takes_yes(run, simulator, changed, more):
    code, _, _ = run("undo", *more)
    assert (code, tool_1(simulator)) == (9, NEW)


@pytest.mark.parametrize(("answer", "expected"), [(True, (0, OLD)), (False, (9, NEW))])
def test_on_a_terminal_it_asks(run, simulator, changed, monkeypatch, answer, expected):
    questions = []
    monkeypatch.setattr("robolink_cli.commands.record.undo.person_here", lambda: True)
    monkeypatch.setattr(consent, "person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.stopping.notes.person_here", lambda: True)

    def asked(question):
        questions.append(question)
        return answer

    monkeypatch.setattr(consent, "asked", asked)
    code, _, _ = run("undo")
    assert (code, tool_1(simulator)) == expected
    assert questions == ["Write the old values back?"]


def test_a_value_that_somebody_else_wrote_stays(run, simulator, changed):
    simulator.machine.tools.set(1, ToolOffset(9.0))
    code, _, err = run("undo", "--yes")
    assert (code, tool_1(simulator)) == (5, ToolOffset(9.0))
    assert "it was left with X 12.500 Y -3.000" in err
    assert "TLSet" in err


def test_what_is_undone_already_is_not_written_again(run, simulator, changed):
    simulator.machine.tools.set(1, OLD)
    written = simulator.machine.flash_writes
    code, out, _ = run("undo")
    assert (code, simulator.machine.flash_writes) == (0, written)
    assert "Nothing was written." in out


def test_a_fresh_controller_is_backed_up_before_the_first_write(run, simulator, state_folder):
    with open_journal().log(simulator.url).hold("test"):
        pass
    assert run(*SET)[0] == 0
    for path in (state_folder / "backups").iterdir():
        path.unlink()
    code, _, err = run("undo", "--yes")
    assert code == 0
    assert "robolink saved its tools in" in err


MISTAKES = {
    "no change": ([], "No finished change"),
    "an unknown change": (["abcd"], "No entry and no change"),
    "both": (["abcd", "--to", "1"], "not both"),
    "no proof": (["--to", "1"], "has no value read"),
    "number 0": (["--to", "0"], "--to"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_sends_nothing(run, simulator, name):
    arguments, words = MISTAKES[name]
    code, out, err = run("undo", *arguments, "--yes")
    assert (code, out) == (2, "")
    assert words in err
    assert simulator.machine.flash_writes == 0


def test_an_operator_by_the_cell_file_is_refused(simulator, changed, capsys, tmp_path, monkeypatch):
    (tmp_path / "robolink.toml").write_text(
        f'[cells.five]\nurl = "{simulator.url}"\n'
        'people = { Ann = "engineer", Bob = "operator" }\n',
        encoding="utf-8",
    )
    assert main.run(["-c", "five", "--operator", "Bob", "undo", "--yes"]) == 9
    assert "Ask an engineer" in capsys.readouterr().err
    assert tool_1(simulator) == NEW
    assert main.run(["-c", "five", "--operator", "Ann", "undo", "--yes"]) == 0
    assert tool_1(simulator) == OLD
