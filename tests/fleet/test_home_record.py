"""How cells stand is noted at the plant from their journals: each entry counts once."""

import platform
import shutil
from collections import defaultdict
from datetime import UTC, datetime, timedelta
from functools import partial

import pytest
from robolink_cli.commands.fleet.agent import agent_here

from robolink.calibration import Drift, VerifyResult
from robolink.calibration_run import conclude_turn_test
from robolink.config import add_cell, load_cell_files, use_journals_of
from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import LeaseHeldError, VerifyError
from robolink.fleet import FleetStore, JobOutcome, JobState, PlantNotes, RecipeInUse, plan_of
from robolink.fleet.agent_lock import AgentLock
from robolink.fleet.plant_view import home_record
from robolink.fleet.plant_view.home_record import HomeRecord
from robolink.journal import Journal, close_files, open_journal, this_computer
from robolink.model import EntryKind, Marker, MarkerKind, NewCheck, NewEntry, Signature, ToolOffset
from robolink.transaction import ToolChange, Wanted, carrying_out, change_tools
from robolink.transport import parse_url
from tests.fleet._plans import permitted

WRITTEN = ToolOffset(12.7, -3.5, -20)


class Home:
    """A computer with cells, their journals, and the plant's database."""

    def __init__(self, folder, location, wall):
        self.folder, self.location, self.wall = folder, location, wall
        self.machines = defaultdict(SimpleMachine)
        self.record = self.made()

    def restarted(self):
        self.record.close()
        self.record = self.made()

    def made(self):
        cells = lambda: load_cell_files().cells  # noqa: E731
        return HomeRecord(self.location, "plant", cells, clock=self.wall)

    def add(self, name, **more):
        number = 10 + len(load_cell_files().cells)
        url = f"epson+tcp://192.168.0.{number}:5000"
        add_cell(self.folder / "robolink.toml", name, {"url": url, **more})
        return self.controller(name)

    def controller(self, name, **signature):
        """A controller whose record is the journal of a cell."""
        files = load_cell_files()
        use_journals_of(files.cells.values(), files.journal)
        address = parse_url(files.cells[name].url).address
        log = open_journal(address=address).log(address, signature=Signature(**signature))
        return SimpleController(self.machines[name], outcomes=log)

    def states(self):
        self.record.note()
        with PlantNotes(self.location, "plant") as notes:
            return notes.cells()


@pytest.fixture
def home(tmp_path, monkeypatch, location, wall):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "robolink.toml"))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    (tmp_path / "robolink.toml").touch()
    home = Home(tmp_path, location, wall)
    yield home
    home.record.close()


def write(controller, offset, tool=1):
    before = controller.tools.read(tool)
    change_tools(controller, [Wanted(tool, offset, before)])


def turned(controller, offset, *, drift_mm=0.02, tool=1, kept=True):
    """A change with a turn test, as a calibration makes it."""
    wanted = Wanted(tool, offset, controller.tools.read(tool), details={"method": "two-pose"})
    proof = VerifyResult((Drift(180, drift_mm, 0),), tolerance_mm=0.2)
    with ToolChange(controller, [wanted], verify=True) as change:
        change.write()
        conclude_turn_test(controller, tool, proof, claim=None)
        if kept:
            change.keep()


def test_what_is_on_record_of_a_cell_is_noted_each_entry_once(home):
    home.add("a")
    home.add("b")
    for offset in (ToolOffset(1, 0, -20), ToolOffset(1.3, 0.4, -20)):
        write(home.controller("a", recipe="needle", recipe_hash="aa"), offset)
    state = home.states()["a"]
    assert state.changes == {"done": 2}
    assert (sum(state.corrections), state.moved_mm) == (1, 0.5)  # the first defined the tool
    assert state.recipe is not None
    assert (state.recipe.name, state.recipe.hash) == ("needle", "aa")
    assert home.states()["b"].changes == {}
    since = state.recipe.since

    home.restarted()  # what was counted before is not counted again
    write(home.controller("a", recipe="needle 2", recipe_hash="aa"), ToolOffset(1.3, 0.4, -19))
    write(home.controller("b", recipe="pin", recipe_hash="bb"), ToolOffset(1, 0, -20))
    write(home.controller("b"), ToolOffset(1, 0, -21))  # by hand: the recipe is the one before
    states = home.states()
    assert states["a"].changes == {"done": 3}
    assert states["a"].recipe == RecipeInUse("needle 2", "aa", since)
    assert states["a"].moved_mm == 1.5
    assert (states["b"].changes, states["b"].recipe.hash) == ({"done": 2}, "bb")


