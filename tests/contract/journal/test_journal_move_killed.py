"""A move that is killed: one journal is in force afterwards, never both, and it can be repeated."""

import os
import signal
from itertools import count

import pytest

from robolink.errors import JournalError
from robolink.files import durable
from robolink.journal import _journal_loss, close_files, move_journal, open_journal
from robolink.journal._connections import _closed, _opened
from robolink.journal.store.connection import DatabaseConnection
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import marker

CELL, OTHER = "cell-a", "cell-b"

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a move is killed in a fork")


def filled(place):
    """Make a journal that two controllers used."""
    for cell in (CELL, OTHER):
        log = open_journal(place).log(cell)
        log.begin(marker())
        log.clear("a", NewEntry(EntryKind.DONE, tool=3, details={"value": [1]}))
    anew()


def anew():
    """Forget every connection, as the next process does."""
    close_files()
    _opened.clear()
    _closed.clear()


def killed_at(step, names, source, target, controller):
    """Move in a fork that is killed before its act of that number; return whether it ended."""
    child = os.fork()
    if child == 0:
        left = step

        def counted(act):
            def acted(*arguments, **options):
                nonlocal left
                left -= 1
                if left == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
                return act(*arguments, **options)

            return acted

        for name in names:
            setattr(DatabaseConnection, name, counted(getattr(DatabaseConnection, name)))
        vars(_journal_loss)["write_whole"] = counted(durable.write_whole)
        try:
            move_journal(target, source=source, controller=controller)
            os._exit(0)
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0
    return os.WIFEXITED(status)


def writes(place, verdict):
    """Let a new process record something about the cell, and return whether that was stored."""
    anew()
    try:
        open_journal(place).log(CELL).append(NewEntry(EntryKind.DECISION, verdict=verdict))
    except JournalError as error:
        refused = str(error)
    else:
        return True
    assert "moved" in refused or "move of" in refused
    return False


def verdicts(place):
    anew()
    journal = open_journal(place, read_only=True)
    assert journal.verify().problems == ()
    return [entry.verdict for entry in journal.entries(controller=CELL, kinds=[EntryKind.DECISION])]


def check_killed(step, names, source, target, controller):
    """Kill a move at a step; check what is in force then, and that it can be repeated."""
    filled(source)
    ended = killed_at(step, names, source, target, controller)
    new_first = step % 2 == 0
    stored = {}
    for place in (target, source) if new_first else (source, target):
        exists = "://" in place or os.path.exists(place)
        # A new journal that holds nothing yet is no record: nobody names it before the move ended.
        anew()
        if place == target and not (exists and is_filled(place)):
            stored[place] = False
        else:
            stored[place] = writes(place, place)
    assert sorted(stored.values()) == [False, True], (step, stored)
    in_force = next(place for place, took in stored.items() if took)
    assert verdicts(in_force) == [in_force]
    anew()
    moved = move_journal(target, source=source, controller=controller)
    assert moved.target == open_journal(target).location
    # What was recorded after the kill came along, or was there already.
    assert verdicts(target) == [in_force]
    assert not writes(source, "late")
    assert writes(target, "next")
    # Reading needs no `recover`: nothing is lost and nothing is open.
    assert open_journal(target).log(CELL).open_markers() == ()
    if controller:
        assert open_journal(source).log(OTHER).open_markers() == ()
        open_journal(source).log(OTHER).append(NewEntry(EntryKind.DECISION))
    return ended, in_force


def is_filled(place):
    try:
        return open_journal(place, read_only=True).count() > 0
    except JournalError:
        return False


def killed_everywhere(request, folder, names, way, steps):
    """Kill a move at each of these steps until one has ended; yield who was in force then."""
    old, new, controller = way

    def place(kind, name):
        if kind == "file":
            return str(folder / f"{name}-{step}.db")
        return request.getfixturevalue("server").empty_place()

    patch = request.getfixturevalue("monkeypatch")
    for step in steps:
        patch.setenv("ROBOLINK_STATE_DIR", str(folder / f"state-{step}"))
        source, target = place(old, "old"), place(new, "new")
        ended, in_force = check_killed(step, names, source, target, controller)
        yield "new" if in_force == target else "old"
        if ended:
            return


FILES = ("file", "file", None)
TO_SERVER, FROM_SERVER = ("file", "server", None), ("server", "file", CELL)


def test_killed_at_each_durable_step_one_journal_is_in_force(request, tmp_path):
    in_force = [*killed_everywhere(request, tmp_path, ("commit",), FILES, count(1))]
    assert in_force == ["old"] * 3 + ["new"] * 4


@pytest.mark.parametrize(
    ("way", "seal"),
    [pytest.param(TO_SERVER, 6, marks=pytest.mark.soak), (FROM_SERVER, 5)],
)
def test_killed_before_and_after_the_seal_one_journal_is_in_force(request, tmp_path, way, seal):
    steps = (seal, seal + 1)
    in_force = [*killed_everywhere(request, tmp_path, ("commit",), way, steps)]
    assert in_force == ["old", "new"]


@pytest.mark.soak
@pytest.mark.parametrize("way", [FILES, TO_SERVER, FROM_SERVER, ("file", "file", CELL)])
def test_killed_at_each_statement_one_journal_is_in_force(request, tmp_path, way):
    acts = ("commit", "run", "run_many", "rows")
    in_force = [*killed_everywhere(request, tmp_path, acts, way, count(1))]
    assert in_force == sorted(in_force, reverse=True)
    assert min(in_force.count("old"), in_force.count("new")) > 10
