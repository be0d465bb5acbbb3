"""The store of a plant on both databases: the gate, the outcomes, the halts, the permits."""

import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from robolink.fleet import (
    FleetStore,
    HaltRule,
    JobOutcome,
    JobState,
    Permit,
    PlanError,
    PlantError,
    WaitReason,
)
from robolink.fleet.store import statements
from tests.contract.journal._postgresql import asked
from tests.fleet._plans import carried_out, cells_of, permitted, plan_with, usual
from tests.fleet.conftest import Wall

UNSETTLED = JobOutcome(6, "OutcomeUnknownError", what="no answer")
OFF = JobOutcome(3, "ConnectError", what="no route")
BUSY = JobOutcome(5, "LeaseHeldError", what="Li is at work")
REFUSED = JobOutcome(5, "NotReadyError", "guard_open", what="the guard is open")
FIRST, SECOND = cells_of(2)

EACH_DATABASE = pytest.mark.parametrize("location", ["sqlite", "postgresql"], indirect=True)
"""For what the two could do differently; the other tests run on PostgreSQL with soak."""


def state_of(store, plan, cell):
    return next(job.state for job in store.progress(plan.id).jobs if job.cell == cell)


def why(store, plan, cell):
    return store.begin(plan.id, cell).why


def test_a_plan_is_read_as_it_was_frozen_and_kept_once(store, open_store):
    plan = plan_with()
    store.add_plan(plan)
    store.add_plan(plan)
    assert open_store().plan(plan.id) == plan
    assert store.plans() == (plan,)
    assert [job.cell for job in store.progress(plan.id).jobs] == list(plan.cells)


def test_the_outcome_is_on_record_for_others_when_the_call_returns(store, open_store):
    plan = permitted(store, plan_with(kind="backup"))
    carried_out(store, plan, FIRST, JobOutcome(0, change="c-1"))
    job = open_store().progress(plan.id).jobs[0]
    assert (job.state, job.code, job.change, job.attempt) == (JobState.KEPT, 0, "c-1", 1)


def test_a_job_that_was_killed_is_handed_out_again_as_the_same_attempt(store, open_store):
    plan = permitted(store, plan_with())
    assert store.begin(plan.id, FIRST).job.attempt == 1
    store.close()
    again = open_store().begin(plan.id, FIRST)
    assert again.begun
    assert again.job.attempt == 1


def test_a_job_that_was_killed_does_nothing_anew_while_the_plan_may_not_go_on(store, wall):
    plan = permitted(store, plan_with(window="22:00-05:00"))
    assert store.begin(plan.id, FIRST).may_write

    def may_write():
        turn = store.begin(plan.id, FIRST)
        assert turn.begun
        return turn.may_write

    store.halt(plan.id, "Chen")
    assert not may_write()
    store.resume(plan.id, "Chen", "")
    assert may_write()
    wall.go_on(hours=7)
    assert not may_write()
    wall.go_on(hours=17)
    assert may_write()
    store.revoke_permit(1, "Wang")
    assert not may_write()
    permitted(store, plan)
    assert may_write()
    store.cancel(plan.id, "Chen")
    assert not may_write()


def test_an_outcome_that_is_delivered_again_changes_nothing(store):
    plan = permitted(store, plan_with())
    first = carried_out(store, plan, FIRST)
    before = store.progress(plan.id)
    again = store.record_outcome(plan.id, FIRST, 1, REFUSED)
    assert again.repeated
    assert again.job == first.job
    assert store.progress(plan.id) == before


def test_that_something_is_unsettled_is_believed_after_another_outcome_too(store):
    plan = permitted(store, plan_with(auto=True))
    carried_out(store, plan, FIRST, JobOutcome(0, corrections=(usual(),)))
    late = store.record_outcome(plan.id, FIRST, 1, UNSETTLED)
    assert late.halt is not None
    assert late.halt.rule is HaltRule.UNSETTLED
    assert state_of(store, plan, FIRST) is JobState.UNSETTLED
    assert why(store, plan, SECOND) is WaitReason.HALTED
    assert store.record_outcome(plan.id, FIRST, 1, UNSETTLED).repeated


