"""The pages of plans: what they show, who may decide, and that no database holds them up."""

import json
import sqlite3
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
from robolink_cli.panel.guard.people import Pins
from robolink_cli.panel.plant.desk import PlantDesk

from robolink.fleet import FleetStore, HaltRule, JobOutcome, JobState, LineJobStore
from robolink.fleet.store.course import PlanCourse
from robolink.model import Secret
from tests.fleet._plans import cells_of, permitted, plan_with
from tests.panel.access._bare import PINS, Browser
from tests.panel.plant._served import JON, MEI, LineComputer, PlantPanel, token_of
from tests.panel.plant.conftest import CELLS

ONLY_A_FILE = pytest.mark.parametrize("location", ["sqlite"], indirect=True)
"""A server that hangs is in test_line_jobs.py."""

REFUSED = JobOutcome(5, "NotReadyError", "guard_open", what="the guard is open")


@pytest.fixture
def page(panel):
    """A browser on a page of the panel; logged in where a test says as whom."""
    for name in (MEI, JON):
        Pins().set(name, Secret(PINS[name]))

    def opened(who=None):
        browser = Browser(panel)
        text = browser.get("/").body.decode()
        browser.token = text.partition('data-token="')[2].partition('"')[0]
        if who is not None:
            assert browser.log_in(who).status == 200
        return browser

    return opened


def read(browser, path):
    """Return a page; what was not heard yet is awaited on it."""
    answer = browser.get(path)
    assert answer.status == 200, answer.body
    return answer.body.decode()


def eventually(holds, within_s=8.0):
    until_s = time.monotonic() + within_s
    while not (found := holds()):
        assert time.monotonic() < until_s, "it did not come to pass"
        time.sleep(0.2)
    return found


@contextmanager
def blocked(location):
    """Keep a database of SQLite from everybody for the block."""
    blocker = sqlite3.connect(location)
    blocker.execute("BEGIN EXCLUSIVE")
    try:
        yield
    finally:
        blocker.close()


def test_plans_are_listed_with_their_states_and_why_they_stand(store, page):
    plan = permitted(store, plan_with(6))
    store.begin(plan.id, plan.cells[0])
    store.record_outcome(plan.id, plan.cells[0], 1, REFUSED)
    text = eventually(lambda: _with(read(page(), "/plans"), "5 waiting"))
    assert "offset" in text
    assert "5 waiting" in text
    assert "1 refused; a person has to look" in text
    assert "cell-0001, of the first ring, did not do what it was asked." in text
    assert f'href="/plan/{plan.id}"' in text


def test_one_plan_shows_its_rings_its_cells_and_why_each_waits(store, page):
    plan = permitted(store, plan_with(6))
    store.begin(plan.id, plan.cells[0])
    store.record_outcome(plan.id, plan.cells[0], 1, REFUSED)
    browser = page()
    text = eventually(lambda: _with(read(browser, f"/plan/{plan.id}"), "5 waiting"))
    assert "ring 2" in text
    assert "NotReadyError the guard is open" in text
    assert text.count("<tr><th") == 7  # a head and six cells
    assert "5 waiting: the plan is halted" in text
    left = read(browser, f"/plan/{plan.id}?state=person")
    assert "cell-0001" in left
    assert "cell-0002" not in left
    assert browser.get("/plan/0123456789ab").status == 404


def test_pages_say_that_there_is_no_plan_and_make_no_database(home, page, monkeypatch):
    assert "No plan was made yet." in read(page(), "/plans")
    assert not (home / "plant.db").exists()


@pytest.mark.soak
def test_words_of_a_plan_are_no_elements_of_a_page(store, page):
    plan = plan_with(1, name="<script>alert(1)</script>")
    store.add_plan(plan)
    store.halt(plan.id, "Li", "<img src=x onerror=alert(1)>")
    form_of(page(), plan, "&lt;img")
    for path in ("/plans", f"/plan/{plan.id}", f"/plan/{plan.id}/resume"):
        text = read(page(), path)
        assert "<script>alert" not in text
        assert "<img" not in text
        assert "&lt;img" in text


