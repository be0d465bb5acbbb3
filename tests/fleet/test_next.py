"""Jobs that a person carries out at a cell: once, after a yes there, and never lost."""

import time
from contextlib import ExitStack
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from robolink_cli.commands.fleet.job_gate import JobGate
from robolink_cli.session.cell_plans import due_at_cells, jobs_at

import robolink
from robolink.errors import (
    BusyError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    StoppedError,
)
from robolink.fleet import FleetStore, HaltRule, JobState, WaitReason, default_plant, plan_of
from robolink.journal import open_journal
from robolink.model import EntryKind, MarkerKind
from robolink.transaction import Wanted, change_tools
from tests._commands import run_command
from tests.fleet._moving_cells import NEW, OLD, PersonAtCell

SCARA = Path(__file__).parents[2] / "examples" / "recipes" / "scara-pin.toml"
SOAK = pytest.mark.soak


def orders():
    return list(open_journal().entries(kinds=(EntryKind.ORDER,)))


def test_a_job_is_shown_agreed_to_carried_out_and_reported(cells):
    plan = cells.plan()
    person = PersonAtCell()
    ended = person.run("a", "--json", "--nozzle", "N-7")
    assert ended.code == 0, ended.err
    assert person.asked[0] == "Carry out this job now?"
    for shown in (plan.id, "needles", plan.recipe_hash[:12], "ring 1 of 2", "Chen", "tool 1"):
        assert shown in ended.err
    job = ended.document["job"]
    assert (job["state"], job["exit_code"], job["permit"]) == ("kept", 0, "Chen")
    assert cells.tool("a").components() == pytest.approx(NEW.components(), abs=2e-3)
    (order,) = orders()
    assert (order.details["order"], order.change) == (plan.order("a"), job["change"])
    (done,) = open_journal().entries(kinds=(EntryKind.DONE,))
    assert (done.signature.operator, done.signature.nozzle) == ("Chen", "N-7")
    answered = [
        one for one in open_journal().entries() if plan.id in str(one.details.get("question"))
    ]
    assert [one.details["answer"] for one in answered] == ["yes"]
    kept = cells.job(plan, "a")
    assert (kept.state, kept.change, kept.attempt) == (JobState.KEPT, job["change"], 1)
    again = PersonAtCell().run("a", plan.id)
    assert (again.code, cells.writes("a")) == (1, 1)
    assert "has ended here: done, on record" in again.out
    (waits,) = PersonAtCell().run("b", "--json").document["waiting"]
    assert waits["why"] == "pause", "after the ring, a person looks"
    cells.store.resume(plan.id, "Li", "looked at")
    assert PersonAtCell().run("b").code == 0


def check_waiting(cells, plan, cell="a"):
    """Nothing of the job was begun, and the next yes carries it out."""
    job = cells.job(plan, cell)
    assert (job.state, job.attempt, cells.writes(cell)) == (JobState.WAITING, 0, 0)
    assert orders() == []


def test_a_no_leaves_the_job_waiting(cells):
    plan = cells.plan()
    ended = PersonAtCell("n").run("a")
    assert ended.code == 9, ended.err
    check_waiting(cells, plan)
    assert PersonAtCell().run("a").code == 0


def test_without_a_person_nothing_begins(cells):
    plan = cells.plan()
    ended = run_command("-c", "a", "fleet", "next")
    assert ended.code == 9
    assert "there is nobody to ask" in ended.err
    check_waiting(cells, plan)
    assert run_command("-c", "a", "fleet", "next", "--yes").code == 2


def test_a_no_to_the_new_value_is_the_end_of_the_job(cells):
    """By then it had begun: the person has seen the value and refused it."""
    plan = cells.plan()
    person = PersonAtCell("y", "y", "y", "n")
    ended = person.run("a")
    assert ended.code == 9, ended.err
    assert "Write these values to tool 1?" in person.asked[-1]
    job = cells.job(plan, "a")
    assert (job.state, job.code, job.error) == (JobState.REFUSED, 9, "DeclinedError")
    assert (cells.tool("a"), cells.writes("a")) == (OLD, 0)
    assert [halt.rule for halt in cells.store.progress(plan.id).standing] == [HaltRule.FIRST_RING]
    assert "did not do what it was asked" in ended.err
    again = PersonAtCell().run("a", plan.id)
    assert (again.code, cells.writes("a")) == (1, 0)


