"""The tool table of a PLC with a map keeps the contract of every tool table, on each link."""

import socket
from pathlib import Path
from typing import Any

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.plc import (
    PlcSimulator,
    serve_plc,
    serve_plc_line,
    serve_plc_opcua,
)
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import ANY, ToolOffset
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.errors import (
    ConfigError,
    ConnectError,
    OutcomeUnknownError,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    TransportTimeoutError,
)
from robolink.methods import PointsSource
from robolink.model import Verdict
from robolink.register_maps import CommitKind, SymbolMap, load_map, load_plc_map
from robolink.runner import Question
from robolink.testing import confirm_whole_map
from robolink.transaction import recover

MAPS = Path("examples/plc-maps")
BY_SYMBOL = ("by-symbol", "opcua")
"""Left to ``make soak`` but for one lost answer: ``test_symbol_map_faults`` writes and disturbs it
over OPC UA, ``test_symbol_map_writing`` its driver, and a calibration lies above the link.
"""
# The first map has coils, discrete inputs and both kinds of registers, so it runs on both links.
CELLS = (
    ("commit-bit", "modbus-tcp"),
    ("level-handshake", "modbus-tcp"),
    ("no-handshake", "modbus-tcp"),
    ("commit-bit", "modbus-rtu"),
    BY_SYMBOL,
)
SERVERS: dict[str, Any] = {
    "modbus-tcp": serve_plc,
    "modbus-rtu": serve_plc_line,
    "opcua": serve_plc_opcua,
}
NEW = ToolOffset(11.25, -3.125)


class Served:
    """A simulated PLC on a link; its time passes ten times as fast as real time."""

    def __init__(self, name, wire="modbus-tcp"):
        self.path = MAPS / f"{name}.toml"
        self.map = load_plc_map(self.path)
        self.plc = PlcSimulator(self.map, seed=7)
        self.serve = SERVERS[wire]
        self.patience_s = 0.3 if wire == "modbus-tcp" else 0.8  # a line must be silent first
        if isinstance(self.map, SymbolMap):
            (node,) = self.map.slots[1].nodes
            self.place, self.whole = node, True
            self.first_write = f"write {node.partition('.Application.')[2]}"
        else:
            slot = self.map.slots[1]
            self.place, self.whole = f"(address {slot.span.start})", slot.contiguous
            self.first_write = f"fc16 {slot.span.start}"

    def __enter__(self):
        self.host = self.serve(self.plc, self.path, clock=ScaledClock(10.0))
        self.url = self.host.url
        with self.connect() as controller:
            confirm_whole_map(controller)
        return self

    def __exit__(self, *_details):
        self.host.close()

    def connect(self, **options):
        return robolink.connect(self.url, **options)


def cases(*more, kept=()):
    """Return each cell, with each of ``more`` if there is any; over OPC UA only those ``kept``."""

    def case(cell, *one):
        marks = pytest.mark.soak if cell == BY_SYMBOL and not set(one) & set(kept) else ()
        return pytest.param(cell, *one, marks=marks, id="-".join((*cell, *(a.name for a in one))))

    return [case(cell, *one) for cell in CELLS for one in (zip(more) if more else [()])]


@pytest.fixture(params=cases())
def served(request):
    with Served(*request.param) as served:
        yield served


@pytest.fixture
def controller(served):
    with served.connect() as controller:
        yield controller


def test_the_map_says_which_tools_there_are_and_the_flange_reads_as_zero(controller):
    assert list(controller.tools.indices()) == [1, 2]
    assert list(controller.tools.read_all()) == [1, 2]
    assert controller.tools.read(0) == ToolOffset()


def test_a_write_is_read_back_and_receipted(served, controller):
    before = controller.tools.read(1)
    receipt = controller.tools.write(1, NEW, expected=before)
    assert (receipt.before, receipt.requested, receipt.skipped) == (before, NEW, False)
    assert receipt.read_back == NEW
    assert served.plc.program.in_force[1]["x"] == NEW.x_mm


