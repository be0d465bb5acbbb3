"""The commands that the simulated mailbox program carries out, by its options."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator
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
    Bits,
    Capability,
    Command,
    CommandState,
    ErrorClass,
    GroupState,
    Kinematics,
    Opcode,
    Response,
    WordOrder,
    encode_command,
    encode_response,
)
from tests._rows import each_row
from tests.unit._mailbox_client import FACTORS, LINE, MCS, another, linked, owning

# The commands that the simulated mailbox program carries out, and those that it refuses.


def moves_started(simulator):
    return simulator.plc.group.movements_started


@pytest.mark.usefixtures("mailbox_program")
def test_the_machine_stands_ready_at_first(mailbox_program):
    now = linked(SoftMotionSimulator()).now()
    assert (now.group_state, now.tool_slot, now.boot_id) == (GroupState.STANDBY, 1, 1)
    if mailbox_program == "modelled":  # the executed one was told by commands
        assert (now.ack_head, now.state, now.ack_owner) == (0, CommandState.EMPTY, 0)
    assert now.bits == Bits.POWERED | Bits.TOOL_KNOWN | Bits.SIMULATED | Bits.PERMITTED
    assert (now.position_kinematics, now.axis_count) == (Kinematics.SCARA3_Z, 4)


@pytest.mark.usefixtures("mailbox_program")
def test_the_heartbeat_counts_the_cycles_of_the_motion_task():
    client = linked(SoftMotionSimulator())
    before = client.now().plc_heartbeat
    client.link.clock.sleep(4.0)
    assert (client.now().plc_heartbeat - before) & 0xFFFF in (1000, 1001)


@pytest.mark.usefixtures("mailbox_program")
def test_a_command_is_looked_at_in_the_next_cycle_of_the_program():
    options = PlcOptions(mailbox=MailboxOptions(program_cycle_us=20_000))
    client = linked(SoftMotionSimulator(options=options))
    client.link.clock.advance_to(41_000_000)
    before = client.now().ack_head
    client.write(client.command(Opcode.OWNERSHIP, 1))
    assert client.now().ack_head == before
    client.link.clock.advance_to(60_000_000)
    assert client.now().ack_head == before + 1


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.fault("F27")
def test_the_same_command_again_is_acknowledged_and_not_carried_out():
    client, _ = owning()
    command = client.command(
        Opcode.WRITE_TOOL, 3, pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.0), name="needle"
    )
    for _ in range(3):
        client.write(command)
        client.wait(0.05)
    assert client.acknowledged(command).state == CommandState.DONE
    assert client.slot(3).counter == 1


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.fault("F27")
@pytest.mark.parametrize("between", ["the owner's next", "another client's"])
def test_a_command_of_before_is_not_carried_out_again_behind_another(between):
    client, _ = owning()
    command = client.command(Opcode.WRITE_TOOL, 3, pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
    client.write(command)
    client.wait(0.05)
    if between == "another client's":
        other = another(client)
        other.write(other.command(Opcode.OWNERSHIP, 1))  # refused, and acknowledged
    else:
        client.write(client.command(Opcode.CLEAR_TOOL, 3))
    client.wait(0.05)
    changes = client.slot(3).counter
    client.write(command)
    client.wait(0.05)
    assert client.slot(3).counter == changes
    # Later new commands count as always.
    assert client.done(Opcode.WRITE_TOOL, 4, name="next").state == CommandState.DONE


@pytest.mark.usefixtures("mailbox_program")
def test_the_numbers_of_an_owner_go_on_behind_the_highest():
    client, _ = owning()
    client.sequence = 0xFFFE - 0x7FFF
    for jump in (0x7FFF, 1, 1, 1):
        client.sequence += jump - 1
        assert client.done(Opcode.READ_TOOL).state == CommandState.DONE
    assert client.now().ack_head == 2


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.fault("F28")
def test_a_block_with_two_ends_is_not_looked_at():
    client, _ = owning()
    words = list(encode_command(client.command(Opcode.READ_TOOL)))
    words[63] -= 1
    client.link.write_command(words)
    client.wait(0.1)
    now = client.now()
    assert now.ack_head == client.sequence - 1
    assert now.rejected == 0


@pytest.mark.usefixtures("mailbox_program")
def test_a_damaged_block_is_counted_once_and_not_acknowledged():
    client, _ = owning()
    words = list(encode_command(client.command(Opcode.READ_TOOL)))
    words[10] ^= 4
    for _ in range(3):
        client.link.write_command(words)
        client.wait(0.05)
    now = client.now()
    assert (now.ack_head, now.rejected) == (client.sequence - 1, 1)
    words[61] ^= 1
    client.link.write_command(words)
    client.wait(0.05)
    assert client.now().rejected == 2


@pytest.mark.usefixtures("mailbox_program")
def test_zeroed_inputs_are_no_command():
    client, simulator = owning()
    simulator.panel.zero_inputs()
    client.link.clock.sleep(0.1)
    now = client.now()
    assert (now.ack_head, now.rejected) == (client.sequence, 0)


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.fault("F28", "F32")
def test_a_block_that_arrives_in_two_parts_is_carried_out_when_it_is_whole():
    client, simulator = owning()
    simulator.faults.add(PlcFault(PlcFaultAction.TEAR_WRITE, match="SELECT_TOOL", seconds=0.1))
    command = client.command(Opcode.SELECT_TOOL, 0)
    client.link.write_command(encode_command(command))
    client.link.clock.sleep(0.08)
    assert client.now().tool_slot == 1
    client.link.clock.sleep(0.03)
    now = client.now()
    assert (now.ack_head, now.tool_slot, now.rejected) == (command.sequence, 0, 0)


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.parametrize(
    ("fields", "error_class"),
    [
        ({"version": 0x0200}, ErrorClass.VERSION),
        ({"reserved": 1}, ErrorClass.RESERVED_NOT_ZERO),
        ({"group": 2}, ErrorClass.OPERAND),
        ({"opcode": 4711}, ErrorClass.UNKNOWN_OPCODE),
        ({"boot_id": 9}, ErrorClass.OTHER_BOOT),
        ({"owner": 5}, ErrorClass.NOT_OWNER),
        ({"epoch": 77}, ErrorClass.STALE_EPOCH),
        ({"version": 0x0200, "owner": 5, "boot_id": 9}, ErrorClass.VERSION),
        ({"boot_id": 9, "owner": 5}, ErrorClass.OTHER_BOOT),
    ],
)
def test_what_every_command_can_be_refused_for(fields, error_class):
    client, _ = owning()
    fields = {"opcode": Opcode.SELECT_TOOL, **fields}
    command = client.command(**fields)
    client.write(command)
    now = client.acknowledged(command)
    assert (now.state, now.error_class) == (CommandState.ERROR, error_class)
    assert now.opcode_echo == fields["opcode"]
    assert now.tool_slot == 1


@pytest.mark.usefixtures("mailbox_program")
def test_another_minor_version_is_served():
    client, _ = owning()
    assert client.done(Opcode.SELECT_TOOL, 0, version=0x0107).tool_slot == 0


@pytest.mark.usefixtures("mailbox_program")
def test_the_profile_tools_has_no_motion():
    options = PlcOptions(mailbox=MailboxOptions(profile="tools"))
    client, simulator = owning(options=options)
    assert client.now().capabilities == Capability.TOOLS
    for opcode in (Opcode.ENABLE, Opcode.STOP, Opcode.MOVE_LINEAR, Opcode.READ_INPUT):
        assert client.refused(opcode, pose=(1.0,) * 6, dynamics=LINE) == ErrorClass.UNKNOWN_OPCODE
    client.done(Opcode.SELECT_TOOL, 1)
    simulator.panel.restart()
    assert client.now().group_state == GroupState.STANDBY


@pytest.mark.usefixtures("mailbox_program")
def test_a_command_that_comes_too_early_is_told_among_the_ends():
    client, _ = owning()
    client.move(z=-20.0)
    client.wait(0.1)
    halt = client.command(Opcode.HALT)
    client.write(halt)
    assert client.acknowledged(halt).state != CommandState.DONE
    early = client.command(Opcode.READ_TOOL)
    client.write(early)
    client.wait(1.0)
    now = client.now()
    assert (early.sequence, CommandState.ERROR, ErrorClass.BUSY) in now.finished
    assert (now.ack_head, now.state) == (halt.sequence, CommandState.DONE)


@pytest.mark.usefixtures("mailbox_program")
def test_a_stop_comes_in_at_any_time_and_ends_what_was_in_work():
    client, _ = owning()
    client.move(z=-20.0)
    client.wait(0.1)
    interrupt = client.tell(Opcode.INTERRUPT)
    assert interrupt.state != CommandState.DONE
    client.done(Opcode.STOP)
    ends = client.now().finished
    assert (interrupt.ack_head, CommandState.ABORTED, ErrorClass.NONE) in ends


@pytest.mark.usefixtures("mailbox_program")
def test_without_the_permit_nothing_is_changed_and_everything_can_be_read():
    client, simulator = owning()
    sequence = client.move(z=-20.0).ack_head
    simulator.panel.withdraw_permit()
    assert not client.after_a_cycle().bits & Bits.PERMITTED
    for opcode in (Opcode.SELECT_TOOL, Opcode.MOVE_DIRECT, Opcode.WRITE_OUTPUT, Opcode.DISABLE):
        assert client.refused(opcode, dynamics=FACTORS) == ErrorClass.NOT_PERMITTED
    client.done(Opcode.READ_TOOL)
    client.done(Opcode.READ_INPUT, 3)
    client.done(Opcode.HALT)
    assert client.end_of(sequence).state == CommandState.ABORTED
    simulator.panel.give_permit()
    client.done(Opcode.SELECT_TOOL, 0)


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.parametrize(
    ("opcode", "operands", "fields"),
    [
        (Opcode.OWNERSHIP, (2,), {}),
        (Opcode.READ_TOOL, (3,), {}),
        (Opcode.READ_INPUT, (32,), {}),
        (Opcode.READ_INPUT, (-1,), {}),
        (Opcode.WRITE_OUTPUT, (1, 2), {}),
        (Opcode.STOP, (2,), {}),
        (Opcode.JOG, (64, 0, MCS), {}),
        (Opcode.JOG, (1, 0, 6), {"dynamics": LINE}),
        (Opcode.MOVE_LINEAR, (0, 0, 6, 0), {"dynamics": LINE}),
        (Opcode.MOVE_LINEAR, (0, 0, MCS, 6), {"dynamics": LINE}),
        (Opcode.MOVE_LINEAR, (0, 0, MCS, 0), {"pose": (float("nan"),) * 6, "dynamics": LINE}),
        (Opcode.MOVE_UNTIL_INPUT, (40, 0, MCS, 0), {"dynamics": LINE}),
        (Opcode.MOVE_UNTIL_INPUT, (1, 2, MCS, 0), {"dynamics": LINE}),
        (Opcode.WRITE_TOOL, (1,), {"pose": (float("inf"),) * 6}),
        (Opcode.SET_KINEMATICS, (200,), {}),
    ],
)
def test_an_operand_out_of_range_is_refused(opcode, operands, fields):
    client, simulator = owning()
    assert client.refused(opcode, *operands, **fields) == ErrorClass.OPERAND
    assert moves_started(simulator) == 0


@pytest.mark.usefixtures("mailbox_program")
def test_inputs_are_read_and_outputs_switched():
    client, simulator = owning()
    assert client.done(Opcode.READ_INPUT, 4).answer.input_value == 0
    simulator.panel.switch_input(4, True)
    assert client.done(Opcode.READ_INPUT, 4).answer.input_value == 1
    client.done(Opcode.WRITE_OUTPUT, 7, 1)
    assert simulator.plc.group.outputs.read(7)


@pytest.mark.usefixtures("mailbox_program")
def test_the_answer_words_hold_the_set_tool_when_no_answer_stands_there():
    client, _ = owning()
    client.done(Opcode.WRITE_OUTPUT, 7, 1)
    assert client.now().answer.pose == client.slot(1).tool
    other = another(client)
    other.write(other.command(Opcode.READ_INPUT, 1))
    other.link.clock.sleep(0.05)
    assert client.now().ack_owner == other.owner
    assert client.now().answer.pose == (0.0,) * 6


# Options of a simulated PLC as text, and the word orders of a PLC.

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


@each_row(
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


@each_row("order", ORDERS)
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