def test_a_no_to_the_movement_leaves_the_job_waiting(cells):
    """It is asked under the order, before anything was begun."""
    plan = cells.plan(recipe=str(SCARA))
    person = PersonAtCell("y", "n")
    ended = person.run("a", "--nozzle", "N-1")
    assert ended.code == 9, ended.err
    assert "Is everybody out of the cell?" in person.asked[-1]
    check_waiting(cells, plan)
    assert cells.simulators["a"].machine.arm.moves_started == 0


def test_a_job_of_another_plant_or_home_is_not_offered_here(cells):
    elsewhere = cells.plan(plant="west", permitted=False)
    with FleetStore(default_plant(), home="PC8") as pc8:
        table = {**TABLE, "recipe": "needle.toml", "cells": ["a"]}
        path, homes = cells.folder / "plan.toml", {"a": "PC8"}
        other = plan_of(table, cells=["a"], path=path, homes=homes)
        pc8.add_plan(other)
    cells.permit(elsewhere)
    cells.permit(other)
    assert due_at_cells("plant") == {}
    assert due_at_cells("west")["a"].plan == elsewhere
    ended = PersonAtCell().run("a", "--json")
    (waits,) = ended.document["waiting"]
    assert (ended.code, waits["plan"], waits["why"]) == (1, other.id, "home")
    ended = PersonAtCell().run("a", elsewhere.id)
    assert ended.code == 2
    assert "add --plant west" in ended.err
    for plan in (elsewhere, other):
        check_waiting(cells, plan)
    here = cells.plan()
    assert due_at_cells("plant")["a"].plan == here


TABLE = {"schema": "robolink/fleet-plan/1", "kind": "recipe", "name": "needles"}


@pytest.fixture
def later(monkeypatch):
    """Makes it twelve hours later by the clock of this computer, in another zone."""
    offset = datetime.now().astimezone().utcoffset() or timedelta()

    def in_another_zone():
        monkeypatch.setenv("TZ", f"XXX{-12 - round(offset.total_seconds() / 3600)}")
        time.tzset()

    yield in_another_zone
    monkeypatch.delenv("TZ", raising=False)
    time.tzset()


HELD_BACK = ("cancelled", "revoked", "another permit")


@pytest.mark.parametrize(
    "meanwhile",
    ["halted", *(pytest.param(one, marks=SOAK) for one in HELD_BACK), "window"],
)
def test_what_holds_a_plan_back_after_it_was_shown_holds_the_job_back(cells, later, meanwhile):
    hour = datetime.now().astimezone().hour
    window = f"{(hour - 2) % 24:02}:00-{(hour + 2) % 24:02}:00"
    plan = cells.plan(permitted=False, window=window)
    permit = cells.permit(plan)
    person = PersonAtCell()

    def act(_number):
        match meanwhile:
            case "halted":
                cells.store.halt(plan.id, "Li", "the line stands")
            case "cancelled":
                cells.store.cancel(plan.id, "Li")
            case "another permit":
                cells.permit(plan)
            case "window":
                later()
        if "permit" in meanwhile or meanwhile == "revoked":
            cells.store.revoke_permit(permit.number, "Li")

    person.before = act
    ended = person.run("a")
    assert ended.code == 5, ended.err
    assert "Nothing was begun" in ended.err
    job = cells.job(plan, "a")
    expected = JobState.CANCELLED if meanwhile == "cancelled" else JobState.WAITING
    assert (job.state, job.attempt, cells.writes("a"), orders()) == (expected, 0, 0, [])


def test_each_plan_says_why_no_job_is_due(cells):
    plan = cells.plan(permitted=False)
    other = cells.plan(name="held", permitted=False)
    cells.store.halt(other.id, "Li")
    ended = run_command("-c", "a", "fleet", "next", "--json")
    assert ended.code == 1
    waits = {one["plan"]: one["why"] for one in ended.document["waiting"]}
    assert waits == {plan.id: "permit", other.id: "halted"}
    cells.permit(plan)
    ended = run_command("-c", "b", "fleet", "next")
    assert f"Plan {plan.id} (needles) waits here for: an earlier ring is not finished" in ended.out
    assert PersonAtCell().run("a", other.id).code == 1
    assert cells.writes("a") == 0


def test_a_plan_is_started_and_says_at_which_cells_a_person_is_waited_for(cells):
    plan = cells.plan(starts=False)
    assert PersonAtCell().run("a").code == 1
    ended = run_command("fleet", "run", plan.id)
    assert ended.code == 1, ended.err
    assert f"robolink -c a fleet next {plan.id}" in ended.out
    assert "1 waiting: a person at the cell" in ended.out
    progress = cells.store.progress(plan.id)
    assert [progress.why(job) for job in progress.jobs] == [WaitReason.PERSON, WaitReason.RING]
    cells.store.begin(plan.id, "a")
    assert "a: running since" in run_command("fleet", "status", plan.id).out


