"""The assist port: a simulated person, controlled by JSON lines."""

import json
import math
import socket
from contextlib import ExitStack, closing, suppress
from dataclasses import asdict

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.cell.world_parameters import parameter_names
from robolink_simulators.control.acts import ACTS
from robolink_simulators.control.assist import (
    LONGEST_LINE,
    MOST_CLIENTS,
    AssistClient,
    serve_assist,
)
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.errors import ConfigError, ConnectError, TransportBrokenError
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
    with (
        serve_tcp(simulator, clock=clock) as host,
        serve_assist(simulator, clock=clock, token="the-token") as port,
    ):
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
    assert assist.truth() == json.loads(json.dumps(simulator.truth()))


def test_the_assist_port_shows_the_axes_of_the_true_tool(assisted):
    _, assist, simulator = assisted
    assist.do("set_world", tool_v_deg=90, eye_sigma_mm=0)
    u_deg = math.radians(simulator.machine.arm.flange().u_deg)
    # A quarter turn about Y brings +Z to the old direction of +X.
    aside = [50 * math.cos(u_deg), 50 * math.sin(u_deg), 0]
    assert assist.way_along("z", 50.0, 1) == pytest.approx(aside, abs=1e-9)
    assert assist.way_along("x", 50.0, 1) == pytest.approx([0, 0, -50], abs=1e-9)
    with pytest.raises(ConfigError, match=r"way_along knows no axis.*x, z"):
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
        assist.do("set_input", number=3, on=True)
        assert exchange(client, b"$GetIO,3\r\n") == b"#GetIO,1\r\n"
        assist.do("cut_link")
        assert client.receive(deadline=soon(client)) == b""


def test_the_assist_port_counts_and_changes_the_nozzle(assisted):
    _, assist, simulator = assisted
    counted = {"exchanges": 0, "moves_started": 0, "tool_writes": 0, "starts": 1, "touches": 0}
    assert assist.do("counters") == counted
    tip = assist.do("change_nozzle")["tip"]
    assert tip["x_mm"] == simulator.world.tips[1].x_mm


@pytest.mark.parametrize(
    ("act", "parameters", "words"),
    [
        ("dance", {}, "Choose one of"),
        ("raise_error", {}, "whole number"),
        ("raise_error", {"number": "4002"}, "whole number"),
        ("set_input", {"number": 9000}, "no input 9000"),
    ],
)
def test_what_the_assist_port_cannot_do_is_said(assisted, act, parameters, words):
    _, assist, _ = assisted
    with pytest.raises(ConfigError, match=words):
        assist.do(act, **parameters)
    assert assist.do("counters")["exchanges"] == 0


# 400 digits are legal JSON and no float: math.isfinite raises at them.
HUGE = 10**400
HOSTILE = [HUGE, -HUGE, 1e308, -1e308, math.nan, math.inf, "x" * 900, [[]], {}, None, True, "1e300"]


TURNS = 4


@pytest.mark.parametrize("turns", [TURNS, pytest.param(1, marks=pytest.mark.soak)])
@pytest.mark.parametrize("simulated", [EpsonSimulator, SoftMotionSimulator])
def test_no_value_of_any_act_stops_the_assist_port(simulated, turns):
    """Of the world's many parameters, each value is given to every fourth, in turn.

    An act that both kinds have gets half of the values on each.
    """
    simulator, clock = simulated(seed=3), ScaledClock(50)
    acts = {name: act for name, act in ACTS[simulator.kind].items() if name != "set_world"}
    shared, of_an_epson = set(ACTS["epson"]) & set(ACTS["softmotion"]), simulator.kind == "epson"
    usual = {"axis": "z", "text": "a", "name": "a", "action": "delay", "order": "low_first"}
    with serve_assist(simulator, clock=clock) as port, AssistClient(port.url) as assist:
        for turn, value in enumerate(HOSTILE):
            for act in acts.values():
                if act.name in shared and turns > 1 and turn % 2 == of_an_epson:
                    continue
                given = {taken.name: usual.get(taken.name, 1) for taken in act.takes}
                for name in (*given, "unknown"):
                    with suppress(ConfigError):
                        assist.do(act.name, **{**given, name: value})
            for name in list(parameter_names())[turn % turns :: turns]:
                with suppress(ConfigError):
                    assist.do("set_world", **{name: value})
        assert all(math.isfinite(value) for value in asdict(assist.look()).values())
        assert assist.do("counters")["touches"] >= 0


def door(assist):
    """Open a bare connection to the assist port."""
    link = parse_url(assist._url)
    return socket.create_connection((link.host, link.port), timeout=5)


