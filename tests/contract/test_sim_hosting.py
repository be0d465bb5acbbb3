"""The served simulator against a foreign client: a raw socket."""

import random
import re
import socket
import threading
import tomllib
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.spel import parser
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp

from robolink.errors import ConfigError, ConnectError
from robolink.model import Secret
from robolink.transport import parse_url

ANSWER = re.compile(rb'(#\w+,"[^"]*"|[#!][^\r"]*)\r\n')


class RawClient:
    """A bare socket that returns one answer at a time."""

    def __init__(self, url):
        link = parse_url(url)
        self.socket = socket.create_connection((link.host, link.port), timeout=10)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.held = b""

    def ask(self, request):
        self.socket.sendall(request.encode() + b"\r\n")
        return self.answer()

    def answer(self):
        while (whole := ANSWER.match(self.held)) is None:
            part = self.socket.recv(4096)
            if not part:
                raise EOFError(self.held)
            self.held += part
        self.held = self.held[whole.end() :]
        return whole[1].decode()

    def close(self):
        self.socket.close()


@contextmanager
def raw(url, *, password=""):
    with closing(RawClient(url)) as client:
        assert client.ask(f"$Login,{password}") == "#Login,0"
        yield client


@contextmanager
def served(simulator=None, *, factor=1.0):
    simulator = simulator or EpsonSimulator()
    with serve_tcp(simulator, clock=ScaledClock(factor)) as host:
        yield host


# ---- the exchanges of docs/reference/epson.md 6, on the simulator


def test_a_login_with_and_without_a_password():
    with served(EpsonSimulator(password=Secret("canary-123"))) as host:
        with raw(host.url, password="canary-123"):
            pass
    with served() as host:
        with closing(RawClient(host.url)) as client:
            assert client.ask("$Login,bad") == "!Login,13"
            assert client.ask("$Login,") == "#Login,0"


def test_the_dialogue_with_a_running_task():
    """Vectors 3 to 7 and 12: an RC700-A while its task ran."""
    with served() as host, raw(host.url) as client:
        version = client.ask("$GetVariable,VERSION$,String")
        assert version == "#GetVariable,SIMULATED"
        assert client.ask("$GetStatus") == "#GetStatus,00100000001,0000"
        assert client.ask("$Start,0") == "#Start,0"
        assert client.ask("$GetStatus") == "#GetStatus,00100000010,0000"
        assert client.ask("$Reset") == "!Reset,20"
        assert client.ask("$SetMotorsOn,1") == "!SetMotorsOn,20"
        assert client.ask("$SetMotorsOff,1") == "!SetMotorsOff,20"
        assert client.ask("$Pause") == "#Pause,0"
        assert client.ask("$Stop") == "#Stop,0"
        assert client.ask("$Logout") == "#Logout,0"


def test_the_dialogue_with_a_small_move():
    """Vectors 8 to 11: the position changes by the step, less some micrometres."""
    with served(factor=50) as host, raw(host.url) as client:
        assert client.ask("$SetMotorsOn,1") == "#SetMotorsOn,0"
        before = client.ask('$Execute,"print realpos"')
        assert client.ask('$Execute,"move here +x(-1)"') == "#Execute,0"
        after = client.ask('$Execute,"print realpos"')
    layout = re.compile(
        r'#Execute," X: ([ \d.-]{8}) Y: [ \d.-]{8} Z: [ \d.-]{8}'
        r' U: [ \d.-]{8} V: [ \d.-]{8} W: [ \d.-]{8} /R /0\r\n"'
    )
    x_before, x_after = (float(layout.findall(text)[0]) for text in (before, after))
    assert x_after - x_before == pytest.approx(-1, abs=0.02)


def test_the_remaining_vectors():
    simulator = EpsonSimulator()
    simulator.machine.inputs.set_byte(0, 0xFF)
    simulator.machine.inputs.set(8, True)
    with served(simulator) as host, raw(host.url) as client:
        assert client.ask('$execute,"Tool 1"') == "#execute,0"
        assert client.ask("$GetIO,1") == "#GetIO,1"
        assert client.ask("$GetIOByte,0") == "#GetIOByte,FF"
        assert client.ask("$GetIOWord,0") == "#GetIOWord,01FF"
        assert client.ask("$GetAlm") == "#GetAlm,0"
        assert client.ask("GetStatus") == "!GetStatus,10"
        assert client.ask("$Nope") == "!Nope,11"
        assert client.ask("$Login,,terminator") == "#Login,0"
        assert client.ask("$GetErrMsg,4001,0") == "#GetErrMsg,Out of reach"
        assert client.ask("$GetRobotInfo") == "#GetRobotInfo,1,3,T6-602S"
        assert client.ask("$GetMotor,0") == "#GetMotor,1,1,0"


