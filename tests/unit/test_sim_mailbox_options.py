"""Options of a simulated PLC as text, and how a PLC may lay its words."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.softmotion.mailbox.image import Bank, arranged, places_of
from robolink_simulators.softmotion.mailbox.option_text import (
    option_names,
    options_from_text,
    parameters_from_text,
)

from robolink.errors import ConfigError
from robolink.protocols.mailbox import (
    COMMAND,
    PROBE,
    RESPONSE,
    Command,
    Opcode,
    Response,
    WordOrder,
    encode_command,
    encode_response,
)

ORDERS = [
    WordOrder.LOW_FIRST,
    WordOrder.HIGH_FIRST,
    WordOrder.PAIRS_SWAPPED,
    WordOrder.HALVES_SWAPPED,
]


def test_options_reach_the_part_that_they_are_about():
    options = options_from_text(
        {
            "profile": "tools",
            "unit_um": "25400",
            "latch": "edge",
            "numbers.unreachable": "10123",
            "snapshot_latched": "no",
        }
    )
    assert (options.mailbox.profile, options.mailbox.unit_um) == ("tools", 25400.0)
    assert (options.group.latch, options.group.numbers.unreachable) == ("edge", 10123)
    assert options.mailbox.snapshot_latched is False
    assert len(set(option_names())) == len(option_names())


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ({"colour": "red"}, "no option 'colour'"),
        ({"profile": "some"}, "full, tools"),
        ({"unit_um": "0"}, "above 0"),
        ({"program_cycle_us": "0"}, "above 0"),
        ({"cycle_us": "9000000"}, "above 0"),
        ({"watchdog_ms": "-1"}, "0 or more"),
        ({"response": "4000"}, "4096 registers"),
        ({"slots": "100"}, "response and slots overlap"),
        ({"registers": "holding"}, "command and response overlap"),
    ],
)
def test_a_wrong_option_is_named(pairs, words):
    with pytest.raises(ConfigError) as caught:
        options_from_text(pairs)
    assert words in f"{caught.value} {caught.value.remedy}"


def test_a_parameter_is_a_number():
    assert parameters_from_text({"dArmLength1": "250.5"}) == {"dArmLength1": 250.5}
    with pytest.raises(ConfigError, match="dArmLength1 cannot be 'long'"):
        parameters_from_text({"dArmLength1": "long"})


def test_the_blocks_stand_where_the_options_say():
    pairs = {"registers": "holding", "response": "100", "slots": "1000"}
    command, response, slots = places_of(options_from_text(pairs).mailbox)
    assert (command.start, command.end, command.written) == (0, 64, True)
    assert (response.bank, response.start, response.first) == (Bank.HOLDING, 100, 0)
    assert (slots.bank, slots.start, slots.first) == (Bank.HOLDING, 1000, 112)


@pytest.mark.parametrize("order", ORDERS)
@given(x=st.floats(-1e6, 1e6), raw=st.integers(-(2**31), 2**31 - 1))
@settings(max_examples=25, deadline=None)
def test_another_word_order_twice_is_none_and_the_checksum_stays_right(order, x, raw):
    block = encode_response(Response(tcp=(x, 2.0, 3.0, 4.0, 5.0, 6.0), raw_error=raw))
    moved = arranged(RESPONSE, block, order)
    assert RESPONSE.intact(moved)
    assert arranged(RESPONSE, moved, order) == block
    assert moved[:4] == block[:4]


@pytest.mark.parametrize("order", ORDERS)
def test_a_damaged_block_stays_damaged(order):
    words = list(encode_command(Command(1, Opcode.HALT)))
    words[9] ^= 1
    assert not COMMAND.intact(arranged(COMMAND, words, order))


def test_high_first_turns_every_value_of_several_words():
    block = encode_response(Response(ack_owner=0x12345678, unit_um=1000.0))
    moved = arranged(RESPONSE, block, WordOrder.HIGH_FIRST)
    assert moved[RESPONSE.at("probe")] == block[RESPONSE.at("probe")][::-1]
    assert moved[RESPONSE.at("ack_owner")] == (0x1234, 0x5678)
    assert RESPONSE.unpack(block)["probe"] == PROBE
