"""Jobs that hang: they are cut off, and hold up neither other cells nor the agent's end.

What hangs here is what has no deadline: a file that nobody writes, a disk that is frozen.
"""

# ruff: noqa: F401, F811 - fixtures of another module

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink import runtime
from robolink.fleet import FleetStore, JobOutcome, JobState, Treatment
from robolink.fleet.agent import Agent
from robolink.fleet.errors import PlantError
from robolink.fleet.silence import CUT_S, LONGEST_S, LOOK_S, SILENT_S, SilentJobs
from robolink.journal import open_journal, signature_here
from robolink.journal.store.connection import DatabaseConnection
from robolink.transaction import recover
from robolink.transport import parse_url
from tests.fleet.test_acts import PERMIT, acts, cell_file, plan, simulator, tool_of, treatment
from tests.fleet.test_agent import plan as plan_of_checks
from tests.fleet.test_agent import running, until


class SteppedTime(runtime.SystemRuntime):
    """A monotonic time that a test moves."""

    def __init__(self):
        self.now_ns = 0

    def monotonic_ns(self):
        return self.now_ns

    def go_on(self, seconds):
        self.now_ns += int(seconds * 1e9)


@pytest.fixture
def stepped():
    time_here = SteppedTime()
    with runtime.replaced(time_here):
        yield time_here


def watch(silent, time_here, seconds):
    """Look for silent jobs every second, as an agent does."""
    for _ in range(int(seconds)):
        time_here.go_on(LOOK_S)
        silent.look()


class Line:
    """Connections whose exchanges a test counts; cutting one off ends as the test says."""

    def __init__(self, outcome=None):
        self.sent, self.cut, self.outcome = 0, [], outcome
        self.asked = threading.Event()

    def exchanges(self, _order):
        return self.sent

    def cut_off(self, order, ended):
        self.cut.append(order)
        if self.outcome is not None:
            ended(self.outcome)
        self.asked.set()


def test_a_job_is_silent_without_an_exchange_and_no_job_is_at_work_for_ever(stepped):
    line = Line(JobOutcome(6, "OutcomeUnknownError"))
    silent = SilentJobs(line)
    with silent.watching("P/a", 1, writes=True):
        for _ in range(int(LONGEST_S / SILENT_S)):
            line.sent += 1  # a sign of life that others are given, while the job itself hangs
            silent.look()
            assert not line.asked.is_set()
            watch(silent, stepped, SILENT_S)
        line.sent += 1
        watch(silent, stepped, 1)
        assert line.asked.wait(10)
        assert {order: job.outcome for order, job in silent.cut().items()} == {"P/a": line.outcome}
    assert silent.cut() == {}
    with silent.watching("P/b", 2, writes=True):
        line.sent = 0
        line.asked.clear()
        watch(silent, stepped, SILENT_S)
        assert silent.cut() == {}
        stepped.go_on(0.1)
        silent.look()
        assert line.asked.wait(10)
        silent.look()
    assert line.cut == ["P/a", "P/b"]  # once each


@pytest.mark.parametrize(("writes", "code"), [(True, 6), (False, 2)])
def test_where_the_stop_itself_hangs_rest_is_not_proved(writes, code, stepped):
    line = Line()
    silent = SilentJobs(line)
    with silent.watching("P/a", 1, writes=writes):
        watch(silent, stepped, SILENT_S + 1)
        assert line.asked.wait(10)
        stepped.go_on(600)
        silent.look()
        assert silent.given_up() == frozenset()
        watch(silent, stepped, CUT_S + 1)
        (job,) = silent.cut().values()
        assert job.ended(JobOutcome(0)) is job.outcome
    assert (job.attempt, job.outcome.code) == (1, code)
    assert ("press the emergency stop" in job.outcome.what) is writes


def test_a_process_that_stood_still_holds_nothing_against_its_jobs(stepped):
    line = Line(JobOutcome(6, "OutcomeUnknownError"))
    silent = SilentJobs(line)
    with silent.watching("P/a", 1, writes=True):
        watch(silent, stepped, 10)
        for _ in range(2):
            stepped.go_on(2 * LONGEST_S)
            silent.look()
        with silent.watching("P/b", 1, writes=True):
            stepped.go_on(60)
            watch(silent, stepped, SILENT_S - 15)
            assert line.cut == []
            watch(silent, stepped, 6)
            assert line.asked.wait(10)
            assert line.cut == ["P/a"]
            line.asked.clear()
            watch(silent, stepped, 15)
            assert line.asked.wait(10)
    assert line.cut == ["P/a", "P/b"]


