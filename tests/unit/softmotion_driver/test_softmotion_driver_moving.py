"""Movements of an axis group: marked, sent once, kept alive while they are waited for.

Source: docs/reference/mailbox.md, "Movements".
"""

import math
import signal
import threading
from dataclasses import replace
from functools import partial

import pytest

from robolink.controllers import Jog, open_softmotion
from robolink.controllers.softmotion.heartbeat import Turns
from robolink.errors import (
    BusyError,
    ConfigError,
    ControllerFaultError,
    LimitError,
    MotionTimeoutError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    RejectedError,
    RobolinkError,
    StoppedError,
    TransportTimeoutError,
)
from robolink.model import InputEdge, MotionOutcome, MotionProfile, Path, Pose, Verdict, WorkBox
from robolink.protocols.mailbox import (
    Bits,
    BufferMode,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    Finished,
    GroupState,
    Opcode,
    decode_response,
    encode_response,
)
from tests.unit.softmotion_driver import _plc
from tests.unit.softmotion_driver._plc import MS

ANYWHERE = WorkBox()
TARGET = Pose(410.0, 90.0, 250.0, 45.0, tool=0)
STRAIGHT = MotionProfile(Path.STRAIGHT, speed_mm_s=20.0)


def move(group, target=TARGET, profile=STRAIGHT):
    return group.move_to(target, profile, box=ANYWHERE)


def test_a_movement_arrives_and_its_marker_goes(cell, plc, group):
    motion = move(group)
    assert len(cell.open_requests()) == 1
    assert motion.wait(timeout_s=5) is MotionOutcome.ARRIVED
    assert cell.open_requests() == []
    assert group.pose().coordinates() == pytest.approx(TARGET.coordinates())
    (command,) = plc.executed
    assert command.opcode == Opcode.MOVE_LINEAR
    assert command.operands[2:] == (CoordinateSystem.MCS, BufferMode.BUFFERED)
    assert command.dynamics[0] == 20.0


def test_ctrl_c_before_the_first_beat_keeps_nobody_out_afterwards(monkeypatch):
    turns = Turns()

    def interrupted(_predicate, _timeout):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(turns._changed, "wait_for", interrupted)
        with pytest.raises(KeyboardInterrupt), turns.kept():
            raise AssertionError
    assert turns._waiters == 0


def test_a_joint_move_carries_factors(plc, group):
    move(group, profile=MotionProfile(Path.JOINT, speed_percent=5)).wait(timeout_s=5)
    (command,) = plc.executed
    assert command.opcode == Opcode.MOVE_DIRECT
    assert command.dynamics == (0.05,) * 4


@pytest.mark.parametrize(("told_deg", "read_deg"), [(4.9e-13, 0.0), (-8.5e-7, 0.0), (0.001, 0.001)])
def test_a_tilt_that_is_mere_rounding_is_none(plc, group, told_deg, read_deg):
    plc.now = replace(plc.now, tcp=(400.0, 80.0, 250.0, 30.0, told_deg, 15.0))
    pose = group.pose()
    assert math.hypot(pose.v_deg, pose.w_deg) == pytest.approx(read_deg, abs=1e-9)
    assert (pose.v_deg, pose.w_deg) == (0.0, 0.0) or read_deg
    assert pose.u_deg == pytest.approx(45.0)


def test_speeds_are_converted_to_the_plcs_unit(cell, plc):
    plc.now = replace(plc.now, unit_um=10.0)
    move(cell.met().groups[0]).wait(timeout_s=5)
    assert plc.executed[-1].dynamics[0] == pytest.approx(2000.0)


@pytest.mark.parametrize(
    "profile",
    [
        MotionProfile(speed_percent=0),
        MotionProfile(speed_percent=101),
        replace(STRAIGHT, speed_mm_s=0),
    ],
)
def test_an_impossible_speed_is_refused_unsent(cell, group, profile):
    with pytest.raises(ConfigError):
        move(group, profile=profile)
    assert cell.link.sent == []


