"""A process that has locked a controller stops it for its own user, and for nobody else."""

import json
import os
import socket
import stat
import threading

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.errors import OutcomeUnknownError, RejectedError, StoppedError
from robolink.model import ControllerStatus, MotionProfile, WorkBox
from robolink.stopping import HolderGoneError, StopListener, holders_of
from robolink.timing import NS_PER_S
from robolink.transport import far_end_of


@pytest.fixture(params=["path", "loopback"])
def controller(request, monkeypatch, tmp_path):
    """An open controller; ``loopback`` is for paths and systems without local sockets."""
    if request.param == "loopback":
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / ("long" * 30)))
    with serve_tcp(EpsonSimulator(seed=3)) as host, robolink.connect(host.url) as controller:
        yield controller


def url_of(controller):
    return controller.identity


def holder_of(controller):
    (holder,) = holders_of(far_end_of(url_of(controller)))
    return holder


def test_who_asks_is_named_and_the_latch_is_closed(controller):
    heard: list[str] = []
    with StopListener(controller, url_of(controller), who="line 3", heard=heard.append):
        holder = holder_of(controller)
        assert holder.who == "line 3"
        assert holder.ask_to_stop("anna") == "ready"
        controller.latch.release()
        assert holder.ask_to_stop("bert") == "ready"  # it goes on listening
    assert heard == ["anna", "bert"]
    group = controller.groups[0]
    with pytest.raises(StoppedError):
        group.move_to(group.pose(), MotionProfile(), box=WorkBox())
    assert list(holders_of(far_end_of(url_of(controller)))) == []
    with pytest.raises(HolderGoneError):
        holder.ask_to_stop("anna")


def test_only_the_user_himself_may_read_where_to_knock(controller):
    with StopListener(controller, url_of(controller)):
        holder = holder_of(controller)
        assert stat.S_IMODE(holder.card.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(holder.card.stat().st_mode) == 0o600
        if isinstance(holder.place, str):
            assert stat.S_IMODE(os.stat(holder.place).st_mode) == 0o600


@pytest.mark.parametrize(
    "said",
    [
        b'{"token": "wrong"}\n',
        b"{}\n",
        b"\xff\n",
        b"[1]\n",
        b"",
        '{"token": "sch\u00f6n"}\n'.encode(),
        b'{"token": "\\ud800"}\n',
        b"[" * 4000 + b"\n",
        b"1" * 4090 + b"\n",
    ],
    ids=["wrong", "none", "bytes", "list", "nothing", "umlaut", "surrogate", "deep", "digits"],
)
@pytest.mark.fault("F74")
def test_without_the_token_nothing_is_stopped(controller, said):
    with StopListener(controller, url_of(controller)):
        holder = holder_of(controller)
        with holder._knock() as line:
            line.sendall(said)
            line.shutdown(socket.SHUT_WR)
            assert line.recv(10) == b""
        controller.latch.require_open("the check")
        assert holder.ask_to_stop("anna") == "ready"  # and the next one is served


def test_another_address_is_not_this_controller(controller):
    with StopListener(controller, url_of(controller)):
        assert list(holders_of(far_end_of("epson+tcp://127.0.0.1:1"))) == []
        assert list(holders_of(far_end_of(url_of(controller).replace("127.0.0.1", "localhost"))))


class Refusing:
    """A controller that refuses to stop."""

    def __init__(self, error):
        self._error = error

    def stop(self):
        raise self._error

    def status(self):
        raise AssertionError


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (RejectedError("no", remedy="do it there", code=20), RejectedError),
        (OutcomeUnknownError("no", remedy="do it there"), OutcomeUnknownError),
        (ZeroDivisionError("no"), OutcomeUnknownError),
    ],
)
def test_a_stop_that_fails_is_told_as_it_is(error, told):
    with StopListener(Refusing(error), "epson+tcp://127.0.0.1:5000"):
        (holder,) = holders_of(far_end_of("epson+tcp://127.0.0.1:5000"))
        with pytest.raises(told, match="no"):
            holder.ask_to_stop("anna")


