"""The attacks against the panel itself, and what must never be possible from a page."""

import asyncio
import json
import random
import threading
from contextlib import contextmanager
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_cli.panel.app import Panel as Application
from robolink_cli.panel.board import PanelCell
from robolink_cli.panel.guard import access as access_module
from robolink_cli.panel.guard.gate import LIVE, POSTS, REPORT_SECURITY
from robolink_cli.panel.guard.people import Pins
from robolink_cli.panel.hub import Hub
from robolink_cli.panel.jobs import KINDS, PanelJob, options_of
from robolink_cli.panel.plant.plan_pages import PlanPages
from robolink_cli.panel.serving import PanelPlace, Served, serve
from robolink_cli.panel.watch import CellWatch
from robolink_cli.wizard.views.wire import from_wire
from starlette.routing import Route, WebSocketRoute

from robolink.model import PersonRole, Secret
from tests.panel.access._bare import CELL, JON, MEI, OPEN_CELL, PEOPLE, PINS, Browser

URL = "epson+tcp://127.0.0.1:9"
"""Nobody listens there."""

GETS = {
    "/",
    "/cell/{cell}",
    "/cell/{cell}/history",
    "/cell/{cell}/picture",
    "/cell/{cell}/report/{change}",
    "/login",
    "/pair",
    "/plan/{plan}",
    "/plan/{plan}/{decision}",
    "/plans",
    "/static/{name}",
}


VIEW = {
    "number": 7,
    "waits": True,
    "head": {
        "cell": CELL,
        "job": "undo",
        "title": "Ready?",
        "step": None,
        "simulated": True,
        "needle": "",
    },
    "status": None,
    "body": {"kind": "question", "told": [], "question": "Ready?", "text": False},
    "actions": [],
    "heard": [],
    "message": "",
}


class RunningJob(PanelJob):
    """A job without a process, which keeps what it is told."""

    def __init__(self, *given, **named):
        super().__init__(*given, **named)
        self.heard = []

    def _send(self, said, *, may_be_lost=False):
        if said["t"] != "alive":
            self.heard.append(said)


class Product:
    """The panel, served; with the notes and the begun jobs of a test."""

    def __init__(self):
        self.kept, self.begun = [], []
        self.trusts = None
        self.runs: Any = False
        """Whether what is begun runs; then the job that runs."""
        self.hub: Any = None

    def note(self, kind, cell, **facts):
        self.kept.append((kind, cell, facts))

    def browser(self, **options):
        return Browser(self, **options)

    def board(self, cell):
        return self.hub.boards[cell]

    @contextmanager
    def served(self, place=None, names=()):
        ready = threading.Event()
        loop_of: list[Any] = []

        async def run():
            ended = asyncio.Event()
            loop_of.extend((asyncio.get_running_loop(), ended))

            def told(url):
                self.port = int(url.rstrip("/").rpartition(":")[2])
                ready.set()

            cells = tuple(PanelCell(name, URL) for name in PEOPLE)
            served = Served(cells, PEOPLE, names, audit=self)
            await serve(served, place or PanelPlace("127.0.0.1", 0), ready=told, ended=ended)

        thread = threading.Thread(target=lambda: asyncio.run(run()))
        thread.start()
        try:
            assert ready.wait(60)
            yield self
        finally:
            loop_of[0].call_soon_threadsafe(loop_of[1].set)
            thread.join(20)
        assert not thread.is_alive()


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """One panel for all tests here, on which no job runs: what would begin is kept."""
    folder = tmp_path_factory.mktemp("panel")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLINK_STATE_DIR", str(folder))
        patch.setattr(access_module, "COMMANDS_A_SECOND", 1e9)
        patch.setattr("robolink_cli.panel.guard.gate.COMMANDS_A_SECOND", 1e9)
        patch.setattr("robolink_cli.panel.guard.live.COMMANDS_A_SECOND", 1e9)
        patch.setattr("robolink_cli.panel.guard.people.COST", 2)
        product = Product()

        async def begin(_self, board, kind, **given):
            product.begun.append((board.name, kind.name, given))
            if product.runs:
                job = RunningJob(board.name, kind, changed=board.renew, **given)
                job.view = from_wire(VIEW)
                board.job = product.runs = job

        async def looks_at_nothing(_self):
            pass

        made = Hub.__init__

        def kept(hub, *given, **named):
            made(hub, *given, **named)
            product.hub = hub

        patch.setattr(Hub, "__init__", kept)
        patch.setattr(Hub, "begin", begin)
        patch.setattr(CellWatch, "take", looks_at_nothing)
        for name, pin in PINS.items():
            Pins().set(name, Secret(pin))
        with product.served():
            yield product


