"""Jogging of a simulated axis group; numbers are those of docs/reference/softmotion.md 5."""

from dataclasses import dataclass
from itertools import pairwise
from math import atan2, degrees, hypot

import pytest
from robolink_simulators.cell.frames import (
    NO_TURN,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    Frame,
    about,
    axis_and_angle,
    product,
)
from robolink_simulators.softmotion import (
    AxisGroup,
    CoordRef,
    CoordSystem,
    Dynamics,
    ErrorKind,
    JogCommand,
    SmcGroupState,
)
from robolink_simulators.softmotion.kinematics.kinematics import ANY_CONFIGURATION

from robolink.model import AxisKind, OrientationSpace
from tests.unit._softmotion_machine import (
    CYCLE_NS,
    LINE,
    NOZZLE,
    kind,
    moved,
    passing,
    settled,
    standing,
)

SLOW = Dynamics(20.0, 200.0, 200.0, 1000.0)
TENTH = Dynamics(0.1, 0.1, 0.1, 0.1)
STILL = JogCommand(0, 0, CoordSystem.MCS, SLOW)
STILL_AXES = JogCommand(0, 0, CoordSystem.ACS, TENTH)
FORWARD_X = JogCommand(1, 0, CoordSystem.MCS, SLOW)


@dataclass(frozen=True, slots=True)
class SixAxes:
    """A machine that takes up every orientation: X, Y, Z and turns about x, y', z''."""

    name = "custom"
    kinds = (AxisKind.LINEAR,) * 3 + (AxisKind.ROTARY,) * 3

    def flange(self, axes):
        turn = product(about(X_AXIS, axes[3]), about(Y_AXIS, axes[4]))
        return Frame(axes[:3], product(turn, about(Z_AXIS, axes[5])))

    def configuration(self, axes):
        return ANY_CONFIGURATION

    def axes_for(self, flange, configuration, near):
        r = flange.rotation
        turns = atan2(-r[1][2], r[2][2]), atan2(r[0][2], hypot(r[0][0], r[0][1]))
        return (*flange.shift_mm, *map(degrees, (*turns, atan2(-r[0][1], r[0][0]))))

    def orientation_image(self, wanted):
        return OrientationSpace.known(wanted)


def six_axes():
    group = AxisGroup(SixAxes())
    group.power(on=True)
    group.enable()
    return group


@pytest.mark.parametrize(("bit", "axis"), [(3, X_AXIS), (4, Y_AXIS), (5, Z_AXIS)])
def test_jogging_a_b_c_turns_about_the_axes_through_the_tip(bit, axis):
    """Behaviour 15."""
    group = six_axes()
    group.set_tool(CoordRef(10, 20, 30))
    before = group.tcp()
    assert before.rotation == NO_TURN
    group.jog(JogCommand(1 << bit, 0, CoordSystem.MCS, TENTH))
    passing(group, 0.5)
    turned_about, angle_deg = axis_and_angle(group.tcp().rotation)
    assert turned_about == pytest.approx(axis, abs=1e-9)
    assert 5 < angle_deg < 20
    assert group.tcp().shift_mm == pytest.approx(before.shift_mm, abs=1e-9)


def test_both_buttons_at_once_move_nothing():
    """Behaviour 15."""
    group = six_axes()
    both = group.jog(JogCommand(0b1001, 0b1001, CoordSystem.MCS, TENTH))
    assert both.outputs.done
    assert group.next_change() is None
    assert group.values == (0.0,) * 6


def test_the_second_button_ends_a_jog():
    """Behaviour 15: a rising edge that makes both true counts as a falling one."""
    group = standing()
    jog = group.jog(FORWARD_X)
    passing(group, 0.5)
    assert jog.outputs.active
    group.jog(JogCommand(1, 1, CoordSystem.MCS, SLOW))
    settled(group)
    assert jog.outputs.done
    assert group.state is SmcGroupState.STANDBY


def test_turning_the_c_axis_keeps_the_tip_of_a_long_tool():
    group = standing()
    group.set_tool(NOZZLE)
    before = group.tcp()
    group.jog(JogCommand(1 << 5, 0, CoordSystem.MCS, TENTH))
    passing(group, 1.0)
    assert group.tcp().shift_mm == pytest.approx(before.shift_mm, abs=1e-9)
    assert group.values[2] != 15.0


