"""Six-axis and folding arms, and Tool 0 of every kind of robot, as EPSON defines them."""

import json
import math
import random
from pathlib import Path

import click
import pytest
from robolink_cli.commands.simulate.sim import sim
from robolink_simulators.cell.frames import product, transposed, zyx
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.kinematics import (
    continued,
    forward,
    frame_of,
    hand_of,
    inverse,
    tip_of,
)
from robolink_simulators.epson.arm.robots import (
    Joints,
    Mechanism,
    Mount,
    check_depth,
    check_ranges,
    find_robot,
    robots,
)
from robolink_simulators.epson.condition import OutOfReach

from robolink.errors import ConfigError
from robolink.model import Elbow, Hand, Posture, ToolOffset, Wrist
from robolink.protocols.spel import parse_point
from tests._rows import each_row

# Six-axis and folding arms: EPSON's own descriptions, flags, and both directions of the kinematics.

SHARED = Path(__file__).parents[2].parent / "shared"
VECTORS = SHARED / "vectors" / "epson_fk.json"
C8 = find_robot("C8-C901S")
FAMILIES = ("GX4-C351S-L", "GX8-C653SR", "RS4-C351S", "RS6-C552C")
SIX_AXES = ("C8-C901S", "C8-C1401CR", "C12-C1401C", "CX4-A601SR", "CX7-A901S", "C4-A901S", "VT6L")


def turned_from(pose, rotation):
    """Return the largest difference between the entries of a pose's orientation and a matrix."""
    seen = zyx(pose.u_deg, pose.v_deg, pose.w_deg)
    rows = zip(seen, rotation, strict=True)
    return max(abs(a - b) for row, other in rows for a, b in zip(row, other, strict=True))


def somewhere(model, rng, margin_deg=0.0):
    """Return possible joints of the arm, as far from singular ones as requested."""
    while True:
        joints = Joints(*(rng.uniform(low, high) for low, high in model.ranges))
        try:
            check_depth(model, joints)
        except OutOfReach:
            continue
        if model.mechanism is Mechanism.SIX_AXIS:
            bends = (joints[4],)
        else:
            bends = (math.remainder(joints[1], 180.0),)
        if all(abs(bend) > margin_deg for bend in bends):
            return joints


@pytest.mark.skipif(not VECTORS.exists(), reason="the vendor's poses are not beside this folder")
def test_every_pose_of_the_vendors_own_geometry_is_reached():
    cases = json.loads(VECTORS.read_text(encoding="utf-8"))["cases"]
    assert len(cases) >= 390
    for case in cases:
        model = find_robot(case["model"])
        joints = Joints(*case["joints"])
        check_ranges(model, joints)
        pose = forward(model, joints)
        assert pose.coordinates()[:3] == pytest.approx(case["xyz_mm"], abs=1e-5), case
        assert turned_from(pose, case["rotation"]) < 1e-8, case
        if abs(pose.v_deg) < 89.9 and model.six_axes:
            assert pose.coordinates()[3:] == pytest.approx(case["uvw_deg"], abs=1e-6), case


@each_row(
    ("model", "joints", "pose"),
    [
        # docs/reference/epson-robots.md, "Six axes": zero, and the worked example of both mounts.
        ("C8-C901S", (0, 0, 0, 0, 0, 0), (0, 580, 902, 0, -90, -90)),
        ("C8-C901SR", (0, 0, 0, 0, 0, 0), (0, 580, -902, 0, -90, -90)),
        ("C8-C901S", (30, 0, 0, 0, -90, 0), (-250, 433.013, 822, 120, 0, 180)),
        ("C8-C901SR", (30, 0, 0, 0, -90, 0), (250, 433.013, -822, -120, 0, 0)),
        ("RS4-C351S", (0, 0, 0, 0), (0, 0, 0, 0, 0, 0)),
        ("RS4-C351S", (57, -122, -5, 0), (21.354, 305.371, -5, -65, 0, 0)),
        ("GX4-C251S", (0, 0, 0, 0), (250, 0, 0, 0, 0, 0)),
    ],
)
def test_printed_examples(model, joints, pose):
    there = forward(find_robot(model), Joints(*joints))
    assert there.coordinates() == pytest.approx(pose, abs=6e-4)