@pytest.fixture
def product(served):
    served.kept.clear()
    served.begun.clear()
    return served


def page(product, who=MEI, cell=CELL):
    """Return a browser with a page of the panel; logged in, with the seat."""
    browser = product.browser()
    text = browser.get("/").body.decode()
    browser.token = text.partition('data-token="')[2].partition('"')[0]
    assert len(browser.token) == 64
    assert 'class="dark"' not in text  # nobody has chosen that
    if who is not None:
        assert browser.log_in(who).status == 200
        assert browser.post("/seat", {"cell": cell}).status == 200
    return browser


def test_each_address_of_the_panel_stands_in_the_table_of_the_gate():
    found = Application.application(object.__new__(_Routes))
    gets, posts, streams = set[str](), set[str](), set[str]()
    for route in found.routes:
        if isinstance(route, WebSocketRoute):
            streams.add(route.path)
        else:
            assert isinstance(route, Route)
            methods = set(route.methods or ()) - {"HEAD"}
            (posts if methods == {"POST"} else gets).add(route.path)
            assert methods in ({"GET"}, {"POST"}), route.path
    assert gets <= GETS
    assert posts == set(POSTS) - {"/pair", "/login", "/logout"}  # these the gate answers itself
    assert streams == {LIVE}


class _Routes(Application):
    """The application without anything behind it."""

    plans = object.__new__(PlanPages)

    def __init__(self):
        pass


def test_a_token_of_a_page_is_that_of_its_stream(product):
    browser = page(product)
    with browser.live() as stream:
        assert stream.hello["token"] == browser.token


def test_looking_needs_nothing_here_and_commanding_everything(product):
    browser = page(product, who=None)
    for path in ("/", f"/cell/{CELL}", "/login", "/static/panel.js", "/static/panel.css"):
        assert browser.get(path).status == 200, path
    for path in ("/seat", "/start"):
        answer = browser.post(path, {"cell": CELL, "job": "change"})
        assert answer.status == 403
        assert "PIN" in answer.json()["why"]
    assert product.begun == []
    browser.log_in()
    assert browser.post("/start", {"cell": CELL, "job": "change"}).status == 409
    browser.post("/seat", {"cell": CELL})
    assert browser.post("/start", {"cell": CELL, "job": "change"}).status == 200
    assert [(cell, job) for cell, job, _ in product.begun] == [(CELL, "change")]


def test_another_page_begins_nothing_and_stops_nothing(product):
    browser = page(product)
    foreign = {"Origin": "https://evil.example", "Sec_Fetch_Site": "cross-site"}
    for path in POSTS:
        said = {"cell": CELL, "job": "change", "press": "x", "age_ms": 1}
        assert browser.post(path, said, **foreign).status == 403
    assert browser.refused(**foreign) == 403
    assert product.begun == []
    assert [kind for kind, _, _ in product.kept if kind == "stop"] == []


# ---- Never from a page.

FORBIDDEN = "execute-raw set clear select restore reset motors --yes -y --accept-jump --accept-turn"


def test_no_job_is_a_raw_statement_a_typed_value_or_a_yes_in_advance():
    for kind in KINDS.values():
        words = {*kind.words, *kind.values.values()}
        assert not words & set(FORBIDDEN.split()), kind.name
        assert not words & {"--speed", "--power", "--password-file", "--record"}, kind.name


NO_JOBS: list[object] = [
    *["execute-raw", "tool", "reset", "robot", "journal", "expert", "sim", "--yes", "-c"]
]
NO_JOBS += [
    *["CHANGE", "solve", "jog", "panel"],
    "tool set",
    "cell new",
    "panel pin",
    "change --yes",
]
NO_JOBS += ["", " change", None, 1, ["change"]]


def test_what_is_no_job_does_not_begin(product):
    browser = page(product)
    for job in NO_JOBS:
        assert browser.post("/start", {"cell": CELL, "job": job}).status == 404, job
    assert product.begun == []


