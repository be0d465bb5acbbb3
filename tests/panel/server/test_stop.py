"""STOP: each press once, from whatever state the panel is in, and never for a later job."""

import asyncio
import os
import pty
import signal
import socketserver
import subprocess
import sys
import threading
import time
import tty
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from types import SimpleNamespace

import pytest
from robolink_cli.panel.stop import (
    StopAnswer,
    StopAsked,
    StopDesk,
    StopEnd,
    StopProcess,
    stop_cell,
)
from robolink_cli.stopping.request import StopRequest
from robolink_cli.stopping.stop_first import stop_first
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.controllers import stop_now
from robolink.controllers.epson.line import EpsonConversation, open_line
from robolink.errors import ConnectError, LoginUnansweredError, RejectedError
from robolink.stopping import StopListener, find_note
from robolink.transport import far_end_of
from tests.cli.test_stop_command import HEAVY, OF_ASYNCUA


class Carrier:
    """Carries stops out, as fast as it is let."""

    def __init__(self):
        self.asked = []
        self.may_end = asyncio.Event()
        self.may_end.set()

    async def __call__(self, asked):
        self.asked.append(asked.cell)
        await self.may_end.wait()
        return StopAnswer(StopEnd.STOPPED, f"{asked.cell} rests", (asked.cell,))


