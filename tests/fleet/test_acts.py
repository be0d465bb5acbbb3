"""What an agent does at a cell: once an order, recorded, and never by moving a robot."""

import json
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path

import pytest
from robolink_cli.commands.fleet.acts import CellActs
from robolink_cli.session.cell_plans import outcome_of
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink import transaction
from robolink.errors import ConnectError
from robolink.fleet import Permit, Treatment, plan_of, treatment_of
from robolink.journal import default_location, open_journal, this_computer
from robolink.journal.store.connection import DatabaseConnection
from robolink.model import EntryKind, MarkerKind, ToolOffset
from robolink.stopping import holders_of
from robolink.transport import far_end_of, parse_url

PERMIT = Permit(1, "plant", "Chen", "engineer", "2026-11-30", "2026-12-31")

SOAK = pytest.mark.soak


@pytest.fixture
def simulator():
    simulator = EpsonSimulator("T6-602S", seed=1)
    with serve_tcp(simulator):
        yield simulator


@pytest.fixture
def cell_file(simulator, tmp_path, monkeypatch):
    file = tmp_path / "robolink.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    file.write_text(f"[cells.a]\nurl = {json.dumps(simulator.url)}\n")
    return file


@pytest.fixture
def acts(cell_file, tmp_path):
    with CellActs(tmp_path / "backups") as acts:
        yield acts


def plan(kind, **more):
    table = {"schema": "robolink/fleet-plan/1", "kind": kind, "name": "test", "cells": ["a"]}
    if kind == "offset":
        more = {"offsets": {"a": {"tool": 1, "x_mm": 12.7}}, **more}
    return plan_of({**table, **more}, cells=["a"], author="Li", made_at="2026-11-30T22:00:00+00:00")


def tool_of(simulator, number=1):
    return simulator.machine.robots[0].tools.get(number)


def treatment(outcome):
    return treatment_of(outcome.code, outcome.error, outcome.reason)


def entries(kind):
    return list(open_journal().entries(kinds=(kind,)))


def test_an_offset_is_written_once_however_often_it_is_delivered(acts, simulator):
    before, made = tool_of(simulator), plan("offset")
    first = acts(made, "a", PERMIT)
    assert (first.code, first.what) == (0, "Written and read back.")
    assert tool_of(simulator) == ToolOffset(12.7, before.y_mm, before.z_mm, before.u_deg)
    again = acts(made, "a", PERMIT)
    assert (again.code, again.what) == (0, "Written before.")
    assert simulator.machine.flash_writes == 1
    (entry,) = entries(EntryKind.ORDER)
    assert entry.details["order"] == made.order("a")
    assert entry.signature.operator == "Chen"
    assert simulator.machine.motions.added == 0


@pytest.fixture
def disturbed(monkeypatch):
    """Has something happen just before the next write, or just after it."""
    change_tools = transaction.change_tools

    def by(happening, *, after):
        def change(controller, *args, **kwargs):
            monkeypatch.setattr(transaction, "change_tools", change_tools)
            if not after:
                happening(controller)
            receipts = change_tools(controller, *args, **kwargs)
            happening(controller)
            return receipts

        monkeypatch.setattr(transaction, "change_tools", change)

    return by


def stopped_by_an_error(controller):
    controller.stop()
    controller.latch.require_open("test")


@pytest.mark.parametrize("stop", [lambda controller: controller.stop(), stopped_by_an_error])
def test_a_stop_after_an_offset_is_kept_takes_nothing_back(acts, simulator, disturbed, stop):
    made = plan("offset")
    disturbed(stop, after=True)
    ended = acts(made, "a", PERMIT)
    assert (ended.code, ended.error, treatment(ended)) == (0, "", Treatment.DONE)
    assert "ended by a stop" in ended.what
    assert acts(made, "a", PERMIT).what == "Written before."
    assert simulator.machine.flash_writes == 1


@pytest.mark.parametrize(
    "defect",
    [ZeroDivisionError("a defect"), pytest.param(OSError(28, "no space left"), marks=SOAK)],
)
def test_what_ends_in_a_defect_is_done_by_the_next_delivery(acts, simulator, disturbed, defect):
    def fails(_controller):
        raise defect

    made = plan("offset")
    disturbed(fails, after=False)
    assert treatment(acts(made, "a", PERMIT)) is Treatment.HALT
    assert (simulator.machine.flash_writes, entries(EntryKind.ORDER)) == (0, [])
    assert acts(made, "a", PERMIT).what == "Written and read back."
    disturbed(fails, after=True)
    kept = acts(plan("offset", name="2"), "a", PERMIT)
    assert (kept.code, str(defect) in kept.what) == (0, True)


