"""What a plan of faults does to a simulated OPC UA server, seen by a client that is not ours."""

import asyncio
import struct
import time
from datetime import UTC, datetime

import pytest
from asyncua import ua
from asyncua.common.utils import NotEnoughData
from cryptography import x509
from robolink_simulators.cell.clock import SteeredClock
from robolink_simulators.faults import FaultNotPossibleError, LinkKind, PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import COMMAND_WORDS, BlockError, decode_response
from tests.contract._opcua_peer import OpcuaPeer

pytestmark = pytest.mark.simulator_only

DEVICE = "Simulated SoftMotion PLC"
COMMAND, RESPONSE = "RL_Symbols.command", "RL_Symbols.response"
SLOTS, HEARTBEAT = "RL_Symbols.slots", "RL_Symbols.heartbeat"
WORDS = [*range(1, COMMAND_WORDS + 1)]
BEAT_WORD = 10
"""Word of the response that counts the PLC's cycles; the first and the last do, too."""

GONE = (OSError, ua.UaError, TimeoutError)
UNREADABLE = (*GONE, NotEnoughData, ValueError, KeyError, struct.error)
"""What asyncua raises of an answer that never comes, or of which it gets a part."""


@pytest.fixture
def plc():
    return SoftMotionSimulator(seed=3)


@pytest.fixture
def host(plc):
    with serve_opcua(plc) as host:
        yield host


@pytest.fixture
def peer(host):
    with OpcuaPeer(host.url, DEVICE, timeout_s=1.0) as peer:
        peer.node(RESPONSE), peer.node(COMMAND)
        yield peer


def plan(plc, action, **fields):
    """Plan one fault for the next request that matches."""
    plc.faults.add(PlcFault(PlcFaultAction[action.upper()], **fields))


def met(plc):
    """Return the names of the faults that happened."""
    return [fault.action.name.lower() for fault in plc.faults.fired]


def test_an_array_is_torn_between_two_cycles_and_both_ends_tell(plc, peer):
    plan(plc, "tear_array", match="read_response", position=20, every=1)
    before = 0
    for _ in range(5):
        (words,) = peer.read(RESPONSE)
        with pytest.raises(BlockError):
            decode_response(words[1:-1])
        assert before <= words[0] < words[-1]
        before = words[-1]
    assert met(plc) == ["tear_array"] * 5
    plc.faults.clear()
    decode_response(peer.read(RESPONSE)[0][1:-1])


def test_what_is_torn_is_of_two_moments_and_of_nothing_else(plc, peer):
    """The program changes the slots while the server copies them."""
    plan(plc, "tear_array", match="read_slots", position=100)
    with plc.lock:
        old = plc.plc.output(plc.now_ns)[112:]

    def write_slots(_number, text):
        if text == "read_slots":
            for slot in range(1, 16):
                plc.plc.tools.preset(slot, plc.world.stored)
            plc.on_reply = None

    plc.on_reply = write_slots
    (torn,) = peer.read(SLOTS)
    (new,) = peer.read(SLOTS)
    assert torn == [*old[:100], *new[100:]]
    assert torn not in ([*old], new)


def test_what_clients_wrote_is_read_with_faults_too_and_is_on_the_record(plc, peer):
    plan(plc, "tear_nodes")
    peer.write(COMMAND, WORDS)
    plan(plc, "garble_reply", match="read_command", position=3, bit=0)
    plan(plc, "zero_reply", match="read_beat")
    peer.write(HEARTBEAT, 7)
    assert peer.read(COMMAND) == [[*WORDS[:3], WORDS[3] ^ 1, *WORDS[4:62], 7, WORDS[63]]]
    assert (peer.read(HEARTBEAT), peer.read(HEARTBEAT)) == ([0], [7])
    assert met(plc) == ["garble_reply", "zero_reply"]
    asked = [text for _, way, text in plc.log if way == ">"]
    assert asked[-4:] == ["beat", "read_command", "read_beat", "read_beat"]
    peer.read(RESPONSE, RESPONSE)
    assert met(plc)[2:] == ["tear_nodes"]  # it waited for an answer of two moments


