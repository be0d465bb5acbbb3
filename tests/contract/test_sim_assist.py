"""The assist port: a person, as JSON lines."""

import json
import math
import socket
from contextlib import closing

import pytest
from robolink_simulators.assist.port import AssistClient, serve_assist
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.streams.epson_tcp import serve_tcp

from robolink.errors import ConfigError, ConnectError
from robolink.timing import Deadline
from robolink.transport import open_transport, parse_url


def soon(transport, seconds=5.0):
    return Deadline.after(transport.clock, seconds)


def exchange(transport, request):
    transport.send(request, deadline=soon(transport))
    data = b""
    while not data.endswith(b"\r\n"):
        data += transport.receive(deadline=soon(transport))
    return data


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
    assert flange["u_deg"] == pytest.approx(simulator.machine.arm.flange().u_deg, abs=1e-9)
    assert abs(assist.look().dx_mm) < 1e-6
    assert assist.truth() == json.loads(json.dumps(simulator.world.truth()))


def test_the_assist_port_shows_the_axes_of_the_true_tool(assisted):
    _, assist, simulator = assisted
    assist.do("set_world", tool_v_deg=90, eye_sigma_mm=0)
    u_deg = math.radians(simulator.machine.arm.flange().u_deg)
    # Turned about Y by a quarter of a turn, +Z points to where +X was.
    aside = [50 * math.cos(u_deg), 50 * math.sin(u_deg), 0]
    assert assist.way_along("z", 50.0, 1) == pytest.approx(aside, abs=1e-9)
    assert assist.way_along("x", 50.0, 1) == pytest.approx([0, 0, -50], abs=1e-9)
    with pytest.raises(ConfigError, match="no axis 'y'"):
        assist.do("way_along", axis="y", length_mm=50)


def test_the_assist_port_pushes_buttons(assisted):
    host, assist, _ = assisted
    with closing(open_transport(host.url)) as client:
        exchange(client, b"$Login,\r\n")
        assist.do("press_estop")
        assert exchange(client, b"$GetStatus\r\n") == b"#GetStatus,00100010001,0000\r\n"
        assist.do("release_estop")
        exchange(client, b"$Reset\r\n")
        assist.do("raise_error", number=4002)
        assert exchange(client, b"$GetStatus\r\n") == b"#GetStatus,00100001001,4002\r\n"
        assist.do("set_input", bit=3, on=True)
        assert exchange(client, b"$GetIO,3\r\n") == b"#GetIO,1\r\n"
        assist.do("cut_link")
        assert client.receive(deadline=soon(client)) == b""


def test_the_assist_port_counts_and_changes_the_nozzle(assisted):
    _, assist, simulator = assisted
    counted = {"exchanges": 0, "moves_started": 0, "flash_writes": 0, "touches": 0}
    assert assist.do("counters") == counted
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
