"""tshark dissects the traffic of our client and the simulated PLC over Modbus TCP."""

import struct

import pytest
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import (
    COMMAND_WORDS,
    PROBE,
    RESPONSE_WORDS,
    SLOT_WORDS,
    decode_command,
    decode_response,
    decode_slot,
)
from robolink.transport import parse_url
from tests.peers._pcap import write_modbus_tcp
from tests.peers._relay import Relay
from tests.peers._tshark import (
    WRITTEN,
    complaints,
    dissected,
    require_the_tool_written,
    summaries,
    write_a_tool,
)

REQUESTS, ANSWERS = "mbtcp && tcp.dstport == 502", "mbtcp && tcp.srcport == 502"
REGISTERS = "modbus.regval_uint16"
WRITE_REGISTERS = 16


@pytest.fixture
def dialogue():
    """The traffic while a tool was written."""
    with serve_modbus_tcp(SoftMotionSimulator()) as host:
        port = parse_url(host.url).port
        assert port is not None
        with Relay(port) as relay:
            write_a_tool(f"softmotion+modbus-tcp://127.0.0.1:{relay.port}")
    return relay.dialogue


@pytest.fixture
def capture(dialogue, tmp_path):
    """The capture of it."""
    write_modbus_tcp(tmp_path / "modbus.pcap", dialogue)
    return tmp_path / "modbus.pcap"


def blocks(capture, where):
    """Return the registers of each frame that has some."""
    found = dissected(capture, [REGISTERS], where=f"{where} && {REGISTERS}")
    return [[int(word) for word in text.split(",")] for (text,) in found]


def test_nothing_is_malformed_and_all_of_it_is_modbus(capture, dialogue):
    assert complaints(capture) == []
    assert len(summaries(capture, where="mbtcp")) == len(dialogue)


def test_the_functions_are_16_and_4_and_nothing_is_refused(capture):
    found = dissected(capture, ["modbus.func_code", "modbus.exception_code"], where="mbtcp")
    assert {tuple(fields) for fields in found} == {("16", ""), ("4", "")}


def test_each_answer_carries_the_number_of_its_request(capture):
    asked = dissected(capture, ["mbtcp.trans_id"], where=REQUESTS)
    answered = dissected(capture, ["mbtcp.trans_id"], where=ANSWERS)
    assert asked == answered
    assert len({number for (number,) in asked}) == len(asked)


def test_the_commands_take_the_mailbox_write_the_tool_and_let_go(capture):
    found = [words for words in blocks(capture, REQUESTS) if len(words) == COMMAND_WORDS]
    require_the_tool_written([decode_command(words) for words in found])


def test_the_answers_are_whole_blocks_and_slots(capture):
    found = blocks(capture, ANSWERS)
    responses = [decode_response(words) for words in found if len(words) == RESPONSE_WORDS]
    slots = [decode_slot(words) for words in found if len(words) == SLOT_WORDS]
    assert {response.probe for response in responses} == {PROBE}
    assert not slots[0].defined
    assert slots[-1].tool == pytest.approx(WRITTEN)


def test_an_answer_that_is_too_short_would_have_been_found(dialogue, tmp_path):
    n = next(
        n
        for n, (from_client, frame) in enumerate(dialogue)
        if not from_client and frame[7] == WRITE_REGISTERS
    )
    frame = dialogue[n][1]
    dialogue[n] = (False, frame[:4] + struct.pack(">H", 3) + frame[6:9])
    write_modbus_tcp(tmp_path / "short.pcap", dialogue)
    assert len(complaints(tmp_path / "short.pcap")) == 1
