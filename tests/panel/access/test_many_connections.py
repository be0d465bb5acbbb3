"""Connections: slow ones, silent ones, ten thousand of them, and readers that do not read."""

import json
import socket
import time
from contextlib import ExitStack, suppress

import pytest
from robolink_cli.panel.guard import connections, gate
from robolink_cli.panel.guard.connections import (
    MOST,
    OF_A_TABLET,
    STRANGERS,
    TURN_S,
    Connections,
    network_of,
)

from tests.panel.access._bare import CELL


def silent(panel, source="127.0.0.2"):
    """Open a connection that says nothing."""
    return socket.create_connection(("127.0.0.1", panel.port), 5, (source, 0))


def is_closed(line, wait_s=5.0):
    line.settimeout(wait_s)
    try:
        while line.recv(4096):
            pass
    except TimeoutError:
        return False
    except OSError:
        return True
    return True


@pytest.fixture
def now(monkeypatch):
    """The time of connections, set by hand."""
    time_s = [100.0]
    monkeypatch.setattr(connections, "monotonic", lambda: time_s[0])
    return time_s


def test_whoever_opens_most_makes_room(now):
    known, closed = Connections(), []

    def come(address, number):
        now[0] += 0.001
        return known.came((address, number), lambda: closed.append((address, number)))

    for number in range(STRANGERS):
        assert come("10.0.0.66", number)
    for number in range(2):  # tablets that come meanwhile
        assert come(f"10.0.0.{number}", 1)
    assert closed == [("10.0.0.66", 0), ("10.0.0.66", 1)]  # the oldest first
    taken = [number for number in range(100, 10_100) if come("10.0.0.66", number)]
    assert {address for address, _ in closed} == {"10.0.0.66"}
    # Each has a turn, and no more places are given away in that time.
    assert len(taken) == pytest.approx(10.0 / TURN_S * (STRANGERS - 2), rel=0.1)
    assert len(known) == known.strangers == STRANGERS
    assert known.refused == 10_000 + STRANGERS + 2 - STRANGERS


def test_a_known_connection_is_never_closed_for_a_stranger():
    known, closed = Connections(), []
    for number in range(MOST):
        known.came(("10.0.0.5", number), lambda: closed.append("a tablet"))
        taken = known.let_in(("10.0.0.5", number), f"tablet{number}")
        assert taken == (number < MOST - STRANGERS)
    assert closed == []
    for number in range(1000):
        known.came(("10.0.0.66", number), lambda: None)
    # Those that found no place are strangers still, and may go.
    assert len(closed) <= STRANGERS
    assert sum(1 for one in known._open.values() if one.tablet is not None) == MOST - STRANGERS
    assert len(known) <= MOST


def test_one_tablet_does_not_take_all_places():
    known = Connections()
    for number in range(OF_A_TABLET):
        known.came(("10.0.0.5", number), lambda: None)
        assert known.let_in(("10.0.0.5", number), "a")
    known.came(("10.0.0.5", 999), lambda: None)
    assert not known.let_in(("10.0.0.5", 999), "a")
    assert known.let_in(("10.0.0.5", 999), "b")


def test_a_far_end_that_is_another_by_now_is_left_alone():
    known, closed = Connections(), []
    old = known.came(("10.0.0.5", 1), lambda: closed.append("old"))
    known.cut(("10.0.0.5", 1))
    new = known.came(("10.0.0.5", 1), lambda: closed.append("new"))
    assert old
    assert new
    known.expire(old)
    known.went(old)
    assert closed == ["old"]
    assert len(known) == 1
    known.went(new)
    assert len(known) == 0


def test_whose_an_address_is():
    assert network_of("2001:db8::1") == network_of("2001:db8::2")
    assert network_of("::1") == "::1"
    assert network_of("fe80::1%eth0") == network_of("fe80::2%eth1")
    assert network_of("testclient") == "testclient"


@pytest.mark.parametrize("count", [2500, pytest.param(10_000, marks=pytest.mark.soak)])
def test_thousands_of_connections_keep_no_stop_waiting(panel, count):
    tablet = panel.browser().load()
    worst_s = 0.0
    with ExitStack() as stack, tablet.live() as stream:
        for number in range(count):
            stack.enter_context(silent(panel))
            if number % 250 == 249:
                begun_s = time.monotonic()
                assert stream.ask(t="stop", press=str(number))["t"] == "carried out"
                assert tablet.post("/stop", {"cell": CELL, "press": str(number)}).status == 200
                worst_s = max(worst_s, time.monotonic() - begun_s)
                stack.pop_all().close()
        held = [stack.enter_context(silent(panel)) for _ in range(200)]
        assert tablet.get("/").status == 200
        assert panel.access.connections.strangers <= STRANGERS
        assert len(panel.access.connections) <= MOST
        assert sum(is_closed(line, 0.1) for line in held) >= 200 - STRANGERS
        assert stream.ask(t="stop", press="last")["t"] == "carried out"
    assert panel.access.connections.refused >= 0.9 * count
    assert worst_s < 2.0


