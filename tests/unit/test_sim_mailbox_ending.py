"""The simulated mailbox always accepts an end, and ends unattended movements at once."""

import math

import pytest
from robolink_simulators.softmotion.mailbox import (
    MailboxOptions,
    PlcOptions,
    SoftMotionSimulator,
)

from robolink.protocols.mailbox import Bits, CommandState, ErrorClass, GroupState, Opcode
from tests.unit._mailbox_client import MCS, another, linked, owning, shifted

pytestmark = pytest.mark.usefixtures("mailbox_program")

SPEED_MM_S, BRAKES_MM_S2 = 200.0, 2000.0
FAST = (SPEED_MM_S, BRAKES_MM_S2, BRAKES_MM_S2, 20000.0)
BRAKING_MM = SPEED_MM_S**2 / (2 * BRAKES_MM_S2)
CYCLE_S = 0.004
SLOW = (20.0, 200.0, 200.0, 2000.0)
BACK_ALONG_X = 0b1


def jogging(client):
    """Jog back along X until the group has its full speed; return its place then."""
    now = client.tell(Opcode.JOG, 0, BACK_ALONG_X, MCS, dynamics=FAST)
    client.wait(0.2)
    assert client.now().bits & Bits.JOGGING
    return now.ack_head


def distance_mm(client, since):
    """Return the distance of the TCP from an earlier place."""
    return math.dist(tcp_mm(client), since)


def tcp_mm(client):
    return client.now().tcp[:3]


def pass_silently(client, simulator, seconds):
    """Let time pass without any client's requests."""
    client.link.clock.sleep(seconds)
    simulator.advance(client.link.clock.now_ns())


def write_zero_heartbeat(client, simulator):
    client.link.beat(0)


def zero_everything(client, simulator):
    simulator.panel.zero_inputs()


def withdraw_permit(client, simulator):
    simulator.panel.withdraw_permit()


ENDINGS = [
    (write_zero_heartbeat, ErrorClass.HEARTBEAT_LOST),
    (zero_everything, ErrorClass.HEARTBEAT_LOST),
    (withdraw_permit, ErrorClass.NOT_PERMITTED),
]


@pytest.mark.parametrize(("end", "error_class"), ENDINGS)
def test_a_fast_jog_stops_within_two_cycles_and_its_braking_distance(end, error_class):
    client, simulator = owning()
    sequence = jogging(client)
    since = tcp_mm(client)
    end(client, simulator)
    pass_silently(client, simulator, 1.0)
    assert distance_mm(client, since) < BRAKING_MM + 2 * CYCLE_S * SPEED_MM_S
    assert distance_mm(client, since) > BRAKING_MM / 2
    assert (sequence, CommandState.ABORTED, error_class) in client.now().finished
    assert client.now().group_state == GroupState.STANDBY
    assert client.now().tool_slot == 1


@pytest.mark.parametrize(("end", "error_class"), ENDINGS)
def test_every_movement_in_the_queue_ends_and_none_begins(end, error_class):
    client, simulator = owning()
    tcp = client.now().tcp
    sequences = [
        client.tell(
            Opcode.MOVE_LINEAR, 0, 0, MCS, 1, pose=shifted(tcp, z=z), dynamics=SLOW
        ).ack_head
        for z in (-20.0, -40.0)
    ]
    client.wait(0.1)
    since = tcp_mm(client)
    end(client, simulator)
    pass_silently(client, simulator, 3.0)
    assert distance_mm(client, since) < 1.5
    ends = [(sequence, CommandState.ABORTED, error_class) for sequence in sequences]
    assert sorted(client.now().finished[:2]) == sorted(ends)


@pytest.mark.parametrize(("end", "error_class"), ENDINGS)
def test_an_interrupted_movement_ends_and_cannot_go_on(end, error_class):
    client, simulator = owning()
    sequence = client.move(z=-20.0, dynamics=SLOW).ack_head
    client.wait(0.1)
    client.done(Opcode.INTERRUPT)
    end(client, simulator)
    pass_silently(client, simulator, 0.1)
    simulator.panel.give_permit()
    assert (sequence, CommandState.ABORTED, error_class) in client.now().finished
    assert client.refused(Opcode.CONTINUE) == ErrorClass.NO_SUCH_MOVEMENT


def test_the_watchdog_of_the_fieldbus_stops_a_fast_jog_while_nobody_asks_for_anything():
    options = PlcOptions(mailbox=MailboxOptions(watchdog_ms=50))
    client, simulator = owning(options=options)
    client.tell(Opcode.JOG, 0, BACK_ALONG_X, MCS, dynamics=FAST)
    for _ in range(10):  # often enough for this watchdog
        client.beat()
        client.link.clock.sleep(0.02)
    assert client.now().bits & Bits.JOGGING
    since = tcp_mm(client)
    pass_silently(client, simulator, 1.0)
    zeroed_after_mm = 0.05 * SPEED_MM_S
    moved_mm = distance_mm(client, since)
    assert moved_mm < zeroed_after_mm + BRAKING_MM + 2 * CYCLE_S * SPEED_MM_S
    assert moved_mm > zeroed_after_mm
    assert not any(simulator.plc.program.inbox.words)


