"""The driver on a six-axis robot: points with flags, the short way round, singular positions."""

from dataclasses import replace

import pytest
from robolink_simulators.cell.frames import transposed
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.kinematics import continued, forward, frame_of
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.memory.points import Point

import robolink
from robolink.errors import LimitError
from robolink.model import Elbow, Hand, MotionProfile, Path, Posture, ToolOffset, WorkBox, Wrist
from robolink.protocols import spel

pytestmark = pytest.mark.simulator_only

ANYWHERE = WorkBox()
STRAIGHT = MotionProfile(Path.STRAIGHT, speed_mm_s=250.0)
JOINT = MotionProfile(Path.JOINT, speed_percent=5)


@pytest.fixture(params=["C8-C901S", "C8-C901SR"])
def arm(request, serve_simulator):
    """A simulator and a controller connected to it."""
    simulator = EpsonSimulator(request.param, seed=2)
    with robolink.connect(serve_simulator(simulator).url) as controller:
        controller.tools.select(0)
        yield simulator, controller


def go(controller, target, profile=JOINT):
    controller.groups[0].move_to(target, profile, box=ANYWHERE).wait(timeout_s=600)


def test_a_pose_and_a_taught_point_tell_their_flags(arm):
    simulator, controller = arm
    machine = simulator.machine
    joints = Joints(*machine.arm.joints[:5], 200.0)
    machine.arm.place(joints, simulator.now_ns)
    pose = controller.groups[0].pose()
    assert pose.hand is Hand.RIGHT
    assert pose.posture == machine.arm.posture
    assert pose.posture.j6_flag == 1
    machine.points.store(7, Point.at(machine.tip()))
    assert controller.points.read(7).posture == pose.posture


@pytest.mark.parametrize("profile", [JOINT, STRAIGHT])
def test_a_tool_that_turns_past_half_a_turn_does_not_go_round_the_other_way(arm, profile):
    simulator, controller = arm
    machine = simulator.machine
    machine.arm.place(Joints(*machine.arm.joints[:5], 175.0), simulator.now_ns)
    here = controller.groups[0].pose()
    for turn_deg in (10.0, -10.0):
        start = machine.arm.joints
        target = replace(here, u_deg=here.u_deg + turn_deg, z_mm=here.z_mm + turn_deg / 5)
        go(controller, target, profile)
        assert abs(machine.arm.joints[5] - start[5]) < 25
    assert machine.arm.posture.wrist is here.posture.wrist


def test_a_target_without_flags_keeps_the_present_ones(arm):
    simulator, controller = arm
    here = controller.groups[0].pose()
    before = simulator.machine.arm.posture
    go(controller, replace(here, x_mm=here.x_mm + 5, hand=None, posture=None))
    assert simulator.machine.arm.posture == before
    assert controller.groups[0].pose().x_mm == pytest.approx(here.x_mm + 5, abs=0.02)


def test_flags_that_are_given_are_taken(arm):
    simulator, controller = arm
    here = controller.groups[0].pose()
    other = Wrist.FLIP if here.posture.wrist is Wrist.NO_FLIP else Wrist.NO_FLIP
    go(controller, replace(here, posture=replace(here.posture, wrist=other)))
    assert simulator.machine.arm.posture.wrist is other
    there = controller.groups[0].pose()
    assert there.coordinates()[:3] == pytest.approx(here.coordinates()[:3], abs=0.02)


def test_a_straight_way_to_a_singular_wrist_is_refused_before_it_is_sent(arm):
    simulator, controller = arm
    machine = simulator.machine
    stands = machine.arm.joints
    machine.arm.place(Joints(*stands[:4], 4.0, stands[5]), simulator.now_ns)
    singular = controller.groups[0].pose()
    started = machine.arm.moves_started
    with pytest.raises(LimitError, match=r"Joint 5 would be at 4\.0 degrees"):
        go(controller, replace(singular, z_mm=singular.z_mm), STRAIGHT)
    assert machine.arm.moves_started == started
    go(controller, singular, JOINT)  # joint to joint is allowed


def test_a_straight_way_past_the_axis_of_joint_1_is_refused_before_it_is_sent(arm):
    """The wrist is 12 mm from the axis: joint 1 would have to swing round."""
    simulator, controller = arm
    machine = simulator.machine
    model = machine.model
    near = Joints(20.0, -3.0, 20.0, 30.0, 70.0, 0.0)
    flange = forward(model, near)
    x, y, _ = wrist_mm(flange, model)
    aside = replace(flange, x_mm=flange.x_mm - 0.98 * x + 12.0, y_mm=flange.y_mm - 0.98 * y)
    machine.arm.place(continued(model, aside, near), simulator.now_ns)
    started = machine.arm.moves_started
    here = controller.groups[0].pose()
    # Past the axis, which stays on its left.
    x, y, _ = wrist_mm(here, model)
    past = replace(here, x_mm=here.x_mm - y, y_mm=here.y_mm + x)
    told = controller.groups[0].obstacle(past, Path.STRAIGHT, start=here)
    assert "too near its axis" in told
    assert controller.groups[0].obstacle(past, Path.JOINT, start=here) == ""
    with pytest.raises(LimitError, match="too near its axis"):
        go(controller, past, STRAIGHT)
    assert machine.arm.moves_started == started
    go(controller, replace(here, z_mm=here.z_mm + 5), STRAIGHT)


