"""The answer time of a simulator: on each link, for each answer, in real and in simulated time."""

import socket
import struct
import time
from contextlib import ExitStack, closing
from dataclasses import replace

import canopen
import pytest
from robolink_cli.commands.simulate.cells_file import read_cells
from robolink_cli.commands.simulate.sim import sim
from robolink_simulators.cell.clock import ManualClock, ScaledClock, SteeredClock
from robolink_simulators.device.hosted import LONGEST_ANSWER_MS
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.fieldbus.canopen_objects import object_dictionary
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import MEDIA, served
from robolink_simulators.testkit.operator import written_map, written_symbol_map

import robolink
from robolink.errors import ConfigError, TransportBrokenError
from robolink.model import MotionProfile, WorkBox
from robolink.register_maps import load_plc_map
from robolink.timing import NS_PER_S
from robolink.transport import parse_url
from tests.contract.test_sim_hosting import raw

pytestmark = pytest.mark.simulator_only

ANSWER_MS = 20
ANSWER_S = ANSWER_MS / 1000
READS = 3
LINKS = [
    pytest.param(kind, medium, marks=pytest.mark.soak if medium == "opcua-secured" else ())
    for kind, media in MEDIA.items()
    for medium in media
]
CARRIED_S = {("softmotion", "sim"): 0.001}
"""What an exchange with the mailbox takes in the process besides (``exchange_us``)."""


def made(kind, folder, answer_ms=ANSWER_MS, medium=""):
    """Return a simulator with an answer time, and the file of its map."""
    if kind == "epson":
        return EpsonSimulator(seed=3, answer_ms=answer_ms), None
    if kind == "softmotion":
        return SoftMotionSimulator(seed=3, answer_ms=answer_ms), None
    path = (written_symbol_map if medium.startswith("opcua") else written_map)(folder)
    return PlcSimulator(load_plc_map(path), seed=3, answer_ms=answer_ms), path


def measured_s(controller):
    """Return how long each exchange of a few reads takes, by the controller's clock."""
    began_ns, asked = controller.clock.now_ns(), controller.exchanges
    for _ in range(READS):
        controller.tools.read(1)
    return (controller.clock.now_ns() - began_ns) / NS_PER_S / (controller.exchanges - asked)


@pytest.mark.parametrize(("kind", "medium"), LINKS, ids=lambda value: value)
def test_each_exchange_takes_the_answer_time_on_every_link(kind, medium, tmp_path):
    simulator, path = made(kind, tmp_path, medium=medium)
    with (
        served(simulator, medium, map_file=path) as url,
        robolink.connect(url) as controller,
    ):
        took_s = measured_s(controller)
    carried_s = CARRIED_S.get((kind, medium), 0.0)
    if medium == "sim":
        assert took_s == pytest.approx(ANSWER_S + carried_s)
    else:
        assert took_s >= ANSWER_S  # above it comes what this computer needs


@pytest.mark.parametrize("kind", MEDIA)
def test_without_one_an_exchange_in_the_process_takes_no_time(kind, tmp_path):
    simulator, path = made(kind, tmp_path, answer_ms=0)
    with served(simulator, map_file=path) as url, robolink.connect(url) as controller:
        assert measured_s(controller) == pytest.approx(CARRIED_S.get((kind, "sim"), 0.0))


@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_the_url_of_a_simulator_in_the_process_gives_it(kind):
    name = f"answers-{kind}"
    with robolink.connect(f"{kind}+sim://{name}?answer_ms=50&seed=3") as controller:
        assert measured_s(controller) == pytest.approx(0.05 + CARRIED_S.get((kind, "sim"), 0.0))


@pytest.mark.parametrize("kind", ["epson", "softmotion"])
@pytest.mark.parametrize("text", ["fast", "-1", "nan", "inf", "10001"])
def test_a_url_with_an_answer_time_that_is_none_is_refused(kind, text):
    with pytest.raises(ConfigError):
        robolink.connect(f"{kind}+sim://never-{kind}?answer_ms={text}")


@pytest.mark.parametrize("kind", MEDIA)
@pytest.mark.parametrize("answer_ms", [-0.1, float("nan"), LONGEST_ANSWER_MS + 1])
def test_no_simulator_is_made_with_an_answer_time_that_is_none(kind, answer_ms, tmp_path):
    with pytest.raises(ConfigError):
        made(kind, tmp_path, answer_ms)


