"""A CANopen node that misbehaves, on a fake bus."""

import struct
from typing import Any

import can
import pytest

from robolink.errors import (
    ConnectError,
    RejectedError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.transport import parse_url
from robolink.transport.can.bus import CanLine
from robolink.transport.can.mailbox import CanopenMailboxLink, open_canopen_link
from tests.unit._scripted_can import (
    HEARTBEAT,
    IDENTITY,
    NODE,
    RPDO1,
    SDO_ANSWER,
    SDO_ASK,
    TPDO1,
    FakeClock,
    ScriptedBus,
    node_with,
)


@pytest.fixture
def link_to():
    def make(answer, **meeting):
        clock = FakeClock()
        bus: Any = ScriptedBus(clock, answer)
        link = CanopenMailboxLink(
            CanLine(bus, "softmotion+can://desk"),
            NODE,
            lambda _timeout_s: link,
            identity=IDENTITY,
            durable=True,
            timeout_s=1.0,
            clock=clock,
        )
        link.meet(**{"start": True, **meeting})
        return bus, link

    return make


def test_the_node_is_asked_for_its_heartbeat_and_started(link_to):
    bus, _ = link_to(node_with(0))
    assert bus.sent == [(SDO_ASK, b"\x40\x17\x10\x00\0\0\0\0"), (0, bytes([1, NODE]))]


def test_another_device_may_start_the_node(link_to):
    bus, _ = link_to(node_with(0), start=False)
    assert [identifier for identifier, _ in bus.sent] == [SDO_ASK]


def test_a_node_without_a_heartbeat_object_is_not_supervised(link_to):
    refusal = b"\x80\x17\x10\x00" + (0x06020000).to_bytes(4, "little")
    bus, link = link_to(lambda identifier, data: [(SDO_ANSWER, refusal)] * (identifier != 0))
    bus.clock.sleep(3600)
    link.beat(0x0101)


def test_nobody_there_is_named_and_the_transfer_given_up(link_to):
    with pytest.raises(ConnectError, match=r"Node 5 of .* does not answer") as caught:
        link_to(lambda identifier, data: ())
    assert "terminators" in caught.value.remedy


@pytest.mark.fault("F11")
def test_a_lost_heartbeat_names_itself_before_anything_is_sent(link_to):
    bus, link = link_to(node_with(200))
    sent = len(bus.sent)
    bus.clock.sleep(0.7)
    with pytest.raises(TransportBrokenError, match=r"lost its heartbeat: .* 0\.2 s"):
        link.write_command((0,) * 64)
    assert len(bus.sent) == sent
    with pytest.raises(TransportClosedError):
        link.beat(1)


def test_a_lost_heartbeat_names_itself_while_an_answer_is_awaited(link_to):
    _, link = link_to(node_with(100))
    with pytest.raises(TransportBrokenError, match="lost its heartbeat"):
        link.read_slot(1)


def test_a_heartbeat_that_this_computer_was_too_busy_to_hear_is_waited_for(link_to):
    bus, link = link_to(node_with(200))
    bus.clock.sleep(60)  # neither this thread nor the one that passes frames on has run
    bus.late = [(HEARTBEAT, b"\x05")]
    link.beat(0x0101)
    assert bus.sent[-1] == (RPDO1, b"\x01\x01")


def test_heartbeats_that_waited_in_the_queue_count(link_to):
    bus, link = link_to(node_with(200))
    bus.clock.sleep(60)
    bus.hear((HEARTBEAT, b"\x05"), (TPDO1, bytes(8)))
    assert link.read_head().ack == 0


def test_a_restarted_node_names_itself(link_to):
    bus, link = link_to(node_with(200))
    bus.hear((HEARTBEAT, b"\x00"))
    with pytest.raises(TransportBrokenError, match="has restarted"):
        link.read_head()


def test_a_head_is_the_newest_that_was_sent(link_to):
    bus, link = link_to(node_with(0))
    bus.hear((TPDO1, struct.pack("<HBBHH", 1, 4, 2, 0, 7)))
    bus.hear((TPDO1, struct.pack("<HBBHH", 2, 15, 5, 203, 8)))
    head = link.read_head()
    assert (head.ack, head.state, head.group_state) == (2, 15, 5)
    assert (head.error_class, head.heartbeat) == (203, 8)
    with pytest.raises(TransportTimeoutError):
        link.read_head()  # each is taken once


@pytest.mark.parametrize("sent", [(), ((TPDO1, b"\1\2\3"),)])
def test_heads_that_do_not_come_are_named(link_to, sent):
    bus, link = link_to(node_with(0))
    bus.hear(*sent)
    with pytest.raises(TransportTimeoutError, match="sends no TPDO1"):
        link.read_head()
    assert bus.clock.time_ns == pytest.approx(1e9, rel=0.1)


def test_a_beat_is_one_pdo(link_to):
    bus, link = link_to(node_with(0))
    link.beat(0x0102)
    assert bus.sent[-1] == (0x200 + NODE, b"\x02\x01")


def test_a_refused_download_says_why_sends_nothing_more_and_keeps_the_link(link_to):
    def refuse(data):
        return [(SDO_ANSWER, b"\x80\x00\x21\x00" + (0x06020000).to_bytes(4, "little"))]

    bus, link = link_to(node_with(0, refuse))
    with pytest.raises(RejectedError, match=r"object 2100h:0 with SDO abort 06020000h") as caught:
        link.write_command((7,) * 64)
    assert caught.value.code == 0x06020000
    assert "EDS" in caught.value.remedy
    assert [data[0] for _, data in bus.sent[2:]] == [0x21]
    link.beat(1)


@pytest.mark.fault("F04")
@pytest.mark.parametrize("answered", [1, 2, 19])
@pytest.mark.fault("F52")
def test_f52_a_download_that_is_cut_off_is_aborted_once_and_sends_nothing_more(link_to, answered):
    left = [answered]

    def answer(data):
        left[0] -= 1
        if left[0] < 0:
            return ()
        first = data[0] & 0xE0 == 0x20
        return [(SDO_ANSWER, b"\x60\x00\x21\0\0\0\0\0" if first else toggled(0x20, data))]

    bus, link = link_to(node_with(0, answer))
    with pytest.raises(TransportTimeoutError, match="2100h:0"):
        link.write_command((7,) * 64)
    frames = [data for _, data in bus.sent[2:]]
    assert len(frames) == answered + 2
    assert frames[-1] == b"\x80\x00\x21\x00" + (0x05040000).to_bytes(4, "little")
    with pytest.raises(TransportClosedError):
        link.read_slot(1)


def toggled(service, data):
    return bytes([service | data[0] & 0x10]) + bytes(7)


LATE = (
    b"\x60\x00\x21\0\0\0\0\0",  # a download begun
    b"\x20\0\0\0\0\0\0\0",  # a segment taken
    b"\x43\x18\x10\x04\1\2\3\4",  # another object
    b"\x80\x01\x21\x00\0\0\2\6",  # an abort
)


@pytest.mark.parametrize("late", LATE)
@pytest.mark.fault("F57", "F58")
def test_an_answer_to_a_client_that_was_killed_is_passed_over_by_the_next_one(link_to, late):
    bus, link = link_to(
        lambda identifier, data: [(SDO_ANSWER, late), *node_with(200)(identifier, data)]
    )
    assert bus.sent == [(SDO_ASK, b"\x40\x17\x10\x00\0\0\0\0"), (0, bytes([1, NODE]))]
    bus.clock.sleep(0.7)
    with pytest.raises(TransportBrokenError, match=r"0\.2 s"):  # the period is the node's own
        link.beat(1)


def test_a_second_client_on_the_bus_is_noticed_while_connecting(link_to):
    twice = [(SDO_ANSWER, LATE[0]), (SDO_ANSWER, LATE[1])]
    with pytest.raises(RemoteProtocolError, match="1017h:0") as caught:
        link_to(lambda identifier, data: [*twice, *node_with(0)(identifier, data)])
    assert "second SDO client" in caught.value.remedy


@pytest.mark.fault("F10")
@pytest.mark.parametrize(
    "foreign",
    [
        b"\x60\x01\x21\0\0\0\0\0",  # another object
        b"\x40\x00\x21\0\0\0\0\0",  # another service
        b"\x80\x01\x21\x00\0\0\2\6",  # an abort of somebody else's transfer
        b"\x60\x00\x21\0",  # too short
    ],
)
@pytest.mark.fault("F51")
def test_an_answer_that_does_not_fit_aborts_the_transfer(link_to, foreign):
    bus, link = link_to(node_with(0, lambda data: [(SDO_ANSWER, foreign)]))
    with pytest.raises(RemoteProtocolError, match="something other than object 2100h:0"):
        link.write_command((7,) * 64)
    assert [data[0] for _, data in bus.sent[2:]] == [0x21, 0x80]


@pytest.mark.fault("F52")
def test_a_segment_with_the_wrong_toggle_aborts_the_transfer(link_to):
    def answer(data):
        if data[0] & 0xE0 == 0x20:
            return [(SDO_ANSWER, b"\x60\x00\x21\0\0\0\0\0")]
        return [(SDO_ANSWER, b"\x30\0\0\0\0\0\0\0")]

    _, link = link_to(node_with(0, answer))
    with pytest.raises(RemoteProtocolError):
        link.write_command((7,) * 64)


def test_an_upload_that_never_ends_is_cut_short(link_to):
    def answer(data):
        first = data[0] & 0xE0 == 0x40
        return [(SDO_ANSWER, b"\x41" + data[1:4] + bytes(4) if first else toggled(0, data))]

    bus, link = link_to(node_with(0, answer))
    with pytest.raises(RemoteProtocolError):
        link.read_slot(1)
    assert len(bus.sent) < 200


def test_heartbeats_behind_a_lesser_error_frame_count(link_to):
    bus, link = link_to(node_with(200))
    bus.clock.sleep(60)
    bus.hear((0x04, bytes(8)), is_error_frame=True)
    bus.hear((HEARTBEAT, b"\x05"))
    link.beat(1)


def test_a_block_of_another_size_is_refused(link_to):
    def answer(data):
        return [(SDO_ANSWER, b"\x43" + data[1:4] + b"\1\2\3\4")]

    _, link = link_to(node_with(0, answer))
    with pytest.raises(RemoteProtocolError, match="4 bytes in object 2200h instead of 72"):
        link.read_slot(3)


@pytest.mark.fault("F50")
def test_f50_a_bus_error_reaches_whoever_waits(link_to):
    bus, link = link_to(node_with(0))
    bus.failure = can.CanOperationError("the adapter was unplugged")
    with pytest.raises(TransportBrokenError, match="unplugged") as caught:
        link.read_head()
    assert isinstance(caught.value.__cause__, can.CanOperationError)
    with pytest.raises(TransportClosedError):
        link.beat(1)


@pytest.mark.parametrize("use", ["write_command", "beat"])
@pytest.mark.fault("F50")
def test_a_frame_that_cannot_be_sent_is_an_error_at_once(link_to, use):
    bus, link = link_to(node_with(0))
    bus.recv = lambda timeout: None
    bus.failure = can.CanOperationError("no buffer space")
    with pytest.raises(TransportBrokenError, match="no buffer space"):
        link.write_command((0,) * 64) if use == "write_command" else link.beat(1)


@pytest.mark.fault("F50")
def test_bus_off_is_named_and_lesser_error_frames_are_not_the_end(link_to):
    bus, link = link_to(node_with(0))
    bus.hear((0x04, bytes(8)), is_error_frame=True)
    bus.hear((TPDO1, bytes(8)))
    assert link.read_head().ack == 0
    bus.hear((0x40, bytes(8)), is_error_frame=True)
    with pytest.raises(TransportBrokenError, match="bus-off"):
        link.read_head()


@pytest.mark.parametrize(
    "misuse",
    [
        lambda link: link.read_slot(0),
        lambda link: link.read_slot(16),
        lambda link: link.write_command((0,) * 63),
        lambda link: link.beat(65536),
    ],
)
def test_a_caller_who_asks_for_what_there_is_not_is_told_so_and_the_link_lives(link_to, misuse):
    bus, link = link_to(node_with(0))
    sent = len(bus.sent)
    with pytest.raises(ValueError, match=r"."):
        misuse(link)
    assert len(bus.sent) == sent
    link.beat(1)


def test_frames_of_a_bus_by_multicast_stay_on_this_computer(monkeypatch):
    asked: dict[str, Any] = {}

    def opened(**settings: Any) -> can.BusABC:
        asked.update(settings)
        raise OSError("as far as here")

    monkeypatch.setattr(can, "Bus", opened)
    url = parse_url("softmotion+can://239.74.163.2?interface=udp_multicast&node=1")
    with pytest.raises(ConnectError, match="as far as here"):
        open_canopen_link(url, timeout_s=1.0)
    # 0 hops means this computer only; nodes on a bus understand classic frames.
    assert asked["hop_limit"] == 0
    assert asked["fd"] is False
