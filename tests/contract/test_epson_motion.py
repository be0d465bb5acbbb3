"""Movements are sent at most once, watched, stoppable and limited; settings are restored after."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from robolink import ToolOffset
from robolink.controllers.epson.session import EpsonSession, execution
from robolink.errors import (
    BusyError,
    ControllerFaultError,
    LimitError,
    LocalProtocolError,
    MotionTimeoutError,
    NotReadyError,
    StoppedError,
)
from robolink.model import MotionOutcome, MotionProfile, Path, WorkBox
from robolink.protocols.spel import Statement

pytestmark = pytest.mark.moves

STRAIGHT = MotionProfile(Path.STRAIGHT, 5, 20.0)
EVERYWHERE = WorkBox()


@pytest.fixture
def controller(cell):
    with cell.connect() as controller:
        controller.motors(True)
        yield controller


def start(controller, dx_mm=0.0, dz_mm=5.0, **pose):
    group = controller.groups[0]
    here = group.pose()
    target = replace(here, x_mm=here.x_mm + dx_mm, z_mm=here.z_mm + dz_mm, **pose)
    return group, target


@pytest.mark.on_every_link
def test_a_straight_move_arrives(controller):
    group, target = start(controller)
    motion = group.move_to(target, STRAIGHT, box=EVERYWHERE)
    assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED
    assert group.pose().z_mm == pytest.approx(target.z_mm, abs=0.05)
    assert controller.outcomes.open_markers() == ()


def test_a_statement_that_cannot_be_sent_leaves_nothing_to_wait_for(controller):
    session = controller._link.session
    with pytest.raises(LocalProtocolError):
        session.start_execute(Statement("Wait 1\r\nWait 2"))
    assert session.pending is None
    group, target = start(controller)
    motion = group.move_to(target, STRAIGHT, box=EVERYWHERE)
    assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED


def test_a_statement_that_may_have_left_is_known_to_a_stop(controller, monkeypatch):
    session, transport = controller._link.session, controller._link.session._transport

    def cut_short(*_arguments, **_options):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(type(transport), "send", cut_short)
        with pytest.raises(KeyboardInterrupt):
            session.start_execute(Statement("Wait 1"))
    assert session.pending is not None
    with pytest.raises(BusyError):
        session.ask(execution(Statement("Wait 1")))


def test_no_movement_begins_within_the_procedure_of_another_thread(controller):
    group, target = start(controller)
    with controller.procedure("a change"), ThreadPoolExecutor(1) as other:
        late = other.submit(group.move_to, target, STRAIGHT, box=EVERYWHERE)
        with pytest.raises(BusyError, match="must wait"):
            late.result(10)
    assert group.pose().z_mm == pytest.approx(target.z_mm - 5.0, abs=0.005)


def test_a_joint_move_turns_the_tool(controller):
    group, target = start(controller)
    target = replace(target, u_deg=target.u_deg + 30)
    motion = group.move_to(target, MotionProfile(), box=EVERYWHERE)
    assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED
    assert group.pose().u_deg == pytest.approx(target.u_deg, abs=0.05)


def test_power_is_low_and_the_speed_is_set_before_a_move(cell):
    with cell.connect() as controller:
        controller.motors(True)
        cell.simulator.machine.power_high = True
        group, target = start(controller)
        group.move_to(target, STRAIGHT, box=EVERYWHERE).wait(timeout_s=60)
        in_force = group.settings.read()
    assert not in_force.power_high
    assert in_force.speed_s_mm_s[0] == 20.0


def test_a_target_outside_the_box_is_refused_before_anything_is_sent(controller):
    group, target = start(controller, dx_mm=50)
    box = WorkBox.around(group.pose(), xy_mm=10, below_mm=10, above_mm=10)
    sent = controller.exchanges
    with pytest.raises(LimitError, match=r"X .* allowed area"):
        group.move_to(target, STRAIGHT, box=box)
    assert controller.exchanges == sent


def test_a_target_for_another_tool_is_refused(controller):
    group, target = start(controller)
    with pytest.raises(NotReadyError) as caught:
        group.move_to(replace(target, tool=9), STRAIGHT, box=EVERYWHERE)
    assert caught.value.reason == "wrong_tool"


@pytest.mark.fault("F23")
def test_a_remote_timeout_of_never_forbids_motion(cell):
    with cell.connect(remote_timeout_s=0) as controller:
        controller.motors(True)
        group, target = start(controller)
        with pytest.raises(NotReadyError) as caught:
            group.move_to(target, STRAIGHT, box=EVERYWHERE)
    assert caught.value.reason == "no_remote_timeout"


def test_motors_off_are_named_and_nothing_moves(cell):
    with cell.connect() as controller:
        controller.motors(False)
        group, target = start(controller)
        moved = cell.simulator.machine.arm.moves_started
        with pytest.raises(NotReadyError) as caught:
            group.move_to(target, STRAIGHT, box=EVERYWHERE)
        assert caught.value.reason == "motors_off"
        assert cell.simulator.machine.arm.moves_started == moved
        controller.motors(True)


@pytest.mark.on_every_link
def test_a_stop_from_another_thread_gets_in_while_one_waits(controller, monkeypatch):
    group, target = start(controller, dz_mm=30)
    motion = group.move_to(target, MotionProfile(Path.STRAIGHT, 1, 1.0), box=EVERYWHERE)
    await_pending = EpsonSession.await_pending
    got_in: list[bool] = []

    def stop_meanwhile(session, *, wait_s):
        if threading.current_thread() is threading.main_thread() and not got_in:
            stopper = threading.Thread(target=controller.stop)
            stopper.start()
            stopper.join(timeout=10)
            got_in.append(not stopper.is_alive())
        await_pending(session, wait_s=wait_s)

    monkeypatch.setattr(EpsonSession, "await_pending", stop_meanwhile)
    with pytest.raises(StoppedError):
        motion.wait(timeout_s=60)
    assert got_in == [True]
    assert group.pose().z_mm < target.z_mm - 1
    assert controller.outcomes.open_markers() == ()


def test_a_move_that_takes_too_long_is_aborted_and_its_end_is_seen(controller):
    group, target = start(controller, dz_mm=30)
    motion = group.move_to(target, MotionProfile(Path.STRAIGHT, 1, 1.0), box=EVERYWHERE)
    with pytest.raises(MotionTimeoutError, match="robolink aborted it"):
        motion.wait(timeout_s=0.05)
    assert controller.outcomes.open_markers() == ()
    assert group.pose().z_mm < target.z_mm - 1


@pytest.mark.fault("F21", "F22")
@pytest.mark.parametrize("danger", ["press_estop", "open_guard"])
def test_an_emergency_stop_or_an_open_guard_ends_the_move_and_nothing_is_resent(cell, danger):
    with cell.connect() as controller:
        controller.motors(True)
        group, target = start(controller, dz_mm=30)
        moved = cell.simulator.machine.arm.moves_started
        motion = group.move_to(target, MotionProfile(Path.STRAIGHT, 1, 5.0), box=EVERYWHERE)
        controller.status()  # by now the movement has started
        getattr(cell.simulator.panel, danger)()
        with pytest.raises(ControllerFaultError):
            motion.wait(timeout_s=60)
        assert cell.simulator.machine.arm.moves_started == moved + 1
        assert controller.outcomes.open_markers() == ()
        with pytest.raises(NotReadyError):
            group.move_to(target, STRAIGHT, box=EVERYWHERE)


def test_after_release_and_reset_the_robot_can_move_again(cell):
    with cell.connect() as controller:
        cell.simulator.panel.press_estop()
        assert controller.status().emergency_stop
        with pytest.raises(ControllerFaultError, match="Release the button"):
            controller.reset_fault()
        cell.simulator.panel.release_estop()
        controller.reset_fault()
        controller.motors(True)
        group, target = start(controller)
        motion = group.move_to(target, STRAIGHT, box=EVERYWHERE)
        assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED


def test_the_tool_power_and_speed_of_before_are_put_back(controller):
    group = controller.groups[0]
    selected, in_force = controller.tools.selected(), group.settings.read()
    with controller.preserved("a test"):
        controller.tools.select(0)
        group.settings.slow_down(MotionProfile(Path.JOINT, 3, 7.0))
        (marker,) = controller.outcomes.open_markers()
        assert (marker.details["tool"], marker.details["now"]) == (selected, 0)
    assert controller.tools.selected() == selected
    assert group.settings.read() == in_force
    assert controller.outcomes.open_markers() == ()


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_they_are_put_back_when_the_procedure_dies(controller, error):
    selected = controller.tools.selected()
    with pytest.raises(error), controller.preserved("a test"):
        controller.tools.select(0)
        raise error
    assert controller.tools.selected() == selected
    assert controller.outcomes.open_markers() == ()


def test_what_cannot_be_put_back_is_named_by_the_message_and_the_marker(cell):
    with cell.connect() as controller:
        controller.motors(True)
        group, _ = start(controller)
        selected = controller.tools.selected()
        with pytest.raises(ControllerFaultError, match=f"select the previous tool {selected}"):
            with controller.preserved("a test"):
                controller.tools.select(0)
                pose = group.pose()
                lift = replace(pose, z_mm=pose.z_mm + 20)
                motion = group.move_to(lift, MotionProfile(Path.STRAIGHT, 1, 5), box=EVERYWHERE)
                controller.status()
                cell.simulator.panel.press_estop()
                motion.wait(timeout_s=60)
        (marker,) = controller.outcomes.open_markers()
        assert marker.details["tool"] == selected
        assert marker.details["now"] == 0


def test_a_tool_written_while_it_is_selected_moves_nothing(cell):
    with cell.connect() as controller:
        moved = cell.simulator.machine.arm.moves_started
        tool = controller.tools.selected()
        before = controller.tools.read(tool)
        controller.tools.write(tool, ToolOffset(13, -3, -20), expected=before)
        assert cell.simulator.machine.arm.moves_started == moved
