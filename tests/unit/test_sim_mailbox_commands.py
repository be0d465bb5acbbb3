"""Which commands the simulated mailbox program carries out, and which it refuses."""

import pytest
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

from robolink.protocols.mailbox import (
    Bits,
    Capability,
    CommandState,
    ErrorClass,
    GroupState,
    Kinematics,
    Opcode,
    encode_command,
)
from tests.unit._mailbox_client import FACTORS, LINE, MCS, another, linked, owning

pytestmark = pytest.mark.usefixtures("mailbox_program")


def moves_started(simulator):
    return simulator.plc.group.movements_started


def test_the_machine_stands_ready_at_first(mailbox_program):
    now = linked(SoftMotionSimulator()).now()
    assert (now.group_state, now.tool_slot, now.boot_id) == (GroupState.STANDBY, 1, 1)
    if mailbox_program == "modelled":  # the executed one was told by commands
        assert (now.ack_head, now.state, now.ack_owner) == (0, CommandState.EMPTY, 0)
    assert now.bits == Bits.POWERED | Bits.TOOL_KNOWN | Bits.SIMULATED | Bits.PERMITTED
    assert (now.position_kinematics, now.axis_count) == (Kinematics.SCARA3_Z, 4)


def test_the_heartbeat_counts_the_cycles_of_the_motion_task():
    client = linked(SoftMotionSimulator())
    before = client.now().plc_heartbeat
    client.link.clock.sleep(4.0)
    assert (client.now().plc_heartbeat - before) & 0xFFFF in (1000, 1001)


def test_a_command_is_looked_at_in_the_next_cycle_of_the_program():
    options = PlcOptions(mailbox=MailboxOptions(program_cycle_us=20_000))
    client = linked(SoftMotionSimulator(options=options))
    client.link.clock.advance_to(41_000_000)
    before = client.now().ack_head
    client.write(client.command(Opcode.OWNERSHIP, 1))
    assert client.now().ack_head == before
    client.link.clock.advance_to(60_000_000)
    assert client.now().ack_head == before + 1


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
    # What is new after that counts as ever.
    assert client.done(Opcode.WRITE_TOOL, 4, name="next").state == CommandState.DONE


def test_the_numbers_of_an_owner_go_on_behind_the_highest():
    client, _ = owning()
    client.sequence = 0xFFFE - 0x7FFF
    for jump in (0x7FFF, 1, 1, 1):
        client.sequence += jump - 1
        assert client.done(Opcode.READ_TOOL).state == CommandState.DONE
    assert client.now().ack_head == 2


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


def test_zeroed_inputs_are_no_command():
    client, simulator = owning()
    simulator.panel.zero_inputs()
    client.link.clock.sleep(0.1)
    now = client.now()
    assert (now.ack_head, now.rejected) == (client.sequence, 0)


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


def test_another_minor_version_is_served():
    client, _ = owning()
    assert client.done(Opcode.SELECT_TOOL, 0, version=0x0107).tool_slot == 0


def test_the_profile_tools_has_no_motion():
    options = PlcOptions(mailbox=MailboxOptions(profile="tools"))
    client, simulator = owning(options=options)
    assert client.now().capabilities == Capability.TOOLS
    for opcode in (Opcode.ENABLE, Opcode.STOP, Opcode.MOVE_LINEAR, Opcode.READ_INPUT):
        assert client.refused(opcode, pose=(1.0,) * 6, dynamics=LINE) == ErrorClass.UNKNOWN_OPCODE
    client.done(Opcode.SELECT_TOOL, 1)
    simulator.panel.restart()
    assert client.now().group_state == GroupState.STANDBY


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


def test_a_stop_comes_in_at_any_time_and_ends_what_was_in_work():
    client, _ = owning()
    client.move(z=-20.0)
    client.wait(0.1)
    interrupt = client.tell(Opcode.INTERRUPT)
    assert interrupt.state != CommandState.DONE
    client.done(Opcode.STOP)
    ends = client.now().finished
    assert (interrupt.ack_head, CommandState.ABORTED, ErrorClass.NONE) in ends


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


def test_inputs_are_read_and_outputs_switched():
    client, simulator = owning()
    assert client.done(Opcode.READ_INPUT, 4).answer.input_value == 0
    simulator.panel.switch_input(4, True)
    assert client.done(Opcode.READ_INPUT, 4).answer.input_value == 1
    client.done(Opcode.WRITE_OUTPUT, 7, 1)
    assert simulator.plc.group.outputs.read(7)


def test_the_answer_words_hold_the_set_tool_when_no_answer_stands_there():
    client, _ = owning()
    client.done(Opcode.WRITE_OUTPUT, 7, 1)
    assert client.now().answer.pose == client.slot(1).tool
    other = another(client)
    other.write(other.command(Opcode.READ_INPUT, 1))
    other.link.clock.sleep(0.05)
    assert client.now().ack_owner == other.owner
    assert client.now().answer.pose == (0.0,) * 6
