"""The hub: the last snapshot for every tablet, and no tablet that holds up another."""

import asyncio
import math
import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from robolink_cli.panel import hub as hub_module
from robolink_cli.panel.app import Panel
from robolink_cli.panel.board import Board, PanelCell, may_begin
from robolink_cli.panel.cards import CellCard
from robolink_cli.panel.guard.pairing import Tablet as SeatedTablet
from robolink_cli.panel.guard.seat import SILENCE_S, Seats
from robolink_cli.panel.hub import BEAT_S, Hub, LivePage
from robolink_cli.panel.jobs import KINDS, JobEnd, PanelJob
from robolink_cli.panel.pages import HERE, Pages, Parts, Watcher
from robolink_cli.panel.record import Standing
from robolink_cli.panel.watch import CellLook, CellWatch, card_of
from robolink_cli.panel.words import speaking_in
from robolink_cli.wizard.views.records import (
    Head,
    JogPad,
    MovingView,
    QuestionView,
    Status,
    TouchView,
    View,
)
from starlette.websockets import WebSocketDisconnect

from robolink.journal import close_files, open_journal
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry
from robolink.stopping import StopNote
from tests.panel.access._bare import Clock

CELL = PanelCell("line3", "epson+tcp://192.0.2.1:5000")


class FewPages(Pages):
    """Draws a view as its question, and counts."""

    def __init__(self):
        self.drawn = 0

    def screen(self, view, watcher, *, camera=None):
        self.drawn += 1
        return Parts("question", view.head.title, view.body.question, watcher.language)

    def idle(self, card, watcher, *, camera=None):
        self.drawn += 1
        return Parts("idle", card.name, card.word, watcher.language)

    def overview(self, cards, watcher, bar=None):
        self.drawn += 1
        return Parts("overview", "", " ".join(card.word for card in cards), watcher.language)


class NoSeats:
    def __init__(self, tablet=""):
        self.tablet = tablet

    def holder(self, cell, *, moving=None):
        return SimpleNamespace(tablet=self.tablet, who="mei") if self.tablet else None


class FakeJob:
    kind = KINDS["change"]
    language = "en"

    def __init__(self):
        self.view, self.view_s, self.end = None, time.monotonic(), None
        self.alives = 0

    def alive(self):
        self.alives += 1

    async def wait(self):
        return None


@pytest.fixture(autouse=True)
def nothing_on_record(monkeypatch):
    """Leave the record of the hub's cells alone: its tests are of what is shown."""
    monkeypatch.setattr(hub_module, "RECORD_S", math.inf)


def view(number, question="?", age_s=0.1):
    status = Status("ready", halted=False, age_s=age_s)
    body = QuestionView((), question, text=False)
    return View(
        number, waits=True, head=Head("line3", "change", "Ready?"), status=status, body=body
    )


@pytest.fixture
def noted():
    return []


@pytest.fixture
def hub(noted):
    cells = [CELL, PanelCell("line4", "epson+tcp://192.0.2.2:5000")]
    return Hub(cells, FewPages(), NoSeats("t1"), lambda *what, **facts: noted.append(what))


class Tablet:
    """A page that keeps what it is sent; it may be slow."""

    def __init__(self, cell="line3", tablet="t1", language="en"):
        self.frames = []
        self.takes = asyncio.Event()
        self.takes.set()
        self.live = LivePage(self.send, lambda: Watcher(language), tablet, cell)

    async def send(self, frame):
        await self.takes.wait()
        self.frames.append(frame)

    def of(self, kind):
        return [frame for frame in self.frames if frame["t"] == kind]


def watched(hub, *tablets, then):
    async def work():
        shows = [asyncio.ensure_future(hub.show(one.live)) for one in tablets]
        try:
            return await then()
        finally:
            for one in shows:
                one.cancel()
            await asyncio.gather(*shows, return_exceptions=True)

    return work()


def change(hub, shown):
    board = hub.boards["line3"]
    board.job.view, board.job.view_s = shown, time.monotonic()
    board.renew()


