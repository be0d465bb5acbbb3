"""canopen's client, with our data sheet only, reads the simulated node."""

import os
import socket
import struct
import threading

import canopen
import pytest
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import PROBE, VERSION, Bits, decode_response, decode_slot
from tests._patience import PATIENCE_S

DATA_SHEET = "companions/codesys/robolink_mailbox.eds"
NODE = 5
OPERATIONAL = 5
PRODUCER_HEARTBEAT, RESPONSE, MAILBOX, TOOL_SLOT = 0x1017, 0x2101, 0x2102, 0x2200


def free_port():
    """Return a UDP port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(params=["virtual", "udp_multicast"])
def place(request, tmp_path):
    """A bus in this process, or one between processes."""
    if request.param == "virtual":
        return CanPlace("virtual", tmp_path.name, node=NODE)
    group = f"239.74.164.{os.getpid() % 200 + 20}"
    return CanPlace("udp_multicast", group, port=free_port(), node=NODE)


@pytest.fixture
def simulator(place):
    """The PLC behind the node."""
    simulator = SoftMotionSimulator()
    with serve_canopen(simulator, place):
        yield simulator


@pytest.fixture
def node(simulator, place):
    """canopen's own picture of that node."""
    with canopen.Network() as network:
        network.NOTIFIER_CYCLE = 0.02
        network.connect(**place.settings())
        node = network.add_node(canopen.RemoteNode(NODE, DATA_SHEET))
        node.sdo.RESPONSE_TIMEOUT = PATIENCE_S  # else 0.3 s, which a busy computer takes
        yield node


def seen(register, wanted):
    """Wait until a value that canopen reports to all callbacks is as wanted."""
    came = threading.Event()

    def keep(told):
        if wanted(told):
            came.set()

    register(keep)
    return came.wait(PATIENCE_S)


def response(node):
    """Have a copy made and return its contents."""
    node.sdo[MAILBOX]["snapshot"].raw = 1
    return decode_response(struct.unpack("<112H", node.sdo[RESPONSE].raw))


def test_the_heartbeat_time_is_that_of_the_data_sheet_and_heartbeats_come(node):
    assert node.sdo[PRODUCER_HEARTBEAT].raw == 100
    node.nmt.state = "OPERATIONAL"
    assert seen(node.nmt.add_heartbeat_callback, lambda state: state == OPERATIONAL)


def test_the_mailbox_describes_itself(node, simulator):
    named = node.sdo[MAILBOX]
    assert [named[n].raw for n in (1, 2)] == [VERSION, simulator.plc.memory.boot_id]
    assert named["capabilities"].raw == response(node).capabilities
    assert named[4].raw == PROBE == 12.3456


def test_a_copy_of_the_response_is_whole_and_stands_still_until_the_next(node, simulator):
    first = response(node)
    assert (first.probe, first.boot_id) == (PROBE, simulator.plc.memory.boot_id)
    copy = node.sdo[RESPONSE].raw
    simulator.panel.press_estop()
    assert node.sdo[RESPONSE].raw == copy
    assert first.bits ^ response(node).bits == Bits.POWERED


def test_the_first_slot_is_what_the_plc_holds(node, simulator):
    words = struct.unpack("<36H", node.sdo[TOOL_SLOT][1].raw)
    assert decode_slot(words) == simulator.plc.memory.slot(1)


def test_the_first_pdo_is_mapped_as_the_data_sheet_says(node):
    node.tpdo.read()
    node.nmt.state = "OPERATIONAL"
    head = node.tpdo[1]
    beats = []

    def beats_move(head):
        beats.append(head["head.heartbeat"].raw)
        return beats[-1] != beats[0]

    assert seen(head.add_callback, beats_move)
    now = response(node)
    assert head["head.group_state"].raw == now.group_state
    assert head["head.ack"].raw == now.ack_head