def test_a_job_that_begins_as_the_process_goes_on_is_at_work_no_longer_than_others(stepped):
    line = Line(JobOutcome(6, "OutcomeUnknownError"))
    silent = SilentJobs(line)
    stepped.go_on(10 * LONGEST_S)
    with silent.watching("P/a", 1, writes=True):
        silent.look()
        for _ in range(int(LONGEST_S)):
            assert line.cut == []
            line.sent += 1
            watch(silent, stepped, 1)
        line.sent += 1
        watch(silent, stepped, 1)
        assert line.asked.wait(10)


def test_no_job_comes_or_goes_while_they_are_looked_at(stepped):
    silent, lock = SilentJobs(Line()), threading.Lock()

    class Jobs(dict[str, Any]):
        def items(self):
            assert lock.locked()
            return super().items()

    silent._jobs, silent._lock = Jobs(), lock
    with silent.watching("P/a", 1, writes=True):
        silent.look()
        assert silent.cut() == {}


CUT, CUT_HALT = JobOutcome(6, "OutcomeUnknownError", what="cut"), JobOutcome(2, "PlantError")


@pytest.mark.parametrize(
    ("own", "cut", "told"),
    [
        (JobOutcome(2, "JournalError"), CUT, CUT),
        (JobOutcome(3, "TransportError"), CUT_HALT, CUT_HALT),
        (JobOutcome(6, what="own"), CUT_HALT, JobOutcome(6, what="own")),
        (JobOutcome(0), None, JobOutcome(0)),  # it ended before its connection was cut
    ],
)
def test_a_job_that_wakes_while_it_is_cut_off_ends_by_what_that_shows(own, cut, told, stepped):
    ends = []

    class HeldLine(Line):
        def cut_off(self, _order, ended):
            ends.append(ended)
            self.asked.set()

    line = HeldLine()
    silent = SilentJobs(line)
    with silent.watching("P/a", 1, writes=True) as job, ThreadPoolExecutor(1) as thread:
        watch(silent, stepped, SILENT_S + 1)
        assert line.asked.wait(10)
        ended = thread.submit(job.ended, own)
        assert not ended.done()
        ends[0](cut)
        assert ended.result(10) == told


def test_a_job_that_has_ended_is_not_cut_off(stepped):
    line = Line(CUT)
    silent = SilentJobs(line)
    with silent.watching("P/a", 1, writes=True) as job:
        assert job.ended(JobOutcome(0)) == JobOutcome(0)
        watch(silent, stepped, SILENT_S + 1)
        assert silent.cut() == {}
    assert line.cut == []


@pytest.fixture
def hasty(monkeypatch, tmp_path, engine_file):
    """Has an agent take jobs for silent at once."""
    shutil.copy(engine_file, tmp_path / "plant.db.jobs")
    monkeypatch.setattr("robolink.fleet.silence.SILENT_S", 0.05)
    for name in ("LOOK_S", "_TURN_S", "_GATHER_S"):
        monkeypatch.setattr(f"robolink.fleet.agent.{name}", 0.05)


def test_what_a_person_resumed_stays_so_while_the_thread_hangs_and_when_it_wakes(tmp_path, hasty):
    wakes, begun = threading.Event(), list[int]()

    class LivelyLater(Line):
        def exchanges(self, _order):
            self.sent += len(begun) > 1
            return self.sent

    def act(*_):
        begun.append(1)
        if len(begun) == 1:
            assert wakes.wait(30)
            return JobOutcome(2, "JournalError", what="The disk is back.")
        return JobOutcome(0)

    location, made = str(tmp_path / "plant.db"), plan_of_checks(cells=["a"])
    agent = Agent(location, "plant", act, line=LivelyLater(CUT))
    with FleetStore(location) as store:
        store.add_plan(made)
        with running(agent):
            until(lambda: store.progress(made.id).jobs[0].state is JobState.UNSETTLED)
            store.resume(made.id, "Li", "recovered")
            turned_s = agent.turned_s
            until(lambda: agent.turned_s > turned_s + 0.2)
            assert store.progress(made.id).jobs[0].state is JobState.WAITING
            wakes.set()
            until(lambda: store.progress(made.id).finished)
        progress = store.progress(made.id)
    assert (progress.jobs[0].code, len(progress.halts), len(begun)) == (0, 1, 2)


def test_what_wakes_in_time_does_not_hide_that_nobody_knows_how_it_stands(tmp_path, hasty):
    class SlowLine(Line):
        def cut_off(self, _order, ended):
            self.asked.set()
            time.sleep(0.1)  # while the stop is under way
            ended(CUT)

    line = SlowLine()

    def act(*_):
        assert line.asked.wait(30)
        return JobOutcome(3, "TransportClosedError")

    location, made = str(tmp_path / "plant.db"), plan_of_checks(cells=["a"])
    with FleetStore(location) as store:
        store.add_plan(made)
        with running(Agent(location, "plant", act, line=line)):
            until(lambda: store.progress(made.id).jobs[0].state is not JobState.RUNNING)
            until(lambda: store.progress(made.id).jobs[0].code)
        (job,) = store.progress(made.id).jobs
    assert (job.state, job.code, job.what) == (JobState.UNSETTLED, 6, "cut")