def test_a_plan_for_no_person_is_refused_by_name(cells):
    check = cells.plan(kind="check", recipe=None, rings=[])
    ended = PersonAtCell().run("a", check.id)
    assert (ended.code, "needs no person" in ended.err) == (2, True)
    moving = cells.plan(cells=["b"], rings=[1])
    ended = PersonAtCell().run("a", moving.id)
    assert (ended.code, "has no cell a" in ended.err) == (2, True)


def test_only_the_frozen_recipe_is_run_wherever_it_lies(cells):
    plan = cells.plan()
    file = cells.folder / "needle.toml"
    frozen = file.read_text()
    file.write_text(frozen + "# another\n")
    ended = PersonAtCell().run("a")
    assert (ended.code, "is not the one of plan" in ended.err) == (2, True)
    check_waiting(cells, plan)
    (cells.folder / "recipes").mkdir()
    (cells.folder / "recipes" / "kept.toml").write_text(frozen)
    assert PersonAtCell().run("a").code == 0
    (done,) = open_journal().entries(kinds=(EntryKind.DONE,))
    assert done.signature.recipe_hash == plan.recipe_hash


def test_a_change_that_was_typed_by_hand_is_not_the_job(cells):
    plan = cells.plan()
    by_hand = ("change", "needle.toml", "--order", plan.order("a"), "--yes")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(cells.folder)
        assert run_command("-c", "a", *by_hand).code == 0
    ended = PersonAtCell().run("a")
    assert ended.code == 2
    assert (cells.job(plan, "a").state, cells.writes("a")) == (JobState.REFUSED, 1)


def test_who_has_the_permit_is_one_of_the_people_of_the_cell(cells):
    plan = cells.plan()
    with (cells.folder / "robolink.toml").open("a") as file:
        file.write('[cells.a.people]\nSato = "engineer"\n')
    ended = PersonAtCell().run("a")
    assert (ended.code, "'Chen' is not among the people" in ended.err) == (2, True)
    check_waiting(cells, plan)
    assert PersonAtCell().run("a", "--operator", "Sato").code == 0
    (done,) = open_journal().entries(kinds=(EntryKind.DONE,))
    assert done.signature.operator == "Sato"


def test_without_the_plants_database_nothing_begins(cells, location, server_of):
    plan = cells.plan()
    person = PersonAtCell()
    with ExitStack() as away:
        person.before = lambda _number: away.enter_context(server_of(location))
        ended = person.run("a")
        assert ended.code == 2, ended.err
        assert (cells.writes("a"), orders()) == (0, [])
    cells.store.close()
    check_waiting(cells, plan)


@pytest.mark.parametrize("reporter", ["status", pytest.param("next", marks=SOAK)])
def test_an_end_that_could_not_be_reported_is_reported_from_the_record(
    cells, location, server_of, reporter
):
    plan = cells.plan()
    person = PersonAtCell()
    with ExitStack() as away:
        person.before = lambda number: number == 2 and away.enter_context(server_of(location))
        ended = person.run("a")
        assert ended.code == 0, ended.err
        assert f"robolink -c a fleet next {plan.id}" in ended.err
    cells.store.close()
    assert (cells.job(plan, "a").state, cells.writes("a")) == (JobState.RUNNING, 1)
    if reporter == "status":
        ended = run_command("fleet", "status", plan.id, "--why", "a", "--json")
        assert ended.document["state"] == "kept"
    else:
        ended = run_command("-c", "a", "fleet", "next", "--json")
        assert ended.document["job"]["state"] == "kept"
    assert ended.code == 0, ended.err
    job = cells.job(plan, "a")
    assert (job.state, job.change, cells.writes("a")) == (JobState.KEPT, orders()[0].change, 1)


def test_a_job_that_was_interrupted_ends_with_its_cancelled_plan(cells):
    plan = cells.plan()
    cells.store.begin(plan.id, "a")
    cells.store.cancel(plan.id, "Li")
    ended = PersonAtCell().run("a")
    assert ended.code == 5, ended.err
    job = cells.job(plan, "a")
    assert (job.state, cells.writes("a"), orders()) == (JobState.CANCELLED, 0, [])