def without_permit(simulator=None):
    client, simulator = owning(simulator)
    simulator.panel.withdraw_permit()
    return client, simulator


def test_what_only_ends_needs_no_permit_and_what_begins_does():
    client, _ = without_permit()
    client.done(Opcode.JOG, 0, 0, MCS)
    client.done(Opcode.HALT)
    assert client.refused(Opcode.INTERRUPT) == ErrorClass.NO_SUCH_MOVEMENT
    assert client.refused(Opcode.JOG, 1, 1, MCS, dynamics=FAST) == ErrorClass.NOT_PERMITTED
    assert client.refused(Opcode.JOG, 1, 0, MCS, dynamics=FAST) == ErrorClass.NOT_PERMITTED
    assert client.refused(Opcode.CONTINUE) == ErrorClass.NOT_PERMITTED
    client.done(Opcode.STOP)
    assert client.refused(Opcode.STOP, 1) == ErrorClass.NOT_PERMITTED
    assert client.now().group_state == GroupState.STOPPING


def test_interrupting_takes_the_owner_and_stopping_does_not():
    client, _ = owning()
    sequence = jogging(client)
    other = another(client)
    assert other.refused(Opcode.INTERRUPT) == ErrorClass.NOT_OWNER
    assert client.now().bits & Bits.JOGGING
    other.done(Opcode.STOP)
    assert (sequence, CommandState.ABORTED, ErrorClass.NONE) in client.now().finished
    assert not client.now().bits & Bits.JOGGING


def test_anybody_ends_a_jog_with_or_without_a_permit_and_its_owner_is_told():
    client, simulator = owning()
    sequence = jogging(client)
    other = another(client)
    since = tcp_mm(client)
    other.done(Opcode.JOG, 0, 0, MCS)
    client.wait(0.5)
    assert distance_mm(client, since) < BRAKING_MM + 2 * CYCLE_S * SPEED_MM_S
    assert client.now().finished[0] == (sequence, CommandState.ABORTED, ErrorClass.NONE)
    for nothing_pressed in ((1, 0), (1, 1)):
        assert other.refused(Opcode.JOG, *nothing_pressed, MCS) == ErrorClass.NOT_OWNER
    simulator.panel.withdraw_permit()
    other.done(Opcode.JOG, 0, 0, MCS)
    client.sequence = other.sequence
    client.done(Opcode.OWNERSHIP, 0)
    other.sequence = client.sequence
    other.done(Opcode.JOG, 0, 0, MCS)  # nobody owns it


def test_a_jog_whose_owner_presses_again_after_another_let_go_is_his_to_end():
    client, _ = owning()
    sequence = jogging(client)
    other = another(client)
    other.tell(Opcode.JOG, 0, 0, MCS)
    client.sequence = other.sequence
    client.tell(Opcode.JOG, 0, BACK_ALONG_X, MCS, dynamics=FAST)
    client.wait(0.2)
    assert client.now().bits & Bits.JOGGING
    client.done(Opcode.JOG, 0, 0, MCS)
    client.wait(0.5)
    assert sequence not in [end.sequence for end in client.now().finished]


EXPELLED = (CommandState.ABORTED, ErrorClass.NOT_OWNER)


def test_a_jog_ends_with_its_owner_and_the_new_one_goes_on_from_there():
    client, _ = owning()
    sequence = jogging(client)
    other = another(client)
    since = tcp_mm(client)
    other.take(insist=1)
    other.wait(1.0)
    assert BRAKING_MM / 2 < distance_mm(client, since) < BRAKING_MM + 3 * CYCLE_S * SPEED_MM_S
    assert client.now().finished[0] == (sequence, *EXPELLED)
    assert client.now().group_state == GroupState.STANDBY
    assert client.now().tool_slot == 1
    client.sequence = other.sequence
    client.done(Opcode.JOG, 0, 0, MCS)
    assert client.refused(Opcode.JOG, 0, BACK_ALONG_X, MCS, dynamics=FAST) == ErrorClass.NOT_OWNER
    other.sequence = client.sequence
    moved = other.move(z=-5.0).ack_head
    assert other.end_of(moved).state == CommandState.DONE


