"""The control API: a client in any language operates a simulated cell."""

import http.client
import json
import os
import socket
import time
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ManualClock, SteeredClock
from robolink_simulators.control import http_port
from robolink_simulators.control import wire_acts as wire
from robolink_simulators.control.acts import ACTS
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.control.client import ControlClient
from robolink_simulators.control.http_port import LONGEST_REQUEST, MOST_CLIENTS
from robolink_simulators.control.server import ControlServer
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import counted
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.errors import ConfigError, ConnectError, OutcomeUnknownError, TransportBrokenError
from robolink.register_maps import load_map
from tools.openapi import openapi

ROOT = Path(__file__).parents[2]
MAP = ROOT / "examples/plc-maps/commit-bit.toml"


@pytest.fixture(scope="module")
def cells():
    """An EPSON on a port, a PLC with a mailbox on a bus, and one with a map, behind one port."""
    epson, plc = EpsonSimulator(seed=3), SoftMotionSimulator(seed=3)
    mapped = PlcSimulator(load_map(MAP))
    clocks = [SteeredClock(20) for _ in range(3)]
    with ExitStack() as stack:
        tcp = stack.enter_context(serve_tcp(epson, clock=clocks[0])).url
        bus = stack.enter_context(serve_modbus_tcp(plc, clock=clocks[1])).url
        served = {
            "a": ControlledCell(epson, clocks[0], {"tcp": tcp}),
            "b": ControlledCell(plc, clocks[1], {"modbus-tcp": bus}),
            "c": ControlledCell(mapped, clocks[2]),
        }
        yield stack.enter_context(ControlServer(served, token="the-token"))


@pytest.fixture
def at(cells):
    """Makes clients, each of a cell in its initial state."""
    with ExitStack() as stack:

        def client(name):
            simulator = cells.cells[name].simulator
            simulator.reset()
            return stack.enter_context(ControlClient(cells.url_of(name))), simulator

        yield client
    for cell in cells.cells.values():
        cell.clock.run(20)


def raw(cells, method, path, body=b"", headers=()):
    """Send any request; return status and document."""
    parts = urlsplit(cells.url)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=10)
    try:
        connection.request(method, path, body, dict(headers))
        reply = connection.getresponse()
        told = json.loads(reply.read())
        assert told.get("ok", "openapi" in told) or (told["error"] and told["remedy"])
        return reply.status, told
    finally:
        connection.close()


def test_an_act_that_several_kinds_have_takes_the_same_at_each():
    kinds: dict[str, set[object]] = {}
    for acts in ACTS.values():
        for name, act in acts.items():
            kinds.setdefault(name, set()).add((act.takes, act.reads))
    assert {name for name, forms in kinds.items() if len(forms) > 1} == set()
    assert set(ACTS["plc"]) <= set(ACTS["softmotion"])


@pytest.mark.parametrize("name", ["a", "b"])
def test_both_kinds_are_looked_at_and_pushed_alike(at, name):
    control, simulator = at(name)
    assert {"kind", "machine", "seed", "urls", "acts", "version"} == set(control.about())
    assert control.do("truth")["tips"] == json.loads(json.dumps(simulator.truth()["tips"]))
    assert set(control.do("look")) == {"dx_mm", "dy_mm", "dz_mm"}
    tip = control.do("change_nozzle")["tip"]
    assert control.do("truth")["tips"]["1"] == tip
    assert control.do("set_input", number=3) == {}
    assert control.do("press_estop") == {}
    assert control.do("release_estop") == {}
    assert control.do("set_world", eye_sigma_mm=0.5)["parameters"]["eye_sigma_mm"] == 0.5
    control.do("snapshot", name="before")
    control.do("change_nozzle")
    control.do("restore", name="before")
    assert control.do("truth")["tips"]["1"] == tip
    control.do("reset")
    assert control.do("truth")["tips"]["1"] != tip
    assert control.do("counters")["starts"] >= 1