# ---- Decisions


def test_an_engineer_halts_and_resumes_and_it_is_on_record(panel, store, page):
    plan = permitted(store, plan_with(2))
    browser = page(MEI)
    halted = browser.post("/plan/halt", {"plan": plan.id, "reason": "the line stands"})
    assert halted.status == 200
    (halt,) = store.progress(plan.id).standing
    assert (halt.rule, halt.numbers) == (HaltRule.PERSON, {"reason": "the line stands"})
    assert halt.by.startswith("mei, panel (")
    form = form_of(browser, plan, "the line stands")
    seen = _seen(form)
    said = {"plan": plan.id, "reason": "the line runs", "seen": seen}
    assert browser.post("/plan/resume", said).status == 200
    assert store.progress(plan.id).standing == ()
    kinds = [(kind, facts["who"]) for kind, _, facts in panel.kept if kind.startswith("plan_")]
    assert kinds == [("plan_halted", MEI), ("plan_resumed", MEI)]


def form_of(browser, plan, words):
    """Return the form of resuming, once it shows what was halted."""

    def shown():
        answer = browser.get(f"/plan/{plan.id}/resume")
        return _with(answer.body.decode(), words) if answer.status == 200 else ""

    return eventually(shown)


def _with(text, words):
    return text if words in text else ""


def _seen(form):
    body = form.partition("/plan/resume")[2].partition('data-body="')[2].partition('"')[0]
    return json.loads(body.replace("&#34;", '"'))["seen"]


def test_a_halt_that_came_meanwhile_is_not_lifted_unseen(store, page):
    plan = permitted(store, plan_with(2))
    store.halt(plan.id, "Li", "first")
    browser = page(MEI)
    seen = _seen(form_of(browser, plan, "first"))
    store.halt(plan.id, "Wang", "second")
    said = {"plan": plan.id, "reason": "looked at", "seen": seen}
    assert browser.post("/plan/resume", said).status == 200
    (left,) = store.progress(plan.id).standing
    assert left.by == "Wang"
    again = browser.post("/plan/resume", said)  # a press that comes twice lifts nothing more
    assert again.status == 409
    assert store.progress(plan.id).standing == (left,)


@pytest.mark.parametrize(
    "seen",
    [0, "1", *(pytest.param(one, marks=pytest.mark.soak) for one in (-1, 99, None, 1.5, True))],
)
def test_a_resume_that_names_no_halt_lifts_nothing(store, page, seen):
    plan = permitted(store, plan_with(2))
    for _ in range(1 if seen is not True else 0):
        store.halt(plan.id, "Li", "first")
    said = {"plan": plan.id, "reason": "x", "seen": seen}
    assert page(MEI).post("/plan/resume", said).status == 409
    assert len(store.progress(plan.id).standing) == (seen is not True)


def test_nobody_else_decides(panel, store, page):
    plan = permitted(store, plan_with(2))
    store.halt(plan.id, "Li", "first")
    said = {"plan": plan.id, "reason": "because", "seen": 1}
    for browser, whys in ((page(), "PIN"), (page(JON), "engineer")):
        for path in ("/plan/halt", "/plan/resume"):
            answer = browser.post(path, said)
            assert answer.status == 403
            assert whys in answer.json()["why"]
    mei = page(MEI)
    for changed in ({"reason": ""}, {"reason": " "}, {"reason": "a\nb"}, {"reason": "x" * 201}):
        assert mei.post("/plan/resume", said | changed).status == 409
    assert mei.post("/plan/resume", said, X_Robolink_Token="0" * 64).status == 403
    assert mei.post("/plan/resume", said, Origin="https://evil.example").status == 403
    assert mei.post("/plan/halt", said | {"plan": "0123456789ab"}).status == 409
    assert len(store.progress(plan.id).standing) == 1
    assert [kind for kind, _, _ in panel.kept if kind.startswith("plan_")] == []


