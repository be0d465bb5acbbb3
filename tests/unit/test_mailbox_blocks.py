"""The mailbox's blocks: layout as in the register map, whole or refused."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymodbus.framer.rtu import FramerRTU

from robolink.protocols.mailbox import (
    COMMAND,
    COMMAND_WORDS,
    RESPONSE,
    RESPONSE_WORDS,
    SLOT,
    SLOT_WORDS,
    BlockError,
    BlockFault,
    Command,
    ErrorClass,
    Field,
    Layout,
    Opcode,
    Response,
    Slot,
    WordType,
    crc16,
    decode_command,
    decode_response,
    decode_slot,
    encode_command,
    encode_response,
    encode_slot,
    slot_start,
)

WORDS = st.lists(st.integers(0, 0xFFFF), max_size=112)
POSE = (412.5, -103.25, 87.125, 30.0, 40.0, 50.0)
WRITE = Command(
    4711, Opcode.WRITE_TOOL, operands=(7, 0, 0, 0), pose=POSE, name="needle 0.4", owner=0xCAFE0001
)
SNAPSHOT = Response(ack_head=4711, ack_owner=0xCAFE0001, tcp=POSE, boot_id=9)
BLOCKS = {
    "command": (encode_command(WRITE, heartbeat=0x0203), decode_command),
    "response": (encode_response(SNAPSHOT), decode_response),
    "slot": (encode_slot(Slot(3, True, POSE, "needle")), decode_slot),
}


def fault_of(decode, words):
    with pytest.raises(BlockError) as caught:
        decode(words)
    return caught.value.fault


@given(WORDS)
@settings(deadline=None, max_examples=50)
def test_the_checksum_is_the_one_of_modbus_rtu(words):
    data = b"".join(word.to_bytes(2, "little") for word in words)
    swapped = FramerRTU.compute_CRC(data)  # as it goes over the wire: low byte first
    assert crc16(words) == (swapped & 0xFF) << 8 | swapped >> 8


def test_the_checksum_of_a_known_request():
    # The RTU request 01 03 00 00 00 01 ends in 84 0A, as every Modbus tutorial shows.
    assert crc16([0x0301, 0x0000, 0x0100]) == 0x0A84


def test_the_blocks_have_their_sizes():
    assert (COMMAND_WORDS, RESPONSE_WORDS, SLOT_WORDS) == (64, 112, 36)
    assert (slot_start(1), slot_start(2), slot_start(15)) == (112, 148, 616)


@pytest.mark.parametrize(
    ("layout", "places"),
    [
        (COMMAND, {"i3": 7, "pose": 8, "dyn": 32, "name": 48, "owner": 56, "crc": 61}),
        (RESPONSE, {"raw_error": 4, "answer": 12, "probe": 84, "unit_um": 91, "crc": 110}),
        (SLOT, {"tool": 2, "name": 26, "crc": 34, "counter_tail": 35}),
    ],
)
def test_fields_stand_where_the_register_map_says(layout, places):
    assert {name: layout[name].word for name in places} == places


def test_a_layout_with_a_gap_cannot_be_made():
    with pytest.raises(ValueError, match="follow"):
        Layout(Field(0, "one", WordType.UINT), Field(2, "two", WordType.UINT))


def test_a_command_word_by_word():
    words = encode_command(WRITE, heartbeat=0x0203)
    assert words[:8] == (4711, 5205, 1, 0x0100, 7, 0, 0, 0)
    assert words[8:12] == (0, 0, 0xC800, 0x4079)  # 412.5, low word first
    assert words[48:51] == (0x656E, 0x6465, 0x656C)  # "ne", "ed", "le"
    assert words[56:60] == (0x0001, 0xCAFE, 0, 0)
    assert (words[60], words[62], words[63]) == (0, 0x0203, 4711)


def test_the_probe_lies_low_word_first():
    # docs/reference/softmotion.md 4.4
    assert encode_response(SNAPSHOT)[84:88] == (0xFEC5, 0x7BB2, 0xB0F2, 0x4028)


@pytest.mark.fault("F07")
@pytest.mark.parametrize("name", BLOCKS)
def test_f07_any_single_flipped_bit_is_refused(name):
    words, decode = BLOCKS[name]
    for word in range(len(words)):
        if name == "command" and word == COMMAND["client_heartbeat"].word:
            continue
        for bit in range(16):
            broken = list(words)
            broken[word] ^= 1 << bit
            with pytest.raises(BlockError):
                decode(broken)


def test_the_heartbeat_may_change_alone():
    one, other = encode_command(WRITE, heartbeat=1), encode_command(WRITE, heartbeat=2)
    assert [n for n in range(64) if one[n] != other[n]] == [62]
    assert decode_command(one) == decode_command(other) == WRITE


@pytest.mark.fault("F28", "F32")
@pytest.mark.parametrize("cut", range(1, 64))
def test_f28_f32_a_torn_command_is_refused(cut):
    old = encode_command(WRITE)
    new = encode_command(Command(4712, Opcode.SELECT_TOOL, owner=1))
    assert fault_of(decode_command, new[:cut] + old[cut:]) is BlockFault.TORN
    assert fault_of(decode_command, old[:cut] + new[cut:]) is BlockFault.TORN


@pytest.mark.fault("F31")
@given(st.integers(1, 111), st.tuples(*[st.floats(-500, 500)] * 6), st.integers(1, 65535))
@settings(deadline=None, max_examples=100)
def test_a_torn_snapshot_is_refused_or_is_one_of_the_two(cut, tcp, ack):
    old = encode_response(SNAPSHOT)
    new = encode_response(Response(ack_head=ack, tcp=tcp, plc_heartbeat=1))
    torn = new[:cut] + old[cut:]
    if torn != old:
        assert fault_of(decode_response, torn) in (BlockFault.TORN, BlockFault.CRC)


@pytest.mark.fault("F29", "F30")
def test_zeroes_are_no_command():
    # What a CODESYS watchdog leaves of the holding registers.
    assert fault_of(decode_command, (0,) * 64) is BlockFault.EMPTY


@pytest.mark.fault("F30")
@pytest.mark.parametrize("name", ["response", "slot"])
def test_zeroes_are_nobodys_answer(name):
    words, decode = BLOCKS[name]
    assert fault_of(decode, (0,) * len(words)) is BlockFault.EMPTY


@pytest.mark.parametrize("name", BLOCKS)
@pytest.mark.parametrize("change", [lambda w: w[:-1], lambda w: (*w, 0), lambda w: ()])
def test_another_number_of_words_is_refused(name, change):
    words, decode = BLOCKS[name]
    assert fault_of(decode, change(words)) is BlockFault.LENGTH


def test_a_refused_checksum_names_the_block_it_stood_in():
    words = list(encode_command(WRITE))
    words[61] ^= 1
    with pytest.raises(BlockError) as caught:
        decode_command(words)
    assert (caught.value.head, caught.value.crc) == (4711, words[61])


@pytest.mark.parametrize("version", [0x0000, 0x0200, 0xFF00])
def test_a_command_of_another_major_is_read_to_be_refused_by_name(version):
    command = decode_command(encode_command(Command(1, Opcode.STOP, owner=5, version=version)))
    assert (command.refusal(), command.owner) == (ErrorClass.VERSION, 5)


@pytest.mark.parametrize(
    ("command", "refusal"),
    [
        (Command(1, Opcode.HALT, version=0x01FF), ErrorClass.NONE),
        (Command(1, Opcode.HALT, reserved=1), ErrorClass.RESERVED_NOT_ZERO),
        (Command(1, Opcode.HALT, group=2), ErrorClass.OPERAND),
    ],
)
def test_what_is_refused_whatever_the_opcode(command, refusal):
    assert decode_command(encode_command(command)).refusal() is refusal


def test_a_snapshot_of_another_major_is_refused_and_of_another_minor_is_read():
    assert fault_of(decode_response, encode_response(Response(version=0x0200))) is (
        BlockFault.VERSION
    )
    assert decode_response(encode_response(Response(version=0x0105))).version == 0x0105


@pytest.mark.parametrize(
    "command",
    [
        Command(0, Opcode.HALT),
        Command(65536, Opcode.HALT),
        Command(1, Opcode.HALT, operands=(32768, 0, 0, 0)),
        Command(1, Opcode.HALT, owner=-1),
        Command(1, Opcode.WRITE_TOOL, name="x" * 17),
        Command(1, Opcode.WRITE_TOOL, name="Nadel ß"),
        Command(1, Opcode.WRITE_TOOL, name="a\nb"),
    ],
)
def test_what_does_not_fit_is_not_sent(command):
    with pytest.raises(BlockError) as caught:
        encode_command(command)
    assert caught.value.fault is BlockFault.VALUE
    assert "does not fit" in str(caught.value)


def test_a_slot_name_that_a_plc_fills_with_other_bytes_is_shown():
    values = {"counter": 1, "defined": 1, "tool": (0.0,) * 6, "name": b"D\xfcse\0rest"}
    assert decode_slot(SLOT.pack(values | {"counter_tail": 1})).name == "Düse"
