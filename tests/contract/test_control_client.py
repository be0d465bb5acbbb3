"""Clients of a simulator whose far end is something else, is silent or has ended."""

import json
import socket
import threading
from contextlib import contextmanager

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.control import http_port
from robolink_simulators.control.assist import AssistClient, serve_assist
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.control.client import ControlClient
from robolink_simulators.control.server import ControlServer
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.errors import (
    ConnectError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportTimeoutError,
)

OTHER_JSON = json.dumps({"error": "not found", "status": 404}).encode()
NOT_OURS = {
    "JSON of its own": b"HTTP/1.1 404 No\r\nContent-Length: %d\r\n\r\n%s"
    % (len(OTHER_JSON), OTHER_JSON),
    "its own with 200": b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%s"
    % (len(OTHER_JSON), OTHER_JSON),
    "no object": b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n[]",
    "a page": b"HTTP/1.1 200 OK\r\nContent-Length: 13\r\n\r\n<html></html>",
    "a page that ends with its connection": b"HTTP/1.0 200 OK\r\n\r\n<html></html>",
    "no HTTP": b"#login,0\r\n",
    "bytes": b"\x00\xff\xfe\r\n\r\n",
    "too many headers": b"HTTP/1.1 200 OK\r\n" + b"A: 1\r\n" * 200 + b"\r\n",
    "too long a line": b"HTTP/1.1 200 " + b"a" * 70_000,
}
CUT = {
    "nothing": b"",
    "half a head": b"HTTP/1.1 200 OK\r\nContent-Le",
    "half a body": b'HTTP/1.1 200 OK\r\nContent-Length: 50\r\n\r\n{"ok": tr',
}


@contextmanager
def answering(answer, *, holds=False):
    """Serve one connection: read a request, send this answer, and close it unless it is held."""
    done = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve():
            connection, _ = listener.accept()
            with connection:
                connection.recv(65536)
                connection.sendall(answer)
                if holds:
                    done.wait(20)
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(65536):  # closing with unread bytes would send a reset
                    pass

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listener.getsockname()[1]
        done.set()
        thread.join(20)


def control(port, **more):
    return ControlClient(f"http://127.0.0.1:{port}/token/v1/cells/cell", **more)


@pytest.mark.parametrize("answer", NOT_OURS.values(), ids=NOT_OURS)
def test_what_is_no_simulator_is_called_that(answer):
    with answering(answer) as port, control(port) as client:
        with pytest.raises(RemoteProtocolError, match="no robolink simulator") as told:
            client.do("truth")
    assert str(port) in told.value.what
    assert "token" not in str(told.value)
    assert told.value.remedy


@pytest.mark.parametrize("answer", CUT.values(), ids=CUT)
def test_a_connection_that_ends_without_an_answer_leaves_it_open_what_was_done(answer):
    with answering(answer) as port, control(port) as client:
        with pytest.raises(TransportBrokenError, match="ended without an answer") as told:
            client.do("change_nozzle")
    assert "before you repeat it" in told.value.remedy


def test_who_is_silent_is_not_called_gone():
    with answering(b"", holds=True) as port, control(port, timeout_s=0.2) as client:
        with pytest.raises(TransportTimeoutError, match=r"within 0\.2 s") as told:
            client.do("change_nozzle")
    assert "before you repeat it" in told.value.remedy


@pytest.mark.parametrize(
    ("answer", "kind"),
    [
        (b"!login,99\r\n", RemoteProtocolError),
        (b"{}\n", RemoteProtocolError),
        (b"[1]\n", RemoteProtocolError),
        (b"\n", RemoteProtocolError),
        (b"", TransportBrokenError),
    ],
)
def test_the_assist_port_of_no_simulator_is_called_that_too(answer, kind):
    with answering(answer) as port, pytest.raises(kind) as told:
        AssistClient(f"assist+tcp://token@127.0.0.1:{port}")
    assert str(port) in told.value.what
    assert "token" not in str(told.value)
    assert told.value.remedy


def test_an_assist_port_that_is_silent_is_not_called_gone():
    with answering(b"", holds=True) as port, pytest.raises(TransportTimeoutError, match=r"0\.2 s"):
        AssistClient(f"assist+tcp://token@127.0.0.1:{port}", timeout_s=0.2)


def test_the_port_of_a_controller_is_no_control_port():
    with serve_tcp(EpsonSimulator(seed=3), clock=ScaledClock()) as host:
        port = int(host.url.rpartition(":")[2])
        with control(port, timeout_s=10) as client:
            with pytest.raises((RemoteProtocolError, TransportBrokenError)):
                client.do("truth")


@pytest.fixture
def served():
    cell = ControlledCell(EpsonSimulator(seed=3), ManualClock())
    with ControlServer({"cell": cell}) as server:
        yield server


def test_a_client_that_was_silent_for_long_connects_again(served, monkeypatch):
    monkeypatch.setattr(http_port._Served, "timeout", 0.05)
    with ControlClient(served.url_of("cell")) as client:
        client.do("snapshot", name="one")
        first = client._connection.sock
        first.settimeout(10)
        assert first.recv(1, socket.MSG_PEEK) == b""  # the simulator has ended it
        # The act is carried out, once.
        assert client.do("counters")["starts"] == 1
        assert client._connection.sock is not first
        assert client._connection.sock.gettimeout() == 10.0
        assert served.requests == 2


def test_a_connection_that_stands_is_kept(served):
    with ControlClient(served.url_of("cell")) as client:
        client.do("counters")
        first = client._connection.sock
        client.do("counters")
        assert client._connection.sock is first


def test_one_that_listens_no_more_is_gone():
    cell = ControlledCell(EpsonSimulator(seed=3), ManualClock())
    with ControlServer({"cell": cell}) as server:
        client = ControlClient(server.url_of("cell"))
        client.do("counters")
    with client:
        with pytest.raises(TransportBrokenError, match="is gone"):
            client.do("counters")
        with pytest.raises(ConnectError, match="No simulator listens"):
            client.do("counters")


def test_the_longest_answer_there_is_reaches_a_client_of_the_assist_port():
    simulator = EpsonSimulator(seed=3)
    for number in range(2000):
        simulator.log.add(number, ">", f"{number} {'x' * 1500}")
    with serve_assist(simulator, clock=ScaledClock()) as port, AssistClient(port.url) as client:
        assert len(client.do("log")["lines"]) == 2000


def test_the_assist_port_counts_what_it_was_asked():
    with serve_assist(EpsonSimulator(seed=3), clock=ScaledClock()) as port:
        assert port.requests == 0
        with AssistClient(port.url) as client:
            client.look()
            client.truth()
        assert port.requests == 3  # the token, and two acts
