"""What the pages of a plant and its orders take: ``python -m tests.panel.plant.measures``.

Printed are milliseconds: POST /jobs on both databases, the page of 2,000 cells, a plan of 2,000
cells, and STOP while the plant's database answers and while all its processes are frozen.
"""

import os
import shutil
import signal
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import pytest
from robolink_cli.panel.guard import line_gate

from robolink.fleet import FleetStore
from robolink.fleet.store.line_jobs import MOST_OPEN
from tests.contract.journal._postgresql import is_installed, served
from tests.fleet._plans import cells_of, plan_with
from tests.panel.access._bare import Browser
from tests.panel.plant._served import LineComputer, PlantPanel, token_of
from tests.panel.plant.test_line_jobs import processes_of

POSTS = 300
STOPS = 60
MANY = 2000
PAINT = """() => new Promise((told) => {
  const look = () => {
    const found = performance.getEntriesByName("first-contentful-paint")[0];
    if (found) told(found.startTime); else setTimeout(look, 5);
  };
  look();
})"""


def main() -> int:
    """Measure all of it."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("ROBOLINK_STATE_DIR", str(Path(folder) / "state"))
        patch.setenv("ROBOLINK_PLANT", str(Path(folder) / "plant.db"))
        patch.setattr(line_gate, "JOBS_A_SECOND", 1e9)
        cells = tuple(cells_of(MANY))
        groups = {f"line{n}": cells[40 * n : 40 * n + 40] for n in range(50)}
        with PlantPanel().served(cells, groups=groups) as panel:
            _orders(panel, "SQLite")
            if is_installed():
                with served() as server:
                    patch.setenv("ROBOLINK_PLANT", server.url())
                    _orders(panel, "PostgreSQL")
                    _pages(panel)
                    _stops(panel, server)
    return 0


def _orders(panel, database):
    # Few jobs of one line computer may be open at once.
    lines = [LineComputer(panel.port, token_of(f"mes-{n}")) for n in range(0, POSTS, MOST_OPEN)]
    warm = LineComputer(panel.port, token_of("warm"))
    warm.post({"order": "first", "cell": "cell-0001", "kind": "check"})

    def post(number):
        said = {"order": f"order {number}", "cell": f"cell-{number + 1:04}", "kind": "check"}
        assert lines[number // MOST_OPEN].post(said)[0] in (200, 201)

    _told(f"POST /jobs, {database}, new", [_ms(partial(post, n)) for n in range(POSTS)])
    _told(f"POST /jobs, {database}, again", [_ms(partial(post, n)) for n in range(POSTS)])


def _pages(panel):
    with FleetStore(os.environ["ROBOLINK_PLANT"]) as store:
        plan = plan_with(MANY, kind="check")
        store.add_plan(plan)
    browser = Browser(panel)
    paths = ("/", "/?group=line3", "/?groups=1", "/plans", f"/plan/{plan.id}")
    for path in paths:
        answer = browser.get(path)
        assert answer.status == 200
        size = len(answer.body)
        _told(
            f"GET {path}, {size / 1000:.0f} kB",
            [_ms(partial(browser.get, path)) for _ in range(20)],
        )

    if shutil.which("chromium") and find_spec("playwright"):
        _paints(panel, paths)


def _paints(panel, paths):
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        for path in paths:
            took = []
            for _ in range(5):
                page.goto(f"http://127.0.0.1:{panel.port}{path}")
                took.append(page.evaluate(PAINT))
            _told(f"first paint of {path} in Chromium", took)
        chromium.close()


def _stops(panel, server):
    browser = Browser(panel)
    text = browser.get("/").body.decode()
    browser.token = text.partition('data-token="')[2].partition('"')[0]

    def stops(name):
        def stop(number):
            said = {"press": f"{name} {number}", "age_ms": 1, "cell": "cell-0001"}
            # Nobody listens there: the press has gone the whole way to the socket.
            assert browser.post("/stop", said).json()["outcome"] == "failed"

        _told(
            f"STOP to the refused connection, {name}",
            [_ms(partial(stop, n)) for n in range(STOPS)],
        )

    stops("no page of plans open")
    with _opened(browser):
        stops("a page of plans open")
        frozen = processes_of(server)
        for pid in frozen:
            os.kill(pid, signal.SIGSTOP)
        try:
            while "is not reached since" not in browser.get("/plans").body.decode():
                time.sleep(0.1)
            stops("the database frozen")
        finally:
            for pid in frozen:
                os.kill(pid, signal.SIGCONT)


@contextmanager
def _opened(browser):
    with browser.live(cell="&plans=1"):
        yield


def _ms(work: Callable[[], object]) -> float:
    begun_s = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - begun_s)


def _told(what: str, took_ms: list[float]) -> None:
    took_ms.sort()
    last = took_ms[min(len(took_ms) - 1, int(0.99 * len(took_ms)))]
    sys.stdout.write(
        f"{what}: p50 {statistics.median(took_ms):.1f}, p99 {last:.1f}, most {took_ms[-1]:.1f} ms "
        f"(n={len(took_ms)})\n"
    )
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