def test_without_a_permit_an_order_is_only_looked_up(acts, simulator):
    made = plan("offset")
    ended = acts(made, "a", None)
    assert (ended.code, ended.error, treatment(ended)) == (5, "BusyError", Treatment.BUSY)
    assert simulator.machine.flash_writes == 0
    assert entries(EntryKind.ORDER) == []
    assert acts(made, "a", PERMIT).what == "Written and read back."
    assert acts(made, "a", None).what == "Written before."
    with robolink.connect(simulator.url) as other:
        other.begin(MarkerKind.SET, "TLSet 1", {"tool": 1})
    assert treatment(acts(plan("offset", name="2"), "a", None)) is Treatment.UNSETTLED
    assert simulator.machine.flash_writes == 1


def test_a_backup_is_saved_once_and_is_whole(acts, simulator, tmp_path):
    from robolink.backup import load

    made = plan("backup")
    assert acts(made, "a", None).code == 0
    (file,) = (tmp_path / "backups" / made.id).iterdir()
    was = file.read_bytes()
    simulator.machine.robots[0].tools.set(1, ToolOffset(1, 2, 3))
    assert acts(made, "a", None).code == 0
    assert file.read_bytes() == was
    assert load(file).state.tools[1] is not None
    file.write_text("{")
    assert treatment(acts(made, "a", None)) is Treatment.PERSON


def test_a_check_tells_what_it_found_and_is_on_record(acts, simulator):
    assert acts(plan("check"), "a", None).what == "No problem found."
    assert acts(plan("offset"), "a", PERMIT).code == 0
    simulator.machine.robots[0].tools.set(1, ToolOffset(13, 2, 3))
    found = acts(plan("check", name="next night"), "a", None)
    assert found.code == 1
    assert "Tool 1 holds X 13.000" in found.what
    assert treatment(found) is Treatment.DONE
    assert [one.well for one in open_journal().checks(newest_first=False)] == [True, False]


def test_the_drift_is_read_without_asking_a_controller(acts, simulator):
    before = simulator.exchanges
    assert acts(plan("drift"), "a", None).what == "No problem found."
    assert simulator.exchanges == before


@pytest.mark.parametrize(
    ("trouble", "expected"),
    [
        ("start_production", Treatment.BUSY),
        ("teach", Treatment.PERSON),
        ("press_estop", Treatment.PERSON),
    ],
)
def test_nothing_is_written_in_a_state_that_forbids_it(acts, simulator, trouble, expected):
    getattr(simulator.panel, trouble)()
    assert treatment(acts(plan("offset"), "a", PERMIT)) is expected
    assert simulator.machine.flash_writes == 0


def test_a_cell_that_is_locked_off_or_unsettled_says_so(acts, simulator, cell_file):
    made = plan("offset")
    with robolink.connect(simulator.url) as other, other.outcomes.hold("somebody else"):
        assert treatment(acts(made, "a", PERMIT)) in (Treatment.BUSY, Treatment.OFF)
    with robolink.connect(simulator.url) as other:
        marker = other.begin(MarkerKind.SET, "TLSet 1", {"tool": 1})
    ended = acts(made, "a", PERMIT)
    assert (ended.code, treatment(ended)) == (6, Treatment.UNSETTLED)
    with robolink.connect(simulator.url) as other:
        other.finish(marker)
    cell_file.write_text('[cells.a]\nurl = "epson+tcp://127.0.0.1:1"\n')
    assert treatment(acts(made, "a", PERMIT)) is Treatment.OFF
    assert simulator.machine.flash_writes == 0


@pytest.mark.parametrize("kind", [pytest.param("backup", marks=SOAK), "check", "offset"])
def test_a_stop_from_another_terminal_reaches_the_controller(kind, acts, simulator):
    simulator.answer_s = 0.05
    stopped: list[str] = []

    def stop():
        until = time.monotonic() + 20
        while not stopped and time.monotonic() < until:
            stopped.extend(one.ask_to_stop("Wang") for one in holders_of(far_end_of(simulator.url)))
            time.sleep(0.005)

    with ThreadPoolExecutor(1) as terminal:
        asked = terminal.submit(stop)
        ended = acts(plan(kind), "a", PERMIT)
        asked.result()
    assert stopped
    assert (ended.code, ended.error, treatment(ended)) == (10, "StoppedError", Treatment.PERSON)
    assert simulator.machine.flash_writes == 0


def test_a_check_leaves_a_cell_alone_at_which_somebody_works(acts, simulator):
    program = (
        "import sys\n"
        "from robolink.controllers import SimpleController\n"
        "from robolink.stopping import StopListener\n"
        "with StopListener(SimpleController(), sys.argv[1], who='Sato, at the cell'):\n"
        "    print('here', flush=True)\n"
        "    sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-m", "tests._program", program, simulator.url],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "here\n"
        before = simulator.exchanges
        ended = acts(plan("check"), "a", None)
        assert other.stdin is not None
        other.stdin.close()
    assert (ended.code, treatment(ended)) == (5, Treatment.BUSY)
    assert "Sato, at the cell" in ended.what
    assert simulator.exchanges == before