def test_a_target_outside_the_box_is_refused_unsent(cell, group):
    box = WorkBox(z_min_mm=260.0)
    with pytest.raises(LimitError):
        group.move_to(TARGET, STRAIGHT, box=box)
    with pytest.raises(LimitError):
        group.move_until_input(TARGET, InputEdge(1), speed_mm_s=5, box=box)
    assert cell.link.sent == []


def test_a_target_for_another_tool_is_refused_unsent(cell, group):
    for tool in (3, None):
        with pytest.raises(NotReadyError) as refusal:
            move(group, replace(TARGET, tool=tool))
        assert refusal.value.reason is NotReadyReason.WRONG_TOOL
    assert cell.link.sent == []
    assert cell.open_requests() == []


def test_a_target_in_a_local_or_without_a_number_is_refused(cell, group):
    with pytest.raises(ConfigError, match="local 1"):
        move(group, replace(TARGET, local=1))
    with pytest.raises(ConfigError, match="not a number"):
        move(group, replace(TARGET, u_deg=float("nan")))
    assert cell.link.sent == []
    assert cell.open_requests() == []


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"group_state": GroupState.DISABLED}, NotReadyReason.MOTORS_OFF),
        ({"group_state": GroupState.ERRORSTOP}, NotReadyReason.FAULT),
        ({"group_state": GroupState.STOPPING}, NotReadyReason.PAUSED),
        ({"group_state": GroupState.HOMING}, NotReadyReason.RUNNING),
        ({"bits": Bits.PERMITTED}, NotReadyReason.MOTORS_OFF),
        ({"bits": Bits.POWERED}, NotReadyReason.NOT_REMOTE),
        ({"bits": Bits.POWERED | Bits.PERMITTED | Bits.INTERRUPTED}, NotReadyReason.PAUSED),
    ],
)
def test_a_state_that_forbids_moving_is_named(cell, plc, group, change, reason):
    plc.now = replace(plc.now, **change)
    with pytest.raises(NotReadyError) as refusal:
        move(group)
    assert refusal.value.reason is reason
    assert refusal.value.remedy
    assert cell.link.sent == []
    assert cell.open_requests() == []


def test_waiting_beats_often_enough_for_the_watchdog(cell, plc, group):
    for _ in range(3):
        assert move(group).wait(timeout_s=5) is MotionOutcome.ARRIVED
    assert len(cell.link.beats) >= 9


def test_a_movement_on_which_nobody_waits_is_halted_by_the_plc(cell, plc, group):
    motion = move(group)
    later = move(group)
    plc.clock.sleep(3.0)
    assert motion.wait(timeout_s=5) is MotionOutcome.ARRIVED
    with pytest.raises(ControllerFaultError, match="heartbeat was missing"):
        later.wait(timeout_s=5)
    assert cell.open_requests() == []


def test_four_movements_may_be_under_way_and_no_more(cell, plc, group):
    motions = [move(group) for _ in range(4)]
    with pytest.raises(BusyError, match="four movements"):
        move(group)
    assert len(plc.executed) == 4
    assert [motion.wait(timeout_s=5) for motion in motions] == [MotionOutcome.ARRIVED] * 4
    assert cell.open_requests() == []
    move(group).wait(timeout_s=5)


def test_an_end_that_was_read_is_known_when_the_plc_has_forgotten_it(plc, group):
    first = move(group)
    second = move(group)
    assert second.wait(timeout_s=5) is MotionOutcome.ARRIVED
    plc.now = replace(plc.now, finished=(Finished(9, 10, 0),) * 4)
    assert first.wait(timeout_s=5) is MotionOutcome.ARRIVED


def test_a_movement_that_takes_too_long_is_halted(cell, plc, group):
    motions = [move(group) for _ in range(4)]
    with pytest.raises(MotionTimeoutError, match="did not end within"):
        motions[3].wait(timeout_s=0.7)
    assert plc.opcodes()[-1] == Opcode.HALT
    assert [motion.wait(timeout_s=1) for motion in motions[:3]][-1] is MotionOutcome.STOPPED
    assert cell.open_requests() == []