class Time:
    """A clock that is set by hand."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


SECOND_TRY_S = 1.5
"""When a second try that succeeds has ended for sure, in s: the first ends after 0.5 s, and the
third would begin after 1.5."""

LINE3 = (StopAsked("line3", "mei", "en"),)
BOTH = (*LINE3, StopAsked("line4", "mei", "en"))


async def turns():
    """Let all that can go on go on."""
    for _ in range(50):
        await asyncio.sleep(0)


def run(work):
    return asyncio.run(work)


def test_a_press_that_comes_by_both_ways_is_carried_out_once_and_answered_twice():
    async def work():
        carrier = Carrier()
        carrier.may_end.clear()
        desk = StopDesk(carrier)
        both = [asyncio.ensure_future(desk.press("p", 3, LINE3)) for _ in range(2)]
        await turns()
        carrier.may_end.set()
        answers = await asyncio.gather(*both)
        assert answers[0] == answers[1]
        assert answers[0].outcome is StopEnd.STOPPED
        return carrier.asked

    assert run(work()) == ["line3"]


def test_a_press_that_was_carried_out_never_stops_a_later_job():
    async def work():
        now, carrier = Time(), Carrier()
        desk = StopDesk(carrier, now)
        first = await desk.press("p", 3, LINE3)
        for later_s in (0.5, 4.0, 3600.0):
            now.now_s += later_s
            assert await desk.press("p", 3, LINE3) == first
        assert carrier.asked == ["line3"]
        await desk.press("q", 3, LINE3)  # another press does
        return carrier.asked

    assert run(work()) == ["line3", "line3"]


@pytest.mark.parametrize(
    ("age_ms", "at_ms", "late_s", "carried_out"),
    [
        (5000, None, 0, True),
        (5001, None, 0, False),
        (0, 0, 5.1, False),  # the tablet sent it in time, and the network kept it
        (0, 0, 4.9, True),
        # What cannot be understood counts as fresh.
        ("old", None, 0, True),
        (None, "x", 0, True),
        (True, None, 0, True),
        (float("nan"), None, 0, True),
        (-10_000_000, None, 0, True),
        (1e300, 1e300, 0, True),
        (0, 10**9, 0, True),  # a tablet of the server before
    ],
)
def test_a_press_older_than_five_seconds_stops_nothing_and_a_doubtful_one_stops(
    age_ms, at_ms, late_s, carried_out
):
    async def work():
        now, carrier = Time(), Carrier()
        desk = StopDesk(carrier, now)
        now.now_s += late_s
        answer = await desk.press("p", desk.age_ms(age_ms, at_ms), LINE3)
        assert (answer.outcome is StopEnd.STOPPED) == carried_out
        return carrier.asked

    assert run(work()) == ["line3"] * carried_out


def test_presses_in_a_flood_are_all_answered_and_stop_once():
    async def work():
        carrier = Carrier()
        carrier.may_end.clear()
        desk = StopDesk(carrier)
        flood = [asyncio.ensure_future(desk.press(f"p{n}", 0, LINE3)) for n in range(500)]
        await turns()
        carrier.may_end.set()
        answers = await asyncio.gather(*flood)
        assert {answer.outcome for answer in answers} == {StopEnd.STOPPED}
        return carrier.asked

    assert run(work()) == ["line3"]


def test_a_stop_that_hangs_holds_no_later_press_up():
    async def work():
        now, carrier = Time(), Carrier()
        carrier.may_end.clear()
        desk = StopDesk(carrier, now)
        hangs = asyncio.ensure_future(desk.press("p", 0, LINE3))
        await turns()
        now.now_s += 1.5
        again = asyncio.ensure_future(desk.press("q", 0, LINE3))
        await turns()
        assert carrier.asked == ["line3", "line3"]
        carrier.may_end.set()
        await asyncio.gather(hangs, again)

    run(work())


def test_a_tablet_that_goes_away_takes_nothing_back():
    async def work():
        carrier = Carrier()
        carrier.may_end.clear()
        desk = StopDesk(carrier)
        gone = asyncio.ensure_future(desk.press("p", 0, LINE3))
        await turns()
        gone.cancel()
        carrier.may_end.set()
        return await desk.press("p", 0, LINE3), carrier.asked

    answer, asked = run(work())
    assert answer.outcome is StopEnd.STOPPED
    assert asked == ["line3"]


def test_stop_all_tells_the_worst_end_and_each_cell():
    async def work():
        async def carry_out(asked):
            end = StopEnd.FAILED if asked.cell == "line4" else StopEnd.STOPPED
            return StopAnswer(end, asked.cell, (asked.cell,))

        desk = StopDesk(carry_out)
        assert (await desk.press("p", 0, (), everywhere=True)).outcome is StopEnd.NOTHING
        return await desk.press("q", 0, BOTH, everywhere=True)

    answer = run(work())
    assert answer.outcome is StopEnd.FAILED
    assert answer.text == "line3\nline4"
    assert answer.cells == ("line3", "line4")


def test_one_cells_press_is_no_press_of_another_cell():
    async def work():
        carrier = Carrier()
        desk = StopDesk(carrier)
        await desk.press("p", 0, LINE3)
        await desk.press("p", 0, BOTH[1:])
        return carrier.asked

    assert run(work()) == ["line3", "line4"]


# The process that carries them out, on a simulated controller.


@pytest.fixture(scope="module")
def state_folder(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("state")
        patch.setenv("ROBOLINK_STATE_DIR", str(folder))
        yield folder


SPEED = 20


@pytest.fixture
def robot(state_folder):
    simulator = EpsonSimulator("T6-602S", seed=3)
    with serve_tcp(simulator, clock=ScaledClock(SPEED)) as host:
        yield simulator, host.url


def stopped(carry_out, url, language="en"):
    async def work():
        return await asyncio.wait_for(carry_out(StopAsked(url, "mei", language)), 20)

    return asyncio.run(work())


@pytest.fixture(scope="module")
def own(state_folder):
    with StopProcess() as carry_out:
        assert carry_out.ready.wait(30)
        yield carry_out


def test_it_stops_a_controller_that_nobody_has_and_leaves_a_note(robot, own):
    _, url = robot
    answer = stopped(own, url)
    assert answer.outcome is StopEnd.STOPPED, answer
    assert "has stopped (confirmed)" in answer.text
    note = find_note(far_end_of(url))
    assert note is not None
    assert note.who.startswith("mei")


def test_it_answers_in_the_language_of_the_tablet(robot, own):
    assert "机器人" in stopped(own, robot[1], "zh").text


def test_who_has_the_controller_is_asked_and_the_latch_closes(robot, own):
    _, url = robot
    with robolink.connect(url) as controller, StopListener(controller, url, who="a job"):
        began_s = time.monotonic()
        answer = stopped(own, url)
        took_s = time.monotonic() - began_s
        assert answer.outcome is StopEnd.STOPPED, answer
        assert controller.latch.closed
    assert took_s < 5.0


def test_what_is_not_reached_is_not_called_stopped(own):
    answer = stopped(own, "epson+tcp://127.0.0.1:1")
    assert answer.outcome is StopEnd.FAILED
    assert "emergency stop" in answer.text


def test_a_stop_goes_out_though_the_process_hangs_or_is_killed(robot, own):
    _, url = robot
    os.kill(own.pid, signal.SIGSTOP)
    try:
        began_s = time.monotonic()
        assert stopped(own, url).outcome is StopEnd.STOPPED
        assert time.monotonic() - began_s < 5.0
    finally:
        os.kill(own.pid, signal.SIGCONT)
    before = own.pid
    os.kill(before, signal.SIGKILL)
    assert stopped(own, url).outcome is StopEnd.STOPPED
    until_s = time.monotonic() + 30
    while (own.pid in (None, before) or not own.ready.is_set()) and time.monotonic() < until_s:
        time.sleep(0.02)
    assert own.pid not in (None, before), "it was not started anew"
    assert stopped(own, url).outcome is StopEnd.STOPPED


def test_a_stop_does_not_wait_for_the_threads_of_the_loop(robot, own):
    _, url = robot

    async def work():
        held = threading.Event()
        loop = asyncio.get_running_loop()
        loop.set_default_executor(ThreadPoolExecutor(1))
        waits = loop.run_in_executor(None, held.wait, 30)
        try:
            answer = await asyncio.wait_for(own(StopAsked(url, "mei", "en")), 10)
        finally:
            held.set()
            await waits
        return answer

    assert asyncio.run(work()).outcome is StopEnd.STOPPED


# An EPSON controller serves one client, and a look of the panel is one.


@contextmanager
def logged_in(url):
    """A look that has logged in, and to which nobody can turn: it begins, or it is leaving."""
    talk = EpsonConversation(open_line(url, timeout_s=3), timeout_s=3)
    talk.login("")
    try:
        yield
    finally:
        talk.close()


def stop_beside(looks, url, *, stay_s=0.15):
    """Stop beside each look in turn, for a time each, the first of which is under way."""
    stops, answers = threading.Event(), []

    def stop():
        stops.set()
        answers.append((stop_cell(StopAsked(url, "mei", "en")), time.monotonic()))

    thread = threading.Thread(target=stop)
    for look in looks:
        with look:
            if not stops.is_set():
                began_s = time.monotonic()
                thread.start()
                stops.wait()
            time.sleep(stay_s)
    thread.join()
    ((answer, ended_s),) = answers
    assert answer.outcome is StopEnd.STOPPED, answer.text
    return ended_s - began_s


@pytest.mark.parametrize("second", ["ignored", "closed"])
def test_a_look_that_has_the_only_login_delays_a_stop_by_no_third_try(state_folder, second):
    simulator = EpsonSimulator(seed=3, options=EpsonOptions(second_client=second))
    with serve_tcp(simulator, clock=ScaledClock(SPEED)) as host:
        assert stop_beside([logged_in(host.url)], host.url) < SECOND_TRY_S


@pytest.mark.parametrize("second", ["ignored", "closed"])
def test_a_look_that_stays_for_more_than_a_second_does_not_defeat_a_stop(state_folder, second):
    simulator = EpsonSimulator(seed=3, options=EpsonOptions(second_client=second))
    with serve_tcp(simulator, clock=ScaledClock(SPEED)) as host:
        assert stop_beside([logged_in(host.url)], host.url, stay_s=1.2) < 2.5


@contextmanager
def silent_rtu():
    ends = pty.openpty()
    tty.setraw(ends[1])
    yield f"softmotion+modbus-rtu://{os.ttyname(ends[1])}?parity=none"
    for end in ends:
        os.close(end)


SILENT_CAN = nullcontext("softmotion+can://239.74.163.77:43777?interface=udp_multicast&node=5")


@pytest.mark.parametrize("line", [silent_rtu, lambda: SILENT_CAN])
def test_a_line_on_which_nobody_answers_is_tried_once(state_folder, line):
    once = []
    with line() as url, pytest.raises(ConnectError):
        stop_now(url, timeout_s=0.5, trace=lambda *passage: once.append(passage))
    with line() as url:
        outcome = stop_first(StopRequest(named=url, timeout_s=0.5, record="kept"))
    assert isinstance(outcome.error, ConnectError)
    assert [way for _, way, _ in outcome.heard] == [way for _, way, _ in once] != []


def test_for_all_attempts_the_keyring_is_asked_once(state_folder, monkeypatch):
    asked = []
    keyring = SimpleNamespace(get_password=lambda _service, user: asked.append(user))
    monkeypatch.setitem(sys.modules, "keyring", keyring)
    monkeypatch.setitem(sys.modules, "keyring.errors", SimpleNamespace(KeyringError=OSError))
    simulator = EpsonSimulator(seed=3)
    with serve_tcp(simulator, clock=ScaledClock(SPEED)) as host, logged_in(host.url):
        outcome = stop_first(StopRequest(named=host.url, timeout_s=0.2))
    assert isinstance(outcome.error, LoginUnansweredError)
    assert len(asked) == 1


def test_a_password_that_was_refused_is_not_tried_again(state_folder, monkeypatch):
    """The second is not answered, as where another client has the place meanwhile."""
    keyring = SimpleNamespace(get_password=lambda _service, _user: "canary-right")
    monkeypatch.setitem(sys.modules, "keyring", keyring)
    monkeypatch.setitem(sys.modules, "keyring.errors", SimpleNamespace(KeyringError=OSError))
    monkeypatch.setenv("ROBOLINK_PASSWORD", "canary-wrong")
    logins = []

    class Refusing(socketserver.StreamRequestHandler):
        def handle(self):
            for line in self.rfile:
                logins.append(line)
                if b"wrong" in line:
                    self.wfile.write(b"!Login,13\r\n")

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Refusing) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        url = f"epson+tcp://127.0.0.1:{server.server_address[1]}"
        outcome = stop_first(StopRequest(named=url, timeout_s=0.2))
        server.shutdown()
    assert isinstance(outcome.error, LoginUnansweredError)
    assert [b"wrong" in line for line in logins] == [True, False, False, False]


def test_who_has_the_controller_and_cannot_stop_it_is_not_asked_for_ever(robot):
    """It comes to listen after the first attempt, which finds the place taken."""
    _, url = robot
    asked, outcomes = [], []

    class Helpless:
        def stop(self):
            asked.append(time.monotonic())
            raise RejectedError("no", remedy="", code=1)

        def status(self):
            raise AssertionError

    def stop():
        outcomes.append(stop_first(StopRequest(named=url, timeout_s=0.2)))

    with logged_in(url):
        thread = threading.Thread(target=stop)
        thread.start()
        time.sleep(0.25)
        with StopListener(Helpless(), url, who="a job"):
            thread.join()
    assert isinstance(outcomes[0].error, RejectedError)
    assert len(asked) == 2  # behind the first attempt, and behind the last


def test_a_look_that_has_opened_the_line_delays_a_stop_by_no_third_try(state_folder):
    with served(SoftMotionSimulator(seed=1), "modbus-rtu") as url:
        assert stop_beside([robolink.connect(url)], url) < SECOND_TRY_S


def test_a_stop_finds_a_look_that_has_begun_to_listen_meanwhile(robot):
    _, url = robot

    @contextmanager
    def begins():
        with robolink.connect(url) as controller:
            yield
            with StopListener(controller, url, who="a look"):
                while not controller.latch.closed:
                    time.sleep(0.002)

    assert stop_beside([begins()], url) < SECOND_TRY_S


LOADED = """
import sys
from robolink_cli.panel.stop import load_opcua
load_opcua()
before = set(sys.modules)
from robolink.controllers import stop_now
stop_now(sys.argv[1])
ours = ("asyncua", "cryptography", "robolink.transport.opcua")
print(*sorted(name for name in set(sys.modules) - before if name.startswith(ours)))
print(*sorted(set(sys.argv[2:]) & set(sys.modules)), sep=",")
"""


def test_what_a_stop_over_opc_ua_takes_was_loaded_before_it_and_is_nothing_heavy_but_asyncua():
    from robolink_simulators.hosting.fieldbus.opcua import serve_opcua

    with serve_opcua(SoftMotionSimulator(seed=1)) as host:
        done = subprocess.run(
            [sys.executable, "-c", LOADED, host.url, *HEAVY.split()],
            check=True,
            capture_output=True,
            text=True,
            timeout=30,
        )
    assert done.stdout == "\n" + ",".join(sorted(OF_ASYNCUA)) + "\n"
