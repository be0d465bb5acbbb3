"""Every simulated controller can be reset, and returned to a snapshot, while it is served."""

import json
import socket
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.plc import PlcSimulator, serve_plc
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.errors import ConfigError, RobolinkError
from robolink.register_maps import load_map
from robolink.testing import confirm_whole_map

MAP = Path(__file__).parents[2] / "examples/plc-maps/commit-bit.toml"


class Served:
    """A simulator of one kind on a port."""

    def __init__(self, kind, stack, folder):
        clock = ScaledClock(20)
        self.kind = kind
        self.simulator: Any
        host: Any
        if kind == "epson":
            self.simulator = EpsonSimulator(seed=4)
            host = serve_tcp(self.simulator, clock=clock)
        elif kind == "softmotion":
            self.simulator = SoftMotionSimulator(seed=4)
            host = serve_modbus_tcp(self.simulator, clock=clock)
        else:
            numbered = folder / "numbered.toml"
            place = '[device_id]\ntable = "input"\naddress = 50\n'
            numbered.write_text(f"{MAP.read_text()}\n{place}")
            self.simulator = PlcSimulator(load_map(numbered), seed=4)
            host = serve_plc(self.simulator, numbered, clock=clock)
        self.url = stack.enter_context(host).url

    def one_fault(self):
        if self.kind == "softmotion":
            return PlcFault(PlcFaultAction.DROP_REPLY)
        return Fault(FaultAction.DROP_REPLY)


