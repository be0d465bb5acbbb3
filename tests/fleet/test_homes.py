"""Homes of a plan: which computer begins which job, what others see, and one agent at each."""

import itertools
import json
from datetime import timedelta

import pytest
from robolink_cli import main

from robolink.errors import LeaseHeldError
from robolink.fleet import (
    FleetStore,
    JobOutcome,
    JobState,
    LineJobStore,
    PlanError,
    PlantError,
    PlantVersionError,
    WaitReason,
    line_order_of,
    plan_of,
)
from robolink.fleet.agent import Agent
from robolink.fleet.agent_lock import AgentLock, agent_name
from robolink.fleet.plans import Plan, _id_of
from robolink.fleet.store import migrations
from robolink.journal import computer_key
from tests.fleet import homes_campaign
from tests.fleet._plans import carried_out, cells_of, permitted, plan_with

CELLS = cells_of(6)
HOMES = dict(zip(CELLS, ["PC7", "PC8"] * 3, strict=True))


@pytest.fixture
def at(location, wall):
    """Opens the database as the computer of a name."""
    opened = []

    def computer(name):
        opened.append(FleetStore(location, clock=wall, home=name))
        return opened[-1]

    yield computer
    for store in opened:
        store.close()


ON_A_FILE = pytest.mark.parametrize("location", ["sqlite"], indirect=True)
ON_A_SERVER = pytest.mark.parametrize(
    "location", [pytest.param("postgresql", marks=pytest.mark.soak)], indirect=True
)


@pytest.fixture
def homes(location):
    """Homes of cells; in a file all have one."""
    return HOMES if "://" in location else dict.fromkeys(CELLS, "PC7")


def homed(kind="offset", homes=HOMES, **keys):
    table = {
        "schema": "robolink/fleet-plan/1",
        "kind": kind,
        "name": "test",
        "cells": CELLS,
        **keys,
    }
    if kind == "offset":
        table["offsets"] = {cell: {"tool": 1, "x_mm": 12.0} for cell in CELLS}
    return plan_of(table, cells=CELLS, made_at="2026-11-30T22:00:00+00:00", homes=homes)


# ---- the plan


def test_homes_are_frozen_and_a_plan_without_has_the_id_of_always():
    without = homed(homes={})
    assert without.id == homed(homes=None).id == "e1eecec03ee6"
    assert "homes" not in without.document()
    plan = homed()
    assert plan.id not in (without.id, homed(homes={**HOMES, CELLS[0]: "PC9"}).id)
    assert Plan.from_document(json.loads(json.dumps(plan.document()))) == plan
    moved = {**plan.document(), "homes": {**HOMES, CELLS[0]: "PC9"}}
    with pytest.raises(PlanError, match="changed after it was made"):
        Plan.from_document(moved)


def test_a_cell_that_names_none_has_its_home_here_if_another_names_one(monkeypatch):
    monkeypatch.setattr("platform.node", lambda: "office")
    plan = homed(homes={CELLS[0]: "PC7", "no-cell-of-it": "PC1"})
    assert plan.homes == {CELLS[0]: "PC7", **dict.fromkeys(CELLS[1:], "office")}
    assert homed(homes={"no-cell-of-it": "PC1"}).homes == {}


# ---- whose turn it is


def test_a_job_is_begun_at_its_home_alone(at, homes):
    pc7, pc8 = at("PC7"), at("pc8.")
    plan = homed("check", homes)
    pc7.add_plan(plan)
    for cell in CELLS:
        here, elsewhere = (pc7, pc8) if homes[cell] == "PC7" else (pc8, pc7)
        turn = elsewhere.begin(plan.id, cell)
        assert (turn.begun, turn.why, turn.job.state) == (
            False,
            WaitReason.HOME,
            JobState.WAITING,
        )
        assert here.begin(plan.id, cell).begun
        again = elsewhere.begin(plan.id, cell)  # nor is one that runs handed out elsewhere
        assert (again.begun, again.why, again.job.state) == (
            False,
            WaitReason.HOME,
            JobState.RUNNING,
        )
        assert here.begin(plan.id, cell).begun
        here.record_outcome(plan.id, cell, 1, JobOutcome(0))
        assert elsewhere.begin(plan.id, cell).job.state is JobState.KEPT
    assert pc7.progress(plan.id).finished