def test_connections_that_never_finish_their_request_are_closed(panel, monkeypatch):
    monkeypatch.setattr(connections, "STRANGER_S", 0.3)
    with ExitStack() as stack:
        lines = [stack.enter_context(silent(panel)) for _ in range(5)]
        lines[0].sendall(b"GET / HT")
        lines[1].sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
        lines[2].sendall(b"\x16\x03\x01\x02\x00\x01\x00")  # a hello of TLS
        lines[3].sendall(b"\r\n" * 100)
        assert all(is_closed(line, 3.0) for line in lines)
    tablet = panel.browser().load()
    with tablet.live() as stream:  # who is known may be silent for longer
        time.sleep(0.5)
        assert stream.ask(t="stop", press="1")["t"] == "carried out"


def test_a_body_that_comes_slowly_is_not_waited_for(panel, monkeypatch):
    monkeypatch.setattr(gate, "BODY_S", 0.2)
    tablet = panel.browser().load()
    lines = "\r\n".join(f"{key}: {value}" for key, value in tablet.headers().items())
    head = f"POST /stop HTTP/1.1\r\n{lines}\r\nContent-Length: 20\r\n\r\n{{".encode()
    with silent(panel) as line:
        line.sendall(head)
        line.settimeout(5)
        assert line.recv(4096).startswith(b"HTTP/1.1 408")
    with silent(panel) as line:  # one that breaks off is none
        line.sendall(head)
    assert all(path != "/stop" for _, path, _ in panel.reached)


def test_a_body_in_chunks_is_no_longer_than_another(panel):
    tablet = panel.browser().load()
    lines = "\r\n".join(f"{key}: {value}" for key, value in tablet.headers().items())
    for chunks, status in ((1, b"200"), (9, b"413")):
        said = json.dumps({"cell": CELL}) + " " * 500
        chunk = f"{len(said):x}\r\n{said}\r\n" + f"{500:x}\r\n{' ' * 500}\r\n" * (chunks - 1)
        with silent(panel) as line:
            head = f"POST /stop HTTP/1.1\r\n{lines}\r\nTransfer-Encoding: chunked\r\n\r\n"
            line.sendall(f"{head}{chunk}0\r\n\r\n".encode())
            line.settimeout(5)
            assert line.recv(4096).split()[1] == status
    assert [path for _, path, _ in panel.reached].count("/stop") == 1


def test_a_head_without_end_is_refused(panel):
    with silent(panel) as line:
        with suppress(OSError):
            line.sendall(b"GET / HTTP/1.1\r\nHost: x\r\nX: " + b"a" * 100_000)
        assert is_closed(line, 5.0)
    assert panel.reached == []


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="no TCP_USER_TIMEOUT here")
def test_who_does_not_read_is_cut_off(panel, monkeypatch):
    monkeypatch.setattr(connections, "UNTAKEN_MS", 300)
    tablet = panel.browser().load()
    lines = "\r\n".join(f"{key}: {value}" for key, value in tablet.headers().items())
    with silent(panel) as line:
        line.sendall(f"GET /big HTTP/1.1\r\n{lines}\r\n\r\n".encode())
        time.sleep(0.1)
        assert _ends(panel)
        assert is_closed(line, 5.0)


def _ends(panel):
    for _ in range(100):
        if len(panel.access.connections) == 0:
            return True
        time.sleep(0.05)
    return False


def test_a_page_too_many_says_so(panel):
    tablet = panel.browser().load()
    with ExitStack() as stack:
        for _ in range(OF_A_TABLET):
            stack.enter_context(tablet.live())
        assert tablet.refused() == 403
        answer = tablet.get("/")
        assert answer.status == 503
        assert "Close one" in answer.body.decode()
        other = panel.browser().load()
        assert other.get("/").status == 200
    assert _ends(panel)
    assert tablet.get("/").status == 200


def test_six_pages_of_one_browser_all_live_and_all_stop(panel):
    tablet = panel.browser().load()
    with ExitStack() as stack:
        streams = [stack.enter_context(tablet.live()) for _ in range(12)]
        for number, stream in enumerate(streams):
            assert stream.ask(t="stop", press=str(number))["t"] == "carried out"
        assert tablet.post("/stop", {"cell": CELL, "press": "x"}).status == 200


def test_pipelined_requests_are_each_asked(panel):
    tablet = panel.browser().load()
    good = "\r\n".join(f"{key}: {value}" for key, value in tablet.headers().items())
    bad = "\r\n".join(
        f"{key}: {value}" for key, value in tablet.headers(Origin="https://evil.example").items()
    )
    body = json.dumps({"cell": CELL})
    panel.reached.clear()
    with silent(panel) as line:
        for head in (good, bad, good):
            said = f"POST /stop HTTP/1.1\r\n{head}\r\nContent-Length: {len(body)}\r\n\r\n{body}"
            line.sendall(said.encode())
        line.settimeout(2)
        heard = b""
        with suppress(TimeoutError):
            while heard.count(b"HTTP/1.1") < 3 and (data := line.recv(65536)):
                heard += data
    assert heard.count(b"HTTP/1.1 200") == 2
    assert heard.count(b"HTTP/1.1 403") == 1
    assert len(panel.reached) == 2
