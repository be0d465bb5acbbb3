"""Output and input of robots of every kind over Remote Ethernet."""

import json
import math
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from robolink_simulators.cell.frames import zyx
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.coordinate_systems import frame_at
from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.arm.six_axes import forward
from robolink_simulators.epson.arm.tilted_legs import plan_line
from robolink_simulators.epson.arm.trajectory import LinePace

from robolink.model import Elbow, Posture, Wrist
from robolink.protocols.spel import parse_point, parse_where

VECTORS = Path(__file__).parents[2].parent / "shared" / "vectors" / "epson_fk.json"


class Window:
    """Sends statements to a robot and waits for their end."""

    def __init__(self, client):
        self.client = client

    def __call__(self, statement):
        """Return the output of a statement, ``0`` for none, or the refusal."""
        reply = self.client.ask(f'$Execute,"{statement}"')
        while not reply:
            reply = self.client.wait(1.0)
        return reply.removeprefix("#Execute,").strip('"\r\n ')


@pytest.fixture
def robot(login):
    """Returns the command window of a robot model."""
    return lambda name: Window(login(EpsonSimulator(name)))


@pytest.mark.skipif(not VECTORS.exists(), reason="the vendor's poses are not beside this folder")
def test_every_pose_of_the_vendors_own_geometry_is_printed(robot):
    by_model = defaultdict(list)
    for case in json.loads(VECTORS.read_text(encoding="utf-8"))["cases"]:
        by_model[case["model"]].append(case)
    for name, cases in by_model.items():
        run = robot(name)
        run("Tool 0")
        for case in cases[::3]:
            angles = ", ".join(str(value) for value in case["joints"])
            assert run(f"P1 = AglToPls({angles})") == "0"
            point = parse_point(run("Print P1"))
            assert point.coordinates[:3] == pytest.approx(case["xyz_mm"], abs=5.1e-4), case
            seen = zyx(*point.coordinates[3:])
            for row, other in zip(seen, case["rotation"], strict=True):
                assert row == pytest.approx(other, abs=2e-5), case


def test_six_axes_print_six_joints_and_their_flags(robot):
    run = robot("C8-C901S")
    assert run("Tool 0; Go JA(30, 0, 0, 0, -90, 0)") == "0"
    assert run("Print Here") == (
        "X: -250.000 Y:  433.013 Z:  822.000 U:  120.000 V:    0.000 W:  180.000"
        " /R /A /NF /J4F0 /J6F0 /0"
    )
    where = parse_where(run("Where"))
    assert where.joints == (30, 0, 0, 0, -90, 0)
    assert len(where.pulses) == 6
    assert run("P1 = Here; PList 1").startswith(
        "P1   = XY( -250.000,  433.013,  822.000,  120.000,"
    )
    assert [run(f"Print {word}") for word in ("RobotType", "RobotModel$")] == ["5", "C8-C901S"]
    assert run("Print Hex$(RobotInfo(3))") == "3F"


def test_flags_of_a_point_choose_the_way(robot):
    run = robot("CX4-A601S")
    run("Tool 0; Go JA(0, -35, 5, 20, -60, 30)")
    run("P1 = Here; P2 = P1 /F; P3 = P1; Wrist P3, Flip")
    wanted = parse_point(run("Print P1")).coordinates
    for point in ("P2", "P3"):
        assert run(f"Go {point}") == "0"
        here = parse_point(run("Print Here"))
        assert here.coordinates == pytest.approx(wanted, abs=1.1e-3)
        assert here.posture == Posture(Elbow.ABOVE, Wrist.FLIP)
        assert float(run("Print Agl(5)")) > 0
    assert run("Move P1") == "!Execute,99"  # a straight motion cannot turn the wrist over


