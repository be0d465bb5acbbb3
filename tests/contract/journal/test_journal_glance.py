"""A glance opens the journal only if there is something to report."""

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.journal import close_files, default_location, nothing_is_open, open_journal
from robolink.journal._connections import _opened
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry


@pytest.fixture
def address(monkeypatch, tmp_path):
    """The address of a controller that was met before, with nothing open."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    with serve_tcp(EpsonSimulator(seed=3)) as host:
        with robolink.connect(host.url) as controller:
            assert controller.outcomes.open_markers() == ()
        yield host.url
    close_files()


def test_an_address_that_was_met_and_left_in_order_needs_no_journal(address):
    assert nothing_is_open(address)
    assert not nothing_is_open(address + "0")  # not met before, so it is asked for its identity


def test_a_marker_of_any_controller_opens_it(address):
    log = open_journal().log("another")
    log.begin(Marker("a", MarkerKind.MOVE, "Move", "2026-01-01T00:00:00+00:00"))
    assert not nothing_is_open(address)
    with robolink.connect(address, glance=True) as controller:
        assert controller.outcomes.open_markers() == ()  # it is not this controller's
        assert controller.outcomes.identity != "another"
    log.clear("a")
    assert nothing_is_open(address)


def test_somebody_at_work_opens_it(address):
    with open_journal().log("another").hold("a long change"):
        assert not nothing_is_open(address)
    assert nothing_is_open(address)


def test_what_is_unfinished_shows_at_a_glance(address):
    with robolink.connect(address) as controller:
        marker = controller.begin(MarkerKind.CHANGE, "tool 1", {"tool": 1})
    close_files()
    with robolink.connect(address, glance=True) as controller:
        assert [open_one.operation for open_one in controller.outcomes.open_markers()] == [
            marker.operation
        ]


@pytest.mark.parametrize("content", [b"", b"no database" * 100])
def test_a_file_that_tells_nothing_opens_the_journal(address, tmp_path, content):
    close_files()
    for file in tmp_path.glob("journal.db*"):
        file.unlink()
    assert not nothing_is_open(address)
    Path(default_location().removeprefix("sqlite:///")).write_bytes(content)
    assert not nothing_is_open(address)


def test_a_server_is_not_glanced_at(address, monkeypatch):
    monkeypatch.setenv("ROBOLINK_JOURNAL", "postgresql://nobody@127.0.0.1:1/none")
    assert not nothing_is_open(address)


def test_a_look_at_a_journal_in_order_leaves_the_file_as_it_is(address, tmp_path):
    close_files()
    path = tmp_path / "journal.db"
    before = path.read_bytes()
    with robolink.connect(address, glance=True) as controller:
        assert controller.outcomes.open_markers() == ()
        assert controller.outcomes.at_work() == ""
        assert controller.outcomes.trouble is None
        assert _opened == {}
        controller.outcomes.append(NewEntry(EntryKind.DECISION, verdict="kept"))
    assert path.read_bytes() == before  # the added entry is in the write-ahead log
    (entry,) = open_journal().entries(kinds=(EntryKind.DECISION,))
    assert entry.verdict == "kept"


def test_who_does_not_say_that_it_only_looks_has_the_journal_open_from_the_beginning(address):
    close_files()
    with robolink.connect(address):
        assert len(_opened) == 1


def test_what_others_are_writing_does_not_show_so_a_look_believes_nothing(
    address, tmp_path, monkeypatch
):
    """A journal that another process locks exclusively can be read only without its log."""
    for patience in ("BUSY_S", "GLANCE_S"):
        monkeypatch.setattr(f"robolink.journal.store.connection.{patience}", 0.02)
    close_files()
    holder = sqlite3.connect(tmp_path / "journal.db", isolation_level=None)
    with closing(holder):
        holder.execute("PRAGMA locking_mode = EXCLUSIVE")
        holder.execute("BEGIN EXCLUSIVE")
        holder.execute("UPDATE head SET number = number")
        assert open_journal(read_only=True).addresses_of("nobody") == ()
        assert not nothing_is_open(address)
    assert nothing_is_open(address)


HEAVY = "numpy pydantic pymodbus rich asyncio robolink.calibration robolink.calibration_run"

PROBE = """
import sys
from robolink_cli.main import run
assert run(["-c", sys.argv[1], "status"]) == 0
print(*sorted(set(sys.argv[2:]) & set(sys.modules)), sep=",", file=sys.stderr)
"""


def test_a_status_of_a_controller_in_order_loads_nothing_heavy(address, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", PROBE, address, *HEAVY.split()],
        check=True,
        capture_output=True,
        text=True,
        timeout=30,
        env={**os.environ, "ROBOLINK_STATE_DIR": str(tmp_path)},
    )
    assert "ready" in done.stdout
    assert done.stderr == "\n"
