"""One agent a plant, its lock, its signs of life, and what it does with plans; no cell is real."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from robolink.errors import LeaseHeldError
from robolink.fleet import FleetStore, HaltRule, JobOutcome, JobState, Permit, plan_of
from robolink.fleet.agent import Agent
from robolink.fleet.agent_lock import AgentLock
from robolink.fleet.errors import PlantError
from robolink.fleet.store import statements
from robolink.fleet.watchdog import UNIT, notify
from robolink.journal import this_computer

ROOT = Path(__file__).parents[2]


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.soak)])
def location(request, tmp_path):
    """An empty database of a plant."""
    if request.param == "sqlite":
        shutil.copy(request.getfixturevalue("engine_file"), tmp_path / "plant.db.jobs")
        return str(tmp_path / "plant.db")
    server = request.getfixturevalue("server")
    name = f"plant{time.monotonic_ns()}"
    server.execute(f"CREATE DATABASE {name}")
    return server.url(name)


def plan(kind="check", cells=("a", "b", "c"), **more):
    table = {"schema": "robolink/fleet-plan/1", "kind": kind, "name": "test", "cells": ["*"]}
    return plan_of({**table, **more}, cells=cells, author="Li", made_at="2026-11-30T22:00:00+00:00")


# ---- the lock


def test_a_second_agent_is_refused_by_name_and_follows_the_first(location):
    with AgentLock(location, "plant") as first:
        with pytest.raises(LeaseHeldError, match=f"{os.getpid()}.* is the agent of plant plant"):
            AgentLock(location, "plant").take()
        assert first.is_held()
        with AgentLock(location, "other plant") as other:
            assert other.is_held()
    with AgentLock(location, "plant") as following:
        assert following.is_held()


def test_the_lock_of_a_killed_agent_is_free(location):
    program = (
        "import sys, time\n"
        "from robolink.fleet.agent_lock import AgentLock\n"
        "with AgentLock(sys.argv[1], 'plant'):\n"
        "    print('held', flush=True)\n"
        "    time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-m", "tests._program", program, location],
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        os.kill(process.pid, signal.SIGSTOP)  # frozen, it lives
        with pytest.raises(LeaseHeldError, match=str(process.pid)):
            AgentLock(location, "plant").take()
        process.kill()
        process.wait()
    with AgentLock(location, "plant") as lock:
        assert lock.is_held()


@pytest.mark.soak
def test_a_server_that_was_restarted_has_forgotten_the_lock(server):
    name = f"plant{time.monotonic_ns()}"
    server.execute(f"CREATE DATABASE {name}")
    with AgentLock(server.url(name), "plant") as lock:
        server.stop()
        assert not lock.is_held()
        with pytest.raises(PlantError):
            lock.take()
        server.start()
        lock.take()
        assert lock.is_held()


# ---- signs of life


def test_signs_of_life_go_to_the_service_manager(tmp_path, monkeypatch):
    assert not notify("READY=1")
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(path)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        assert notify("WATCHDOG=1")
        assert manager.recv(64) == b"WATCHDOG=1"
    assert not notify("WATCHDOG=1")  # it is being restarted


@pytest.mark.skipif(sys.platform != "linux", reason="the abstract name space is Linux' own")
def test_signs_of_life_go_to_an_abstract_name(monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(f"\0robolink-test-{os.getpid()}")
        monkeypatch.setenv("NOTIFY_SOCKET", f"@robolink-test-{os.getpid()}")
        assert notify("READY=1")
        assert manager.recv(64) == b"READY=1"


# ---- the agent


class Cells:
    """What is done at cells, and how each job is to end."""

    def __init__(self, **ends):
        self.done: Counter[str] = Counter()
        self.ends = ends

    def __call__(self, plan, cell, permit):
        self.done[plan.order(cell)] += 1
        outcomes = self.ends.get(cell, [JobOutcome(0)])
        return outcomes[min(self.done[plan.order(cell)], len(outcomes)) - 1]


def states(location, made):
    with FleetStore(location) as store:
        progress = store.progress(made.id)
    return {job.cell: job.state for job in progress.jobs}, progress


def is_refused(location):
    """Whether another agent of this home is."""
    with suppress(LeaseHeldError), AgentLock(location, "plant", this_computer()):
        return False
    return True


def test_an_agent_carries_plans_out_and_leaves_the_rest_alone(location, tmp_path):
    recipe = tmp_path / "needle.toml"
    recipe.write_bytes((ROOT / "examples" / "recipes" / "scara-pin.toml").read_bytes())
    cells = Cells(c=[JobOutcome(9, "DeclinedError", what="no")])
    mine, halted, other = plan(), plan(name="halted"), plan(plant="other")
    moving = plan("nozzle_change", recipe=str(recipe))
    with FleetStore(location) as store:
        for one in (mine, halted, other, moving):
            store.add_plan(one)
        store.halt(halted.id, "Li")
        permit(store)
    refused = []

    @contextmanager
    def meanwhile():
        refused.append(is_refused(location))
        yield
        refused.append(is_refused(location))

    Agent(location, "plant", cells, meanwhile=meanwhile).run_until_still()
    assert refused == [True, True]  # what is done meanwhile is done by one process alone
    found, _ = states(location, mine)
    assert found == {"a": JobState.KEPT, "b": JobState.KEPT, "c": JobState.REFUSED}
    assert cells.done == dict.fromkeys((mine.order(cell) for cell in "abc"), 1)
    for one in (halted, other, moving):
        assert set(states(location, one)[0].values()) == {JobState.WAITING}

    # What has ended is not begun again, by another agent either; a plan that somebody changed in
    # the database is told once, and keeps no other from going on.
    changed, late = plan(name="changed"), plan(name="late")
    told: list[str] = []
    with FleetStore(location) as store:
        store.add_plan(changed)
        store.add_plan(late)
        with store._database.transaction() as database:
            database.run(
                "UPDATE plans SET document = replace(document, 'changed', 'bent') "
                "WHERE plan = :plan",
                {"plan": changed.id},
            )
    Agent(location, "plant", cells, tell=told.append).run_until_still()
    assert cells.done.total() == 6
    assert {cells.done[late.order(cell)] for cell in "abc"} == {1}
    assert len(told) == 1
    assert "was changed after it was made" in told[0]


def test_what_a_killed_agent_had_begun_is_looked_up_under_a_halt_too(location):
    """What it had not written yet is not written, and all that is unsettled shows at once."""
    lost = JobOutcome(6, "OutcomeUnknownError", what="no answer")
    writing = plan(
        "offset", rings=["*"], offsets={name: {"tool": 1, "x_mm": 1.0} for name in "abc"}
    )
    reading, permits = plan(), []
    cells = Cells(a=[lost], b=[JobOutcome(0)], c=[lost])

    def act(of, cell, given):
        permits.append(given)
        return cells(of, cell, given)

    with FleetStore(location) as store:
        store.add_plan(writing)
        permit(store)
        with store._database.transaction() as database:  # three at once, as in a later ring
            for cell in "abc":
                where = {"plan": writing.id, "cell": cell, "at": "2026-11-30T22:00:00+00:00"}
                database.run(statements.BEGIN_JOB, where)
        store.add_plan(reading)
        assert store.begin(reading.id, "a").begun
        for one in (writing, reading):
            store.halt(one.id, "Li")
    Agent(location, "plant", act).run_until_still()
    found, progress = states(location, writing)
    unsettled = JobState.UNSETTLED
    assert found == {"a": unsettled, "b": JobState.UNPROVED, "c": unsettled}
    assert permits == [None] * 3
    assert set(states(location, reading)[0].values()) == {JobState.WAITING}
    assert progress.finished


@contextmanager
def running(agent):
    """Have an agent run in a thread."""
    thread = threading.Thread(target=agent.run)
    thread.start()
    try:
        yield
    finally:
        agent.end()
        thread.join(30)


def until(condition, seconds=30):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


@pytest.mark.soak
def test_of_the_first_rings_one_cell_after_the_other_and_then_a_person(location):
    names, rings = ("c0", "c1", "c2", "c3"), [1, 2, "rest"]
    offsets = {name: {"tool": 1, "x_mm": 1.0} for name in names}
    made = plan("offset", names, offsets=offsets, rings=rings)
    at_work, most = [], []

    def act(_plan, cell, given):
        assert given.person == "Li"
        at_work.append(cell)
        most.append(len(at_work))
        time.sleep(0.02)
        at_work.remove(cell)
        return JobOutcome(0)

    with FleetStore(location) as store, running(Agent(location, "plant", act)):
        store.add_plan(made)
        time.sleep(0.3)
        assert most == []  # no permit holds
        permit(store)
        for ended in (1, 3, 4):
            until(lambda: ended == 4 or store.progress(made.id).standing)  # noqa: B023
            until(lambda: len(most) >= ended)  # noqa: B023
            time.sleep(0.1)
            assert len(most) == ended
            if ended < 4:
                assert [one.rule for one in store.progress(made.id).standing] == [HaltRule.PAUSE]
                store.resume(made.id, "Li", "looked at the first")
        until(lambda: store.progress(made.id).finished)
    assert set(most[:3]) == {1}
    assert set(states(location, made)[0].values()) == {JobState.UNPROVED}


def permit(store):
    from robolink.fleet import Permit

    now = datetime.now(UTC)
    store.give_permit(
        Permit(
            0,
            "plant",
            "Li",
            "engineer",
            (now - timedelta(hours=1)).isoformat(timespec="seconds"),
            (now + timedelta(hours=1)).isoformat(timespec="seconds"),
            given_by="Chen",
        )
    )


def test_a_cell_that_is_off_is_tried_again_after_its_pause_and_once_the_clock_is_set_back(location):
    off = JobOutcome(3, "ConnectError", what="not reached")
    cells, ahead = Cells(b=[off, off, JobOutcome(0)]), [timedelta()]
    made = plan()
    with FleetStore(location) as store:
        store.add_plan(made)
    agent = Agent(location, "plant", cells, clock=lambda: datetime.now(UTC) + ahead[0])
    with running(agent):
        with FleetStore(location) as store:
            tried = lambda: store.progress(made.id).jobs[1]  # noqa: E731
            until(lambda: tried().treatment)
            assert tried().attempt == 1
            ahead[0] += timedelta(minutes=3)
            until(lambda: tried().attempt == 2 and tried().state is JobState.WAITING)
            ahead[0] -= timedelta(days=1)
            until(lambda: tried().attempt == 3)
    assert states(location, made)[0]["b"] is JobState.KEPT
    assert cells.done[made.order("b")] == 3


@pytest.mark.soak
def test_a_cell_that_is_off_when_the_window_closes_is_missed_then(location):
    off = JobOutcome(3, "ConnectError", what="not reached")
    now = [datetime(2026, 11, 30, 23, 0).astimezone()]  # in the window, by this computer's clock
    made = plan(window="22:00-05:00")
    agent = Agent(location, "plant", Cells(b=[off]), clock=lambda: now[0])
    with FleetStore(location, clock=lambda: now[0]) as store:
        store.add_plan(made)
        with running(agent):
            until(lambda: all(job.treatment for job in store.progress(made.id).jobs))
            now[0] += timedelta(hours=7)
            until(lambda: store.progress(made.id).finished)
    found, _ = states(location, made)
    assert found == {"a": JobState.KEPT, "b": JobState.MISSED, "c": JobState.KEPT}


def test_a_job_that_moves_a_robot_is_a_persons_and_an_agent_only_ends_it_as_missed(location):
    """What a person tried in vain is not tried again by the agent; the window ends it."""
    now = [datetime(2026, 11, 30, 23, 0).astimezone()]
    recipe = str(ROOT / "examples" / "recipes" / "scara-pin.toml")
    made = plan("recipe", recipe=recipe, rings=["rest"], window="22:00-05:00")
    cells = Cells()
    agent = Agent(location, "plant", cells, clock=lambda: now[0])
    with FleetStore(location, clock=lambda: now[0]) as store:
        store.add_plan(made)
        ends = [str(now[0] + timedelta(days=days)).replace(" ", "T") for days in (-1, 3)]
        store.give_permit(Permit(0, "plant", "Chen", "engineer", *ends))
        turn = store.begin(made.id, "b")
        store.record_outcome(made.id, "b", turn.job.attempt, JobOutcome(3, "ConnectError"))
        with running(agent):
            now[0] += timedelta(hours=7)
            until(lambda: store.progress(made.id).jobs[1].state is JobState.MISSED)
    found, _ = states(location, made)
    assert found == {"a": JobState.WAITING, "b": JobState.MISSED, "c": JobState.WAITING}
    assert not cells.done


def test_a_turn_without_the_database_is_none_for_those_who_watch_the_agent(tmp_path, engine_file):
    place, told = tmp_path / "plant.db", list[str]()
    shutil.copy(engine_file, tmp_path / "plant.db.jobs")
    place.write_bytes(b"no database, and longer than the head of one" * 10)
    agent = Agent(str(place), "plant", lambda *_: JobOutcome(0), tell=told.append)
    agent._run(lambda _still: True)
    assert len(told) == 1
    assert agent.turned_s == 0.0
    place.unlink()
    agent = Agent(str(place), "plant", lambda *_: JobOutcome(0))
    agent.run_until_still()
    assert agent.turned_s > 0


def test_a_unit_watches_the_agent():
    told = UNIT.format(plant="p", user="u", folder="/f", environment="", command="/bin/x")
    assert "\nWatchdogSec=60\n" in told
    assert "\nRestart=always\n" in told
    assert "\nType=notify\n" in told
