"""How long movements take by what is known beforehand: arms, axes, and the rule for both."""

import random
from dataclasses import replace

import pytest
from robolink_simulators.epson.arm.kinematics import forward, posture_of, solve
from robolink_simulators.epson.arm.robots import Evidence, Joints, find_robot, robots

from robolink.controllers import JointRates, Way
from robolink.controllers.epson.arms import EpsonTimes
from robolink.controllers.epson.arms.joints import joint_deltas
from robolink.controllers.epson.arms.models import ArmModel, arm_of
from robolink.controllers.movement_time import ramped_s
from robolink.controllers.softmotion.group import SoftMotionTimes
from robolink.model import Hand, MotionProfile, Path, Pose
from tests._rows import each_row

VENDOR = [model for model in robots() if model.evidence is Evidence.VENDOR]
SECOND_HAND = [model for model in robots() if model.evidence is not Evidence.VENDOR]
RATES = JointRates((360, 540, 1000, 1500), (1800, 2700, 5000, 7500))
HERE = Pose(400, 250, -60, 0)
GO = MotionProfile(Path.JOINT, 5, 50)
MOVE = MotionProfile(Path.STRAIGHT, 5, 50)


def known(name, stated=None) -> ArmModel:
    """The arm of a model that is known."""
    arm = arm_of(name, stated)
    assert arm is not None
    return arm


def moved_by(arm, start, end) -> tuple[float, ...]:
    """By how much the joints move to a place within reach."""
    deltas = joint_deltas(arm, start, end)
    assert deltas is not None
    return deltas


def seconds(times, one) -> float:
    """How long a movement takes whose speed is known."""
    takes_s = times.move_s(one)
    assert takes_s is not None
    return float(takes_s)


def epson(model="GX8-C652S", *, stated=None, accel=(10, 10), factor=100):
    """The times of a robot whose settings are those after a start."""
    return EpsonTimes((200.0, 200.0), accel, factor, arm_of(model, stated))


def way(end, profile=GO, *, length_mm=0.0, turn_deg=0.0, start=HERE):
    """A way of the flange."""
    return Way(length_mm, turn_deg, start, end, profile)


@each_row("model", VENDOR)
def test_a_robot_of_the_makers_files_is_known_by_its_name(model):
    arm = known(model.name.lower())
    assert arm.lengths_mm == model.lengths_mm
    assert arm.rates.speeds == pytest.approx(model.top_speed, abs=0.01)
    assert len(arm.rates.accelerations) == model.axes
    assert arm.hangs is model.hangs


@each_row("model", SECOND_HAND)
def test_of_other_robots_a_cell_file_states_the_speeds(model):
    assert arm_of(model.name) is None
    stated = JointRates(model.top_speed, model.top_speed)
    assert known(model.name, stated).lengths_mm == model.lengths_mm
    assert arm_of("N2-A450S", stated) is None


@each_row(
    "name", ["GX8-C652S", "GX4-C251C", "RS4-C351S", "C8-C901S", "C8-C901SR", "CX4-A601S", "T6-602S"]
)
def test_joints_move_by_what_the_simulated_arm_moves_them(name):
    model, rng = find_robot(name), random.Random(name)
    arm = known(name, JointRates(model.top_speed, model.top_speed))
    for _ in range(20):
        if model.six_axes:
            first = Joints(*(rng.uniform(-30, 30) for _ in range(4)), -60, rng.uniform(-60, 60))
            then = Joints(*(value + rng.uniform(-15, 15) for value in first))
        else:
            bent = -1 if model.robot_type == 6 else 1
            first = Joints(rng.uniform(0, 90), bent * 70, -20, rng.uniform(-60, 60))
            then = Joints(*(value + rng.uniform(-25, 20) for value in first[:2]), -35, 10)
        poses = [forward(model, joints) for joints in (first, then)]
        again = [
            solve(model, pose, pose.hand or Hand.RIGHT, posture_of(model, first)) for pose in poses
        ]
        assert again[1] == pytest.approx(then, abs=1e-6)
        moved = moved_by(arm, *poses)
        assert moved == pytest.approx([b - a for a, b in zip(first, then, strict=True)], abs=1e-6)


def test_a_place_out_of_reach_has_no_joints():
    arm = known("GX8-C652S")
    assert joint_deltas(arm, HERE, replace(HERE, x_mm=900)) is None
    assert joint_deltas(known("C8-C901S"), HERE, replace(HERE, z_mm=5000)) is None
    assert epson().move_s(way(replace(HERE, x_mm=900))) is None