def test_a_jog_speeds_up_runs_evenly_and_slows_down():
    group = standing(at=(30.0, 90.0, 15.0, 0.0))
    group.jog(JogCommand(0, 1, CoordSystem.MCS, SLOW))
    places = []
    for _ in range(150):
        group.advance(group.now_ns + CYCLE_NS)
        places.append(group.tcp().shift_mm)
    speeds = [(a[0] - b[0]) / 0.004 for a, b in pairwise(places)]
    assert speeds[-1] == pytest.approx(20.0)
    assert max(b - a for a, b in pairwise(speeds)) <= 200 * 0.004 + 1e-6
    assert all(place[1:] == pytest.approx(places[0][1:], abs=1e-9) for place in places)
    assert group.status().jogging
    group.jog(STILL)
    settled(group)
    assert 0.9 <= places[-1][0] - group.tcp().shift_mm[0] <= 1.1
    assert not group.status().jogging
    assert group.state is SmcGroupState.STANDBY


def test_in_acs_an_axis_is_jogged_by_factors_up_to_its_limit():
    group = standing()
    jog = group.jog(JogCommand(0b1000, 0b0001, CoordSystem.ACS, Dynamics(1, 1, 1, 1)))
    passing(group, 0.1)
    assert group.values[0] < 30
    assert group.values[3] > -20
    assert group.values[1:3] == (45.0, 15.0)
    passing(group, 2)
    assert group.values[0] == -170
    assert group.values[3] == 300
    assert group.state is SmcGroupState.MOVING
    group.jog(STILL_AXES)
    settled(group)
    assert jog.outputs.done


def test_in_tcs_the_tip_goes_along_its_own_axes():
    group = standing()
    before = group.tcp()
    group.jog(JogCommand(1, 0, CoordSystem.TCS, SLOW))
    passing(group, 0.5)
    moved_mm = (before.inverse() @ group.tcp()).shift_mm
    assert moved_mm[0] > 5
    assert moved_mm[1:] == pytest.approx((0, 0), abs=1e-9)


def test_a_jog_ends_where_the_workspace_ends():
    group = standing()
    jog = group.jog(FORWARD_X)
    passing(group, 60)
    assert kind(jog) is ErrorKind.UNREACHABLE
    assert group.state is SmcGroupState.STANDBY
    assert group.tcp().shift_mm[0] > 320


def test_a_jog_respects_the_velocity_of_the_axes():
    group = standing(at=(0.0, 150.0, 0.0, 0.0))
    group.jog(JogCommand(0, 1, CoordSystem.MCS, Dynamics(5000.0, 50000.0, 50000.0, 1.0)))
    places = [group.values]
    while group.status().jogging:
        group.advance(group.now_ns + CYCLE_NS)
        places.append(group.values)
    for n, axis in enumerate(group.axes):
        speeds = [abs(b[n] - a[n]) / 0.004 for a, b in pairwise(places)]
        assert max(speeds) <= axis.limits.velocity_per_s * 1.05


def test_a_jog_aborts_what_moves_and_begins_when_it_rests():
    group = standing()
    move = moved(group, x_mm=-60)
    passing(group, 0.3)
    jog = group.jog(JogCommand(1 << 2, 0, CoordSystem.MCS, SLOW))
    assert move.outputs.aborted
    assert jog.outputs.active
    passing(group, 1.0)
    assert group.tcp().shift_mm[2] > -15


def test_a_movement_ends_a_jog():
    group = standing()
    jog = group.jog(JogCommand(0, 1, CoordSystem.MCS, SLOW))
    passing(group, 0.5)
    move = moved(group, z_mm=5)
    assert jog.outputs.aborted
    assert not group.status().jogging
    settled(group)
    assert move.outputs.done


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        (JogCommand(1, 0, CoordSystem.ACS, LINE), ErrorKind.DYNAMICS),
        (JogCommand(1 << 5, 0, CoordSystem.MCS, LINE), ErrorKind.DYNAMICS),
        (JogCommand(1, 0, CoordSystem.MCS, Dynamics(0, 1, 1, 1)), ErrorKind.DYNAMICS),
        (JogCommand(1 << 4, 0, CoordSystem.ACS, TENTH), ErrorKind.PARAMETER),
    ],
)
def test_a_jog_that_makes_no_sense_is_refused(command, expected):
    group = standing()
    assert kind(group.jog(command)) is expected
    assert group.state is SmcGroupState.STANDBY
    assert not group.status().jogging


def test_the_coordinate_system_does_not_change_in_motion():
    group = standing()
    jog = group.jog(FORWARD_X)
    passing(group, 0.3)
    assert kind(group.jog(JogCommand(1, 0, CoordSystem.ACS, TENTH))) is ErrorKind.PARAMETER
    assert jog.outputs.active


def test_nothing_is_jogged_without_enabling():
    group = standing()
    group.disable()
    assert kind(group.jog(FORWARD_X)) is ErrorKind.WRONG_STATE
