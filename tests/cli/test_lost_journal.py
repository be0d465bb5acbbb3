"""A journal that was emptied, deleted, replaced or bent is not "nothing is unsettled"."""

import sqlite3

import pytest

from robolink.errors import JournalError
from robolink.journal import open_journal
from robolink.journal._opening import _closed, _opened, close_files


def forget_connections():
    """Begin as a new process does."""
    close_files()
    _opened.clear()
    _closed.clear()


def delete(path):
    for file in path.parent.glob("journal.db*"):
        file.unlink()


def empty(path):
    with sqlite3.connect(path) as connection:
        for table in ("entries", "markers", "leases", "addresses", "former_names"):
            connection.execute(f"DELETE FROM {table}")
        connection.execute("UPDATE head SET number = 0, hash = ''")
    connection.close()


@pytest.fixture
def changed(run, simulator, state_folder):
    """A controller that was changed once; returns the path of the journal."""
    assert run("tool", "set", "1", "--x", "13", "--yes")[0] == 0
    simulator.machine.tools.select(0)  # as a killed calibration leaves it
    forget_connections()
    return state_folder / "journal.db"


@pytest.mark.parametrize("lose", [delete, empty])
def test_a_journal_without_history_of_a_known_controller_blocks_until_a_person_looked(
    run, changed, simulator, lose
):
    lose(changed)
    code, _, err = run("status")
    assert code == 0
    assert "knows nothing of it" in err
    stood = simulator.machine.tip()
    assert run("jog", "x+1", "--yes")[0] == 6
    assert run("tool", "set", "1", "--x", "14", "--yes")[0] == 6
    assert simulator.machine.tip() == stood
    code, out, err = run("recover")
    assert code == 6
    assert "Nothing is left unfinished" not in out + err
    assert "Tool 0 is selected" in out + err
    assert "robolink tool compare" in out + err
    # It is not said to be settled by having been asked for.
    assert run("recover")[0] == 6
    assert run("resolve", "--yes")[0] == 0
    code, out, err = run("recover")
    assert "Nothing is left unfinished" in out + err
    assert "knows nothing" not in run("status")[2]


@pytest.mark.parametrize("gone", ["backups", "controllers"])
def test_either_sign_is_enough(run, changed, gone, state_folder):
    delete(changed)
    (file,) = (state_folder / gone).iterdir()
    file.unlink()
    assert "knows nothing of it" in run("status")[2]


def test_another_place_is_named(run, changed, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(tmp_path / "elsewhere.db"))
    err = run("status")[2]
    assert f"Its record was kept in sqlite:///{changed}" in err


def test_a_controller_that_was_never_changed_is_just_new(run, changed):
    assert "knows nothing" not in run("status")[2]


def test_a_write_that_changed_nothing_loses_no_record(run, simulator):
    same = str(simulator.machine.tools.get(1).x_mm)
    assert run("tool", "set", "1", "--x", same, "--yes")[0] == 0
    assert "knows nothing" not in run("status")[2]


def bend(path, old, new):
    """Change bytes of the file, as a disk does; SQLite does not notice."""
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))


BENT = {
    "a value of the newest entry": lambda path: bend(path, b"13.0", b"18.0"),
    "the end": lambda path: _sql(path, "DELETE FROM entries WHERE number > 3"),
    "the head": lambda path: _sql(path, "UPDATE head SET hash = 'x'"),
}


def _sql(path, *statements):
    with sqlite3.connect(path) as connection:
        for statement in statements:
            connection.execute(statement)
    connection.close()


@pytest.mark.parametrize("how", BENT)
@pytest.mark.fault("F62")
def test_what_was_bent_is_noticed_before_a_write_and_keeps_nobody_from_looking(
    run, changed, simulator, how
):
    simulator.machine.tools.select(1)
    BENT[how](changed)
    assert run("status")[0] == 0
    before = simulator.machine.tools.get(1)
    code, _, err = run("tool", "set", "1", "--x", "15", "--yes")
    assert code == 2
    assert "it is damaged (" in err
    assert simulator.machine.tools.get(1) == before
    assert run("journal", "verify")[0] == 1


@pytest.mark.fault("F62")
def test_a_bent_page_of_the_markers_is_noticed(run, changed, simulator):
    simulator.machine.tools.select(1)
    connection = sqlite3.connect(changed)
    (page,) = connection.execute(
        "SELECT rootpage FROM sqlite_schema WHERE name='markers'"
    ).fetchone()
    (size,) = connection.execute("PRAGMA page_size").fetchone()
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    content = bytearray(changed.read_bytes())
    # The number of cells of the page.
    content[(page - 1) * size + 3 : (page - 1) * size + 5] = b"\x00\x07"
    changed.write_bytes(content)
    code, _, err = run("tool", "set", "1", "--x", "15", "--yes")
    assert code == 2
    assert "it is damaged" in err
    with pytest.raises(JournalError):
        open_journal().log("anybody").look()