def test_variables_of_one_request_are_of_two_cycles(plc, peer):
    plan(plc, "tear_nodes", match="read_response", position=1)
    first, second = (words[BEAT_WORD] for words in peer.read(RESPONSE, RESPONSE))
    assert second > first
    first, second = (words[BEAT_WORD] for words in peer.read(RESPONSE, RESPONSE))
    assert second == first


def test_what_is_planned_for_an_answer_meets_no_notification_that_leaves_before_it(plc, host):
    """The server looks twice for the torn answer; meanwhile it tells of what is watched."""
    told: list[list[int]] = []

    class Handler:
        def datachange_notification(self, node, value, data):
            told.append(value)

    def write_command(_number, text):
        if text == "read_slots":
            plc.plc.write(0, tuple(WORDS), plc.now_ns)
            plc.on_reply = None

    with OpcuaPeer(host.url, DEVICE) as peer:
        watched, torn = peer.node(COMMAND), peer.node(SLOTS)

        async def act(client):
            subscription = await client.create_subscription(50, Handler())
            await subscription.subscribe_data_change(watched)
            await asyncio.sleep(0.2)  # the next notification has been asked for by then
            plc.on_reply = write_command
            plan(plc, "tear_array", match="read_slots", seconds=0.4)
            plan(plc, "drop_reply", match="read_slots")
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(torn.read_value(), 0.8)
            assert len(await torn.read_value()) == 544

        peer.do(act)
    assert [value[0] for value in told] == [0, WORDS[0]]


@pytest.mark.parametrize(
    ("action", "kind", "length"),
    [("wrong_type", "Int32", 114), ("short_array", "UInt16", 113)],
)
def test_a_variable_turns_out_to_be_of_another_type_or_length(plc, peer, action, kind, length):
    plan(plc, action, match="read_response")
    (answer,) = peer.answers(RESPONSE)
    assert (answer.Value.VariantType.name, len(answer.Value.Value)) == (kind, length)
    (answer,) = peer.answers(RESPONSE)
    assert (answer.Value.VariantType.name, len(answer.Value.Value)) == ("UInt16", 114)


@pytest.mark.parametrize(
    ("action", "status"),
    [
        ("wrong_type", "BadTypeMismatch"),
        ("read_only", "BadNotWritable"),
        ("out_of_service", "BadOutOfService"),
    ],
)
def test_a_write_is_refused_and_does_not_arrive(plc, peer, action, status):
    plan(plc, action, match="write_command")
    assert peer.write(COMMAND, WORDS) == status
    assert not any(plc.plc.program.inbox.words)
    assert peer.write(COMMAND, WORDS) == "Good"
    assert met(plc) == [action]


def test_a_variable_out_of_service_has_no_value(plc, peer):
    plan(plc, "out_of_service", match="read_response")
    (answer,) = peer.answers(RESPONSE)
    assert answer.StatusCode.name == "BadOutOfService"
    assert peer.read(RESPONSE)


def test_an_answer_comes_late_and_nothing_overtakes_it(plc, peer):
    plan(plc, "delay", match="read_response", seconds=0.2)
    began_s = time.monotonic()
    assert peer.read(RESPONSE)
    assert time.monotonic() - began_s >= 0.2


@pytest.mark.parametrize("action", ["drop_request", "drop_reply", "half_open", "truncate_reply"])
def test_an_answer_that_never_comes(plc, peer, action):
    plan(plc, action, match="write_command")
    with pytest.raises(UNREADABLE):
        peer.write(COMMAND, WORDS)
    assert any(plc.plc.program.inbox.words) is (action != "drop_request")
    assert met(plc) == [action]