def test_an_interrupted_job_that_a_person_declines_stays_interrupted(cells):
    plan = cells.plan()
    cells.store.begin(plan.id, "a")
    assert PersonAtCell("n").run("a").code == 9
    assert cells.job(plan, "a").state is JobState.RUNNING
    person = PersonAtCell()
    ended = person.run("a")
    assert ended.code == 0, ended.err
    assert "robolink does not know yet how it ended" in ended.out
    job = cells.job(plan, "a")
    assert (job.state, job.attempt, cells.writes("a")) == (JobState.KEPT, 1, 1)


def test_two_people_with_the_same_job_carry_it_out_once(cells):
    plan = cells.plan()
    first, second = PersonAtCell(), PersonAtCell()
    others = []

    def meanwhile(number):
        if number == 2:  # begun, and asked whether the new value is right
            others.append(second.run("a"))

    first.before = meanwhile
    ended = first.run("a")
    assert ended.code == 0, ended.err
    (other,) = others
    assert other.code == 5, other.err
    job = cells.job(plan, "a")
    assert (job.state, job.attempt, cells.writes("a")) == (JobState.KEPT, 1, 1)


@pytest.mark.parametrize("question", [1, 2])
def test_ctrl_c_ends_what_was_begun_and_nothing_else(cells, question):
    plan = cells.plan()
    person = PersonAtCell()

    def interrupt(number):
        if number == question:
            raise KeyboardInterrupt

    person.before = interrupt
    assert person.run("a").code == 130
    job = cells.job(plan, "a")
    if question == 1:
        check_waiting(cells, plan)
        return
    assert (job.state, job.code, cells.writes("a")) == (JobState.REFUSED, 130, 0)
    assert orders()[0].details["ended"]["as"] == "StoppedError"
    assert PersonAtCell().run("a", plan.id).code == 1
    assert cells.writes("a") == 0


def test_a_refusal_that_could_not_be_reported_is_reported_as_one(cells, location, server_of):
    plan = cells.plan()
    person = PersonAtCell("y", "y", "y", "n")
    with ExitStack() as away:
        person.before = lambda number: number == 4 and away.enter_context(server_of(location))
        assert person.run("a").code == 9
    cells.store.close()
    assert cells.job(plan, "a").state is JobState.RUNNING
    ended = run_command("fleet", "status", plan.id, "--json")
    job, *_ = ended.document["jobs"]
    assert (job["state"], job["exit_code"], job["error"]) == ("refused", 9, "DeclinedError")
    assert [one["rule"] for one in ended.document["halts"]] == ["first_ring"]
    assert cells.writes("a") == 0


def test_what_is_unsettled_there_begins_nothing_and_halts_only_an_interrupted_job(cells):
    plan = cells.plan()
    with robolink.connect(cells.simulators["a"].url) as other:
        marker = other.begin(MarkerKind.SET, "TLSet 1", {"tool": 1})
    assert PersonAtCell().run("a").code == 6
    check_waiting(cells, plan)
    cells.store.begin(plan.id, "a")
    assert PersonAtCell().run("a").code == 6
    assert cells.job(plan, "a").state is JobState.UNSETTLED
    with robolink.connect(cells.simulators["a"].url) as other:
        other.finish(marker)
    assert PersonAtCell().run("a").code == 1, "the plan is halted"
    cells.store.resume(plan.id, "Li", "recovered")
    assert PersonAtCell().run("a").code == 0
    job = cells.job(plan, "a")
    assert (job.state, job.attempt, cells.writes("a")) == (JobState.KEPT, 2, 1)


def test_another_computer_than_the_cells_home_neither_begins_nor_reports(cells):
    plan = cells.plan()
    text = (cells.folder / "robolink.toml").read_text()
    (cells.folder / "robolink.toml").write_text('home = "elsewhere"\n' + text)
    person = PersonAtCell()
    ended = person.run("a")
    assert (ended.code, person.asked) == (2, [])
    assert "The home of a is elsewhere" in ended.err
    check_waiting(cells, plan)
    (cells.folder / "robolink.toml").write_text(text)
    cells.store.begin(plan.id, "a")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(JobGate, "end", lambda *_: None)
        assert PersonAtCell().run("a").code == 0
    (cells.folder / "robolink.toml").write_text('home = "elsewhere"\n' + text)
    assert run_command("fleet", "status", plan.id).code == 0
    assert cells.job(plan, "a").state is JobState.RUNNING
    (cells.folder / "robolink.toml").write_text(text)
    assert run_command("fleet", "status", plan.id).code == 0
    assert cells.job(plan, "a").state is JobState.KEPT


# ---- what ends a delivery after, before and beside its job


def planned_at(cells, cell="a"):
    return next(one for one in jobs_at(cells.store, "plant", cell) if one.is_due)