# ---- a disk that hangs


class HangingDisk:
    """Commits of the record do not return in one thread, from the n-th on or after it."""

    def __init__(self, monkeypatch):
        self.hangs, self.freed, self.count = threading.Event(), threading.Event(), 0
        self.at: int | None = None
        self.after = False
        self.thread = ""
        commit = DatabaseConnection.commit

        def counted(connection):
            ours = threading.current_thread().name == self.thread
            here = ours and self.count == self.at
            self.count += ours
            if here and not self.after:
                self._hang()
            commit(connection)
            if here and self.after:
                self._hang()

        monkeypatch.setattr(DatabaseConnection, "commit", counted)

    def _hang(self):
        self.hangs.set()
        assert self.freed.wait(60)


@pytest.fixture
def disk(monkeypatch):
    made = HangingDisk(monkeypatch)
    yield made
    made.freed.set()


def hung_and_freed(at_cell, device, disk, made, at, *, after):
    """Carry an offset out whose thread hangs at a commit; cut it off there, and let it go on.

    Returns:
        The outcome of cutting it off, ``None`` if it ended before that commit; and its own.
    """
    own, said = [], []
    told = threading.Event()
    disk.at, disk.after, disk.count, disk.thread = at, after, 0, "hung job"
    disk.hangs.clear()
    disk.freed.clear()
    job = threading.Thread(
        target=lambda: own.append(at_cell(made, "a", PERMIT)), name="hung job", daemon=True
    )
    job.start()
    until(lambda: disk.hangs.is_set() or not job.is_alive())
    if disk.hangs.is_set():

        def ended(outcome):
            said.append(outcome)
            told.set()

        order = made.order("a")
        threading.Thread(target=at_cell.cut_off, args=(order, ended), daemon=True).start()
        assert told.wait(10)
        wrote = device.machine.flash_writes
        disk.freed.set()
    job.join(30)
    if said:  # whenever it wakes up, nothing of it reaches the controller
        assert device.machine.flash_writes == wrote
    return (said[0] if said else None), own[0]


EVERY = [(number, after) for number in range(40) for after in (False, True)]


@pytest.mark.parametrize(
    "points", [[(0, False), (2, True), (3, False)], pytest.param(EVERY, marks=pytest.mark.soak)]
)
def test_a_job_that_hangs_at_a_commit_is_cut_off_and_its_order_carried_out_once(
    points,
    acts,
    disk,
    simulator,
):
    seen = []
    for number, (at, after) in enumerate(points):
        x_mm, before = 10.0 + number / 10, simulator.machine.flash_writes
        made = plan("offset", name=f"{number}", offsets={"a": {"tool": 1, "x_mm": x_mm}})
        cut, own = hung_and_freed(acts, simulator, disk, made, at, after=after)
        if cut is None:
            assert own.code == 0
            assert at > 4  # it was carried out to its end, behind the last commit
            break
        seen.append((cut.code, own.code))
        assert own.code != 10 or treatment(cut) is Treatment.HALT
        if cut.code == 6:
            assert "the robot stands still" in cut.what
            recovered(simulator)
        else:  # nothing was sent, or it is done
            assert treatment(cut) is Treatment.HALT
        again = acts(made, "a", PERMIT)
        if again.code == 6:  # when it woke up, its intent came on record, and nothing more
            assert (cut.code, simulator.machine.flash_writes) == (2, before)
            recovered(simulator)
            again = acts(made, "a", PERMIT)
        assert again.code == 0, (at, after, cut, own)
        assert simulator.machine.flash_writes - before == 1
        assert tool_of(simulator).x_mm == x_mm
    assert {code for code, _ in seen} == {2, 6}


def recovered(simulator):
    """Do what a person does at an unsettled cell."""
    log = open_journal().log(parse_url(simulator.url).address, signature=signature_here("0"))
    with robolink.connect(simulator.url, outcomes=log) as controller:
        assert recover(controller).left == ()


# ---- hanging in processes of their own


HANGS_AT_ITS_END = """
import threading
from robolink.fleet import agent, silence
from robolink_cli.commands.fleet import agent as command
from robolink_cli.commands.fleet.acts import CellActs
from robolink_cli.entry import main
silence.SILENT_S, agent.END_S, command.LAST_S = 6.0, 20.0, 60.0
found = CellActs._cell
def cell(self, name):
    if name == "a":  # as where its file is on a network drive that is gone
        threading.Event().wait()
    return found(self, name)
CellActs._cell = cell
main()
"""