@pytest.mark.parametrize(
    "outcome", [REFUSED, UNSETTLED, JobOutcome(9, "DeclinedError"), JobOutcome(130)]
)
def test_what_ended_for_a_person_is_not_run_again_by_delivery(store, outcome):
    plan = permitted(store, plan_with(kind="check"))
    carried_out(store, plan, FIRST, outcome)
    turn = store.begin(plan.id, FIRST)
    assert not turn.begun
    assert turn.job.state.final


def test_an_attempt_that_was_never_begun_has_no_outcome(store):
    plan = permitted(store, plan_with())
    with pytest.raises(PlanError, match="never begun"):
        store.record_outcome(plan.id, FIRST, 1, JobOutcome(0))
    with pytest.raises(PlanError, match="has no cell"):
        store.begin(plan.id, "nowhere")


def test_a_cell_that_is_off_is_tried_again_and_missed_when_the_window_closes(store, wall):
    plan = permitted(store, plan_with(kind="check", window="22:00-05:00"))
    tried = carried_out(store, plan, FIRST, OFF)
    assert tried.job.state is JobState.WAITING
    progress = store.progress(plan.id)
    assert progress.why(progress.jobs[0]) is WaitReason.CELL_OFF
    assert store.begin(plan.id, FIRST).job.attempt == 2
    store.record_outcome(plan.id, FIRST, 2, OFF)
    wall.go_on(hours=6)
    assert store.begin(plan.id, FIRST).job.state is JobState.MISSED
    assert why(store, plan, SECOND) is WaitReason.WINDOW


def test_a_cell_that_was_never_tried_waits_for_the_next_night(store, wall):
    plan = permitted(store, plan_with(kind="check", window="22:00-05:00"))
    wall.go_on(hours=6)
    assert why(store, plan, FIRST) is WaitReason.WINDOW
    wall.go_on(hours=18)
    assert store.begin(plan.id, FIRST).begun


def test_tries_have_a_cap(store):
    plan = permitted(store, plan_with(kind="check"))
    states = [carried_out(store, plan, FIRST, BUSY).job.state for _ in range(20)]
    assert states == [JobState.WAITING] * 19 + [JobState.MISSED]


def test_one_job_at_a_cell_at_a_time_whatever_the_plan(store):
    one, other = permitted(store, plan_with(kind="check")), plan_with(kind="backup")
    store.add_plan(other)
    assert store.begin(one.id, FIRST).begun
    assert why(store, other, FIRST) is WaitReason.CELL_BUSY
    store.record_outcome(one.id, FIRST, 1, JobOutcome(0))
    assert store.begin(other.id, FIRST).begun


def test_no_more_cells_are_at_work_than_the_plan_allows(store):
    plan = permitted(store, plan_with(kind="check", at_once=2))
    first, second, third = cells_of(3)
    assert store.begin(plan.id, first).begun
    assert store.begin(plan.id, second).begun
    assert why(store, plan, third) is WaitReason.BUDGET


def test_the_second_ring_of_a_writing_plan_goes_cell_by_cell(store):
    plan = permitted(store, plan_with(8))
    first, second, third = cells_of(3)
    carried_out(store, plan, first, JobOutcome(0, corrections=(usual(),)))
    store.resume(plan.id, "Chen", "looked at it")
    assert store.begin(plan.id, second).begun
    assert why(store, plan, third) is WaitReason.BUDGET


def test_without_a_permit_nothing_that_writes_begins(store, wall):
    plan = plan_with(permit="north")
    store.add_plan(plan)
    assert why(store, plan, FIRST) is WaitReason.PERMIT
    begins, ends = "2026-11-30T23:30:00+00:00", "2026-12-01T01:00:00+00:00"
    permit = store.give_permit(
        Permit(0, plan.plant, "Chen", "engineer", begins, ends, "north", given_by="Li")
    )
    assert why(store, plan, FIRST) is WaitReason.PERMIT
    wall.go_on(hours=1)
    assert store.begin(plan.id, FIRST).begun
    store.record_outcome(plan.id, FIRST, 1, BUSY)
    store.revoke_permit(permit.number, "Wang")
    assert why(store, plan, FIRST) is WaitReason.PERMIT
    (kept,) = store.permits()
    assert (kept.person, kept.given_by, kept.revoked_by) == ("Chen", "Li", "Wang")