def test_a_slow_tablet_gets_the_last_snapshot_only_and_holds_up_nobody(hub):
    async def work():
        slow, quick = Tablet(), Tablet(tablet="t2")

        async def then():
            await asyncio.sleep(0.02)
            slow.takes.clear()
            for number in range(1, 51):
                change(hub, view(number, f"question {number}"))
                await asyncio.sleep(0.005)
            slow.takes.set()
            await asyncio.sleep(0.05)
            return slow, quick

        hub.boards["line3"].job = FakeJob()
        hub.boards["line3"].job.view = view(0, "before")
        return await watched(hub, slow, quick, then=then)

    slow, quick = asyncio.run(work())
    base = hub.boards["line3"].base
    asked = [frame["parts"].get("main") for frame in slow.of("screen")]
    assert len(asked) <= 4, asked
    assert slow.of("screen")[-1]["number"] == base + 50
    assert asked[-1] == "question 50"
    assert len(quick.of("screen")) > 25


def test_what_does_not_differ_is_not_sent_and_all_tablets_share_one_drawing(hub):
    async def work():
        tablets = [Tablet(tablet=f"t{number}") for number in range(20)]

        async def then():
            await asyncio.sleep(0.05)
            for age_s in (0.2, 0.3):
                change(hub, view(1, "same", age_s))
                await asyncio.sleep(0.02)
            return tablets

        hub.boards["line3"].job = FakeJob()
        hub.boards["line3"].job.view = view(1, "same")
        return await watched(hub, *tablets, then=then)

    tablets = asyncio.run(work())
    assert all(len(one.of("screen")) == 1 for one in tablets)
    assert hub.pages.drawn == 3


def test_a_beat_comes_at_least_every_three_tenths_with_the_age_of_the_reading(hub):
    async def work():
        tablet = Tablet()

        async def then():
            await asyncio.sleep(4 * BEAT_S + 0.1)
            return tablet.of("beat")

        hub.boards["line3"].job = FakeJob()
        hub.boards["line3"].job.view = view(1, age_s=0.5)
        return await watched(hub, tablet, then=then)

    beats = asyncio.run(work())
    assert len(beats) >= 4
    ages = [beat["age_ms"] for beat in beats]
    assert ages == sorted(ages)
    assert ages[0] >= 500
    assert ages[-1] - ages[0] > 400, "an age that stands still shows what is stale as live"
    assert beats[0]["status"]["state"] == "ready"


def test_a_tablet_that_is_not_heard_any_more_is_let_go(hub, monkeypatch):
    monkeypatch.setattr(hub_module, "GONE_S", 0.1)

    async def work():
        tablet = Tablet()
        await asyncio.wait_for(hub.show(tablet.live), 5)
        return hub.lives

    assert asyncio.run(work()) == set()


def test_a_job_hears_that_its_tablet_is_there_only_from_its_own_page(hub):
    board = hub.boards["line3"]
    board.job = job = FakeJob()
    now_s = time.monotonic()
    for cell, tablet, heard_s, alive in (
        ("line3", "t2", now_s, False),
        ("line4", "t1", now_s, False),
        ("", "t1", now_s, False),
        ("line3", "t1", now_s - 1.5, False),
        ("line3", "t1", now_s, True),
    ):
        live = Tablet(cell, tablet).live
        live.heard_s = heard_s
        hub.lives = {live}
        job.alives = 0
        hub._tend(board, now_s)
        assert bool(job.alives) == alive, (cell, tablet, heard_s)


def test_numbers_of_one_job_are_none_of_another(hub):
    board = hub.boards["line3"]
    seen = set()
    for _ in range(3):
        board.next_numbers()
        board.job = FakeJob()
        for number in (0, 1, 2, 999_999):
            board.job.view = view(number)
            assert board.question() == number
            assert board.number not in seen
            seen.add(board.number)


def test_a_job_that_ended_without_order_is_told_and_on_record(hub, noted, monkeypatch):
    monkeypatch.setattr(hub_module, "standing_of", lambda *_: Standing())

    async def work():
        board = hub.boards["line3"]
        board.job = job = FakeJob()
        job.end = JobEnd(None, (), "Traceback of a child")
        before = board.number

        await hub._until_end(board, job)
        return board, before

    board, before = asyncio.run(work())
    assert board.job is None
    assert board.number != before
    assert "ended without saying how" in board.said[0]
    assert "Traceback" not in "".join(board.said)
    assert ("job_lost", "line3") in noted


def test_a_tablet_that_is_heard_keeps_its_seat_however_long_a_job_takes(hub):
    clock = Clock()
    seats = Seats(clock)
    seats.take("line3", SeatedTablet("t1", "10.0.0.1", paired=True), moving=False)

    class Line:
        frames = 4

        async def receive_text(self):
            self.frames -= 1
            if self.frames < 0:
                raise WebSocketDisconnect
            clock.sleep(SILENCE_S * 0.9)
            return '{"t":"pong"}'

    access = SimpleNamespace(seats=seats, audit=SimpleNamespace(note=None))
    parts: Any = (hub, None, access, None)
    line: Any = Line()
    desk: Any = None
    asyncio.run(Panel(*parts, looking=desk, ordering=desk)._listen(line, Tablet().live))
    assert seats.holder("line3", moving=False) is not None
    clock.sleep(SILENCE_S * 1.1)
    assert seats.holder("line3", moving=False) is None


