"""Movements and tool slots through the simulated mailbox."""

import json

import pytest
from robolink_simulators.cell.tip_switches import TouchPlate
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

from robolink.errors import ConfigError
from robolink.protocols.mailbox import (
    Bits,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    GroupState,
    Opcode,
    ReadMode,
    Slot,
    frames_match,
)
from tests.unit._mailbox_client import FACTORS, LINE, MCS, NO_TOOL, linked, owning, shifted

pytestmark = pytest.mark.usefixtures("mailbox_program")

# Movements through the simulated mailbox: the queue, the ends, and every way of stopping.

BUFFERED = 1
SLOW = (20.0, 200.0, 200.0, 2000.0)


def test_a_movement_is_followed_to_its_end():
    client, _ = owning()
    target = shifted(client.now().tcp, z=-10.0)
    now = client.move(z=-10.0)
    client.wait(0.02)
    now = client.now()
    assert (now.state, now.group_state) == (CommandState.ACTIVE, GroupState.MOVING)
    assert now.bits & Bits.BUSY
    assert (now.active_movement, now.queue_length) == (client.sequence, 1)
    assert client.end_of(client.sequence) == (client.sequence, CommandState.DONE, 0)
    client.wait(0.02)
    now = client.now()
    assert now.tcp == pytest.approx(target, abs=1e-6)
    assert (now.active_movement, now.queue_length) == (0, 0)
    assert not now.bits & Bits.BUSY


def test_four_movements_may_be_unfinished_and_their_ends_stand_newest_first():
    client, _ = owning()
    depth = [-4.0, -1.0, -6.0, -2.0]
    tcp = client.now().tcp
    sequences = []
    for z in depth:
        now = client.tell(
            Opcode.MOVE_LINEAR, 0, 0, MCS, BUFFERED, pose=shifted(tcp, z=z), dynamics=SLOW
        )
        sequences.append(now.ack_head)
    assert now.state == CommandState.BUFFERED
    assert client.now().queue_length == 4
    assert (
        client.refused(Opcode.MOVE_LINEAR, 0, 0, MCS, BUFFERED, pose=tcp, dynamics=SLOW)
        == ErrorClass.QUEUE_FULL
    )
    client.done(Opcode.READ_TOOL)
    client.end_of(sequences[-1])
    assert [end.sequence for end in client.now().finished] == sequences[::-1]


@pytest.mark.parametrize(
    ("pose", "dynamics", "error_class"),
    [
        ((5000.0, 0.0, 0.0, 0.0, 0.0, 0.0), LINE, ErrorClass.UNREACHABLE),
        ((300.0, 300.0, 0.0, 0.0, 0.0, 0.0), (0.0, 1.0, 1.0, 1.0), ErrorClass.DYNAMICS),
    ],
)
def test_a_movement_that_cannot_be_is_refused_at_once(pose, dynamics, error_class):
    client, _ = owning()
    operands = (0, 0, MCS, 0)
    assert (
        client.refused(Opcode.MOVE_LINEAR, *operands, pose=pose, dynamics=dynamics) == error_class
    )
    now = client.now()
    assert (now.queue_length, now.group_state) == (0, GroupState.STANDBY)
    assert [end.sequence for end in now.finished] == [0, 0, 0, 0]


def test_a_new_movement_aborts_the_one_before():
    client, _ = owning()
    first = client.move(z=-30.0).ack_head
    client.wait(0.1)
    second = client.move(z=5.0).ack_head
    assert client.end_of(second).state == CommandState.DONE
    assert (first, CommandState.ABORTED, ErrorClass.NONE) in client.now().finished


def test_an_interrupted_movement_waits_and_goes_on():
    client, _ = owning()
    target = shifted(client.now().tcp, z=-20.0)
    sequence = client.move(z=-20.0).ack_head
    client.wait(0.1)
    client.done(Opcode.INTERRUPT)
    now = client.now()
    assert (now.active_movement, now.queue_length) == (sequence, 1)
    assert now.bits & Bits.INTERRUPTED
    client.wait(0.02)
    assert client.now().group_state == GroupState.STANDBY
    client.done(Opcode.CONTINUE)
    assert client.end_of(sequence).state == CommandState.DONE
    assert client.now().tcp == pytest.approx(target, abs=1e-6)