def kept_by(gate, controller, then=None):
    """Keep the new value by a job, and end as ``then`` says; report what became of it."""
    with gate.carrying_out(controller) as order:
        gate.begin()
        change_tools(controller, [Wanted(1, NEW, OLD)], order=order)
        if then is not None:
            raise then


@pytest.mark.parametrize(
    ("then", "code", "state"),
    [
        (StoppedError("Somebody stopped it."), 0, JobState.KEPT),
        pytest.param(KeyboardInterrupt(), 0, JobState.KEPT, marks=SOAK),
        pytest.param(
            NotReadyError("Open.", reason=NotReadyReason.GUARD_OPEN), 0, JobState.KEPT, marks=SOAK
        ),
        pytest.param(ZeroDivisionError("a defect"), 0, JobState.KEPT, marks=SOAK),
        (OutcomeUnknownError("Nobody knows where it stands."), 6, JobState.UNSETTLED),
    ],
)
def test_what_comes_after_the_value_is_kept_takes_nothing_back(cells, then, code, state):
    """As a stop does on the way to the safe pose."""
    plan = cells.plan()
    gate = JobGate(cells.store, planned_at(cells))
    with robolink.connect(cells.simulators["a"].url) as controller, pytest.raises(type(then)):
        kept_by(gate, controller, then)
    gate.end(then)
    job = cells.job(plan, "a")
    assert (job.state, job.code, cells.writes("a")) == (state, code, 1)
    if code == 0:
        assert job.change == orders()[0].change
        assert str(then) in job.what


def test_a_stop_before_the_value_is_kept_is_the_end_of_the_job(cells):
    plan, stop = cells.plan(), StoppedError("Somebody stopped it.")
    gate = JobGate(cells.store, planned_at(cells))
    with robolink.connect(cells.simulators["a"].url) as controller, pytest.raises(StoppedError):
        with gate.carrying_out(controller):
            gate.begin()
            raise stop
    gate.end(stop)
    assert (cells.job(plan, "a").state, cells.job(plan, "a").code) == (JobState.REFUSED, 10)


@pytest.mark.parametrize(
    "defect",
    [ZeroDivisionError("a defect"), pytest.param(OSError(28, "no space left"), marks=SOAK)],
)
def test_after_a_defect_the_resumed_plan_delivers_the_job_again(cells, defect):
    plan = cells.plan()
    gate = JobGate(cells.store, planned_at(cells))
    with robolink.connect(cells.simulators["a"].url) as controller, pytest.raises(type(defect)):
        with gate.carrying_out(controller):
            gate.begin()
            raise defect
    gate.end(defect)
    assert [halt.rule for halt in cells.store.progress(plan.id).standing] == [HaltRule.CAUSE]
    cells.store.resume(plan.id, "Li", "mended")
    assert PersonAtCell().run("a").code == 0
    assert (cells.job(plan, "a").state, cells.writes("a")) == (JobState.KEPT, 1)


def test_a_plan_that_is_resumed_while_an_order_is_looked_up_begins_nothing(cells):
    """Nobody was asked, because only a look was meant."""
    plan = cells.plan()
    cells.store.begin(plan.id, "a")
    cells.store.halt(plan.id, "Li")
    gate = JobGate(cells.store, planned_at(cells))
    cells.store.resume(plan.id, "Li", "the line runs")
    with robolink.connect(cells.simulators["a"].url) as controller:
        with pytest.raises(BusyError, match="nobody here has agreed") as held:
            with gate.carrying_out(controller):
                pytest.fail("it was begun")
    assert gate.end(held.value) is None
    assert (cells.job(plan, "a").state, orders()) == (JobState.RUNNING, [])
    person = PersonAtCell()
    assert person.run("a").code == 0
    assert person.asked[0] == "Carry out this job now?"


def test_what_is_unsettled_at_another_computer_is_not_of_the_job_at_its_home(cells, location):
    cells.store.home = "PC7"
    plan = cells.plan(homes={"a": "PC7", "b": "PC7"})
    cells.store.begin(plan.id, "a")
    with FleetStore(location, home="PC8") as pc8:
        gate = JobGate(pc8, planned_at(cells))
        with robolink.connect(cells.simulators["a"].url) as controller:
            controller.begin(MarkerKind.SET, "TLSet 1", {"tool": 1})
            with pytest.raises(OutcomeUnknownError) as seen, gate.carrying_out(controller):
                pytest.fail("it was begun")
        assert gate.end(seen.value) is None
    assert cells.job(plan, "a").state is JobState.RUNNING