# The card of a cell on which no job runs.


def watch(look=None):
    found = CellWatch("line3", CELL.url, None, lambda: None, asyncio.Semaphore(1))
    found.look = look
    return found


def card(look, age_s=0.0, standing=None):
    return card_of(watch(look), standing or Standing(), look.at_s + age_s, simulated=False)


READY = {"state": "ready", "selected_tool": 1}
AT = "2026-11-30T03:00:00+00:00"


def test_what_was_seen_is_never_shown_as_how_it_is_once_it_is_old():
    look = CellLook(50.0, AT, READY)
    assert card(look, 1).mark == "ok"
    old = card(look, 11)
    assert old.mark == "unknown"
    assert "This is how it was at" in " ".join(old.lines)
    by_another = CellLook(50.0, AT, {**READY, "held_by": "ann", "age_s": 30.0})
    assert card(by_another, 1).mark == "unknown", "another process read it half a minute before"


@pytest.mark.parametrize(
    ("read", "mark"),
    [
        (READY, "ok"),
        ({**READY, "held_by": "ann", "age_s": 0.1}, "look"),
        ({**READY, "running": True, "state": "running"}, "look"),
        ({**READY, "emergency_stop": True, "state": "emergency stop"}, "bad"),
        ({**READY, "guard_open": True}, "bad"),
        ({**READY, "state": "teach"}, "look"),
    ],
)
def test_only_what_is_ready_and_free_is_called_so(read, mark):
    assert card(CellLook(50.0, AT, read)).mark == mark


def test_what_went_wrong_with_a_look_is_told_in_the_language_of_the_page():
    """The look was made for a Chinese page; another tablet speaks English."""
    look = CellLook(50.0, AT, failed="no route", failed_here="\u4e0d\u901a", language="zh")
    with speaking_in("zh"):
        assert card(look).lines[0] == "\u4e0d\u901a"
    with speaking_in("en"):
        assert card(look).lines[0] == "no route"


def test_a_look_is_made_in_the_language_of_who_opened_the_page(hub, monkeypatch):
    board, asked = hub.boards["line3"], []

    async def take(language):
        asked.append(language)

    monkeypatch.setattr(board.watch, "take", take)
    for language, cell in (("en", ""), ("zh", "line3"), ("en", "line4")):
        hub.lives.add(Tablet(cell, language + cell, language).live)
    asyncio.run(hub._look(board))
    hub.lives.clear()
    asyncio.run(hub._look(board))
    assert asked == ["zh", "en"]


def test_a_robot_that_is_jogged_moves(monkeypatch):
    """The seat is not taken under a finger, nor between the steps of a held key."""
    board, now = Board(CELL, lambda _board: None, asyncio.Semaphore(1)), [100.0]
    monkeypatch.setattr("robolink_cli.panel.jobs.time.monotonic", lambda: now[0])
    body = TouchView((), "", (), "", (), (), JogPad((0.1,), 0.1, ()))
    job = board.job = PanelJob("line3", KINDS["change"], language="en", who="", changed=print)

    def shows(waits):
        job.view = replace(view(1), waits=waits, body=body)

    assert not board.moving, "it has shown nothing yet"
    shows(waits=True)
    assert not board.moving
    shows(waits=False)
    assert board.moving, "a step is under way"
    shows(waits=True)
    job.hold(1, "x+", "f")
    now[0] += 0.9
    assert board.moving
    job.beat("f")
    now[0] += 0.9
    assert board.moving
    job.beat("another")
    now[0] += 0.2
    assert not board.moving, "its finger is lost"
    job.hold(1, "x+", "g")
    job.release("f")
    assert board.moving
    job.release("g")
    assert not board.moving


def test_an_old_pin_is_asked_for_at_a_question_and_not_in_a_movement():
    pages, way = Pages(), MovingView("Turning", "", (), None, None)
    idle = CellCard("line3", "ok", "ready")
    for young in (True, False):
        watcher = Watcher(seat=HERE, role="operator", young=young)
        asked = pages.screen(view(1), watcher).foot
        assert ("15 minutes" in asked, "/login?cell=line3" in asked) == (not young, not young)
        assert ("15 minutes" in pages.idle(idle, watcher).foot) is not young
        moves = replace(view(1), waits=False, body=way)
        assert "15 minutes" not in pages.screen(moves, watcher).foot