def test_a_console_that_is_held_up_does_not_hold_up_the_stop(controller):
    told, go_on = threading.Event(), threading.Event()

    def heard(_who):
        told.set()
        go_on.wait(10)

    with StopListener(controller, url_of(controller), heard=heard):
        assert holder_of(controller).ask_to_stop("anna") == "ready"
        with pytest.raises(StoppedError):
            controller.latch.require_open("the check")
        assert told.wait(10)
        go_on.set()


@pytest.mark.parametrize("error", [OSError("gone"), BrokenPipeError(), RuntimeError("no console")])
def test_a_console_that_fails_ends_neither_the_stop_nor_the_listening(controller, error):
    def heard(_who):
        raise error

    with StopListener(controller, url_of(controller), heard=heard):
        holder = holder_of(controller)
        assert holder.ask_to_stop("anna") == "ready"
        assert holder.ask_to_stop("bert") == "ready"


def test_a_process_with_many_files_open_listens_too(controller):
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = 1100 if hard == resource.RLIM_INFINITY else min(hard, 1100)
    if most < 1100:
        pytest.skip("this user may not open so many")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, most), hard))
    held = [os.dup(0) for _ in range(1024)]
    try:
        with StopListener(controller, url_of(controller)):
            assert holder_of(controller).ask_to_stop("anna") == "ready"
    finally:
        for one in held:
            os.close(one)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_whoever_leaves_the_controller_waits_for_the_stop_under_way(controller, monkeypatch):
    begun, go_on, ends = threading.Event(), threading.Event(), []
    stop = controller.stop

    def held_up():
        begun.set()
        go_on.wait(10)
        stop()

    monkeypatch.setattr(controller, "stop", held_up)
    listener = StopListener(controller, url_of(controller))
    holder = holder_of(controller)
    asking = threading.Thread(target=lambda: ends.append(holder.ask_to_stop("anna")))
    asking.start()
    assert begun.wait(10)
    leaving = threading.Thread(target=listener.close)
    leaving.start()
    go_on.set()
    leaving.join(10)
    asking.join(10)
    assert ends == ["ready"]


def test_what_a_dead_process_left_is_taken_away(tmp_path):
    url = "epson+tcp://127.0.0.1:5000"
    with StopListener(Refusing(OSError()), url):
        (holder,) = holders_of(far_end_of(url))
        card = json.loads(holder.card.read_text())
        gone = holder.card.with_name("1-dead.json")
        gone.write_text(json.dumps(card | {"pid": 2**22 + 1}))
        assert [found.card for found in holders_of(far_end_of(url))] == [holder.card]
        assert not gone.exists()
        gone.write_text("{")
        assert len(list(holders_of(far_end_of(url)))) == 1


def test_who_looks_on_sees_what_was_read_last_and_its_age_and_nothing_is_read_for_it(controller):
    aged = controller.clock.now_ns() - 3 * NS_PER_S
    with StopListener(controller, url_of(controller), seen=lambda: None):
        assert holder_of(controller).last_seen() is None
    now = controller.status()
    seen = [(now, controller.clock.now_ns() - aged)]
    with StopListener(controller, url_of(controller), seen=lambda: seen[0]):
        before, holder = controller.exchanges, holder_of(controller)
        found = [holder.last_seen() for _ in range(50)]
        assert {one and one.status for one in found} == {now}
        assert all(one and one.age_s >= 3.0 for one in found)
        assert controller.exchanges == before
    with StopListener(controller, url_of(controller)), pytest.raises(HolderGoneError):
        holder_of(controller).last_seen()


def test_a_look_is_answered_while_a_stop_is_under_way_and_by_a_thread_that_holds_no_lock():
    began, let_go = threading.Event(), threading.Event()

    class Slow:
        def stop(self):
            began.set()
            assert let_go.wait(30)

        def status(self):
            return ControllerStatus(remote=True, ready=True)

    url = "epson+tcp://127.0.0.1:5000"
    with StopListener(Slow(), url, seen=lambda: (ControllerStatus(paused=True), 0)):
        (holder,) = holders_of(far_end_of(url))
        ended: list[str] = []
        stopping = threading.Thread(target=lambda: ended.append(holder.ask_to_stop("anna")))
        stopping.start()
        assert began.wait(30)
        found = holder.last_seen()
        assert found is not None
        assert found.status.paused
        let_go.set()
        stopping.join(30)
    assert ended == ["ready"]
