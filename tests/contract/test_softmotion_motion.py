"""Movements of an axis group on every link: at most once, watched, stoppable, in limits."""

import threading
from dataclasses import replace

import pytest
from robolink_simulators.softmotion import GroupOptions
from robolink_simulators.softmotion.mailbox import PlcOptions, SoftMotionSimulator

from robolink.controllers import Jog
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.errors import (
    BusyError,
    ControllerFaultError,
    LimitError,
    MotionTimeoutError,
    NotReadyError,
    NotReadyReason,
    RejectedError,
    StoppedError,
)
from robolink.model import MotionOutcome, MotionProfile, Path, WorkBox
from robolink.protocols.mailbox import CoordinateSystem, ErrorClass
from tests.contract._softmotion_cell import (
    LINKS,
    QUICK,
    SLOW,
    above,
    few_links,
    on_links,
    served,
)

ANYWHERE = WorkBox()


@pytest.fixture(params=few_links())
def cell(request):
    with served(request.param) as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connect() as controller:
        yield controller


@pytest.fixture
def group(controller):
    return controller.groups[0]


@pytest.mark.parametrize("cell", LINKS, indirect=True)
def test_a_straight_move_arrives_and_the_next_may_begin_at_once(cell, group):
    start = group.pose()
    for by_mm in (2.0, 0.0):
        motion = group.move_to(above(start, by_mm), QUICK, box=ANYWHERE)
        assert motion.wait(timeout_s=10) is MotionOutcome.ARRIVED
        assert group.pose().z_mm == pytest.approx(start.z_mm + by_mm, abs=1e-6)
    assert cell.movements_started == 2
    assert cell.open_requests == []


def test_a_joint_move_turns_the_tool(group):
    target = replace(group.pose(), u_deg=group.pose().u_deg + 5.0)
    motion = group.move_to(target, MotionProfile(Path.JOINT, speed_percent=100), box=ANYWHERE)
    assert motion.wait(timeout_s=10) is MotionOutcome.ARRIVED
    assert group.pose().u_deg == pytest.approx(target.u_deg, abs=1e-6)


@pytest.mark.parametrize("cell", few_links("modbus-tcp"), indirect=True)
def test_four_movements_may_be_under_way_and_a_fifth_has_to_wait(cell, group):
    start = group.pose()
    ways = [above(start, by_mm) for by_mm in (2.0, 3.0, 1.0, 0.0)]
    # The first takes long enough for a busy computer to send the others meanwhile.
    motions = [group.move_to(ways[0], SLOW, box=ANYWHERE)]
    motions += [group.move_to(way, QUICK, box=ANYWHERE) for way in ways[1:]]
    with pytest.raises(BusyError, match="four movements"):
        group.move_to(start, QUICK, box=ANYWHERE)
    assert [motion.wait(timeout_s=10) for motion in motions] == [MotionOutcome.ARRIVED] * 4
    assert cell.movements_started == 4
    group.move_to(above(start, 1.0), QUICK, box=ANYWHERE).wait(timeout_s=10)


def test_a_target_outside_the_box_is_refused_before_anything_is_sent(controller, group):
    box = WorkBox.around(group.pose(), xy_mm=10, below_mm=10, above_mm=10)
    sent = controller.exchanges
    with pytest.raises(LimitError, match=r"Z .* allowed area"):
        group.move_to(above(group.pose(), 20.0), QUICK, box=box)
    assert controller.exchanges - sent == 1  # the pose


def test_a_target_for_another_tool_is_refused(cell, group):
    with pytest.raises(NotReadyError, match="tool 9, but tool 1") as refusal:
        group.move_to(replace(group.pose(), tool=9), QUICK, box=ANYWHERE)
    assert refusal.value.reason is NotReadyReason.WRONG_TOOL
    assert "Nothing moved" in refusal.value.remedy
    assert cell.movements_started == 0


def test_a_target_out_of_reach_is_refused_by_the_plc_and_leaves_no_doubt(cell, group):
    with pytest.raises(RejectedError) as refusal:
        motion = group.move_to(above(group.pose(), 5000.0), QUICK, box=ANYWHERE)
        motion.wait(timeout_s=10)
    assert refusal.value.code // 100 == 4
    assert cell.open_requests == []


def test_a_disabled_group_is_not_moved(cell, controller, group):
    controller.motors(False)
    with pytest.raises(NotReadyError, match="disabled") as refusal:
        group.move_to(group.pose(), QUICK, box=ANYWHERE)
    assert refusal.value.reason is NotReadyReason.MOTORS_OFF
    assert cell.movements_started == 0


@pytest.mark.parametrize("cell", few_links("modbus-tcp", "can-multicast", "opcua"), indirect=True)
def test_a_stop_from_another_thread_gets_in_holds_and_is_released_by_a_reset(
    cell, controller, group, monkeypatch
):
    target = above(group.pose(), 20.0)
    motion = group.move_to(target, SLOW, box=ANYWHERE)
    got_in: list[bool] = []
    pause = MailboxWire.pause

    def stop_meanwhile(wire, seconds):
        if not got_in:
            got_in.append(False)
            stopper = threading.Thread(target=controller.stop)
            stopper.start()
            stopper.join(timeout=10)
            got_in[:] = [not stopper.is_alive()]
        pause(wire, seconds)

    monkeypatch.setattr(MailboxWire, "pause", stop_meanwhile)
    with pytest.raises(StoppedError):
        motion.wait(timeout_s=20)
    assert got_in == [True]
    with pytest.raises(StoppedError, match="ended by a stop"):
        group.move_to(target, QUICK, box=ANYWHERE)
    controller.release_stop()
    with pytest.raises(NotReadyError, match="held by a stop"):
        group.move_to(target, QUICK, box=ANYWHERE)
    controller.reset_fault()
    near = above(group.pose(), 1.0)
    assert group.move_to(near, QUICK, box=ANYWHERE).wait(timeout_s=10) is MotionOutcome.ARRIVED
    assert cell.movements_started == 2
    assert cell.open_requests == []


