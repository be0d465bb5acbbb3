"""A journal on a network share is refused before it is opened; status and stop still work."""

import pytest
from robolink_cli.commands.computer.checkup import Level, check_journal

from robolink.errors import JournalError
from robolink.journal import _places, move_journal, open_journal
from robolink.journal._connections import close_files


@pytest.fixture
def share(tmp_path, monkeypatch):
    """A folder that the mount table lists as a network share."""
    folder = tmp_path / "share"
    folder.mkdir()
    table = tmp_path / "mountinfo"
    table.write_text(
        "27 1 254:0 / / rw,relatime - ext4 /dev/vda rw\n"
        f"90 27 0:50 / {folder} rw,relatime - nfs4 plant:/cells rw,vers=4.2\n"
    )
    monkeypatch.setattr(_places, "MOUNT_TABLE", table)
    yield folder
    close_files()


def test_a_journal_on_a_share_is_refused_before_anything_is_made(share, tmp_path):
    for read_only in (False, True):
        with pytest.raises(JournalError, match="nfs4") as caught:
            open_journal(str(share / "5" / "journal.db"), read_only=read_only)
        assert "PostgreSQL" in caught.value.remedy
    assert not list(share.iterdir())
    (tmp_path / "short").symlink_to(share)
    with pytest.raises(JournalError, match="nfs4"):
        open_journal(str(tmp_path / "short" / "journal.db"))
    assert open_journal(str(tmp_path / "journal.db")).durable
    with pytest.raises(JournalError, match="nfs4"):
        move_journal(str(share / "new.db"), source=str(tmp_path / "journal.db"))
    assert not list(share.iterdir())


def test_where_the_mounts_cannot_be_read_nothing_is_refused(share, monkeypatch, tmp_path):
    monkeypatch.setattr(_places, "MOUNT_TABLE", tmp_path / "none")
    assert open_journal(str(share / "journal.db")).durable


def test_commands_that_change_something_end_with_2_and_those_that_look_say_so(
    share, run, simulator, monkeypatch
):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(share / "journal.db"))
    code, _, err = run("status")
    assert code == 0
    assert "network share (nfs4)" in err
    stored = simulator.machine.tools.defined()
    writes = simulator.machine.flash_writes
    code, _, err = run("tool", "set", "1", "--x", "13", "--yes")
    assert code == 2
    assert "network share (nfs4)" in err
    assert "ROBOLINK_JOURNAL" in err
    assert (simulator.machine.tools.defined(), simulator.machine.flash_writes) == (stored, writes)
    assert run("journal", "list")[0] == 2
    assert run("stop")[0] == 0
    (found,) = check_journal()
    assert (found.level, "network share" in found.what) == (Level.BAD, True)
    assert not list(share.iterdir())