@pytest.fixture(params=["epson", "softmotion", "plc"])
def served(request, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with ExitStack() as stack:
        yield Served(request.param, stack, tmp_path)


def write(served, z_mm):
    with robolink.connect(served.url) as controller:
        if served.kind == "plc":
            confirm_whole_map(controller)
        tool = 2
        controller.tools.write(tool, ToolOffset(1, 2, z_mm), expected=robolink.ANY)
        return controller.outcomes.identity


def test_it_is_made_anew_as_another_controller(served):
    at_first = served.simulator.truth()
    who = write(served, -31.0)
    assert served.simulator.truth() != at_first
    assert served.simulator.counters()["tool_writes"]
    with robolink.connect(served.url) as left_open:
        served.simulator.faults.add(served.one_fault())
        served.simulator.reset()
        with pytest.raises(RobolinkError):
            left_open.status()
    assert not served.simulator.faults.pending
    assert served.simulator.truth() == at_first
    assert write(served, -32.0) != who


def test_who_asked_before_it_was_made_anew_is_not_answered_by_the_new_one(served):
    """A request is under way during the reset: its connection is closed."""
    host, _, port = served.url.partition("://")[2].partition("?")[0].rpartition(":")
    asked = b"$Login,\r\n" if served.kind == "epson" else bytes.fromhex("000100000006010400140002")
    with socket.create_connection((host, int(port)), 10) as client:
        client.sendall(asked)
        assert client.recv(100)
        with served.simulator.lock:
            client.sendall(asked)
            time.sleep(0.05)  # it waits for the controller by then, or it is cut off all the same
            served.simulator.reset()
        with suppress(ConnectionResetError):
            assert client.recv(100) == b""
    assert served.simulator.counters()["exchanges"] == 0
    write(served, -31.0)


def test_it_goes_back_to_a_moment_as_the_same_controller(served):
    who = write(served, -31.0)
    if served.kind != "plc":
        with robolink.connect(served.url) as controller:
            controller.tools.select(2)
    moment, then = served.simulator.kept_moment(), served.simulator.truth()
    if served.kind != "plc":
        served.simulator.world.change_nozzle()
        place = served.simulator.world.robot.flange()
        served.simulator.world.robot.turn(20.0)
        assert served.simulator.world.robot.flange() != place
    write(served, -32.0)
    served.simulator.faults.add(served.one_fault())
    served.simulator.go_back(moment)
    assert served.simulator.truth() == then
    if served.kind == "softmotion":
        assert served.simulator.plc.group.tool.frame.shift_mm == pytest.approx((1.0, 2.0, -31.0))
    assert not served.simulator.faults.pending
    if served.kind != "plc":
        there = served.simulator.world.robot.flange()
        assert there.coordinates() == pytest.approx(place.coordinates(), abs=1e-9)
    assert write(served, -31.0) == who
    # Later changes have not entered the snapshot.
    served.simulator.go_back(moment)
    assert served.simulator.truth() == then


def test_the_truth_has_the_same_shape_for_every_kind(served):
    truth = json.loads(json.dumps(served.simulator.truth()))
    assert truth["schema"] == "robolink/sim-truth/1"
    assert truth["kind"] == served.kind
    assert truth["selected_tool"] == 1
    components = {"x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg"}
    assert {frozenset(offset) for offset in truth["stored"].values()} == {frozenset(components)}
    names = {"exchanges", "moves_started", "tool_writes", "starts", "touches"}
    assert set(served.simulator.counters()) == names
    assert served.simulator.counters() == {**dict.fromkeys(names, 0), "starts": 1}
    assert list(served.simulator.motions()) == []


def test_writes_and_starts_are_counted_alike(served):
    write(served, -31.0)
    if served.kind != "plc":
        with robolink.connect(served.url) as controller:
            controller.tools.clear(2, expected=robolink.ANY)  # including a write
    served.simulator.restart()
    counted = served.simulator.counters()
    writes = 1 if served.kind == "plc" else 2
    assert (counted["tool_writes"], counted["starts"]) == (writes, 2)
    served.simulator.reset()
    counted = served.simulator.counters()
    assert (counted["exchanges"], counted["tool_writes"], counted["starts"]) == (0, 0, 1)


def test_what_is_counted_goes_on_when_it_goes_back(served):
    """The difference of two counts covers everything between them, whatever else was done."""
    write(served, -31.0)
    moment = served.simulator.kept_moment()
    write(served, -32.0)
    served.simulator.restart()
    counted, lines = served.simulator.counters(), served.simulator.log.added
    served.simulator.go_back(moment)
    assert served.simulator.counters() == counted
    assert served.simulator.log.added == lines
    write(served, -33.0)
    served.simulator.restart()
    later = served.simulator.counters()
    assert later["exchanges"] > counted["exchanges"]
    del later["exchanges"]
    starts, writes = counted["starts"] + 1, counted["tool_writes"] + 1
    assert later == {"moves_started": 0, "tool_writes": writes, "starts": starts, "touches": 0}


@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_motions_are_numbered_on_when_it_goes_back(kind):
    simulator = EpsonSimulator(seed=4) if kind == "epson" else SoftMotionSimulator(seed=4)

    def move():
        simulator._motion_log().add(simulator.now_ns)
        return simulator.counters()["moves_started"], [it.number for it in simulator.motions()]

    moment = simulator.kept_moment()
    assert [move(), move()] == [(1, [1]), (2, [1, 2])]
    simulator.go_back(moment)
    assert list(simulator.motions()) == []
    assert [move(), move()] == [(3, [3]), (4, [3, 4])]
    assert [it.number for it in simulator.motions(3)] == [4]
    simulator.reset()
    assert move() == (1, [1])


@pytest.mark.parametrize("kind", [EpsonSimulator, SoftMotionSimulator])
def test_what_a_file_tells_of_earlier_is_not_counted(kind, tmp_path):
    for _ in "ab":
        simulator = kind(state_path=tmp_path / "cell.json")
        names = ("exchanges", "moves_started", "tool_writes", "touches")
        assert simulator.counters() == {**dict.fromkeys(names, 0), "starts": 1}
        with simulator.acting():
            if isinstance(simulator, EpsonSimulator):
                simulator.machine.tools.set(3, ToolOffset(1, 2, 3))
                simulator._flash.save_changes()
            else:
                simulator.plc.memory.define(3, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), "T")
        assert simulator.counters()["tool_writes"] == 1


@pytest.mark.parametrize("kind", [EpsonSimulator, SoftMotionSimulator])
def test_a_state_that_cannot_be_kept_is_refused_before_anybody_is_served(kind, tmp_path):
    kind(state_path=tmp_path / "not" / "yet" / "there" / "cell.json")
    assert (tmp_path / "not/yet/there/cell.json").exists()
    (tmp_path / "a-file").touch()
    with pytest.raises(ConfigError, match="cannot save its state"):
        kind(state_path=tmp_path / "a-file" / "cell.json")


def test_what_keeps_its_state_in_a_file_is_not_made_anew(tmp_path):
    for simulator in (
        EpsonSimulator(state_path=tmp_path / "epson.json"),
        SoftMotionSimulator(state_path=tmp_path / "plc.json"),
    ):
        before = simulator.truth()
        with pytest.raises(ConfigError, match="keeps its state"):
            simulator.reset()
        with pytest.raises(ConfigError, match="keeps its state"):
            simulator.go_back(simulator.kept_moment())
        assert simulator.truth() == before


def test_a_moment_fits_the_same_kind_of_machine_only():
    with pytest.raises(ConfigError, match="softmotion Kin_Scara3_Z cannot be put into epson"):
        EpsonSimulator().go_back(SoftMotionSimulator().kept_moment())