def test_an_operator_begins_nothing_that_takes_an_engineer(product):
    browser = page(product, JON)
    for kind in KINDS.values():
        answer = browser.post("/start", {"cell": CELL, "job": kind.name})
        begins = kind.role is not PersonRole.ENGINEER and not kind.of_plan  # no plan waits here
        assert (answer.status == 200) == begins, kind.name
    assert KINDS["undo"].role is PersonRole.ENGINEER
    assert "undo" not in [job for _, job, _ in product.begun]
    assert all(given["who"] == JON for _, _, given in product.begun)


def test_nobody_commands_a_cell_of_other_people(product):
    browser = page(product, JON)
    for path in ("/seat", "/start"):
        assert browser.post(path, {"cell": OPEN_CELL, "job": "change"}).status == 403
    for cell in ("nowhere", "", None, 1, [CELL], {"cell": CELL}, "../line3", "LINE3"):
        answer = browser.post("/start", {"cell": cell, "job": "change"})
        assert answer.status in (400, 403)
    assert product.begun == []


TEXTS = st.one_of(
    st.text(max_size=40),
    st.sampled_from(
        ["--yes", "-y", "--operator=boss", "-c", "a\x00b", "--", "-", "@file", "\n--yes"]
    ),
)


@settings(max_examples=15, deadline=None)
@given(st.dictionaries(st.text(max_size=20), TEXTS, max_size=5), st.sampled_from(sorted(KINDS)))
def test_no_value_of_a_page_becomes_an_option_of_a_command(values, name):
    kind = KINDS[name]
    known = dict.fromkeys(kind.values, "x")
    for given_values in (values, {key: values.get(key, "--yes") for key in known}):
        options = options_of(kind, given_values)
        job = PanelJob(CELL, kind, language="en", who=MEI, changed=lambda: None, values=options)
        line = job.arguments
        assert line[: 4 + len(kind.words)] == ["-c", CELL, "--operator", MEI, *kind.words]
        rest = line[4 + len(kind.words) :]
        assert set(rest[::2]) <= set(kind.values.values())
        assert not any(value.startswith("-") for value in rest[1::2])


def test_the_seat_is_one_and_who_lost_it_commands_nothing(product):
    mei, jon = page(product, MEI), page(product, JON)
    assert mei.post("/start", {"cell": CELL, "job": "change"}).status == 409
    assert jon.post("/start", {"cell": CELL, "job": "change"}).status == 200
    with mei.live() as stream:
        for frame in (
            {"t": "press", "action": "start"},
            {"t": "hold", "axis": "x+", "finger": "f"},
        ):
            stream.send(number=1, press="p", **frame)
            while (answer := stream.next())["t"] != "refused":
                pass
            assert JON in answer["why"]


def test_a_press_without_a_job_presses_nothing(product):
    browser = page(product)
    with browser.live() as stream:
        for number in (0, 1, -1, 2**80, True, "1", None, 1.5):
            stream.send(t="press", number=number, action="start", press="p")
            while (answer := stream.next())["t"] != "refused":
                pass
            assert answer["why"]
    assert product.begun == []


@pytest.fixture
def job(product):
    """A job of an engineer that asks question 7, on a page that has the seat, and its number."""
    browser, product.runs = page(product, MEI), True
    assert browser.post("/start", {"cell": CELL, "job": "undo"}).status == 200
    running = product.runs
    try:
        text = browser.get(f"/cell/{CELL}").body.decode()
        yield browser, running, int(text.partition('data-number="')[2].partition('"')[0])
    finally:
        product.runs = False
        product.board(CELL).job = None


def answered(stream, **frame):
    """Send a frame, and return what is said of it within the stream; ``None`` for nothing."""
    stream.send(**frame)
    stream.send(t="stop", press="after", age_ms=6000)
    while (answer := stream.next())["t"] not in ("refused", "stopped"):
        pass
    if answer["t"] == "refused":
        while stream.next()["t"] != "stopped":
            pass
        return answer["why"]
    return None


def test_a_press_for_another_question_presses_nothing(job):
    browser, running, number = job
    with browser.live() as stream:
        others = (7, number - 1, number + 1, 0, -number, str(number), None, True, number + 0.5)
        for other in others:
            why = answered(stream, t="press", number=other, action="yes", press="p")
            assert "has changed" in why
        answered(stream, t="hold", number=number - 1, axis="x+", finger="f")
        assert running.heard == []
        assert answered(stream, t="press", number=number, action="yes", press="p") is None
        (heard,) = running.heard
        assert (heard["number"], heard["action"]) == (7, "yes")


