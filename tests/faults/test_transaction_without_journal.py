"""A journal that cannot be written: the controller is not touched, and the error says what to do.

The real command line against a served simulator (F61, F62, F63).
"""

import os
import shutil
import sqlite3
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest
from robolink_cli.console.exit_codes import USAGE

from robolink.errors import JournalError
from robolink.journal import open_journal
from robolink.journal.store import connection
from robolink.model import EntryKind, NewEntry
from tests.faults._nozzle_cell import OLD_TIP, NozzleCell, served_cell
from tests.faults._requests import changes

NOBODY = 65534


@contextmanager
def full_disk(path, monkeypatch):
    """Limit the file to its present pages, as a full disk would."""
    prepare = connection._prepare

    def prepared(connection):
        prepare(connection)
        connection.execute("PRAGMA max_page_count = 1")  # SQLite takes what it has got already

    open_journal(str(path)).close()
    monkeypatch.setattr(connection, "_prepare", prepared)
    log = open_journal(str(path)).log("somebody else")
    with pytest.raises(JournalError, match="disk is full"):
        for _ in range(1000):
            log.append(NewEntry(EntryKind.RAW))
    yield


@contextmanager
def read_only(path, monkeypatch):
    """Give the file to another user, who alone may write it."""
    path.chmod(0o444)
    path.parent.chmod(0o555)
    root = os.geteuid() == 0
    if root:
        os.seteuid(NOBODY)  # permissions do not count for root
    try:
        yield
    finally:
        if root:
            os.seteuid(0)
        path.parent.chmod(0o755)


@contextmanager
def corrupt(path, monkeypatch):
    """Overwrite most of the first two pages."""
    content = bytearray(path.read_bytes())
    content[100:8192] = b"\xff" * 8092
    path.write_bytes(content)
    yield


@contextmanager
def newer(path, monkeypatch):
    """Mark the file as written by a newer robolink."""
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE schema_version SET version = version + 1")
    connection.close()
    yield


@contextmanager
def locked(path, monkeypatch):
    """Let another program write for a long time."""
    monkeypatch.setattr(connection, "BUSY_S", 0.1)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    try:
        yield
    finally:
        other.close()


BROKEN = {
    full_disk: ("the disk is full", "Free space there, then repeat the command."),
    read_only: ("this user may not write", "Make file and folder writable"),
    corrupt: ("it is damaged", "Save it with 'robolink journal export --read-only'"),
    newer: ("is newer: form ", "Install the newer robolink"),
    locked: ("another program keeps it locked", "Wait until it has finished, or end it"),
}


@pytest.fixture
def folder():
    """A folder that every user may read."""
    folder = Path(tempfile.mkdtemp(prefix="robolink-transaction-"))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


@pytest.fixture
def cell(folder, monkeypatch):
    """A cell that was written to before, with a journal in its own folder."""
    with served_cell(folder / "cell", monkeypatch) as cell:
        (folder / "journal").mkdir()
        monkeypatch.setenv("ROBOLINK_JOURNAL", str(folder / "journal" / "journal.db"))
        first = cell.run("tool", "set", "2", "--x", "1", "--yes")
        assert first.code == 0, first.err
        open_journal().close()
        yield cell


COMMANDS = {
    "tool set": lambda cell: ["tool", "set", "1", "--x", "12.5", "--yes"],
    "calibrate": lambda cell: cell.calibration,
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    "broken",
    [
        pytest.param(full_disk, marks=pytest.mark.fault("F61")),
        read_only,
        pytest.param(corrupt, marks=pytest.mark.fault("F62")),
        pytest.param(newer, marks=pytest.mark.fault("F62")),
        pytest.param(locked, marks=pytest.mark.fault("F63")),
    ],
    ids=lambda broken: broken.__name__,
)
def test_without_a_journal_nothing_is_changed(cell: NozzleCell, monkeypatch, broken, command):
    cause, remedy = BROKEN[broken]
    path = Path(os.environ["ROBOLINK_JOURNAL"])
    asked = len(cell.requests)
    with broken(path, monkeypatch):
        refused = cell.run(*COMMANDS[command](cell))
    assert refused.code == USAGE
    assert cause in refused.err
    assert remedy in refused.err
    assert str(path) in refused.err
    assert changes(cell.requests[asked:]) == []
    assert cell.tool_1 == OLD_TIP
    assert cell.selected_tool == 1
