"""Whatever goes wrong on the way to an OPC UA server, no tool is taken for what it is not."""

import time
from itertools import product
from pathlib import Path

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.plc import PlcSimulator, serve_plc_opcua

import robolink
from robolink import ToolOffset
from robolink.errors import (
    ConfigError,
    LoginRefusedError,
    OutcomeUnknownError,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
)
from robolink.model import Secret
from robolink.register_maps import load_symbol_map
from robolink.testing import confirm_whole_map
from robolink.transaction import recover

ARRAYS = Path("examples/plc-maps/by-symbol.toml")
NEW = ToolOffset(11.25, -3.125)

STRUCTURES = """
schema = "robolink/plc-map/1"
name = "structures"
cycle_ms = 20
[numbers]
root = "ns=4;s=|var|PLC.Application.GVL."
type = "REAL"
[[tools]]
number = 1
node = "stTool1"
x = { field = "rX" }
y = { field = "diY", unit = "um", type = "int32" }
[commit]
kind = "none"
settle_s = 0.05
"""

SEPARATE = """
schema = "robolink/plc-map/1"
name = "separate nodes"
cycle_ms = 20
[numbers]
root = "ns=4;s=|var|PLC.Application.GVL."
type = "LREAL"
[[tools]]
number = 1
x = { node = "rTool1X" }
y = { node = "rTool1Y" }
[commit]
kind = "level"
request = { node = "xRequest" }
acknowledge = { node = "xDone" }
error = { node = "xError" }
[change_counter]
node = "udiChanges"
"""


class Served:
    """A simulated PLC with a map of symbols, for a module."""

    def __init__(self, path):
        self.plc = PlcSimulator(load_symbol_map(path), seed=7)
        self.host = serve_plc_opcua(self.plc, path, clock=ScaledClock(10.0))
        self.url = self.host.url

    def connect(self, timeout_s=5.0):
        controller = robolink.connect(self.url, timeout_s=timeout_s)
        confirm_whole_map(controller)
        return controller

    def plan(self, action, **fields):
        self.plc.faults.add(Fault(FaultAction[action.upper()], **fields))

    def in_force(self):
        held = self.plc.program.in_force[1]
        return ToolOffset(*(held.get(name, 0.0) for name in "xyzuvw"))


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    made = {}

    def one(text):
        if text not in made:
            path = ARRAYS
            if text is not ARRAYS:
                path = tmp_path_factory.mktemp("map") / "machine.toml"
                path.write_text(text, encoding="utf-8")
            made[text] = Served(path)
        served = made[text]
        served.plc.faults.forget()
        served.plc.faults.on_fired = None
        return served

    yield one
    for served in made.values():
        served.host.close()


KINDS = pytest.mark.parametrize(
    "text", [ARRAYS, STRUCTURES, SEPARATE], ids=["arrays", "structures", "separate"]
)


def old_of(text):
    return {"x": -4.5, "y": 2.5} | ({"z": 1.0, "u": 30.0} if text is ARRAYS else {})


@KINDS
def test_a_tool_is_written_and_read_back(server, text):
    served = server(text)
    served.plc.program.set_tool(1, old_of(text))
    with served.connect() as controller:
        before = controller.tools.read(1)
        assert controller.tools.write(1, NEW, expected=before).read_back == NEW
    assert served.in_force() == NEW


@pytest.mark.usefixtures("own_certificate")
def test_signed_and_encrypted_a_user_writes():
    plc, users = PlcSimulator(load_symbol_map(ARRAYS), seed=7), {"fitter": Secret("correct-horse")}
    with serve_plc_opcua(plc, ARRAYS, clock=ScaledClock(10.0), users=users) as host:
        url = host.secured_url
        with robolink.connect(url, password="correct-horse") as controller:
            confirm_whole_map(controller)
            before = controller.tools.read(1)
            assert controller.tools.write(1, NEW, expected=before).read_back == NEW
        with pytest.raises(LoginRefusedError):
            robolink.connect(url, password="correct-house")
    assert plc.program.in_force[1]["x"] == NEW.x_mm


def test_without_security_and_without_a_word_for_it_a_tool_is_only_read(server):
    served = server(ARRAYS)
    served.plc.program.set_tool(1, old_of(ARRAYS))
    with served.connect() as controller:
        before = controller.tools.read(1)
    writes = len(served.plc.writes)
    with robolink.connect(served.url.replace("&write_unsecured=yes", "")) as controller:
        assert controller.tools.read(1) == before
        with pytest.raises(ConfigError, match="for reading only"):
            controller.tools.write(1, NEW, expected=before)
        assert not controller.outcomes.open_markers()
    assert len(served.plc.writes) == writes