def end_of(connection):
    """Read to the end of a connection, which with unread bytes may be a reset."""
    heard = b""
    try:
        while piece := connection.recv(65536):
            heard += piece
    except ConnectionResetError:
        pass
    return heard


@pytest.mark.fault("F74")
def test_a_web_page_gets_nothing_done_at_the_assist_port(assisted):
    _, assist, simulator = assisted
    with door(assist) as browser:
        browser.sendall(b'POST / HTTP/1.1\r\nHost: x\r\n\r\n{"do": "press_estop"}\n')
        assert end_of(browser) == b""
    assert not simulator.condition.estop_pressed


@pytest.mark.parametrize(
    "first",
    [
        {"do": "press_estop"},
        {"token": "guessed", "do": "press_estop"},
        {"token": None},
        {"token": ""},
        {"token": ["a", "list"]},
        {"token": "\ud800"},
    ],
    ids=["none", "wrong", "null", "empty", "list", "surrogate"],
)
@pytest.mark.fault("F74")
def test_nobody_gets_in_at_the_assist_port_without_its_token(assisted, first):
    _, assist, simulator = assisted
    with door(assist) as stranger:
        stranger.sendall(json.dumps(first).encode() + b'\n{"do": "press_estop"}\n')
        refused = end_of(stranger)
    assert refused.count(b"\n") <= 1
    assert b"not the token" in refused or refused == b""
    assert not simulator.condition.estop_pressed
    assert assist.do("counters")["exchanges"] == 0


def test_a_wrong_or_missing_token_is_refused_in_plain_words(assisted):
    _, assist, _ = assisted
    bare = assist._url
    for url in (bare, bare.replace("://", "://guessed@")):
        with pytest.raises(ConfigError, match="does not know the token") as refused:
            AssistClient(url)
        assert "guessed" not in str(refused.value)
        assert "'robolink sim' prints" in refused.value.remedy


def test_an_act_that_fails_as_none_should_ends_no_port(assisted, monkeypatch):
    _, assist, simulator = assisted
    with monkeypatch.context() as broken:
        broken.setattr(simulator, "counters", lambda: 1 / 0)
        with pytest.raises(ConfigError, match="The simulator failed: ZeroDivisionError") as told:
            assist.do("counters")
        assert "report" in told.value.remedy
    assert assist.do("counters")["exchanges"] == 0


def test_each_assist_port_draws_its_own_token():
    simulator, clock = EpsonSimulator(seed=3), ScaledClock()
    with serve_assist(simulator, clock=clock) as one, serve_assist(simulator, clock=clock) as two:
        tokens = {host.url.partition("@")[0] for host in (one, two)}
    assert len(tokens) == 2
    assert all(len(token) == len("assist+tcp://") + 22 for token in tokens)
    assert "drawn" not in "".join(tokens)
    with serve_assist(simulator, clock=clock, token="given") as port:
        assert "//given@" in port.url


def test_who_keeps_silent_at_the_assist_port_keeps_nobody_out(assisted):
    _, assist, _ = assisted
    with ExitStack() as stack:
        silent = [stack.enter_context(door(assist)) for _ in range(3 * MOST_CLIENTS)]
        assert assist.do("counters")["exchanges"] == 0
        url = assist._url.replace("://", "://the-token@")
        with AssistClient(url) as other:
            assert other.do("counters")["exchanges"] == 0
        assert end_of(silent[0]) == b""


def test_a_full_assist_port_sends_the_newcomer_away(assisted):
    _, assist, _ = assisted
    url = assist._url.replace("://", "://the-token@")
    with ExitStack() as stack:
        for _ in range(MOST_CLIENTS - 1):
            stack.enter_context(AssistClient(url))
        with pytest.raises(TransportBrokenError):
            AssistClient(url)
        assert assist.do("counters")["exchanges"] == 0
    # Places are free again once the port has noticed the departures, before the next client.
    assert assist.do("counters")["exchanges"] == 0
    with AssistClient(url) as again:
        assert again.do("counters")["exchanges"] == 0


@pytest.mark.parametrize("ends", [b"", b"\n"], ids=["endless", "ended"])
def test_a_line_beyond_the_limit_ends_the_connection_and_nothing_else(assisted, ends):
    _, assist, _ = assisted
    with door(assist) as flood:
        with suppress(ConnectionError):
            flood.sendall(b'{"token": "' + b"x" * (2 * LONGEST_LINE) + b'"}' + ends)
            assert end_of(flood) == b""
    assert assist.do("counters")["exchanges"] == 0


def test_an_assist_url_is_checked():
    with pytest.raises(ConfigError, match="not an assist URL"):
        AssistClient("http://127.0.0.1:80")
    with pytest.raises(ConnectError):
        AssistClient("assist+tcp://127.0.0.1:1")