@pytest.mark.soak
def test_an_engineer_of_other_cells_resumes_nothing_at_these(location, store, page):
    """Of the plan's cells that this panel shows, he is engineer of one only."""
    from robolink.model import PersonRole

    cells = {CELLS[1]: {JON: PersonRole.ENGINEER}, CELLS[0]: {MEI: PersonRole.ENGINEER}}
    with PlantPanel().served(CELLS, people=cells) as panel:
        for name in (MEI, JON):
            Pins().set(name, Secret(PINS[name]))
        from robolink.fleet import plan_of

        table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n"}
        plan = plan_of({**table, "cells": list(CELLS)}, cells=CELLS)
        store.add_plan(plan)
        store.halt(plan.id, "Li", "first")
        browser = Browser(panel)
        text = browser.get("/").body.decode()
        browser.token = text.partition('data-token="')[2].partition('"')[0]
        assert browser.log_in(JON).status == 200
        answer = browser.post("/plan/resume", {"plan": plan.id, "reason": "x", "seen": 1})
        assert answer.status == 409
        assert CELLS[0] in answer.json()["why"]
        assert len(store.progress(plan.id).standing) == 1


@ONLY_A_FILE
def test_an_order_of_a_line_computer_that_takes_long_holds_up_no_halt(
    panel, store, page, monkeypatch
):
    plan = permitted(store, plan_with(2))
    browser, line = page(MEI), LineComputer(panel.port, token_of())
    begun, let_go, kept = threading.Event(), threading.Event(), LineJobStore.order_job

    def slow(*given, **more):
        begun.set()
        assert let_go.wait(20)
        return kept(*given, **more)

    monkeypatch.setattr(LineJobStore, "order_job", slow)
    with ThreadPoolExecutor(1) as pool:
        said = {"order": "A-17", "cell": CELLS[0], "kind": "check"}
        posted = pool.submit(line.post, said)
        try:
            assert begun.wait(20)
            halted = browser.post("/plan/halt", {"plan": plan.id, "reason": "the line stands"})
        finally:
            let_go.set()
        assert posted.result(20)[0] in (201, 503)
    assert halted.status == 200
    assert len(store.progress(plan.id).standing) == 1


# ---- A database that is away


@ONLY_A_FILE
def test_pages_say_since_when_the_database_is_not_reached(location, store, page):
    plan = permitted(store, plan_with(6))
    browser = page(MEI)
    eventually(lambda: _with(read(browser, "/plans"), "6 waiting"))
    shown = "5 waiting: an earlier ring"
    eventually(lambda: _with(read(browser, f"/plan/{plan.id}"), shown))
    with blocked(location):
        lost = eventually(lambda: _with(read(browser, "/plans"), "is not reached since"))
        assert "6 waiting" in lost, "what was heard before is shown"
        begun_s = time.monotonic()
        assert shown in read(browser, f"/plan/{plan.id}")
        assert time.monotonic() - begun_s < 0.5
        said = {"plan": plan.id, "reason": "the line stands"}
        assert browser.post("/plan/halt", said).status == 409
    eventually(lambda: "is not reached since" not in read(browser, "/plans"))
    assert store.progress(plan.id).standing == ()


@ONLY_A_FILE
def test_a_plan_that_was_not_heard_of_yet_is_awaited_and_not_denied(location, store, page):
    plan = permitted(store, plan_with(2))
    with blocked(location):
        text = read(page(), f"/plan/{plan.id}")
        assert "Looking ..." in text or "is not reached since" in text
        assert f'data-query="plan={plan.id}' in text, "its stream shows the plan once it is heard"
        assert page(MEI).get(f"/plan/{plan.id}/halt").status == 503


@ONLY_A_FILE
def test_a_decision_that_was_given_up_is_not_carried_out_later(location, store, page):
    plan = permitted(store, plan_with(2))
    browser = page(MEI)
    with blocked(location):
        answer = browser.post("/plan/halt", {"plan": plan.id, "reason": "the line stands"})
        assert answer.status == 409
    # What is asked after it is answered after it.
    said = {"plan": plan.id, "reason": "x", "seen": 1}
    assert browser.post("/plan/resume", said).status == 409
    assert store.progress(plan.id).standing == ()