@pytest.mark.parametrize("opcode", [Opcode.MOVE_LINEAR, Opcode.MOVE_UNTIL_INPUT])
def test_an_interrupted_movement_stays_the_active_one_whatever_is_begun(opcode):
    client, _ = owning()
    signal = 3 if opcode is Opcode.MOVE_UNTIL_INPUT else 0
    target = shifted(client.now().tcp, z=-20.0)
    operands = (signal, 0, CoordinateSystem.MCS, 0)
    sequence = client.tell(opcode, *operands, pose=target, dynamics=LINE).ack_head
    client.wait(0.1)
    client.done(Opcode.INTERRUPT)
    client.wait(0.1)
    buffered = client.move(z=10.0, mode=1)
    assert (buffered.error_class == ErrorClass.MOVING) == bool(signal)
    begun = client.move(z=10.0).ack_head
    client.wait(0.05)
    now = client.now()
    assert now.active_movement == sequence != begun
    assert now.bits & Bits.INTERRUPTED
    assert now.queue_length == 2  # one that was buffered has been aborted


def test_the_state_of_an_interrupted_movement_is_shown_while_it_is_the_last_command():
    client, simulator = owning()
    client.move(z=-20.0)
    client.wait(0.1)
    simulator.plc.group.interrupt()
    client.wait(0.3)
    assert client.now().state == CommandState.INTERRUPTED


@pytest.mark.parametrize("opcode", [Opcode.STOP, Opcode.HALT, Opcode.DISABLE])
def test_an_interrupted_movement_is_ended_by(opcode):
    client, _ = owning()
    sequence = client.move(z=-20.0).ack_head
    client.wait(0.1)
    client.done(Opcode.INTERRUPT)
    client.done(opcode)
    now = client.now()
    assert (sequence, CommandState.ABORTED, ErrorClass.NONE) in now.finished
    assert (now.active_movement, now.queue_length) == (0, 0)
    assert not now.bits & Bits.INTERRUPTED


def test_there_must_be_something_to_interrupt_and_to_continue():
    client, _ = owning()
    assert client.refused(Opcode.INTERRUPT) == ErrorClass.NO_SUCH_MOVEMENT
    assert client.refused(Opcode.CONTINUE) == ErrorClass.NO_SUCH_MOVEMENT


def test_an_axis_error_ends_everything_with_its_class():
    client, simulator = owning()
    sequence = client.move(z=-20.0).ack_head
    client.wait(0.1)
    simulator.panel.fail_axis(1, 16)
    now = client.after_a_cycle()
    assert now.finished[0] == (sequence, CommandState.ABORTED, ErrorClass.AXIS)
    assert (now.group_state, now.raw_error) == (GroupState.ERRORSTOP, 16)
    client.done(Opcode.RESET)
    assert client.now().group_state == GroupState.STANDBY


def test_the_error_of_the_group_is_not_that_of_a_block_that_it_refuses():
    """Two channels: a block in error with an unknown number shows none, not the group's."""
    client, simulator = owning()
    simulator.panel.fail_axis(1, 16)
    now = client.after_a_cycle()
    assert (now.error_class, now.raw_error) == (ErrorClass.NONE, 16)
    assert client.refused(Opcode.CLEAR_TOOL, 1) == ErrorClass.WRONG_STATE
    assert client.now().raw_error == 0
    assert client.refused(Opcode.ENABLE) == ErrorClass.ERRORSTOP
    assert client.now().raw_error == 11000
    client.done(Opcode.READ_TOOL, 0)
    assert client.now().raw_error == 16
    client.done(Opcode.RESET)
    assert client.now().raw_error == 0


def test_the_emergency_stop_takes_the_power_and_a_reset_does_not_give_it_back():
    client, simulator = owning()
    sequence = client.move(z=-20.0).ack_head
    client.wait(0.1)
    simulator.panel.press_estop()
    now = client.after_a_cycle()
    assert not now.bits & Bits.POWERED
    assert now.finished[0] == (sequence, CommandState.ABORTED, ErrorClass.AXIS)
    client.done(Opcode.RESET)
    assert client.move(z=1.0).error_class == ErrorClass.AXIS
    simulator.panel.release_estop()
    assert client.end_of(client.move(z=1.0).ack_head).state == CommandState.DONE


