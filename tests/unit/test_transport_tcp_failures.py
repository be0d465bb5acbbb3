"""The wording of TCP failures, on fake sockets."""

import errno
import os
import socket
from contextlib import closing
from typing import Any

import pytest

from robolink.errors import (
    ConnectError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.timing import Deadline
from robolink.transport import parse_url
from robolink.transport.tcp import TcpTransport, dial, open_tcp

URL = parse_url("epson+tcp://192.0.2.1:5000")
ADDRESSES = [
    (socket.AF_INET, socket.SOCK_STREAM, 6, "", ("192.0.2.1", 5000)),
    (socket.AF_INET, socket.SOCK_STREAM, 6, "", ("192.0.2.2", 5000)),
]


class FakeClock:
    """Advances a little at every reading, so that every wait ends."""

    def __init__(self):
        self.time_ns = 0

    def now_ns(self):
        self.time_ns += 10_000_000
        return self.time_ns

    def sleep(self, seconds):
        self.time_ns += int(seconds * 1e9)


class UnpluggedSocket:
    """A socket whose every use ends in the given error."""

    def __init__(self, error=None, descriptor=-1):
        self.error = error
        self.descriptor = descriptor
        self.options = []
        self.timeouts_s = []
        self.tried = []
        self.closed = False

    def setsockopt(self, level, name, value):
        self.options.append((level, name, value))

    def settimeout(self, timeout_s):
        self.timeouts_s.append(timeout_s)

    def setblocking(self, blocking):
        pass

    def fileno(self):
        return self.descriptor

    def shutdown(self, how):
        raise OSError(errno.ENOTCONN, "not connected")

    def close(self):
        self.closed = True

    def _fail(self, *arguments):
        if self.error is not None:
            raise self.error

    def connect(self, address):
        self.tried.append(address)
        self._fail()

    recv = send = _fail


@pytest.fixture
def sockets(monkeypatch):
    made: list[UnpluggedSocket] = []

    def install(*errors):
        made.extend(UnpluggedSocket(error) for error in errors)
        left = iter(made)
        monkeypatch.setattr(socket, "getaddrinfo", lambda *a, **k: ADDRESSES[: len(errors)])
        monkeypatch.setattr(socket, "socket", lambda *a: next(left))
        return made

    return install


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (ConnectionRefusedError(errno.ECONNREFUSED, "refused"), "refuses connections"),
        (TimeoutError("timed out"), "did not answer within 3 s"),
        (OSError(errno.ETIMEDOUT, "timed out"), "did not answer within 3 s"),
        (OSError(errno.EHOSTUNREACH, "no route"), "no route to"),
        (OSError(errno.ENETUNREACH, "no network"), "no route to"),
        (PermissionError(errno.EACCES, "forbidden here"), "forbidden here"),
    ],
)
def test_a_failed_connection_says_what_happened_and_what_to_do(sockets, error, sentence):
    (made,) = sockets(error)
    with pytest.raises(ConnectError, match=sentence) as caught:
        open_tcp(URL, clock=FakeClock())
    assert caught.value.remedy
    assert caught.value.controller == "epson+tcp://192.0.2.1:5000"
    assert caught.value.__cause__ is error
    assert made.closed


@pytest.mark.parametrize(
    ("scheme", "server"),
    [
        ("epson+tcp", "remote control"),
        ("softmotion+modbus-tcp", "the Modbus server"),
        ("plc+opcua", "the OPC UA server"),
    ],
)
def test_a_port_without_a_server_is_told_with_the_server_that_belongs_there(
    sockets, scheme, server
):
    sockets(ConnectionRefusedError(errno.ECONNREFUSED, "refused"))
    url = parse_url(f"{scheme}://192.0.2.1:5000")
    with pytest.raises(ConnectError) as caught:
        dial(url, timeout_s=3, deadline=Deadline.after(FakeClock(), 3))
    assert f"that {server} is switched on" in caught.value.remedy


def test_an_unknown_host_name_is_named(monkeypatch):
    def look_up(*arguments, **options):
        raise socket.gaierror(socket.EAI_NONAME, "unknown")

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    with pytest.raises(ConnectError, match="'robot-7' is not known"):
        open_tcp(parse_url("epson+tcp://robot-7:5000"), clock=FakeClock())


def test_every_address_of_a_host_is_tried_within_one_deadline(sockets):
    first, second = sockets(ConnectionRefusedError(errno.ECONNREFUSED, "refused"), None)
    clock = FakeClock()
    dial(URL, timeout_s=3.0, deadline=Deadline.after(clock, 3.0))
    assert first.closed
    assert not second.closed
    assert second.timeouts_s < first.timeouts_s


