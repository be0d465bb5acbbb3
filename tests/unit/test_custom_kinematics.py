"""Kinematics of one's own: what is known of a flange, and classes that are loaded by name."""

import sys
from math import atan2, degrees
from pathlib import Path

import pytest
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
from robolink_simulators.softmotion import BlockRefused, ErrorKind, machine_named
from robolink_simulators.softmotion.kinematics.kinematics import ANY_CONFIGURATION

from robolink.errors import ConfigError
from robolink.model import (
    AxisKind,
    CsTool,
    NotReachable,
    OrientationDof,
    OrientationImage,
    OrientationSpace,
    combined_space,
)
from tests.unit._softmotion_rows import image_of

HERE = __name__
EXAMPLE = "double_scara:DoubleScara"
DIRECTED = OrientationSpace(OrientationDof.ONE)


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "examples" / "kinematics")
    yield EXAMPLE
    sys.modules.pop("double_scara", None)


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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
    """A rail whose flange leans with its only turn, about X."""

    kinds = (AxisKind.LINEAR, AxisKind.ROTARY)

    def axes_to_cartesian(self, axes):
        return (axes[0], 0.0, 0.0), about(X_AXIS, axes[1])

    def cartesian_to_axes(self, flange, near):
        return (flange[0][0], near[1])


class BoastingRail(Rail):
    """It says that its flange never turns: any tool would be accepted, and be elsewhere."""

    def get_flange_orientation_image(self, r_flange):
        return OrientationSpace.known(NO_TURN)


class MissingRail(Rail):
    """Its inverse is a tenth of a millimetre off."""

    def get_flange_orientation_image(self, r_flange):
        return OrientationSpace.directed(X_AXIS, X_AXIS)

    def cartesian_to_axes(self, flange, near):
        return (flange[0][0] + 0.1, near[1])


class Empty:
    """Nothing at all."""


class Head:
    """A head of one's own: one axis about Z, a nozzle 40 mm aside of it."""

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


@pytest.mark.parametrize(
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