def test_a_movement_begins_on_arrival_and_its_answer_leaves_after_its_end():
    ended_s = {}
    for answer_ms in (0, ANSWER_MS):
        simulator = EpsonSimulator(seed=3, answer_ms=answer_ms)
        link = simulator.connect(0)
        link.receive(b"$Login\r\n", 0)
        simulator.advance(NS_PER_S)
        assert link.outgoing() == b"#Login,0\r\n"
        link.receive(b'$Execute,"Move Here +Z(-5)"\r\n', NS_PER_S)
        assert simulator.machine.moving
        while not (answer := link.outgoing()):
            simulator.advance(simulator.next_change() or 0)
        assert answer.startswith(b"#Execute,0")
        ended_s[answer_ms] = simulator.now_ns / NS_PER_S
    assert ended_s[ANSWER_MS] - ended_s[0] == pytest.approx(ANSWER_S)


def test_a_stop_acts_on_arrival_and_is_answered_after_the_same_time():
    simulator = EpsonSimulator(seed=3, answer_ms=ANSWER_MS)
    with served(simulator) as url, robolink.connect(url) as controller:
        controller.motors(True)
        group, clock = controller.groups[0], controller.clock
        here = group.pose()
        box = WorkBox.around(here, xy_mm=50, below_mm=50, above_mm=50)
        group.move_to(replace(here, z_mm=here.z_mm - 40), MotionProfile(speed_mm_s=10), box=box)
        clock.sleep(0.5)
        began_ns, asked = clock.now_ns(), controller.exchanges
        controller.stop()
        took_s = (clock.now_ns() - began_ns) / NS_PER_S
        (stopped_ns,) = (
            at_ns for at_ns, way, text in simulator.log if (way, text) == (">", "$Abort")
        )
        assert not simulator.machine.moving
        assert stopped_ns - began_ns < ANSWER_S * NS_PER_S
        assert took_s >= (controller.exchanges - asked) * ANSWER_S > 0


def test_a_refusal_is_answered_after_that_time_too():
    simulator = EpsonSimulator(seed=3, answer_ms=ANSWER_MS)
    link = simulator.connect(0)
    for request in (b"$Nothing\r\n", b"$Login\r\n", b'$Execute,"Nonsense"\r\n'):
        now_ns = simulator.now_ns
        link.receive(request, now_ns)
        assert link.outgoing() == b""
        (at_ns,) = (simulator.next_change(),)
        assert at_ns == now_ns + ANSWER_MS * 1_000_000
        simulator.advance(at_ns - 1)
        assert link.outgoing() == b""
        simulator.advance(at_ns)
        assert link.outgoing()


@pytest.mark.parametrize(
    "asked",
    [
        pytest.param(struct.pack(">BHH", 4, 0xFFFF, 10), id="illegal address"),
        pytest.param(struct.pack(">BHH", 99, 0, 1), id="illegal function"),
        pytest.param(struct.pack(">BHH", 3, 5000, 2), id="beside the mailbox"),
    ],
)
def test_what_the_mailbox_does_not_serve_is_answered_after_that_time_too(asked):
    simulator = SoftMotionSimulator(answer_ms=ANSWER_MS)
    with served(simulator, "modbus-tcp") as url:
        link = parse_url(url)
        with closing(socket.create_connection((link.host, link.port), timeout=10)) as client:
            began_s = time.monotonic()
            client.sendall(struct.pack(">HHHB", 1, 0, 1 + len(asked), 1) + asked)
            assert client.recv(256)
            assert time.monotonic() - began_s >= ANSWER_S


def test_an_object_of_a_can_node_that_never_changes_is_read_after_that_time_too():
    simulator = SoftMotionSimulator(answer_ms=ANSWER_MS)
    network = canopen.Network()
    with served(simulator, "can") as url, ExitStack() as stack:
        link = parse_url(url)
        network.connect(interface="virtual", channel=link.host)
        stack.callback(network.disconnect)
        node = network.add_node(int(link.options["node"]), object_dictionary(5))
        for index, subindex in ((0x2102, 1), (0x2110, 1), (0x1018, 1)):
            began_s = time.monotonic()
            assert node.sdo.upload(index, subindex)
            assert time.monotonic() - began_s >= ANSWER_S


def test_a_request_that_a_plc_with_a_map_gets_twice_is_answered_twice_after_that_time(tmp_path):
    simulator, _ = made("plc", tmp_path)
    simulator.faults.add(Fault(FaultAction.DUPLICATE_REQUEST, seconds=0.1))
    link = simulator.connect(0)
    link.receive(bytes.fromhex("000100000006010300640002"), 0)
    for at_ms in (ANSWER_MS, 100 + ANSWER_MS):
        simulator.advance(at_ms * 1_000_000 - 1)
        assert link.outgoing() == b""
        simulator.advance(at_ms * 1_000_000)
        assert link.outgoing()


