"""Tool 0 of every kind of robot, and the tool that is worked out by hand, as EPSON defines them.

Source: docs/reference/epson-robots.md, "Frames"; docs/reference/calibration.md 2.1.
"""

import math

import pytest
from robolink_simulators.cell.frames import transposed, zyx
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.robots import find_robot

from robolink.errors import ConfigError
from robolink.protocols.spel import parse_point


class CommandWindow:
    """Runs statements and waits for their end."""

    def __init__(self, client):
        self.client = client

    def __call__(self, statement):
        """Return what a statement printed, or ``0``."""
        reply = self.client.ask(f'$Execute,"{statement}"')
        while not reply:
            reply = self.client.wait(1.0)
        return reply.removeprefix("#Execute,").strip('"\r\n ')

    def point(self, name):
        """Return the coordinates that a point prints."""
        return parse_point(self(f"Print {name}")).coordinates

    def axes(self, name):
        """Return the X, Y and Z axis of a point's frame, in the robot's coordinates."""
        return transposed(zyx(*self.point(name)[3:]))


@pytest.fixture
def robot(login):
    return lambda name: CommandWindow(login(EpsonSimulator(name)))


X, Y, UP = (1, 0, 0), (0, 1, 0), (0, 0, 1)


@pytest.mark.parametrize("name", ["C8-C901S", "C8-C901SR", "C12-C1401C", "CX4-A601SR", "VT6L"])
def test_six_axes_with_all_joints_at_zero(robot, name):
    """X upwards, Y along the robot's X, Z square out of the flange of joint 6."""
    run = robot(name)
    run("Tool 0")
    assert run("P1 = AglToPls(0, 0, 0, 0, 0, 0)") == "0"
    for axis, wanted in zip(run.axes("P1"), (UP, X, Y), strict=True):
        assert axis == pytest.approx(wanted, abs=1e-5)
    assert run.point("P1")[3:] == (0, -90, -90)


def test_tool_zero_is_fixed_to_joint_6_and_goes_with_the_arm(robot):
    run = robot("CX7-A901S")
    run("Tool 0; P1 = JA(10, -20, 30, 40, -50, 60); P2 = JA(10, -20, 30, 40, -50, 100)")
    before, after = run.axes("P1"), run.axes("P2")
    assert run.point("P1")[:3] == pytest.approx(run.point("P2")[:3], abs=1e-3)
    assert before[2] == pytest.approx(after[2], abs=5e-5)
    turned = sum(a * b for a, b in zip(before[0], after[0], strict=True))
    assert math.degrees(math.acos(turned)) == pytest.approx(40, abs=0.01)


@pytest.mark.parametrize("name", ["T6-602S", "GX4-C351S-R", "GX8-C552SR", "RS6-C552S"])
def test_a_scara_whose_joints_add_up_to_zero_is_parallel_to_its_axes(robot, name):
    """The origin is on the axis of joint 4, and the frame turns with it."""
    run = robot(name)
    run("Tool 0; P1 = AglToPls(30, 50, -20, -80); P2 = AglToPls(30, 50, -20, -50)")
    assert run.axes("P1") == (X, Y, UP)
    assert run.point("P1")[:3] == run.point("P2")[:3]
    assert run.point("P2")[3] - run.point("P1")[3] == pytest.approx(30)


def test_a_six_axis_robot_on_a_wall_is_refused():
    with pytest.raises(ConfigError, match="on a wall"):
        find_robot("C8-C901SW")


@pytest.mark.parametrize(
    ("name", "sign"), [("T6-602S", 1), ("RS4-C351S", 1), ("C8-C901S", -1), ("CX4-A601SR", -1)]
)
def test_two_poses_half_a_turn_apart_give_the_tool(robot, name, sign):
    """((x2 - x1) / 2, (y2 - y1) / 2) with U at 0 and 180.

    The rule is a SCARA's. Six axes hold their flange upside down: Y of the tool counts the other
    way there.
    """
    run = robot(name)
    simulator = run.client.simulator
    run("Tool 0")
    simulator.world.operator_sigma_mm = 0.0
    simulator.panel.teach()
    for number, u_deg in ((1, 0.0), (2, 180.0)):
        simulator.world.operator.teach_point(number, u_deg)
    simulator.panel.auto()
    (x1, y1, *_), (x2, y2, *_) = (simulator.machine.points.get(n).coordinates for n in (1, 2))
    tool = ((x2 - x1) / 2, sign * (y2 - y1) / 2)
    true = simulator.world.tips[1]
    assert tool == pytest.approx((true.x_mm, true.y_mm), abs=1e-6)


def test_fifteen_tools_and_tool_zero_that_cannot_be_set(robot):
    run = robot("C12-C1401S")
    for tool in range(1, 16):
        assert run(f"TLSet {tool}, XY({tool}, -{tool}, 100, 10, 20, 30)") == "0"
    assert run("TLSet 15") == "Tool 15: 15.000, -15.000, 100.000, 10.000, 20.000, 30.000"
    assert run("Print TLDef(15)") == "-1"
    assert run("TLSet 0, XY(1, 2, 3, 4)") == "!Execute,99"
    assert run.client.code() == 2207
