"""The mailbox, with nearly valid blocks whose checksum is correct."""

import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import strategies as st
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.controller_outcome import Effect
from robolink.errors import RobolinkError
from robolink.model import ANY, ToolOffset
from robolink.protocols.mailbox import (
    BlockError,
    Command,
    Opcode,
    Response,
    Slot,
    decode_command,
    decode_device_id,
    decode_response,
    decode_slot,
    encode_command,
    encode_device_id,
    encode_response,
    encode_slot,
)
from tests._rows import each_row
from tests.fuzz._mutating import LREALS, WORDS, edited_words, fuzzed, sealed
from tests.unit._mailbox_client import linked, owning
from tests.unit.softmotion_driver._cell import Cell

COMMAND_CRC, RESPONSE_CRC, SLOT_CRC = 61, 110, 34
LONGEST_MM = 10_000.0
TOOL = (12.5, -3.25, -20.0, 30.0, 0.0, 0.0)
DYNAMICS = (100.0, 1000.0, 1000.0, 10000.0)

RESPONSE = encode_response(Response(ack_head=7, tcp=TOOL, axes=TOOL))
SLOT = encode_slot(Slot(counter=3, defined=True, tool=TOOL, name="nozzle"))
COMMAND = encode_command(
    Command(5, Opcode.WRITE_TOOL, operands=(3, 0, 0, 0), pose=TOOL, name="n", owner=9), heartbeat=1
)
"""Valid blocks."""


@fuzzed(10, 20_000, words=edited_words(RESPONSE))
def test_a_response_is_decoded_or_refused(words):
    for block in (words, sealed(words, RESPONSE_CRC)):
        try:
            response = decode_response(block)
        except BlockError:
            continue
        again = decode_response(encode_response(response))
        # By its text, in which even a NaN equals itself.
        assert repr(again) == repr(response)


@fuzzed(10, 20_000, words=edited_words(SLOT))
def test_a_slot_is_decoded_or_refused(words):
    for block in (words, sealed(words, SLOT_CRC)):
        try:
            slot = decode_slot(block)
        except BlockError:
            continue
        assert slot.defined in (True, False)
        assert len(slot.name) <= 16


@fuzzed(10, 20_000, words=edited_words(COMMAND))
def test_a_command_is_decoded_or_refused(words):
    for block in (words, sealed(words, COMMAND_CRC)):
        try:
            command = decode_command(block)
        except BlockError:
            continue
        command.refusal()
        assert command.only_ends in (True, False)


@fuzzed(10, 20_000, words=edited_words(encode_device_id(0x1234_BEEF)))
def test_a_device_number_is_decoded_or_refused(words):
    with suppress(BlockError):
        number = decode_device_id(words)
        # Four words of 0 come from a program without a number.
        assert number is None or 0 < number < 2**32


@each_row("length", [0, 1, 63, 64, 65, 111, 112, 113])
def test_a_block_of_another_length_is_refused(length):
    for decode, own in ((decode_response, 112), (decode_slot, 36), (decode_command, 64)):
        if length != own:
            with pytest.raises(BlockError):
                decode((0,) * length)


@fuzzed(4, 1500, data=st.data())
def test_a_plc_stays_sound_whatever_command_it_is_given(data):
    client, simulator = owning()
    for _ in range(12):
        opcode = data.draw(st.sampled_from(Opcode))
        draft = client.command(
            opcode,
            data.draw(st.sampled_from((0, 1, 3, 15, 16, -1))),
            # Usually one impossible number: whole random words are refused for another reason.
            pose=with_one_of(TOOL, data.draw(st.integers(0, 11)), data.draw(LREALS)),
            dynamics=with_one_of(DYNAMICS, data.draw(st.integers(0, 11)), data.draw(LREALS)),
        )
        words = list(encode_command(draft, heartbeat=1))
        if data.draw(st.integers(0, 3)) == 0:
            words = data.draw(edited_words(tuple(words)))
        words[0] = draft.sequence  # otherwise it would be no command at all
        client.link.write_command(sealed(words, COMMAND_CRC))
        client.wait(data.draw(st.sampled_from((0.0, 0.01, 0.6))))
        check_is_sound(client)
    # A stop is accepted whatever went before, also from another client.
    stranger = linked(simulator, owner=0xBADCAFE)
    stranger.tell(Opcode.STOP)
    client.wait(2.0)
    assert client.now().active_movement == 0