@pytest.mark.parametrize(
    "permit",
    [
        Permit(0, "plant", "Chen", "engineer", "2026-11-30", "2026-12-31", group="south"),
        Permit(0, "plant", "Chen", "engineer", "2026-11-30", "2026-12-31", plan="other"),
    ],
)
def test_a_permit_of_another_group_or_plan_does_not_count(store, permit):
    plan = plan_with(permit="north")
    assert not permit.holds(plan, "2026-12-01T00:00:00+00:00")


def test_a_permit_for_nothing_known_is_refused(store):
    store.add_plan(plan_with())
    with pytest.raises(PlanError, match="No plan of plant nroth"):
        store.give_permit(Permit(0, "nroth", "Chen", "engineer", "2026-11-30", "2026-12-31"))
    with pytest.raises(PlanError, match="There is no plan"):
        permit = Permit(0, "plant", "Chen", "engineer", "2026-11-30", "2026-12-31", plan="x")
        store.give_permit(permit)


def test_a_ring_waits_for_the_one_before_and_then_for_a_person(store):
    plan = permitted(store, plan_with())
    assert plan.sizes == (1, 4, 1)
    assert why(store, plan, SECOND) is WaitReason.RING
    ended = carried_out(store, plan, FIRST, JobOutcome(0, corrections=(usual(),)))
    assert ended.halt is not None
    assert ended.halt.rule is HaltRule.PAUSE
    assert why(store, plan, SECOND) is WaitReason.PAUSE
    (lifted,) = store.resume(plan.id, "Chen", "the first cell is well")
    assert (lifted.rule, lifted.lifted_by) == (HaltRule.PAUSE, "Chen")
    assert store.begin(plan.id, SECOND).begun


def test_an_automatic_plan_waits_all_the_same_where_nothing_is_on_record(store):
    plan = permitted(store, plan_with(auto=True))
    bare = JobOutcome(0, corrections=(usual(),))
    assert carried_out(store, plan, FIRST, bare).halt is None
    for cell in plan.rings[1][:3]:
        carried_out(store, plan, cell, bare)
    last = carried_out(store, plan, plan.rings[1][3], JobOutcome(0))
    assert last.halt is not None
    assert last.halt.rule is HaltRule.PAUSE


@pytest.mark.parametrize("kind", ["check", "offset"])
def test_an_automatic_plan_waits_where_a_cell_did_not_do_what_was_asked(store, kind):
    plan = permitted(store, plan_with(9, kind, rings=[1, 2, 2, "rest"], auto=True, at_once=1))
    well = JobOutcome(0, corrections=() if kind == "check" else (usual(),))
    for cell in plan.rings[0] + plan.rings[1]:
        assert carried_out(store, plan, cell, well).halt is None
    assert carried_out(store, plan, plan.rings[2][0], REFUSED).halt is None
    paused = carried_out(store, plan, plan.rings[2][1], well).halt
    assert paused is not None
    assert paused.rule is HaltRule.PAUSE


@pytest.mark.parametrize(
    ("outcome", "rule"),
    [
        (UNSETTLED, HaltRule.UNSETTLED),
        (JobOutcome(70, "KeyError"), HaltRule.CAUSE),
        (JobOutcome(2, "JournalError"), HaltRule.CAUSE),
        (REFUSED, HaltRule.FIRST_RING),
    ],
)
def test_what_chance_cannot_do_halts_at_once(store, outcome, rule):
    plan = permitted(store, plan_with())
    halt = carried_out(store, plan, FIRST, outcome).halt
    assert halt is not None
    assert (halt.rule, halt.cell) == (rule, FIRST)
    assert why(store, plan, SECOND) is WaitReason.HALTED


def test_a_first_cell_that_stays_off_halts(store, wall):
    plan = permitted(store, plan_with(window="22:00-05:00"))
    carried_out(store, plan, FIRST, OFF)
    wall.go_on(hours=7)
    assert why(store, plan, SECOND) is WaitReason.HALTED
    (halt,) = store.progress(plan.id).standing
    assert halt.rule is HaltRule.FIRST_RING


def test_what_runs_when_a_plan_halts_comes_to_its_end(store):
    plan = permitted(store, plan_with(kind="check"))
    assert store.begin(plan.id, FIRST).begun
    store.halt(plan.id, "Chen", "the line stands")
    assert store.record_outcome(plan.id, FIRST, 1, JobOutcome(0)).job.state is JobState.KEPT
    assert why(store, plan, SECOND) is WaitReason.HALTED
    store.resume(plan.id, "Chen", "the line runs")
    assert store.begin(plan.id, SECOND).begun