def test_a_stop_from_another_thread_ends_the_wait(cell, plc, controller, group):
    motion = move(group)
    stopped: list[bool] = []

    def stop():
        thread = threading.Thread(target=controller.stop)
        thread.start()
        thread.join()
        stopped.append(True)

    cell.link.before("beat", stop, nth=2)
    with pytest.raises(StoppedError):
        motion.wait(timeout_s=5)
    assert stopped
    assert plc.now.group_state == GroupState.STOPPING


def signs_of_life(cell):
    """Return how many different heartbeat words the PLC has been sent, alone or with a command."""
    return len({*cell.link.beats, *(words[62] for words in cell.link.sent)})


def test_a_movement_whose_stop_got_lost_is_kept_going_by_nothing(cell, plc, monkeypatch):
    """Its waiter looks on; the PLC hears no new heartbeat and halts it."""
    monkeypatch.setattr(_plc, "MOVE_NS", 3000 * MS)
    controller = open_softmotion(cell.link, outcomes=cell.outcomes, timeout_s=0.2)
    controller.take()
    plc.executed.clear()
    motion, heard = move(controller.groups[0]), []

    def stop_in_vain():
        for _ in range(100):
            cell.link.hold_up("write_command")
        with pytest.raises(RobolinkError):
            controller.stop()
        heard.append(signs_of_life(cell))

    def press():
        thread = threading.Thread(target=stop_in_vain)
        thread.start()
        thread.join()

    cell.link.before("beat", press, nth=2)
    with pytest.raises(StoppedError):
        motion.wait(timeout_s=5)
    assert plc.now.finished[0].error_class == ErrorClass.HEARTBEAT_LOST
    assert signs_of_life(cell) - heard[0] <= 1  # the beat that was on its way
    assert plc.opcodes() == [Opcode.MOVE_LINEAR]


@pytest.mark.parametrize("lost", ["refused", "lost"])
def test_ctrl_c_whose_halt_does_not_get_through_stops_the_group(cell, plc, group, lost):
    motion = move(group)

    def ctrl_c():
        for _ in range(3 if lost == "refused" else 2):
            if lost == "refused":
                cell.link.refuse("write_command")
            else:
                cell.link.hold_up("write_command")
        raise KeyboardInterrupt

    cell.link.before("beat", ctrl_c, nth=2)
    with pytest.raises(KeyboardInterrupt):
        motion.wait(timeout_s=5)
    assert plc.opcodes()[-1] in (
        (Opcode.STOP,) if lost == "refused" else (Opcode.HALT, Opcode.STOP)
    )
    assert plc.now.group_state != GroupState.MOVING