@pytest.mark.parametrize("name", ["C8-C901S", "C8-C1401CR"])
def test_a_straight_line_is_straight_and_turns_evenly(robot, name):
    run = robot(name)
    run("Tool 1")
    start = parse_point(run("Print Here")).coordinates
    assert run("Move Here +X(40) +Y(-30) +TLW(20)") == "0"
    end = parse_point(run("Print Here")).coordinates
    assert end[0] - start[0] == pytest.approx(40, abs=2e-3)
    assert end[1] - start[1] == pytest.approx(-30, abs=2e-3)


def test_tools_take_six_values_and_locals_lean(robot):
    run = robot("CX7-A901S")
    assert run("TLSet 2, XY(10, 20, 100, 30, 40, 50)") == "0"
    assert run("TLSet 2") == "Tool 2: 10.000, 20.000, 100.000, 30.000, 40.000, 50.000"
    run("Tool 0; P5 = Here; Tool 2")
    tip = run("Print Here")
    assert run("Go Here +X(5); Go Here -X(5)") == "0"
    assert run("Print Here") == tip
    # The tool's point seen from the flange's own local is the tool.
    assert run("Tool 0; Local 1, P5; Tool 2") == "0"
    seen = parse_point(run("Print Here @1"))
    assert seen.coordinates == pytest.approx((10, 20, 100, 30, 40, 50), abs=2e-3)
    assert seen.local == 1
    assert run("TGo XY(0, 0, 0, 0, 10, 0)") == "0"
    assert parse_point(run("Print Here @1")).coordinates[:3] == pytest.approx(
        (10, 20, 100), abs=2e-3
    )


@pytest.mark.parametrize(
    ("name", "statement", "code"),
    [
        ("C8-C901S", "Jump Here +X(5)", 4028),
        ("C8-C901S", "SFree 1", 4028),
        ("C8-C901S", "LimZ -10", 4028),
        ("C8-C901S", "Go JA(0, 0, 0, 0)", 4028),
        ("C8-C901S", "Go JA(0, 90, 0, 0, -90, 0)", 4001),
        ("C8-C901S", "Go XY(0, 1500, 500, 90, 0, 180)", 4001),
        ("C8-C901S", "AvoidSingularity 5", 4002),
        ("T6-602S", "AvoidSingularity 1", 4028),
        ("T6-602S", "SingularityDist 10", 4028),
        ("C8-C901S", "SingularitySpeed 101", 4002),
        ("C8-C901S", "J1Angle P1", 4028),
        ("RS4-C351S", "J4Angle P1", 4028),
        ("C8-C901S", "Go Here /J1A(3)", 4028),
        ("RS4-C351S", "Tool 0; Print PAgl(XY(0, 0, -20, 0) /J1A(361), 1)", 4001),
        ("T6-602S", "J4Angle P1", 4028),
        ("GX8-C453S", "Go JA(90, 146, -280, 0)", 4001),
        ("GX8-C453C", "Go JA(90, -138, -250, 0)", 4001),
        ("T6-602S", "Go JA(0, 0, 0, 0, 0, 0)", 4028),
    ],
)
def test_what_a_robot_cannot_do_is_refused(robot, name, statement, code):
    run = robot(name)
    assert run(statement) == "!Execute,99"
    assert run.client.code() == code


def test_an_rs_over_its_own_axis_takes_joint_1_from_the_point(robot):
    run = robot("RS4-C351S")
    assert run("Motor On; Tool 0; P1 = AglToPls(57, 0, -20, 30)") == "0"
    printed = run("Print P1")
    assert printed.endswith("/R /J1A(57.000) /0")
    assert parse_point(printed).posture == Posture(j1_angle_deg=57.0)
    assert run("Print J1Angle(P1)") == "57"
    assert run("P2 = XY(0, 0, -20, 87); Print PAgl(P2, 1)") == "0"
    assert run("J1Angle P2, 40.5; J1Angle P2") == "40.5"
    assert run("Print PAgl(P2, 1); Print PAgl(P2, 4)").split() == ["40.5", "46.5"]
    assert run("Go P2 /J1A(-100); Print J1Angle") == "-100"
    assert run("Print PAgl(XY(300, 0, -20, 87) /J1A(-100), 1)") == run(
        "Print PAgl(XY(300, 0, -20, 87), 1)"
    )
    assert parse_where(run("Where")).joints == (-100, 0, -20, 187)
    assert run("Print J1Angle") == "-100"