def test_the_cell_file_of_now_holds(acts, simulator, cell_file):
    said = f"[cells.a]\nurl = {json.dumps(simulator.url)}\n"
    cell_file.write_text(said + "max_change_mm = 0.1\n")
    ended = acts(plan("offset"), "a", PERMIT)
    assert (ended.code, ended.error) == (9, "NotAllowedError")
    cell_file.write_text(said + 'people = { "Sato" = "engineer" }\n')
    ended = acts(plan("offset", name="2"), "a", PERMIT)
    assert (ended.code, ended.error) == (2, "ConfigError")
    assert "Chen" in ended.what
    cell_file.write_text(said + 'robot = "LS3-401S"\n')
    assert acts(plan("offset", name="3"), "a", PERMIT).code == 2
    cell_file.write_text("[cells.b]\nurl = 'epson+tcp://127.0.0.1:1'\n")
    assert "no cell a" in acts(plan("offset", name="4"), "a", PERMIT).what
    assert simulator.machine.flash_writes == 0


@pytest.mark.parametrize("kind", ["drift", "offset"])
def test_the_record_is_where_the_cell_file_says(kind, acts, simulator, cell_file, monkeypatch):
    monkeypatch.delenv("ROBOLINK_STATE_DIR")
    for name in ("XDG_DATA_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(cell_file.parent / name))
    with cell_file.open("a") as more:
        more.write('journal = "record/a.db"\n')
    assert acts(plan(kind), "a", PERMIT if kind == "offset" else None).code == 0
    place = default_location(parse_url(simulator.url).address)
    assert place.endswith("record/a.db")
    if kind == "offset":
        assert list(open_journal(place).entries(kinds=(EntryKind.ORDER,)))
    assert not (cell_file.parent / "XDG_DATA_HOME" / "robolink" / "journal.db").exists()


def test_a_defect_and_an_error_are_outcomes():
    defect = outcome_of(ZeroDivisionError("x"))
    assert (defect.code, defect.error) == (70, "ZeroDivisionError")
    assert treatment(defect) is Treatment.HALT
    assert treatment(outcome_of(ConnectError("gone"))) is Treatment.OFF


def test_a_backup_folder_that_cannot_be_written_halts_the_plan(cell_file, tmp_path):
    (tmp_path / "file").write_text("")
    with CellActs(Path(tmp_path / "file")) as acts:
        ended = acts(plan("backup"), "a", None)
    assert (ended.error, treatment(ended)) == ("PlanError", Treatment.HALT)


@pytest.mark.parametrize(
    "kind", ["offset", "check", *[pytest.param(kind, marks=SOAK) for kind in ("backup", "drift")]]
)
def test_nothing_is_done_where_the_cell_file_names_another_home(kind, acts, cell_file, simulator):
    said = cell_file.read_text()
    cell_file.write_text(f'{said}home = "another-computer"\n')
    away = acts(plan(kind), "a", PERMIT)
    assert (away.code, away.error) == (2, "NotAtHomeError")
    assert treatment(away) is Treatment.PERSON
    assert not list(simulator.log)
    cell_file.write_text(f'{said}home = "{this_computer()}"\n')
    assert acts(plan(kind), "a", PERMIT).error == ""


@pytest.mark.parametrize("at", [7, 8])
def test_a_write_that_cannot_be_recorded_is_put_back_and_written_by_the_next_delivery(
    acts, simulator, monkeypatch, at
):
    before, made = tool_of(simulator), plan("offset")
    commit, commits = DatabaseConnection.commit, count(1)

    def full(database):
        if next(commits) == at:  # of the entry behind the write, or of the end of the order
            database.roll_back()
            raise sqlite3.OperationalError("database or disk is full")
        commit(database)

    with monkeypatch.context() as once:
        once.setattr(DatabaseConnection, "commit", full)
        first = acts(made, "a", PERMIT)
    assert (first.error, treatment(first)) == ("JournalError", Treatment.HALT)
    assert tool_of(simulator) == before
    assert simulator.machine.flash_writes == 2
    assert entries(EntryKind.ORDER) == []
    again = acts(made, "a", PERMIT)
    assert (again.code, again.what) == (0, "Written and read back.")
    assert (simulator.machine.flash_writes, tool_of(simulator).x_mm) == (3, 12.7)
    told = {entry.details.get("order") for entry in entries(EntryKind.ROLLED_BACK)}
    assert made.order("a") in told
