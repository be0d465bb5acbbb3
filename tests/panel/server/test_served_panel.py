"""The whole panel on a simulated robot: a job, STOP, a panel that is killed and starts anew."""

import asyncio
import os
import shutil
import signal
import time
from itertools import pairwise
from pathlib import Path

import pytest
from robolink_cli.panel.guard.people import NOBODY, Pins
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.model import Secret
from robolink.stopping import find_note, holders_of
from robolink.transport import far_end_of
from tests.panel.server._panel import PIN, Tablet, panel

RECIPES = Path(__file__).parents[3] / "examples" / "recipes"

# Each waits for processes to start, which a busy computer does slowly.
pytestmark = pytest.mark.timeout(240)


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """A cell file with one simulated robot, and its URL."""
    folder = tmp_path_factory.mktemp("panel")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLINK_STATE_DIR", str(folder / "state"))
        patch.chdir(folder)
        simulator = EpsonSimulator("T6-602S", seed=3)
        with serve_tcp(simulator, clock=ScaledClock(20)) as host:
            file = folder / "robolink.toml"
            file.write_text(
                f'[cells.line3]\nurl = "{host.url}"\ntool = 1\nremote_timeout_s = 60.0\n'
                'remote_timeout_confirmed_by = "a test"\n'
            )
            shutil.copy(RECIPES / "scara-pin.toml", folder / "scara-pin.toml")
            Pins().set(NOBODY, Secret(PIN))
            yield file, host.url


@pytest.fixture(scope="module")
def served(cells):
    with panel(cells[0]) as (process, port):
        yield process, port


@pytest.fixture(scope="module")
def served_next(cells):
    """The panel that follows one that was killed."""
    with panel(cells[0]) as (process, port):
        yield process, port


def run(work):
    return asyncio.run(work)


async def seated(page):
    assert (await page.tablet.post("/seat", cell="line3"))[0] == 200
    await page.until(lambda page: page.beats)


def job_of(url):
    """Return the process of the job that has the controller; ``None`` for none."""
    return next((holder.pid for holder in holders_of(far_end_of(url))), None)


def is_gone(pid, within_s=30.0):
    until_s = time.monotonic() + within_s
    while Path(f"/proc/{pid}/status").exists() and time.monotonic() < until_s:
        if "\nState:\tZ" in Path(f"/proc/{pid}/status").read_text():
            return True
        time.sleep(0.02)
    return not Path(f"/proc/{pid}").exists()


def test_a_job_is_begun_pressed_and_left_and_old_numbers_press_nothing(served, cells):
    async def work():
        tablet = Tablet(served[1])
        assert tablet.login() == 200
        async with tablet.live("line3") as page:
            await seated(page)
            idle = page.number
            assert (await tablet.post("/start", cell="line3", job="change"))[0] == 200
            again, why = await tablet.post("/start", cell="line3", job="change")
            assert (again, "running" in why["why"]) == (409, True)
            await page.until(lambda page: page.screen == "choice")
            for number in (idle, page.number - 1, page.number + 1, 0, None, "1", True):
                await page.send(
                    t="press", number=number, action="leave", value="", press=f"old {number}"
                )
                assert await page.answer("refused", f"old {number}")
            assert page.screen == "choice"
            await to_idle(page)
            assert page.number > idle
            beats = [at_s for at_s, _ in page.beats]
            return max(after - before for before, after in pairwise(beats))

    # Every 0.25 s; a machine that is three times slower than busy counts too.
    assert run(work()) < 5.0, "the page would have turned grey"


def test_a_press_that_was_long_on_its_way_does_nothing(served, cells):
    """A cable was out meanwhile: the question is still the same, the person may have gone."""

    async def work():
        tablet = Tablet(served[1])
        assert tablet.login() == 200
        async with tablet.live("line3") as page:
            await seated(page)
            assert (await tablet.post("/start", cell="line3", job="change"))[0] == 200
            await page.until(lambda page: page.screen == "choice")
            await asyncio.sleep(0.4)
            old = page.beats[-1][1]["at_ms"] - 2000
            press = {"number": page.number, "action": "leave", "value": "", "press": "late"}
            await page.send(t="press", at_ms=old, **press)
            refused = await page.answer("refused", "late")
            assert page.screen == "choice"
            await to_idle(page)
            return refused["why"]

    assert "too late" in run(work())