def test_a_person_halts_a_plan_once_and_it_is_resumed_once(store):
    plan = permitted(store, plan_with(kind="check"))
    first = store.halt(plan.id, "Chen")
    other = store.halt(plan.id, "Li")
    assert store.halt(plan.id, "Chen", "again") == first
    assert store.halt(plan.id, "Li") == other
    assert store.progress(plan.id).standing == (first, other)
    store.resume(plan.id, "Chen", "")
    with pytest.raises(PlanError, match="is not halted"):
        store.resume(plan.id, "Chen", "")


@pytest.mark.parametrize(
    ("outcome", "rule"),
    [
        (JobOutcome(70, "KeyError"), HaltRule.CAUSE),
        (REFUSED, HaltRule.FIRST_RING),
        (JobOutcome(0, corrections=(usual(),)), HaltRule.PAUSE),
        (UNSETTLED, HaltRule.UNSETTLED),
    ],
)
def test_a_halt_that_is_found_under_another_is_not_lost(store, outcome, rule):
    plan = permitted(store, plan_with())
    attempt = store.begin(plan.id, FIRST).job.attempt
    store.halt(plan.id, "Chen")
    found = store.record_outcome(plan.id, FIRST, attempt, outcome).halt
    assert found is not None
    assert found.rule is rule
    store.halt(plan.id, "Li")
    rules = [halt.rule for halt in store.progress(plan.id).standing]
    assert rules == [HaltRule.PERSON, rule, HaltRule.PERSON]


def test_what_a_halt_held_back_is_tried_again_at_once_when_it_is_lifted(store):
    plan = permitted(store, plan_with(kind="check"))
    attempt = store.begin(plan.id, FIRST).job.attempt
    store.halt(plan.id, "Chen")
    store.record_outcome(plan.id, FIRST, attempt, JobOutcome(5, "BusyError", what="held back"))
    store.resume(plan.id, "Chen", "the line runs")
    progress = store.progress(plan.id)
    assert progress.why(progress.jobs[0]) is WaitReason.TURN
    assert store.begin(plan.id, FIRST).job.attempt == attempt + 1


def test_a_halt_that_nobody_saw_is_not_lifted(store):
    plan = permitted(store, plan_with())
    carried_out(store, plan, FIRST, JobOutcome(0, corrections=(usual(),)))
    (seen,) = store.progress(plan.id).standing
    later = store.halt(plan.id, "Chen")
    (lifted,) = store.resume(plan.id, "Chen", "looked at it", seen=seen)
    assert lifted.number == seen.number
    assert store.progress(plan.id).standing == (later,)
    assert why(store, plan, SECOND) is WaitReason.HALTED


def test_a_person_halts_a_plan_that_pauses(store):
    plan = permitted(store, plan_with())
    carried_out(store, plan, FIRST, JobOutcome(0, corrections=(usual(),)))
    assert store.halt(plan.id, "Chen").rule is HaltRule.PERSON
    assert why(store, plan, SECOND) is WaitReason.HALTED
    assert len(store.resume(plan.id, "Chen", "both")) == 2


def test_a_cancelled_plan_begins_nothing_more(store):
    plan = permitted(store, plan_with(kind="check"))
    assert store.begin(plan.id, FIRST).begun
    assert store.cancel(plan.id, "Chen") == 5
    store.record_outcome(plan.id, FIRST, 1, JobOutcome(0))
    with pytest.raises(PlanError, match="was cancelled"):
        store.resume(plan.id, "Chen", "after all")
    assert store.begin(plan.id, SECOND).job.state is JobState.CANCELLED
    assert store.progress(plan.id).finished


@pytest.mark.parametrize("outcome", [BUSY, OFF])
def test_of_a_cancelled_plan_a_busy_cell_is_not_tried_again(store, outcome):
    plan = permitted(store, plan_with())
    assert store.begin(plan.id, FIRST).begun
    assert store.cancel(plan.id, "Chen") == 5
    ended = store.record_outcome(plan.id, FIRST, 1, outcome)
    assert (ended.job.state, ended.halt) == (JobState.CANCELLED, None)
    progress = store.progress(plan.id)
    assert progress.finished
    assert [halt.rule for halt in progress.halts] == [HaltRule.PERSON]
    assert store.record_outcome(plan.id, FIRST, 1, UNSETTLED).job.state is JobState.UNSETTLED