@ONLY_A_FILE
@pytest.mark.parametrize(
    ("decision", "step"),
    [("halt", "halt_of"), pytest.param("resume", "lift", marks=pytest.mark.soak)],
)
def test_a_decision_that_is_given_up_on_its_way_is_undone(store, page, monkeypatch, decision, step):
    plan = permitted(store, plan_with(2))
    if decision == "resume":
        store.halt(plan.id, "Li", "first")
    before = store.progress(plan.id).standing
    browser, given_up, usual = page(MEI), threading.Event(), getattr(PlanCourse, step)

    def slow(course, *said):
        given_up.wait(20)
        return usual(course, *said)

    monkeypatch.setattr(PlantDesk.ask, "__defaults__", (0.5,))
    monkeypatch.setattr(PlanCourse, step, slow)
    said = {"plan": plan.id, "reason": "x", "seen": 1}
    assert browser.post(f"/plan/{decision}", said).status == 409
    given_up.set()
    # What is asked after it is answered after it.
    assert browser.post("/plan/resume", said | {"seen": 99}).status == 409
    assert store.progress(plan.id).standing == before


@ONLY_A_FILE
def test_stop_and_cells_wait_for_no_database(location, store, page):
    """A press of STOP is answered as fast while the database hangs as before."""
    permitted(store, plan_with(6))
    browser = page(MEI)
    usual_s = max(_stopped_s(browser, f"a{number}") for number in range(3))
    with blocked(location):
        eventually(lambda: _with(read(browser, "/plans"), "is not reached since"))
        hanging_s = max(_stopped_s(browser, f"b{number}") for number in range(3))
        begun_s = time.monotonic()
        assert CELLS[0] in read(browser, "/")
        assert time.monotonic() - begun_s < 1
    assert hanging_s < usual_s + 0.5


def _stopped_s(browser, press):
    begun_s = time.monotonic()
    answer = browser.post("/stop-all", {"press": press, "age_ms": 1})
    assert answer.json()["outcome"] == "nothing"
    return time.monotonic() - begun_s


@pytest.mark.soak
def test_one_look_serves_all_pages(location, store, page, monkeypatch):
    plan = permitted(store, plan_with(2))
    looks = []
    overviews = FleetStore.overviews

    def counted(self, most=20):
        looks.append(time.monotonic())
        return overviews(self, most)

    monkeypatch.setattr(FleetStore, "overviews", counted)
    browsers = [page() for _ in range(4)]
    begun_s = time.monotonic()
    while time.monotonic() - begun_s < 2.5:
        for browser in browsers:
            read(browser, "/plans")
            read(browser, f"/plan/{plan.id}")
    assert 1 <= len(looks) <= 4


@pytest.mark.soak
def test_a_stream_follows_a_plan(store, page):
    plan = permitted(store, plan_with(3))
    browser = page()
    read(browser, f"/plan/{plan.id}")
    with browser.live(cell=f"&plan={plan.id}&state=&page=1") as stream:
        store.begin(plan.id, plan.cells[0])
        store.record_outcome(plan.id, plan.cells[0], 1, REFUSED)
        until_s = time.monotonic() + 8
        while time.monotonic() < until_s:
            frame = stream.next()
            if "the guard is open" in frame.get("parts", {}).get("main", ""):
                assert frame["screen"] == "plan"
                return
    raise AssertionError


@pytest.mark.soak
def test_a_plan_of_two_thousand_cells_is_shown_in_pages(store, page):
    plan = plan_with(2000, kind="check", cells=cells_of(2000))
    store.add_plan(plan)
    browser = page()
    text = eventually(lambda: _with(read(browser, f"/plan/{plan.id}"), "<tr><th"))
    assert text.count("<tr><th") == 61
    assert len(text) < 40_000
    assert "cell-0061" in read(browser, f"/plan/{plan.id}?page=2")
    assert "cell-2000" in read(browser, f"/plan/{plan.id}?page=9999")
    assert store.progress(plan.id).counts() == {JobState.WAITING: 2000}