@pytest.mark.parametrize("at", ["write_command", "read_head", "read_response"])
def test_ctrl_c_inside_a_stop_lets_it_out_and_nothing_goes_on(cell, plc, controller, group, at):
    motion = move(group)
    cell.link.before(at, partial(signal.raise_signal, signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        controller.stop()
    assert plc.opcodes() == [Opcode.MOVE_LINEAR, Opcode.STOP]
    with pytest.raises(StoppedError):
        motion.wait(timeout_s=5)
    controller.close()
    assert plc.opcodes() == [Opcode.MOVE_LINEAR, Opcode.STOP, Opcode.OWNERSHIP]
    assert plc.now.group_state == GroupState.STOPPING


def test_closing_after_a_stop_that_was_refused_stops_what_nobody_waited_on(
    cell, plc, controller, group
):
    move(group)
    for _ in range(40):
        cell.link.refuse("write_command")
    with pytest.raises(RejectedError):
        controller.stop()
    cell.link.forget_plans()
    assert plc.opcodes() == [Opcode.MOVE_LINEAR]
    controller.close()
    assert plc.opcodes() == [Opcode.MOVE_LINEAR, Opcode.STOP, Opcode.OWNERSHIP]


@pytest.mark.parametrize("pressed", ["as it is written", "later", "at its end"])
def test_what_waits_to_be_acknowledged_leaves_the_lock_to_a_stop(
    cell, plc, controller, group, pressed
):
    """Its block got lost; nobody knows, so behind it nothing but stops follows."""
    if pressed == "as it is written":
        cell.link.plan("write_command", lambda _deliver: controller.latch.close())
    else:
        cell.link.hold_up("write_command")
        at = 2 if pressed == "later" else 13
        cell.link.before("read_head", controller.latch.close, nth=at)
    begun_ns = plc.clock.now_ns()
    with pytest.raises(OutcomeUnknownError):
        move(group)
    if pressed != "at its end":
        assert plc.clock.now_ns() - begun_ns < 300 * MS
    assert len(cell.open_requests()) == 1
    controller.stop()
    assert plc.opcodes() == [Opcode.STOP]
    controller.release_stop()
    with pytest.raises(TransportTimeoutError, match="not acknowledged"):
        controller.release_hold()
    assert plc.opcodes() == [Opcode.STOP]


def test_a_stop_that_another_one_ended_is_told_when_the_axes_stand(cell, plc, controller):
    """Its block is done while the group still brakes for the other stop."""
    begun_ns, rests_ns = plc.clock.now_ns(), 400_000_000

    def braking(words):
        passed_ns = plc.clock.now_ns() - begun_ns
        if Opcode.STOP not in plc.opcodes() or passed_ns >= rests_ns:
            return words
        now = decode_response(words)
        axes = (now.axes[0] + 100.0 * (passed_ns - rests_ns) / 1e9, *now.axes[1:])
        return encode_response(replace(now, bits=now.bits | Bits.BUSY, axes=axes))

    cell.link.response = braking
    controller.stop()
    assert plc.clock.now_ns() - begun_ns >= rests_ns


def test_a_refused_movement_leaves_no_doubt(cell, plc, group):
    plc.refusals[Opcode.MOVE_LINEAR] = ErrorClass.UNREACHABLE
    with pytest.raises(RejectedError, match="cannot be reached"):
        move(group)
    assert cell.open_requests() == []
    plc.refusals.clear()
    assert move(group).wait(timeout_s=5) is MotionOutcome.ARRIVED


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        ((CommandState.ERROR, ErrorClass.AXIS), ControllerFaultError),
        ((CommandState.ABORTED, ErrorClass.AXIS), ControllerFaultError),
        ((CommandState.ERROR, ErrorClass.UNREACHABLE), RejectedError),
    ],
)
def test_a_movement_that_ends_badly_says_how(cell, plc, group, end, expected):
    motion = move(group)
    state, error = end
    sequence = plc.executed[-1].sequence
    plc.end_all()
    plc.now = replace(plc.now, finished=(Finished(sequence, state, error),) * 4, state=state)
    with pytest.raises(expected) as failure:
        motion.wait(timeout_s=5)
    assert failure.value.code == error
    assert cell.open_requests() == []


@pytest.mark.fault("F25")
@pytest.mark.parametrize("lose", ["lose_answer", "lose_request"])
def test_a_movement_without_an_answer_is_unknown_and_blocks_the_next(cell, plc, group, lose):
    getattr(cell.link, lose)("write_command")
    with pytest.raises(OutcomeUnknownError, match="may or may not"):
        move(group)
    later = cell.connect()
    with pytest.raises(OutcomeUnknownError, match="did not finish"):
        move(later.groups[0])
    plc.clock.sleep(1.0)  # a possible movement is not examined before the group has stopped
    (marker,) = cell.outcomes.open_markers()
    finding = later.resolver.examine(marker)
    assert finding.verdict is Verdict.LOOK
    later.resolver.settle(finding)
    assert cell.open_requests() == []
    assert len([code for code in plc.opcodes() if code == Opcode.MOVE_LINEAR]) <= 1


@pytest.mark.parametrize("nth", [1, 2, 3])
@pytest.mark.parametrize("method", ["read_head", "read_response", "beat"])
def test_a_link_that_dies_while_waiting_leaves_the_movement_unknown(
    cell, group, monkeypatch, method, nth
):
    monkeypatch.setattr(_plc, "MOVE_NS", 2_000 * MS)  # long enough for three whole looks
    motions = [move(group)]
    if method == "read_head":  # the end of one behind another is not foreseen
        motions.append(move(group))
    cell.link.lose_answer(method, nth=nth)
    with pytest.raises(OutcomeUnknownError):
        motions[-1].wait(timeout_s=5)
    assert len(cell.open_requests()) == len(motions)


