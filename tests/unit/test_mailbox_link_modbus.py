"""Modbus over TCP and on a serial line: matching answers, and the meaning of refusals."""

from itertools import pairwise

import pytest

from robolink.errors import (
    ConfigError,
    ConnectError,
    RejectedError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.transport.modbus.client import ModbusClient
from robolink.transport.modbus.frames import Area, RtuFraming, TcpFraming
from robolink.transport.modbus.rtu import RtuExchange, RtuLine
from robolink.transport.modbus.tcp import TcpExchange
from tests._rows import each_row
from tests.unit._scripted_modbus import IDENTITY, ScriptedLine, rtu, tcp, words

# Over TCP: matching answers to requests, and the meaning of refusals.


def over_tcp(*steps):
    line = ScriptedLine(*steps)
    exchange = TcpExchange(line, IDENTITY, TcpFraming())
    return line, ModbusClient(line, exchange, identity=IDENTITY, unit=255, timeout_s=1.0)


def test_the_answer_with_the_number_of_the_request_is_taken():
    line, client = over_tcp(lambda frame: [tcp(words(9), 77), tcp(words(8), 0), tcp(words(7), 1)])
    assert client.read_input(0, 1) == (7,)
    assert not line.closed


@pytest.mark.fault("F09")
def test_a_second_copy_of_an_answer_answers_nothing():
    _, client = over_tcp(
        lambda frame: [tcp(words(7), 1), tcp(words(7), 1)], lambda frame: [tcp(words(8), 2)]
    )
    assert client.read_input(0, 1) == (7,)
    assert client.read_input(1, 1) == (8,)


@pytest.mark.fault("F03")
@pytest.mark.parametrize("so_far", [0, 5])
def test_an_old_answer_with_the_very_number_answers_nothing(so_far):
    """A gateway kept it from an earlier connection: all of it, or only its first bytes."""
    old = tcp(words(99), 1)
    rest = [old[so_far:]] if so_far else []
    line, client = over_tcp(lambda frame: [*rest, tcp(words(7), 1)])
    line.coming.append((0, old[:so_far] or old))
    assert client.read_input(0, 1) == (7,)


@pytest.mark.fault("F01")
def test_a_timeout_ends_the_link_and_nothing_is_sent_again():
    line, client = over_tcp(lambda frame: [])
    with pytest.raises(TransportTimeoutError, match=r"40001 \(address 0\) of unit 255") as caught:
        client.write_registers(0, [1, 2])
    assert caught.value.remedy
    assert line.closed
    with pytest.raises(TransportClosedError):
        client.read_input(0, 1)
    assert len(line.sent) == 1


@pytest.mark.fault("F04")
def test_half_an_answer_is_named_and_not_taken():
    _, client = over_tcp(lambda frame: [tcp(words(1, 2), 1)[:-1]])
    with pytest.raises(TransportTimeoutError, match="sent only 12 bytes of its answer") as caught:
        client.read_input(0, 2)
    assert len(caught.value.raw) == 12


@pytest.mark.fault("F67")
@pytest.mark.fault("F10")
def test_frames_that_never_stop_do_not_move_the_deadline():
    stream = [(after / 10, tcp(words(1), 99)) for after in range(100)]
    line, client = over_tcp(lambda frame: stream)
    with pytest.raises(TransportTimeoutError):
        client.read_input(0, 1)
    assert line.clock.time_ns == 1_000_000_000


def test_frames_that_come_in_a_flood_are_named_before_the_deadline():
    stream = [(after / 1000, tcp(words(*range(100)), 99)) for after in range(500)]
    line, client = over_tcp(lambda frame: stream)
    with pytest.raises(RemoteProtocolError, match="without an end") as caught:
        client.read_input(0, 1)
    assert len(caught.value.raw) <= 256
    assert line.closed
    assert len(stream) - len(line.coming) < 100


@pytest.mark.fault("F10")
@each_row(
    "answer",
    [tcp(words(1, 2), 1), tcp(words(1, function=3), 1), tcp(words(1), 1, unit=1)],
)
def test_an_answer_that_does_not_fit_its_number_ends_the_link(answer):
    line, client = over_tcp(lambda frame: [answer])
    with pytest.raises(RemoteProtocolError, match="something other"):
        client.read_input(0, 1)
    assert line.closed


def test_what_is_no_modbus_ends_the_link():
    line, client = over_tcp(lambda frame: [b"SSH-2.0-OpenSSH"])
    with pytest.raises(RemoteProtocolError, match="not Modbus") as caught:
        client.read_input(0, 1)
    assert caught.value.raw.startswith(b"SSH")
    assert line.closed


def test_a_server_that_has_hung_up_is_noticed_before_anything_is_sent():
    line, client = over_tcp()
    line.coming.append((0, b""))
    with pytest.raises(TransportBrokenError, match="closed the connection"):
        client.write_registers(0, [1])
    assert not line.sent


@each_row(
    ("code", "kind", "sentence"),
    [
        (1, RejectedError, "illegal function"),
        (2, RejectedError, "illegal data address"),
        (6, RejectedError, "server busy"),
        (4, RemoteProtocolError, "server device failure"),
        (0x0A, ConnectError, "gateway path unavailable"),
        (0x0B, TransportTimeoutError, "gateway target is silent"),
        (99, RemoteProtocolError, "not in the standard"),
    ],
)
@pytest.mark.fault("F56")
def test_f56_a_refused_write_is_named_and_counts_as_not_done_only_when_that_is_sure(
    code, kind, sentence
):
    line, client = over_tcp(lambda frame: [tcp(bytes([0x90, code]), 1)])
    with pytest.raises(kind, match=sentence) as caught:
        client.write_registers(0, [1])
    assert caught.value.remedy
    assert line.closed is (kind is not RejectedError)


def test_a_refused_read_changed_nothing_whatever_its_code():
    line, client = over_tcp(lambda frame: [tcp(b"\x84\x04", 1)])
    with pytest.raises(RejectedError) as caught:
        client.read_input(0, 1)
    assert caught.value.code == 4
    assert not line.closed


@each_row(
    "ask",
    [
        lambda client: client.read_input(-1, 1),
        lambda client: client.read_input(0, 126),
        lambda client: client.read_holding(65535, 2),
        lambda client: client.read_coils(0, 2001),
        lambda client: client.write_registers(0, []),
        lambda client: client.write_registers(0, [0] * 124),
        lambda client: client.write_registers(0, [65536]),
        lambda client: client.read_discrete(0, 1, unit=256),
    ],
)
def test_what_cannot_be_asked_for_is_not_sent(ask):
    line, client = over_tcp()
    with pytest.raises(ConfigError) as caught:
        ask(client)
    assert caught.value.remedy
    assert not line.sent


# On a serial line: matching answers to requests when no frame carries a number.


def honest(frame):
    """Answer a read with the requested number of words, each its own number."""
    function, count = frame[1], int.from_bytes(frame[4:6], "big")
    return [rtu(words(*range(count), function=function), unit=frame[0])]


def over_rtu(*steps, echo=False):
    """A line whose opening question is answered, followed by ``steps``."""

    def first(frame):
        return [frame, *honest(frame)] if echo else honest(frame)

    line = ScriptedLine(first, *steps)
    settings = RtuLine(
        character_s=0.0005,
        silence_s=0.002,
        quiet_s=0.02,
        echo=echo,
        probe_area=Area.INPUT,
        probe_address=0,
    )
    exchange = RtuExchange(line, IDENTITY, settings, RtuFraming())
    return line, ModbusClient(line, exchange, identity=IDENTITY, unit=1, timeout_s=1.0)


@pytest.mark.fault("F03")
def test_a_serial_line_is_proved_in_step_before_its_first_answer_is_taken():
    stale = rtu(words(41))
    line, client = over_rtu(lambda frame: [rtu(words(42))])
    line.coming.append((0, stale))
    assert client.read_input(0, 1) == (42,)
    assert [frame[1:6].hex() for frame in line.sent] == ["0400000003", "0400000001"]


@pytest.mark.fault("F02")
def test_on_a_serial_line_a_late_answer_is_never_taken_for_the_next():
    late = rtu(words(41))
    line, client = over_rtu(
        lambda frame: [(1.3, late)],
        lambda frame: [(0.6, piece) for piece in honest(frame)],
        lambda frame: [rtu(words(42))],
    )
    with pytest.raises(TransportTimeoutError):
        client.read_input(0, 1)
    assert client.read_input(1, 1) == (42,)
    questions = [frame[1:6].hex() for frame in line.sent]
    assert questions == ["0400000003", "0400000001", "0300000003", "0400010001"]


def test_on_a_dead_line_repeats_share_one_short_deadline_and_no_later_question_does():
    line, client = over_rtu()
    ends_s = []
    for _ in range(2):
        with pytest.raises(TransportTimeoutError):
            client.read_input(0, 1)
        ends_s.append(line.clock.now_ns() / 1e9)
    assert ends_s[0] < 1.03
    assert ends_s[1] < 1.03 + 0.8
    line.clock.sleep(60.0)
    line.steps = [lambda frame: [(0.95, piece) for piece in honest(frame)], honest]
    assert client.read_input(0, 1) == (0,)


@pytest.mark.fault("F02")
def test_on_a_serial_line_an_unanswered_probe_is_not_asked_again_in_the_same_words():
    line, client = over_rtu(lambda frame: [], lambda frame: [], lambda frame: [])
    for _ in range(3):
        with pytest.raises(TransportTimeoutError):
            client.read_input(0, 1)
    line.steps = [honest, lambda frame: [rtu(words(42))]]
    assert client.read_input(0, 1) == (42,)
    asked = [frame[1:6].hex() for frame in line.sent[1:-1]]
    assert asked == ["0400000001", "0300000003", "0400000003", "0400000005"]


def test_a_refusal_proves_a_line_in_step_only_when_no_earlier_question_can_have_it():
    _, client = over_rtu(
        lambda frame: [],
        lambda frame: [rtu(b"\x83\x02")],
        lambda frame: [rtu(words(42))],
    )
    with pytest.raises(TransportTimeoutError):
        client.read_input(0, 1)
    assert client.read_input(0, 1) == (42,)

    line, client = over_rtu(lambda frame: [], lambda frame: [], lambda frame: [rtu(b"\x84\x02")])
    for _ in range(3):
        with pytest.raises(TransportTimeoutError):
            client.read_input(0, 1)
    assert line.sent[-1][1] == 4


def test_each_unit_of_a_line_is_proved_in_step_for_itself():
    late = rtu(words(41), unit=2)
    line, client = over_rtu(
        lambda frame: [rtu(words(7))],
        honest,
        lambda frame: [(3.0, late)],
        lambda frame: [rtu(words(7))],
        honest,
        lambda frame: [rtu(words(42), unit=2)],
    )
    assert client.read_input(0, 1) == (7,)
    with pytest.raises(TransportTimeoutError):
        client.read_input(0, 1, unit=2)
    assert client.read_input(0, 1) == (7,)
    assert client.read_input(0, 1, unit=2) == (42,)
    assert [(frame[0], frame[1], frame[5]) for frame in line.sent] == [
        (1, 4, 3),  # unit 1 is proved
        (1, 4, 1),
        (2, 4, 3),  # unit 2 too
        (2, 4, 1),  # asked in vain
        (1, 4, 1),  # unit 1 is still in step
        (2, 3, 3),  # unit 2 is not
        (2, 4, 1),
    ]


def test_a_broadcast_is_not_a_question():
    line, client = over_rtu()
    with pytest.raises(ConfigError, match="unit 0"):
        client.write_registers(0, [1], unit=0)
    assert not line.sent


def test_frames_on_a_serial_line_keep_their_distance():
    line, client = over_rtu(*[honest] * 3)
    for _ in range(3):
        client.read_input(0, 1)
    assert all(later - earlier >= 2_000_000 for earlier, later in pairwise(line.sent_at_ns))


@pytest.mark.fault("F54")
def test_a_line_that_never_falls_silent_is_named():
    line, client = over_rtu()
    line.coming = [(step * 5_000_000, b"\xff") for step in range(1000)]
    with pytest.raises(RemoteProtocolError, match="is never quiet"):
        client.read_input(0, 1)
    assert not line.sent
    assert 0.98e9 < line.clock.time_ns < 1.1e9  # at the deadline: it is slow enough for that


def test_frames_of_others_that_never_stop_are_named_after_few_of_them():
    others = [(step / 1000, rtu(words(*range(100)), unit=9)) for step in range(500)]
    line, client = over_rtu(lambda frame: others)
    with pytest.raises(RemoteProtocolError, match="without an end"):
        client.read_input(0, 1)
    assert len(others) - len(line.coming) < 30


def test_what_gathered_on_a_line_before_a_question_is_no_flood():
    line, client = over_rtu(lambda frame: [rtu(words(42))])
    line.coming.append((0, bytes(4095)))
    assert client.read_input(0, 1) == (42,)


@pytest.mark.fault("F54")
def test_damage_on_a_serial_line_is_an_error_and_the_line_finds_its_place_again():
    damaged = bytearray(rtu(words(41)))
    damaged[3] ^= 1
    line, client = over_rtu(lambda frame: [bytes(damaged)], honest, lambda frame: [rtu(words(42))])
    with pytest.raises(RemoteProtocolError, match="not Modbus") as caught:
        client.read_input(0, 1)
    assert "baud rate" in str(caught.value.remedy)
    assert client.read_input(0, 1) == (42,)
    assert not line.closed


@pytest.mark.fault("F53")
def test_an_echo_is_stripped_where_it_is_expected():
    line, client = over_rtu(lambda frame: [frame[:3], frame[3:] + rtu(words(42))], echo=True)
    assert client.read_input(0, 1) == (42,)
    assert len(line.sent) == 2


@pytest.mark.fault("F53")
def test_an_echo_that_nobody_expects_is_named():
    _, client = over_rtu(lambda frame: [frame[:5], frame[5:], *honest(frame)])
    with pytest.raises(RemoteProtocolError, match="returns what is sent") as caught:
        client.read_input(0, 1)
    assert "echo=yes" in caught.value.remedy


@pytest.mark.parametrize("heard", [b"\x01\x04\x00\x01", rtu(words(42))])
@pytest.mark.fault("F53")
def test_an_echo_that_does_not_come_is_named(heard):
    _, client = over_rtu(lambda frame: [heard], echo=True)
    with pytest.raises(RemoteProtocolError, match="did not return what was sent"):
        client.read_input(0, 1)


def test_a_written_coil_comes_back_as_it_was_sent():
    _, client = over_rtu(lambda frame: [frame])
    client.write_coil(3, True)


def test_a_zero_before_the_answer_of_an_rs_485_line_is_explained():
    _, client = over_rtu(lambda frame: [b"\0" + rtu(words(41))])
    with pytest.raises(TransportTimeoutError) as caught:
        client.read_input(0, 1)
    assert "bias resistors" in str(caught.value.remedy)