@EACH_DATABASE
def test_two_outcomes_at_once_halt_once(open_store):
    """Each by a connection of its own; hawkBit rolled the halt back (hawkbit issue 2161)."""
    stores = [open_store() for _ in range(6)]
    plan = permitted(stores[0], plan_with(kind="check"))
    for store, cell in zip(stores, plan.cells, strict=True):
        assert store.begin(plan.id, cell).begun
    with ThreadPoolExecutor(6) as pool:
        ended = list(
            pool.map(
                lambda pair: pair[0].record_outcome(plan.id, pair[1], 1, UNSETTLED),
                zip(stores, plan.cells, strict=True),
            )
        )
    assert sum(one.halt is not None for one in ended) == 1
    progress = stores[0].progress(plan.id)
    assert len(progress.halts) == 1
    assert {job.state for job in progress.jobs} == {JobState.UNSETTLED}
    assert sorted(job.sequence for job in progress.jobs) == [1, 2, 3, 4, 5, 6]


def test_one_of_many_deliveries_at_once_is_recorded(open_store):
    stores = [open_store() for _ in range(4)]
    plan = permitted(stores[0], plan_with(kind="check"))
    assert stores[0].begin(plan.id, FIRST).begun
    outcomes = [JobOutcome(0), REFUSED, JobOutcome(0), REFUSED]
    with ThreadPoolExecutor(4) as pool:
        ended = list(
            pool.map(
                lambda pair: pair[0].record_outcome(plan.id, FIRST, 1, pair[1]),
                zip(stores, outcomes, strict=True),
            )
        )
    assert sum(not one.repeated for one in ended) == 1
    assert len({one.job for one in ended}) == 1


@EACH_DATABASE
def test_begun_at_once_by_two_agents_is_begun_once(open_store):
    stores = [open_store() for _ in range(4)]
    plan = permitted(stores[0], plan_with(kind="check", at_once=1))
    with ThreadPoolExecutor(4) as pool:
        turns = list(
            pool.map(
                lambda pair: pair[0].begin(plan.id, pair[1]),
                zip(stores, cells_of(4), strict=True),
            )
        )
    assert sum(turn.begun for turn in turns) == 1
    assert {turn.why for turn in turns if not turn.begun} == {WaitReason.BUDGET}


def course(store, plan, cells, off_mm):
    """Carry jobs out; return the first halt."""
    for cell in cells:
        outcome = JobOutcome(0, corrections=(usual(off_mm),))
        halt = carried_out(store, plan, cell, outcome).halt
        if halt is not None:
            return halt
    return None


def test_cells_that_move_alike_halt_at_the_fifth_and_a_person_accepts_the_shift(store):
    plan = permitted(store, plan_with(60, auto=True, at_once=1))
    halt = course(store, plan, plan.cells, 0.2)
    assert halt is not None
    assert (halt.rule, halt.cell, halt.numbers["cells"]) == (HaltRule.SHIFT, plan.cells[4], 5)
    store.resume(plan.id, "Chen", "needles of another length")
    assert course(store, plan, plan.cells[5:30], 0.2) is None
    again = course(store, plan, plan.cells[30:], 0.0)
    assert again is not None
    assert again.rule is HaltRule.SHIFT


def test_a_right_plan_comes_to_its_end(store):
    plan = permitted(store, plan_with(40, auto=True))
    offs = [0.03, -0.04, 0.01, -0.02] * 10
    for cell, off_mm in zip(plan.cells, offs, strict=True):
        assert course(store, plan, [cell], off_mm) is None
    progress = store.progress(plan.id)
    assert progress.finished
    assert progress.counts() == {JobState.UNPROVED: 40}
    assert progress.halts == ()


RECORDER = """
import sys
from robolink.fleet import FleetStore, JobOutcome
location, plan = sys.argv[1:]
store = FleetStore(location)
for cell in store.plan(plan).cells:
    turn = store.begin(plan, cell)
    # Each in one write, so that a killed process tells whole lines.
    print(f"begun {cell}\\n", end="", flush=True)
    store.record_outcome(plan, cell, turn.job.attempt, JobOutcome(0, change=cell))
    print(f"ended {cell}\\n", end="", flush=True)
"""


