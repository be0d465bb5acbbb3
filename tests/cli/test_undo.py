"""undo on the command line: the table, the question, the write, the document."""

import json

import pytest
from robolink_cli import main
from robolink_cli.prompts import questions as consent

from robolink.journal import open_journal
from robolink.model import EntryKind, ToolOffset

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
    assert f"what entry {number} of" in out


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
    monkeypatch.setattr("robolink_cli.commands.record.undo.on_terminal", lambda: True)
    monkeypatch.setattr(consent, "on_terminal", lambda: True)

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
    assert "its tools were saved in" in err


MISTAKES = {
    "no change": ([], "No finished change"),
    "an unknown change": (["abcd"], "No entry and no change"),
    "both": (["abcd", "--to", "1"], "not both"),
    "no proof": (["--to", "1"], "does not say what was read"),
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