def test_what_counts_as_near_a_singular_place_can_be_set(robot):
    """SPEL8 p. 157, 768 to 772: AvoidSingularity sets all three back."""
    run = robot("C8-C901S")
    shown = "Print SingularityAngle, SingularitySpeed, SingularityDist"
    assert run(shown).split() == ["10", "10", "30"]
    assert run("SingularityAngle 5; SingularitySpeed 20; SingularityDist 40.5") == "0"
    assert run(shown).split() == ["5", "20", "40.5"]
    assert run("SingularityDist").strip() == "40.5"
    assert run("AvoidSingularity 1") == "0"
    assert run(shown).split() == ["10", "10", "30"]


def test_a_line_stays_what_it_is_where_nothing_counts_as_near():
    model = find_robot("C8-C901S")
    start, end = Joints(0, -35, 5, 80, -2, 0), Joints(0, -35, 5, -80, -2, 160)
    poses = (forward(model, start), forward(model, end))

    def leg(around):
        return plan_line(
            model,
            poses,
            LinePace(250.0, 2500.0, 2500.0, 90.0, 400.0),
            offset=None,
            near=start,
            avoiding=around,
        )

    assert leg(SingularSurroundings()).detours
    assert not leg(SingularSurroundings(angle_deg=0.0, distance_mm=0.0)).detours


def test_near_the_singular_wrist_a_line_is_slow_or_refused(robot):
    run = robot("C8-C901S")
    run("Tool 0; SpeedS 250; P2 = JA(0, -35, 5, -80, -2, 160); Go JA(0, -35, 5, 80, -2, 0)")
    assert run("Power High; AvoidSingularity 0; Print AvoidSingularity") == "0"
    assert run("Move P2") == "!Execute,99"
    assert run.client.code() == 4242
    run.client.ask("$Reset")
    # As it is at start-up, the controller gets through; joint 4 swings round.
    assert run("Power High; AvoidSingularity 1; P1 = Here; Move P2") == "0"
    assert float(run("Print Agl(4)")) == pytest.approx(-80, abs=1e-3)
    assert run("Move P1") == "0"
    assert float(run("Print Agl(4)")) == pytest.approx(80, abs=1e-3)


def test_a_folded_arm_uses_the_flags_of_its_first_joints(robot):
    run = robot("RS4-C351S")
    assert run("Tool 0; Go JA(300, 200, -5, 0)") == "0"
    here = parse_point(run("Print Here"))
    assert here.posture == Posture(j1_flag=1, j2_flag=1)
    assert run("P1 = Here; Go JA(0, -90, 0, 0); Go P1") == "0"
    assert parse_where(run("Where")).joints == (300, 200, -5, 0)
    assert run("Print RobotType") == "6"


def test_ljm_takes_the_short_way_round(robot):
    run = robot("C8-C901S")
    run("Tool 0; Go JA(0, -35, 5, 0, -60, 170)")
    run("P1 = Here +TLU(20)")  # joint 6 beyond half a turn
    assert run("Go LJM(P1)") == "0"
    assert float(run("Print Agl(6)")) == pytest.approx(190, abs=1e-3) or float(
        run("Print Agl(6)")
    ) == pytest.approx(150, abs=1e-3)
    assert float(run("Print PAgl(Here, 5)")) == pytest.approx(-60, abs=1e-3)


def test_external_control_points_are_kept_until_power_off(robot):
    run = robot("C8-C901S")
    assert run("ECPSet 2, XY(300, 400, 200, 10, 20, 30); ECP 2") == "0"
    assert run("Print ECP; Print ECPDef(2); Print ECPDef(3)").split() == ["2", "-1", "0"]
    assert parse_point(run("Print ECPSet(2)")).coordinates == (300, 400, 200, 10, 20, 30)
    run.client.simulator.panel._machine.forget_volatile(0)
    assert run.client.simulator.machine.control_points.selected == 0
    assert run.client.simulator.machine.control_points.defined(2)


