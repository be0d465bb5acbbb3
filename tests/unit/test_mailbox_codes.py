"""Code tables, counters and the order of words."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.protocols.mailbox import (
    OPCODES,
    Bits,
    BufferMode,
    Capability,
    Command,
    CommandState,
    ErrorClass,
    ExportProfile,
    Kinematics,
    Opcode,
    Response,
    WordOrder,
    beats_for,
    encode_response,
    error_meaning,
    find_kinematics,
    find_probe,
    find_word_order,
    heartbeat_word,
    next_number,
    opcodes_of,
)

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
    # A number once given stays; new members may follow.
    assert [bit.name for bit in Bits][:10] == [
        *("POWERED", "IN_SYNC", "TRACKING", "TOOL_KNOWN", "BUSY"),
        *("JOGGING", "SIMULATED", "OWNED", "INTERRUPTED", "PERMITTED"),
    ]
    assert [code.value for code in Kinematics if code < 32] == list(range(18))
    assert Kinematics(2) is Kinematics.SCARA3_Z
    assert [flag.value for flag in Capability][:6] == [1, 2, 4, 8, 16, 32]


def test_every_error_class_has_words_of_its_own():
    assert len({error_meaning(code) for code in ErrorClass}) == len(ErrorClass)


@pytest.mark.parametrize(("number", "part"), [(199, "mailbox"), (250, "state"), (777, "communic")])
def test_an_unknown_error_class_is_told_by_its_hundreds(number, part):
    assert part in error_meaning(number)


def test_an_error_class_of_no_family_is_told_as_such():
    assert error_meaning(12345) == "an unknown error"


def test_final_states():
    assert [state.name for state in CommandState if state.final] == ["DONE", "ABORTED", "ERROR"]


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(("number", "following"), [(0, 1), (1, 2), (65534, 65535), (65535, 1)])
def test_counters_leave_zero_out(number, following):
    assert next_number(number) == following


@given(st.integers(0, 0xFFFF), st.integers(0, 2000))
@settings(deadline=None, max_examples=50)
def test_a_heartbeat_says_whose_it_is_and_always_changes(epoch, count):
    word, following = heartbeat_word(epoch, count), heartbeat_word(epoch, count + 1)
    assert word != following
    assert beats_for(word, epoch)
    assert not beats_for(word, epoch + 1)


def test_heartbeats_count_from_1_to_255():
    assert [heartbeat_word(0x0102, n) for n in (1, 255, 256)] == [0x0201, 0x02FF, 0x0201]
    assert not beats_for(0x0200, 0x0102)


@pytest.mark.parametrize(
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
    """Operand i3 of opcodes 2102 and 2103 (docs/mailbox.md)."""
    numbered = {mode.name: mode.value for mode in BufferMode}
    assert numbered == {
        "ABORTING": 0,
        "BUFFERED": 1,
        "BLENDING_LOW": 2,
        "BLENDING_PREVIOUS": 3,
        "BLENDING_NEXT": 4,
        "BLENDING_HIGH": 5,
    }
