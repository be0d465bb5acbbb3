"""A C program on libmodbus reads the mailbox of the simulated PLC."""

import subprocess

import pytest

from robolink.protocols.mailbox import (
    PROBE,
    RESPONSE_WORDS,
    SLOT_WORDS,
    decode_response,
    decode_slot,
)
from robolink.transport import parse_url
from tests._patience import PATIENCE_S


@pytest.fixture
def read_registers(programs, softmotion_sim):
    """Run the C program and return the blocks that it read."""
    url = parse_url(softmotion_sim.url)
    if url.medium == "modbus-tcp":
        way = ("tcp", url.host, str(url.port))
    else:
        way = ("rtu", url.path, url.options.get("unit", "1"))

    def run(*blocks: int) -> list[list[int]]:
        command = [str(programs / "read_registers"), *way, *map(str, blocks)]
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=PATIENCE_S
        )
        if done.returncode:
            raise RuntimeError(done.stderr.strip())
        return [[int(word, 16) for word in line.split()] for line in done.stdout.splitlines()]

    return run


@pytest.mark.parametrize("softmotion_sim", ["modbus-tcp", "modbus-rtu"], indirect=True)
def test_the_response_block_and_the_first_slot_arrive_whole(read_registers, softmotion_sim):
    block, first = read_registers(0, RESPONSE_WORDS, RESPONSE_WORDS, SLOT_WORDS)
    response, slot = decode_response(block), decode_slot(first)
    assert response.probe == PROBE
    assert slot == softmotion_sim.simulator.plc.memory.slot(1)


@pytest.mark.parametrize("softmotion_sim", ["modbus-tcp", "modbus-rtu"], indirect=True)
def test_a_block_beyond_the_registers_is_refused_by_name(read_registers):
    with pytest.raises(RuntimeError, match="Illegal data address"):
        read_registers(4090, 10)
