"""Faults of a simulated PLC, its permitted clients, and a silent client."""

import pytest
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

from robolink.errors import TransportBrokenError, TransportClosedError, TransportTimeoutError
from robolink.protocols.mailbox import (
    Bits,
    BlockError,
    BlockFault,
    CommandState,
    ErrorClass,
    GroupState,
    Opcode,
)
from tests.unit._mailbox_client import FACTORS, another, linked, owning

pytestmark = pytest.mark.usefixtures("mailbox_program")

# The faults that can be planned for a simulated PLC, and the listeners to its exchanges.

SLOW = (20.0, 200.0, 200.0, 2000.0)


def planned(action, **fields):
    client, simulator = owning()
    simulator.faults.add(PlcFault(action, **fields))
    return client, simulator


def test_a_lost_answer_is_a_time_out_and_the_command_is_carried_out():
    client, simulator = planned(PlcFaultAction.DROP_REPLY, match="SELECT_TOOL")
    before = client.link.clock.now_ns()
    with pytest.raises(TransportTimeoutError):
        client.write(client.command(Opcode.SELECT_TOOL, 0))
    assert client.link.clock.now_ns() - before > 2_900_000_000
    with pytest.raises(TransportClosedError):
        client.now()
    assert simulator.plc.tools.selected == 0


@pytest.mark.parametrize(
    ("action", "selected"), [(PlcFaultAction.DISCONNECT, 0), (PlcFaultAction.DISCONNECT_BEFORE, 1)]
)
def test_a_cut_link_leaves_the_command_done_or_not(action, selected):
    client, simulator = planned(action, match="SELECT_TOOL")
    with pytest.raises(TransportBrokenError):
        client.write(client.command(Opcode.SELECT_TOOL, 0))
    simulator.advance(simulator.now_ns + 20_000_000)
    assert simulator.plc.tools.selected == selected


def test_a_late_answer_takes_its_time():
    client, _ = planned(PlcFaultAction.DELAY, match="read_slot 2", seconds=1.5)
    before = client.link.clock.now_ns()
    client.slot(2)
    assert client.link.clock.now_ns() - before == 1_501_000_000


def test_an_ignored_write_is_acknowledged_on_the_wire_only():
    client, _ = planned(PlcFaultAction.IGNORE_WRITE, match="SELECT_TOOL")
    command = client.command(Opcode.SELECT_TOOL, 0)
    client.write(command)
    client.wait(0.1)
    now = client.now()
    assert (now.ack_head, now.tool_slot, now.rejected) == (command.sequence - 1, 1, 0)


def test_a_write_may_arrive_damaged_and_be_written_again():
    client, _ = planned(PlcFaultAction.GARBLE_WRITE, match="SELECT_TOOL")
    command = client.command(Opcode.SELECT_TOOL, 0)
    client.write(command)
    client.wait(0.1)
    assert client.now().rejected == 1
    client.write(command)
    assert client.settled(client.acknowledged(command)).state == CommandState.DONE


@pytest.mark.parametrize(
    ("action", "match", "fault"),
    [
        (PlcFaultAction.TEAR_REPLY, "read_response", BlockFault.TORN),
        (PlcFaultAction.GARBLE_REPLY, "read_response", BlockFault.CRC),
        (PlcFaultAction.TEAR_REPLY, "read_slot", BlockFault.TORN),
        (PlcFaultAction.GARBLE_REPLY, "read_slot", BlockFault.CRC),
    ],
)
def test_an_answer_may_be_torn_or_damaged_once(action, match, fault):
    client, _ = planned(action, match=match)
    read = client.now if match == "read_response" else lambda: client.slot(1)
    with pytest.raises(BlockError) as caught:
        read()
    assert caught.value.fault is fault
    read()


def test_the_plc_may_restart_in_the_middle_of_a_movement():
    client, simulator = planned(PlcFaultAction.RESTART, match="MOVE_LINEAR", seconds=0.1)
    client.move(z=-30.0, dynamics=SLOW)
    client.wait(0.2)
    now = client.now()
    assert (now.boot_id, now.group_state) == (2, GroupState.DISABLED)
    assert simulator.plc.starts == 2