@pytest.mark.parametrize("cell", few_links("opcua"), indirect=True)
def test_a_halted_movement_ends_where_it_is_and_the_group_moves_again(cell, group):
    start = group.pose()
    motion = group.move_to(above(start, 20.0), SLOW, box=ANYWHERE)
    group.halt()
    assert motion.wait(timeout_s=10) is MotionOutcome.STOPPED
    assert group.pose().z_mm < start.z_mm + 10.0
    assert group.move_to(start, QUICK, box=ANYWHERE).wait(timeout_s=10) is MotionOutcome.ARRIVED
    assert cell.open_requests == []


def test_a_move_that_takes_too_long_is_halted_and_its_end_is_seen(cell, group):
    motion = group.move_to(above(group.pose(), 20.0), SLOW, box=ANYWHERE)
    with pytest.raises(MotionTimeoutError, match="robolink stopped it"):
        motion.wait(timeout_s=0.05)
    assert cell.movements_started == 1
    assert cell.open_requests == []


@pytest.mark.fault("F21")
@pytest.mark.parametrize(
    ("danger", "cell"),
    [
        *on_links("press_estop", few_links("opcua")),
        *on_links("fail_axis", few_links("modbus-tcp")),
    ],
    indirect=["cell"],
)
def test_an_emergency_stop_or_a_failing_drive_ends_the_move_and_nothing_is_sent_again(
    cell, controller, group, danger
):
    target = above(group.pose(), 20.0)
    motion = group.move_to(target, SLOW, box=ANYWHERE)
    getattr(cell.simulator.panel, danger)()
    with pytest.raises(ControllerFaultError, match="Nothing was repeated"):
        motion.wait(timeout_s=20)
    assert controller.status().fault
    with pytest.raises(NotReadyError) as refusal:
        group.move_to(target, QUICK, box=ANYWHERE)
    assert refusal.value.reason is NotReadyReason.FAULT
    assert cell.movements_started == 1
    assert cell.open_requests == []
    cell.simulator.panel.release_estop()
    controller.reset_fault()
    near = above(group.pose(), 1.0)
    assert group.move_to(near, QUICK, box=ANYWHERE).wait(timeout_s=10) is MotionOutcome.ARRIVED


@pytest.mark.parametrize("cell", few_links("modbus-tcp", "can-multicast", "opcua"), indirect=True)
def test_a_jog_goes_for_a_time_and_the_group_is_at_rest_afterwards(cell, controller, group):
    start = group.pose()
    jog = Jog(forward=frozenset({2}), speed_mm_s=10.0)
    end = group.jog(jog, duration_s=0.3, box=ANYWHERE)
    assert 0.2 < end.z_mm - start.z_mm < 6.0
    assert not controller.status().running
    assert cell.movements_started == 1
    assert cell.open_requests == []


def test_a_jog_ends_where_the_box_ends(cell, group):
    box = WorkBox.around(group.pose(), xy_mm=10, below_mm=10, above_mm=0.2)
    with pytest.raises(LimitError):
        group.jog(Jog(forward=frozenset({2}), speed_mm_s=20.0), duration_s=5.0, box=box)
    assert cell.open_requests == []


def test_a_jog_of_an_axis_goes_by_a_share_of_its_own_speed(group):
    before = group.axes()["axes"]
    jog = Jog(backward=frozenset({0}), system=CoordinateSystem.ACS, speed_percent=20)
    group.jog(jog, duration_s=0.1, box=ANYWHERE)
    after = group.axes()["axes"]
    assert after[0] < before[0]
    assert after[1:] == pytest.approx(before[1:])


@pytest.mark.parametrize("cell", few_links("opcua"), indirect=True)
def test_a_movement_on_which_nobody_waits_is_halted_on_purpose(cell, group):
    motion = group.move_to(above(group.pose(), 20.0), SLOW, box=ANYWHERE)
    cell.clock.advance(0.6)
    with pytest.raises(
        ControllerFaultError, match="Nobody waited, or PC or network was too slow"
    ) as end:
        motion.wait(timeout_s=10)
    assert end.value.code == ErrorClass.HEARTBEAT_LOST
    assert cell.movements_started == 1
    assert cell.open_requests == []


def test_a_program_that_another_task_calls_is_told_what_to_change():
    """ErrorID 12108 has no class on the PLC, but its meaning is known."""
    options = PlcOptions(GroupOptions(program_task="other"))
    with served("sim", SoftMotionSimulator(options=options)) as cell, cell.connect() as controller:
        group = controller.groups[0]
        with pytest.raises(RejectedError, match="ErrorID 12108") as refused:
            group.move_to(above(group.pose(), 1.0), QUICK, box=ANYWHERE).wait(timeout_s=5)
        assert refused.value.code == ErrorClass.UNMAPPED
        assert "motion task" in refused.value.remedy