def test_a_movement_of_the_new_owner_that_comes_while_the_old_one_brakes_is_not_ended():
    client, _ = owning()
    old = client.move(z=-150.0, dynamics=FAST).ack_head
    client.wait(0.3)
    other = another(client)
    other.take(insist=1)
    new = other.move(z=20.0, dynamics=SLOW).ack_head
    assert other.end_of(new) == (new, CommandState.DONE, ErrorClass.NONE)
    assert (old, *EXPELLED) in other.now().finished


def test_every_movement_of_the_old_owner_ends_whatever_kind_it_is():
    client, _ = owning()
    pose = shifted(client.now().tcp, z=-60.0)
    commanded = (
        (Opcode.MOVE_LINEAR, 0, 0, MCS, 1),
        (Opcode.MOVE_UNTIL_INPUT, 3, 0, MCS, 0),
    )
    for opcode, *operands in commanded:
        sequence = client.tell(opcode, *operands, pose=pose, dynamics=SLOW).ack_head
        client.wait(0.2)
        other = another(client, owner=0x1000 + sequence)
        other.take(insist=1)
        assert other.end_of(sequence) == (sequence, *EXPELLED)
        client.sequence = other.sequence
        client.take(insist=1)
    axes = shifted(client.now().axes, 90.0)
    slowly = (0.02, 0.5, 0.5, 0.5)
    direct = client.tell(Opcode.MOVE_DIRECT, pose=axes, dynamics=slowly).ack_head
    client.wait(0.2)
    other.sequence = client.sequence
    other.take(insist=1)
    assert other.end_of(direct) == (direct, *EXPELLED)


def test_a_stranger_at_the_plc_ends_what_the_owner_has_under_way():
    client, simulator = owning()
    sequence = jogging(client)
    since = tcp_mm(client)
    simulator.panel.take_ownership()
    pass_silently(client, simulator, 0.4)
    assert distance_mm(client, since) < BRAKING_MM + 3 * CYCLE_S * SPEED_MM_S
    assert (sequence, *EXPELLED) in client.now().finished


def test_an_owner_who_takes_it_again_ends_nothing_of_his_own():
    client, _ = owning()
    sequence = client.move(z=-20.0).ack_head
    client.wait(0.1)
    client.take()
    assert client.end_of(sequence).state == CommandState.DONE


def test_a_refused_take_ends_nothing():
    client, _ = owning()
    sequence = client.move(z=-20.0).ack_head
    client.wait(0.1)
    other = another(client)
    assert other.refused(Opcode.OWNERSHIP, 1, 0) == ErrorClass.NOT_OWNER
    assert client.end_of(sequence).state == CommandState.DONE


@pytest.mark.parametrize("insist", [0, 1])
@pytest.mark.parametrize("what", ["jog", "movement"])
def test_an_owner_who_leaves_has_what_is_unfinished_halted_first(what, insist):
    client, simulator = owning()
    sequence = jogging(client) if what == "jog" else client.move(z=-40.0, dynamics=SLOW).ack_head
    client.wait(0.1)
    since = tcp_mm(client)
    now = client.tell(Opcode.OWNERSHIP, 0, insist)
    assert (now.answer.holder, now.state) == (0, CommandState.BUFFERED)
    other = another(client)
    assert CommandState.ERROR in {end.state for end in refused_meanwhile(other)}
    pass_silently(client, simulator, 0.3)
    assert distance_mm(client, since) < BRAKING_MM + 2 * CYCLE_S * SPEED_MM_S
    assert client.now().state == CommandState.DONE
    assert (sequence, CommandState.ABORTED, ErrorClass.NONE) in client.now().finished
    assert client.now().group_state == GroupState.STANDBY


def refused_meanwhile(other):
    """Let another client ask for the mailbox during the braking, and return the ends."""
    other.write(other.command(Opcode.OWNERSHIP, 1))
    other.link.clock.sleep(2 * CYCLE_S)
    return other.now().finished


def test_a_client_that_only_looks_keeps_nothing_going():
    client, _ = owning()
    sequence = jogging(client)
    for _ in range(40):
        client.now()
        client.link.read_head()
        client.link.clock.sleep(0.02)
    assert (sequence, CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST) in client.now().finished


def test_a_watchdog_that_expired_zeroes_again_only_after_another_request():
    options = PlcOptions(mailbox=MailboxOptions(watchdog_ms=500))
    client = linked(SoftMotionSimulator(options=options))
    client.take()
    simulator = client.link._simulator
    pass_silently(client, simulator, 2.0)
    assert not any(simulator.plc.program.inbox.words)
    client.beat()
    assert any(simulator.plc.program.inbox.words)
    pass_silently(client, simulator, 0.4)
    assert any(simulator.plc.program.inbox.words)
    pass_silently(client, simulator, 0.2)
    assert not any(simulator.plc.program.inbox.words)