def test_a_preview_is_what_is_sent_first_and_sends_nothing(served, controller):
    (first, *_) = controller.tools.preview_write(1, NEW)
    assert served.place in first
    assert served.plc.writes == []
    controller.tools.write(1, NEW, expected=ANY)
    assert controller.tools.preview_write(1, NEW) == ()


@pytest.mark.fault("F43")
def test_a_write_that_is_acknowledged_and_not_done_is_noticed(served, controller):
    served.plc.faults.add(Fault(FaultAction.IGNORE_WRITE, match=served.first_write))
    with pytest.raises(ReadBackError, match="reads back as"):
        controller.tools.write(1, NEW, expected=ANY)


@pytest.mark.parametrize(
    ("served", "action"),
    cases(
        *(FaultAction.DROP_REPLY, FaultAction.DISCONNECT, FaultAction.DISCONNECT_BEFORE),
        kept=(FaultAction.DISCONNECT_BEFORE,),
    ),
    indirect=["served"],
)
def test_a_lost_answer_is_not_sent_again_and_settled_by_the_next_connection(served, action):
    first = served.first_write
    with served.connect(timeout_s=served.patience_s) as controller:
        before = controller.tools.read(1)
        served.plc.faults.add(Fault(action, match=first))
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, NEW, expected=before)
    assert served.plc.writes.count(first) <= 1
    with served.connect() as controller:
        recovery = recover(controller)
        (finding,) = (*recovery.settled, *recovery.left)
        if action is FaultAction.DISCONNECT_BEFORE:
            # Old values in the registers do not prove that the PLC uses them, so it is asked.
            asked = served.map.commit.kind is not CommitKind.NONE
            assert finding.verdict is (Verdict.NOT_FINISHED if asked else Verdict.NOT_APPLIED)
            assert controller.tools.read(1) == before
        elif served.whole:
            assert controller.tools.read(1) == NEW
            assert served.plc.program.in_force[1]["x"] == NEW.x_mm
        else:
            assert finding.verdict is Verdict.CONFLICT


@pytest.mark.parametrize("served", [CELLS[0]], ids="-".join, indirect=True)
def test_a_calibration_takes_its_poses_from_a_person(served):
    class Person:
        def tell(self, text):
            pass

        def ask(self, question, kind):
            assert kind is Question.YES_NO

        def poll(self, wait_s):
            return "y"

    with served.connect() as controller:
        stored = controller.tools.read(1)
        poses = (
            robolink.Pose(300 - stored.x_mm - 0.2, 100 - stored.y_mm, -20, 0),
            robolink.Pose(300 + stored.x_mm + 0.2, 100 + stored.y_mm, -20, 180),
        )
        plan = ChangePlan((ToolPlan(1, PointsSource(lambda: poses)),), ask_before_write=False)
        report = NozzleChange(controller, plan, operator=Person()).run(write=True)
        assert controller.tools.read(1).x_mm == pytest.approx(stored.x_mm + 0.2, abs=0.001)
        assert controller.tools.read(1).z_mm == stored.z_mm
    assert len(report.tools) == 1


def test_a_wrong_unit_a_missing_map_and_a_closed_port_are_clear_errors():
    with Served("commit-bit") as served:
        with pytest.raises(TransportTimeoutError, match="unit 9"):
            robolink.connect(served.url.replace("unit=1", "unit=9"))
        bare = served.url.partition("?")[0]
        with pytest.raises(ConfigError, match="map is missing"):
            robolink.connect(bare)
        with pytest.raises(ConfigError, match="cannot be read"):
            robolink.connect(f"{bare}?map=missing.toml")
        with pytest.raises(ConfigError, match="no option 'units'"):
            robolink.connect(f"{served.url}&units=1")
        told = []
        robolink.connect(served.url, trace=lambda *passage: told.append(passage[1])).close()
        assert {"sent", "received"} == set(told)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.raises(ConnectError):
        robolink.connect(f"plc+modbus-tcp://127.0.0.1:{port}?map={MAPS / 'commit-bit.toml'}")


