"""Who may command the simulated mailbox, and what happens when its client falls silent."""

import pytest
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import Bits, CommandState, ErrorClass, GroupState, Opcode
from tests.unit._mailbox_client import FACTORS, another, linked, owning

pytestmark = pytest.mark.usefixtures("mailbox_program")


def test_nobody_owns_it_at_first_and_reads_need_no_owner():
    client = linked(SoftMotionSimulator())
    assert not client.now().bits & Bits.OWNED
    assert client.refused(Opcode.SELECT_TOOL, 0) == ErrorClass.NOT_OWNER
    taken = client.take()
    assert (taken.answer.holder, taken.answer.epoch) == (client.owner, 1)
    assert taken.bits & Bits.OWNED


def test_a_refused_take_names_the_holder():
    client, _ = owning()
    other = another(client)
    now = other.tell(Opcode.OWNERSHIP, 1)
    assert (now.state, now.error_class) == (CommandState.ERROR, ErrorClass.NOT_OWNER)
    assert (now.answer.holder, now.answer.epoch) == (client.owner, client.epoch)


def test_a_silent_owner_loses_it_after_ten_seconds():
    client, _ = owning()
    other = another(client)
    client.link.clock.sleep(9.5)
    assert other.refused(Opcode.OWNERSHIP, 1) == ErrorClass.NOT_OWNER
    client.beat()
    client.link.clock.sleep(9.9)
    assert other.refused(Opcode.OWNERSHIP, 1) == ErrorClass.NOT_OWNER
    client.link.clock.sleep(0.2)
    assert other.take().answer.holder == other.owner
    assert client.refused(Opcode.SELECT_TOOL, 0) == ErrorClass.NOT_OWNER


def test_a_person_may_insist():
    client, _ = owning()
    other = another(client)
    assert other.take(insist=1).answer.epoch == client.epoch + 1
    assert client.refused(Opcode.SELECT_TOOL, 0) == ErrorClass.NOT_OWNER


def test_an_owner_that_slept_through_two_epochs_is_stale():
    client, _ = owning()
    epoch = client.epoch
    client.take()
    client.epoch = epoch
    assert client.refused(Opcode.SELECT_TOOL, 0) == ErrorClass.STALE_EPOCH
    assert client.refused(Opcode.OWNERSHIP, 0) == ErrorClass.STALE_EPOCH


def test_it_is_given_back_by_its_owner_only():
    client, _ = owning()
    other = another(client)
    assert other.refused(Opcode.OWNERSHIP, 0) == ErrorClass.NOT_OWNER
    assert client.done(Opcode.OWNERSHIP, 0).answer.holder == 0
    assert other.take().answer.holder == other.owner


def test_a_token_of_zero_owns_nothing():
    client = linked(SoftMotionSimulator(), owner=0)
    client.sequence = 0
    assert client.refused(Opcode.OWNERSHIP, 1) == ErrorClass.OPERAND


def test_the_epoch_wraps_to_one():
    client, simulator = owning()
    simulator.plc.memory.epoch = 65535
    assert client.take().answer.epoch == 1


def test_a_start_clears_the_owner_and_keeps_the_epoch():
    client, simulator = owning()
    simulator.panel.restart()
    assert not client.now().bits & Bits.OWNED
    client.sequence = 0
    assert client.take().answer.epoch == 2


def test_anybody_may_stop_and_only_the_owner_lets_go():
    client, _ = owning()
    other = another(client)
    other.done(Opcode.STOP)
    assert other.refused(Opcode.STOP, 1) == ErrorClass.NOT_OWNER
    client.sequence = other.sequence
    client.done(Opcode.STOP, 1)
    assert client.now().group_state == GroupState.STANDBY


def silence(client, seconds):
    client.link.clock.sleep(seconds)


@pytest.mark.fault("F23")
def test_a_movement_is_halted_half_a_second_after_the_last_beat_and_the_tool_stays():
    client, _ = owning()
    sequence = client.move(z=-40.0, dynamics=(10.0, 100.0, 100.0, 1000.0)).ack_head
    client.wait(0.6)
    silence(client, 0.45)
    assert client.now().active_movement == sequence
    silence(client, 0.1)
    now = client.now()
    assert now.finished[0] == (sequence, CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST)
    assert (now.state, now.error_class) == (CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST)
    silence(client, 1.0)
    assert client.now().group_state == GroupState.STANDBY
    assert client.now().tool_slot == 1


@pytest.mark.parametrize("epochs_ago", [1, 2])
def test_a_beat_of_another_epoch_does_not_count(epochs_ago):
    client, _ = owning()
    client.take()
    sequence = client.move(z=-40.0, dynamics=(10.0, 100.0, 100.0, 1000.0)).ack_head
    client.epoch -= epochs_ago
    client.wait(0.6)
    end = (sequence, CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST)
    assert client.now().finished[0] == end


def test_a_beat_that_does_not_change_does_not_count():
    client, _ = owning()
    client.move(z=-40.0, dynamics=(10.0, 100.0, 100.0, 1000.0))
    for _ in range(6):
        client.beats = 7
        client.beat()
        silence(client, 0.1)
    assert client.now().error_class == ErrorClass.HEARTBEAT_LOST


def test_nothing_is_supervised_while_nothing_moves():
    client, _ = owning()
    silence(client, 5.0)
    sequence = client.move(z=-5.0).ack_head
    assert client.end_of(sequence).state == CommandState.DONE


def test_a_jog_ends_when_its_client_falls_silent():
    client, _ = owning()
    now = client.tell(Opcode.JOG, 1, 0, 0, dynamics=FACTORS)
    silence(client, 0.3)
    assert client.now().bits & Bits.JOGGING
    silence(client, 1.0)
    after = client.now()
    assert not after.bits & Bits.JOGGING
    assert (now.ack_head, CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST) in after.finished


def test_an_interrupted_movement_ends_when_its_client_falls_silent():
    client, _ = owning()
    sequence = client.move(z=-40.0).ack_head
    client.wait(0.1)
    client.done(Opcode.INTERRUPT)
    assert client.now().bits & Bits.INTERRUPTED
    silence(client, 0.6)
    end = (sequence, CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST)
    assert client.now().finished[0] == end
    assert not client.now().bits & Bits.INTERRUPTED


def test_silence_during_an_interrupt_still_ends_the_movement():
    client, _ = owning()
    sequence = client.move(z=-150.0, dynamics=(100.0, 1000.0, 70.0, 1000.0)).ack_head
    client.wait(0.2)
    assert client.tell(Opcode.INTERRUPT).state == CommandState.BUFFERED
    silence(client, 2.0)
    end = (sequence, CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST)
    assert end in client.now().finished


def test_nobody_takes_it_from_a_silent_owner_while_something_moves():
    client, simulator = owning()
    other = another(client)
    silence(client, 9.9)
    simulator.panel.move_axis(0, 130.0)
    silence(client, 0.2)
    assert other.refused(Opcode.OWNERSHIP, 1) == ErrorClass.NOT_OWNER
    silence(client, 1.0)
    assert other.take().answer.holder == other.owner