def test_a_cable_that_is_pulled_before_the_answer_leaves_brings_none():
    simulator, clock = SoftMotionSimulator(seed=3, answer_ms=ANSWER_MS), ManualClock()
    link = InProcessMailboxLink("a PLC", simulator, clock, timeout_s=3.0)
    assert link.read_head()
    at_ns = clock.now_ns() + ANSWER_MS * 1_000_000 // 2
    simulator._mishaps.plan_at(at_ns, simulator.panel.cut_link)
    with pytest.raises(TransportBrokenError):
        link.read_head()


def test_a_planned_delay_is_added_to_it():
    late = Fault(FaultAction.DELAY, match="GetStatus", seconds=0.5)
    simulator = EpsonSimulator(seed=3, faults=[late], answer_ms=ANSWER_MS)
    link = simulator.connect(0)
    link.receive(b"$Login\r\n", 0)
    simulator.advance(NS_PER_S)
    assert link.outgoing() == b"#Login,0\r\n"
    link.receive(b"$GetStatus\r\n", NS_PER_S)
    assert simulator.next_change() == NS_PER_S + (500 + ANSWER_MS) * 1_000_000


def test_answers_leave_in_the_order_of_their_requests():
    simulator = EpsonSimulator(seed=3, answer_ms=ANSWER_MS)
    with serve_tcp(simulator) as host, raw(host.url) as client:
        began_s = time.monotonic()
        client.socket.sendall(b'$GetStatus\r\n$Execute,"Print 6 * 7"\r\n$Nothing\r\n')
        answers = [client.answer() for _ in range(3)]
        took_s = time.monotonic() - began_s
    assert [answer.partition(",")[0] for answer in answers] == [
        "#GetStatus",
        "#Execute",
        "!Nothing",
    ]
    assert took_s >= ANSWER_S


def test_twenty_times_as_fast_it_takes_a_twentieth_of_real_time():
    simulator = EpsonSimulator(seed=3, answer_ms=2000)
    with serve_tcp(simulator, clock=ScaledClock(20)) as host, raw(host.url) as client:
        began_s = time.monotonic()
        client.ask("$GetStatus")
        assert 0.1 <= time.monotonic() - began_s < 1.9


@pytest.mark.parametrize(
    ("kind", "medium"), [link for link in LINKS if link.values[1] != "sim"], ids=lambda value: value
)
def test_where_time_stands_still_an_exchange_lets_it_pass(kind, medium, tmp_path):
    simulator, path = made(kind, tmp_path, answer_ms=2000, medium=medium)
    clock = SteeredClock(0)
    with (
        served(simulator, medium, map_file=path, clock=clock) as url,
        robolink.connect(url, timeout_s=1.5) as controller,
    ):
        began_ns, asked = clock.now_ns(), simulator.exchanges
        began_s = time.monotonic()
        controller.tools.read(1)
        assert time.monotonic() - began_s < 1.0
        passed_s = (clock.now_ns() - began_ns) / NS_PER_S
        assert passed_s >= 2.0 * (simulator.exchanges - asked) > 0


def test_a_line_that_is_turned_on_hears_of_it_after_that_time():
    options = EpsonOptions(rs232_eot_answer="ack")
    simulator = EpsonSimulator(seed=3, options=options, answer_ms=ANSWER_MS)
    link = simulator.connect_serial(0)
    link.receive(b"\x04", 0)
    assert link.outgoing() == b""
    simulator.advance(ANSWER_MS * 1_000_000)
    assert link.outgoing() == b"\x06"


@pytest.mark.parametrize("kind", MEDIA)
def test_every_command_that_serves_a_simulator_takes_it(kind, tmp_path):
    keys = {"epson": "", "softmotion": "", "plc": f'map = "{written_map(tmp_path)}"\n'}[kind]
    path = tmp_path / "cells.toml"
    text = 'schema = "robolink/sim-cells/1"\n[cells.a]\nkind = "{}"\nanswer_ms = {}\n{}'
    path.write_text(text.format(kind, ANSWER_MS, keys))
    (cell,) = read_cells(path, sim.commands)
    assert cell.kind.make(**cell.given).answer_s == ANSWER_S
    path.write_text(text.format(kind, LONGEST_ANSWER_MS + 1, keys))
    with pytest.raises(ConfigError):
        read_cells(path, sim.commands)
