"""Blocks written by one end of the mailbox are read by the other."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.protocols.mailbox import (
    Answer,
    Bits,
    BlockError,
    Capability,
    Command,
    CommandState,
    ErrorClass,
    Finished,
    GroupState,
    Kinematics,
    Opcode,
    Response,
    Slot,
    decode_command,
    decode_response,
    decode_slot,
    encode_command,
    encode_response,
    encode_slot,
    kinematics_word,
)
from tests._rows import each_row

UINT = st.integers(0, 0xFFFF)
UDINT = st.integers(0, 0xFFFFFFFF)
LREAL = st.floats(allow_nan=False)
SIX = st.tuples(*[LREAL] * 6)
NAME = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=16)

COMMANDS = st.builds(
    Command,
    sequence=st.integers(1, 0xFFFF),
    opcode=st.sampled_from(Opcode) | UINT,
    group=UINT,
    operands=st.tuples(*[st.integers(-32768, 32767)] * 4),
    pose=SIX,
    dynamics=st.tuples(*[LREAL] * 4),
    name=NAME,
    owner=UDINT,
    epoch=UINT,
    boot_id=UINT,
    version=UINT,
    reserved=UINT,
)
ENDS = st.builds(Finished, UINT, st.sampled_from(CommandState), st.sampled_from(ErrorClass) | UINT)
RESPONSES = st.builds(
    Response,
    version=st.integers(0x0100, 0x01FF),
    ack_head=UINT,
    state=st.sampled_from(CommandState) | UINT,
    error_class=UINT,
    raw_error=st.integers(-(2**31), 2**31 - 1),
    opcode_echo=UINT,
    group_state=st.sampled_from(GroupState) | UINT,
    bits=UINT.map(Bits),
    plc_heartbeat=UINT,
    boot_id=UINT,
    tool_slot=UINT,
    answer=SIX.map(Answer.of_pose) | st.builds(Answer.of_owner, UDINT, UINT),
    tcp=SIX,
    axes=SIX,
    probe=LREAL,
    kinematics=UINT,
    axis_count=UINT,
    capabilities=UINT.map(Capability),
    unit_um=st.floats(width=32, allow_nan=False),
    rejected=UINT,
    active_movement=UINT,
    queue_length=UINT,
    finished=st.tuples(*[ENDS] * 4),
    ack_owner=UDINT,
)


@given(COMMANDS, UINT)
@settings(deadline=None, max_examples=40)
def test_a_plc_reads_the_command_that_was_sent(command, heartbeat):
    words = encode_command(command, heartbeat=heartbeat)
    assert (len(words), words[62]) == (64, heartbeat)
    assert decode_command(words) == command


@given(RESPONSES)
@settings(deadline=None, max_examples=40)
def test_a_client_reads_the_snapshot_that_was_published(response):
    words = encode_response(response)
    assert len(words) == 112
    assert decode_response(words) == response


@given(st.builds(Slot, counter=UINT, defined=st.booleans(), tool=SIX, name=NAME))
@settings(deadline=None, max_examples=25)
def test_a_client_reads_the_slot_that_was_published(slot):
    words = encode_slot(slot)
    assert len(words) == 36
    assert decode_slot(words) == slot


def test_numbers_that_are_known_come_back_by_name():
    words = encode_response(Response(state=10, opcode_echo=30001, group_state=1, error_class=301))
    response = decode_response(words)
    assert response.state is CommandState.DONE
    assert response.opcode_echo is Opcode.SELECT_TOOL
    assert response.group_state is GroupState.STANDBY
    assert response.error_class is ErrorClass.TOOL_INCOMPATIBLE


def test_numbers_of_a_newer_plc_are_kept():
    response = decode_response(
        encode_response(Response(state=12, error_class=488, bits=Bits(4096)))
    )
    assert (response.state, response.error_class, response.bits.value) == (12, 488, 4096)


@pytest.mark.fault("F37")
def test_what_is_not_finite_reaches_the_plc_to_be_refused_there():
    command = Command(1, Opcode.MOVE_LINEAR, pose=(float("nan"),) * 6)
    assert all(value != value for value in decode_command(encode_command(command)).pose)


@given(st.lists(UINT, min_size=24, max_size=24))
@settings(deadline=None, max_examples=25)
def test_no_answer_loses_a_bit_on_its_way(words):
    answer = Answer(tuple(words))
    assert decode_response(encode_response(Response(answer=answer))).answer == answer


def test_the_answer_words_have_three_readings():
    assert Answer.of_owner(0xCAFE0001, 17).words[:4] == (0x0001, 0xCAFE, 17, 0)
    owner = Answer.of_owner(0xCAFE0001, 17)
    assert (owner.holder, owner.epoch) == (0xCAFE0001, 17)
    assert Answer.of_input(513).input_value == 513
    assert Answer.of_pose((1.5, 0, 0, 0, 0, 0)).words[:4] == struct.unpack(
        "<4H", struct.pack("<d", 1.5)
    )


@each_row("words", [(), (0,) * 23, (65536,) + (0,) * 23])
def test_an_answer_of_another_size_cannot_be_made(words):
    with pytest.raises(BlockError):
        Answer(words)


def test_a_coupled_kinematics_is_told_apart_from_the_same_alone():
    alone = Response(kinematics=Kinematics.SCARA2_Z)
    coupled = Response(kinematics=kinematics_word(Kinematics.SCARA2_Z, Kinematics.C_AXIS))
    assert (alone.position_kinematics, alone.orientation_kinematics) == (1, 0)
    assert coupled.position_kinematics == Kinematics.SCARA2_Z
    assert coupled.orientation_kinematics == Kinematics.C_AXIS