def test_a_cell_that_does_not_answer_shows_no_old_values():
    shown = card(CellLook(50.0, AT, failed="no route"))
    assert shown.mark == "unknown"
    assert shown.lines[0] == "no route"


def test_an_open_job_counts_however_ready_the_controller_is(hub):
    marker = Marker("a", MarkerKind.CHANGE, "change of tool 1", AT, {})
    shown = card(CellLook(50.0, AT, READY), standing=Standing((marker,)))
    assert shown.mark == "look"
    board = hub.boards["line3"]
    board.standing = Standing((marker,))
    offers = {one.job: one for one in board.offers(Watcher(role="engineer"))}
    assert offers["recover"].why_not == ""
    assert offers["change"].why_not
    board.standing = Standing()
    assert "recover" not in {one.job for one in board.offers(Watcher())}


def test_a_release_is_offered_where_a_stop_is_on_record_or_holds_a_plc(hub):
    board = hub.boards["line3"]

    def offered():
        return "release" in {one.job for one in board.offers(Watcher(role="operator"))}

    board.watch.look = CellLook(50.0, AT, READY)
    assert not offered()
    board.watch.look = CellLook(50.0, AT, {**READY, "held_by_a_stop": True})
    assert offered(), "it was stopped from another computer: no note is here"
    board.watch.look = None
    board.standing = Standing(stopped=StopNote("x", "mei", AT, True))
    assert offered()


def test_a_look_is_made_for_a_page_or_where_the_cell_file_asks_for_it():
    never = watch()
    assert not never.is_due(100.0, wanted=False)
    assert never.is_due(100.0, wanted=True)
    never.look = CellLook(100.0, AT, READY)
    assert not never.is_due(10_000.0, wanted=False), "an idle cell was polled"
    assert not never.is_due(101.0, wanted=True), "six tabs would poll it"
    often = CellWatch("line3", CELL.url, 30.0, lambda: None, asyncio.Semaphore(1))
    assert often.is_due(0.0, wanted=False)
    often.look = CellLook(100.0, AT, READY)
    assert not often.is_due(129.0, wanted=False)
    assert often.is_due(130.0, wanted=False)


def test_an_operator_begins_what_is_an_operators():
    assert may_begin(KINDS["change"], "operator")
    assert not may_begin(KINDS["undo"], "operator")
    assert may_begin(KINDS["undo"], "engineer")
    for nobody in ("", "onlooker"):
        assert not any(may_begin(kind, nobody) for kind in KINDS.values())


def test_each_station_of_the_cell_file_is_offered_and_no_other_is_taken():
    cell = PanelCell("line3", CELL.url, stations=("PIN-07", "--yes"), tool=2)
    board = Hub([cell], FewPages(), NoSeats(), lambda *_, **__: None).boards["line3"]
    offered = [dict(one.values) for one in board.offers(Watcher(role="engineer")) if one.values]
    assert offered == [{"station": "PIN-07"}, {"station": "--yes"}]
    kind = KINDS["station"]
    assert board.station(kind, {"station": "PIN-07"}) == ("PIN-07", 2)
    for wrong in (None, "PIN-07", {}, {"station": "PIN-08"}, {"station": ["PIN-07"]}, {"tool": 1}):
        assert board.station(kind, wrong) is None
    assert board.station(KINDS["change"], {"station": "PIN-07"}) is None
    job = PanelJob(
        "line3",
        kind,
        language="en",
        who="mei",
        changed=lambda: None,
        station=board.station(kind, {"station": "--yes"}),
    )
    learn = ["cell", "station", "learn", "--tool", "2", "--", "--yes"]
    assert job.arguments == ["-c", "line3", "--operator", "mei", *learn]


def recipe(name):
    return SimpleNamespace(name=name, path=f"/cells/{name}.toml", told=lambda: (f"{name} told",))


