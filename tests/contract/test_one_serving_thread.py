"""All simulated controllers of a process share one serving thread without affecting each other."""

import contextlib
import select
import socket
import threading
import time

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.remote.link import EpsonServerLink
from robolink_simulators.hosting.streams import serving_loop
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.hosting.streams.serving_loop import MOST_AT_ONCE, SelectedReadiness
from robolink_simulators.hosting.streams.tcp_host import TcpHost

from robolink.transport import parse_url


class Asking:
    """A raw client."""

    def __init__(self, url):
        link = parse_url(url)
        self.socket = socket.create_connection((link.host, link.port), timeout=20)

    def ask(self, request):
        self.socket.sendall(request + b"\r\n")
        return self.socket.recv(4096)


@pytest.fixture
def asking():
    """Connects raw clients that are closed at the end."""
    clients = []

    def connected(url):
        clients.append(Asking(url))
        return clients[-1]

    yield connected
    for client in clients:
        client.socket.close()


@pytest.fixture
def hosts():
    served = [serve_tcp(EpsonSimulator(seed=number)) for number in range(40)]
    yield served
    for host in served:
        host.close()


def test_forty_controllers_need_one_thread_and_each_answers_its_own_client(hosts, asking):
    assert sum(thread.name == "simulators" for thread in threading.enumerate()) == 1
    clients = [asking(host.url) for host in hosts]
    for client in clients:
        assert client.ask(b"$Login,") == b"#Login,0\r\n"
    for number, client in enumerate(clients):
        assert client.ask(b"$SetIO,%d,1" % number) == b"#SetIO,0\r\n"
    for number, host in enumerate(hosts):
        outputs = host._device.machine.outputs
        assert [at for at in range(40) if outputs.get(at)] == [number]


def test_a_hook_that_raises_ends_its_own_controller_and_no_other(hosts, asking, monkeypatch):
    told = []
    monkeypatch.setattr(threading, "excepthook", lambda args: told.append(args.exc_value))
    broken, sound = asking(hosts[0].url), asking(hosts[1].url)

    def fail(_number, _text):
        raise RuntimeError("of a test")

    hosts[0]._device.on_request = fail
    assert broken.ask(b"$Login,") in (b"#Login,0\r\n", b"")
    assert sound.ask(b"$Login,") == b"#Login,0\r\n"
    with pytest.raises(ConnectionRefusedError):
        asking(hosts[0].url)
    assert [str(error) for error in told] == ["of a test"]


def test_the_thread_goes_with_the_last_host_and_comes_again_with_the_next(asking):
    for _ in range(3):
        with serve_tcp(EpsonSimulator()) as one, serve_tcp(EpsonSimulator()) as other:
            one.close()
            assert asking(other.url).ask(b"$Login,") == b"#Login,0\r\n"
        assert all(thread.name != "simulators" for thread in threading.enumerate())


def test_a_host_may_be_closed_by_what_its_own_controller_does(asking):
    simulator, gone = EpsonSimulator(), threading.Event()
    host = serve_tcp(simulator)

    def close(_number, _text):
        host.close()
        gone.set()

    simulator.on_reply = close
    client = asking(host.url)
    client.ask(b"$Login,")
    assert gone.wait(20)
    host.close()
    with pytest.raises(ConnectionRefusedError):
        asking(host.url)


@pytest.fixture
def asked_at_once(asking):
    """Query controllers while another one blocks all of them; return what each saw when served."""

    def asked(hosts):
        holding, let_go, all_looked = (threading.Event() for _ in range(3))
        held, *others = [asking(host.url) for host in hosts]
        answered_before = []

        def hold(_number, _text):
            holding.set()
            let_go.wait(20)

        def look(_number, _text):
            sockets = [client.socket for client in others]
            answered_before.append(len(select.select(sockets, [], [], 0)[0]))
            if len(answered_before) == len(others):
                all_looked.set()

        for client in (held, *others):
            client.ask(b"$Login,")
        hosts[0]._device.on_request = hold
        for host in hosts[1:]:
            host._device.on_request = look
        held.socket.sendall(b"$GetStatus\r\n")
        assert holding.wait(20)
        for client in others:
            client.socket.sendall(b"$GetStatus\r\n")
        let_go.set()
        assert all_looked.wait(20)
        for client in (held, *others):
            assert client.socket.recv(4096).startswith(b"#GetStatus,")
        return answered_before

    return asked


def test_those_who_asked_at_once_are_all_heard_before_one_is_answered(hosts, asked_at_once):
    """A client that queries many is woken once for all of them, not once for each."""
    assert asked_at_once(hosts[:6]) == [0] * 5


def test_of_many_who_ask_at_once_a_few_are_answered_before_the_rest_is_heard(
    monkeypatch, asked_at_once
):
    """The same if the system reports all of them at once."""
    monkeypatch.setattr(serving_loop, "make_readiness", SelectedReadiness)
    with contextlib.ExitStack() as stack:
        hosts = [stack.enter_context(serve_tcp(EpsonSimulator())) for _ in range(40)]
        answered_before = asked_at_once(hosts)
    assert answered_before[:MOST_AT_ONCE] == [0] * MOST_AT_ONCE
    assert answered_before[-1] >= MOST_AT_ONCE


def test_one_that_cannot_answer_is_served_no_more_and_the_others_are(hosts, asking, monkeypatch):
    told = []
    monkeypatch.setattr(threading, "excepthook", lambda args: told.append(args.exc_value))
    broken, sound = asking(hosts[0].url), asking(hosts[1].url)
    broken.ask(b"$Login,")

    def fail():
        raise RuntimeError("of a test")

    monkeypatch.setattr(hosts[0], "flush", fail)
    assert broken.ask(b"$GetStatus") == b""
    assert sound.ask(b"$Login,") == b"#Login,0\r\n"
    assert [str(error) for error in told] == ["of a test"]


def test_one_whose_end_fails_too_is_closed_all_the_same(hosts, asking, monkeypatch):
    """A client that has failed usually fails again when its controller is told that it has left."""
    told = []
    monkeypatch.setattr(threading, "excepthook", lambda args: told.append(str(args.exc_value)))
    broken, sound = asking(hosts[0].url), asking(hosts[1].url)
    broken.ask(b"$Login,")

    def fail(_link, _data, _now_ns):
        raise RuntimeError("of a test")

    with monkeypatch.context() as failing:
        failing.setattr(EpsonServerLink, "receive", fail)
        assert broken.ask(b"$GetStatus") == b""
        hosts[0].close()  # returns when the thread has finished with it
    assert told == ["of a test"] * 2
    with pytest.raises(ConnectionRefusedError):
        asking(hosts[0].url)
    assert sound.ask(b"$Login,") == b"#Login,0\r\n"


@pytest.mark.skipif(not hasattr(select, "epoll"), reason="limits of open files are of Unix")
def test_who_calls_while_no_file_can_be_opened_waits_and_costs_nothing(monkeypatch):
    import resource

    looked, accept = [], TcpHost._accept

    def count(host, events, now_ns):
        looked.append(now_ns)
        accept(host, events, now_ns)

    monkeypatch.setattr(TcpHost, "_accept", count)
    with serve_tcp(EpsonSimulator()) as host, socket.socket() as client:
        link = parse_url(host.url)
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        client.settimeout(20)
        resource.setrlimit(resource.RLIMIT_NOFILE, (client.fileno() + 1, hard))
        try:
            client.connect((link.host, link.port))
            client.sendall(b"$Login,\r\n")
            time.sleep(0.2)
            tried = len(looked)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        assert client.recv(4096) == b"#Login,0\r\n"
    assert 0 < tried < 40
