"""The job of a plan on the panel: offered first, begun there, carried out by ``fleet next``."""

import asyncio
import os
import subprocess
import sys

import pytest
from robolink_cli.panel.board import PanelCell
from robolink_cli.panel.guard.people import NOBODY, Pins
from robolink_cli.panel.hub import Hub
from robolink_cli.panel.jobs import KINDS, PanelJob
from robolink_cli.panel.pages import Pages, Watcher
from robolink_cli.session.cell_plans import due_at_cells
from robolink_cli.wizard.views.page_ways import on_a_page
from robolink_cli.wizard.views.records import ChoiceView, EndView, QuestionView
from robolink_simulators.control.assist import InProcessEyes

from robolink.config import load_cells
from robolink.fleet import JobState
from robolink.model import Secret
from tests.fleet._moving_cells import NEW
from tests.panel.job._tablet import at_the_wire, change
from tests.panel.server._panel import PIN, Tablet, panel


class NoSeats:
    """Nobody works on a cell."""

    def holder(self, cell, *, moving=None):
        return None


HERE = Watcher(role="operator", who="mei", seat="here")


@pytest.fixture
def boards(cells):
    hub = Hub([PanelCell(name, "") for name in "ab"], Pages(), NoSeats(), lambda *_, **__: None)

    def offered():
        hub._offer(due_at_cells("plant"))
        return hub.boards

    return offered


def test_the_job_of_a_plan_is_offered_first_and_on_the_card(cells, boards):
    a = boards()["a"]
    assert next(one.job for one in a.offers(HERE)) == "change"
    plan = cells.plan(name="needles of November", kind="nozzle_change")
    a, b = boards().values()
    first, *_ = a.offers(HERE)
    assert (first.job, first.values) == ("plan", {"plan": plan.id})
    assert first.text == "Plan needles of November waits for you here"
    assert any(plan.recipe_hash[:12] in line for line in first.details)
    card = a.card(HERE, 0.0)
    assert card.lines[0] == first.text
    assert a.sign(0.0) == "look", "it is found among many cells"
    page = Pages().idle(card, HERE).main
    assert "Plan needles of November waits for you here" in page
    assert b.planned is None, "its ring has not begun"
    kind = KINDS["plan"]
    assert a.subject(kind, {"plan": plan.id}) == plan.id
    for wrong in (None, {}, {"plan": ""}, {"plan": "0123456789ab"}, {"recipe": plan.id}):
        assert a.subject(kind, wrong) == ""
    assert b.subject(kind, {"plan": ""}) == b.subject(kind, {"plan": plan.id}) == ""
    job = PanelJob("a", kind, language="en", who="mei", changed=print, subject=plan.id)
    assert job.arguments == ["-c", "a", "--operator", "mei", "fleet", "next", "--", plan.id]
    cells.store.halt(plan.id, "Li")
    assert boards()["a"].planned is None


def test_only_the_panel_at_the_home_of_a_cell_offers_it(cells):
    cells.plan()
    file, offered = cells.folder / "robolink.toml", []
    text = file.read_text()
    for home in ("", 'home = "elsewhere"\n'):
        file.write_text(home + text)
        cell = PanelCell("a", "", configured=load_cells()["a"])
        hub = Hub([cell], Pages(), NoSeats(), lambda *_, **__: None)
        hub._offer(due_at_cells("plant"))
        offered.append(hub.boards["a"].planned is not None)
    assert offered == [True, False]


def test_a_job_is_carried_out_on_a_page(cells):
    plan = cells.plan()
    ended = []

    def script(tablet):
        first = tablet.body(ChoiceView)
        assert first.question == "Carry out this job now?"
        assert any("Chen" in line for line in first.rows[0].details)
        ended.append(change(tablet, InProcessEyes(cells.simulators["a"])))
        tablet.press("finish")

    code, tablet = at_the_wire(["-c", "a", "--operator", "mei", "fleet", "next", plan.id], script)
    (end,) = ended
    assert (code, tablet.left["code"], end.done) == (0, 0, True), tablet.left
    assert any("done, on record" in line for line in tablet.left["kept"])
    assert cells.tool("a").components() == pytest.approx(NEW.components(), abs=2e-3)
    job = cells.job(plan, "a")
    assert (job.state, job.attempt, cells.writes("a")) == (JobState.KEPT, 1, 1)


