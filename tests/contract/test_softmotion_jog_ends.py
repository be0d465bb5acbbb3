"""A jog on a simulated PLC always ends with the robot stopped, whatever happens meanwhile."""

import math
import threading

import pytest
from robolink_simulators.faults import PlcFault, PlcFaultAction

from robolink.controllers import Jog
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.errors import (
    ControllerFaultError,
    LeaseLostError,
    LimitError,
    RejectedError,
    StoppedError,
)
from robolink.model import InputEdge, MotionProfile, Path, WorkBox
from robolink.protocols.mailbox import ErrorClass
from tests.contract._softmotion_cell import SLOW, above, served

ANYWHERE = WorkBox()
BOTH = pytest.mark.parametrize("cell", ["sim", "modbus-tcp"], indirect=True)
BACK_ALONG_X = Jog(backward=frozenset({0}), speed_mm_s=10.0)


@pytest.fixture(params=["sim", pytest.param("modbus-tcp", marks=pytest.mark.soak)])
def cell(request):
    with served(request.param) as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connect() as controller:
        yield controller


def box_around(pose, half_mm):
    return WorkBox.around(pose, xy_mm=half_mm, below_mm=half_mm, above_mm=half_mm)


def distance_mm(controller, since):
    """Return the distance of the tip from an earlier place."""
    here = controller.groups[0].pose().coordinates()
    return math.dist(here[:3], since.coordinates()[:3])


def look_for(cell, controller, seconds):
    """Poll the state for this long."""
    for _ in range(round(seconds / 0.1)):
        controller.status()
        cell.clock.advance(0.1)


@BOTH
def test_a_permit_that_is_withdrawn_ends_the_jog_and_no_status_moves_it_on(cell, controller):
    group, simulator = controller.groups[0], cell.simulator
    start = group.pose()
    simulator.faults.add(
        PlcFault(PlcFaultAction.WITHDRAW_PERMIT, match="write_command JOG", seconds=0.4)
    )
    with pytest.raises(RejectedError, match="does not permit") as refusal:
        group.jog(BACK_ALONG_X, duration_s=2.0, box=box_around(start, 30.0))
    assert refusal.value.code == ErrorClass.NOT_PERMITTED
    moved_mm = distance_mm(controller, start)
    assert 2.0 < moved_mm < 6.0
    look_for(cell, controller, 5.0)
    assert distance_mm(controller, start) == pytest.approx(moved_mm, abs=0.01)
    assert not controller.status().running
    assert cell.open_requests == []


def taken_over(cell, controller, command):
    """Let a second program take over the mailbox shortly after a command was written."""
    cell.simulator.faults.add(
        PlcFault(PlcFaultAction.TAKE_OWNERSHIP, match=f"write_command {command}", seconds=0.4)
    )


@BOTH
def test_a_jog_that_another_program_takes_over_ends_at_once(cell, controller):
    group = controller.groups[0]
    start = group.pose()
    taken_over(cell, controller, "JOG")
    with pytest.raises(RejectedError, match="another program has taken it over") as refusal:
        group.jog(BACK_ALONG_X, duration_s=5.0, box=box_around(start, 60.0))
    assert refusal.value.code == ErrorClass.NOT_OWNER
    assert 1.0 < distance_mm(controller, start) < 6.0
    assert not controller.status().running
    assert cell.open_requests == []
    with pytest.raises(LeaseLostError):
        group.jog(BACK_ALONG_X, duration_s=1.0, box=ANYWHERE)
    assert cell.commands == ["JOG"]


@pytest.mark.parametrize("kind", ["LINEAR", "DIRECT", "UNTIL_INPUT"])
def test_a_movement_that_another_program_takes_over_is_said_to_be(cell, controller, kind):
    group = controller.groups[0]
    start = group.pose()
    taken_over(cell, controller, f"MOVE_{kind}")
    with pytest.raises(RejectedError, match="another program has taken it over") as refusal:
        if kind == "UNTIL_INPUT":
            edge = InputEdge(3)
            motion = group.move_until_input(above(start, 20.0), edge, speed_mm_s=2.0, box=ANYWHERE)
            motion.wait(timeout_s=30)
        else:
            profile = SLOW if kind == "LINEAR" else MotionProfile(Path.JOINT, speed_percent=1)
            group.move_to(above(start, 20.0), profile, box=ANYWHERE).wait(timeout_s=30)
    assert refusal.value.code == ErrorClass.NOT_OWNER
    assert distance_mm(controller, start) < 15.0
    assert cell.open_requests == []
    with pytest.raises(LeaseLostError):
        group.move_to(start, SLOW, box=ANYWHERE)


@BOTH
def test_a_stop_from_another_thread_ends_the_jog_and_is_no_success(cell, controller, monkeypatch):
    group = controller.groups[0]
    start = group.pose()
    read_head, heads = MailboxWire.read_head, []

    def stop_meanwhile(wire):
        heads.append(threading.current_thread())
        if len(heads) == 20:
            stopper = threading.Thread(target=controller.stop)
            stopper.start()
            stopper.join(timeout=10)
        return read_head(wire)

    monkeypatch.setattr(MailboxWire, "read_head", stop_meanwhile)
    with pytest.raises(StoppedError):
        group.jog(BACK_ALONG_X, duration_s=20.0, box=ANYWHERE)
    assert distance_mm(controller, start) < 20.0
    assert controller.status().paused
    assert cell.commands == ["JOG", "STOP"]
    assert cell.open_requests == []


def test_a_jog_that_leaves_the_box_while_the_permit_goes_stands_still(cell, controller):
    group = controller.groups[0]
    start = group.pose()
    cell.simulator.faults.add(PlcFault(PlcFaultAction.WITHDRAW_PERMIT, match="JOG", on_exchange=1))
    box = box_around(start, 1.0)
    with pytest.raises(LimitError):
        group.jog(BACK_ALONG_X, duration_s=20.0, box=box)
    moved_mm = distance_mm(controller, start)
    look_for(cell, controller, 5.0)
    assert distance_mm(controller, start) == pytest.approx(moved_mm, abs=0.01)
    assert cell.open_requests == []


def test_looking_from_the_thread_that_began_a_movement_does_not_keep_it_going(cell, controller):
    group = controller.groups[0]
    start = group.pose()
    motion = group.move_to(above(start, 20.0), SLOW, box=ANYWHERE)
    for _ in range(20):
        controller.status()
        controller.tools.read(1)
        cell.clock.advance(0.1)
    assert distance_mm(controller, start) < 2.0
    with pytest.raises(ControllerFaultError, match="heartbeat was missing"):
        motion.wait(timeout_s=10)
    assert cell.open_requests == []


def test_a_client_that_closes_leaves_nothing_moving(cell):
    with cell.connect() as controller:
        start = controller.groups[0].pose()
        controller.groups[0].move_to(above(start, 20.0), SLOW, box=ANYWHERE)
    with cell.connect() as later:
        assert not later.status().running
        assert distance_mm(later, start) < 2.0
    assert cell.commands[-1] == "HALT"