@pytest.mark.parametrize(
    "action", ["disconnect", "disconnect_before", "reset", "drop_channel", "lose_session"]
)
def test_a_connection_channel_or_session_that_ends(plc, host, peer, action):
    plan(plc, action, match="write_command")
    with pytest.raises(GONE):
        peer.write(COMMAND, WORDS)
    arrived = action in ("disconnect", "reset", "drop_channel")
    assert any(plc.plc.program.inbox.words) is arrived
    with pytest.raises(GONE):
        peer.read(RESPONSE)
    with OpcuaPeer(host.url, DEVICE) as again:
        assert again.read(RESPONSE)


@pytest.mark.parametrize("action", ["split_reply", "delay"])
def test_an_answer_in_two_pieces_is_one(plc, peer, action):
    plan(plc, action, match="read_response", seconds=0.05, position=20)
    decode_response(peer.read(RESPONSE)[0][1:-1])
    assert met(plc) == [action]


def test_a_restart_ends_the_connection_and_counts(plc, host, peer):
    plan(plc, "restart", match="write_command")
    peer.write(COMMAND, WORDS)
    with pytest.raises(GONE):
        for _ in range(5):  # the PLC restarts after the request that met it
            peer.read(RESPONSE)
    with OpcuaPeer(host.url, DEVICE) as again:
        assert decode_response(again.read(RESPONSE)[0][1:-1]).boot_id == plc.plc.memory.boot_id
    assert plc.plc.starts == 2


def test_a_certificate_that_ended_yesterday_is_shown_to_whoever_comes(plc, host, peer):
    plan(plc, "expired_certificate", match="read_response")
    assert peer.read(RESPONSE)
    assert peer.read(RESPONSE)  # who is in stays in
    with OpcuaPeer(host.url, DEVICE) as again:
        endpoints = again.do(lambda client: client.get_endpoints())
    (shown,) = {x509.load_der_x509_certificate(one.ServerCertificate) for one in endpoints}
    assert shown.not_valid_after_utc < datetime.now(UTC)


def test_a_server_may_show_such_a_certificate_from_the_beginning(plc):
    with serve_opcua(plc, expired=True) as host, OpcuaPeer(host.url, DEVICE) as peer:
        endpoints = peer.do(lambda client: client.get_endpoints())
    shown = x509.load_der_x509_certificate(endpoints[0].ServerCertificate)
    assert shown.not_valid_after_utc < datetime.now(UTC)


def test_words_are_bent_before_the_channel_protects_them(plc, host):
    with OpcuaPeer(host.url, DEVICE, secured=True) as peer:
        plan(plc, "garble_reply", match="read_response", position=30, bit=3)
        with pytest.raises(BlockError):
            decode_response(peer.read(RESPONSE)[0][1:-1])
        plan(plc, "tear_write", match="write_command", position=10, seconds=3600)
        assert peer.write(COMMAND, WORDS) == "Good"
        assert plc.plc.program.inbox.words == (*WORDS[:10], *[0] * 54)


def test_where_time_stands_still_a_torn_answer_lets_a_cycle_pass(plc):
    clock = SteeredClock(0.0)
    with serve_opcua(plc, clock=clock) as host, OpcuaPeer(host.url, DEVICE) as peer:
        peer.read(RESPONSE)
        began_ns = clock.now_ns()
        plan(plc, "tear_array", match="read_response")
        peer.read(RESPONSE)
        assert clock.now_ns() - began_ns == plc.options.group.cycle_us * 1000


@pytest.mark.parametrize("action", ["shift_map", "modbus_exception", "lose_segment"])
def test_faults_of_other_links_are_refused(plc, action):
    fault = PlcFault(PlcFaultAction[action.upper()], code=1)
    with pytest.raises(FaultNotPossibleError):
        plc.faults.plan([fault], 1, {LinkKind.OPCUA})


@pytest.mark.parametrize("action", ["tear_array", "read_only", "expired_certificate"])
def test_faults_of_opc_ua_are_refused_on_other_links(plc, action):
    fault = PlcFault(PlcFaultAction[action.upper()])
    with pytest.raises(FaultNotPossibleError):
        plc.faults.plan([fault], 1, {LinkKind.MODBUS_TCP})