def wrist_mm(flange, model):
    """Return the centre of the wrist."""
    axis = transposed(frame_of(flange).rotation)[2]
    at = flange.coordinates()[:3]
    return tuple(p - model.lengths_mm[5] * a for p, a in zip(at, axis, strict=True))


def test_what_stands_in_the_way_is_told_before_anything_moves(arm):
    simulator, controller = arm
    machine, group = simulator.machine, controller.groups[0]
    here, stands = group.pose(), machine.arm.joints
    assert group.obstacle(here, Path.STRAIGHT) == ""
    assert "cannot reach" in group.obstacle(replace(here, y_mm=here.y_mm + 3000), Path.JOINT)
    machine.arm.place(Joints(*stands[:4], 4.0, stands[5]), simulator.now_ns)
    singular = group.pose()
    assert "Joint 5" in group.obstacle(singular, Path.STRAIGHT)
    assert group.obstacle(singular, Path.JOINT) == ""
    assert machine.arm.moves_started == 0


def test_a_straight_way_past_a_singular_wrist_is_found_between_its_ends(arm):
    """Joint 5 is -30 degrees at both ends and -1 half way."""
    simulator, controller = arm
    machine, group = simulator.machine, controller.groups[0]
    machine.arm.place(Joints(0.0, -28.0, 20.0, 0.0, -30.0, 0.0), simulator.now_ns)
    here = group.pose()
    down_mm = 318.0 if machine.model.hangs else -318.0
    there = replace(here, y_mm=here.y_mm - 255.0, z_mm=here.z_mm + down_mm)
    assert group.obstacle(there, Path.STRAIGHT) == ""
    assert "Joint 5" in group.obstacle(there, Path.STRAIGHT, start=here)
    with pytest.raises(LimitError, match="Joint 5"):
        go(controller, there, STRAIGHT)
    assert machine.arm.moves_started == 0


def test_a_place_out_of_reach_is_refused_and_the_controller_stays_ready(arm):
    simulator, controller = arm
    here = controller.groups[0].pose()
    with pytest.raises(LimitError, match="cannot reach"):
        go(controller, replace(here, y_mm=here.y_mm + 3000))
    assert simulator.machine.arm.moves_started == 0
    go(controller, replace(here, x_mm=here.x_mm + 1))


def test_a_tilted_tool_is_written_whole_and_read_back(arm):
    _, controller = arm
    offset = ToolOffset(10.0, -20.0, 100.0, 30.0, 40.0, -50.0)
    controller.tools.write(3, offset, expected=None)
    assert controller.tools.read(3) == offset


@pytest.mark.parametrize("arm", ["RS4-C351S"], indirect=True)
def test_an_rs_comes_back_to_joint_1_as_it_stood_over_its_own_axis(arm):
    simulator, controller = arm
    machine = simulator.machine
    there = Joints(57.0, 0.0, -20.0, 30.0)
    machine.arm.place(there, simulator.now_ns)
    machine.points.store(7, Point.at(machine.tip()))
    assert controller.groups[0].pose().posture.j1_angle_deg == 57.0
    taught = controller.points.read(7)
    assert (taught.x_mm, taught.y_mm, taught.posture.j1_angle_deg) == (0.0, 0.0, 57.0)
    machine.arm.place(Joints(-40.0, 60.0, -20.0, 0.0), simulator.now_ns)
    go(controller, replace(taught, tool=0))
    assert machine.arm.joints == pytest.approx(there, abs=1e-3)


def test_points_and_flags_go_through_text_and_back():
    postures = [
        Posture(elbow, wrist, j1_flag=j1, j4_flag=j4, j6_flag=j6, j4_angle_deg=-7.125)
        for elbow in Elbow
        for wrist in Wrist
        for j1, j4, j6 in ((0, 0, 0), (1, 0, 2), (0, 1, 127))
    ]
    for posture in postures:
        printed = spel.PrintedPoint.of(
            (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
            hand=Hand.LEFT,
            local=2,
            posture=posture,
            six_axes=True,
        )
        assert spel.parse_point(spel.format_point(printed)) == printed


@pytest.mark.parametrize(
    ("text", "kind", "six"),
    [("5", 5, True), (" 3\r\n", 3, False), ("6-Axis", 5, True), ("RS", 6, False), ("9", 9, False)],
)
def test_the_type_of_a_robot_is_read_by_number_and_by_name(text, kind, six):
    assert spel.parse_robot_type(text) == kind
    assert spel.tilts_tool(kind) is six