def test_a_heartbeat_that_freezes_while_waiting_is_found_out(cell, plc, group):
    motion = move(group)

    def freeze():
        plc.frozen = True
        plc.clock.sleep(0)

    plc.advance = lambda: None
    cell.link.before("beat", freeze, nth=2)
    with pytest.raises(OutcomeUnknownError, match="has stopped"):
        motion.wait(timeout_s=60)
    assert len(cell.open_requests()) == 1


def test_a_restart_while_moving_leaves_the_movement_unknown(cell, plc, group):
    motion = move(group)
    plc.restart()
    with pytest.raises(OutcomeUnknownError, match="restarted"):
        motion.wait(timeout_s=5)
    assert len(cell.open_requests()) == 1


def test_a_movement_that_the_plc_no_longer_shows_is_unknown(cell, plc, group):
    motion = move(group)
    plc.end_all()
    plc.now = replace(
        plc.now, finished=(Finished(),) * 4, ack_head=9, ack_owner=5, state=CommandState.DONE
    )
    with pytest.raises(OutcomeUnknownError, match="shows neither"):
        motion.wait(timeout_s=5)


def test_closing_halts_what_nobody_waited_on_and_gives_the_mailbox_back(cell, plc, controller):
    move(controller.groups[0])
    controller.close()
    assert plc.opcodes() == [Opcode.MOVE_LINEAR, Opcode.HALT, Opcode.OWNERSHIP]
    assert cell.open_requests() == []


@pytest.mark.fault("F24")
def test_an_interrupt_of_the_person_halts_the_movement(cell, plc, group):
    motion = move(group)

    def ctrl_c():
        raise KeyboardInterrupt

    cell.link.before("beat", ctrl_c, nth=2)
    with pytest.raises(KeyboardInterrupt):
        motion.wait(timeout_s=5)
    assert plc.opcodes()[-1] == Opcode.HALT
    assert cell.open_requests() == []


def test_interrupting_and_resuming_reach_the_plc(plc, group):
    group.interrupt()
    group.resume()
    group.halt()
    assert plc.opcodes() == [Opcode.INTERRUPT, Opcode.CONTINUE, Opcode.HALT]


def test_a_touch_gives_the_position_latched_at_the_edge(cell, plc, group):
    plc.edge = (410.0, 90.0, 271.25, 45.0, 0.0, 0.0)
    motion = group.move_until_input(TARGET, InputEdge(3, falling=True), speed_mm_s=2, box=ANYWHERE)
    latched = motion.wait(timeout_s=5)
    assert latched is not None
    assert latched.z_mm == pytest.approx(271.25)
    assert latched.tool == 0
    assert plc.executed[-1].operands == (-3, 0, CoordinateSystem.MCS, BufferMode.BUFFERED)
    assert cell.open_requests() == []


def test_a_touch_without_an_edge_gives_nothing(cell, plc, group):
    motion = group.move_until_input(TARGET, InputEdge(4), speed_mm_s=2, box=ANYWHERE)
    assert motion.wait(timeout_s=5) is None
    assert cell.open_requests() == []


def test_a_touch_that_is_stopped_is_no_measurement(cell, plc, group):
    motion = group.move_until_input(TARGET, InputEdge(4), speed_mm_s=2, box=ANYWHERE)
    cell.link.before("read_head", plc.end_all)
    with pytest.raises(StoppedError, match="stopped before the input"):
        motion.wait(timeout_s=5)


def test_a_touch_is_not_begun_when_its_input_has_switched_before(cell, plc, group):
    with pytest.raises(NotReadyError, match="Input 3 is on") as refusal:
        group.move_until_input(TARGET, InputEdge(3), speed_mm_s=2, box=ANYWHERE)
    assert refusal.value.reason is NotReadyReason.EDGE_PASSED
    assert Opcode.MOVE_UNTIL_INPUT not in plc.opcodes()
    assert cell.open_requests() == []


