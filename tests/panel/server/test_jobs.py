"""Jobs: a process each, that ends in order whatever becomes of the panel or of its line."""

import asyncio
import json
import os
import signal
import sys
import time

import pytest
from robolink_cli.panel.jobs import KINDS, MOST_BYTES, JobKind, PanelJob, end_all, options_of


class StandIn(PanelJob):
    program = "tests.panel.server._child"


@pytest.fixture
def behaves(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(os.path.abspath, sys.path)))
    monkeypatch.setenv("STAND_IN_END", str(tmp_path / "end"))

    def behave(how):
        monkeypatch.setenv("STAND_IN", how)

    return behave


def job(changed=lambda: None, **named):
    return StandIn("line3", KINDS["change"], language="zh", who="mei", changed=changed, **named)


async def shown(one, within_s=20.0):
    until_s = time.monotonic() + within_s
    while one.view is None and one.end is None and time.monotonic() < until_s:
        await asyncio.sleep(0.01)
    return one


async def told(one, count, within_s=20.0):
    until_s = time.monotonic() + within_s
    while len(one.told) < count and time.monotonic() < until_s:
        await asyncio.sleep(0.01)
    return [json.loads(text) for text in one.told]


def test_it_shows_takes_presses_and_ends_in_order(behaves):
    behaves("well")
    changes = []

    async def work():
        one = job(lambda: changes.append(1))
        await one.start()
        await shown(one)
        assert one.view.head.title == "Ready?"
        one.press(1, "yes", "")
        one.hold(1, "x+", "f1")
        one.beat("f1")
        one.alive()
        one.release("f1")
        heard = await told(one, 5)
        assert await one.close(20)
        return one, heard

    one, heard = asyncio.run(work())
    assert [said["t"] for said in heard] == ["press", "hold", "beat", "alive", "release"]
    assert heard[0] == {"t": "press", "number": 1, "action": "yes", "value": ""}
    assert one.end.in_order
    assert (one.end.code, one.end.kept) == (9, ("Nothing was sent.",))
    assert changes


def test_the_command_line_is_the_ordinary_one_with_cell_and_person(behaves):
    kind = JobKind("change", "x", ("change",), values={"needle": "--nozzle"})
    one = StandIn(
        "line3", kind, language="en", who="mei", changed=lambda: None, values={"--nozzle": "N7"}
    )
    assert one.arguments == ["-c", "line3", "--operator", "mei", "change", "--nozzle", "N7"]


def test_a_page_gives_no_options_but_the_known_ones():
    kind = JobKind("change", "x", ("change",), values={"needle": "--nozzle"})
    given = {"needle": "N7", "yes": "--yes", "--yes": "1", "operator": "root"}
    assert options_of(kind, given) == {"--nozzle": "N7"}


@pytest.mark.parametrize("wrong", [None, [], "x", {"needle": 3}, {"needle": "--x"}, {"needle": ""}])
def test_what_is_no_value_is_left_out(wrong):
    kind = JobKind("change", "x", ("change",), values={"needle": "--nozzle"})
    assert options_of(kind, wrong) == {}


@pytest.mark.parametrize("how", ["dies", "giant", "nonsense", "foreign"])
def test_a_line_that_cannot_be_trusted_ends_the_job_and_nobody_calls_that_order(behaves, how):
    behaves(how)

    async def work():
        one = job()
        await one.start()
        await asyncio.wait_for(one.wait(), 20)
        return one

    one = asyncio.run(work())
    assert not one.end.in_order
    if how == "dies":
        assert "fell over" in one.end.errors


def test_a_killed_process_is_known_to_have_ended_without_order(behaves):
    behaves("well")

    async def work():
        one = job()
        await one.start()
        await shown(one)
        os.kill(one.pid, signal.SIGKILL)
        await asyncio.wait_for(one.wait(), 20)
        one.press(1, "yes", "")  # into nothing
        return one

    assert not asyncio.run(work()).end.in_order


def test_what_a_job_does_not_take_is_not_kept_without_bound(behaves):
    behaves("deaf")

    async def work():
        one = job()
        await one.start()
        await shown(one)
        for _ in range(20_000):
            one.beat("f1")
            one.alive()
        kept = one._writer.transport.get_write_buffer_size()
        left = await end_all([one], 0.2)
        os.kill(one.pid, signal.SIGKILL)
        await asyncio.wait_for(one.wait(), 20)
        return kept, left == [one]

    kept, goes_on = asyncio.run(work())
    assert kept < MOST_BYTES
    assert goes_on