@each_row("name", [*FAMILIES, *SIX_AXES])
def test_the_flags_of_a_pose_lead_back_to_its_joints(name):
    model, rng = find_robot(name), random.Random(name)
    for _ in range(60):
        joints = somewhere(model, rng, 0.01)
        pose = forward(model, joints)
        assert inverse(model, pose, hand_of(model, joints), pose.posture) == pytest.approx(
            joints, abs=1e-5
        )


@pytest.mark.soak
@pytest.mark.parametrize("name", [model.name for model in robots()])
def test_the_flags_of_ten_thousand_poses_lead_back_to_their_joints(name):
    model, rng = find_robot(name), random.Random(name)
    for _ in range(10_000):
        joints = somewhere(model, rng, 0.01)
        pose = forward(model, joints)
        assert inverse(model, pose, hand_of(model, joints), pose.posture) == pytest.approx(
            joints, abs=1e-4
        )


@each_row("name", SIX_AXES)
def test_all_eight_ways_lead_to_one_pose(name):
    model, rng = find_robot(name), random.Random(name)
    ways = 0
    for _ in range(20):
        pose = forward(model, somewhere(model, rng, 1.0))
        for hand in Hand:
            for elbow in Elbow:
                for wrist in Wrist:
                    posture = Posture(elbow, wrist)
                    try:
                        joints = inverse(model, pose, hand, posture)
                    except OutOfReach:
                        continue
                    ways += 1
                    back = forward(model, joints)
                    assert (back.hand, back.posture) == (hand, posture)
                    assert back.coordinates()[:3] == pytest.approx(pose.coordinates()[:3], abs=1e-6)
                    assert turned_from(back, frame_of(pose).rotation) < 1e-9
    assert ways > 40


@each_row(
    ("joints", "hand", "posture"),
    [
        ((0, 0, 0, 0, -90, 0), Hand.RIGHT, Posture()),
        ((0, 0, 0, 0, 90, 0), Hand.RIGHT, Posture(wrist=Wrist.FLIP)),
        ((0, -60, 120, 0, -30, 0), Hand.RIGHT, Posture(Elbow.BELOW)),
        ((0, 60, 100, 0, -30, 0), Hand.LEFT, Posture()),
        ((181, 0, 0, -181, -90, -180), Hand.RIGHT, Posture(j1_flag=1, j4_flag=1, j6_flag=1)),
        ((0, 0, 0, 0, -90, 180), Hand.RIGHT, Posture(j6_flag=0)),
        ((0, 0, 0, 0, -90, 361), Hand.RIGHT, Posture(j6_flag=2)),
        ((0, 0, 0, 0, -90, -361), Hand.RIGHT, Posture(j6_flag=2)),
    ],
)
def test_flags_are_numbered_as_documented(joints, hand, posture):
    pose = forward(C8, Joints(*joints))
    assert (pose.hand, pose.posture) == (hand, posture)
    assert inverse(C8, pose, hand, posture) == pytest.approx(joints, abs=1e-9)


def test_where_the_wrist_is_stretched_only_the_sum_of_joints_4_and_6_counts():
    twisted = forward(C8, Joints(0, 0, 0, 90, 0, -90))
    assert inverse(C8, twisted, Hand.RIGHT, twisted.posture) == pytest.approx((0,) * 6)
    assert continued(C8, twisted, Joints(0, 0, 0, 80, 0.5, -80)) == pytest.approx(
        (0, 0, 0, 80, 0, -80)
    )
    # With 0.001 degrees joint 4 counts again; the sample's own print of the orientation.
    nearly = forward(C8, Joints(0, 0, 0, 90, 0.001, -90))
    assert nearly.coordinates()[3:] == pytest.approx((0.0, -90.0, -89.999), abs=1e-6)
    assert inverse(C8, nearly, Hand.RIGHT, nearly.posture) == pytest.approx(
        (0, 0, 0, 90, 0.001, -90), abs=1e-6
    )


