"""What is no cell's fault: the plan halts, and who resumes it has the same cells carried out."""

# ruff: noqa: F401, F811 - fixtures of another module

import errno

import pytest
from robolink_cli.session.cell_plans import outcome_of

from robolink.fleet import HaltRule, JobOutcome, JobState, Treatment
from robolink.journal import open_journal
from robolink.model import EntryKind
from tests.fleet._plans import carried_out, permitted, plan_with
from tests.fleet.test_acts import (  # the fixtures
    PERMIT,
    acts,
    cell_file,
    plan,
    simulator,
    tool_of,
    treatment,
)

FULL = JobOutcome(2, "JournalError", what="no space left on device")
GUARD = JobOutcome(5, "NotReadyError", "guard_open", what="the guard is open")


def test_a_cause_that_is_no_cells_is_no_refusal_and_ends_with_the_resume(store):
    made = permitted(store, plan_with(40, rings=[1, 1, 20, "rest"], at_once=20))
    for (cell,) in made.rings[:2]:
        carried_out(store, made, cell)
        store.resume(made.id, "Li", "looked at it")
    cells = made.rings[2]
    for cell in cells:
        assert store.begin(made.id, cell).begun
    rules = []
    for cell, outcome in [(cells[0], GUARD), *((cell, FULL) for cell in cells[1:16])]:
        ended = store.record_outcome(made.id, cell, 1, outcome)
        rules += [ended.halt.rule] if ended.halt else []
    assert rules == [HaltRule.CAUSE]

    # While it stands nothing of it begins; then the sixteen do, and what a cell refused does not.
    assert not store.begin(made.id, cells[1]).begun
    store.resume(made.id, "Li", "the disk has room again")
    assert store.begin(made.id, cells[0]).job.state is JobState.REFUSED
    for cell in cells[1:16]:
        assert carried_out(store, made, cell).job.state is JobState.UNPROVED


def test_a_backup_that_finds_no_room_closes_no_order(acts, simulator, tmp_path):
    in_the_way = tmp_path / "state" / "backups"
    in_the_way.parent.mkdir(exist_ok=True)
    in_the_way.write_text("a file where the folder has to be")
    full = acts(plan("offset"), "a", PERMIT)
    assert (full.error, treatment(full)) == ("JournalError", Treatment.HALT)
    assert simulator.machine.flash_writes == 0
    assert not list(open_journal().entries(kinds=(EntryKind.ORDER,)))
    in_the_way.unlink()
    assert acts(plan("offset"), "a", PERMIT).code == 0
    assert tool_of(simulator).x_mm == 12.7


@pytest.mark.parametrize("kind", ["offset", "backup"])
def test_where_no_stop_could_reach_a_controller_nothing_is_done_there(
    kind,
    acts,
    simulator,
    monkeypatch,
):
    def full(*_arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("robolink.stopping._listener._publish", full)
        ended = acts(plan(kind), "a", PERMIT)
    assert (ended.code, ended.error, treatment(ended)) == (2, "PlantError", Treatment.HALT)
    assert "No space left on device" in ended.what
    assert simulator.machine.flash_writes == 0
    assert acts(plan(kind), "a", PERMIT).code == 0


def test_what_may_be_unproved_stays_so_whatever_broke_afterwards():
    assert outcome_of(OSError(errno.EIO, "disk")).code == 2
    assert outcome_of(ZeroDivisionError("x")).code == 70