def probing(client, z, run_on=0, number=5):
    return client.tell(
        Opcode.MOVE_UNTIL_INPUT,
        *(number, run_on, MCS, 0),
        pose=shifted(client.now().tcp, z=z),
        dynamics=SLOW,
    ).ack_head


@pytest.mark.parametrize("run_on", [0, 1])
def test_a_movement_until_an_input_latches_the_tcp_at_the_edge(run_on, mailbox_program):
    client, simulator = owning()
    plate_mm = simulator.world.tip_mm()[2] - 3.0
    simulator.world.connect(5, TouchPlate(plate_mm))
    before = client.now().tcp
    sequence = probing(client, -10.0, run_on)
    assert client.now().answer.pose == (0.0,) * 6
    assert client.end_of(sequence).state == CommandState.DONE
    now = client.now()
    assert now.opcode_echo == Opcode.MOVE_UNTIL_INPUT
    assert before[2] - now.answer.pose[2] == pytest.approx(3.0, abs=0.1)
    braked = {"modelled": 4.0, "executed": 3.3}[mailbox_program]  # MC_GroupHalt brakes harder
    assert before[2] - now.tcp[2] == pytest.approx(10.0 if run_on else braked, abs=0.15)


def test_without_an_edge_the_movement_ends_in_error():
    client, _ = owning()
    sequence = probing(client, -2.0)
    assert client.end_of(sequence) == (sequence, CommandState.ERROR, ErrorClass.NO_EDGE)


def test_a_falling_edge_is_a_negative_number():
    client, simulator = owning()
    simulator.panel.switch_input(5, True)
    sequence = probing(client, -10.0, number=-5)
    client.wait(0.1)
    simulator.panel.switch_input(5, False)
    assert client.end_of(sequence).state == CommandState.DONE
    assert client.now().answer.pose != (0.0,) * 6


def test_a_jog_is_steered_and_ended():
    client, _ = owning()
    before = client.now()
    assert client.tell(Opcode.JOG, 4, 0, MCS, dynamics=SLOW).state == CommandState.ACTIVE
    client.wait(0.5)
    client.done(Opcode.JOG, 0, 4, MCS, dynamics=SLOW)
    client.wait(0.2)
    client.done(Opcode.JOG, 0, 0, MCS)
    client.wait(0.3)
    now = client.now()
    assert 1.0 < now.tcp[2] - before.tcp[2] < 9.0
    assert not now.bits & Bits.JOGGING
    assert now.group_state == GroupState.STANDBY


def test_a_halt_ends_everything_without_holding():
    client, _ = owning()
    sequence = client.move(z=-20.0).ack_head
    client.wait(0.1)
    client.done(Opcode.HALT)
    client.wait(0.05)
    now = client.now()
    assert (sequence, CommandState.ABORTED, ErrorClass.NONE) in now.finished
    assert now.group_state == GroupState.STANDBY
    assert client.end_of(client.move(z=1.0).ack_head).state == CommandState.DONE


def test_while_a_stop_is_held_other_stops_join_in_and_a_halt_is_overruled():
    client, _ = owning()
    client.done(Opcode.STOP)
    client.done(Opcode.STOP)
    now = client.tell(Opcode.HALT)
    assert (now.state, now.error_class) == (CommandState.ABORTED, ErrorClass.STOPPING)
    client.done(Opcode.STOP, 1)
    client.done(Opcode.STOP, 1)
    assert client.now().group_state == GroupState.STANDBY


def test_axes_are_jogged_by_factors():
    client, _ = owning()
    before = client.now().axes
    client.tell(Opcode.JOG, 1, 0, CoordinateSystem.ACS, dynamics=FACTORS)
    client.wait(0.2)
    client.done(Opcode.JOG, 0, 0, CoordinateSystem.ACS)
    client.wait(0.5)
    after = client.now().axes
    assert after[0] > before[0] + 5
    assert after[1:] == pytest.approx(before[1:])


# The tool slots of the simulated mailbox, over commands and over restarts.