def with_one_of(numbers, at, other):
    """Return numbers with one of them replaced; none if there is no such place."""
    return tuple(other if place == at else number for place, number in enumerate(numbers))


def check_is_sound(client):
    """Check that the PLC's output can be read, and that it holds no forbidden tool."""
    now = client.now()
    assert all(map(math.isfinite, (*now.tcp, *now.axes, *now.answer.pose)))
    for number in range(1, 16):
        slot = client.slot(number)
        if slot.defined:
            assert all(abs(length) <= LONGEST_MM for length in slot.tool[:3])
            assert all(map(math.isfinite, slot.tool))


OLD, NEW = ToolOffset(12.5, -3.25, -20.0, 30.0), ToolOffset(12.75, -3.0, -20.5, 30.0)
READS = (
    lambda it: it.status(),
    lambda it: it.facts(),
    lambda it: it.tools.read(1),
    lambda it: it.tools.selected(),
    lambda it: it.groups[0].pose(),
    lambda it: it.condition(),
    lambda it: it.verify(),
)


@pytest.mark.fault("F07")
@fuzzed(6, 2500, data=st.data())
def test_the_driver_reads_or_refuses_whatever_a_plc_answers(data):
    cell = Cell()
    try:
        controller = cell.met()
        edits = data.draw(st.lists(st.tuples(st.integers(1, 109), WORDS), min_size=1, max_size=4))

        def distorted(words):
            changed = list(words)
            for at, word in edits:
                changed[at] = word
            return sealed(changed, RESPONSE_CRC)

        slot = sealed(data.draw(edited_words(SLOT)), SLOT_CRC)
        slot = (*slot[:-2], slot[-2], slot[0])
        link: Any = cell.link
        link.response, link.read_slot = distorted, lambda _number: slot
        for read in READS:
            with suppress(RobolinkError):
                found = read(controller)
                if isinstance(found, ToolOffset):
                    assert all(map(math.isfinite, found.components()))
    finally:
        cell.close()


@fuzzed(6, 2500, data=st.data())
def test_a_write_is_called_done_only_when_the_slot_holds_it(data):
    cell = Cell()
    try:
        controller = cell.met()
        controller.tools.write(1, OLD, expected=ANY)
        at, word = data.draw(st.integers(1, 109)), data.draw(WORDS)
        after = data.draw(st.integers(0, 6))
        seen = 0

        def distorted(words):
            nonlocal seen
            seen += 1
            if seen <= after:
                return words
            return sealed([*words[:at], word, *words[at + 1 :]], RESPONSE_CRC)

        cell.link.response = distorted
        said = None
        try:
            controller.tools.write(1, NEW, expected=OLD)
        except RobolinkError as error:
            said = error
        held = cell.plc.slots[1].tool[:3] == pytest.approx(NEW.components()[:3])
        if said is None:
            assert held
        elif held:
            assert said.controller_state.effect is not Effect.UNCHANGED
    finally:
        cell.close()


def test_a_command_that_is_nearly_right_does_get_past_the_door():
    """The seeds of the above are accepted unchanged, so only the edits are under test."""
    simulator = SoftMotionSimulator()
    client, _ = owning(simulator)
    done = client.done(Opcode.WRITE_TOOL, 3, pose=TOOL, name="n")
    assert decode_response(encode_response(replace(done))).ack_head == done.ack_head
    assert client.slot(3).tool == pytest.approx(TOOL)
