"""journal move: what a person reads, and that a cell goes on with the journal that was moved."""

import json

import pytest
from robolink_cli import main
from robolink_cli.commands.computer.checkup import Level, check_journal
from robolink_cli.commands.record.journal_move import _show_end

from robolink.journal import JournalMove, name_journals, open_journal
from robolink.journal._connections import _closed, _opened, close_files
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry

ORDER = ("tool", "set", "1", "--x", "13", "--yes", "--order", "J-1007")


def next_process():
    close_files()
    _opened.clear()
    _closed.clear()


@pytest.fixture
def plain(capsys):
    """Run a command without naming a controller; return the exit code and the output."""

    def ran(*arguments):
        capsys.readouterr()
        code = main.run(arguments)
        return code, *capsys.readouterr()

    return ran


@pytest.fixture
def changed(run, simulator, state_folder):
    """A controller that was changed by an order; returns the path of the journal."""
    assert run("tool", "backup", "golden.json")[0] == 0
    assert run(*ORDER)[0] == 0
    next_process()
    return state_folder / "journal.db"


def test_a_cell_goes_on_with_the_journal_that_was_moved(
    run, plain, changed, simulator, tmp_path, monkeypatch
):
    code, out, _ = run("--json", "journal", "verify")
    whole, new = json.loads(out), tmp_path / "new.db"
    code, out, _ = plain("journal", "move", str(new), "--dry-run")
    assert (code, new.exists()) == (0, False)
    assert f"entries that would be moved: {whole['entry_count']}" in out
    assert "epson:" in out
    code, out, _ = plain("--json", "journal", "move", str(new))
    said = json.loads(out)
    assert (code, said["moved"], said["controller"], said["hindrances"]) == (0, True, None, [])
    assert said["source"] == f"sqlite:///{changed}"
    assert (said["last_number"], said["last_hash"]) == (whole["last_number"], whole["last_hash"])
    # The old journal: looking goes on, and says where the record is; nothing is written.
    writes = simulator.machine.flash_writes
    code, out, err = run("status")
    assert code == 0
    assert f"was moved to {new}" in " ".join(err.split())
    code, _, err = run("tool", "set", "1", "--x", "14", "--yes")
    assert code == 2
    assert f"Name {new} in ROBOLINK_JOURNAL" in " ".join(err.split())
    assert run("recover")[0] == 2
    assert simulator.machine.flash_writes == writes
    assert run("journal", "list")[0] == 0
    (found,) = check_journal()
    assert (found.level, f"was moved to {new}" in found.what) == (Level.BAD, True)
    # The new one: nobody asks for `recover`, and what was ordered before is not done again.
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(new))
    next_process()
    code, out, err = run("status")
    assert "moved" not in out + err
    assert "No job is left unfinished" in "".join(run("recover")[1:])
    assert run(*ORDER)[0] == 0
    assert simulator.machine.flash_writes == writes
    assert run("undo", "--yes")[0] == 0
    assert simulator.machine.flash_writes == writes + 1
    assert run("tool", "compare", "golden.json")[0] == 0
    assert run("journal", "verify")[0] == 0


def test_what_is_in_the_way_is_listed_and_ends_the_move(plain, changed, tmp_path):
    name = open_journal().log("line3")
    name.begin(Marker("a", MarkerKind.MOVE, "Go P1", "2026-01-01T00:00:00+00:00"))
    new = tmp_path / "new.db"
    code, out, _ = plain("journal", "move", str(new), "--dry-run")
    assert code == 1
    assert "A job on line3 is unfinished" in out
    assert "has locked line3 since" in out
    code, _, err = plain("journal", "move", str(new))
    assert code == 6
    assert "Go P1" in err
    assert not new.exists()


def test_one_controller_is_moved_out_of_a_journal_and_the_others_stay(
    run, changed, simulator, monkeypatch, tmp_path
):
    open_journal().log("line3").append(NewEntry(EntryKind.DECISION, verdict="stays"))
    own = tmp_path / "own.db"
    code, out, _ = run("journal", "move", str(own))
    assert (code, f"cell file: {own}" in out) == (0, True)
    next_process()
    code, _, err = run("tool", "set", "1", "--x", "14", "--yes")
    assert code == 2
    assert "The record of epson:" in err
    open_journal().log("line3").append(NewEntry(EntryKind.DECISION, verdict="goes on"))
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(own))
    assert "moved here from" in run("journal", "list", "--kind", "journal")[1]
    assert run(*ORDER)[0] == 0
    assert run("undo", "--yes")[0] == 0


def test_a_cell_that_the_environment_names_is_not_moved_alone(
    run, plain, changed, simulator, monkeypatch, tmp_path
):
    open_journal().log("line3").append(NewEntry(EntryKind.DECISION, verdict="comes along"))
    monkeypatch.setenv("ROBOLINK_CONTROLLER", simulator.url)
    new = str(tmp_path / "new.db")
    said = json.loads(run("--json", "journal", "move", new, "--dry-run")[1])
    assert said["controller"].startswith("epson:")
    code, out, _ = plain("--json", "journal", "move", new)
    said = json.loads(out)
    assert (code, said["controller"], len(said["controllers"])) == (0, None, 2)


def test_a_place_that_is_taken_is_refused(plain, changed, tmp_path):
    taken = str(tmp_path / "taken.db")
    open_journal(taken).log("x").append(NewEntry(EntryKind.RAW))
    for place, words in ((taken, "entries already"), (str(changed), "in force already")):
        code, _, err = plain("journal", "move", place)
        assert (code, words in err) == (2, True)


def test_the_line_of_a_cell_file_that_names_the_old_journal_is_named(
    plain, simulator, tmp_path, monkeypatch
):
    monkeypatch.delenv("ROBOLINK_STATE_DIR")
    for kind in ("data", "state"):
        monkeypatch.setattr(f"platformdirs.user_{kind}_path", lambda *_, **__: tmp_path / "own")
    cells = tmp_path / "robolink.toml"
    cells.write_text(f'[cells.line3]\nurl = "{simulator.url}"\njournal = "line3.db"\n')
    try:
        assert plain("-c", "line3", "tool", "set", "1", "--x", "13", "--yes")[0] == 0
        next_process()
        code, out, err = plain("-c", "line3", "journal", "move", "new.db")
        assert code == 0, err
        assert f"{cells}, line 3, still names the old one." in out
        next_process()
        code, _, err = plain("-c", "line3", "tool", "set", "1", "--x", "14", "--yes")
        assert (code, "was moved to" in err) == (2, True)
        cells.write_text(cells.read_text().replace("line3.db", "new.db"))
        next_process()
        assert plain("-c", "line3", "tool", "set", "1", "--x", "14", "--yes")[0] == 0
    finally:
        name_journals({}, afresh=True)


def test_the_password_of_the_old_place_is_not_printed(capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_JOURNAL", "postgresql://cells:geheim9@db.plant/journal")
    place = "postgresql+psycopg://cells:***@db.plant/journal"
    _show_end(JournalMove(place, "sqlite:////new.db", "", ("cell-a",), 1, 1, "ab"))
    out = " ".join(capsys.readouterr().out.split())
    assert "still names the old one: postgresql://cells:***@db.plant/journal" in out
    assert "geheim9" not in out