TOOL = (1.0, -2.0, 30.5, 10.0, 20.0, 30.0)
SIDEWAYS = (5.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_slot_keeps_what_is_written_and_counts_it():
    client, _ = owning()
    assert client.slot(7) == Slot()
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle 0.4")
    assert client.slot(7) == Slot(1, True, TOOL, "needle 0.4")
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle 0.4")
    client.done(Opcode.CLEAR_TOOL, 7)
    client.done(Opcode.CLEAR_TOOL, 7)
    assert client.slot(7) == Slot(3)
    assert client.now().tool_slot == 1


@pytest.mark.parametrize("slot", [0, 16, -1])
@pytest.mark.parametrize("opcode", [Opcode.WRITE_TOOL, Opcode.CLEAR_TOOL])
def test_there_are_fifteen_slots(slot, opcode):
    client, _ = owning()
    assert client.refused(opcode, slot, pose=TOOL) == ErrorClass.SLOT_OUT_OF_RANGE


@pytest.mark.parametrize(("unit_um", "longest"), [(1000.0, 10_000.0), (1_000_000.0, 10.0)])
def test_a_tool_is_no_longer_than_ten_metres_whatever_the_unit(unit_um, longest):
    client, _ = owning(options=PlcOptions(mailbox=MailboxOptions(unit_um=unit_um)))
    client.done(Opcode.WRITE_TOOL, 7, pose=shifted(NO_TOOL, z=longest))
    before = client.slot(7)
    for axis in "xyz":
        tool = shifted(NO_TOOL, **{axis: -1.01 * longest})
        assert client.refused(Opcode.WRITE_TOOL, 7, pose=tool) == ErrorClass.OPERAND
    assert client.slot(7) == before


def test_selecting_sets_the_tool_and_answers_with_it():
    client, _ = owning()
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL)
    now = client.done(Opcode.SELECT_TOOL, 7)
    assert now.tool_slot == 7
    assert frames_match(now.answer.pose, TOOL, tolerance=1e-9)
    assert client.done(Opcode.SELECT_TOOL, 0).answer.pose == NO_TOOL
    assert client.refused(Opcode.SELECT_TOOL, 16) == ErrorClass.SLOT_OUT_OF_RANGE
    assert client.refused(Opcode.SELECT_TOOL, 8) == ErrorClass.SLOT_EMPTY


def test_writing_the_selected_slot_sets_the_tool_and_the_reported_tcp_jumps():
    client, _ = owning()
    before = client.now()
    tool = client.slot(1).tool
    client.done(Opcode.WRITE_TOOL, 1, pose=shifted(tool, z=3.0))
    after = client.now()
    assert after.tcp == pytest.approx(shifted(before.tcp, z=3.0), abs=1e-9)
    assert after.axes == before.axes
    assert client.done(Opcode.READ_TOOL).answer.pose == pytest.approx(shifted(tool, z=3.0))


def test_a_refused_write_of_the_selected_slot_changes_neither_slot_nor_tool():
    client, simulator = owning(kinematics="Kin_Scara2_Z")
    before = client.slot(1)
    assert client.refused(Opcode.WRITE_TOOL, 1, pose=SIDEWAYS) == ErrorClass.TOOL_INCOMPATIBLE
    simulator.panel.fail_axis(0)
    assert client.refused(Opcode.WRITE_TOOL, 1, pose=before.tool) == ErrorClass.ERRORSTOP
    assert client.slot(1) == before
    client.done(Opcode.WRITE_TOOL, 2, pose=SIDEWAYS)
    assert client.slot(2).defined


def test_the_selected_slot_is_not_cleared():
    client, _ = owning()
    assert client.refused(Opcode.CLEAR_TOOL, 1) == ErrorClass.WRONG_STATE
    assert client.slot(1).defined


def test_the_three_tools_that_can_be_read():
    client, _ = owning()
    old = client.slot(1).tool
    for mode in (ReadMode.ACTIVE, ReadMode.LAST_COMMANDED):
        assert client.refused(Opcode.READ_TOOL, mode) == ErrorClass.NO_SUCH_MOVEMENT
    client.move(z=-20.0)
    client.done(Opcode.WRITE_TOOL, 2, pose=TOOL)
    client.done(Opcode.SELECT_TOOL, 2)
    client.move(z=-21.0, mode=1)
    read = {mode: client.done(Opcode.READ_TOOL, mode).answer.pose for mode in ReadMode}
    assert frames_match(read[ReadMode.SET], TOOL, tolerance=1e-9)
    assert frames_match(read[ReadMode.ACTIVE], old, tolerance=1e-9)
    assert frames_match(read[ReadMode.LAST_COMMANDED], TOOL, tolerance=1e-9)


