"""The exchanges of docs/reference/epson.md 6, replayed through both roles."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import (
    BadRequest,
    EpsonTextCodec,
    Event,
    Refusal,
    Reply,
    Request,
    StatusFlags,
    parse_status,
)
from robolink.protocols.spel import parse_point
from tests._rows import each_row

FILE = Path(__file__).parents[1] / "transcripts" / "epson_text.toml"
EXCHANGES: list[dict[str, Any]] = tomllib.loads(FILE.read_text("utf-8"))["exchange"]
TERMINATORS = (b"\r\n", b"\r", b"\n")


def one_event(role: Role, data: bytes) -> Event:
    codec = EpsonTextCodec(role)
    codec.receive_data(data)
    event = codec.next_event()
    assert event is not NEED_DATA
    assert codec.next_event() is NEED_DATA
    assert codec.bytes_held == b""
    return event


def answered(vector: int) -> list[Event]:
    lines = [e["reply"] for e in EXCHANGES if e["vector"] == vector]
    return [one_event(Role.HOST, line.encode() + b"\r\n") for line in lines]


def test_every_vector_is_there():
    assert {e["vector"] for e in EXCHANGES} == {*range(1, 17), *range(21, 25)}
    assert {e["evidence"] for e in EXCHANGES} == {"seen", "documented", "computed"}


@each_row("terminator", TERMINATORS)
@each_row("exchange", EXCHANGES)
def test_a_request_is_read_by_the_device_and_written_by_the_host(exchange, terminator):
    line = exchange["request"].encode()
    event = one_event(Role.DEVICE, line + terminator)
    if isinstance(event, BadRequest):
        assert exchange["reply"] == f"!{event.name},{event.code}"
        return
    assert isinstance(event, Request)
    written = EpsonTextCodec(Role.HOST, terminator=terminator).send(event)
    surplus = b",terminator" if exchange["vector"] == 21 else b""
    assert written == line.removesuffix(surplus) + terminator


@each_row("terminator", TERMINATORS)
@each_row("exchange", [e for e in EXCHANGES if "reply" in e])
def test_an_answer_is_read_by_the_host_and_written_by_the_device(exchange, terminator):
    line = exchange["reply"].encode()
    event = one_event(Role.HOST, line + terminator)
    assert isinstance(event, (Reply, Refusal))
    assert event.name == exchange["request"].lstrip("$").partition(",")[0]
    written = EpsonTextCodec(Role.DEVICE, terminator=terminator).send(event)
    assert written == line.replace(b"\r\n", b"") + terminator


def test_the_login_without_terminator_is_read_at_the_end_of_its_segment():
    [exchange] = [e for e in EXCHANGES if e["vector"] == 21]
    codec = EpsonTextCodec(Role.DEVICE, unterminated=True)
    codec.receive_data(exchange["request"].encode())
    codec.end_of_request()
    assert codec.next_event() == Request("Login", ("",))


def test_the_seen_states_have_the_flags_that_their_writers_saw():
    [running] = answered(4)
    [ready] = answered(12)
    assert isinstance(running, Reply)
    assert isinstance(ready, Reply)
    assert parse_status(running) == (StatusFlags(auto=True, running=True), 0)
    assert parse_status(ready) == (StatusFlags(auto=True, ready=True), 0)


def test_a_busy_controller_refuses_with_20_and_still_stops():
    assert answered(5) == [Refusal("Reset", 20)]
    assert answered(6) == [Refusal("SetMotorsOn", 20), Refusal("SetMotorsOff", 20)]
    assert answered(7) == [Reply(name, ("0",)) for name in ("Pause", "Stop", "Logout")]


def test_the_printed_position_is_the_same_with_and_without_the_inner_line_end():
    bare, with_line_end = answered(10)
    assert isinstance(bare, Reply)
    assert bare == with_line_end
    assert bare.text is not None
    point = parse_point(bare.text)
    assert point.coordinates == (-182.632, 240.114, -20.002, -36.156, 0.0, 0.0)
    assert point.flags == ("R", "0")


def test_the_measured_position_is_not_the_commanded_one():
    before, _ = answered(10)
    [after] = answered(11)
    assert isinstance(before, Reply)
    assert isinstance(after, Reply)
    assert before.text is not None
    assert after.text is not None
    old, new = parse_point(before.text), parse_point(after.text)
    assert new.coordinates[0] - old.coordinates[0] == pytest.approx(-0.998)
    assert new.coordinates[1] - old.coordinates[1] == pytest.approx(0.001)