def test_a_frozen_program_stands_still_while_the_robot_goes_on():
    client, simulator = planned(PlcFaultAction.FREEZE, match="read_slot", seconds=0.0)
    client.move(z=-30.0, dynamics=SLOW)
    client.wait(0.1)
    client.slot(1)
    client.link.clock.sleep(0.1)
    frozen = client.now()
    axes = simulator.plc.group.values
    client.write(client.command(Opcode.HALT))
    client.link.clock.sleep(1.0)
    assert client.now() == frozen
    assert simulator.plc.group.values != axes
    simulator.panel.thaw()
    client.link.clock.sleep(0.1)
    assert client.now().finished[0][1:] == (CommandState.ABORTED, ErrorClass.NONE)
    assert client.now().plc_heartbeat != frozen.plc_heartbeat


@pytest.mark.parametrize(
    ("action", "seen"),
    [
        (PlcFaultAction.ESTOP, lambda now: not now.bits & Bits.POWERED),
        (PlcFaultAction.AXIS_ERROR, lambda now: now.group_state == GroupState.ERRORSTOP),
        (PlcFaultAction.WITHDRAW_PERMIT, lambda now: not now.bits & Bits.PERMITTED),
    ],
)
def test_the_machine_may_change_after_a_request(action, seen):
    client, _ = planned(action, match="read_head", seconds=0.2)
    client.link.read_head()
    client.link.clock.sleep(0.1)
    assert not seen(client.now())
    client.link.clock.sleep(0.15)
    assert seen(client.now())


def test_zeroed_inputs_wait_for_nobody():
    client, simulator = planned(PlcFaultAction.ZERO_INPUTS, match="SELECT_TOOL")
    client.write(client.command(Opcode.SELECT_TOOL, 0))
    client.wait(0.1)
    assert client.now().ack_head == client.sequence - 1
    assert simulator.plc.program.inbox.words[:62] == (0,) * 62


def test_a_watchdog_zeroes_what_was_written_after_a_silence():
    client, simulator = owning(options=PlcOptions(mailbox=MailboxOptions(watchdog_ms=500)))
    client.link.clock.sleep(0.4)
    client.now()
    assert any(simulator.plc.program.inbox.words)
    client.link.clock.sleep(0.6)
    assert client.now().ack_head == client.sequence
    assert not any(simulator.plc.program.inbox.words)


def test_faults_are_counted_among_the_requests_that_match():
    client, simulator = planned(PlcFaultAction.TEAR_REPLY, match="read_response", on_exchange=2)
    client.now()
    client.slot(1)
    client.now()
    with pytest.raises(BlockError):
        client.now()
    assert not simulator.faults.pending


def test_hooks_are_told_of_every_exchange_by_name_and_number():
    client, simulator = owning()
    told = []
    simulator.on_request = lambda number, text: told.append((number, text))
    simulator.on_reply = lambda number, text: told.append((-number, text))
    client.link.read_head()
    client.write(client.command(Opcode.SELECT_TOOL, 0))
    client.beat()
    client.slot(15)
    first = told[0][0]
    texts = ["read_head", f"write_command SELECT_TOOL {client.sequence}", "beat", "read_slot 15"]
    pairs = [(sign * (first + n), text) for n, text in enumerate(texts) for sign in (1, -1)]
    assert told == pairs
    assert [text for _, way, text in simulator.log if way == ">"][-4:] == texts


def test_what_a_hook_raises_reaches_the_host_and_the_request_is_carried_out():
    client, simulator = owning()

    def leave(_number, _text):
        raise KeyboardInterrupt

    simulator.on_request = leave
    with pytest.raises(KeyboardInterrupt):
        client.write(client.command(Opcode.SELECT_TOOL, 0))
    simulator.on_request = None
    client.wait(0.05)
    assert client.now().tool_slot == 0


# The permitted clients of the simulated mailbox, and the effects of a silent client.


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