def test_a_tool_that_the_machine_sets_by_itself_is_not_known():
    client, simulator = owning()
    simulator.panel.set_tool(CoordRef(z_mm=77.0))
    assert not client.after_a_cycle().bits & Bits.TOOL_KNOWN
    assert client.done(Opcode.READ_TOOL).answer.pose[2] == 77.0
    client.done(Opcode.SELECT_TOOL, 1)
    assert client.now().bits & Bits.TOOL_KNOWN


def test_lengths_are_in_user_units_and_angles_in_degrees():
    options = PlcOptions(mailbox=MailboxOptions(unit_um=100.0))
    client, simulator = owning(options=options)
    client.done(Opcode.WRITE_TOOL, 3, pose=(10.0, 0.0, 250.0, 90.0, 0.0, 0.0))
    client.done(Opcode.SELECT_TOOL, 3)
    x_mm, y_mm, z_mm = simulator.plc.group.tool.frame.shift_mm
    assert (x_mm, y_mm, z_mm) == pytest.approx((1.0, 0.0, 25.0))
    now = client.now()
    assert now.unit_um == 100.0
    assert now.tcp[:3] == pytest.approx([10 * it for it in simulator.plc.group.tcp().shift_mm])
    assert now.axes[0] == simulator.plc.group.values[0]
    assert now.axes[3] == pytest.approx(10 * simulator.plc.group.values[3])
    sequence = client.tell(
        Opcode.MOVE_LINEAR, 0, 0, MCS, 0, pose=shifted(now.tcp, z=-100.0), dynamics=LINE
    ).ack_head
    client.wait(0.5)
    assert client.now().active_movement == sequence
    assert client.end_of(sequence).state == CommandState.DONE
    assert simulator.plc.group.values[3] == pytest.approx(now.axes[3] / 10 - 10.0)


def test_a_restart_takes_the_tool_and_keeps_the_slots():
    client, simulator = owning()
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle")
    client.move(z=-50.0)
    simulator.panel.restart()
    now = client.now()
    assert (now.boot_id, now.tool_slot, now.ack_head, now.queue_length) == (2, 0, 0, 0)
    assert (now.group_state, now.state) == (GroupState.DISABLED, CommandState.EMPTY)
    assert now.answer.pose == NO_TOOL
    assert client.slot(7) == Slot(1, True, TOOL, "needle")
    assert [end.sequence for end in now.finished] == [0, 0, 0, 0]


def test_the_command_that_stood_there_is_not_carried_out_after_a_restart():
    client, simulator = owning()
    client.done(Opcode.SELECT_TOOL, 0)
    simulator.panel.restart()
    client.link.clock.sleep(1.0)
    assert client.now().ack_head == 0


def test_the_boot_id_is_never_zero():
    client, simulator = owning()
    simulator.plc.memory.boot_id = 65535
    simulator.panel.restart()
    assert client.now().boot_id == 1


def test_a_file_keeps_what_is_retained(tmp_path):
    path = tmp_path / "plc.json"
    client, _ = owning(state_path=path)
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle")
    again = linked(SoftMotionSimulator(state_path=path))
    assert again.slot(7) == Slot(1, True, TOOL, "needle")
    now = again.now()
    assert (now.boot_id, now.tool_slot) == (2, 0)
    assert now.group_state == GroupState.DISABLED
    assert again.take().answer.epoch == 2
    assert json.loads(path.read_text())["memory"]["boot_id"] == 2


@pytest.mark.parametrize("change", [("Kin_Scara3_Z", "Kin_Gantry3"), ("counter", "number")])
def test_a_file_that_does_not_fit_is_refused(tmp_path, change):
    path = tmp_path / "plc.json"
    SoftMotionSimulator(state_path=path)
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(ConfigError, match="not a saved state"):
        SoftMotionSimulator(state_path=path)
