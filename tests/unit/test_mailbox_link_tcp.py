"""Over TCP: whose answer an answer is, and what a refusal means."""

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
from robolink.transport.modbus.frames import TcpFraming
from robolink.transport.modbus.tcp import TcpExchange
from tests.unit._scripted_modbus import IDENTITY, ScriptedLine, tcp, words


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
    """A gateway kept it from an earlier connection: all of it, or its first bytes so far."""
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
    with pytest.raises(TransportTimeoutError, match="answered 12 bytes, then nothing") as caught:
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
@pytest.mark.parametrize(
    "answer",
    [tcp(words(1, 2), 1), tcp(words(1, function=3), 1), tcp(words(1), 1, unit=1)],
    ids=["length", "function", "unit"],
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


@pytest.mark.parametrize(
    ("code", "kind", "sentence"),
    [
        (1, RejectedError, "illegal function"),
        (2, RejectedError, "illegal data address"),
        (6, RejectedError, "server busy"),
        (4, RemoteProtocolError, "server device failure"),
        (0x0A, ConnectError, "gateway path unavailable"),
        (0x0B, TransportTimeoutError, "gateway target does not respond"),
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


@pytest.mark.parametrize(
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
