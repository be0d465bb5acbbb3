"""Movements through the simulated mailbox: the queue, the ends, and every way of stopping."""

import pytest
from robolink_simulators.cell.tip_switches import TouchPlate

from robolink.protocols.mailbox import (
    Bits,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    GroupState,
    Opcode,
)
from tests.unit._mailbox_client import FACTORS, LINE, MCS, owning, shifted

pytestmark = pytest.mark.usefixtures("mailbox_program")

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
    """Two channels: a block in error whose number nobody knows shows none, not the group's."""
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