def test_no_further_address_is_tried_when_the_deadline_has_passed(sockets):
    first, second = sockets(TimeoutError(), None)
    with pytest.raises(ConnectError):
        dial(URL, timeout_s=0.015, deadline=Deadline.after(FakeClock(), 0.015))
    assert (len(first.tried), len(second.tried)) == (1, 0)


@pytest.mark.fault("F75")
@pytest.mark.fault("F11")
def test_a_dead_peer_is_noticed_within_three_seconds(sockets):
    (made,) = sockets(None)
    dial(URL, timeout_s=3.0, deadline=Deadline.after(FakeClock(), 3.0))
    wanted = {"SO_KEEPALIVE": 1, "TCP_NODELAY": 1, "TCP_KEEPIDLE": 1, "TCP_KEEPINTVL": 1}
    wanted |= {"TCP_KEEPCNT": 2, "TCP_USER_TIMEOUT": 2500}
    values = {name: value for _, name, value in made.options}
    here = {name: value for name, value in wanted.items() if hasattr(socket, name)}
    assert values == {getattr(socket, name): value for name, value in here.items()}


def test_missing_platform_constants_are_not_missed(sockets, monkeypatch):
    for name in ("TCP_USER_TIMEOUT", "TCP_KEEPIDLE", "TCP_KEEPINTVL", "TCP_KEEPCNT"):
        monkeypatch.delattr(socket, name, raising=False)
    (made,) = sockets(None)
    dial(URL, timeout_s=3.0, deadline=Deadline.after(FakeClock(), 3.0))
    assert {name for _, name, _ in made.options} == {socket.SO_KEEPALIVE, socket.TCP_NODELAY}


@pytest.fixture
def broken_link():
    descriptor = os.open(os.devnull, os.O_RDWR)  # always ready

    def make(error):
        connection: Any = UnpluggedSocket(error, descriptor)
        return TcpTransport(connection, URL, FakeClock())

    yield make
    os.close(descriptor)


RESET = ConnectionResetError(errno.ECONNRESET, "reset by peer")
DEAD = TimeoutError(errno.ETIMEDOUT, "timed out")  # what TCP_USER_TIMEOUT ends with


@pytest.mark.parametrize("error", [RESET, DEAD])
@pytest.mark.parametrize("use", ["send", "receive", "receive_waiting"])
def test_a_link_that_breaks_is_broken_and_not_timed_out(broken_link, error, use):
    link = broken_link(error)
    deadline = Deadline.after(link.clock, 1.0)
    calls = {
        "send": lambda: link.send(b"x", deadline=deadline),
        "receive": lambda: link.receive(deadline=deadline),
        "receive_waiting": link.receive_waiting,
    }
    with pytest.raises(TransportBrokenError, match=error.strerror) as caught:
        calls[use]()
    assert caught.value.__cause__ is error


def test_an_error_after_our_own_close_is_only_the_close(broken_link):
    link = broken_link(OSError(errno.EBADF, "bad descriptor"))
    link.close()
    with pytest.raises(TransportClosedError):
        link.receive(deadline=Deadline.after(link.clock, 1.0))


def test_a_far_end_that_takes_nothing_times_the_send_out(broken_link):
    link = broken_link(BlockingIOError())
    with pytest.raises(TransportTimeoutError):
        link.send(b"x", deadline=Deadline.after(link.clock, 0.1))


@pytest.mark.parametrize("missing", ["MSG_DONTWAIT", "poll"])
def test_a_link_works_where_the_platform_lacks_something(monkeypatch, missing):
    if missing == "poll":
        monkeypatch.delattr("select.poll")
    else:
        monkeypatch.delattr(socket, missing)
    ours, theirs = socket.socketpair()
    with closing(TcpTransport(ours, URL, FakeClock())) as link, theirs:
        link.send(b"$GetStatus\r\n", deadline=Deadline.after(link.clock, 5.0))
        assert theirs.recv(64) == b"$GetStatus\r\n"
        assert link.receive_waiting() is None
        with pytest.raises(TransportTimeoutError):
            link.receive(deadline=Deadline.after(link.clock, 0.0))
        theirs.sendall(b"#GetStatus")
        assert link.wait_readable(deadline=Deadline.after(link.clock, 5.0))
        assert link.receive(deadline=Deadline.after(link.clock, 5.0)) == b"#GetStatus"