def test_half_a_turn_goes_the_way_that_its_sign_says():
    arm = known("GX8-C652S")
    for turn_deg in (180.0, -180.0):
        assert moved_by(arm, HERE, replace(HERE, u_deg=turn_deg))[3] == turn_deg
    assert moved_by(arm, replace(HERE, u_deg=170), replace(HERE, u_deg=-170))[3] == 20


def test_power_low_holds_speed_and_accel_to_their_defaults():
    turn = way(replace(HERE, u_deg=90))
    slow, usual = epson().move_s(turn), epson().move_s(replace(turn, profile=MotionProfile()))
    fast = replace(turn, profile=MotionProfile(Path.JOINT, 80))
    assert slow == usual == epson().move_s(fast) == epson(accel=(100, 100)).move_s(fast)
    assert epson().move_s(replace(turn, profile=MotionProfile(Path.JOINT, 1))) > 4 * slow
    assert slow == pytest.approx(90 / (0.05 * 2828.572) + 0.5 * 2828.572 / 38844.53)


def test_in_power_low_the_tip_keeps_below_250_mm_s():
    sweep = replace(HERE, x_mm=-400, y_mm=250)
    assert epson().move_s(way(sweep, length_mm=800)) >= 800 / 250


def test_speed_factor_slows_everything_down():
    turn, line = way(replace(HERE, u_deg=90)), way(HERE, MOVE, length_mm=40)
    for one in (turn, line):
        usual_s, slow_s = seconds(epson(), one), seconds(epson(factor=50), one)
        assert 1.5 * usual_s < slow_s <= 2 * usual_s


def test_a_straight_way_takes_its_speed_and_its_ramps():
    assert epson().move_s(way(HERE, MOVE, length_mm=100)) == pytest.approx(2 + 0.25)
    assert epson().search_s(way(HERE, MOVE, length_mm=100)) == pytest.approx(2 + 0.25)
    assert ramped_s(2, 50, 200, 200) == pytest.approx(2 * (2 / 200) ** 0.5)
    # The model is not needed for that.
    assert epson("N2-A450S").move_s(way(HERE, MOVE, length_mm=100)) is not None
    assert epson("N2-A450S").move_s(way(replace(HERE, u_deg=9))) is None


def test_a_turn_alone_on_a_straight_path_goes_by_speeds_that_nobody_read():
    assert epson().move_s(way(HERE, MOVE, turn_deg=20)) is None
    assert SoftMotionTimes("Kin_Gantry3", None).move_s(way(HERE, MOVE, turn_deg=20)) is None


def test_a_plc_needs_its_kinematics_and_its_axes_for_a_direct_movement():
    axes = JointRates((500,) * 3, (5000,) * 3)
    there = way(replace(HERE, x_mm=410))
    assert SoftMotionTimes("Kin_Gantry3", None).move_s(there) is None
    assert SoftMotionTimes("Kin_Tripod_Rotary", axes).move_s(there) is None
    assert SoftMotionTimes("Kin_5Axes", axes).move_s(there) is None  # of another number of axes
    assert SoftMotionTimes("Kin_Gantry3", axes).move_s(there) == pytest.approx(0.5, abs=0.04)


def test_each_axis_of_a_plc_moves_by_its_own_coordinate():
    turned = way(replace(HERE, x_mm=405, u_deg=60, v_deg=-10))
    for kinematics, speeds, slowest_s in (
        ("Kin_Gantry3", (500, 500, 500), 5 / 25),
        ("Kin_Gantry3+Kin_CAxis", (500, 500, 500, 720), 60 / 36),
        ("Kin_5Axes", (500, 500, 500, 7200, 36), 10 / 1.8),
    ):
        times = SoftMotionTimes(kinematics, JointRates(speeds, (1e6,) * len(speeds)))
        assert seconds(times, turned) == pytest.approx(slowest_s, abs=0.05)


def test_a_stated_acceleration_makes_a_plc_slower():
    line, plc = way(HERE, MOVE, length_mm=30), SoftMotionTimes("Kin_Gantry3", None)
    assert seconds(replace(plc, acceleration_mm_s2=50), line) > seconds(plc, line)
    # What an edge stops may not brake less.
    searched_s = plc.search_s(line)
    assert searched_s is not None
    assert searched_s < seconds(plc, line)


def test_joints_that_do_not_move_take_no_time():
    assert RATES.takes_s((0, 0, 0, 0), 0.05, 0.1) == 0
    assert RATES.takes_s((1, 2), 0.05, 0.1) is None