def test_a_replaced_journal_is_counted_anew_and_so_is_a_cell_that_came_later(home):
    write(home.add("a"), WRITTEN)
    write(home.controller("a"), ToolOffset(1, 2, 3))
    home.states()
    write(home.add("b"), WRITTEN)
    assert home.states()["b"].changes == {"done": 1}
    assert home.states()["a"].changes == {"done": 2}
    close_files()
    shutil.rmtree(home.folder / "state")
    write(home.controller("a"), ToolOffset(1, 2, 4))
    states = home.states()
    assert (states["a"].changes, states["b"].changes) == ({"done": 1}, {})


def test_what_another_process_has_noted_meanwhile_is_gone_on_from(home):
    write(home.add("a"), WRITTEN)
    home.states()
    write(home.controller("a", recipe="needle", recipe_hash="aa"), ToolOffset(12.7, -3.5, -19))
    other = home.made()
    other.note()
    other.close()
    home.wall.go_on(seconds=home_record.FRESH_S)
    home.states()  # nothing is new to it but the age of the note
    write(home.controller("a"), WRITTEN)
    state = home.states()["a"]
    assert (state.changes, state.moved_mm) == ({"done": 3}, 2.0)
    assert state.recipe is not None
    assert state.recipe.hash == "aa"


def test_two_processes_that_note_at_once_count_each_entry_once(home, monkeypatch):
    write(home.add("a"), WRITTEN)
    home.states()
    write(home.controller("a"), ToolOffset(1, 2, 3))
    other, markers = home.made(), Journal.open_markers

    def between(journal):  # the states were read, and are not noted yet
        monkeypatch.setattr(Journal, "open_markers", markers)
        write(home.controller("a"), WRITTEN)
        other.note()
        other.close()
        return markers(journal)

    monkeypatch.setattr(Journal, "open_markers", between)
    assert home.states()["a"].changes == {"done": 3}
    assert home.states()["a"].changes == {"done": 3}


def test_a_process_that_is_refused_as_agent_notes_nothing(home, monkeypatch):
    write(home.add("a"), WRITTEN)
    monkeypatch.setenv("ROBOLINK_PLANT", home.location)
    with AgentLock(home.location, "plant", this_computer()), agent_here("plant") as second:
        with pytest.raises(LeaseHeldError):
            second.run_until_still()
    with PlantNotes(home.location, "plant") as notes:
        assert notes.cells() == {}


@pytest.mark.soak
def test_an_agent_notes_before_it_ends(home, monkeypatch):
    write(home.add("a"), WRITTEN)
    monkeypatch.setenv("ROBOLINK_PLANT", home.location)
    with agent_here("plant") as agent:
        agent.run_until_still()
    with PlantNotes(home.location, "plant") as notes:
        assert notes.cells()["a"].changes == {"done": 1}


