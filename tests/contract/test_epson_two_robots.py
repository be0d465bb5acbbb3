"""Two robots on one controller: a SCARA and six axes, each with its tools, points and world."""

from dataclasses import replace
from itertools import count

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

import robolink
from robolink.controllers.epson import EpsonController
from robolink.model import MotionProfile, Path, ToolOffset, WorkBox
from tests.contract._method_cell import method_cell

pytestmark = pytest.mark.simulator_only

BOTH = "GX4-C351S,C8-C901SR"
_names = count()


@pytest.fixture
def cell(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    name, simulator = f"two-robots-{next(_names)}", EpsonSimulator(BOTH, seed=5)
    simulator.url = register(name, simulator, clock=ManualClock())
    yield simulator
    unregister(name)


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
        done = at.calibrate("pivot", "--station", "PIN-08", "--count", "4")
        assert done.code == 0, done.err
        for robot, world, axes in zip(machine.robots, cells, (2, 3), strict=True):
            held, true = robot.tools.get(1).components(), world.tips[1].components()
            assert held[:axes] == pytest.approx(true[:axes], abs=0.04)
