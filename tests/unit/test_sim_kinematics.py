import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.epson.arm.kinematics import (
    flange_of,
    forward,
    hand_of,
    inverse,
    solve,
    tip_of,
)
from robolink_simulators.epson.arm.robots import (
    Evidence,
    Joints,
    Mechanism,
    check_ranges,
    find_robot,
    robots,
)
from robolink_simulators.epson.condition import OutOfReach

from robolink.errors import ConfigError
from robolink.model import Hand, Pose, ToolOffset

T6 = find_robot("T6-602S")
SCARAS = [model for model in robots() if model.mechanism is Mechanism.SCARA]


@st.composite
def placements(draw):
    model = draw(st.sampled_from(SCARAS))
    # J2 = 0 is the singular stretched arm, where both hands are one. Curved arms bend farther to
    # one side, and some bend less far deep down.
    most_deg = 180.0 if model.narrow_below is None else model.narrow_below[1]
    side = draw(st.sampled_from((-1, 1)))
    widest_deg = -model.ranges[1].low if side < 0 else model.ranges[1].high
    j2 = side * draw(st.floats(0.5, min(most_deg, widest_deg)))
    j1, j3, j4 = (draw(st.floats(*model.ranges[joint])) for joint in (0, 2, 3))
    return model, Joints(j1, j2, j3, j4)


offsets = st.builds(
    ToolOffset, *(st.floats(-200, 200),) * 3, st.floats(-360, 360), st.just(0.0), st.just(0.0)
)


@settings(max_examples=200, deadline=None)
@given(placements())
def test_the_inverse_finds_the_joints_that_the_forward_kinematics_came_from(placement):
    model, joints = placement
    found = inverse(model, forward(model, joints), hand_of(model, joints))
    assert found == pytest.approx(joints, abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(placements(), st.sampled_from(Hand))
def test_both_hands_bring_the_flange_to_the_same_pose(placement, hand):
    model, joints = placement
    pose = forward(model, joints)
    found = solve(model, pose, hand)
    assert hand_of(model, found) is hand
    assert forward(model, found).coordinates() == pytest.approx(pose.coordinates(), abs=1e-6)


@settings(max_examples=100, deadline=None)
@given(placements(), offsets)
def test_the_flange_is_found_again_from_the_tip(placement, offset):
    model, joints = placement
    flange = forward(model, joints)
    back = flange_of(model, tip_of(model, flange, offset, tool=3), offset)
    assert back.coordinates() == pytest.approx(flange.coordinates(), abs=1e-9)
    assert back.tool == 0


def test_with_all_joints_at_zero_the_arm_lies_along_x_and_u_is_zero():
    pose = forward(T6, Joints(0, 0, 0, 0))
    assert pose.coordinates() == (600.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_positive_joint_1_turns_counter_clockwise():
    pose = forward(T6, Joints(90, 0, -5, 0))
    assert pose.coordinates()[:4] == pytest.approx((0.0, 600.0, -5.0, 90.0))


def test_a_righty_arm_has_a_positive_joint_2():
    assert solve(T6, Pose(400, 0, 0, 0), Hand.RIGHT)[1] > 0
    assert solve(T6, Pose(400, 0, 0, 0), Hand.LEFT)[1] < 0


def test_u_is_taken_literally_so_270_and_minus_90_are_different_joint_values():
    far = inverse(T6, Pose(400, 100, 0, 270), Hand.RIGHT)
    near = inverse(T6, Pose(400, 100, 0, -90), Hand.RIGHT)
    assert far[3] - near[3] == pytest.approx(360)


def test_the_tip_turns_with_the_flange_and_adds_its_own_angle():
    tip = tip_of(T6, Pose(100, 0, -10, 90), ToolOffset(10, 0, -5, 30), tool=1)
    assert tip.coordinates()[:4] == pytest.approx((100, 10, -15, 120))
    assert tip.tool == 1


@pytest.mark.parametrize("x_mm", [600.01, 1e200, float("nan"), 0.0])
def test_a_position_that_the_links_cannot_span_is_out_of_reach(x_mm):
    with pytest.raises(OutOfReach, match="reach"):
        solve(T6, Pose(x_mm, 0, 0, 0), Hand.RIGHT)


@pytest.mark.parametrize(
    ("joints", "joint"),
    [
        (Joints(-42.1, 0, 0, 0), 1),
        (Joints(0, 150.1, 0, 0), 2),
        (Joints(0, 0, 0.1, 0), 3),
        (Joints(0, 0, 0, -360.1), 4),
    ],
)
def test_a_joint_outside_its_range_is_named(joints, joint):
    with pytest.raises(OutOfReach, match=f"Joint {joint}"):
        check_ranges(T6, joints)


def test_a_robot_is_found_in_any_case():
    assert find_robot("gx4-c251s").lengths_mm == (120, 130)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("C8-901S", "Is C8-C901S meant?"),
        ("gx4-c351m", "Is GX4-C351"),
        ("zzz", "C12-C1401C, "),
        ("C8-C901SW", "Choose C8-C901S, on a table"),
    ],
)
def test_an_unknown_robot_is_refused_with_the_likeliest_name_or_all(name, says):
    with pytest.raises(ConfigError) as refused:
        find_robot(name)
    assert says in str(refused.value.remedy)


def test_every_row_says_where_it_comes_from():
    assert all(model.source for model in robots())
    second_hand = {m.name for m in robots() if m.evidence is Evidence.SECOND_HAND}
    assert {name[0] for name in second_hand} <= set("TLGCV")
    assert len(robots()) - len(second_hand) == 64


def test_the_pulse_ranges_of_the_t_series_are_those_of_the_data_sheet():
    # docs/reference/epson.md 4: T3-B J1 -95574..505174, J2 +-320854; T6-B J1 -152918..808278, J2
    # +-341334.
    for name, j1, j2 in (
        ("T3-401S", (-95574, 505174), 320854),
        ("T6-602S", (-152918, 808278), 341334),
    ):
        model = find_robot(name)
        ends = [end * model.pulses_per_unit[0] for end in model.ranges[0]]
        assert ends == pytest.approx(j1, abs=1.5)
        assert model.ranges[1].high * model.pulses_per_unit[1] == pytest.approx(j2, abs=1.5)