def test_an_input_number_below_one_is_refused(cell, group):
    with pytest.raises(ConfigError, match="no input 0"):
        group.move_until_input(TARGET, InputEdge(0), speed_mm_s=2, box=ANYWHERE)
    assert cell.link.sent == []


def test_a_jog_goes_for_a_time_and_is_ended(cell, plc, group):
    jog = Jog(forward=frozenset({0}), backward=frozenset({2}), speed_mm_s=3.0)
    began_ns = plc.clock.now_ns()
    pose = group.jog(jog, duration_s=2.0, box=ANYWHERE)
    assert 2.0 <= (plc.clock.now_ns() - began_ns) / 1e9 < 2.5
    start, end = plc.executed
    assert (start.operands, end.operands[:2]) == ((0b001, 0b100, CoordinateSystem.MCS, 0), (0, 0))
    assert start.dynamics[0] == 3.0
    assert pose.x_mm == pytest.approx(400.0)
    assert cell.open_requests() == []
    assert len(cell.link.beats) >= 15


def test_a_jog_that_leaves_the_box_is_ended(cell, plc, group):
    box = WorkBox(x_max_mm=399.0)
    with pytest.raises(LimitError):
        group.jog(Jog(forward=frozenset({0})), duration_s=5.0, box=box)
    assert plc.executed[-1].operands[:2] == (0, 0)
    assert cell.open_requests() == []


def test_a_jog_that_an_interrupt_ends_is_ended_on_the_plc_too(cell, plc, group):
    def ctrl_c():
        raise KeyboardInterrupt

    cell.link.before("read_head", ctrl_c, nth=3)
    with pytest.raises(KeyboardInterrupt):
        group.jog(Jog(forward=frozenset({0})), duration_s=5.0, box=ANYWHERE)
    assert plc.executed[-1].operands[:2] == (0, 0)
    assert cell.open_requests() == []


def test_ctrl_c_while_the_marker_of_a_jog_is_stored_leaves_none_and_nothing_begins(
    cell, plc, group, monkeypatch
):
    begin, executed = cell.outcomes.begin, len(plc.executed)

    def interrupted(marker):
        begin(marker)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(cell.outcomes, "begin", interrupted)
    with pytest.raises(KeyboardInterrupt):
        group.jog(Jog(forward=frozenset({0})), duration_s=5.0, box=ANYWHERE)
    assert not [done for done in plc.executed[executed:] if done.opcode == Opcode.JOG]
    assert cell.open_requests() == []


@pytest.mark.parametrize(
    "jog",
    [
        Jog(),
        Jog(forward=frozenset({6})),
        Jog(forward=frozenset({1}), backward=frozenset({1})),
        Jog(forward=frozenset({1, 4})),
    ],
)
def test_an_impossible_jog_is_refused_unsent(cell, group, jog):
    with pytest.raises(ConfigError):
        group.jog(jog, duration_s=1.0, box=ANYWHERE)
    assert cell.link.sent == []


def test_turns_and_machine_axes_are_jogged_by_factors(plc, group):
    turn = Jog(forward=frozenset({3}), speed_percent=2)
    axis = Jog(forward=frozenset({0}), system=CoordinateSystem.ACS, speed_percent=4)
    group.jog(turn, duration_s=0.1, box=ANYWHERE)
    group.jog(axis, duration_s=0.1, box=ANYWHERE)
    assert [plc.executed[n].dynamics for n in (0, 2)] == [(0.02,) * 4, (0.04,) * 4]


def test_a_preview_of_a_movement_names_what_would_be_sent(cell, group):
    (text,) = group.requests_for(TARGET, STRAIGHT)
    assert text == "2103 MOVE_LINEAR 0 0 1 1 (410 90 250 45 0 0)"
    assert cell.link.sent == []


def test_the_axes_and_the_terms_of_moving_are_told(cell, plc, group):
    plc.now = replace(plc.now, axes=(1.0, 2.0, 3.0, 4.0, 0.0, 0.0))
    assert group.axes() == {"axes": (1.0, 2.0, 3.0, 4.0)}
    assert cell.link.identity in group.terms().who