@pytest.mark.parametrize(("flag", "joint_5"), [("", 60), (" LJM 1", -60), (" LJM 2", 60)])
def test_ljm_behind_a_movement_keeps_the_wrist_or_not(robot, flag, joint_5):
    run = robot("C8-C901S")
    run("Tool 0; Go JA(0, -35, 5, 0, -60, 0); P1 = Here /F +Z(1)")
    assert run(f"Go P1{flag}") == "0"
    assert float(run("Print Agl(5)")) == pytest.approx(joint_5, abs=1)


def test_joint_2_of_gx8_c453_is_narrower_where_the_shaft_is_low(robot):
    run = robot("GX8-C453S")
    assert run("Tool 0; P1 = AglToPls(90, 146, -280, 0)") == "0"  # a point is not a way there
    assert run("Go P1") == "!Execute,99"
    run.client.ask("$Reset")
    assert run("Go JA(90, 146, -260, 0); Go JA(90, 144, -280, 0)") == "0"
    assert robot("GX8-C452S")("Go JA(90, 146, -190, 0)") == "0"


def tip_along(robot, statement, share):
    """Return the tip's place after a share of a movement's time, and let the movement end."""
    machine = robot.client.simulator.machine
    robot.client.ask(f'$Execute,"{statement}"')
    start_ns, end_ns = robot.client.simulator.now_ns, machine.arm.next_change()
    pose = machine.robot.tip_at(
        machine.arm.position_at(start_ns + round(share * (end_ns - start_ns)))
    )
    while not robot.client.wait(1.0):
        pass
    return pose.coordinates()


def frame_of_six(values):
    x, y, z, u, v, w = values
    return frame_at((x, y, z, u, v, w))


def off_line_mm(place, start, end):
    """Return the distance of a place from a line."""
    way = [b - a for a, b in zip(start[:3], end[:3], strict=True)]
    seen = [b - a for a, b in zip(start[:3], place[:3], strict=True)]
    along = sum(a * b for a, b in zip(way, seen, strict=True)) / sum(a * a for a in way)
    return math.dist(seen, [along * a for a in way])


def test_a_line_past_the_singular_wrist_is_left_and_come_back_to(robot):
    """Across J5 = 0 joint 4 would turn over at once: the arm takes another path and returns."""
    run = robot("C8-C901S")
    run("Tool 0; P1 = JA(0, -35, 5, 60, -12, 0); P2 = JA(2, -35, 5, -60, -12, 120)")
    run("Power High; SpeedS 200; Go P1")
    start, end = (parse_point(run(f"Print {name}")).coordinates for name in ("P1", "P2"))
    middle = tip_along(run, "Move P2", 0.5)
    assert off_line_mm(middle, start, end) > 0.5
    assert parse_point(run("Print Here")).coordinates == pytest.approx(end, abs=2e-3)
    # So slowly that joint 4 keeps up it stays on the line.
    run("Go P1; SpeedS 0.5")
    middle = tip_along(run, "Move P2", 0.5)
    assert off_line_mm(middle, start, end) < 1e-3


HELD = [
    ("C8-C901S", "Here +X(30) +Y(20) +TLU(40) +TLV(10)", "Here +X(-10) +Z(25)"),
    ("T6-602S", "Here +X(-30) +Y(20) +U(-200)", "Here +X(-20) +Y(5) +U(-100)"),
    ("RS4-C351S", "Here +X(30) +Y(20) +U(40)", "Here +X(10) +Y(15) +U(20)"),
]