@pytest.mark.parametrize("stranger", ["PC70", "pc7.plant.local", "PC", ""])
def test_a_name_that_is_nearly_the_same_is_another_computer(at, homes, stranger):
    plan = homed("check", homes)
    at("PC7").add_plan(plan)
    assert at(stranger).begin(plan.id, CELLS[0]).why is WaitReason.HOME


@ON_A_SERVER
def test_rings_halts_and_cells_at_work_are_counted_together(at):
    pc7, pc8 = at("PC7"), at("PC8")
    plan = permitted(pc7, homed(rings=[2, "rest"], at_once=2))
    assert pc8.begin(plan.id, CELLS[1]).begun
    assert pc7.begin(plan.id, CELLS[0]).why is WaitReason.BUDGET  # one of a first ring
    pc8.record_outcome(plan.id, CELLS[1], 1, JobOutcome(0))
    carried_out(pc7, plan, CELLS[0])
    assert pc8.begin(plan.id, CELLS[3]).why is WaitReason.PAUSE
    pc8.resume(plan.id, "Chen", "looked")
    assert pc8.begin(plan.id, CELLS[3]).begun
    assert pc7.begin(plan.id, CELLS[2]).why is WaitReason.BUDGET
    pc8.record_outcome(plan.id, CELLS[3], 1, JobOutcome(6, "OutcomeUnknownError"))
    assert pc7.begin(plan.id, CELLS[2]).why is WaitReason.HALTED


def test_a_plan_without_homes_is_carried_out_by_the_computer_that_begins(at, location):
    pc7, pc8 = at("PC7"), at("PC8")
    plan = plan_with(6, "check")
    pc7.add_plan(plan)
    assert pc8.begin(plan.id, CELLS[0]).begun
    if "://" in location:
        assert pc7.begin(plan.id, CELLS[1]).why is WaitReason.HOME
        assert pc7.begin(plan.id, CELLS[0]).begun is False
        assert pc7.progress(plan.id).bound_to == "PC8"
    else:  # the file is this computer's, whatever it is called by now
        assert pc7.begin(plan.id, CELLS[1]).begun
    assert pc8.begin(plan.id, CELLS[2]).begun


@ON_A_SERVER
def test_a_plan_without_homes_is_no_other_computers_once_an_agent_was_heard(at):
    pc7, laptop = at("PC7"), at("laptop")
    plan = plan_with(6, "check")
    pc7.add_plan(plan)
    pc7.hear_home("another plant")
    assert laptop.progress(plan.id).is_at_home(CELLS[0], "laptop")  # any, as long as none is heard
    pc7.hear_home("plant")
    assert laptop.begin(plan.id, CELLS[0]).why is WaitReason.HOME
    assert not laptop.progress(plan.id).is_at_home(CELLS[0], "laptop")
    assert pc7.progress(plan.id).bound_to == ""
    assert pc7.begin(plan.id, CELLS[0]).begun
    assert pc7.progress(plan.id).bound_to == "PC7"


@ON_A_SERVER
def test_a_computer_without_all_cells_does_not_begin_a_plan_without_homes(at):
    pc7, pc8 = at("PC7"), at("PC8")
    plan = plan_with(6, "check")
    pc7.add_plan(plan)
    with pytest.raises(PlanError, match=f"this one has no {CELLS[5]}"):
        pc8.begin(plan.id, CELLS[0], cells=CELLS[:5])
    assert pc7.progress(plan.id).jobs[0].state is JobState.WAITING
    assert pc7.begin(plan.id, CELLS[0], cells=[*CELLS, "other"]).begun


@ON_A_SERVER
def test_what_a_line_orders_is_carried_out_by_the_computer_that_took_it(at, location, wall):
    asked = line_order_of({"order": "A-17", "cell": CELLS[0], "kind": "check"})
    plan = asked.plan("mes", cells=CELLS, recipes={})
    with LineJobStore(location, clock=wall, home="PC7") as panel:
        for _ in range(2):
            panel.order_job("mes", asked, plan)
    assert at("PC8").begin(plan.id, CELLS[0]).why is WaitReason.HOME
    assert at("PC7").begin(plan.id, CELLS[0]).begun