def test_a_broken_journal_keeps_no_other_from_being_noted(home, monkeypatch):
    monkeypatch.delenv("ROBOLINK_STATE_DIR")  # it would go before the cell file
    for name in ("XDG_DATA_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(home.folder / name))
    for name in "ab":
        write(home.add(name, journal=f"{name}.db"), WRITTEN)
    home.record.note()
    write(home.controller("b"), ToolOffset(1, 2, 3))
    close_files()
    (home.folder / "a.db").write_bytes(b"no database at all" * 100)
    told: list[str] = []
    home.record._tell = told.append
    home.record.try_to_note()
    assert len(told) == 1
    assert "a.db" in told[0]
    with PlantNotes(home.location, "plant") as notes:
        assert notes.cells()["b"].changes == {"done": 2}


def test_a_defect_is_told_and_ends_no_later_look(home):
    told: list[str] = []
    cells = home.record._cells
    home.record._tell = told.append
    home.record._cells = lambda: 1 // 0
    home.record.try_to_note()
    home.record.try_to_note()
    assert told == ["A defect in robolink: ZeroDivisionError: integer division or modulo by zero"]
    home.record._cells = cells
    write(home.add("a"), WRITTEN)
    home.record.try_to_note()
    assert home.states()["a"].changes == {"done": 1}


def test_a_journal_that_did_not_change_is_not_read(home, monkeypatch):
    write(home.add("a"), WRITTEN)
    home.states()
    read: list[str] = []

    def markers(journal: Journal) -> tuple[()]:
        read.append(journal.location)
        return ()

    monkeypatch.setattr(Journal, "open_markers", markers)
    home.states()
    assert read == []
    home.wall.go_on(seconds=home_record.FRESH_S)  # its age shows that its home works
    noted_at = home.states()["a"].noted_at
    assert datetime.fromisoformat(noted_at) == home.wall.now
    assert len(read) == 1


def test_a_cell_whose_home_is_another_computer_is_left_to_that_one(home):
    write(home.add("a"), WRITTEN)
    file = home.folder / "robolink.toml"
    file.write_text(file.read_text() + 'home = "another-computer"\n')
    assert home.states() == {}
    file.write_text(file.read_text().replace("another-computer", platform.node()))
    assert home.states()["a"].changes == {"done": 1}


def test_checks_and_unfinished_jobs_are_noted(home):
    controller = home.add("a")
    home.add("b")
    address = parse_url(load_cell_files().cells["a"].url).address
    journal = open_journal(address=address)
    journal.record_checks([NewCheck(address, "a", True, "No problem found.")])
    journal.record_checks([NewCheck(address, "a", False, "Needs attention: tool_changed.")])
    journal.record_checks([NewCheck("epson+tcp://192.168.0.99:5000", "", True, "Of no cell.")])
    state = home.states()["a"]
    assert (state.well, state.verdict) == (False, "Needs attention: tool_changed.")
    assert state.unsettled_since == ""
    begun_at = "2026-11-30T08:00:00+00:00"
    marker = Marker("op-1", MarkerKind.SET, "TLSet 1", begun_at, {"tool": 1})
    controller.outcomes.begin(marker)
    assert home.states()["a"].unsettled_since == begun_at
    controller.outcomes.clear("op-1", NewEntry(EntryKind.NOT_APPLIED, tool=1))
    state = home.states()["a"]
    assert (state.unsettled_since, state.changes) == ("", {"not_applied": 1})


def test_a_database_that_is_away_is_told_and_made_up_for(home, server_of):
    told: list[str] = []
    write(home.add("a"), WRITTEN)
    home.states()
    home.record._tell = told.append
    with server_of(home.location):
        write(home.controller("a"), ToolOffset(1, 2, 3))
        home.record.try_to_note()
    assert len(told) == 1
    assert home.states()["a"].changes == {"done": 2}


@pytest.mark.soak
def test_a_plant_says_how_many_entries_it_has_no_copy_of(home, server):
    if "://" not in home.location:
        pytest.skip("a file takes no copies")
    write(home.add("a"), WRITTEN)
    write(home.controller("a"), ToolOffset(1, 2, 3))
    home.states()
    journal = open_journal()
    with PlantNotes(home.location, "plant") as notes:
        assert notes.look().behind_count is None  # nothing was ever copied
        with journal.outbox(home.location) as outbox:
            outbox.copy()
        assert notes.look().behind_count == 0
        write(home.controller("a"), WRITTEN)
        home.states()
        behind = notes.look().behind_count
    assert behind == journal.count() - outbox_end(home, journal) > 0


def outbox_end(home, journal):
    with journal.outbox(home.location) as outbox:
        return outbox.witness().number


# ---- unproved becomes kept


def offset_plan(home, cells, **more):
    table = {"schema": "robolink/fleet-plan/1", "kind": "offset", "name": "test", "cells": cells}
    offsets = {cell: {"tool": 1, "x_mm": 12.7} for cell in cells}
    made_at = "2026-11-30T22:00:00+00:00"
    plan = plan_of({**table, "offsets": offsets, **more}, cells=cells, made_at=made_at)
    with FleetStore(home.location, clock=home.wall) as store:
        permitted(store, plan)
    return plan


def ordered(home, plan, cell, offset=WRITTEN, *, reported=True):
    """Write an offset without motion under the order of a plan, as an agent does."""
    controller = home.controller(cell)
    with carrying_out(controller, plan.order(cell), {"tool": 1}) as order:
        wanted = [Wanted(1, offset, controller.tools.read(1))]
        change_tools(controller, wanted, order=order)
    if reported:
        report(home, plan, cell)
    return controller


def report(home, plan, cell):
    with FleetStore(home.location, clock=home.wall) as store:
        turn = store.begin(plan.id, cell)
        ended = store.record_outcome(plan.id, cell, turn.job.attempt, JobOutcome(0))
        assert ended.job.state is JobState.UNPROVED


def job(home, plan, cell="a"):
    home.record.note()
    with FleetStore(home.location, clock=home.wall) as store:
        (found,) = [one for one in store.progress(plan.id).jobs if one.cell == cell]
    return found


def test_a_later_turn_test_of_the_very_value_makes_it_kept(home):
    home.add("a")
    plan = offset_plan(home, ["a"])
    controller = ordered(home, plan, "a")
    assert job(home, plan).state is JobState.UNPROVED
    turned(controller, WRITTEN)
    found = job(home, plan)
    (test,) = controller.outcomes.recorded(kinds=(EntryKind.VERIFY,))
    assert (found.state, found.proof) == (JobState.KEPT, test.number)
    write(controller, ToolOffset(1, 2, 3))  # what is written afterwards takes no proof away
    assert job(home, plan).proof == test.number
    with PlantNotes(home.location, "plant") as notes:
        last = notes.events(0)[-1][1]
    assert (last["event"], last["state"], last["proof"]) == ("outcome", "kept", test.number)


def test_a_turn_test_of_before_the_write_proves_nothing(home):
    home.add("a")
    plan = offset_plan(home, ["a"])
    turned(home.controller("a"), WRITTEN)
    write(home.controller("a"), ToolOffset(1, 2, 3))
    ordered(home, plan, "a")
    assert job(home, plan).state is JobState.UNPROVED


@pytest.mark.parametrize(
    "then",
    [
        "failed",
        "another value",
        "another tool",
        "another cell",
        "put back",
        "put back after the test of another",
        "another value while it was tested",
        "contradicted",
    ],
)
def test_what_does_not_prove_it(home, then):
    home.add("a")
    home.add("b")
    plan = offset_plan(home, ["a"])
    controller = ordered(home, plan, "a")
    match then:
        case "failed":
            with pytest.raises(VerifyError):
                turned(controller, WRITTEN, drift_mm=0.5)
        case "another value":
            turned(controller, ToolOffset(12.701, -3.5, -20))
        case "another tool":
            turned(controller, WRITTEN, tool=2)
        case "another cell":
            turned(home.controller("b"), WRITTEN)
        case "put back":
            turned(controller, WRITTEN, kept=False)
        case "put back after the test of another":
            turned(controller, ToolOffset(12.9, -3.5, -20))
            write(controller, WRITTEN)
        case "another value while it was tested":
            other = [12.9, -3.5, -20, 0, 0, 0]
            of_it = partial(NewEntry, change="c-9", tool=1)
            controller.outcomes.append(
                of_it(EntryKind.READ_BACK, details={"value": other}),
                of_it(EntryKind.VERIFY, details={"passed": True}),
                of_it(EntryKind.DECISION, details={"value": list(WRITTEN.components())}),
            )
        case "contradicted":
            said = {"passed": True, "judgement": {"code": "proof_contradicts_accuracy"}}
            kept = {"value": list(WRITTEN.components())}
            controller.outcomes.append(
                NewEntry(EntryKind.VERIFY, change="c-9", tool=1, details=said),
                NewEntry(EntryKind.DECISION, change="c-9", tool=1, details=kept),
            )
    assert job(home, plan).state is JobState.UNPROVED
    home.restarted()
    assert job(home, plan).state is JobState.UNPROVED


@pytest.mark.parametrize("between", ["written by hand", "by a change", "seen by a change"])
def test_a_value_that_was_put_back_is_proved_by_a_test_of_its_own(home, between):
    home.add("a")
    plan = offset_plan(home, ["a"])
    controller = ordered(home, plan, "a")
    match between:
        case "written by hand":
            write(controller, ToolOffset(1, 2, 3))
            write(controller, WRITTEN)
        case "by a change":
            with pytest.raises(VerifyError):
                turned(controller, ToolOffset(12.9, -3.5, -20), drift_mm=0.5)
        case "seen by a change":
            found = {"before": [1, 2, 3, 0, 0, 0], "requested": list(WRITTEN.components())}
            controller.outcomes.append(NewEntry(EntryKind.INTENT, tool=1, details=found))
    assert job(home, plan).state is JobState.UNPROVED
    turned(controller, WRITTEN)
    (*_, test) = sorted(
        one.number for one in controller.outcomes.recorded(kinds=(EntryKind.VERIFY,))
    )
    found = job(home, plan)
    assert (found.state, found.proof) == (JobState.KEPT, test)
    home.restarted()
    assert job(home, plan).state is JobState.KEPT


def test_a_test_that_comes_while_nobody_looks_counts_and_so_does_one_before_the_outcome(home):
    home.add("a")
    home.add("b")
    plan = offset_plan(home, ["a", "b"], rings=[2])
    turned(ordered(home, plan, "a"), WRITTEN)
    controller = ordered(home, plan, "b", reported=False)  # the agent was killed here
    turned(controller, WRITTEN)
    home.restarted()
    assert job(home, plan).state is JobState.KEPT
    report(home, plan, "b")
    assert job(home, plan, "b").state is JobState.KEPT


def test_a_plan_goes_on_counting_a_proved_job_as_it_did_before(home):
    home.add("a")
    home.add("b")
    plan = offset_plan(home, ["a", "b"], rings=[1, 1])
    turned(ordered(home, plan, "a"), WRITTEN)
    job(home, plan)
    with FleetStore(home.location, clock=home.wall) as store:
        progress = store.progress(plan.id)
        assert [str(one.rule) for one in progress.standing] == ["pause"]
        store.resume(plan.id, "Li", "looked at")
    ordered(home, plan, "b")
    assert {one.state for one in progress.jobs} == {JobState.KEPT, JobState.WAITING}
    assert home.wall.now - datetime(2026, 11, 30, tzinfo=UTC) < timedelta(days=1)


def test_a_cell_of_another_computer_is_noted_there_alone(home, monkeypatch):
    monkeypatch.setattr("platform.node", lambda: "PC7")
    write(home.add("a"), WRITTEN)
    assert home.states()["a"].changes
    noted = home.states()["a"]
    file = home.folder / "robolink.toml"
    file.write_text(f'home = "PC7"\n{file.read_text()}')
    monkeypatch.setattr("platform.node", lambda: "PC8")
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(home.folder / "of-pc8"))
    open_journal().close()  # a journal that knows nothing of the cell
    home.wall.go_on(hours=1)
    home.restarted()
    assert home.states()["a"] == noted