@pytest.mark.fault("F42")
def test_a_second_execute_is_refused_while_the_first_one_runs():
    with served() as host, raw(host.url) as client:
        client.socket.sendall(b'$Execute,"Move Here +X(-50)"\r\n')
        assert client.ask('$Execute,"Go P1"') == "!Execute,21"
        assert client.ask("$GetStatus") == "#GetStatus,00100000010,0000"
        assert client.ask("$Abort") == "#Abort,0"
        assert client.answer() == "!Execute,99"


def test_every_transcribed_request_is_understood():
    """The simulator knows every request of the transcripts."""
    path = Path(__file__).parents[1] / "transcripts" / "epson_text.toml"
    exchanges = tomllib.loads(path.read_text())["exchange"]
    requests = [
        entry["request"] for entry in exchanges if not entry.get("reply", "").startswith("!")
    ]
    assert len(requests) > 10
    with served(factor=1000) as host:
        for request in requests:
            with closing(RawClient(host.url)) as client:
                if not request.lower().startswith("$login"):
                    client.ask("$Login,")
                    assert client.ask("$Reset") == "#Reset,0"
                answer = client.ask(request)
            assert not re.fullmatch(r"!\w+,1[012]", answer), (request, answer)


# ---- the TCP host ----------------------------------------------------------------------------


def test_requests_cut_anywhere_are_the_same_requests():
    rng = random.Random(1)
    with served() as host, raw(host.url) as client:
        stream = b'$GetCurRobot\r\n$GetIO,7\r\n$Execute,"Print Tool"\r\n'
        while stream:
            cut = rng.randint(1, 6)
            client.socket.sendall(stream[:cut])
            stream = stream[cut:]
        expected = b'#GetCurRobot,1\r\n#GetIO,0\r\n#Execute,"1\r\n"\r\n'
        received = b""
        while len(received) < len(expected):
            received += client.socket.recv(100)
    assert received == expected


def test_an_idle_link_is_cut_without_anybody_sending():
    simulator = EpsonSimulator(options=EpsonOptions(remote_timeout_s=0.1))
    with served(simulator, factor=50) as host, raw(host.url) as client:
        assert client.socket.recv(10) == b""
        assert simulator.condition.code == 19


def test_a_delayed_reply_wakes_the_host_by_itself():
    simulator = EpsonSimulator(faults=[Fault(FaultAction.DELAY, match="GetIO", seconds=2)])
    with served(simulator, factor=50) as host, raw(host.url) as client:
        assert client.ask("$GetIO,0") == "#GetIO,0"


def test_an_act_at_the_panel_wakes_the_host():
    simulator = EpsonSimulator()
    with served(simulator) as host, raw(host.url) as client:
        client.socket.sendall(b'$Execute,"Move Here +X(-50)"\r\n')
        assert client.ask("$GetStatus") == "#GetStatus,00100000010,0000"
        simulator.panel.press_estop()
        assert client.answer() == "!Execute,99"


def test_a_client_that_resets_frees_its_place():
    with served() as host:
        with raw(host.url) as client:
            client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        with raw(host.url) as client:
            assert client.ask("$GetCurRobot") == "#GetCurRobot,1"


def test_a_closed_host_closes_its_connections_and_its_port():
    simulator = EpsonSimulator()
    with served(simulator) as host:
        assert simulator.url == host.url
        client = RawClient(host.url)
        assert client.ask("$Login,") == "#Login,0"
    with closing(client):
        assert client.socket.recv(10) == b""
    assert simulator.url == ""
    assert simulator.watchers == []
    link = parse_url(host.url)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((link.host, link.port), timeout=5)
    host.close()


def test_a_closed_host_leaves_no_thread():
    before = threading.active_count()
    with served():
        assert threading.active_count() == before + 1
    assert threading.active_count() == before


@pytest.mark.fault("F73")
def test_f73_only_loopback_is_served_unless_told_otherwise():
    for address in ("0.0.0.0", "192.0.2.1", "::", "example.com"):
        with pytest.raises(ConfigError, match="other machines"):
            serve_tcp(EpsonSimulator(), address)
    with serve_tcp(EpsonSimulator(), "0.0.0.0", allow_remote=True) as host:
        with raw(host.url.replace("0.0.0.0", "127.0.0.1")) as client:
            assert client.ask("$GetCurRobot") == "#GetCurRobot,1"


def test_a_taken_port_is_named():
    with served() as host:
        port = int(host.url.rpartition(":")[2])
        with pytest.raises(ConnectError, match=str(port)):
            serve_tcp(EpsonSimulator(), port=port)


@pytest.mark.parametrize("serve", [serve_tcp, serve_serial])
def test_no_client_waits_until_statements_can_be_read(serve, monkeypatch):
    """Loading the parser takes a third of a second, and seconds on a busy machine."""
    made = []
    monkeypatch.setattr(parser, "_parser", lambda: made.append("the parser"))
    with serve(EpsonSimulator()):
        assert made == ["the parser"]
