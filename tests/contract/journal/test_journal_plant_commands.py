"""The plant at the command line: journal sync and verify, and the end of each command."""

import json
import os
import socket
import sys
import threading
import time
from itertools import count
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_cli.session.plant_outbox import (
    _Copying,
    copy_journals_in_use,
    copying_meanwhile,
)
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.config import NamedPlant, add_cell, check_file, named_plant
from robolink.journal import (
    close_files,
    copy_journals,
    default_location,
    journals_added_to,
    move_journal,
    open_journal,
)
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import run as act
from tests.contract.journal._postgresql import asked

_numbers = count()


@pytest.fixture(autouse=True)
def own_state(monkeypatch, tmp_path):
    for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "none"))
    monkeypatch.chdir(tmp_path)
    journals_added_to()
    yield
    close_files()


@pytest.fixture
def cell():
    """The URL of a simulated controller that is recorded like a real one."""
    simulator = EpsonSimulator(seed=4, serial="SIM00001")
    simulator.durable = True
    name = f"plant-{next(_numbers)}"
    register(name, simulator)
    yield simulator.url
    unregister(name)


@pytest.fixture
def run(capsys):
    """Run a command; return its exit code and what it printed."""

    def ran(*arguments):
        code = main.run(arguments)
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return ran


@pytest.fixture(autouse=True)
def named(own_state, request, monkeypatch):
    """Name the plant in the environment of a test that has one."""
    if "plant" in request.fixturenames:
        monkeypatch.setenv("ROBOLINK_PLANT", request.getfixturevalue("plant"))


def there(plant):
    """Return the hashes that the plant has, in the order of their numbers."""
    if asked(plant, "SELECT to_regclass('fleet.cell_entries')") == [(None,)]:
        return []
    return [its for (its,) in asked(plant, "SELECT hash FROM fleet.cell_entries ORDER BY number")]


def here():
    return [entry.hash for entry in open_journal(read_only=True).entries(newest_first=False)]


def record(entry_count=1):
    entries = [NewEntry(EntryKind.DECISION, verdict=f"{n}") for n in range(entry_count)]
    open_journal().log("cell-a").append(*entries)


def told(answer):
    """Return exit code and document."""
    code, out, _ = answer
    return code, json.loads(out)


def test_a_command_that_recorded_something_copies_it_at_its_end(run, cell, plant):
    assert run("-c", cell, "tool", "list")[0] == 0
    recorded = len(here())
    assert run("-c", cell, "tool", "set", "1", "--x", "13", "--yes")[0] == 0
    assert there(plant) == here()
    assert len(here()) > recorded


def test_a_command_that_recorded_nothing_asks_the_plant_nothing(run, cell, plant, monkeypatch):
    assert run("-c", cell, "tool", "set", "1", "--x", "13", "--yes")[0] == 0
    monkeypatch.setenv("ROBOLINK_PLANT", "postgresql://u@127.0.0.1:1/plant")
    for command in (("status",), ("tool", "list"), ("journal", "list")):
        assert run("-c", cell, *command)[2] == ""