@ON_A_FILE
def test_a_file_takes_no_plan_of_several_computers(at):
    store = at("PC7")
    with pytest.raises(PlanError, match=r"at home on PC8, and .*plant\.db is a file of this") as no:
        store.add_plan(homed("check"))
    assert "PostgreSQL" in no.value.remedy
    assert store.plans() == ()
    alone = homed("check", homes=dict.fromkeys(CELLS, "pc7"))
    store.add_plan(alone)
    assert carried_out(store, alone, CELLS[0]).job.state is JobState.KEPT


# ---- what is heard


@ON_A_SERVER
def test_each_home_whose_agent_is_silent_shows_since_when(at, wall):
    pc7, pc8 = at("PC7"), at("PC8")
    plan = homed("check")
    pc7.add_plan(plan)
    pc8.hear_home("plant")
    wall.now += timedelta(seconds=59)
    pc7.hear_home("plant")
    pc7.hear_home("another plant")

    def whys():
        progress = pc8.progress(plan.id)
        return [progress.why(job) for job in progress.jobs[:2]]

    assert whys() == [WaitReason.TURN, WaitReason.TURN]
    wall.now += timedelta(seconds=1)
    assert whys() == [WaitReason.TURN, WaitReason.HOME]
    wall.now += timedelta(days=1)
    assert whys() == [WaitReason.HOME, WaitReason.HOME]
    left = {one.home: one.heard_at for one in pc8.progress(plan.id).homes_left()}
    assert left == {"PC7": "2026-11-30T23:00:59+00:00", "PC8": "2026-11-30T23:00:00+00:00"}
    assert [(one.plant, one.home) for one in pc7.homes()] == [
        ("another plant", "PC7"),
        ("plant", "PC7"),
        ("plant", "PC8"),
    ]
    pc8.hear_home("plant")
    assert whys() == [WaitReason.HOME, WaitReason.TURN]


def test_a_plan_that_moves_robots_waits_for_no_agent(at, tmp_path, homes):
    store = at("PC7")
    values = {"kind": "nozzle_change", "recipe": "r.toml", "recipe_hash": "0"}
    said = {**homed("check", homes).document(), **values}
    plan = Plan.from_document({**said, "plan": _id_of(said)})
    store.add_plan(plan)
    assert WaitReason.HOME not in store.progress(plan.id).waits()


def test_status_tells_the_homes(at, location, monkeypatch, capsys):
    monkeypatch.setenv("ROBOLINK_PLANT", location)
    monkeypatch.setattr("platform.node", lambda: "office")
    pc7 = at("PC7")
    plan = homed("check", dict.fromkeys(CELLS, "PC7"))
    pc7.add_plan(plan)

    def told(*words):
        assert main.run(["cell", "fleet", "status", *words]) == 0
        return capsys.readouterr().out

    job = json.loads(told(plan.id, "--why", CELLS[1], "--json"))
    assert (job["home"], job["why"]) == ("PC7", "home")
    assert json.loads(told("--json"))["homes"] == []
    for words in ([plan.id, "--why", CELLS[1]], [plan.id]):
        assert "PC7: its agent was never heard" in told(*words)
    pc7.hear_home("plant")
    (home,) = json.loads(told("--json"))["homes"]
    assert (home["home"], home["heard_at"]) == ("PC7", "2026-11-30T23:00:00+00:00")
    assert "PC7: its agent was heard last" in told(plan.id)
    assert "PC7" in told()


# ---- an agent that ends when nothing is left to do


@pytest.fixture
def jobs_database(server):
    return server.empty_database()


@pytest.mark.soak
@pytest.mark.parametrize("heard", [True, False])
def test_run_waits_for_a_home_at_work_and_not_for_a_silent_one(
    jobs_database, wall, monkeypatch, heard
):
    monkeypatch.setattr("platform.node", lambda: "PC7")
    plan = homed(
        "check",
        {**dict.fromkeys(CELLS, "PC7"), CELLS[1]: "PC8"},
        rings=[CELLS[1], "rest"],
        auto=True,
    )
    turns = itertools.count()
    with FleetStore(jobs_database, clock=wall, home="PC8") as pc8:
        pc8.add_plan(plan)
        if heard:
            pc8.hear_home("plant")

        def clock():
            if next(turns) == 6 and heard:
                carried_out(pc8, plan, CELLS[1])
            return wall.now

        done = []

        def act(_plan, cell, _permit):
            done.append(cell)
            return JobOutcome(0)

        Agent(jobs_database, "plant", act, clock=clock).run_until_still()
        assert sorted(done) == ([CELLS[0], *CELLS[2:]] if heard else [])
        assert pc8.progress(plan.id).finished is heard