def test_a_map_on_the_wrong_link_is_refused_by_name(server):
    url = server(ARRAYS).url
    registers = Path("examples/plc-maps/commit-bit.toml").absolute()
    with pytest.raises(ConfigError, match="names registers, not symbols"):
        robolink.connect(url.replace(str(ARRAYS.absolute()), str(registers)))
    with pytest.raises(ConfigError, match="names symbols, not registers"):
        robolink.connect(f"plc+modbus-tcp://127.0.0.1:1?map={ARRAYS.absolute()}")


@pytest.mark.parametrize(
    ("text", "action", "positions", "bit"),
    [
        pytest.param(text, action, positions, bit, id=f"{name}-{bit}", marks=marks)
        for name, text, action, positions, in_turn in (
            ("arrays", ARRAYS, "tear_array", (1, 3), 0),
            ("structures", STRUCTURES, "tear_array", (1,), 1),
            ("separate", SEPARATE, "tear_nodes", (1, 2), 0),
        )
        for bit, marks in ((in_turn, ()), (1 - in_turn, pytest.mark.soak))
    ],
)
def test_a_torn_answer_is_no_value(server, text, action, positions, bit):
    """The program changes the tool between the two moments of the first or the second answer."""
    served = server(text)
    tool = "Needle" if text is ARRAYS else "Tool1"
    program = served.plc.program
    old, new = old_of(text), {name: value + 1 for name, value in old_of(text).items()}
    with served.connect() as controller:
        for times, (position, at) in enumerate(product(positions, (0, 1)), start=1):
            program.set_tool(1, old)
            served.plc.faults.on_fired = lambda _fault, _request: setattr(
                served.plc, "on_reply", change
            )

            def change(_number, _shown):
                program.set_tool(1, new)
                served.plc.on_reply = None

            served.plan(action, on_exchange=at, match=tool, position=position, bit=bit)
            found = controller.tools.read(1)
            assert found.x_mm in (old["x"], new["x"])
            assert found.y_mm - found.x_mm == pytest.approx(old["y"] - old["x"])
            assert served.plc.faults.times_fired == times


@pytest.mark.parametrize("action", ["wrong_type", "short_array"])
def test_an_array_that_changed_its_type_is_told(server, action):
    served = server(ARRAYS)
    with served.connect() as controller:
        served.plan(action, match="read GVL_Tools.udiCycle, GVL_Tools.aNeedleA")
        with pytest.raises(RemoteProtocolError):
            controller.tools.read(1)


@pytest.mark.parametrize(
    ("text", "action"),
    [(ARRAYS, "wrong_type"), (STRUCTURES, "read_only"), (SEPARATE, "out_of_service")],
    ids=["arrays", "structures", "separate"],
)
def test_a_write_that_the_server_refuses_leaves_the_old_value(server, text, action):
    served = server(text)
    served.plc.program.set_tool(1, old_of(text))
    with served.connect() as controller:
        before = controller.tools.read(1)
        served.plan(action, match="write")
        with pytest.raises((RejectedError, OutcomeUnknownError)) as told:
            controller.tools.write(1, NEW, expected=before)
        unknown = isinstance(told.value, OutcomeUnknownError)
        assert bool(controller.outcomes.open_markers()) is unknown
    with served.connect() as controller:
        recover(controller)
        assert controller.tools.read(1) == before
    assert served.in_force() == before


def test_a_tear_of_what_cannot_be_torn_has_not_happened(server):
    """Neither inside single values, nor what stands still, nor a write, nor a refusal."""
    served = server(SEPARATE)
    served.plc.program.set_tool(1, old_of(SEPARATE))
    with served.connect() as controller:
        before = controller.tools.read(1)
        for action in ("tear_array", "tear_nodes", "tear_write"):
            served.plan(action)
            controller.tools.write(1, NEW, expected=before)
            assert (served.plc.faults.fired, served.plc.faults.times_fired) == ([], 0)
            assert [fault.action.name.lower() for fault in served.plc.faults.pending] == [action]
            served.plc.faults.forget()
            served.plc.program.set_tool(1, old_of(SEPARATE))
        served.plan("out_of_service")
        served.plan("tear_nodes")
        with pytest.raises(RejectedError):
            controller.tools.read(1)
        assert [fault.action.name for fault in served.plc.faults.fired] == ["OUT_OF_SERVICE"]


