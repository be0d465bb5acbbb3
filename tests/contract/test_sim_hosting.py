"""The served simulator against clients that are not ours: raw sockets, and its own assist."""

import json
import random
import re
import socket
import threading
import tomllib
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from robolink_simulators.assist import AssistClient, serve_assist
from robolink_simulators.clock import ManualClock, ScaledClock
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.in_process import (
    clock_of,
    open_epson,
    register,
    simulator_named,
    unregister,
)
from robolink_simulators.hosting.tcp import serve_tcp

from robolink.errors import (
    ConfigError,
    ConnectError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.model import Secret
from robolink.timing import Deadline
from robolink.transport import open_transport, parse_url


ANSWER = re.compile(rb'(#\w+,"[^"]*"|[#!][^\r"]*)\r\n')


class RawClient:
    """A socket and nothing else; hands out one answer at a time."""

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


# ---- the vectors of epson.md part 7, against the simulator ----------------------------------


def test_a_login_with_and_without_a_password():
    with served(EpsonSimulator(password=Secret("123"))) as host:
        with raw(host.url, password="123"):
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
    x_before, x_after = (float(layout.fullmatch(text)[1]) for text in (before, after))
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


def test_a_second_execute_is_refused_while_the_first_one_runs():
    with served() as host, raw(host.url) as client:
        client.socket.sendall(b'$Execute,"Move Here +X(-50)"\r\n')
        assert client.ask('$Execute,"Go P1"') == "!Execute,21"
        assert client.ask("$GetStatus") == "#GetStatus,00100000010,0000"
        assert client.ask("$Abort") == "#Abort,0"
        assert client.answer() == "!Execute,99"


def test_every_transcribed_request_is_understood():
    """None of the requests of the transcripts is unknown or malformed here."""
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
    simulator = EpsonSimulator(options=EpsonOptions(remote_timeout_s=5))
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


def test_only_loopback_is_served_unless_told_otherwise():
    for address in ("0.0.0.0", "192.0.2.1", "::", "example.com"):
        with pytest.raises(ConfigError, match="other machines"):
            serve_tcp(EpsonSimulator(), address)
    with serve_tcp(EpsonSimulator(), "0.0.0.0", allow_remote=True) as host:
        with raw(host.url.replace("0.0.0.0", "127.0.0.1")) as client:
            assert client.ask("$GetCurRobot") == "#GetCurRobot,1"


def test_a_taken_port_is_named():
    with served() as host:
        port = parse_url(host.url).port
        with pytest.raises(ConnectError, match=str(port)):
            serve_tcp(EpsonSimulator(), port=port)


# ---- the assist port -------------------------------------------------------------------------


@pytest.fixture
def assisted():
    simulator, clock = EpsonSimulator(seed=3), ScaledClock(50)
    with serve_tcp(simulator, clock=clock) as host, serve_assist(simulator, clock=clock) as port:
        with AssistClient(port.url) as assist:
            yield host, assist, simulator


def test_the_assist_port_looks_jogs_and_tells_the_truth(assisted):
    _, assist, simulator = assisted
    seen = assist.look(1)
    assert seen == simulator.world.operator.look()
    with pytest.raises(ConfigError, match="Teach"):
        assist.jog_onto_pin()
    assist.do("teach")
    flange = assist.jog_onto_pin()
    assert flange["u_deg"] == pytest.approx(simulator.machine.arm.flange().u_deg)
    assert abs(assist.look().dx_mm) < 1e-6
    assert assist.truth() == json.loads(json.dumps(simulator.world.truth()))


def test_the_assist_port_pushes_buttons(assisted):
    host, assist, _ = assisted
    with raw(host.url) as client:
        for act, flags in (
            ("press_estop", "00100010001"),
            ("release_estop", "00100010001"),
        ):
            assist.do(act)
            assert client.ask("$GetStatus") == f"#GetStatus,{flags},0000"
        client.ask("$Reset")
        assist.do("raise_error", number=4002)
        assert client.ask("$GetStatus") == "#GetStatus,00100001001,4002"
        assist.do("set_input", bit=3, on=True)
        assert client.ask("$GetIO,3") == "#GetIO,1"
        assist.do("cut_link")
        assert client.socket.recv(10) == b""


def test_the_assist_port_counts_and_changes_the_nozzle(assisted):
    _, assist, simulator = assisted
    assert assist.do("counters") == {"exchanges": 0, "moves_started": 0, "flash_writes": 0}
    tip = assist.do("change_nozzle")["tip"]
    assert tip["x_mm"] == simulator.world.tips[1].x_mm


@pytest.mark.parametrize(
    ("act", "parameters", "words"),
    [
        ("dance", {}, "Known are"),
        ("raise_error", {}, "whole number"),
        ("raise_error", {"number": "4002"}, "whole number"),
        ("set_input", {"bit": 9000}, "no bit"),
    ],
)
def test_what_the_assist_port_cannot_do_is_said(assisted, act, parameters, words):
    _, assist, _ = assisted
    with pytest.raises(ConfigError, match=words):
        assist.do(act, **parameters)
    assert assist.do("counters")["exchanges"] == 0


def test_a_web_page_gets_nothing_done_at_the_assist_port(assisted):
    _, assist, simulator = assisted
    link = parse_url(assist._url)
    with socket.create_connection((link.host, link.port), timeout=5) as browser:
        browser.sendall(b'POST / HTTP/1.1\r\nHost: x\r\n\r\n{"do": "press_estop"}\n')
        assert browser.recv(100) == b""
    assert not simulator.condition.estop_pressed


def test_an_assist_url_is_checked():
    with pytest.raises(ConfigError, match="not an assist URL"):
        AssistClient("http://127.0.0.1:80")
    with pytest.raises(ConnectError):
        AssistClient("assist+tcp://127.0.0.1:1")


# ---- in this process -------------------------------------------------------------------------


@pytest.fixture
def name(request):
    yield "hosting-test"
    unregister("hosting-test")


def soon(transport, seconds=5.0):
    return Deadline.after(transport.clock, seconds)


def exchange(transport, request):
    transport.send(request, deadline=soon(transport))
    data = b""
    while not data.endswith(b"\r\n"):
        data += transport.receive(deadline=soon(transport))
    return data


def test_a_named_simulator_is_shared_by_name(name):
    first = open_transport(f"epson+sim://{name}?seed=4&rc_plus=5&robot=GX4-C251S")
    again = open_transport(f"epson+sim://{name}")
    with closing(first), closing(again):
        simulator = simulator_named(name)
        assert (simulator.seed, simulator.options.rc_plus) == (4, 5)
        assert simulator.machine.model.name == "GX4-C251S"
        assert first.clock is again.clock is clock_of(name)
        assert first.identity == again.identity == f"epson+sim://{name}"
        assert not first.durable
    with pytest.raises(ConfigError, match="other options"):
        open_transport(f"epson+sim://{name}?seed=5")


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("colour=red", "robot, seed, state, split, terminator"),
        ("seed=x", "whole number"),
        ("robot=R2D2", "no simulated robot"),
        ("split=2", "split"),
        ("terminator=tab", "crlf"),
    ],
)
def test_a_wrong_option_is_named_and_leaves_no_simulator(name, query, words):
    with pytest.raises(ConfigError, match=words):
        open_transport(f"epson+sim://{name}?{query}")
    with pytest.raises(ConfigError, match="No simulator"):
        simulator_named(name)