@pytest.fixture
def silent():
    """The URL of a database that takes connections and says nothing."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield f"postgresql://u@127.0.0.1:{listener.getsockname()[1]}/plant"


def test_a_plant_that_is_away_is_told_once_and_changes_no_exit_code(
    run, cell, plant, silent, monkeypatch
):
    write = ("-c", cell, "tool", "set", "1", "--yes", "--x")
    for url in ("postgresql://cells:geheim9@127.0.0.1:1/plant", silent):
        monkeypatch.setenv("ROBOLINK_PLANT", url)
        begun_s = time.monotonic()
        code, _, err = run(*write, "13" if url != silent else "12")
        assert code == 0
        assert time.monotonic() - begun_s < 5  # the wait is 1 s; the rest is the machine's
        assert ("does not answer" in err) == (url != silent)  # told already
        assert "geheim9" not in err
    monkeypatch.setenv("ROBOLINK_PLANT", plant)
    code, out, _ = run(*write, "12.5", "--json")
    assert (code, json.loads(out)["schema"]) == (0, "robolink/tool-write/1")
    assert there(plant) == here()
    # It is told anew once it was back.
    monkeypatch.setenv("ROBOLINK_PLANT", silent)
    assert "did not answer within 1 s" in run(*write, "12")[2]


def test_a_plant_that_answered_and_is_slow_is_not_told_as_one_that_is_away(plant, capsys):
    copying = _Copying((), plant)
    copying.answered.set()
    copying.show(repeat=True)
    told_here = " ".join(capsys.readouterr().err.split())
    assert "Copying to the plant's database took more than 3 s." in told_here
    assert "answer" not in told_here


def test_a_plant_that_is_named_wrongly_changes_no_exit_code(run, cell, monkeypatch):
    monkeypatch.setenv("ROBOLINK_PLANT", "mysql://u@h/d")
    code, _, err = run("-c", cell, "tool", "set", "1", "--x", "13", "--yes")
    assert code == 0
    assert "names no database of a plant" in err
    assert run("journal", "sync")[0] == 2


@pytest.mark.parametrize("place", ["fleet.db", "sqlite:///fleet.db"])
def test_a_file_of_plans_gets_no_copies(run, cell, monkeypatch, place):
    monkeypatch.setenv("ROBOLINK_PLANT", place)
    assert "fleet" not in run("-c", cell, "tool", "set", "1", "--x", "13", "--yes")[2]
    assert "No PostgreSQL database of a plant is named" in run("journal", "sync")[2]
    assert told(run("journal", "verify", "--json"))[1]["plant"] is None
    assert not Path("fleet.db").exists()


def test_without_psycopg_a_command_says_what_is_missing_and_ends_as_it_would(
    run, cell, plant, monkeypatch
):
    monkeypatch.setitem(sys.modules, "psycopg", None)
    code, _, err = run("-c", cell, "tool", "set", "1", "--x", "13", "--yes")
    assert code == 0
    assert "pip install 'robolink[postgresql]'" in err


def test_a_journal_that_was_cut_is_told_by_each_command(run, cell, plant):
    write = ("-c", cell, "tool", "set", "1", "--yes", "--x")
    assert run(*write, "13")[0] == 0
    copies, journal = there(plant), open_journal()
    act(journal, "DELETE FROM entries WHERE number > 1")
    act(journal, "UPDATE head SET number = 1, hash = (SELECT hash FROM entries)")
    for value in ("12", "13"):
        code, _, err = run(*write, value)
        assert code == 0
        assert "What to do: docs/journal.md" in err
    assert there(plant) == copies


# ---- journal sync


def test_sync_shows_the_chain_what_was_copied_and_what_is_left(run, plant):
    assert run("journal", "sync")[0] == 2  # no journal yet
    record(3)
    code, found = told(run("journal", "sync", "--json"))
    hashes = here()
    assert code == 0
    assert found == {
        "schema": "robolink/journal-synced/1",
        "ok": True,
        "plant": plant,
        "named_by": "ROBOLINK_PLANT",
        "journals": [
            {
                "journal": default_location(),
                "cells": [],
                "chain": hashes[0],
                "copied_count": 3,
                "number": 3,
                "hash": hashes[2],
                "behind_count": 0,
                "error": None,
            }
        ],
    }
    code, out, _ = run("journal", "sync")
    assert code == 0
    assert hashes[0][:12] in out
    assert "ROBOLINK_PLANT" in out


def test_sync_copies_the_journals_of_many_cells_each_once_and_names_those_it_cannot(
    run, plant, tmp_path, monkeypatch
):
    """One journal is missing, one was rewritten; two cells share one; the others are copied."""
    own = {name: tmp_path / f"{name}.db" for name in ("press-1", "press-2", "press-3", "glue")}
    file = tmp_path / "robolink.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    monkeypatch.delenv("ROBOLINK_STATE_DIR", raising=False)
    journals = {**own, "press-4": own["press-1"]}
    for number, (name, journal) in enumerate(sorted(journals.items())):
        said = {"url": f"epson+tcp://192.0.2.{number + 1}:5000", "journal": str(journal)}
        add_cell(file, name, said)
    for name, journal in own.items():
        if name != "press-2":
            entries = open_journal(str(journal))
            for _ in range(2):
                entries.log(f"epson:{name}").append(NewEntry(EntryKind.DECISION, verdict=name))
    assert run("journal", "sync", "press-3")[0] == 0
    act(open_journal(str(own["press-3"])), "DELETE FROM entries WHERE number = 2")
    close_files()
    code, document = told(run("journal", "sync", "press-*", "glue", "press-1", "--json"))
    assert (code, document["ok"]) == (2, False)
    found = {tuple(one["cells"]): one for one in document["journals"]}
    assert list(found) == [("press-1", "press-4"), ("press-2",), ("press-3",), ("glue",)]
    assert [one["number"] for one in found.values()] == [2, None, None, 2]
    kinds = {cells: one["error"] and one["error"]["kind"] for cells, one in found.items()}
    assert kinds[("press-2",)] == "JournalError"
    assert kinds[("press-3",)] == "ChainConflictError"
    assert [kinds[("press-1", "press-4")], kinds[("glue",)]] == [None, None]
    code, out, _ = run("journal", "sync", "press-*")
    assert code == 2
    assert "press-2: not copied." in out
    assert "There is no journal" in out
    assert run("journal", "sync", "press-*", "--new-chain")[0] == 2
    assert run("journal", "sync", "press-1", "glue")[0] == 0
    assert run("journal", "sync", "press-9")[0] == 2


def test_where_the_plant_is_away_no_further_journal_is_tried(tmp_path):
    places = [str(tmp_path / f"{number}.db") for number in range(20)]
    for place in places:
        open_journal(place).log("epson:C-1").append(NewEntry(EntryKind.DECISION))
    close_files()
    copies = list(copy_journals(places, "postgresql://u@127.0.0.1:1/plant", at_once=1))
    assert {type(one.error).__name__ for one in copies} == {"ConnectError"}
    assert len({id(one.error) for one in copies}) == 1


def test_sync_says_who_is_missing(run, monkeypatch):
    record()
    assert "No PostgreSQL database of a plant is named" in run("journal", "sync")[2]
    assert run("journal", "sync")[0] == 2
    monkeypatch.setenv("ROBOLINK_PLANT", "postgresql://u@127.0.0.1:1/plant")
    code, _, err = run("journal", "sync")
    assert (code, "127.0.0.1:1/plant does not answer" in err) == (3, True)
    code, document = told(run("journal", "sync", "--json"))
    assert document["error"]["kind"] == "ConnectError"


def test_a_new_record_in_the_place_of_another_is_copied_when_a_person_says_so(run, plant):
    record(2)
    assert run("journal", "sync")[0] == 0
    act(open_journal(), "DELETE FROM entries")
    act(open_journal(), "UPDATE head SET number = 0, hash = ''")
    close_files()
    record(1)
    code, document = told(run("journal", "sync", "--json"))
    assert (code, document["error"]["kind"]) == (2, "ChainConflictError")
    assert run("journal", "verify")[0] == 1
    assert run("journal", "sync", "--new-chain")[0] == 0
    assert run("journal", "verify")[0] == 0
    assert len(there(plant)) == 3


def test_after_a_move_the_copying_goes_on_from_the_new_place(run, plant, monkeypatch, tmp_path):
    record(3)
    run("journal", "sync")
    move_journal(str(tmp_path / "new.db"))
    code, document = told(run("journal", "sync", "--json"))
    assert (code, "was moved to" in document["error"]["what"]) == (2, True)
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(tmp_path / "new.db"))
    assert run("journal", "verify")[0] == 0
    record(1)
    code, document = told(run("journal", "sync", "--json"))
    assert (code, document["journals"][0]["copied_count"]) == (0, 1)
    assert there(plant) == here()


# ---- journal verify


def test_verify_compares_with_the_plant(run, plant):
    record(3)
    code, out, _ = run("journal", "verify")
    assert (code, "has no copy of this journal" in out, "Without a key" in out) == (0, True, True)
    run("journal", "sync")
    code, out, _ = run("journal", "verify")
    assert (code, "has the same entries, up to 3" in out, "Without a key" in out) == (
        0,
        True,
        False,
    )
    act(open_journal(), "DELETE FROM entries WHERE number = 3")
    act(open_journal(), "UPDATE head SET number = 2, hash = (SELECT max(hash) FROM entries)")
    act(
        open_journal(),
        "UPDATE head SET hash = (SELECT hash FROM entries WHERE number = 2)",
    )
    code, found = told(run("journal", "verify", "--json"))
    assert code == 1
    assert (found["last_number"], found["plant"]["number"]) == (2, 3)
    (problem,) = found["problems"]
    assert "ends with entry 2" in problem
    out = run("journal", "verify")[1].replace("\n", " ")
    assert problem.split(":")[0] in out
    assert "checked: problems: 1." in out


def test_verify_checks_what_it_can_where_the_plant_is_away(run, monkeypatch):
    record(3)
    monkeypatch.setenv("ROBOLINK_PLANT", "postgresql://u@127.0.0.1:1/plant")
    code, out, _ = run("journal", "verify")
    assert (code, "3 entries checked" in out, "127.0.0.1:1/plant" in out) == (3, True, True)
    assert told(run("journal", "verify", "--json"))[1]["plant"]["number"] is None
    act(open_journal(), "UPDATE entries SET verdict = 'x' WHERE number = 2")
    assert run("journal", "verify")[0] == 1  # what is wrong here comes first


# ---- The panel, and where a plant is named


def test_the_panel_copies_in_its_own_time_and_tells_once(plant, monkeypatch, capsys):
    copy_journals_in_use()  # no journal is open yet
    record(2)
    copy_journals_in_use()
    assert there(plant) == here()
    record(1)
    copy_journals_in_use()
    assert there(plant) == here()
    act(open_journal(), "DELETE FROM entries WHERE number > 1")
    act(open_journal(), "UPDATE head SET number = 1, hash = (SELECT hash FROM entries)")
    copy_journals_in_use()
    copy_journals_in_use()
    assert capsys.readouterr().err.count("newer ones were removed") == 1


def test_a_journal_that_was_cut_keeps_no_other_back(plant, tmp_path):
    for name in ("cut.db", "whole.db"):
        journal = open_journal(str(tmp_path / name))
        journal.log("cell-a").append(NewEntry(EntryKind.DECISION), NewEntry(EntryKind.RAW))
    copy_journals_in_use()
    act(open_journal(str(tmp_path / "cut.db")), "DELETE FROM entries WHERE number > 1")
    journal.log("cell-a").append(NewEntry(EntryKind.RAW))
    copy_journals_in_use()
    assert len(there(plant)) == 5


def test_beside_an_agent_the_journal_is_copied_again_and_again(plant):
    record(2)
    arrived = threading.Event()
    with copying_meanwhile(0.01):
        for _ in range(500):
            if there(plant) == here():
                arrived.set()
                break
            arrived.wait(0.01)
    assert arrived.is_set()


def test_a_file_names_the_plant_where_the_environment_does_not(tmp_path, monkeypatch):
    assert named_plant() is None
    (tmp_path / "robolink.toml").write_text('plant = "postgresql://u@h/d"\n')
    assert named_plant() == NamedPlant("postgresql://u@h/d", str(tmp_path / "robolink.toml"))
    assert check_file(tmp_path / "robolink.toml") == ()
    monkeypatch.setenv("ROBOLINK_PLANT", "postgresql://u@other/d")
    assert named_plant() == NamedPlant("postgresql://u@other/d", "ROBOLINK_PLANT")
    monkeypatch.setenv("ROBOLINK_PLANT", "")
    assert named_plant() is None  # to be without it for once


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('plant = "postgresql://u:geheim9@h/d"', "holds a password"),
        ('plant = "postgresql://u@h/d?password=geheim9"', "holds a password"),
        ('plant = "geheim9"', "must be a URL"),
        ('plants = "postgresql://u@h/d"', "did you mean plant?"),
    ],
)
def test_a_plant_that_a_file_names_wrongly_is_refused(tmp_path, line, said):
    (tmp_path / "robolink.toml").write_text(line)
    (problem,) = check_file(tmp_path / "robolink.toml")
    assert said in problem.what
    assert "geheim9" not in str(problem)


# ---- journal export --since


def test_an_export_since_a_day_leaves_out_what_was_before(run, tmp_path):
    record(3)
    act(open_journal(), "UPDATE entries SET at = '2026-01-31T23:59:59.999+00:00' WHERE number = 1")
    act(open_journal(), "UPDATE entries SET at = '2026-02-01T00:00:00.000+00:00' WHERE number = 2")
    export = ("journal", "export", "--force", "some.jsonl", "--json")
    for since, entry_count in (("2026-01-31", 3), ("2026-02-01", 2), ("2026-02-02", 1)):
        code, found = told(run(*export, "--since", since))
        assert (code, found["entry_count"]) == (0, entry_count)
    assert run(*export, "--since", "yesterday")[0] == 2
