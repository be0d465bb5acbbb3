"""mbpoll reads the mailbox of the simulated PLC, and commands it, over TCP and a serial line."""

import re
import struct
import subprocess

import pytest

from robolink.protocols.mailbox import (
    COMMAND_WORDS,
    PROBE,
    RESPONSE,
    RESPONSE_WORDS,
    SLOT_WORDS,
    VERSION,
    Command,
    CommandState,
    Opcode,
    decode_response,
    decode_slot,
    encode_command,
)
from robolink.transport import parse_url
from tests._patience import PATIENCE_S

INPUT, INPUT_HEX, INPUT_REAL, INPUT_BITS, HOLDING = "3", "3:hex", "3:float", "1", "4"

pytestmark = pytest.mark.parametrize("softmotion_sim", ["modbus-tcp", "modbus-rtu"], indirect=True)


@pytest.fixture
def mbpoll(softmotion_sim):
    """Run mbpoll once and return the values that it printed; addresses count from 0."""
    url = parse_url(softmotion_sim.url)
    if url.medium == "modbus-tcp":
        way, place = ["-m", "tcp", "-p", str(url.port)], url.host
    else:
        way, place = ["-m", "rtu", "-b", url.options["baud"], "-P", "none"], url.path

    def run(kind: str, first: int, count: int = 1, *values: int) -> list[str]:
        asked = () if values else ("-c", str(count))
        words = [str(value) for value in values]
        command = ["mbpoll", *way, "-0", "-1", "-t", kind, "-r", str(first), *asked, place, *words]
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=PATIENCE_S
        )
        if done.returncode:
            raise RuntimeError(done.stderr.strip())
        return re.findall(r"^\[\d+\]:\s+(\S+)", done.stdout, re.MULTILINE)

    return run


def words_of(printed: list[str]) -> list[int]:
    """Return the words that mbpoll printed as hexadecimal numbers."""
    return [int(text, 16) for text in printed]


def test_the_probe_reads_as_12_3456_low_word_first(mbpoll):
    words = words_of(mbpoll(INPUT_HEX, RESPONSE.at("probe").start, 4))
    assert struct.unpack("<d", struct.pack("<4H", *words)) == (PROBE,) == (12.3456,)


def test_the_version_stands_in_the_first_register(mbpoll):
    assert mbpoll(INPUT, 0) == [str(VERSION)]


def test_a_real_is_read_as_mbpoll_reads_its_little_endian_floats(mbpoll):
    assert mbpoll(INPUT_REAL, RESPONSE.at("unit_um").start) == ["1000"]


def test_the_heartbeat_moves(mbpoll):
    address = RESPONSE.at("plc_heartbeat").start
    assert mbpoll(INPUT, address) != mbpoll(INPUT, address)


def test_the_whole_block_and_a_slot_are_what_the_codec_expects(mbpoll, softmotion_sim):
    response = decode_response(words_of(mbpoll(INPUT_HEX, 0, RESPONSE_WORDS)))
    slot = decode_slot(words_of(mbpoll(INPUT_HEX, RESPONSE_WORDS, SLOT_WORDS)))
    kept = softmotion_sim.simulator.plc.memory
    assert (response.probe, response.boot_id, response.tool_slot) == (PROBE, kept.boot_id, 1)
    assert slot == kept.slot(1)


def test_discrete_inputs_overlay_the_input_registers(mbpoll):
    bits = mbpoll(INPUT_BITS, 0, 16)
    assert sum(int(bit) << n for n, bit in enumerate(bits)) == VERSION


def test_a_command_that_mbpoll_writes_is_acknowledged(mbpoll):
    command = Command(1, Opcode.OWNERSHIP, operands=(1, 0, 0, 0), owner=0xC0FFEE)
    mbpoll(HOLDING, 0, COMMAND_WORDS, *encode_command(command))
    for _ in range(20):  # the PLC reads it in its next cycle
        response = decode_response(words_of(mbpoll(INPUT_HEX, 0, RESPONSE_WORDS)))
        if response.ack_head:
            break
    assert (response.ack_head, response.state) == (1, CommandState.DONE)
    assert response.answer.holder == 0xC0FFEE


def test_registers_that_do_not_exist_are_refused_by_name(mbpoll):
    with pytest.raises(RuntimeError, match="Illegal data address"):
        mbpoll(INPUT, 4090, 10)