def test_a_state_file_makes_it_durable(name, tmp_path):
    with closing(open_transport(f"epson+sim://{name}?state={tmp_path}/cell.json")) as transport:
        assert transport.durable


def test_waiting_lets_simulated_time_pass_and_no_more_than_needed(name):
    with closing(open_transport(f"epson+sim://{name}")) as transport:
        exchange(transport, b"$Login,\r\n")
        assert transport.clock.now_ns() == 0
        transport.send(b'$Execute,"Move Here +X(-10)"\r\n', deadline=soon(transport))
        assert not transport.wait_readable(deadline=soon(transport, 0.1))
        assert transport.clock.now_ns() == 100_000_000
        assert transport.wait_readable(deadline=soon(transport, 60))
        assert transport.receive(deadline=soon(transport)) == b"#Execute,0\r\n"
        assert transport.clock.now_ns() < 2_000_000_000
        with pytest.raises(TransportTimeoutError):
            transport.receive(deadline=soon(transport))


def test_what_arrives_may_come_in_pieces(name):
    with closing(open_transport(f"epson+sim://{name}?split=1")) as transport:
        transport.send(b"$Login,\r\n$GetStatus\r\n", deadline=soon(transport))
        pieces = []
        while sum(map(len, pieces)) < 10 + 29:
            pieces.append(transport.receive(deadline=soon(transport)))
        assert len(pieces) > 2
        assert b"".join(pieces) == b"#Login,0\r\n#GetStatus,00100000001,0000\r\n"


def test_a_cut_link_ends_the_stream_and_breaks_the_next_send(name):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.DISCONNECT, match="GetIO")])
    register(name, simulator)
    with closing(open_transport(simulator.url)) as transport:
        exchange(transport, b"$Login,\r\n")
        transport.send(b"$GetIO,0\r\n", deadline=soon(transport))
        assert transport.receive(deadline=soon(transport)) == b""
        assert transport.receive_waiting() == b""
        with pytest.raises(TransportBrokenError):
            transport.send(b"$GetIO,0\r\n", deadline=soon(transport))


def test_a_name_is_taken_once(name):
    register(name, EpsonSimulator())
    with pytest.raises(ConfigError, match="taken"):
        register(name, EpsonSimulator())


def test_a_manual_clock_of_the_caller_is_used(name):
    clock = ManualClock(77)
    with closing(open_epson(parse_url(f"epson+sim://{name}"), clock=clock)) as transport:
        assert transport.clock is clock


def test_threads_do_not_mix_their_answers(name):
    simulator = EpsonSimulator()
    register(name, simulator)
    with closing(open_transport(simulator.url)) as transport:
        exchange(transport, b"$Login,\r\n")
        stop = threading.Event()

        def press():
            while not stop.is_set():
                simulator.panel.press_estop()
                simulator.panel.release_estop()

        thread = threading.Thread(target=press)
        thread.start()
        try:
            answers = {exchange(transport, b"$GetCurRobot\r\n") for _ in range(300)}
        finally:
            stop.set()
            thread.join()
    assert answers == {b"#GetCurRobot,1\r\n"}