@pytest.mark.soak
@pytest.mark.timeout(300)
def test_a_job_that_hangs_holds_up_neither_the_others_nor_the_end_of_the_agent(
    cell_file,
    tmp_path,
    monkeypatch,
):
    location = str(tmp_path / "plant.db")
    monkeypatch.setenv("ROBOLINK_PLANT", location)
    made = plan_of_checks(cells=[*"abcdefghijklmnopqrstuvwxyz"])
    with FleetStore(location) as store:
        store.add_plan(made)
        process = subprocess.Popen([sys.executable, "-c", HANGS_AT_ITS_END, "fleet", "agent"])
        try:
            until(lambda: store.progress(made.id).standing, 90)
            assert [str(one.rule) for one in store.progress(made.id).standing] == ["cause"]
            store.resume(made.id, "Li", "the drive is back")
            until(lambda: store.progress(made.id).counts()[JobState.REFUSED] == 25, 90)
            assert store.progress(made.id).jobs[0].state is JobState.WAITING  # its thread hangs on
            process.send_signal(signal.SIGTERM)
            assert process.wait(20) == 1
        finally:
            process.kill()
            process.wait()


@pytest.mark.soak
@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="freezing a disk takes root")
@pytest.mark.timeout(400)
def test_a_disk_that_is_frozen_holds_up_the_cells_alone_whose_record_it_has(tmp_path, monkeypatch):
    with frozen_disk(tmp_path) as (mount, freeze), two_cells() as (first, second):
        location = str(tmp_path / "plant.db")
        monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "robolink.toml"))
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
        monkeypatch.setenv("ROBOLINK_PLANT", location)
        (tmp_path / "robolink.toml").write_text(
            f'[cells.a]\nurl = "{first.url}"\njournal = "{mount}/a.db"\n'
            f'[cells.b]\nurl = "{second.url}"\n'
        )
        made = plan_of_checks(cells=["a", "b"])
        with FleetStore(location) as store:
            store.add_plan(made)
            process = subprocess.Popen([sys.executable, "-m", "robolink_cli", "fleet", "agent"])
            try:
                until(lambda: store.progress(made.id).finished, 60)
                freeze(True)
                for number in range(2):
                    late = plan_of_checks(cells=["a", "b"], name=f"late {number}")
                    store.add_plan(late)
                    until(lambda: store.progress(late.id).jobs[1].state.final, 60)  # noqa: B023
                    until(lambda: number or store.progress(late.id).jobs[0].state.final, 90)  # noqa: B023
                process.send_signal(signal.SIGTERM)
                time.sleep(5)
                # What waits for a disk outlives SIGKILL; its thread may come back in time, too.
                freeze(False)
                assert process.wait(60) in (0, 1)
            finally:
                freeze(False)
                process.kill()
                process.wait()


@contextmanager
def two_cells():
    one, other = EpsonSimulator("T6-602S", seed=1), EpsonSimulator("T6-602S", seed=2)
    with serve_tcp(one), serve_tcp(other):
        yield one, other


@contextmanager
def frozen_disk(folder):
    """Mount a file system of its own; return its folder, and what freezes it and lets it go."""
    image, mount = folder / "disk", folder / "mount"
    mount.mkdir()
    image.write_bytes(b"")
    os.truncate(image, 64 << 20)
    made = subprocess.run(
        f"mkfs.ext4 -q {image} && mount -o loop {image} {mount}", shell=True, check=False
    )
    if made.returncode:
        pytest.skip("no file system can be mounted here")

    def freeze(now):
        subprocess.run(["fsfreeze", "-f" if now else "-u", str(mount)], check=now)

    try:
        yield mount, freeze
    finally:
        subprocess.run(["umount", "-l", str(mount)], check=False)


@pytest.mark.soak
def test_a_server_that_is_frozen_is_given_up_and_used_again_when_it_goes_on(server, monkeypatch):
    monkeypatch.setattr("robolink.journal.store.connection.ANSWER_S", 1.0)
    made = plan_of_checks(name="frozen")
    url = server.empty_database()
    agent = Agent(url, "plant", lambda *_: JobOutcome(0))
    with FleetStore(url) as store:
        store.add_plan(made)
        with running(agent), stopped(server):
            begun = time.monotonic()
            with pytest.raises(PlantError, match="no answer for 1 s"):
                store.plans()
            assert time.monotonic() - begun < 10
            agent.end()
        until(lambda: agent.hung == frozenset())
        Agent(url, "plant", lambda *_: JobOutcome(0)).run_until_still()
        assert store.progress(made.id).finished


@contextmanager
def stopped(server):
    """Freeze a server with all of its processes."""
    first = server.process.pid
    pids = [first, *map(int, subprocess.check_output(["pgrep", "-P", str(first)]).split())]
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
