"""The page of all cells with many of them: groups, states, pages."""

import asyncio
import re
from types import SimpleNamespace
from typing import Any

import pytest
from robolink_cli.panel import hub as hub_module
from robolink_cli.panel.board import PanelCell
from robolink_cli.panel.cards import A_PAGE, SIGNS, CellChoice
from robolink_cli.panel.hub import Hub, LivePage
from robolink_cli.panel.pages import Pages, Watcher
from robolink_cli.panel.record import Standing
from robolink_cli.panel.watch import STALE_AFTER_S, CellLook

from robolink.model import Marker, MarkerKind

WATCHER = Watcher()
PAGES = Pages()
"""It keeps nothing of a cell, and to compile its templates takes longer than to draw a page."""
COUNT = 240
NAMES = [f"line{number // 40 + 1}-{number % 40:02}" for number in range(COUNT)]
GROUPS = {"line3": ("line3-*",), "first": ("line1-00", "line2-*"), "none": ("x*",)}
NOW_S = 1000.0


class NoSeats:
    def holder(self, cell, *, moving=None):
        return None


@pytest.fixture
def hub():
    cells = [PanelCell(name, "epson+tcp://192.0.2.1:5000") for name in NAMES]
    return Hub(cells, PAGES, NoSeats(), lambda *_what, **_facts: None, GROUPS)


def seen(board, state="ready", age_s=1.0, **read):
    board.watch.look = CellLook(NOW_S - age_s, "2026-11-30T09:00:00+00:00", {"state": state} | read)


def drawn(hub, **choice):
    hub.everything_changed()
    parts = hub.overview(WATCHER, NOW_S, CellChoice(**choice))
    return re.findall(r'<b class="name">(.*?)</b>', parts.main), parts


def test_many_cells_are_shown_in_pages_that_stay_small(hub):
    names, parts = drawn(hub)
    assert names == NAMES[:A_PAGE]
    assert len(parts.main) < 30_000
    assert f"{COUNT} of {COUNT} cells" in parts.head
    assert 'href="/?page=2"' in parts.foot
    assert drawn(hub, page=2)[0] == NAMES[A_PAGE : 2 * A_PAGE]
    last, parts = drawn(hub, page=99)
    assert last[-1] == NAMES[-1]
    assert 'href="/?page=6"' not in parts.foot


def test_a_group_shows_its_cells_and_no_others(hub):
    names, parts = drawn(hub, group="line3")
    assert names == [name for name in NAMES if name.startswith("line3-")]
    assert "40 of 40 cells" in parts.head
    assert drawn(hub, group="first")[0] == ["line1-00", *NAMES[40:80]]
    for nothing in ("none", "nowhere"):
        names, parts = drawn(hub, group=nothing)
        assert names == []
        assert "No cell is like that now." in parts.main


def test_the_page_of_groups_counts_their_states(hub):
    seen(hub.boards["line3-07"], emergency_stop=True)
    names, parts = drawn(hub, groups=True)
    assert names == list(GROUPS)
    assert 'href="/?group=line3"' in parts.main
    assert "fault: 1" in parts.main
    assert "not known: 39" in parts.main


def test_cells_are_found_by_what_their_cards_show(hub):
    """A sign that said something else than the card would hide a cell that needs help."""
    looks: list[tuple[str, float, dict[str, Any]]] = [
        ("ready", 1.0, {}),
        ("ready", STALE_AFTER_S + 1, {}),
        ("teach", 1.0, {}),
        ("ready", 1.0, {"guard_open": True}),
        ("ready", 1.0, {"held_by": "mei"}),
    ]
    for number, (state, age_s, read) in enumerate(looks):
        seen(hub.boards[NAMES[number]], state, age_s, **read)
    for board in list(hub.boards.values())[:8]:
        assert board.sign(NOW_S) == board.card(WATCHER, NOW_S).mark
    assert drawn(hub, sign="ok")[0] == [NAMES[0]]
    assert drawn(hub, sign="look")[0] == [NAMES[2], NAMES[4]]
    assert drawn(hub, sign="bad")[0] == [NAMES[3]]
    assert len(drawn(hub, sign="unknown", group="line3")[0]) == 40


def test_an_interrupted_job_is_found_at_a_cell_that_nobody_looked_at(hub):
    at = "2026-11-30T09:00:00+00:00"
    marker = Marker("a", MarkerKind.CHANGE, "change of tool 1", at, {})
    board = hub.boards[NAMES[-1]]
    board.standing = Standing(interrupted=(marker,))
    assert drawn(hub, sign="look")[0] == [NAMES[-1]]


def test_a_job_is_found_by_its_sign_and_a_halted_one_as_a_fault(hub):
    status = SimpleNamespace(halted=False)
    job: Any = SimpleNamespace(view=SimpleNamespace(status=status), is_held=False)
    board = hub.boards[NAMES[5]]
    board.job = job
    assert board.sign(NOW_S) == "busy"
    status.halted = True
    assert board.sign(NOW_S) == "bad"
    assert set(SIGNS) >= {board.sign(NOW_S)}


def test_an_address_asks_for_what_there_is(hub):
    for said in (
        {"page": "-1"},
        {"page": "1e9"},
        {"page": "99999999"},
        {"sign": "<b>"},
        {"group": "<script>"},
        {"page": "\u0663"},
    ):
        choice = CellChoice.of(said)
        assert choice.page == 1
        assert choice.sign == ""
        assert "<script>" not in "".join(hub.overview(WATCHER, NOW_S, choice).named().values())
    one = CellChoice("line3", "bad", 4)
    assert CellChoice.of({"group": "line3", "sign": "bad", "page": "4"}) == one
    assert one.link(sign="") == "/?group=line3"


def test_few_cells_have_the_page_that_they_always_had():
    cells = [PanelCell("line3", "epson+tcp://192.0.2.1:5000")]
    small = Hub(cells, PAGES, NoSeats(), lambda *_what, **_facts: None)
    parts = small.overview(WATCHER, NOW_S)
    assert "ways" not in parts.main
    assert "dense" not in parts.main


def test_records_of_many_cells_are_read_a_few_at_a_time(hub, monkeypatch):
    """All of them at once would keep everything else from the processor for minutes."""
    at_once, most, read = 0, 0, []

    async def reads(board):
        nonlocal at_once, most
        at_once += 1
        most = max(most, at_once)
        await asyncio.sleep(0)
        read.append(board.name)
        at_once -= 1

    monkeypatch.setattr(hub, "read_standing", reads)

    async def work():
        run = asyncio.ensure_future(hub.run())
        while len(read) < 100:
            await asyncio.sleep(0)
        run.cancel()
        await asyncio.gather(run, return_exceptions=True)

    asyncio.run(work())
    assert most <= hub_module.READS_AT_ONCE


def test_a_page_of_plans_has_no_cell_looked_at_for_it(hub):
    async def send(_frame):
        pass

    plans = LivePage(send, lambda: WATCHER, "t1", draw=lambda _w, _s: hub.overview(WATCHER, NOW_S))
    every, one = LivePage(send, lambda: WATCHER, "t2"), LivePage(send, lambda: WATCHER, "t3", "a")
    assert not plans.follows("a")
    assert every.follows("a")
    assert (one.follows("a"), one.follows("b")) == (True, False)
