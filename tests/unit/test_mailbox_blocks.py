"""The mailbox's blocks, code tables and counters: as in the register map, complete or refused."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymodbus.framer.rtu import FramerRTU

from robolink.protocols.mailbox import (
    COMMAND,
    COMMAND_WORDS,
    OPCODES,
    RESPONSE,
    RESPONSE_WORDS,
    SLOT,
    SLOT_WORDS,
    Bits,
    BlockError,
    BlockFault,
    BufferMode,
    Capability,
    Command,
    CommandState,
    ErrorClass,
    ExportProfile,
    Field,
    Kinematics,
    Layout,
    Opcode,
    Response,
    Slot,
    WordOrder,
    WordType,
    beats_for,
    crc16,
    decode_command,
    decode_response,
    decode_slot,
    encode_command,
    encode_response,
    encode_slot,
    error_meaning,
    find_kinematics,
    find_probe,
    find_word_order,
    heartbeat_word,
    next_number,
    opcodes_of,
    slot_start,
)
from tests._rows import each_row

# The mailbox's blocks: layout as in the register map, complete or refused.

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
@settings(deadline=None, max_examples=25)
def test_the_checksum_is_the_one_of_modbus_rtu(words):
    data = b"".join(word.to_bytes(2, "little") for word in words)
    swapped = FramerRTU.compute_CRC(data)  # as sent: low byte first
    assert crc16(words) == (swapped & 0xFF) << 8 | swapped >> 8


def test_the_checksum_of_a_known_request():
    # The RTU request 01 03 00 00 00 01 ends in 84 0A, as every Modbus tutorial shows.
    assert crc16([0x0301, 0x0000, 0x0100]) == 0x0A84


def test_the_blocks_have_their_sizes():
    assert (COMMAND_WORDS, RESPONSE_WORDS, SLOT_WORDS) == (64, 112, 36)
    assert (slot_start(1), slot_start(2), slot_start(15)) == (112, 148, 616)


@each_row(
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
@each_row("name", BLOCKS)
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
@each_row("cut", range(1, 64))
def test_f28_f32_a_torn_command_is_refused(cut):
    old = encode_command(WRITE)
    new = encode_command(Command(4712, Opcode.SELECT_TOOL, owner=1))
    assert fault_of(decode_command, new[:cut] + old[cut:]) is BlockFault.TORN
    assert fault_of(decode_command, old[:cut] + new[cut:]) is BlockFault.TORN


@pytest.mark.fault("F31")
@given(st.integers(1, 111), st.tuples(*[st.floats(-500, 500)] * 6), st.integers(1, 65535))
@settings(deadline=None, max_examples=40)
def test_a_torn_snapshot_is_refused_or_is_one_of_the_two(cut, tcp, ack):
    old = encode_response(SNAPSHOT)
    new = encode_response(Response(ack_head=ack, tcp=tcp, plc_heartbeat=1))
    torn = new[:cut] + old[cut:]
    if torn != old:
        assert fault_of(decode_response, torn) in (BlockFault.TORN, BlockFault.CRC)


@pytest.mark.fault("F29", "F30")
def test_zeroes_are_no_command():
    # The holding registers after a CODESYS watchdog has zeroed them.
    assert fault_of(decode_command, (0,) * 64) is BlockFault.EMPTY


@pytest.mark.fault("F30")
@pytest.mark.parametrize("name", ["response", "slot"])
def test_zeroes_are_nobodys_answer(name):
    words, decode = BLOCKS[name]
    assert fault_of(decode, (0,) * len(words)) is BlockFault.EMPTY


@each_row("name", BLOCKS)
@each_row("change", [lambda w: w[:-1], lambda w: (*w, 0), lambda w: ()])
def test_another_number_of_words_is_refused(name, change):
    words, decode = BLOCKS[name]
    assert fault_of(decode, change(words)) is BlockFault.LENGTH


def test_a_refused_checksum_names_the_block_it_stood_in():
    words = list(encode_command(WRITE))
    words[61] ^= 1
    with pytest.raises(BlockError) as caught:
        decode_command(words)
    assert (caught.value.head, caught.value.crc) == (4711, words[61])


@each_row("version", [0x0000, 0x0200, 0xFF00])
def test_a_command_of_another_major_is_read_to_be_refused_by_name(version):
    command = decode_command(encode_command(Command(1, Opcode.STOP, owner=5, version=version)))
    assert (command.refusal(), command.owner) == (ErrorClass.VERSION, 5)


@each_row(
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


@each_row(
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


# Code tables, counters and the order of words.

# docs/reference/softmotion.md 4.4
LOW_FIRST = (0xFEC5, 0x7BB2, 0xB0F2, 0x4028)


def test_every_opcode_has_its_facts():
    assert tuple(OPCODES) == tuple(Opcode)


def test_the_tools_profile_holds_no_motion():
    assert opcodes_of(ExportProfile.TOOLS) == (
        Opcode.WRITE_TOOL,
        Opcode.SELECT_TOOL,
        Opcode.READ_TOOL,
        Opcode.CLEAR_TOOL,
        Opcode.OWNERSHIP,
    )
    assert ExportProfile.TOOLS.capabilities is Capability.TOOLS


def test_the_full_profile_holds_everything():
    assert opcodes_of(ExportProfile.FULL) == tuple(Opcode)
    assert all(capability in ExportProfile.FULL.capabilities for capability in Capability)


def test_only_stop_halt_and_ownership_need_no_owner():
    free = {code for code, facts in OPCODES.items() if not facts.needs_owner}
    assert free == {Opcode.STOP, Opcode.HALT, Opcode.OWNERSHIP}


def test_to_end_a_jog_needs_no_owner_and_to_press_a_button_does():
    assert not Command(1, Opcode.JOG, operands=(0, 0, 5, 0)).needs_owner
    assert Command(1, Opcode.JOG, operands=(1, 0, 0, 0)).needs_owner
    assert Command(1, Opcode.JOG, operands=(0, 1, 0, 0)).needs_owner
    assert Command(1, Opcode.JOG, operands=(1, 1, 0, 0)).needs_owner


def test_what_reads_or_stops_needs_no_permit():
    free = {code for code in OPCODES if not Command(1, code).needs_permit}
    assert free == {
        Opcode.INTERRUPT,
        Opcode.STOP,
        Opcode.HALT,
        Opcode.JOG,  # which presses no button
        Opcode.OWNERSHIP,
        Opcode.READ_TOOL,
        Opcode.READ_INPUT,
    }


def test_to_release_a_held_stop_or_to_press_a_button_needs_the_permit():
    assert Command(1, Opcode.STOP, operands=(1, 0, 0, 0)).needs_permit
    assert Command(1, Opcode.JOG, operands=(0, 1, 0, 0)).needs_permit


def test_codes_are_append_only():
    # An assigned number never changes; new members may follow.
    assert [bit.name for bit in Bits][:10] == [
        *("POWERED", "IN_SYNC", "TRACKING", "TOOL_KNOWN", "BUSY"),
        *("JOGGING", "SIMULATED", "OWNED", "INTERRUPTED", "PERMITTED"),
    ]
    assert [code.value for code in Kinematics if code < 32] == list(range(18))
    assert Kinematics(2) is Kinematics.SCARA3_Z
    assert [flag.value for flag in Capability][:6] == [1, 2, 4, 8, 16, 32]


def test_every_error_class_has_words_of_its_own():
    assert len({error_meaning(code) for code in ErrorClass}) == len(ErrorClass)


@each_row(("number", "part"), [(199, "mailbox"), (250, "state"), (777, "communic")])
def test_an_unknown_error_class_is_told_by_its_hundreds(number, part):
    assert part in error_meaning(number)


def test_an_error_class_of_no_family_is_told_as_such():
    assert error_meaning(12345) == "an unknown error"


def test_final_states():
    assert [state.name for state in CommandState if state.final] == ["DONE", "ABORTED", "ERROR"]


@each_row(
    ("name", "code"),
    [
        ("Kin_Scara3_Z", Kinematics.SCARA3_Z),
        ("Kin_CAxis", Kinematics.C_AXIS),
        ("Kin_Unknown", None),
        ("", None),
    ],
)
def test_kinematics_are_found_by_the_name_of_their_block(name, code):
    assert find_kinematics(name) is code


@each_row(("number", "following"), [(0, 1), (1, 2), (65534, 65535), (65535, 1)])
def test_counters_leave_zero_out(number, following):
    assert next_number(number) == following


@given(st.integers(0, 0xFFFF), st.integers(0, 2000))
@settings(deadline=None, max_examples=25)
def test_a_heartbeat_says_whose_it_is_and_always_changes(epoch, count):
    word, following = heartbeat_word(epoch, count), heartbeat_word(epoch, count + 1)
    assert word != following
    assert beats_for(word, epoch)
    assert not beats_for(word, epoch + 1)


def test_heartbeats_count_from_1_to_255():
    assert [heartbeat_word(0x0102, n) for n in (1, 255, 256)] == [0x0201, 0x02FF, 0x0201]
    assert not beats_for(0x0200, 0x0102)


@each_row(
    ("words", "order"),
    [
        (LOW_FIRST, WordOrder.LOW_FIRST),
        (LOW_FIRST[::-1], WordOrder.HIGH_FIRST),
        ((0x7BB2, 0xFEC5, 0x4028, 0xB0F2), WordOrder.PAIRS_SWAPPED),
        ((0xB0F2, 0x4028, 0xFEC5, 0x7BB2), WordOrder.HALVES_SWAPPED),
        ((0xC5FE, 0xB27B, 0xF2B0, 0x2840), WordOrder.LOW_FIRST_BYTES_SWAPPED),
        ((0x2840, 0xF2B0, 0xB27B, 0xC5FE), WordOrder.HIGH_FIRST_BYTES_SWAPPED),
        ((0, 0, 0, 0), None),
        (LOW_FIRST[:3], None),
    ],
)
def test_the_probe_tells_the_order_of_words(words, order):
    assert find_word_order(words) is order


def test_no_two_orders_are_called_the_same():
    assert len({order.meaning for order in WordOrder}) == len(WordOrder)


def test_the_probe_is_found_where_a_wrong_base_has_moved_it():
    words = encode_response(Response())
    assert find_probe(words) == (84, WordOrder.LOW_FIRST)
    assert find_probe((*words[1:], 0)) == (83, WordOrder.LOW_FIRST)
    assert find_probe(words[::-1]) == (24, WordOrder.HIGH_FIRST)
    assert find_probe((0,) * 112) is None


def test_the_modes_of_a_movement_have_the_numbers_of_the_page():
    """Operand i3 of opcodes 2102 and 2103 (docs/reference/mailbox.md)."""
    numbered = {mode.name: mode.value for mode in BufferMode}
    assert numbered == {
        "ABORTING": 0,
        "BUFFERED": 1,
        "BLENDING_LOW": 2,
        "BLENDING_PREVIOUS": 3,
        "BLENDING_NEXT": 4,
        "BLENDING_HIGH": 5,
    }
