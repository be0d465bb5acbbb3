"""A job at a cell whose process is killed: carried out once in the end, and never written twice."""

import itertools
import signal
import subprocess
import sys

import pytest

from robolink.fleet import JobState
from robolink.journal import open_journal
from tests._commands import run_command
from tests.fleet._moving_cells import OLD, PersonAtCell

# Each waits for processes to start, which a busy computer does slowly.
pytestmark = pytest.mark.timeout(240)


@pytest.fixture
def written(cells):
    """All values that were written into tool 1 of the first cell, in order."""
    tools, values = cells.simulators["a"].machine.tools, []
    store = tools.set

    def counted(number, offset):
        store(number, offset)
        values.append(offset)

    tools.set = counted
    return values


def killed(where):
    """Carry the job out in a process that is killed somewhere; return how that ended."""
    words = ["-m", "tests.fleet._killed_next", str(where), "-c", "a", "fleet", "next"]
    return subprocess.run(
        [sys.executable, *words], check=False, capture_output=True, text=True, timeout=120
    )


def carried_out_in_the_end(cells, plan):
    """Do what a person does until the job has its last end; return how often was recovered."""
    recovered = 0
    while True:
        ended = PersonAtCell().run("a", plan.id)
        job = cells.job(plan, "a")
        if job.state is JobState.KEPT:
            return recovered
        assert (ended.code, job.state) == (6, JobState.UNSETTLED), ended.err
        assert recovered < 2
        assert run_command("-c", "a", "recover", "--yes").code == 0
        cells.store.resume(plan.id, "Li", "recovered")
        recovered += 1


def check_once(cells, plan, written):
    """What was written more than once had been put back in between, and is what is on record."""
    new = cells.tool("a")
    assert new != OLD
    assert written[0::2] == [new] * len(written[0::2])
    assert written[1::2] == [OLD] * len(written[1::2])
    assert len(written) % 2 == 1
    job = cells.job(plan, "a")
    assert (job.state, job.code) == (JobState.KEPT, 0)
    assert open_journal().log(cells.simulators["a"].url).open_markers() == ()
    assert open_journal().verify().problems == ()
    left = len(written)
    assert PersonAtCell().run("a", plan.id).code == 1
    assert len(written) == left


@pytest.mark.parametrize("where", [pytest.param("begun", marks=pytest.mark.soak), "unreported"])
def test_a_job_whose_process_is_killed_is_carried_out_once(cells, written, where):
    plan = cells.plan()
    ended = killed(where)
    assert ended.returncode == -signal.SIGKILL, ended.stdout
    assert cells.job(plan, "a").state is JobState.RUNNING
    assert len(written) == (where == "unreported")
    assert carried_out_in_the_end(cells, plan) == 0
    check_once(cells, plan, written)
    assert len(written) == 1
    assert cells.job(plan, "a").attempt == 1


@pytest.mark.soak
@pytest.mark.timeout(1200)
def test_killed_at_each_commit_it_is_carried_out_once(cells, written):
    for number in itertools.count():
        written.clear()
        cells.simulators["a"].machine.tools.set(1, OLD)
        written.clear()
        plan = cells.plan(name=f"killed at {number}")
        ended = killed(number)
        if ended.returncode == 0:
            assert number > 20, "there are more durable transitions than that"
            break
        assert ended.returncode == -signal.SIGKILL, ended.stdout
        carried_out_in_the_end(cells, plan)
        check_once(cells, plan, written)
