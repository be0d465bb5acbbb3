"""Kinematics of simulated arms, and user-defined kinematics."""

import sys
from math import atan2, degrees
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.cell.frames import (
    NO_TURN,
    X_AXIS,
    Z_AXIS,
    Frame,
    about,
    product,
    turned,
    zyz,
)
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
from robolink_simulators.softmotion import BlockRefused, ErrorKind, machine_named
from robolink_simulators.softmotion.kinematics.kinematics import ANY_CONFIGURATION

from robolink.errors import ConfigError
from robolink.model import (
    AxisKind,
    CsTool,
    Hand,
    NotReachable,
    OrientationDof,
    OrientationImage,
    OrientationSpace,
    Pose,
    ToolOffset,
    combined_space,
)
from tests._rows import each_row
from tests.unit._softmotion_rows import image_of

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


@settings(max_examples=80, deadline=None)
@given(placements())
def test_the_inverse_finds_the_joints_that_the_forward_kinematics_came_from(placement):
    model, joints = placement
    found = inverse(model, forward(model, joints), hand_of(model, joints))
    assert found == pytest.approx(joints, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(placements(), st.sampled_from(Hand))
def test_both_hands_bring_the_flange_to_the_same_pose(placement, hand):
    model, joints = placement
    pose = forward(model, joints)
    found = solve(model, pose, hand)
    assert hand_of(model, found) is hand
    assert forward(model, found).coordinates() == pytest.approx(pose.coordinates(), abs=1e-6)


@settings(max_examples=40, deadline=None)
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


@each_row("x_mm", [600.01, 1e200, float("nan"), 0.0])
def test_a_position_that_the_links_cannot_span_is_out_of_reach(x_mm):
    with pytest.raises(OutOfReach, match="reach"):
        solve(T6, Pose(x_mm, 0, 0, 0), Hand.RIGHT)


@each_row(
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


@each_row(
    ("name", "says"),
    [
        ("C8-901S", "Did you mean C8-C901S,"),
        ("gx4-c351m", "Did you mean GX4-C351"),
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


# User-defined kinematics: the known part of a flange, and classes loaded by name.

HERE = __name__
EXAMPLE = "double_scara:DoubleScara"
DIRECTED = OrientationSpace(OrientationDof.ONE)


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "examples" / "kinematics")
    yield EXAMPLE
    sys.modules.pop("double_scara", None)


@each_row(
    ("space", "shift_mm", "impossible_mm"),
    [
        (OrientationSpace.known(NO_TURN), (1, 2, 3), (0, 0, 0)),
        (DIRECTED, (0, 0, 3), (0, 0, 0)),
        (DIRECTED, (0, 0, -3), (0, 0, 0)),
        (DIRECTED, (0, 0, 0), (0, 0, 0)),
        (DIRECTED, (1, 0, 3), (1, 0, 0)),
        (DIRECTED, (0, 0.001, 0), (0, 0.001, 0)),
        (OrientationSpace.unknown(), (0, 0, 0), (0, 0, 0)),
        (OrientationSpace.unknown(), (0, 0, 1), (0, 0, 1)),
        (OrientationSpace.directed((0.6, 0.8, 0.0), (0.6, 0.8, 0.0)), (6, 8, 0), (0, 0, 0)),
        (OrientationSpace.directed((0.6, 0.8, 0.0), (0.6, 0.8, 0.0)), (10, 0, 2), (6.4, -4.8, 2)),
    ],
)
def test_a_shift_fits_when_it_does_not_depend_on_what_is_unknown(space, shift_mm, impossible_mm):
    assert space.impossible(shift_mm) == pytest.approx(impossible_mm)
    assert space.accepts(shift_mm) is not any(impossible_mm)


def test_an_orientation_is_projected_by_the_smallest_turn():
    wanted = zyz(20, 50, 30)
    space = OrientationSpace.directed(Z_AXIS, X_AXIS, wanted)
    assert space.holds(space.m_ori_zero)
    assert turned(space.m_ori_zero, Z_AXIS) == pytest.approx(X_AXIS)
    with pytest.raises(NotReachable):
        OrientationSpace.directed(Z_AXIS, (0.0, 0.0, -1.0), NO_TURN)


@each_row(
    "broken",
    [
        {"dof": OrientationDof.ZERO, "m_ori_zero": ((1.0, 0.0, 0.0),) * 3},
        {"dof": OrientationDof.ONE, "v_u": (0.0, 0.0, 2.0)},
        {"dof": OrientationDof.ONE, "v_rot": (1.0, 0.0, 0.0)},
        {"dof": OrientationDof.ONE, "v_u": (float("nan"), 0.0, 0.0)},
    ],
)
def test_a_space_that_contradicts_itself_is_none(broken):
    with pytest.raises(ValueError, match=r"m_ori_zero|unit vector"):
        OrientationSpace(**broken)


TILTED = about(X_AXIS, 90)
TILTED_BASE = OrientationSpace.known(TILTED)
FREE = OrientationSpace.unknown()
C_AXIS = OrientationImage(CsTool.FLANGE, DIRECTED, b_active=True)
LEFT_OVER = OrientationImage(CsTool.FLANGE, DIRECTED, b_active=False)
FIXED = OrientationImage(CsTool.FLANGE, OrientationSpace.known(TILTED), b_active=True)
ANY_TURN = OrientationImage(CsTool.FLANGE, FREE, b_active=True)
SAID = OrientationImage(CsTool.MCS, OrientationSpace.known(TILTED), b_active=False)


@each_row(
    ("base", "image", "dof"),
    [
        (TILTED_BASE, C_AXIS, 0),
        (TILTED_BASE, LEFT_OVER, 1),
        (TILTED_BASE, FIXED, 0),
        (DIRECTED, C_AXIS, 0),
        (DIRECTED, LEFT_OVER, 1),
        # The drive of the fixed part cannot make up for what the arms leave open.
        (DIRECTED, FIXED, 1),
        (FREE, C_AXIS, 3),
        (FREE, FIXED, 3),
        (FREE, ANY_TURN, 0),
        (FREE, SAID, 0),
        # A turn about X on arms that turn about Z leaves no direction known.
        (
            DIRECTED,
            OrientationImage(
                CsTool.FLANGE,
                OrientationSpace(OrientationDof.ONE, v_u=X_AXIS, v_rot=X_AXIS),
                b_active=True,
            ),
            3,
        ),
    ],
)
def test_what_is_known_of_a_coupling_follows_from_its_parts(base, image, dof):
    assert combined_space(base, image, TILTED).dof.value == dof


def test_a_fixed_part_turns_the_direction_that_is_known_with_it():
    space = combined_space(DIRECTED, FIXED, NO_TURN)
    for turn_deg in (0.0, 70.0):
        assert space.holds(product(about(Z_AXIS, turn_deg), TILTED))
    assert not space.holds(NO_TURN)


def test_the_example_is_a_machine_alone_and_with_a_c_axis(example):
    alone = machine_named(example)
    image = image_of(alone.kinematics)
    assert image.impossible((1.0, 2.0, 3.0)) == pytest.approx((1.0, 2.0, 0.0))
    assert alone.limits[0].low == 100.0
    coupled = machine_named(f"{example}+Kin_CAxis", {"inner": 210.0, "dOffsetC": 30.0})
    assert image_of(coupled.kinematics).accepts((1.0, 2.0, 3.0))
    assert coupled.kinematics.name == f"{example}+Kin_CAxis"
    with pytest.raises(BlockRefused) as refused:
        alone.kinematics.axes_for(Frame((900.0, 0.0, 0.0)), ANY_CONFIGURATION, (0.0,) * 3)
    assert refused.value.kind is ErrorKind.UNREACHABLE


class Rail:
    """A rail whose flange tilts with its only turn, about X."""

    kinds = (AxisKind.LINEAR, AxisKind.ROTARY)

    def axes_to_cartesian(self, axes):
        return (axes[0], 0.0, 0.0), about(X_AXIS, axes[1])

    def cartesian_to_axes(self, flange, near):
        return (flange[0][0], near[1])


class BoastingRail(Rail):
    """It claims that its flange never turns: any tool would be accepted, and be elsewhere."""

    def get_flange_orientation_image(self, r_flange):
        return OrientationSpace.known(NO_TURN)


class MissingRail(Rail):
    """A rail with an inverse that is a tenth of a millimetre off."""

    def get_flange_orientation_image(self, r_flange):
        return OrientationSpace.directed(X_AXIS, X_AXIS)

    def cartesian_to_axes(self, flange, near):
        return (flange[0][0] + 0.1, near[1])


class Empty:
    """A class without members."""


class Head:
    """A user-defined head: one axis about Z, with a nozzle 40 mm beside it."""

    kinds = (AxisKind.ROTARY,)

    def axes_to_cartesian(self, axes):
        turn = about(Z_AXIS, axes[0])
        return turned(turn, (40.0, 0.0, 0.0)), turn

    def cartesian_to_axes(self, flange, near):
        turn = flange[1]
        return (degrees(atan2(turn[1][0], turn[0][0])),)

    def get_orientation_image_2(self, r_flange, base):
        return C_AXIS

    def get_position_from_orientation(self, flange, base):
        (x, y, z), turn = flange
        dx, dy, dz = turned(turn, (40.0, 0.0, 0.0))
        return (x - dx, y - dy, z - dz)


def test_a_head_of_one_s_own_is_coupled_to_a_kinematics_of_the_library():
    machine = machine_named(f"Kin_Gantry3+{HERE}:Head")
    flange = machine.kinematics.flange((1.0, 2.0, 3.0, 90.0))
    assert flange.shift_mm == pytest.approx((1.0, 42.0, 3.0))
    found = machine.kinematics.axes_for(flange, machine.kinematics.configuration(()), (0.0,) * 4)
    assert found == pytest.approx((1.0, 2.0, 3.0, 90.0))


def test_a_class_without_an_orientation_image_moves_and_takes_no_tool():
    assert machine_named(f"{HERE}:Rail").kinematics.orientation_image(NO_TURN) is None


@each_row(
    ("name", "says"),
    [
        (f"{HERE}:BoastingRail", "does not hold the flange"),
        (f"{HERE}:MissingRail", "bring it elsewhere"),
        (f"{HERE}:NoSuchClass", "There is no class"),
        ("no_such_module:Rail", "There is no class"),
        (f"{HERE}:EXAMPLE", "is not a class"),
        (f"{HERE}:OrientationDof", "cannot be made"),
        (f"{HERE}:OrientationSpace", "cannot be made"),
        (f"{HERE}:Empty", "lacks methods"),
        (f"Kin_Gantry3+{HERE}:Rail", "ISMOrientationKinematicsWithOriImage2"),
    ],
)
def test_a_class_that_is_no_kinematics_or_says_what_is_not_so_is_refused(name, says):
    with pytest.raises(ConfigError, match=says) as refused:
        machine_named(name)
    assert refused.value.remedy