@pytest.mark.parametrize(("name", "end", "mid"), HELD, ids=[case[0] for case in HELD])
def test_a_held_workpiece_is_led_past_an_external_control_point(robot, name, end, mid):
    """The point follows a straight line or an arc on the workpiece; the tip does not."""
    run = robot(name)
    assert run("Motor On; Tool 0; TLSet 1, XY(12, 5, 0, 20); Tool 1") == "0"
    assert run(f"P1 = Here; P2 = {end}; P3 = {mid}") == "0"
    assert run("Move P2 ECP") == "!Execute,99"
    assert run.client.code() == 2232
    run.client.ask("$Reset")
    run("Motor On; ECPSet 1, Here +X(60) +Z(-40); ECP 1; SpeedS 50")
    start, last, half = (parse_point(run(f"Print P{n}")).coordinates for n in (1, 2, 3))
    point = frame_of_six(parse_point(run("Print ECPSet(1)")).coordinates)

    def seen(*places):
        return [(frame_of_six(at).inverse() @ point).shift_mm for at in places]

    middle = tip_along(run, "Move P2 ECP", 0.5)
    assert off_line_mm(*seen(middle, start, last)) < 1e-2
    assert off_line_mm(middle, start, last) > 1.0
    assert parse_point(run("Print Here")).coordinates == pytest.approx(last, abs=2e-3)
    run("Go P1")
    some = [tip_along(run, "Arc3 P3, P2 ECP", share) for share in (0.4, 0.7) if run("Go P1")]
    assert parse_point(run("Print Here")).coordinates == pytest.approx(last, abs=2e-3)
    for place in some:
        assert off_circle_mm(*seen(place, start, half, last)) < 1e-2


@pytest.mark.parametrize(("name", "end", "mid"), HELD[:2], ids=[case[0] for case in HELD[:2]])
def test_arc3_is_a_circle_in_space_through_its_middle_point(robot, name, end, mid):
    run = robot(name)
    run(f"Motor On; P1 = Here; P2 = {end}; P3 = {mid} +Z(-12); SpeedS 50")
    start, last, half = (parse_point(run(f"Print P{n}")).coordinates for n in (1, 2, 3))
    places = [tip_along(run, "Arc3 P3, P2", share) for share in (0.3, 0.6) if run("Go P1")]
    assert parse_point(run("Print Here")).coordinates == pytest.approx(last, abs=2e-3)
    for place in places:
        assert off_circle_mm(place, start, half, last) < 1e-2
        assert off_line_mm(place, start, last) > 1.0
    assert run("Arc3 P2, P2") == "!Execute,99"
    assert run.client.code() == 4002


def off_circle_mm(place, *three):
    """Return the distance of a place from the circle through three others."""
    at, a, b, c = (np.array(one[:3]) for one in (place, *three))
    normal = np.cross(b - a, c - a)
    rows = np.array([b - a, c - a, normal])
    heights = [(b @ b - a @ a) / 2, (c @ c - a @ a) / 2, normal @ a]
    centre = np.linalg.solve(rows, heights)
    aside = (at - a) @ normal / np.linalg.norm(normal)
    return math.hypot(np.linalg.norm(at - centre) - np.linalg.norm(a - centre), aside)


def test_ljm_counts_from_another_point_than_where_the_arm_is(robot):
    run = robot("C8-C901S")
    run("Tool 0; P2 = JA(0, -35, 5, 0, -60, -150); Go JA(0, -35, 5, 0, -60, 150)")
    run("P1 = Here +TLU(40)")
    turns = {}
    for flags in ("P1", "P1, Here", "P1, P2", "P1, P2, 4"):
        turns[flags] = float(run(f"Print PAgl(LJM({flags}), 6)"))
    here = turns["P1"]
    assert abs(here - 150) == pytest.approx(40, abs=1e-3)
    assert turns["P1, Here"] == here
    # The same place, one turn of joint 6 nearer to the reference.
    other = turns["P1, P2"]
    assert abs(other - here) == pytest.approx(360, abs=1e-3)
    assert abs(other + 150) < 180
    # Joint 6 first, with the other wrist.
    assert abs(turns["P1, P2, 4"] + 150) == pytest.approx(80, abs=1e-3)
    assert run("Print PAgl(LJM(P1, XY(5000, 0, 0, 0, 0, 180)), 6)") == "!Execute,99"
