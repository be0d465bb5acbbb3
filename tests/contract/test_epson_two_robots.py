"""Two robots on one controller, a SCARA and a six-axis arm, each with its tools and points."""

from dataclasses import replace

import pytest
from robolink_simulators.epson import EpsonSimulator

import robolink
from robolink.controllers import EpsonController
from robolink.errors import NotReadyError, OutcomeUnknownError
from robolink.model import (
    ANY,
    Marker,
    MarkerKind,
    MotionProfile,
    Path,
    ToolOffset,
    Verdict,
    WorkBox,
    plain_offset,
)
from robolink.timing import wall_label
from robolink.transaction import Wanted, change_tools, plan_undo, recover, undo
from tests.contract._method_cell import method_cell

pytestmark = pytest.mark.simulator_only

BOTH = "GX4-C351S,C8-C901SR"


@pytest.fixture
def cell(serve_simulator):
    simulator = EpsonSimulator(BOTH, seed=5)
    serve_simulator(simulator)
    return simulator


def test_what_belongs_to_a_robot_is_that_of_the_robot_in_force(cell):
    scara, six = cell.machine.robots
    with robolink.connect(cell.url) as controller:
        assert isinstance(controller, EpsonController)
        assert controller.robot_number() == 1
        assert controller.facts().robot_models == ("GX4-C351S", "C8-C901SR")
        controller.tools.write(4, ToolOffset(1.0, 2.0, -30.0, 10.0), expected=None)
        stood = six.arm.joints
        here = controller.groups[0].pose()
        up = replace(here, z_mm=here.z_mm + 3)
        profile = MotionProfile(Path.STRAIGHT, speed_mm_s=250.0)
        controller.groups[0].move_to(up, profile, box=WorkBox()).wait(timeout_s=60)
        assert six.arm.joints == stood
        assert scara.arm.moves_started == 1
    assert (scara.tools.get(4), six.tools.get(4)) == (ToolOffset(1.0, 2.0, -30.0, 10.0), None)
    cell.machine.choose(2)
    with robolink.connect(cell.url) as controller:
        offset = ToolOffset(1.0, 2.0, 130.0, 10.0, 20.0, 30.0)
        controller.tools.write(4, offset, expected=None)
        assert controller.tools.read(4) == offset
        assert len(controller.groups[0].axes()["joints"]) == 6
    assert scara.tools.get(4).components()[3:] == (10.0, 0.0, 0.0)


def test_the_motions_of_all_robots_are_told_in_order(cell):
    def up(number):
        cell.machine.choose(number)
        with robolink.connect(cell.url) as controller:
            here = controller.groups[0].pose()
            profile = MotionProfile(Path.STRAIGHT, speed_mm_s=250.0)
            above = replace(here, z_mm=here.z_mm + 3)
            controller.groups[0].move_to(above, profile, box=WorkBox()).wait(timeout_s=60)

    for number in (1, 2, 1):
        up(number)
    told = list(cell.motions())
    assert [(it.number, it.robot) for it in told] == [(1, 1), (2, 2), (3, 1)]
    first_mm, _, last_mm = (it.flange_mm[2] for it in told)
    assert last_mm - first_mm == pytest.approx(3, abs=0.01)
    assert [it.number for it in cell.motions(2)] == [3]
    assert cell.counters()["moves_started"] == 3


def test_each_robot_is_undone_by_its_own_record(cell):
    """Tool 4 of robot 1 and tool 4 of robot 2 are two tools."""
    robots = cell.machine.robots
    old, new = ToolOffset(1.0, 2.0, 30.0), ToolOffset(1.5, 2.5, 30.5)
    for number, shift_mm in ((1, 0.0), (2, 100.0)):
        cell.machine.choose(number)
        with robolink.connect(cell.url) as controller:
            for offset in (old, new):
                moved = replace(offset, x_mm=offset.x_mm + shift_mm)
                change_tools(controller, [Wanted(4, moved, ANY)])
    cell.machine.choose(1)
    with robolink.connect(cell.url) as controller:
        undo(controller, plan_undo(controller, tool=4))
        # A typed statement selects the other robot, and with it the other record.
        assert isinstance(controller, EpsonController)
        first = controller.outcomes.robot
        controller.execute_raw("Robot 2")
        assert controller.outcomes.robot != first
        undo(controller, plan_undo(controller, tool=4))
    assert robots[0].tools.get(4) == old
    assert robots[1].tools.get(4) == replace(old, x_mm=101.0)


def test_what_was_begun_on_one_robot_is_not_judged_by_the_tools_of_another(cell):
    cell.machine.choose(2)
    offset = ToolOffset(1.0, 2.0, 30.0)
    details = {"tool": 4, "requested": plain_offset(offset), "before": None}
    marker = Marker("op", MarkerKind.SET, "TLSet 4, XY(...)", wall_label(), details)
    with robolink.connect(cell.url) as controller:
        controller.outcomes.begin(marker)
    cell.machine.robots[0].tools.set(4, offset)  # it would look finished
    cell.machine.choose(1)
    with robolink.connect(cell.url) as controller:
        with pytest.raises(OutcomeUnknownError):
            controller.require_settled("Go P1")
        with pytest.raises(NotReadyError, match="was begun on"):
            recover(controller)
    cell.machine.choose(2)
    with robolink.connect(cell.url) as controller:
        (settled,) = recover(controller).settled
        assert settled.verdict is Verdict.NOT_APPLIED


def test_motors_of_one_robot_or_of_all():
    simulator = EpsonSimulator(BOTH)
    link = simulator.connect(0)

    def ask(request):
        link.receive(f"{request}\r\n".encode(), simulator.now_ns)
        return link.outgoing().decode().strip()

    assert ask("$Login,") == "#Login,0"
    assert ask("$SetMotorsOff,2") == "#SetMotorsOff,0"
    assert [robot.motors_on for robot in simulator.machine.robots] == [True, False]
    assert ask("$GetMotor,2") == "#GetMotor,1,0,0"
    assert ask("$SetMotorsOff,0") == "#SetMotorsOff,0"
    assert not any(robot.motors_on for robot in simulator.machine.robots)
    assert ask("$SetCurRobot,2") == "#SetCurRobot,0"
    assert ask("$GetRobotInfo") == "#GetRobotInfo,2,3,GX4-C351S,5,C8-C901SR"
    assert ask("$SetCurRobot,3") == "!SetCurRobot,12"
    assert ask('$Execute,"Robot 1; Print Robot, RobotType"').split()[:2] == ['#Execute,"1', "3"]
    assert ask('$Execute,"Robot 3"') == "!Execute,99"


def test_both_robots_are_calibrated_one_after_the_other(tmp_path, monkeypatch):
    with method_cell(BOTH, tmp_path, monkeypatch) as at:
        machine, cells = at.cell.simulator.machine, at.cell.simulator.worlds
        done = at.calibrate("two-pose", "--station", "PIN-07")
        assert done.code == 0, done.err
        machine.choose(2)
        machine.motors_on = True
        done = at.calibrate("pivot", "--station", "PIN-07", "--count", "4")
        assert done.code == 0, done.err
        for robot, world, axes in zip(machine.robots, cells, (2, 3), strict=True):
            held, true = robot.tools.get(1).components(), world.tips[1].components()
            assert held[:axes] == pytest.approx(true[:axes], abs=0.04)