@EACH_DATABASE
def test_what_a_killed_process_was_told_is_on_record(open_store, location, wall):
    store = open_store()
    plan = permitted(store, plan_with(400, kind="check"))
    command = [sys.executable, "-m", "tests._program", RECORDER, location, plan.id]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        told = [process.stdout.readline().split() for _ in range(41)]
        process.kill()
        told += [line.split() for line in process.stdout]
    jobs = {job.cell: job for job in store.progress(plan.id).jobs}
    for what, cell in told:
        assert jobs[cell].attempt == 1
        if what == "ended":
            assert (jobs[cell].state, jobs[cell].change) == (JobState.KEPT, cell)
    running = [cell for cell, job in jobs.items() if job.state is JobState.RUNNING]
    assert len(running) <= 1
    for cell in running:
        assert store.begin(plan.id, cell).job.attempt == 1


def require_found_again(store, away):
    """Lose a database in the midst of a job; the same store is to go on once it is there again."""
    plan = permitted(store, plan_with(kind="check"))
    attempt = store.begin(plan.id, FIRST).job.attempt
    with away, pytest.raises(PlantError, match=r"cannot be used|was moved"):
        store.record_outcome(plan.id, FIRST, attempt, JobOutcome(0))
    assert store.begin(plan.id, FIRST).begun
    store.record_outcome(plan.id, FIRST, attempt, JobOutcome(0))
    assert store.record_outcome(plan.id, FIRST, attempt, JobOutcome(0)).repeated


def test_a_database_that_comes_back_is_found_again(open_store, location, server_of):
    require_found_again(open_store(), server_of(location))


def test_a_server_that_cut_its_connections_is_found_again(server):
    url = server.empty_database()
    with FleetStore(url) as store:
        require_found_again(store, server.closed(url))


@EACH_DATABASE
def test_many_that_open_a_new_database_at_once_make_it_once(open_store):
    stores = [open_store() for _ in range(8)]
    plan = plan_with(kind="check")
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda store: store.add_plan(plan), stores))
    assert len(stores[0].plans()) == 1
    assert len(stores[0].progress(plan.id).jobs) == 6


def test_a_job_that_the_closed_window_interrupts_waits_for_the_next_one(store, wall):
    plan = permitted(store, plan_with(kind="check", window="22:00-05:00"))
    assert store.begin(plan.id, FIRST).begun
    wall.go_on(hours=7)
    turn = store.begin(plan.id, FIRST)
    assert turn.begun
    assert not turn.may_write
    held_back = JobOutcome(5, "BusyError", what="The plan may not begin anything now.")
    store.record_outcome(plan.id, FIRST, turn.job.attempt, held_back)
    assert why(store, plan, SECOND) is WaitReason.WINDOW
    assert store.end_vain(plan.id).jobs[0].state is JobState.WAITING
    wall.go_on(hours=17)
    assert store.begin(plan.id, FIRST).begun
    store.record_outcome(plan.id, FIRST, 2, BUSY)  # somebody else had the cell all the time
    wall.go_on(hours=7)
    assert store.end_vain(plan.id).jobs[0].state is JobState.MISSED


@pytest.mark.soak
def test_a_home_that_is_frozen_in_a_transaction_holds_up_the_others_for_seconds(server):
    url = server.empty_database()
    with FleetStore(url) as store:
        stuck, other = plan_with(name="stuck"), plan_with(name="other")
        for plan in (stuck, other):
            store.add_plan(plan)
        with store._database.transaction() as database:  # a computer that is cut off ends as soon
            names = ("keepalives_idle", "keepalives_interval", "keepalives_count", "user_timeout")
            shown = [database.rows(f"SHOW tcp_{name}")[0][0] for name in names]
            assert shown == ["5", "2", "3", "10000"]
        command = [sys.executable, "-m", "tests._program", FROZEN, url, stuck.id]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            process.stdout.readline()
            process.send_signal(signal.SIGSTOP)
            begun, tried = time.monotonic(), 0
            try:
                while not halted(url, other):
                    tried += 1
                    assert time.monotonic() - begun < 20
            finally:
                process.kill()
        assert tried, "the lock was held at first"
        assert store.progress(other.id).standing


