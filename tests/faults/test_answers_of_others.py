"""A late, old, joined, doubled or unsolicited answer never answers a question.

Each over a real link: TCP sockets, pseudo terminals, a virtual CAN bus. The requested values differ
from each other, so an answer in the wrong place shows.
"""

import os
import select
from contextlib import contextmanager

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.controllers.epson.tools import EpsonToolTable
from robolink.errors import RemoteProtocolError, RobolinkError, TransportError
from robolink.protocols import spel
from tests.contract._softmotion_cell import served
from tests.faults._bending_relay import BendingRelay
from tests.unit._scripted_modbus import rtu, words

CUT = PlcFaultAction.TRUNCATE_REPLY
SPLIT = PlcFaultAction.SPLIT_REPLY
TWICE = PlcFaultAction.DUPLICATE_REPLY
TIMEOUT_S = 0.8
PATIENCE_S = 6.0
"""For exchanges that must not time out on a busy computer."""
SLOTS = {2: ToolOffset(1, 2, 3, 4), 3: ToolOffset(-5, -6, -7, -8), 4: ToolOffset(9, 10, 11, 12)}


@contextmanager
def relayed(**bends):
    """An EPSON controller behind a relay: its simulator, its URL, the relay."""
    simulator = EpsonSimulator(seed=5)
    for tool, value in SLOTS.items():
        simulator.machine.tools.set(tool, value)
    with serve_tcp(simulator) as host:
        port = int(host.url.rpartition(":")[2].partition("?")[0])
        with BendingRelay(port, **bends) as relay:
            yield simulator, host.url.replace(str(port), str(relay.port)), relay


def asked(controller, tools):
    """Read tools; no value is another tool's. Return the number of answers."""
    answered = 0
    for tool in tools:
        try:
            value = controller.tools.read(tool)
        except RobolinkError:
            continue
        assert controller.tools.same(value, SLOTS[tool]), f"tool {tool} was answered with {value}"
        answered += 1
    return answered


@pytest.mark.parametrize(
    ("link", "late_s"),
    [
        pytest.param("modbus-tcp", 0.9, marks=pytest.mark.fault("F01")),
        pytest.param("can-virtual", 0.9, marks=[pytest.mark.fault("F01"), pytest.mark.soak]),
        pytest.param("modbus-rtu", 0.82, marks=[pytest.mark.fault("F02"), pytest.mark.soak]),
        pytest.param("modbus-rtu", 0.95, marks=pytest.mark.fault("F02")),
    ],
)
def test_f01_f02_a_late_answer_of_a_plc_answers_no_other_question(link, late_s):
    with served(link, SoftMotionSimulator(seed=7)) as cell:
        with cell.connect() as controller:
            for slot, value in SLOTS.items():
                controller.tools.write(slot, value, expected=None)
        with cell.connect(timeout_s=TIMEOUT_S) as controller:
            late = PlcFault(PlcFaultAction.DELAY, match="read_slot 2", seconds=late_s)
            cell.simulator.faults.add(late)
            asked(controller, [2, 3, 4, 3, 2])
            assert cell.simulator.faults.fired == [late]
        with cell.connect() as controller:
            assert asked(controller, SLOTS) == len(SLOTS)


@pytest.mark.parametrize(
    ("action", "link"),
    [
        pytest.param(CUT, "modbus-rtu", marks=pytest.mark.fault("F04")),
        pytest.param(CUT, "modbus-tcp", marks=[pytest.mark.fault("F04"), pytest.mark.soak]),
        pytest.param(SPLIT, "modbus-tcp", marks=pytest.mark.fault("F05")),
        pytest.param(SPLIT, "modbus-rtu", marks=[pytest.mark.fault("F05"), pytest.mark.soak]),
        pytest.param(TWICE, "modbus-rtu", marks=pytest.mark.fault("F09")),
        pytest.param(TWICE, "modbus-tcp", marks=[pytest.mark.fault("F09"), pytest.mark.soak]),
    ],
    ids=lambda value: value if isinstance(value, str) else value.name.lower(),
)
def test_f04_f05_f09_an_answer_of_a_plc_that_is_cut_split_or_doubled(link, action):
    with served(link, SoftMotionSimulator(seed=7)) as cell:
        with cell.connect() as controller:
            for slot, value in SLOTS.items():
                controller.tools.write(slot, value, expected=None)
        split = action is SPLIT
        for at in (1, 40):
            cell.simulator.faults.add(PlcFault(action, match="read_slot 3", position=at))
            with cell.connect(timeout_s=PATIENCE_S if split else TIMEOUT_S) as controller:
                answered = asked(controller, [2, 3, 4, 2])
                assert answered == 4 or not split
            assert cell.simulator.faults.pending == ()
        with cell.connect() as controller:
            assert asked(controller, SLOTS) == len(SLOTS)