def test_a_tool_may_be_tilted_on_the_flange():
    flange = forward(C8, Joints(0, -35, 5, 0, -60, 0))
    tool = ToolOffset(10.0, 20.0, 100.0, 30.0, 40.0, 50.0)
    tip = tip_of(C8, flange, tool, tool=1)
    # The tool looks down: its Z goes down, its X along the robot's Y, its Y along X.
    x, y, z = flange.coordinates()[:3]
    assert tip.coordinates()[:3] == pytest.approx((x + 20.0, y + 10.0, z - 100.0))
    on_flange = product(transposed(frame_of(flange).rotation), frame_of(tip).rotation)
    assert on_flange[2] == pytest.approx(zyx(30.0, 40.0, 50.0)[2])


def test_the_table_has_the_vendors_64_robots_and_both_mounts():
    mounts = {(m.mechanism, m.mount) for m in robots()}
    assert (Mechanism.SIX_AXIS, Mount.CEILING) in mounts
    assert (Mechanism.SCARA, Mount.MULTIPLE) in mounts
    assert (Mechanism.FOLDED_SCARA, Mount.CEILING) in mounts
    assert {m.robot_type for m in robots()} == {3, 5, 6}


@pytest.mark.skipif(not SHARED.exists(), reason="the vendor's table is not beside this folder")
def test_the_table_is_the_vendors():
    data = SHARED / "data" / "epson_robots" / "joints.json"
    models = json.loads(data.read_text(encoding="utf-8"))["models"]
    assert len(models) == 64
    for name, row in models.items():
        model = find_robot(name)
        joints = [joint for joint in row["chain"] if joint["type"] != "fixed"]
        assert model.lengths_mm == tuple(row.get("links_mm") or row["arms_mm"])
        assert model.ranges == tuple((j["lower"], j["upper"]) for j in joints)
        assert model.top_speed == tuple(j["max_speed"] for j in joints)
        assert (model.mount, model.robot_type) == (row["mount"], row["robot_type"])
        assert model.payload_kg == row["payload_max_kg"]


def test_the_ends_of_ranges_are_whole_pulses_where_the_resolution_is_known():
    known = {"GX4-C301S": (0, 1), "GX8-C652CR": (0,), "C8-C901S": (1, 2), "C12-C1401S": (1,)}
    for name, joints in known.items():
        model = find_robot(name)
        for joint in joints:
            for end in model.ranges[joint]:
                pulses = end * model.pulses_per_unit[joint]
                assert pulses == pytest.approx(round(pulses), abs=0.01)
    # The limits that the manual prints for GX4.
    low, high = find_robot("GX4-C301S").ranges[0]
    scale = find_robot("GX4-C301S").pulses_per_unit[0]
    assert (round(low * scale), round(high * scale)) == (-1456356, 6699236)


def test_the_shell_completes_the_name_of_a_robot_and_of_a_second_one():
    complete = sim.commands["epson"].params
    (option,) = [one for one in complete if one.name == "robot"]
    context = click.Context(sim.commands["epson"])
    names = [item.value for item in option.shell_complete(context, "cx4")]
    assert names == ["CX4-A601C", "CX4-A601CR", "CX4-A601S", "CX4-A601SR"]
    second = [item.value for item in option.shell_complete(context, "T6-602S,rs4")]
    assert second == ["T6-602S,RS4-C351C", "T6-602S,RS4-C351S"]


# Tool 0 of every kind of robot, and the tool calculated by hand, as EPSON defines them.
# Source: docs/reference/epson-robots.md, "Frames"; docs/reference/calibration.md 2.1.


class CommandWindow:
    """Runs statements and waits for their end."""

    def __init__(self, client):
        self.client = client

    def __call__(self, statement):
        """Return the output of a statement, or ``0``."""
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

    This is a SCARA's rule. A six-axis robot's flange is upside down, so the tool's Y has the other
    sign.
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