def test_each_recipe_is_offered_and_only_an_offered_one_is_taken(hub):
    board, kind = hub.boards["line3"], KINDS["change"]

    def offers():
        return [one for one in board.offers(Watcher(role="operator")) if one.job == "change"]

    assert [(one.details, dict(one.values)) for one in offers()] == [((), {})]
    board.recipes = (recipe("needle"),)
    (only,) = offers()
    assert dict(only.values) == {}, "the job tells more of a single recipe"
    assert only.details == ("recipe: needle", "needle told")
    board.recipes = (recipe("needle"), recipe("two"))
    assert [dict(one.values) for one in offers()] == [{"recipe": "needle"}, {"recipe": "two"}]
    assert board.subject(kind, {"recipe": "two"}) == "/cells/two.toml"
    for wrong in (None, "two", {}, {"recipe": "/etc/passwd"}, {"recipe": ["two"]}):
        assert board.subject(kind, wrong) == ""
    assert board.subject(KINDS["undo"], {"recipe": "two"}) == ""
    board.recipes = (recipe("needle"), recipe("needle"))
    assert [dict(one.values) for one in offers()] == [{}], "a name that two share chooses neither"
    assert board.subject(kind, {"recipe": "needle"}) == ""


def test_what_a_job_tells_is_shown_at_once():
    shown = []
    one = PanelJob(
        "line3",
        KINDS["change"],
        language="en",
        who="",
        changed=lambda: shown.append(list(one.told)),
    )
    one._heard({"t": "told", "text": "The tip was 0.2 mm off."})
    one._heard({"t": "beat"})
    assert shown == [["The tip was 0.2 mm off."]]


def test_a_job_with_a_recipe_names_its_file_and_nothing_that_is_an_option():
    one = PanelJob(
        "line3", KINDS["change"], language="en", who="", changed=lambda: None, subject="-x.toml"
    )
    assert one.arguments == ["-c", "line3", "change", "--", "-x.toml"]


def test_simulated_is_only_what_the_last_reader_was_told(hub):
    board = hub.boards["line3"]
    simulated = {**READY, "controller": "epson:C-SIM0A1B2C3D/SIM0A1B2C3D"}
    held = {**READY, "controller": CELL.url, "held_by": "ann"}
    nameless = {**READY, "controller": CELL.url}
    plc = {**READY, "controller": "softmotion:1A"}
    for read, shown in (
        (None, False),
        (simulated, True),
        (None, True),  # a job has ended, and the next look is under way
        (held, True),
        (nameless, True),
        ({**nameless, "controller": "epson:C-T60A1B2C3D/T6"}, False),
        ({**plc, "simulated": True}, True),
        ({**plc, "simulated": False}, False),
    ):
        board.watch.look = None if read is None else CellLook(50.0, AT, read)
        assert board.simulated is shown, read
    board.watch.look = CellLook(50.0, AT, failed="no route")
    assert not board.simulated, "what does not answer may be another"
    board.watch.look = CellLook(50.0, AT, nameless)
    board.standing = Standing(simulated=True)
    assert board.simulated, "a simulator was met there last"
    board.job = FakeJob()
    board.job.view = view(1)
    assert not board.simulated, "the job is connected to a real one"
    board.job = None
    assert not board.simulated, "the record outweighs a job that was connected since"


def test_no_age_is_told_where_nothing_was_read(hub):
    board = hub.boards["line3"]
    assert hub.beat(Tablet().live, 60.0)["age_ms"] is None
    board.watch.look = CellLook(50.0, AT, READY)
    assert hub.beat(Tablet().live, 60.0)["age_ms"] == 10_000
    assert hub.beat(Tablet(cell="").live, 60.0)["age_ms"] is None


def test_a_cell_that_names_no_tool_finds_no_station():
    cell = PanelCell("line3", CELL.url, stations=("PIN-07",))
    board = Hub([cell], FewPages(), NoSeats(), lambda *_, **__: None).boards["line3"]
    assert "station" not in {one.job for one in board.offers(Watcher(role="engineer"))}
    assert board.station(KINDS["station"], {"station": "PIN-07"}) is None


def test_while_it_runs_the_journal_is_copied_to_the_plant(hub, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    open_journal().log("cell-a").append(NewEntry(EntryKind.DECISION))

    async def work():
        asked = asyncio.Event()

        async def answer(_, writer):
            asked.set()
            writer.close()

        async with await asyncio.start_server(answer, "127.0.0.1", 0) as plant:
            port = plant.sockets[0].getsockname()[1]
            monkeypatch.setenv("ROBOLINK_PLANT", f"postgresql://u@127.0.0.1:{port}/plant")
            running = asyncio.ensure_future(hub.run())
            await asyncio.wait_for(asked.wait(), 10)
            running.cancel()

    asyncio.run(work())
    close_files()