def test_the_simulated_device_on_a_line_answers_one_request_after_the_other():
    """Otherwise a late answer could come at any time, which no device on a line sends."""
    simulator = SoftMotionSimulator(seed=7)
    simulator.faults.add(PlcFault(PlcFaultAction.DELAY, match="read_slot 2", seconds=0.1))
    with serve_modbus_rtu(simulator, clock=ScaledClock()) as host:
        assert host.cable is not None
        near = os.open(host.cable.near, os.O_RDWR | os.O_NOCTTY)
        answers = b""
        try:
            os.write(near, rtu(bytes([4, *(112 + 36).to_bytes(2, "big"), 0, 36])))
            while simulator.exchanges < 1:
                select.select([near], [], [], 0.01)
            os.write(near, rtu(bytes([4, 0, 0, 0, 3])))
            while len(answers) < 77 + 11:
                assert select.select([near], [], [], 5)[0]
                answers += os.read(near, 256)
        finally:
            os.close(near)
    assert (answers[2], answers[77 + 2]) == (72, 6)


@pytest.mark.fault("F03")
@pytest.mark.parametrize(
    "length", [36, *(pytest.param(n, marks=pytest.mark.soak) for n in (3, 112))]
)
def test_f03_old_answers_on_a_serial_line_are_thrown_away(length):
    """The answers to the first question, to that for a slot, and to that for the block."""
    simulator = SoftMotionSimulator(seed=7)
    with serve_modbus_rtu(simulator, clock=ScaledClock()) as host:
        with robolink.connect(host.url) as controller:
            for slot, value in SLOTS.items():
                controller.tools.write(slot, value, expected=None)
        assert host.cable is not None
        far_end = os.open(host.cable.far, os.O_WRONLY | os.O_NOCTTY)
        os.write(far_end, rtu(words(*[0x4242] * length)))
        os.close(far_end)
        with robolink.connect(host.url) as controller:
            assert asked(controller, SLOTS) == len(SLOTS)


@pytest.mark.fault("F03")
@pytest.mark.parametrize(
    "old", [b'#Execute,"3"\r\n', b"#GetStatus,00100000001,0000\r\n", b"#Login,0\r\n", b"\x00~"]
)
def test_f03_old_bytes_on_a_new_connection_answer_nothing(old):
    with relayed(greeting=old) as (_, url, _):
        try:
            controller = robolink.connect(url, timeout_s=PATIENCE_S)
        except (RemoteProtocolError, TransportError):
            return
        # Bytes that look like the answer to the login are taken for it; the true one is then one
        # too many, and ends the session.
        with controller:
            assert asked(controller, [2, 3, 4]) == 0


@pytest.mark.fault("F06", "F10")
@pytest.mark.parametrize(
    "more", [b'#Execute,"3"\r\n', b"#GetStatus,00100000001,0000\r\n", b"!Execute,99\r\n"]
)
def test_f06_f10_an_answer_that_nobody_asked_for_ends_the_session(more):
    sent: list[bytes] = [b""]
    doubled: list[bytes] = []

    def heard(data):
        sent.append(data)
        return data

    def joined(data):
        # The last answer to a read of tool 2: any next question could be answered by more.
        if b"TLSet(2)" in sent[-1] and not doubled:
            doubled.append(data)
            return data + more
        return data

    with relayed(to_server=heard, to_client=joined) as (_, url, _):
        with robolink.connect(url, timeout_s=PATIENCE_S) as controller:
            table = controller.tools
            assert isinstance(table, EpsonToolTable)
            window = table._window
            assert asked(controller, [2]) == 1
            assert doubled
            # Without the status reading before it, whose name would reveal it.
            with pytest.raises((RemoteProtocolError, TransportError)):
                window.printed(spel.print_selected_tool())
            with pytest.raises((RemoteProtocolError, TransportError)):
                controller.status()
        with connected_anew(url) as controller:
            assert asked(controller, SLOTS) == len(SLOTS)


def connected_anew(url):
    """Connect behind a session that ended without a logout: its end may not be seen there yet."""
    return robolink.connect(url, wait_s=60)


@pytest.mark.fault("F10")
def test_f10_bytes_that_a_controller_pushes_by_itself_are_named():
    simulator = EpsonSimulator(seed=5)
    with serve_tcp(simulator) as host:
        with robolink.connect(host.url, timeout_s=PATIENCE_S) as controller:
            before = controller.tools.read(1)
            simulator.push(b'#Execute,"7"\r\n')
            with pytest.raises(RemoteProtocolError, match="did not ask for"):
                while True:
                    assert controller.tools.selected() == 1
        with connected_anew(host.url) as controller:
            assert controller.tools.read(1) == before
