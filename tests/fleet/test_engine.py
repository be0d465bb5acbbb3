"""The engine: what is handed out is begun once, one job a cell, and survives a kill.

Real databases, real threads, a real kill; jobs write to files and touch no cell.
"""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter

import pytest
from sqlalchemy import text

from robolink.fleet.engine import Engine, JobEndedError, QueuePlace
from robolink.fleet.errors import PlantError


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.soak)])
def url(request, tmp_path):
    """The address of an empty database of the engine's own."""
    if request.param == "sqlite":
        file = shutil.copy(request.getfixturevalue("engine_file"), tmp_path)
        return f"sqlite:///{file}"
    server = request.getfixturevalue("server")
    name = f"fleet{time.monotonic_ns()}"
    server.execute(f"CREATE DATABASE {name}")
    return server.url(name)


def jobs(*names):
    return {name: name.split("/")[1] for name in names}


class Cells:
    """Jobs that are counted, and told apart by what their names say."""

    def __init__(self):
        self.begun: Counter[str] = Counter()
        self.at_work: Counter[str] = Counter()
        self.clashes = []
        self.most = 0
        self.go = threading.Event()
        self._lock = threading.Lock()

    def __call__(self, order):
        cell = order.split("/")[1]
        with self._lock:
            self.begun[order] += 1
            self.at_work[cell] += 1
            self.most = max(self.most, self.at_work.total())
            if self.at_work[cell] > 1:
                self.clashes.append(order)
        if order.startswith("stays"):
            assert self.go.wait(30)
        with self._lock:
            self.at_work[cell] -= 1
        if order.startswith("refused"):
            raise JobEndedError("the cell said no")


def test_no_thread_outlives_an_engine_whose_job_another_one_took_over(url):
    def taken_over(_order):
        with engine._database.begin() as transaction:
            transaction.execute(text(f"UPDATE {schema}workflow_status SET owner_xid = 'another'"))
        over.set()

    def threads():
        return {one for one in threading.enumerate() if not one.daemon} - before

    schema = "dbos." if "://" in url and "sqlite" not in url else ""
    over, before = threading.Event(), {*threading.enumerate()}
    engine = Engine(url, "plant", taken_over, workers=1)
    engine.start()
    engine.hand_out(jobs("a/c1"))
    assert over.wait(30)
    time.sleep(1.5)  # it asks for the result once a second
    assert threads()
    assert engine.stop(10) == frozenset()
    deadline = time.monotonic() + 20
    while threads():
        assert time.monotonic() < deadline, threads()
        time.sleep(0.05)


def until(engine, condition):
    deadline = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < deadline
        engine.wait_for_news(0.05)


@pytest.fixture
def cells():
    return Cells()


@pytest.fixture
def engine(url, cells):
    engine = Engine(url, "plant", cells, workers=3)
    engine.start()
    yield engine
    cells.go.set()
    assert engine.stop(10) == frozenset()


def test_jobs_are_begun_once_one_a_cell_and_so_many_at_a_time(engine, cells):
    plans = [f"{plan}/c{cell}" for plan in ("P1", "P2", "refused") for cell in range(5)]
    assert set(engine.hand_out(jobs(*plans))) == set(plans)
    assert engine.hand_out(jobs(*plans[-2:])) == () or cells.begun  # known, or over already
    until(engine, lambda: not engine.held())
    assert set(cells.begun) == set(plans)
    assert cells.clashes == []
    assert cells.most <= 3

    # One that has ended, well or not, is handed out anew: whether it is to be, the store says.
    again = [plans[0], plans[-1]]
    before = Counter({order: cells.begun[order] for order in again})
    assert set(engine.hand_out(jobs(*again))) == set(again)
    until(engine, lambda: not engine.held())
    assert {order: cells.begun[order] - before[order] for order in again} == dict.fromkeys(again, 1)

    # The second of a cell waits, is taken back, and has not run; the one that runs is not.
    engine.hand_out(jobs("stays/c2"))
    until(engine, engine.running)
    engine.hand_out(jobs("late/c2"))
    assert engine.held() == {"late/c2": QueuePlace.WAITING, "stays/c2": QueuePlace.RUNNING}
    engine.withdraw(["late/c2", "stays/c2"])
    assert engine.held() == {"stays/c2": QueuePlace.RUNNING}
    cells.go.set()
    until(engine, lambda: not engine.held())
    assert (cells.begun["late/c2"], cells.begun["stays/c2"]) == (0, 1)


def test_a_job_that_counts_as_running_and_does_not_run_is_dropped(engine, cells):
    engine.hand_out(jobs("stays/c2"))
    until(engine, engine.running)
    engine.hand_out(jobs("late/c2"))
    # What a database that goes away in the wrong moment leaves behind.
    with engine._database.begin() as transaction:
        table = "workflow_status" if engine._database.name == "sqlite" else "dbos.workflow_status"
        transaction.exec_driver_sql(
            f"UPDATE {table} SET status = 'PENDING' WHERE workflow_uuid = 'late/c2'"
        )
    assert engine.drop_stranded() == ()  # it may be about to begin
    assert engine.drop_stranded() == ("late/c2",)
    assert engine.held() == {"stays/c2": QueuePlace.RUNNING}
    assert engine.hand_out(jobs("late/c2")) == ("late/c2",)
    cells.go.set()
    until(engine, lambda: not engine.held())
    assert cells.begun == {"stays/c2": 1, "late/c2": 1}


@pytest.mark.soak
def test_what_a_killed_process_had_begun_the_next_of_its_plant_begins_again(url, tmp_path):
    orders = ["P/c1-stays", "P/c2-stays", "P/c3-stays"]
    log, deadline = tmp_path / "log", time.monotonic() + 30
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.fleet._engine_process", url, str(tmp_path), "2", *orders]
    )
    try:
        while not log.exists() or log.read_text().count("begin") < 2:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    assert len(log.read_text().splitlines()) == 2  # two workers: the third waits, and none ended
    seen: Counter[str] = Counter()
    engine = Engine(url, "plant", lambda order: seen.update([order]), workers=2)
    engine.start()
    try:
        until(engine, lambda: not engine.held())
    finally:
        engine.stop(10)
    assert seen == dict.fromkeys(orders, 1)


@pytest.mark.soak
def test_what_would_begin_while_it_ends_is_left_to_the_next_one(url, cells):
    engine = Engine(url, "plant", cells, workers=1)
    engine.start()
    engine.hand_out(jobs("stays/c1"))
    until(engine, engine.running)
    engine.hand_out(jobs("P/c2", "P/c3"))
    assert engine.stop(0.2) == {"stays/c1"}
    assert cells.begun == {"stays/c1": 1}
    cells.go.set()
    following = Engine(url, "plant", cells, workers=1)
    following.start()
    try:
        until(following, lambda: not following.held())
    finally:
        following.stop(10)
    assert (cells.begun["P/c2"], cells.begun["P/c3"]) == (1, 1)


def test_a_database_that_is_not_there_is_told(tmp_path):
    engine = Engine(f"sqlite:///{tmp_path / 'no folder' / 'jobs.db'}", "plant", print)
    with pytest.raises(PlantError, match="cannot be used"):
        engine.start()