@pytest.mark.parametrize("name", ["a", "b"])
def test_a_cable_is_pulled_and_a_client_that_connects_again_is_served(
    at, cells, name, monkeypatch, tmp_path
):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    control, _ = at(name)
    (url,) = cells.cells[name].urls.values()
    with robolink.connect(url, timeout_s=3.0) as controller:
        before = controller.tools.read(1)
        assert control.do("cut_link") == {}
        with pytest.raises(TransportBrokenError):
            controller.tools.read(1)
    with robolink.connect(url, timeout_s=3.0) as controller:
        assert controller.tools.read(1) == before


def test_an_answer_is_lost_as_often_as_was_asked_for(at, cells, monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    control, simulator = at("a")
    added = control.do("add_fault", action="drop_reply", match="TLSet 2, XY", times=2)
    assert [fault.get("on_exchange", 0) for fault in added["pending"]] == [0, 1]
    with robolink.connect(cells.cells["a"].urls["tcp"], timeout_s=3.0) as controller:
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(2, ToolOffset(1, 2, 3), expected=None)
    told = control.do("faults")
    assert [len(told["fired"]), len(told["pending"])] == [1, 1]
    assert control.do("truth")["stored"]["2"]["y_mm"] == 2
    lines = control.do("log")["lines"]
    asked = [line for line in lines if line["direction"] == ">" and "TLSet 2, XY" in line["text"]]
    assert len(asked) == 1
    assert control.do("log", after=asked[0]["number"])["lines"][0]["number"] > asked[0]["number"]
    assert control.do("clear_faults")["pending"] == []
    assert simulator.faults.pending == ()


def test_sim_ctl_does_an_act_from_a_shell(cells, at, capsys):
    control, _ = at("a")
    control.do("set_clock", factor=0)
    then = control.do("clock")["simulated_s"]
    assert main.run(["sim", "ctl", "--at", cells.url_of("a"), "step", "seconds=2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["simulated_s"] == pytest.approx(then + 2)
    assert control.do("clock")["simulated_s"] == pytest.approx(then + 2)


def test_sim_ctl_takes_for_a_text_what_is_one(cells, at, capsys):
    """A snapshot may be called 007, and a number may select a request by its text."""
    control, _ = at("a")

    def ctl(*words):
        return main.run(["sim", "ctl", "--at", cells.url_of("a"), *words])

    for name in ("007", "true", "inf"):
        assert ctl("snapshot", f"name={name}") == 0
        assert ctl("restore", f"name={name}") == 0
    assert ctl("add_fault", "action=drop_reply", "match=2003", "times=2") == 0
    assert {fault["match"] for fault in control.do("faults")["pending"]} == {"2003"}
    for no_number in ("inf", "1_0"):
        assert ctl("step", f"seconds={no_number}") == 2
        assert "step needs seconds, a number from 0" in capsys.readouterr().err


def test_what_happened_and_what_waits_is_bounded(at, monkeypatch):
    monkeypatch.setattr(wire, "_MOST_PENDING", 12)
    monkeypatch.setattr(wire, "MOST_FIRED", 3)
    monkeypatch.setattr(counted, "MOST_FIRED", 3)
    control, simulator = at("a")
    assert len(control.do("add_fault", action="drop_reply", times=10)["pending"]) == 10
    with pytest.raises(ConfigError, match="10 faults wait already") as told:
        control.do("add_fault", action="delay", times=3)
    assert "clear_faults" in told.value.remedy
    for _ in range(10):
        assert simulator.faults.take("$GetStatus")
    told = control.do("faults")
    assert [fault["on_exchange"] for fault in told["fired"]] == [7, 8, 9]
    assert (told["times_fired"], told["pending"]) == (10, [])
    assert len(simulator.faults.fired) <= 6
    control.do("reset")
    nothing = {"fired": [], "times_fired": 0, "pending": [], "waiting": 0}
    assert control.do("faults") == nothing
    monkeypatch.setattr(wire, "_MOST_TOLD", 2)
    told = control.do("add_fault", action="drop_reply", times=3)
    assert (len(told["pending"]), told["waiting"]) == (2, 3)


def test_time_is_paused_stepped_and_hastened(at):
    control, simulator = at("a")
    control.do("set_clock", factor=0)
    then = control.do("clock")["simulated_s"]
    assert control.do("clock") == {"simulated_s": then, "factor": 0}
    assert control.do("step", seconds=2.5)["simulated_s"] == pytest.approx(then + 2.5)
    assert simulator.now_ns == pytest.approx((then + 2.5) * 1e9)
    control.do("set_clock", factor=1000)
    assert control.do("clock")["factor"] == 1000


@pytest.mark.parametrize(
    ("name", "act", "given", "words"),
    [
        ("a", "dance", {}, "Choose one of"),
        ("a", "truth", {"tool": 1}, "takes no 'tool'"),
        ("a", "press_estop", {"hard": True}, "takes no 'hard'"),
        ("a", "raise_error", {}, "raise_error needs number"),
        ("a", "raise_error", {"number": "4002"}, "whole number from 0 to 9999"),
        ("a", "set_input", {"number": 9000}, "no input 9000. Inputs are 0 to 511"),
        ("b", "set_input", {"number": 32}, "no input 32. Inputs are 0 to 31"),
        ("a", "add_fault", {"action": "delay", "times": 0}, "whole number from 1 to 1000"),
        ("a", "set_input", {"number": 1, "on": 7}, "true or false"),
        ("a", "freeze", {}, "cannot do 'freeze'"),
        ("a", "restore", {"name": "nothing"}, "no snapshot"),
        ("a", "step", {"seconds": -1}, "from 0 to"),
        ("a", "set_clock", {"factor": 1e9}, "from 0 to 1000"),
        ("a", "add_fault", {"action": "explode"}, "knows no action 'explode'."),
        ("a", "add_fault", {"action": 3}, "add_fault needs action, a text"),
        ("a", "add_fault", {"action": "delay", "every": 1, "times": 2}, "either times or every"),
        ("a", "add_fault", {"action": "modbus_exception"}, "cannot happen on epson"),
        ("c", "add_fault", {"action": "modbus_exception", "code": 9}, "fault 1, code: must be"),
        ("a", "add_fault", {"action": "echo"}, "cannot happen on epson"),
        ("a", "add_fault", {"action": "garble_reply", "bit": 9}, "fault 1, bit"),
        ("b", "add_fault", {"action": "lose_login"}, "cannot happen on softmotion"),
        ("b", "teach", {}, "cannot do 'teach'"),
        ("c", "look", {}, "cannot do 'look'"),
        ("a", "set_world", {"gravity": 1}, "no parameter 'gravity'"),
        ("a", "push", {"text": "two\nlines"}, "printable"),
    ],
)
def test_what_is_unknown_or_wrong_is_refused_by_name(at, name, act, given, words):
    control, simulator = at(name)
    with pytest.raises(ConfigError, match=words):
        control.do(act, **given)
    assert not simulator.faults.pending
    assert simulator.counters()["exchanges"] == 0


def test_a_client_in_any_language_is_told_what_went_wrong(cells):
    base = urlsplit(cells.url).path
    post = f"{base}/cells/a"
    assert raw(cells, "GET", f"{base}/cells/a/truth")[0] == 200
    assert raw(cells, "POST", f"{post}/truth")[0] == 200
    assert raw(cells, "GET", f"{base}/cells/a/log?after=0")[0] == 200
    assert raw(cells, "GET", f"{base}/cells/a/press_estop")[0] == 405
    assert raw(cells, "POST", f"{post}/dance")[0] == 404
    assert raw(cells, "POST", f"{base}/cells/z/truth")[0] == 404
    assert raw(cells, "GET", "/the-token/v2")[0] == 404
    assert raw(cells, "POST", f"{post}/truth", b"[]")[0] == 400
    assert raw(cells, "POST", f"{post}/truth", b"{")[0] == 400
    assert raw(cells, "POST", f"{post}/truth", b'{"a":' * 5000)[0] == 400
    assert raw(cells, "POST", f"{post}/look", b'{"tool": 1e999}')[0] == 400
    too_long = b" " * (LONGEST_REQUEST + 1)
    assert raw(cells, "POST", f"{post}/truth", too_long)[0] == 413
    assert raw(cells, "POST", f"{post}/truth", headers=[("Content-Length", "x")])[0] == 411
    status, told = raw(cells, "POST", f"{post}/step", b'{"seconds": 1, "seconds": 2}')
    assert (status, told["error"]) == (400, "'seconds' is given twice.")
    asked_twice = "after=1&after=2"
    for query in (asked_twice, "after=", "nothing=", "&".join(f"a{n}=1" for n in range(60))):
        assert raw(cells, "GET", f"{base}/cells/a/log?{query}")[0] == 400
    for path in ("", "/openapi.json", "/cells/a"):
        assert raw(cells, "GET", f"{base}{path}?nothing=1")[0] == 400
    status, told = raw(cells, "POST", f"{post}/step?seconds=5", b'{"seconds": 1}')
    assert (status, "not behind the question mark" in told["error"]) == (400, True)
    assert raw(cells, "GET", f"{base}/cells/a/truth", b"{}")[0] == 400
    status, told = raw(cells, "POST", f"{post}/raise_error")
    assert (status, told["ok"], told["schema"]) == (400, False, "robolink/control/1")
    assert told["error"]
    assert told["remedy"]


@pytest.mark.parametrize(
    ("name", "act", "given", "words"),
    [
        ("a", "jog_onto_pin", {}, "Teach mode only"),
        ("a", "teach_point", {"number": 1, "u_deg": 0}, "Teach mode only"),
        ("b", "move_axis", {"number": 0, "target": 1e6}, "Axis 0 does not move"),
        ("d", "reset", {}, "keeps its state in a file"),
        ("d", "set_clock", {"factor": 2}, "only while somebody waits"),
    ],
)
def test_what_cannot_be_done_now_is_told_apart_from_what_was_asked_wrongly(
    cells, tmp_path, name, act, given, words
):
    if name == "d":
        kept = EpsonSimulator(state_path=tmp_path / "epson.json")
        cells.cells["d"] = ControlledCell(kept, ManualClock())
    address = f"{urlsplit(cells.url).path}/cells/{name}/{act}"
    status, told = raw(cells, "POST", address, json.dumps(given).encode())
    cells.cells.pop("d", None)
    assert (status, told["ok"]) == (409, False)
    assert words in told["error"]
    assert told["remedy"]


def test_what_a_controller_cannot_keep_is_refused_and_noted(tmp_path):
    """Its host then ends it; until that the act gives the reason."""
    kept = tmp_path / "kept/plc.json"
    simulator = SoftMotionSimulator(state_path=kept)
    cell = ControlledCell(simulator, ManualClock())
    with ControlServer({"a": cell}) as server, ControlClient(server.url_of("a")) as control:
        control.do("restart")
        assert simulator.failure is None
        kept.unlink()
        kept.parent.rmdir()
        kept.parent.write_text("in its place")
        for _ in "ab":
            with pytest.raises(ConfigError, match="cannot save its state") as told:
                control.do("restart")
            assert "a folder that can be written" in told.value.remedy
            assert str(simulator.failure) == str(told.value)
        path = f"{urlsplit(server.url).path}/cells/a/restart"
        assert raw(server, "POST", path)[0] == 409


def exchanged(cells, sent, *, then_closes=False):
    """Send raw bytes; return the head and the document of the answer."""
    parts = urlsplit(cells.url)
    with socket.create_connection((parts.hostname, parts.port), 10) as connection:
        connection.sendall(sent)
        if then_closes:
            connection.shutdown(socket.SHUT_WR)
        reply = http.client.HTTPResponse(connection, method=sent.partition(b" ")[0].decode())
        reply.begin()
        return reply, json.loads(reply.read() or b"null")


@pytest.mark.parametrize("body", [b"", b'{"number": 3}'])
def test_a_request_that_ends_early_is_not_carried_out(cells, at, body):
    _, simulator = at("a")
    act = "set_input" if body else "press_estop"
    head = f"POST {urlsplit(cells.url).path}/cells/a/{act} HTTP/1.1\r\nContent-Length: 90\r\n\r\n"
    reply, told = exchanged(cells, head.encode() + body, then_closes=True)
    assert (reply.status, told["ok"]) == (400, False)
    assert not simulator.condition.estop_pressed
    assert not simulator.machine.inputs.get(3)


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        (b"hello\r\n\r\n", 400),
        (b"GET / HTTP/3.0\r\n\r\n", 505),
        (b"PUT /the-token/v1 HTTP/1.1\r\n\r\n", 405),
        (b"HEAD /the-token/v1 HTTP/1.1\r\n\r\n", 405),
        (b"GET /" + b"a" * 70_000 + b" HTTP/1.1\r\n\r\n", 414),
        (b"GET / HTTP/1.1\r\n" + b"A: 1\r\n" * 200 + b"\r\n", 431),
        (b"POST / HTTP/1.1\r\nContent-Length: 2\r\nContent-Length: 9\r\n\r\n{}", 411),
        (b"GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 411),
    ],
)
def test_what_is_no_request_is_answered_in_json_too(cells, sent, status):
    reply, told = exchanged(cells, sent)
    assert reply.status == status
    assert reply.headers["Content-Type"] == "application/json"
    assert reply.headers["Connection"] == "close"
    if b"HEAD" not in sent:
        assert (told["schema"], told["ok"]) == ("robolink/control/1", False)
        assert told["error"]
        assert told["remedy"]


def test_half_an_address_is_answered_too(cells):
    reply, told = exchanged(cells, b"GET http://[x/ HTTP/1.1\r\n\r\n")
    assert (reply.status, told["ok"]) == (400, False)


def test_an_old_client_is_answered_and_cut_off(cells):
    path = f"{urlsplit(cells.url).path}/cells/a/counters"
    reply, told = exchanged(cells, f"GET {path} HTTP/1.0\r\n\r\n".encode())
    assert (reply.status, told["ok"], reply.headers["Connection"]) == (200, True, "close")


def test_a_simulator_that_fails_says_so(cells, at, monkeypatch):
    _, simulator = at("a")
    monkeypatch.setattr(simulator, "counters", lambda: 1 / 0)
    status, told = raw(cells, "GET", f"{urlsplit(cells.url).path}/cells/a/counters")
    assert (status, told["ok"]) == (500, False)
    assert "ZeroDivisionError" in told["error"]


DOCUMENT = openapi()


OTHERS = ("HEAD", "PUT", "DELETE", "PATCH", "OPTIONS")
"""Methods that no address has: each is tried at a part of them."""


@pytest.mark.parametrize("method", ["GET", "POST", *OTHERS])
def test_each_address_answers_the_methods_of_the_document_and_names_them_to_others(cells, method):
    base = urlsplit(cells.url).path
    kinds = {name: ACTS[cell.simulator.kind] for name, cell in cells.cells.items()}
    addresses = [("/", ""), ("/cells/{cell}", "/cells/a")]
    addresses += [
        (f"/cells/{{cell}}/{act}", f"/cells/{name}/{act}")
        for name, acts in kinds.items()
        for act in acts
    ]
    turn = slice(OTHERS.index(method), None, len(OTHERS)) if method in OTHERS else slice(None)
    for path, address in addresses[turn]:
        operations = DOCUMENT["paths"][path].keys() - {"parameters"}
        allowed = ", ".join(it for it in ("GET", "POST") if it.lower() in operations)
        if method in allowed:
            continue
        # The method is refused before the body is read.
        sent = (
            f"{method} {base}{address} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n[]"
        )
        reply, told = exchanged(cells, sent.encode())
        assert (reply.status, reply.headers["Allow"]) == (405, allowed), (method, address)
        if method != "HEAD":
            assert (told["ok"], allowed in told["remedy"]) == (False, True)
    refused, _ = exchanged(cells, f"{method} /x/v1 HTTP/1.1\r\n\r\n".encode())
    assert (refused.status, refused.headers["Allow"]) == (403, None)


@pytest.mark.parametrize(
    ("head", "status"),
    [
        ([], 200),
        ([("Host", "127.0.0.1:{port}")], 200),
        ([("Host", "LOCALHOST")], 200),
        ([("Host", "cell.localhost.:80")], 200),
        ([("Host", "[::1]:{port}")], 200),
        ([("Host", "192.0.2.7:9000")], 200),  # forwarded to this port
        ([("Host", "evil.example:{port}")], 403),
        ([("Host", "127.0.0.1.evil.example")], 403),
        ([("Host", "localhost.evil.example")], 403),
        ([("Host", "evillocalhost")], 403),
        ([("Host", "")], 403),
        ([("Host", "[x")], 403),
        ([("Host", "localhost"), ("Host", "evil.example")], 403),
        ([("Host", "127.0.0.1:{port}"), ("Origin", "http://evil.example")], 403),
        ([("Host", "127.0.0.1:{port}"), ("Origin", "http://127.0.0.1:{port}")], 403),
        ([("Host", "127.0.0.1:{port}"), ("Origin", "null")], 403),
    ],
)
def test_what_a_page_in_a_browser_asks_is_refused(cells, at, head, status):
    _, simulator = at("a")
    base, port = urlsplit(cells.url).path, urlsplit(cells.url).port
    lines = [f"{name}: {value.format(port=port)}" for name, value in head]
    for asked in ("POST {}/cells/a/set_input", "GET {}/cells/a/truth"):
        body = '{"number": 3}' if "POST" in asked else ""
        first = [f"{asked.format(base)} HTTP/1.1", *lines, f"Content-Length: {len(body)}"]
        reply, told = exchanged(cells, "\r\n".join([*first, "", body]).encode())
        assert (reply.status, told["ok"]) == (status, status == 200)
        assert "Access-Control-Allow-Origin" not in reply.headers
    assert simulator.machine.inputs.get(3) is (status == 200)


def test_a_port_for_other_machines_is_called_as_they_like_but_not_by_a_page():
    cell = ControlledCell(EpsonSimulator(seed=3), ManualClock())
    with ControlServer({"a": cell}, ("127.0.0.1", 0), allow_remote=True) as server:
        head = f"GET {urlsplit(server.url).path} HTTP/1.1\r\nHost: simulators.plant.example\r\n"
        assert exchanged(server, f"{head}\r\n".encode())[0].status == 200
        assert exchanged(server, f"{head}Origin: null\r\n\r\n".encode())[0].status == 403


@pytest.mark.parametrize(
    ("name", "act", "given"),
    [
        ("a", "set_input", {"number": 9000}),
        ("b", "set_input", {"number": 32}),
        ("a", "restore", {"name": "nothing"}),
        ("a", "add_fault", {"action": "echo"}),
        ("b", "set_world", {"contact_input": 32}),
    ],
)
def test_what_this_machine_has_not_is_told_apart_from_what_is_none(cells, name, act, given):
    address = f"{urlsplit(cells.url).path}/cells/{name}/{act}"
    assert raw(cells, "POST", address, json.dumps(given).encode())[0] == 409


@pytest.mark.parametrize(
    ("given", "status"),
    [
        ({"camera_mirrored": 1, "board_held": False}, 200),
        ({"contact_input": None, "person_bias_frame": "tool"}, 200),
        ({"contact_input": "none"}, 200),
        ({"contact_input": "9"}, 400),
        ({"lean_deg": "1"}, 400),
        ({"lean_deg": True}, 400),
        ({"camera_still_share": 2}, 400),
        ({"camera_um_per_px_x": 0}, 400),
        ({"person_bias_frame": False}, 400),
    ],
)
def test_a_parameter_of_the_world_is_what_the_document_says(cells, at, given, status):
    at("a")
    address = f"{urlsplit(cells.url).path}/cells/a/set_world"
    assert raw(cells, "POST", address, json.dumps(given).encode())[0] == status


def test_who_does_not_show_the_token_learns_nothing(cells):
    answers = {
        json.dumps(raw(cells, method, path))
        for method in ("GET", "POST")
        for path in ("/", "/v1", "/x/v1", "/the-toke/v1/cells/a/truth", "/the-token2/v1")
    }
    assert len(answers) == 1
    assert json.loads(answers.pop())[0] == 403
    with (
        pytest.raises(ConfigError, match="token"),
        ControlClient(cells.url_of("a").replace("the-token", "another")) as client,
    ):
        client.do("truth")
    assert "the-token" not in repr(cells.answered("GET", "/", b""))


def counters_of(url):
    try:
        with ControlClient(url) as client:
            return client.do("counters")
    except (ConnectError, TransportBrokenError):  # told that there is no room, or cut off at once
        return None


def test_silent_clients_are_bounded_and_keep_nobody_out_for_good(cells, monkeypatch):
    monkeypatch.setattr(http_port, "MOST_CLIENTS", 4)
    monkeypatch.setattr(http_port, "MOST_TURNED_AWAY", 2)
    parts = urlsplit(cells.url)
    silent = [socket.create_connection((parts.hostname, parts.port), 5) for _ in range(3)]
    with ExitStack() as stack:
        for connection in silent:
            stack.callback(connection.close)
        with ControlClient(cells.url_of("a")) as client:
            assert client.do("counters")
            with (
                ControlClient(cells.url_of("a")) as one_too_many,
                pytest.raises(ConnectError, match="4 clients are connected") as told,
            ):
                one_too_many.do("counters")
            assert told.value.remedy
            too_silent = [socket.create_connection((parts.hostname, parts.port), 5) for _ in "ab"]
            with socket.create_connection((parts.hostname, parts.port), 5) as far_too_many:
                assert far_too_many.recv(1) == b""
            for connection in too_silent:
                connection.close()
    # The server notices a moment later that they have left.
    ends = time.monotonic() + 20.0
    while counters_of(cells.url_of("a")) is None:
        assert time.monotonic() < ends
    assert MOST_CLIENTS >= 16


def connected(cells):
    parts = urlsplit(cells.url)
    return socket.create_connection((parts.hostname, parts.port), 10)


def test_where_all_places_are_taken_who_has_asked_nothing_makes_way(cells, monkeypatch):
    monkeypatch.setattr(http_port, "MOST_CLIENTS", 4)
    monkeypatch.setattr(http_port, "_BEFORE_ASKING_S", 0.0)
    with ExitStack() as stack:
        asked = stack.enter_context(ControlClient(cells.url_of("a")))
        assert asked.do("counters")
        kept = asked._connection.sock
        slow = [stack.enter_context(connected(cells)) for _ in range(8)]
        for connection in slow[-3:]:
            connection.sendall(b"GET /the-token/v1")
        for name in "abc":
            assert stack.enter_context(ControlClient(cells.url_of(name))).do("counters")
        for connection in slow:
            assert connection.recv(1) == b""
        assert asked.do("counters")
        assert asked._connection.sock is kept
        with (
            ControlClient(cells.url_of("a")) as one_too_many,
            pytest.raises(ConnectError, match="4 clients are connected"),
        ):
            one_too_many.do("counters")


def test_who_sends_a_byte_now_and_then_is_cut_off_like_who_sends_none(cells, monkeypatch):
    monkeypatch.setattr(http_port._Served, "timeout", 0.3)
    with connected(cells) as slow:
        slow.settimeout(0.05)
        for _ in range(400):
            try:
                slow.sendall(b"G")
                assert slow.recv(1) == b""
            except TimeoutError:
                continue  # not yet
            except OSError:
                pass  # cut off in the middle of a byte sequence
            break
        else:
            pytest.fail("it has a place for good")


def test_who_takes_no_answer_is_cut_off(cells, monkeypatch):
    monkeypatch.setattr(http_port._Served, "timeout", 0.3)
    simulator = cells.cells["a"].simulator
    for number in range(2000):
        simulator.log.add(number, ">", "x" * 500)
    with connected(cells) as deaf:
        path = f"{urlsplit(cells.url).path}/cells/a/log"
        deaf.sendall(f"GET {path} HTTP/1.1\r\n\r\n".encode() * 20)
        assert counters_of(cells.url_of("a"))
        ends = time.monotonic() + 30.0
        while cells._http._served:
            assert time.monotonic() < ends
            time.sleep(0.01)
    simulator.reset()


def test_who_shows_another_token_keeps_no_place(cells):
    reply, told = exchanged(cells, b"GET /another/v1 HTTP/1.1\r\n\r\n")
    assert (reply.status, reply.headers["Connection"], told["ok"]) == (403, "close", False)


def test_it_listens_where_only_this_machine_reaches_it():
    cell = {"a": ControlledCell(EpsonSimulator())}
    with pytest.raises(ConfigError, match="other machines"):
        ControlServer(cell, ("0.0.0.0", 0))
    with ControlServer(cell) as control, pytest.raises(ConnectError, match="cannot listen"):
        ControlServer(cell, ("127.0.0.1", urlsplit(control.url).port or 0))
    with ControlClient(control.url_of("a")) as gone, pytest.raises(ConnectError, match="No sim"):
        gone.do("truth")
    with pytest.raises(ConfigError, match="not the control URL") as told:
        ControlClient("https://secret@127.0.0.1:1/v1")
    assert "secret" not in str(told.value)


def test_a_simulator_that_ends_cuts_those_who_ask():
    control = ControlServer({"a": ControlledCell(EpsonSimulator())})
    with control, ControlClient(control.url_of("a")) as client:
        client.do("truth")
        control.close()
        with pytest.raises(TransportBrokenError, match="is gone"):
            client.do("truth")


def test_the_openapi_document_of_the_wheel_is_the_one_of_the_acts(cells):
    held = json.loads(files("robolink_simulators.control").joinpath("openapi.json").read_bytes())
    # The maker is: python -m tools.openapi > .../control/openapi.json
    assert held == json.loads(json.dumps(openapi()))
    status, served = raw(cells, "GET", f"{urlsplit(cells.url).path}/openapi.json")
    assert (status, served) == (200, held)
    acts = {name for kind in ACTS.values() for name in kind}
    assert acts <= {path.rpartition("/")[2] for path in held["paths"]}
    assert all(act.says.endswith(".") for kind in ACTS.values() for act in kind.values())


def test_the_page_names_every_act():
    page = (ROOT / "docs/control-api.md").read_text()
    acts = {name for kind in ACTS.values() for name in kind}
    assert {name for name in acts if f"`{name}`" not in page} == set()


@pytest.mark.skipif(os.name != "posix", reason="Windows holds no port for a connection that ended")
def test_a_port_can_be_had_again_although_somebody_was_connected_at_the_end():
    cell = ControlledCell(EpsonSimulator(seed=3), ManualClock())
    with ControlServer({"a": cell}) as control:
        parts = urlsplit(control.url)
        client = ControlClient(control.url_of("a"))
        client.do("clock")
    client.close()
    with ControlServer({"a": cell}, (parts.hostname or "", parts.port or 0)) as control:
        assert urlsplit(control.url).port == parts.port
