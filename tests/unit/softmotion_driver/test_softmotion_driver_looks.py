"""Which snapshot allows a movement, and how often a movement is looked at.

Between the marker of a movement and its block anything may happen: a person selects another tool,
another program takes the mailbox, the PLC restarts. What allowed the movement before allows
nothing then.
"""

import math
import threading
import time
from dataclasses import replace
from itertools import pairwise

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.controllers import Jog
from robolink.controllers.softmotion.heartbeat import (
    LOOK_S,
    PAUSED_BEAT_S,
    POLL_S,
    ExpectedEnd,
    Turns,
    shared_out,
)
from robolink.controllers.softmotion.movement import shortest_time_s
from robolink.controllers.softmotion.snapshots import STEP_S
from robolink.errors import (
    ControllerFaultError,
    LeaseLostError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    RejectedError,
    StoppedError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.model import MarkerKind, MotionOutcome, MotionProfile, Path, Pose, WorkBox
from robolink.protocols.mailbox import (
    Bits,
    ErrorClass,
    GroupState,
    Opcode,
    decode_response,
    encode_response,
    next_number,
)
from robolink.timing import NS_PER_S
from tests._rows import each_row
from tests.unit.softmotion_driver import _plc
from tests.unit.softmotion_driver._plc import MS, STRANGER

ANYWHERE = WorkBox()
TARGET = Pose(410.0, 90.0, 250.0, 45.0, tool=0)
STRAIGHT = MotionProfile(Path.STRAIGHT, speed_mm_s=20.0)
ALL = Bits.POWERED | Bits.IN_SYNC | Bits.TOOL_KNOWN | Bits.PERMITTED
LONGEST_S = 1.25
"""A pause is at most this many times as long as usual."""

MISHAPS = [
    ({"tool_slot": 3}, NotReadyReason.WRONG_TOOL),
    ({"bits": ALL & ~Bits.TOOL_KNOWN}, NotReadyReason.WRONG_TOOL),
    ({"bits": ALL & ~Bits.POWERED}, NotReadyReason.MOTORS_OFF),
    ({"bits": ALL & ~Bits.PERMITTED}, NotReadyReason.NOT_REMOTE),
    ({"bits": ALL | Bits.INTERRUPTED}, NotReadyReason.PAUSED),
    ({"bits": ALL | Bits.JOGGING}, NotReadyReason.RUNNING),
    ({"group_state": GroupState.DISABLED}, NotReadyReason.MOTORS_OFF),
    ({"group_state": GroupState.ERRORSTOP}, NotReadyReason.FAULT),
    ({"group_state": GroupState.STOPPING}, NotReadyReason.PAUSED),
    ({"group_state": GroupState.HOMING}, NotReadyReason.RUNNING),
]
OF_THE_TOOL = 2
"""How many of them are about the tool; a jog goes with whatever tool there is."""


def move(group, profile=STRAIGHT):
    return group.move_to(TARGET, profile, box=ANYWHERE)


def after_the_marker(monkeypatch, cell, act):
    """Do something as soon as the marker of a movement is stored."""
    begin = cell.outcomes.begin

    def stored(marker):
        begin(marker)
        if marker.kind is MarkerKind.MOVE:
            act()

    monkeypatch.setattr(cell.outcomes, "begin", stored)


@pytest.mark.parametrize(("change", "reason"), MISHAPS)
def test_what_changes_after_the_marker_of_a_movement_holds_it_back(
    cell, plc, group, monkeypatch, change, reason
):
    group.pose()

    def happen():
        plc.now = replace(plc.now, **change)

    after_the_marker(monkeypatch, cell, happen)
    with pytest.raises(NotReadyError) as refusal:
        move(group)
    assert refusal.value.reason is reason
    assert cell.link.sent == []
    assert cell.open_requests() == []


@pytest.mark.parametrize(("change", "reason"), MISHAPS[OF_THE_TOOL:])
def test_what_changes_after_the_marker_of_a_jog_holds_it_back(
    cell, plc, group, monkeypatch, change, reason
):
    def happen():
        plc.now = replace(plc.now, **change)

    after_the_marker(monkeypatch, cell, happen)
    with pytest.raises(NotReadyError) as refusal:
        group.jog(Jog(forward=frozenset({0})), duration_s=1.0, box=ANYWHERE)
    assert refusal.value.reason is reason
    assert cell.link.sent == []
    assert cell.open_requests() == []


@pytest.mark.parametrize("moment", ["before the call", "after the marker"])
def test_a_restart_before_the_block_leaves_nothing_in_doubt(cell, plc, group, monkeypatch, moment):
    group.pose()
    if moment == "before the call":
        plc.restart()
    else:
        after_the_marker(monkeypatch, cell, plc.restart)
    with pytest.raises(TransportBrokenError, match="restarted"):
        move(group)
    assert cell.link.sent == []
    assert cell.open_requests() == []


def test_a_link_that_dies_before_the_block_leaves_nothing_in_doubt(cell, group, monkeypatch):
    group.pose()
    after_the_marker(monkeypatch, cell, lambda: cell.link.lose_answer("read_response"))
    with pytest.raises(TransportTimeoutError):
        move(group)
    assert cell.link.sent == []
    assert cell.open_requests() == []


@pytest.mark.parametrize("lose", ["lose_answer", "lose_request"])
def test_a_link_that_dies_with_the_block_leaves_the_movement_in_doubt(
    cell, group, monkeypatch, lose
):
    group.pose()
    getattr(cell.link, lose)("write_command")
    with pytest.raises(OutcomeUnknownError, match="may or may not"):
        move(group)
    assert len(cell.open_requests()) == 1


def test_a_link_that_dies_after_the_acceptance_leaves_the_movement_in_doubt(cell, plc, group):
    group.pose()
    cell.link.before("read_response", lambda: plc.clock.sleep(0.06), nth=2)  # that of acceptance
    cell.link.lose_answer("beat")
    with pytest.raises(OutcomeUnknownError):
        move(group)
    assert plc.opcodes() == [Opcode.MOVE_LINEAR]
    assert len(cell.open_requests()) == 1


def test_another_owner_after_the_marker_gets_the_movement_refused(cell, plc, group, monkeypatch):
    group.pose()

    def take():
        plc.owner, plc.epoch = STRANGER, next_number(plc.epoch)

    after_the_marker(monkeypatch, cell, take)
    with pytest.raises(RejectedError) as refusal:
        move(group)
    assert refusal.value.code == ErrorClass.NOT_OWNER
    assert cell.open_requests() == []
    sent = len(cell.link.sent)
    with pytest.raises(LeaseLostError):
        move(group)
    assert len(cell.link.sent) == sent


def test_a_stop_after_the_marker_holds_the_movement_back(cell, controller, group, monkeypatch):
    group.pose()
    after_the_marker(monkeypatch, cell, controller.latch.close)
    with pytest.raises(StoppedError):
        move(group)
    assert cell.link.sent == []
    assert cell.open_requests() == []


def test_a_state_that_has_been_put_right_refuses_nothing(plc, group):
    """A refusal comes from a new snapshot only."""
    plc.now = replace(plc.now, bits=ALL & ~Bits.PERMITTED)
    group.pose()
    plc.now = replace(plc.now, bits=ALL)
    assert move(group).wait(timeout_s=5) is MotionOutcome.ARRIVED


def test_one_snapshot_serves_a_step_and_the_block_has_its_own(cell, group):
    move(group).wait(timeout_s=5)
    group.pose()
    read = counted(cell, "read_response")
    motion = move(group)
    assert read[0] == 2  # one after the marker, and one that shows the acceptance
    motion.wait(timeout_s=5)


def test_without_a_snapshot_of_this_step_one_more_is_read(cell, plc, group):
    group.pose()
    plc.clock.sleep(2 * STEP_S)
    read = counted(cell, "read_response")
    motion = move(group)
    assert read[0] == 3
    motion.wait(timeout_s=5)


def test_a_snapshot_belongs_to_a_step_for_a_moment_and_until_a_command(plc, controller):
    snapshots = controller._mailbox.snapshots
    now = snapshots.take()
    assert snapshots.of_this_step() is now
    controller.io.read_input(3)
    later = snapshots.of_this_step()
    assert later is not None  # the one that showed the answer
    assert later is not now
    plc.clock.sleep(STEP_S + 0.001)
    assert snapshots.of_this_step() is None


def test_a_snapshot_from_before_a_command_belongs_to_no_step(controller):
    """What the command changes is not in it, however young it is."""
    snapshots, wire = controller._mailbox.snapshots, controller._mailbox.wire
    snapshots.take()
    wire.write([0] * 64, lambda: None)
    assert snapshots.of_this_step() is None


def counted(cell, method):
    """Count the calls of a method of the link from now on."""
    calls = [0]
    exchange = getattr(cell.link, method)

    def counting(*args):
        calls[0] += 1
        return exchange(*args)

    setattr(cell.link, method, counting)
    return calls


def looked_at(cell, plc):
    """Note from now on when the client looked, and when it gave a sign of life, in s."""
    looks: list[float] = []
    signs: list[float] = []
    for method, noted in (
        ("read_head", looks),
        ("read_response", looks),
        ("beat", signs),
        ("write_command", signs),
    ):
        exchange = getattr(cell.link, method)

        def noting(*args, exchange=exchange, noted=noted):
            noted.append(plc.clock.now_ns() / NS_PER_S)
            return exchange(*args)

        setattr(cell.link, method, noting)
    return looks, signs


def longest_gap(times):
    return max(b - a for a, b in pairwise(times))


@pytest.mark.parametrize("lasts_s", [0.02, 0.3, 1.0, 3.0, 12.0])
@pytest.mark.parametrize("path", [Path.STRAIGHT, Path.JOINT])
def test_whatever_a_movement_takes_it_is_looked_at_and_kept_going(
    cell, plc, group, monkeypatch, lasts_s, path
):
    """The PLC here jumps at the end, so that nothing of it can be foreseen."""
    monkeypatch.setattr(_plc, "MOVE_NS", round(lasts_s * NS_PER_S))
    group.pose()
    looks, signs = looked_at(cell, plc)
    assert move(group, MotionProfile(path)).wait(timeout_s=20) is MotionOutcome.ARRIVED
    ended_s = plc.clock.now_ns() / NS_PER_S
    assert longest_gap([*signs, ended_s]) <= LONGEST_S * PAUSED_BEAT_S + 0.01
    assert longest_gap(looks) <= LONGEST_S * LOOK_S + 0.01


class Course:
    """A movement that is really under way: its tip goes as its profile says.

    Args:
        slower: By what factor it takes longer than its numbers say.
        jerk: Whether the corners of its speed are rounded.
    """

    def __init__(self, plc, *, slower=1.0, rounded=False):
        self.plc, self.slower, self.rounded = plc, slower, rounded
        self.lasts_s = 0.0

    def starts(self, command):
        start = self.plc.now.tcp
        way = math.dist(start[:3], command.pose[:3])
        self.lasts_s = self.slower * shortest_time_s(way, command.dynamics)
        if command.opcode == Opcode.MOVE_DIRECT:
            self.lasts_s = self.slower * 2.6
        self.begun_s = self.plc.clock.now_ns() / NS_PER_S
        self.start, self.end = start, command.pose

    def tip(self):
        passed = min(1.0, (self.plc.clock.now_ns() / NS_PER_S - self.begun_s) / self.lasts_s)
        if self.rounded:
            share = (1 - math.cos(math.pi * passed)) / 2
        else:
            share = 2 * passed**2 if passed < 0.5 else 1 - 2 * (1 - passed) ** 2
        return tuple(a + share * (b - a) for a, b in zip(self.start, self.end, strict=True))


@pytest.mark.parametrize("rounded", [False, True])
@pytest.mark.parametrize("slower", [1.0, 1.02, 1.6, 4.0])
@pytest.mark.parametrize("path", [Path.STRAIGHT, Path.JOINT])
def test_the_end_of_a_movement_is_expected_and_noticed_soon(
    cell, plc, group, monkeypatch, path, slower, rounded
):
    course = Course(plc, slower=slower, rounded=rounded)
    carry_out, response = plc._move, plc.response

    def start(command):
        course.starts(command)
        monkeypatch.setattr(_plc, "MOVE_NS", round(course.lasts_s * NS_PER_S))
        return carry_out(command)

    def shown():
        plc.advance()
        if plc.now.active_movement:
            plc.now = replace(plc.now, tcp=course.tip())
        return response()

    monkeypatch.setattr(plc, "_move", start)
    monkeypatch.setattr(plc, "response", shown)
    group.pose()
    motion = move(group, MotionProfile(path, speed_mm_s=20.0))
    looks, signs = looked_at(cell, plc)
    assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED
    late_s = plc.clock.now_ns() / NS_PER_S - course.begun_s - course.lasts_s
    assert late_s <= max(0.03, POLL_S + 0.01)
    assert longest_gap(signs) <= LONGEST_S * PAUSED_BEAT_S + 0.01
    # About every 0.3 s, and some around the expected end.
    assert len(looks) <= course.lasts_s / LOOK_S * (1 if slower < 1.5 else 4) + 14


@pytest.mark.parametrize("when_s", [0.3, 2.5])
@pytest.mark.parametrize(
    "happens",
    [
        {"group_state": GroupState.ERRORSTOP},
        {"group_state": GroupState.STOPPING},
        {"bits": ALL & ~Bits.PERMITTED},
    ],
)
def test_what_ends_a_movement_early_is_seen_within_half_a_second(
    cell, plc, group, monkeypatch, when_s, happens
):
    monkeypatch.setattr(_plc, "MOVE_NS", 9_000 * MS)
    motion = move(group)
    ends_s = plc.clock.now_ns() / NS_PER_S + when_s
    advance = plc.advance

    def ending():
        advance()
        if plc._queue and plc.clock.now_ns() / NS_PER_S >= ends_s:
            plc.end_all(ErrorClass.AXIS)
            plc.now = replace(plc.now, **happens)

    monkeypatch.setattr(plc, "advance", ending)
    with pytest.raises(ControllerFaultError):
        motion.wait(timeout_s=20)
    assert plc.clock.now_ns() / NS_PER_S - ends_s < 0.5


def test_a_wait_that_begins_late_beats_at_once(cell, plc, group):
    motion = move(group)
    plc.clock.sleep(0.4)
    assert motion.wait(timeout_s=5) is MotionOutcome.ARRIVED


def test_a_movement_whose_tip_is_told_as_no_number_is_waited_for(cell, plc, group, monkeypatch):
    monkeypatch.setattr(_plc, "MOVE_NS", 2_000 * MS)
    motions = [move(group)]
    plc.now = replace(plc.now, tcp=(math.inf, math.nan, 0.0, math.inf, math.nan, 0.0))
    motions.append(move(group))
    assert [motion.wait(timeout_s=5) for motion in motions] == [MotionOutcome.ARRIVED] * 2


def test_a_movement_that_begins_where_there_is_no_number_is_waited_for(plc, group):
    plc.now = replace(plc.now, tcp=(math.inf, *plc.now.tcp[1:]))
    assert move(group).wait(timeout_s=5) is MotionOutcome.ARRIVED


@each_row(
    ("whole_s", "usual_s", "part_s"),
    [(0.0, 0.1, 0.0), (0.05, 0.1, 0.05), (0.124, 0.1, 0.124), (0.126, 0.1, 0.063), (0.3, 0.1, 0.1)],
)
def test_a_time_is_shared_out_evenly(whole_s, usual_s, part_s):
    assert shared_out(whole_s, usual_s) == pytest.approx(part_s)


@each_row(("distance", "seconds"), [(0.0, 0.0), (0.1, 0.1), (10.0, 1.0), (20.0, 1.5)])
def test_the_shortest_time_of_a_way_is_that_of_its_speed_and_acceleration(distance, seconds):
    assert shortest_time_s(distance, (20.0, 40.0, 40.0, 80.0)) == pytest.approx(seconds)


def test_a_turn_over_the_end_of_the_circle_is_a_short_way():
    end = ExpectedEnd((0.0, 0.0, 0.0, 179.0, 0.0, 0.0), (0.0, 0.0, 0.0, -175.0, 0.0, 0.0), 0)
    end.saw((0.0, 0.0, 0.0, -179.9, 0.0, 0.0), 1_000 * MS)
    assert end.patience_s(1_000 * MS) == pytest.approx(shared_out(1.008, LOOK_S))


def test_an_end_that_another_reading_showed_is_no_rest(cell, plc, controller, group, monkeypatch):
    """The acceptance showed a group at rest, which had not begun."""
    monkeypatch.setattr(_plc, "MOVE_NS", 20 * MS)
    begun_ns = plc.clock.now_ns()
    brakes_ns, rests_ns = begun_ns + 20 * MS, begun_ns + 150 * MS

    def late(words):
        now_ns = plc.clock.now_ns()
        moving = brakes_ns <= now_ns < rests_ns
        state = GroupState.MOVING if moving else GroupState.STANDBY
        return encode_response(replace(decode_response(words), group_state=state))

    cell.link.response = late
    motion = move(group)
    plc.clock.sleep(0.02)
    assert controller.status().running
    assert motion.wait(timeout_s=5) is MotionOutcome.ARRIVED
    assert plc.clock.now_ns() >= rests_ns


def test_a_stop_of_this_process_ends_a_pause(cell, plc, controller, group, monkeypatch):
    monkeypatch.setattr(_plc, "MOVE_NS", 9_000 * MS)
    motion = move(group)
    looks, signs = looked_at(cell, plc)
    cell.link.before("beat", controller.latch.close)
    cell.link.before("read_head", plc.end_all)
    with pytest.raises(StoppedError):
        motion.wait(timeout_s=20)
    assert looks[0] - signs[0] <= LONGEST_S * PAUSED_BEAT_S + 0.01


def test_on_a_network_others_have_the_wire_while_the_waiter_pauses():
    turns, entered = Turns(), threading.Event()

    def look():
        with turns:
            entered.set()

    with turns.kept():
        other = threading.Thread(target=look)
        with turns.pausing():
            other.start()
            assert entered.wait(0.5)
        other.join()
        entered.clear()
        held = threading.Thread(target=look)
        held.start()
        assert not entered.wait(0.05)  # between two pauses the waiter alone has it
        assert turns.let_one_in()
        held.join()
    assert entered.is_set()


def test_a_waiter_goes_on_only_when_nobody_is_in_the_middle_of_an_exchange():
    turns, inside, left = Turns(), threading.Event(), []

    def look():
        with turns:
            inside.set()
            time.sleep(0.05)
            left.append(True)

    with turns.kept():
        other = threading.Thread(target=look)
        with turns.pausing():
            other.start()
            assert inside.wait(5)
        assert left
        other.join()


@pytest.mark.parametrize("whole_look_s", [0.0, 0.3])
def test_a_stop_does_not_wait_until_a_waiter_has_paused(
    cell, plc, controller, group, monkeypatch, whole_look_s
):
    """Neither on a network nor on a serial line, where others are let in by the waiter alone."""
    arrived: list[bool] = []

    class Stands(ManualClock):
        def sleep(self, seconds):
            if seconds > 0.01 and not arrived:
                arrived.append(False)
                stopper.start()
                over_s = time.monotonic() + 0.5
                while Opcode.STOP not in plc.opcodes() and time.monotonic() < over_s:
                    time.sleep(0.001)
                arrived[:] = [Opcode.STOP in plc.opcodes()]
            super().sleep(seconds)

    monkeypatch.setattr(type(cell.link), "whole_look_s", property(lambda _: whole_look_s))
    stopper = threading.Thread(target=controller.stop)
    monkeypatch.setattr(plc.clock, "__class__", Stands)
    with pytest.raises(StoppedError):
        move(group).wait(timeout_s=5)
    stopper.join(5)
    assert arrived == [True]
    assert plc.now.group_state == GroupState.STOPPING