@pytest.mark.parametrize("bit", [0, 1])
@pytest.mark.parametrize("text", [ARRAYS, STRUCTURES], ids=["handshake", "none"])
def test_a_torn_write_reaches_the_machine_only_without_a_handshake(server, text, bit):
    served = server(text)
    old = old_of(text)
    served.plc.program.set_tool(1, old)
    worked_with = []
    take_over = served.plc.program._take_over

    def noted():
        take_over()
        held = served.plc.program.in_force[1]
        worked_with.append((held["x"], held["y"]))

    served.plc.program._take_over = noted
    try:
        with served.connect() as controller:
            before = controller.tools.read(1)
            served.plan("tear_write", match="write", position=1, bit=bit)
            assert controller.tools.write(1, NEW, expected=before).read_back == NEW
    finally:
        del served.plc.program._take_over
    assert [fault.action.name for fault in served.plc.faults.fired] == ["TEAR_WRITE"]
    half = (old["x"], NEW.y_mm) if bit else (NEW.x_mm, old["y"])
    whole = (NEW.x_mm, NEW.y_mm)
    assert worked_with == ([half, whole] if text is STRUCTURES else [whole])


ACTIONS = (
    *("tear_nodes", "tear_write", "wrong_type", "short_array", "read_only", "out_of_service"),
    *("lose_session", "drop_channel", "disconnect", "disconnect_before", "reset", "drop_reply"),
    *("ignore_write", "restart"),
)

EMPTY = {
    *((STRUCTURES, "tear_nodes"), (SEPARATE, "tear_nodes")),
    *((SEPARATE, "tear_write"), (SEPARATE, "short_array")),
}
"""What cannot happen: nothing but the client changes these nodes, or they are single values."""
NAMES = {ARRAYS: "arrays", STRUCTURES: "structures", SEPARATE: "separate"}


PATIENCE_S = 2.0


def connected(served, timeout_s):
    """Connect to a PLC that may be starting at this moment."""
    for _ in range(20):
        try:
            return served.connect(timeout_s)
        except TransportError:
            time.sleep(0.05)
    return served.connect(timeout_s)


def meet(served, text, action, at, controller, *, timeout_s=PATIENCE_S):
    """Let one fault meet one request of a write, and check what is said against what is so.

    Return the next connection, and whether the fault was met.
    """
    served.plc.faults.forget()
    served.plc.program.set_tool(1, old_of(text))
    told: RobolinkError | None = None
    with controller:
        before = controller.tools.read(1)
        served.plan(action, on_exchange=at, position=1)
        try:
            controller.tools.write(1, NEW, expected=before)
        except RobolinkError as error:
            told = error
        met = bool(served.plc.faults.fired)
        served.plc.faults.forget()
    now = served.in_force()
    if told is None:
        assert now == NEW
    elif not isinstance(told, OutcomeUnknownError | ReadBackError):
        assert now == before, told
    controller = connected(served, timeout_s)
    recovery = recover(controller)
    assert served.in_force() in (before, NEW)
    if not recovery.left:
        assert not controller.outcomes.open_markers()
        assert controller.tools.read(1) == served.in_force()
    for marker in controller.outcomes.open_markers():
        controller.outcomes.clear(marker.operation)
    return controller, met


TOLD_ELSEWHERE = ("wrong_type", "read_only", "out_of_service", "drop_channel", "ignore_write")
"""Faults of the one write that ``test_opcua_faults_told.py`` has too, or a test above."""


def test_one_fault_in_the_middle_of_a_write(server):
    served = server(ARRAYS)
    controller = served.connect(PATIENCE_S)
    for number, action in enumerate(ACTIONS):
        if action in TOLD_ELSEWHERE:
            continue
        controller, met = meet(served, ARRAYS, action, 8 + number % 7, controller)
        assert met, action
    controller.close()


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("text", "action"),
    [
        pytest.param(text, action, id=f"{name}-{action}")
        for text, name in NAMES.items()
        for action in ACTIONS
        if (text, action) not in EMPTY
    ],
)
def test_one_fault_at_any_request_of_a_write(server, text, action):
    served, at, met = server(text), 0, True
    timeout_s = 1.0 if action == "drop_reply" else 5.0
    controller = served.connect(timeout_s)
    while met:
        controller, met = meet(served, text, action, at, controller, timeout_s=timeout_s)
        at += met
    controller.close()
    assert at >= 8