def test_what_another_tablet_recorded_and_sends_again_presses_nothing(product, job):
    browser, running, number = job
    thief = page(product, who=None)
    for jar in ({}, {key: value for key, value in browser.jar.items() if "login" in key}):
        thief.jar |= jar
        with thief.live() as stream:
            for kind in ("press", "hold", "beat"):
                answered(stream, t=kind, number=number, action="yes", axis="x+", finger="f")
    assert running.heard == []


def test_an_operator_does_not_go_on_with_what_an_engineer_began(product, job):
    _, running, number = job
    jon = page(product, JON)  # the robot rests: the seat may be taken
    with jon.live() as stream:
        for action in ("yes", "write", "confirm", "start", "take", "answer", "choose"):
            why = answered(stream, t="press", number=number, action=action, press="p")
            assert MEI in why
        answered(stream, t="hold", number=number, axis="x+", finger="f")
        assert running.heard == []
        # Ending it is always allowed.
        assert answered(stream, t="press", number=number, action="leave", press="p") is None
        assert [heard["action"] for heard in running.heard] == ["leave"]


def test_a_stop_is_answered_whatever_is_stale(product):
    browser = page(product)
    for changed in (
        {"X_Robolink_Token": None},
        {"X_Robolink_Token": "0" * 64},
        {"Sec_Fetch_Site": None},
        {"Cookie": None},
    ):
        press = str(random.random())
        said = {"cell": CELL, "press": press, "age_ms": 6000}  # old: it connects to nobody
        answer = browser.post("/stop", said, **changed)
        assert answer.status == 200
        assert (answer.json()["press"], answer.json()["outcome"]) == (press, "old")
    with browser.live() as stream:
        stream.send(t="stop", press="q", age_ms=6000)
        while (answer := stream.next())["t"] != "stopped":
            pass
        assert answer["outcome"] == "old"


def test_a_report_runs_no_script(product):
    browser = page(product)
    answer = browser.get(f"/cell/{CELL}/report/abcd")
    assert answer.headers["content-security-policy"] == REPORT_SECURITY
    assert "script-src" not in REPORT_SECURITY
    assert browser.get(f"/cell/{CELL}/report/a/b").headers["content-security-policy"] != (
        REPORT_SECURITY
    )


# ---- Fuzz of routes and frames.

VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), TEXTS, st.just(CELL)),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=6,
)
KEYS = "cell job values press age_ms at_ms name pin language dark t number action value axis finger"
BODIES = st.dictionaries(st.sampled_from(KEYS.split()), VALUES, max_size=6)
PATHS = st.one_of(
    st.sampled_from([*POSTS, "/", "/cell/line3", "/cell/%00", "/static/..%2fpanel.py", "/live"]),
    st.text(
        st.characters(min_codepoint=0x21, max_codepoint=0x7E, exclude_characters="?#"), max_size=30
    ).map(lambda text: "/" + text),
)


def test_whatever_is_asked_the_panel_answers_and_goes_on(product):
    browser = page(product)
    others = [path for path in POSTS if path not in ("/login", "/pair", "/logout")]

    @settings(max_examples=30, deadline=None)
    @given(BODIES, st.sampled_from(others))
    def posts(body, path):
        answer = browser.post(path, body)
        assert answer.status in (200, 400, 403, 404, 409, 413, 415), (path, body)

    @settings(max_examples=20, deadline=None)
    @given(PATHS, st.sampled_from(["GET", "POST", "HEAD"]), st.binary(max_size=60))
    def paths(path, method, body):
        asked = browser.request(method, path.encode("ascii", "ignore").decode(), body)
        assert asked.status < 500 or asked.status == 503, (path, method)

    posts()
    paths()
    assert browser.get("/").status == 200
    assert {job for _, job, _ in product.begun} <= set(KINDS)


def test_whatever_frame_comes_the_stream_answers_or_ends(product):
    browser = page(product)
    kinds = st.sampled_from(["press", "hold", "beat", "release", "pong", "x"])

    @settings(max_examples=10, deadline=None)
    @given(st.lists(st.tuples(kinds, BODIES), max_size=6))
    def frames(sent):
        with browser.live() as stream:
            for kind, body in sent:
                text = json.dumps({**body, "t": kind})
                if "NaN" not in text and "Infinity" not in text:
                    stream.socket.send(text)
            stream.send(t="stop", press="last", age_ms=6000)
            while stream.next()["t"] != "stopped":
                pass

    frames()
    assert product.begun == []