@pytest.mark.soak
def test_a_terminal_beside_the_page_is_told_who_has_the_job(cells):
    plan, beside = cells.plan(), []

    def script(tablet):
        tablet.body(ChoiceView)
        tablet.press("choose", tablet.view.body.rows[0].value)
        tablet.body(QuestionView)  # it has begun, and asks how the points were taught
        words = ["-m", "tests.fleet._killed_next", "1000000", "-c", "a", "fleet", "next"]
        beside.append(
            subprocess.run([sys.executable, *words], check=False, capture_output=True, text=True)
        )
        change(tablet, InProcessEyes(cells.simulators["a"]))
        tablet.press("finish")

    code, _ = at_the_wire(["-c", "a", "fleet", "next", plan.id], script)
    (other,) = beside
    assert (code, other.returncode) == (0, 5), other.stdout
    assert str(os.getpid()) in other.stdout
    job = cells.job(plan, "a")
    assert (job.state, job.attempt, cells.writes("a")) == (JobState.KEPT, 1, 1)


def test_whoever_leaves_the_page_before_it_began_leaves_the_job_waiting(cells):
    plan = cells.plan()

    def script(tablet):
        tablet.body(ChoiceView)
        tablet.press("leave")
        tablet.body(EndView)
        tablet.press("leave")

    code, _ = at_the_wire(["-c", "a", "fleet", "next", plan.id], script)
    job = cells.job(plan, "a")
    assert (code, job.state, job.attempt, cells.writes("a")) == (9, JobState.WAITING, 0, 0)


def test_a_sentence_that_names_the_command_names_the_button_of_the_page():
    said = on_a_page("To report it later: robolink -c a fleet next 0123456789ab")
    assert said == "To report it later: 'Carry out the job of a plan' on this page"


@pytest.mark.soak
@pytest.mark.timeout(240)
def test_a_served_panel_begins_it_for_who_has_the_seat(cells):
    plan = cells.plan(plant="west")
    Pins().set(NOBODY, Secret(PIN))

    async def work(port):
        tablet = Tablet(port)
        assert tablet.login() == 200
        async with tablet.live("a") as page, tablet.live() as overview:
            waits = "waits for you here"
            await page.until(lambda page: waits in page.parts.get("main", ""))
            await overview.until(lambda page: waits in page.parts.get("main", ""))
            assert (await tablet.post("/seat", cell="a"))[0] == 200
            other = {"plan": "0123456789ab"}
            assert (await tablet.post("/start", cell="a", job="plan", values=other))[0] == 409
            assert (await tablet.post("/start", cell="b", job="plan", values=other))[0] == 409
            ours = {"plan": plan.id}
            assert (await tablet.post("/start", cell="a", job="plan", values=ours))[0] == 200
            await page.until(lambda page: page.screen == "choice")
            assert "needles" in page.parts["main"]
            while page.screen != "end":
                before = page.number
                act = {"choice": ("choose", "1"), "question": ("yes", ""), "values": ("write", "1")}
                action = act.get(page.screen, ("go_on", ""))
                await page.press_until(
                    lambda page, before=before: page.number != before or page.screen == "end",
                    *action,
                )
            assert plan.id in page.parts["main"]
            await page.press_until(lambda page: page.screen == "idle", "finish")
            await page.until(lambda page: waits not in page.parts["main"])

    with panel(cells.folder / "robolink.toml", "--plant", "west") as (_, port):
        asyncio.run(work(port))
    job = cells.job(plan, "a")
    assert (job.state, job.attempt, cells.writes("a")) == (JobState.KEPT, 1, 1)