def test_stop_needs_no_login_no_token_and_reaches_a_job_that_is_at_work(served, cells):
    _, url = cells

    async def work():
        boss, other = Tablet(served[1]), Tablet(served[1])
        assert boss.login() == 200
        async with boss.live("line3") as page, other.live("line3") as looks_on:
            await seated(page)
            await boss.post("/start", cell="line3", job="change")
            await page.until(lambda page: page.screen == "choice")
            await page.press_until(at_work, "choose", "1")
            assert job_of(url) is not None
            other.token = "stale"
            posted, streamed = await asyncio.gather(
                other.post("/stop", cell="line3", press="s1", age_ms=4),
                stop_by_stream(looks_on, "s1"),
            )
            assert posted[1]["outcome"] == streamed["outcome"] == "stopped"
            assert posted[1]["text"] == streamed["text"]
            # What the latch of the job refuses from now on, no press brings back.
            await to_idle(page)
            assert find_note(far_end_of(url)) is not None
            again = await other.post("/stop", cell="line3", press="s1", age_ms=4)
            old = await other.post("/stop", cell="line3", press="s2", age_ms=5001)
            return again[1]["outcome"], old[1]["outcome"]

    assert run(work()) == ("stopped", "old")


def at_work(page):
    return page.screen not in ("choice", "wait")


async def to_idle(page):
    """End the job with what its screens offer for that."""
    while page.screen != "idle":
        before = page.screen
        last = "finish" if 'data-action="finish"' in page.parts["foot"] else "leave"
        await page.press_until(lambda page, before=before: page.screen != before, last)


async def stop_by_stream(page, press):
    await page.send(t="stop", press=press, age_ms=4)
    return await page.answer("stopped", press)


def test_stop_all_stops_only_what_this_panel_runs(served):
    async def work():
        tablet = Tablet(served[1])
        async with tablet.live() as page:
            by_stream = await stop_by_stream(page, "a1")
            posted = await tablet.post("/stop-all", press="a2", age_ms=0)
        return by_stream["outcome"], posted[1]["outcome"]

    assert run(work()) == ("nothing", "nothing")


def test_get_changes_nothing_and_every_page_of_a_cell_is_there(served):
    tablet = Tablet(served[1])
    for path in ("/", "/cell/line3", "/cell/line3/history", "/login", "/static/panel.js"):
        assert tablet.ask("GET", path)[0] == 200, path
    for path in ("/cell/line4", "/static/panel.py", "/static/..%2fapp.py", "/seat", "/start"):
        assert tablet.ask("GET", path)[0] in (404, 405), path


def test_a_panel_that_is_killed_takes_its_job_along_in_order_and_the_next_shows_what_stands(
    served, cells, request
):
    _, url = cells

    async def until_at_work(port):
        tablet = Tablet(port)
        assert tablet.login() == 200
        async with tablet.live("line3") as page:
            await seated(page)
            await tablet.post("/start", cell="line3", job="release")
            await page.until(lambda page: page.screen == "question")
            await page.press_until(lambda page: page.screen != "question", "yes")
            await to_idle(page)
            await tablet.post("/start", cell="line3", job="change")
            await page.until(lambda page: page.screen == "choice")
            await page.press_until(at_work, "choose", "1")
            return page.hello["server"], job_of(url)

    process, port = served
    server, job = run(until_at_work(port))
    assert job is not None
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert is_gone(job), "the job goes on without a panel"
    assert job_of(url) is None

    async def look(port):
        again = Tablet(port)
        async with again.live("line3") as page:
            await page.until(lambda page: "ready" in page.parts.get("head", ""))
            assert page.hello["server"] != server
            assert (await again.post("/start", cell="line3", job="change"))[0] != 200
            stopped = await again.post("/stop", cell="line3", press="k1", age_ms=0)
            return stopped[1]["outcome"]

    _, port = request.getfixturevalue("served_next")
    assert run(look(port)) == "stopped"


def test_the_end_of_a_panel_ends_its_jobs_first(served_next, cells):
    file, url = cells
    process, port = served_next

    async def begin(port):
        tablet = Tablet(port)
        assert tablet.login() == 200
        async with tablet.live("line3") as page:
            await seated(page)
            await tablet.post("/start", cell="line3", job="change")
            await page.until(lambda page: page.screen != "idle")

    run(begin(port))
    process.terminate()
    assert process.wait(60) == 0
    assert job_of(url) is None
    assert os.path.exists(file)