def test_on_a_serial_line_a_unit_that_is_not_there_is_silent_and_a_closed_line_is_told():
    with Served("commit-bit", "modbus-rtu") as served:
        other = served.url.replace("?", "?unit=9&")
        with pytest.raises(ConnectError, match="Unit 9 does not answer"):
            robolink.connect(other, timeout_s=0.2)
        with served.connect() as controller:
            assert controller.tools.read(1) is not None
    with pytest.raises(ConnectError):
        robolink.connect(served.url)


@pytest.mark.fault("F70")
@pytest.mark.fault("F34")
def test_a_map_of_another_machine_is_found_out_when_connecting(tmp_path):
    text = (MAPS / "commit-bit.toml").read_text(encoding="utf-8")
    shifted = tmp_path / "shifted.toml"
    shifted.write_text(text.replace("address = 20\n", "address = 21\n"), encoding="utf-8")
    turned = tmp_path / "turned.toml"
    turned.write_text(text.replace('"low_first"', '"high_first"'), encoding="utf-8")
    with Served("commit-bit") as served:
        url = served.url.partition("&map=")[0]
        with pytest.raises(RemoteProtocolError, match="off by"):
            robolink.connect(f"{url}&map={shifted}")
        with pytest.raises(RemoteProtocolError, match='word_order = "low_first"'):
            robolink.connect(f"{url}&map={turned}")
    assert served.plc.writes == []


FAR_APART = """
schema = "robolink/plc-map/1"
name = "far apart"
[numbers]
type = "REAL"
word_order = "low_first"
[[tools]]
number = 1
x = { address = 100 }
y = { address = 170 }
z = { address = 198 }
[commit]
kind = "level"
request = { table = "coil", address = 10 }
acknowledge = { table = "discrete", address = 10 }
"""


def test_a_server_that_gives_few_registers_is_read_in_parts(tmp_path):
    path = tmp_path / "far.toml"
    path.write_text(FAR_APART)
    plc = PlcSimulator(load_map(path), seed=7, most_registers=50)
    with serve_plc(plc, path, clock=ScaledClock(10.0)) as host:
        with (
            robolink.connect(host.url) as controller,
            pytest.raises(RejectedError, match="exception 3") as caught,
        ):
            controller.tools.read(1)
        assert "most_registers=50" in str(caught.value.remedy)
        with robolink.connect(f"{host.url}&most_registers=50") as controller:
            confirm_whole_map(controller)
            controller.tools.write(1, ToolOffset(1.5, 2.5, 3.5), expected=ANY)
            assert controller.tools.read(1) == ToolOffset(1.5, 2.5, 3.5)


def test_a_length_beyond_what_the_map_allows_is_told_by_the_key_that_decides(tmp_path):
    path = tmp_path / "far.toml"
    path.write_text(FAR_APART.replace("[numbers]", "largest_mm = 50\n[numbers]"))
    wide = tmp_path / "wide.toml"
    wide.write_text(FAR_APART)
    plc = PlcSimulator(load_map(wide), seed=7)
    with serve_plc(plc, path, clock=ScaledClock(10.0)) as host:
        with robolink.connect(host.url.replace("far.toml", "wide.toml")) as controller:
            confirm_whole_map(controller)
            controller.tools.write(1, ToolOffset(1.5, 2.5, 120), expected=ANY)
        with (
            robolink.connect(host.url) as controller,
            pytest.raises(RemoteProtocolError, match=r"120 mm; the map allows 50 mm .*largest_mm"),
        ):
            controller.tools.read(1)


def test_a_mailbox_says_by_number_how_many_registers_it_needs_at_once():
    with (
        serve_modbus_tcp(SoftMotionSimulator()) as host,
        pytest.raises(ConfigError, match="112 registers") as caught,
    ):
        robolink.connect(f"{host.url}{'&' if '?' in host.url else '?'}most_registers=61")
    assert "64 in a write" in str(caught.value.remedy)