@pytest.mark.soak
@pytest.mark.timeout(400)
def test_agents_of_two_homes_that_are_killed_write_once_and_each_at_its_own(server, tmp_path):
    found = homes_campaign.carried_out(tmp_path, 12, 3, server.empty_database(), seed=1)
    assert (found["written"], found["kills"], len(found["heard"])) == (12, 3, 2)
    for count in ("written_twice", "lost", "by_the_wrong_home", "not_on_record_at_home"):
        assert found[count] == 0, found


# ---- one agent at each


@pytest.mark.soak
def test_a_computer_without_all_cells_of_a_plan_makes_it_not_its_own(jobs_database, monkeypatch):
    plan, done, told = plan_with(2, "check"), [], list[str]()
    with FleetStore(jobs_database) as store:
        store.add_plan(plan)

        def carried_out_by(name, cells):
            def act(_plan, cell, _permit):
                done.append((name, cell))
                return JobOutcome(0)

            monkeypatch.setattr("platform.node", lambda: name)
            agent = Agent(jobs_database, "plant", act, cells=lambda: cells, tell=told.append)
            agent.run_until_still()

        carried_out_by("PC8", CELLS[1:])
        assert (done, store.progress(plan.id).bound_to) == ([], "")
        assert (
            f"waits for a computer that has all of its cells; this one has no {CELLS[0]}"
            in (told[0])
        )
        carried_out_by("PC7", CELLS)
        assert sorted(done) == [("PC7", cell) for cell in plan.cells]


@pytest.mark.soak
def test_an_agent_waits_for_its_own_lock_on_a_connection_that_was_lost(jobs_database):
    agent = Agent(jobs_database, "plant", lambda *_: JobOutcome(0))
    with AgentLock(jobs_database, "plant", agent.home) as lost:
        with pytest.raises(PlantError, match="still keeps this agent's lock"):
            agent._keep_lock()
        lost.release()  # as the server does, once it has noticed
        agent._keep_lock()
        assert agent._lock.is_held()
        agent._lock.release()


def test_a_second_agent_of_a_home_is_refused_and_one_of_another_is_not(location):
    with AgentLock(location, "plant", "PC7"):
        with pytest.raises(LeaseHeldError, match="is the agent of plant plant"):
            AgentLock(location, "plant", "pc7").take()
        if "://" in location:
            with AgentLock(location, "plant", "PC8") as other:
                assert other.is_held()
        else:  # one computer has the file
            with pytest.raises(LeaseHeldError):
                AgentLock(location, "plant", "PC8").take()
    assert agent_name("plant", "") == "plant"
    assert agent_name("plant", "PC7.") == "plant@pc7"


# ---- versions


def test_the_tables_of_the_first_version_are_brought_up_to_date(at, monkeypatch):
    old = plan_with(6, "check")
    with monkeypatch.context() as then:
        then.setattr(migrations, "MIGRATIONS", migrations.MIGRATIONS[:1])
        first = at("PC7")
        with first._database.transaction() as database:
            database.run(
                "INSERT INTO plans (plan, plant, made_at, document, cancelled_at) VALUES "
                "(:plan, :plant, :at, :document, '')",
                {
                    "plan": old.id,
                    "plant": old.plant,
                    "at": old.made_at,
                    "document": json.dumps(old.document()),
                },
            )
        first.close()
    store = at("PC7")
    assert store.plan(old.id) == old
    assert store.progress(old.id).bound_to == ""
    store.hear_home("plant")


def test_an_agent_ends_where_a_newer_robolink_has_changed_the_tables(at):
    store, other = at("PC7"), at("PC7")
    store.hear_home("plant")
    with other._database.transaction() as database:
        database.run("UPDATE fleet_version SET version = version + 1")
    with pytest.raises(PlantVersionError, match="is newer than this robolink"):
        store.hear_home("plant")
    with pytest.raises(PlantVersionError, match="is newer than this robolink"):
        at("PC8").homes()


def test_names_are_compared_without_capitals_and_the_last_dot():
    assert computer_key("PC7.Plant.LOCAL.") == "pc7.plant.local"