FROZEN = """
import sys, time
from robolink.fleet import FleetStore
from robolink.fleet.store import statements
with FleetStore(sys.argv[1]) as store, store._database.transaction() as database:
    store._course(database, sys.argv[2])
    database.run(statements.NEXT_EVENT)
    print(flush=True)
    time.sleep(60)
"""


def halted(url, plan):
    try:
        with FleetStore(url) as store:
            return store.halt(plan.id, "Li")
    except PlantError:
        return None


@pytest.mark.soak
def test_who_begins_takes_the_cell_before_the_events_as_who_ends(server):
    """Else two plans at one cell wait for each other, and the server undoes one of them."""
    url, wall = server.empty_database(), Wall()
    night = plan_with(kind="check", window="22:00-05:00")
    day = plan_with(kind="backup", name="day")
    with FleetStore(url, clock=wall) as store:
        for plan in (night, day):
            store.add_plan(plan)
        carried_out(store, night, SECOND, OFF)
        assert store.begin(day.id, FIRST).begun
        wall.go_on(hours=7)  # so that the next begin of the night ends a job

        def waiting():
            query = "SELECT count(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock'"
            return asked(url, query)[0][0]

        def waits_for(count):
            deadline = time.monotonic() + 5
            while waiting() != count:
                assert time.monotonic() < deadline

        def elsewhere(act):
            with FleetStore(url, clock=wall) as other:
                return act(other)

        with ThreadPoolExecutor(2) as pool:
            with store._database.transaction() as database:
                database.run(statements.NEXT_EVENT)
                begins = pool.submit(elsewhere, lambda one: one.begin(night.id, FIRST))
                waits_for(1)
                ends = pool.submit(
                    elsewhere, lambda one: one.record_outcome(day.id, FIRST, 1, JobOutcome(0))
                )
                waits_for(2)
            assert begins.result().why is WaitReason.WINDOW
            assert ends.result().job.state is JobState.KEPT
        assert state_of(store, night, SECOND) is JobState.MISSED


# ---- years of ended plans


LOOKS = (
    (statements.OPEN_PLANS, {"plant": "plant", "cell": ""}),
    (statements.OPEN_LINE_JOBS, {"line": "mes"}),
    (statements.RECENT_PLANS, {"plant": "plant", "since": "9", "most": 20}),
)


def test_what_is_open_is_found_without_a_look_at_what_has_ended(store, location):
    server = "://" in location
    numbers = [{"n": n, "plan": f"p{n:05d}", "at": f"2026-{n:05d}"} for n in range(3000)]
    # With documents as long as those of plans; a server reads a table of a few pages whole.
    document = "x" * 1000 if server else "{}"
    with store._database.transaction() as database:
        database.run_many(
            "INSERT INTO plans (plan, plant, made_at, document, cancelled_at) "
            f"VALUES (:plan, 'plant', :at, '{document}', '')",
            numbers,
        )
        database.run_many(
            "INSERT INTO outcomes (plan, cell, ring, place, state, attempt, begun_at, ended_at, "
            "code, error, reason, what, change, treatment, judged, corrections, sequence) VALUES "
            "(:plan, 'a', 0, :n, 'kept', 1, '', '', 0, '', '', '', '', '', 0, '', 1)",
            numbers,
        )
        database.run_many(
            "INSERT INTO line_jobs (line, order_id, plan, cell, posted_at, body) "
            "VALUES ('mes', :plan, :plan, 'a', '', '{}')",
            numbers,
        )
        if server:
            for table in ("plans", "outcomes", "line_jobs"):
                database.run(f"ANALYZE {table}")
    whole = ("Seq Scan on",) if server else ("SCAN plans", "SCAN outcomes", "SCAN line_jobs")
    by_plant = "SEARCH plans USING INDEX plans_by_time (plant=?)"
    ask = "EXPLAIN " if server else "EXPLAIN QUERY PLAN "
    for statement, values in LOOKS:
        with store._database.transaction() as database:
            steps = [str(row[-1]) for row in database.rows(ask + statement, values)]
        assert steps
        assert [step for step in steps if step.strip("- >").startswith((*whole, by_plant))] == []
