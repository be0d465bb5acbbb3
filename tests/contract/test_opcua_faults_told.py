"""What our driver says of each fault of an OPC UA server: by its name, and never a wrong value."""

import re
from contextlib import closing
from dataclasses import replace

import pytest
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.faults.links import LinkKind, links_of
from robolink_simulators.plc import PlcSimulator, serve_plc_opcua
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served
from robolink_simulators.testkit.operator import written_symbol_map

import robolink
from robolink.errors import (
    OutcomeUnknownError,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.model import MotionProfile, Path, WorkBox
from robolink.register_maps import load_symbol_map
from robolink.testing import confirm_whole_map
from robolink.transport import open_opcua

pytestmark = pytest.mark.simulator_only

PATIENCE_S = 0.5
PARENT = "/DeviceSet/*/Resources/Application/GlobalVars/GVL_Tools"
TOOL = robolink.ToolOffset(1, 2, 3)
OLD = {"x": -4.5, "y": 2.5, "z": 1.0}
SLOW = MotionProfile(Path.STRAIGHT, speed_mm_s=20)

READS = (
    ("wrong_type", RemoteProtocolError, "has to be"),
    ("short_array", RemoteProtocolError, "has to be"),
    ("out_of_service", RejectedError, "BadOutOfService"),
    ("lose_session", TransportBrokenError, "BadSessionIdInvalid"),
    ("drop_channel", TransportBrokenError, "BadSecureChannelClosed"),
    ("drop_reply", TransportTimeoutError, "did not answer"),
)
WRITES = (
    ("read_only", RejectedError, "BadNotWritable", False),
    ("wrong_type", RejectedError, "BadTypeMismatch", False),
    ("out_of_service", OutcomeUnknownError, "does not say whether this was done", False),
    ("lose_session", OutcomeUnknownError, "BadSessionIdInvalid", False),
    ("drop_channel", OutcomeUnknownError, "BadSecureChannelClosed", True),
    ("drop_reply", OutcomeUnknownError, "did not answer", True),
    ("ignore_write", ReadBackError, "reads back as", False),
)
"""Fault of a write to a PLC, what the driver raises and says, and whether it arrived."""


TOLD_ON_OTHER_LINKS_TOO = (
    ("drop_request", TransportTimeoutError, "did not answer"),
    ("truncate_reply", TransportTimeoutError, "did not answer"),
    ("duplicate_reply", RemoteProtocolError, "makes no sense"),
    ("zero_reply", RemoteProtocolError, "it is empty"),
    ("disconnect", TransportBrokenError, "closed the connection"),
    ("disconnect_before", TransportBrokenError, "closed the connection"),
    ("reset", TransportBrokenError, "broke"),
    ("half_open", TransportTimeoutError, "did not answer"),
    ("restart", TransportBrokenError, "has restarted"),
    ("word_order", RemoteProtocolError, "high word first"),
)
"""The same of faults that every link of a mailbox has; a restart and words in another order show
at the next answer."""
BORNE = frozenset(
    {
        *("duplicate_request", "stall", "delay", "reorder_write"),
        *("garble_reply", "tear_reply", "stale_reply", "split_reply", "tear_array", "tear_nodes"),
        *("garble_write", "tear_write", "ignore_write", "read_only", "expired_certificate"),
        *("freeze", "freeze_heartbeat", "zero_inputs", "take_ownership", "withdraw_permit"),
        *("estop", "axis_error"),
    }
)
"""Faults of which a read is right all the same: it is read again, it waits, or they are of writes,
of movements and of later connections."""


@pytest.mark.soak
def test_each_fault_that_a_plan_may_have_is_told_by_a_read_or_does_it_no_harm(robolink_state):
    told_by = {action: (kind, words) for action, kind, words in (*READS, *TOLD_ON_OTHER_LINKS_TOO)}
    possible = [one for one in PlcFaultAction if LinkKind.OPCUA in links_of(one)]
    assert {one.name.lower() for one in possible} == told_by.keys() | BORNE
    for action in possible:
        plc = SoftMotionSimulator(seed=3)
        with served(plc, "opcua") as url, robolink.connect(url, timeout_s=PATIENCE_S) as controller:
            due = controller.tools.read(1)
            plc.faults.add(PlcFault(action, match="read_slots"))
            if (told := told_by.get(action.name.lower())) is None:
                assert controller.tools.read(1) == due, action
                continue
            with pytest.raises(told[0], match=re.escape(told[1])):
                controller.tools.read(1)


def test_a_certificate_that_ends_is_told_at_the_next_connection(robolink_state, own_certificate):
    plc = SoftMotionSimulator(seed=3)
    with served(plc, "opcua-secured") as url:
        plc.faults.add(PlcFault(PlcFaultAction.EXPIRED_CERTIFICATE, match="read_slots"))
        with robolink.connect(url) as controller:
            due = controller.tools.read(1)
            assert controller.tools.read(1) == due
        with pytest.raises(RobolinkError, match="certificate"):
            robolink.connect(url)


def test_each_fault_of_a_read_is_told_by_its_name(robolink_state):
    plc = SoftMotionSimulator(seed=3)
    with served(plc, "opcua") as url:
        right = robolink.connect(url)
        due = right.tools.read(1)
        right.close()
        for action, kind, words in READS:
            with robolink.connect(url, timeout_s=PATIENCE_S) as controller:
                plc.faults.add(PlcFault(PlcFaultAction[action.upper()], match="read_slots"))
                with pytest.raises(kind) as told:
                    controller.tools.read(1)
            assert words in str(told.value), action
            assert plc.faults.fired[-1].action.name.lower() == action
        with robolink.connect(url) as controller:
            assert controller.tools.read(1) == due
    assert plc.counters()["tool_writes"] == 0


def test_a_value_out_of_service_while_connecting_is_told_by_its_name_and_not_kept(
    robolink_state, tmp_path
):
    mailbox = SoftMotionSimulator(seed=3)
    with served(mailbox, "opcua") as url:
        mailbox.faults.add(PlcFault(PlcFaultAction.OUT_OF_SERVICE, every=1))
        with pytest.raises(RejectedError, match="BadOutOfService"):
            robolink.connect(url)
    path = written_symbol_map(tmp_path)
    plc = PlcSimulator(load_symbol_map(path), seed=7)
    tool = "ns=4;s=|var|PLC.Application.GVL_Tools.aNeedleA"
    with serve_plc_opcua(plc, path) as host:
        plc.faults.add(Fault(FaultAction.OUT_OF_SERVICE, match="aNeedleA", every=1))
        with pytest.raises(RejectedError, match="BadOutOfService"):
            robolink.connect(host.url)
        with closing(open_opcua(host.url.partition("?")[0] + "?security=none")) as client:
            with pytest.raises(RejectedError, match="BadOutOfService"):
                client.describe(tool)
            (found,) = {one for one in client.browse(PARENT) if one.id == tool}
            assert not found.readable
            plc.faults.forget()
            assert client.describe(tool).type_name == "Double[6]"


def test_a_torn_block_is_read_again_and_one_that_stays_torn_is_told(robolink_state):
    plc = SoftMotionSimulator(seed=3)
    torn = PlcFaultAction.TEAR_ARRAY

    def asked():
        return sum(line[1:] == (">", "read_response") for line in plc.log)

    with served(plc, "opcua") as url, robolink.connect(url) as controller:
        due = controller.status()
        for number, cut in enumerate((1, 50, 113), 1):
            plc.faults.add(PlcFault(torn, match="read_response", position=cut))
            assert controller.status() == due
            assert [fault.action for fault in plc.faults.fired] == [torn] * number
        plc.faults.add(PlcFault(torn, match="read_response", position=50, every=1))
        before = asked()
        with pytest.raises(RemoteProtocolError, match="mixed two PLC cycles in each of 3 answers"):
            controller.status()
        assert asked() == before + 3


@pytest.fixture(scope="module")
def plc_with_a_map(tmp_path_factory):
    path = written_symbol_map(tmp_path_factory.mktemp("map"))
    plc = PlcSimulator(load_symbol_map(path), seed=7)
    with serve_plc_opcua(plc, path) as host:
        yield plc, host.url


@pytest.mark.parametrize(("action", "kind", "words", "arrived"), WRITES, ids=lambda value: value)
def test_each_fault_of_a_write_is_told_and_nothing_is_sent_twice(
    robolink_state, plc_with_a_map, action, kind, words, arrived
):
    plc, url = plc_with_a_map
    plc.program.set_tool(1, OLD)
    plc.log.clear()
    takeovers = plc.program.takeovers
    with robolink.connect(url, timeout_s=PATIENCE_S) as controller:
        confirm_whole_map(controller)
        old = controller.tools.read(1)
        plc.faults.add(Fault(FaultAction[action.upper()], match="write GVL_Tools.aNeedleA"))
        with pytest.raises(kind) as told:
            controller.tools.write(1, TOOL, expected=old)
    assert words in str(told.value)
    sent = [text for _, way, text in plc.log if way == ">" and text.endswith("aNeedleA")]
    assert sum(text.startswith("write") for text in sent) == 1
    assert (plc.program.shown()[1]["x"] == TOOL.x_mm) is arrived
    assert plc.program.takeovers - takeovers == (action == "ignore_write")


def test_an_array_that_changes_while_it_is_read_is_never_taken_for_a_tool(
    robolink_state, plc_with_a_map
):
    """The program changes the array in each answer: no two readings are equal, none is believed."""
    plc, url = plc_with_a_map
    with robolink.connect(url) as controller:
        due = controller.tools.read(1)
        held = dict(plc.program.in_force[1])
        count = 0

        def change(_number, text):
            nonlocal count
            if "aNeedleA" in text:
                count += 1
                plc.program.set_tool(1, {name: value + count for name, value in held.items()})

        plc.on_reply = change
        plc.faults.add(Fault(FaultAction.TEAR_ARRAY, match="aNeedleA", position=1, every=1))
        with pytest.raises(RemoteProtocolError, match="changes at every reading"):
            controller.tools.read(1)
        plc.on_reply = None
        plc.faults.forget()
        plc.program.set_tool(1, held)
        assert controller.tools.read(1) == due


NO_SERVICE = PlcFault(PlcFaultAction.OUT_OF_SERVICE, match="read_response", every=1)
LOOKS_REFUSED = PlcFault(PlcFaultAction.MODBUS_EXCEPTION, match="read_", code=6, every=1)
BEATS_REFUSED = PlcFault(PlcFaultAction.MODBUS_EXCEPTION, match="beat", code=6, every=1)


@pytest.mark.parametrize(
    ("medium", "fault", "command"),
    [
        ("opcua", NO_SERVICE, "WRITE_TOOL"),
        ("modbus-tcp", LOOKS_REFUSED, "MOVE_LINEAR"),
        ("modbus-tcp", BEATS_REFUSED, "MOVE_LINEAR"),
        pytest.param("opcua", NO_SERVICE, "MOVE_LINEAR", marks=pytest.mark.soak),
        pytest.param("modbus-tcp", LOOKS_REFUSED, "WRITE_TOOL", marks=pytest.mark.soak),
    ],
    ids=lambda value: value if isinstance(value, str) else value.match,
)
def test_a_look_that_is_refused_refuses_no_command(robolink_state, medium, fault, command):
    """The command was sent, and the PLC may carry it out: its answer alone cannot be read."""
    plc = SoftMotionSimulator(seed=3)

    def refuse_from_here(_number, text):
        if f"write_command {command}" in text:
            plc.on_request = None
            plc.faults.add(fault)

    with served(plc, medium) as url, robolink.connect(url) as controller:
        controller.motors(True)
        old, here = controller.tools.read(1), controller.groups[0].pose()
        plc.on_request = refuse_from_here
        with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
            if command == "WRITE_TOOL":
                controller.tools.write(1, TOOL, expected=old)
            else:
                there = replace(here, z_mm=here.z_mm + 20)
                controller.groups[0].move_to(there, SLOW, box=WorkBox()).wait(timeout_s=20)
        (marker,) = controller.outcomes.open_markers()
        assert command in marker.request
        plc.faults.forget()
        controller.stop()  # over the same link
        counted = plc.counters()
        assert counted["tool_writes"] + counted["moves_started"] <= 1
