"""Jogging and single axes of a simulated axis group (docs/reference/softmotion.md 5)."""

from dataclasses import dataclass
from itertools import pairwise
from math import atan2, degrees, hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
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
    AxisState,
    CoordRef,
    CoordSystem,
    Dynamics,
    ErrorKind,
    JogCommand,
    SmcGroupState,
)
from robolink_simulators.softmotion.group.profile import Pace, SpeedProfile
from robolink_simulators.softmotion.kinematics.kinematics import ANY_CONFIGURATION

from robolink.model import AxisKind, OrientationSpace
from tests._rows import each_row
from tests.unit._softmotion_machine import (
    CYCLE_NS,
    LINE,
    NOZZLE,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
    state_of,
)

# Jogging of a simulated axis group; numbers are those of docs/reference/softmotion.md 5.

SLOW = Dynamics(20.0, 200.0, 200.0, 1000.0)
TENTH = Dynamics(0.1, 0.1, 0.1, 0.1)
STILL = JogCommand(0, 0, CoordSystem.MCS, SLOW)
STILL_AXES = JogCommand(0, 0, CoordSystem.ACS, TENTH)
FORWARD_X = JogCommand(1, 0, CoordSystem.MCS, SLOW)


@dataclass(frozen=True, slots=True)
class SixAxes:
    """A machine with every orientation: X, Y, Z and turns about x, y', z''."""

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


@each_row(("bit", "axis"), [(3, X_AXIS), (4, Y_AXIS), (5, Z_AXIS)])
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


@each_row(
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


# Axes of a group that move alone; numbers are those of docs/reference/softmotion.md 5.


def test_a_single_axis_may_move_in_standby_and_ends_a_group_movement_in_error():
    """Behaviour 14."""
    group = standing()
    single = group.move_axis(2, 40.0)
    assert state_of(group) is SmcGroupState.STANDBY
    assert group.axes[2].state is AxisState.DISCRETE_MOTION
    settled(group)
    assert single.outputs.done
    assert group.values[2] == 40.0
    assert state_of(group) is SmcGroupState.STANDBY
    move = moved(group, x_mm=-20)
    passing(group, 0.1)
    assert kind(group.move_axis(2, 0.0)) is ErrorKind.INTERRUPTED_BY_SINGLE_AXIS
    assert state_of(group) is SmcGroupState.ERROR_STOP
    error = group.status().error
    assert error.symbol == "SMC_AXIS_GROUP_INTERRUPTED_BY_SINGLE_AXIS"
    assert error.number == 0
    assert move.outputs.aborted


def test_a_group_movement_while_an_axis_moves_alone_is_a_group_error():
    group = standing()
    single = group.move_axis(2, 40.0)
    passing(group, 0.01)
    move = group.move_linear_absolute(shifted(group, x_mm=-20), LINE)
    assert kind(move) is ErrorKind.INTERRUPTED_BY_SINGLE_AXIS
    assert state_of(group) is SmcGroupState.ERROR_STOP
    assert single.outputs.aborted
    settled(group)
    assert group.values[2] < 40.0


def test_a_disabled_group_lets_its_axes_move_alone():
    group = standing()
    group.disable()
    single = group.move_axis(0, 50.0)
    settled(group)
    assert single.outputs.done
    assert state_of(group) is SmcGroupState.DISABLED


@each_row(
    ("prepare", "expected"),
    [
        (lambda group: group.power(on=False), ErrorKind.NO_POWER),
        (lambda group: group.stop(), ErrorKind.WRONG_STATE),
        (lambda group: group.fail_axis(0), ErrorKind.WRONG_STATE),
        (lambda group: None, ErrorKind.AXIS_LIMIT),
    ],
)
def test_a_single_axis_refuses_what_it_cannot_do(prepare, expected):
    group = standing()
    prepare(group)
    assert kind(group.move_axis(0, 1000.0)) is expected


def test_what_stops_an_axis_aborts_its_single_movement():
    group = standing()
    single = group.move_axis(2, 40.0)
    group.power(on=False)
    assert single.outputs.aborted
    group.disable()
    group.power(on=True)
    failing, going = group.move_axis(2, 40.0), group.move_axis(0, 20.0)
    group.fail_axis(2)
    assert failing.outputs.aborted
    settled(group)
    assert going.outputs.done


@pytest.mark.parametrize("number", [-1, 4])
def test_there_is_no_other_axis_than_those_of_the_group(number):
    assert kind(standing().move_axis(number, 0.0)) is ErrorKind.PARAMETER


def test_a_second_single_movement_of_an_axis_aborts_the_first():
    group = standing()
    first, second = group.move_axis(2, 40.0), group.move_axis(2, -40.0)
    assert first.outputs.aborted
    settled(group)
    assert second.outputs.done
    assert group.values[2] == -40.0


rates = st.floats(1e-3, 1e3)
paces = st.builds(Pace, rates, rates, rates)


def samples(profile, count=60):
    return [profile.share_at(profile.duration_s * step / count) for step in range(count + 1)]


@settings(max_examples=40, deadline=None)
@given(paces, st.floats(0, 0.99))
def test_a_profile_goes_from_its_start_to_the_end_within_its_limits(pace, start):
    profile = SpeedProfile.fastest(start, pace)
    shares = samples(profile)
    assert shares[0] == pytest.approx(start)
    assert profile.share_at(profile.duration_s) == 1
    assert all(b >= a - 1e-9 for a, b in pairwise(shares))
    step_s = profile.duration_s / 60
    assert all(b - a <= pace.rate_per_s * step_s * (1 + 1e-6) + 1e-9 for a, b in pairwise(shares))
    assert profile.rate_at(profile.falls_after_s) <= pace.rate_per_s * (1 + 1e-9)


@settings(max_examples=40, deadline=None)
@given(paces, st.floats(0.001, 0.999), rates)
def test_a_braked_profile_keeps_its_past_and_comes_to_rest_on_the_path(pace, part, fall):
    profile = SpeedProfile.fastest(0.0, pace)
    at_s = profile.duration_s * part
    braked = profile.braked(at_s, fall)
    assert braked.share_at(at_s / 2) == pytest.approx(profile.share_at(at_s / 2), abs=1e-9)
    assert braked.share_at(at_s) == pytest.approx(profile.share_at(at_s), abs=1e-9)
    assert braked.rate_at(at_s) == pytest.approx(profile.rate_at(at_s), rel=1e-6, abs=1e-9)
    assert profile.share_at(at_s) - 1e-9 <= braked.end <= 1
    just_before_s = braked.duration_s * (1 - 1e-9)
    assert braked.share_at(just_before_s) == pytest.approx(braked.end, abs=1e-6)
    assert braked.rate_at(braked.duration_s) == 0


def test_braking_twice_keeps_the_harder_end():
    profile = SpeedProfile.fastest(0.0, Pace(1.0, 10.0, 10.0)).braked(0.5, 5.0)
    again = profile.braked(0.55, 10.0)
    assert again.end < profile.end
    assert again.duration_s < profile.duration_s


def test_braking_after_the_end_changes_nothing():
    profile = SpeedProfile.fastest(0.0, Pace(1.0, 10.0, 10.0))
    assert profile.braked(profile.duration_s, 1.0) is profile


def test_braking_before_anything_moves_stays_where_it_is():
    braked = SpeedProfile.fastest(0.25, Pace(1.0, 10.0, 10.0)).braked(0.0, 1.0)
    assert (braked.end, braked.duration_s) == (0.25, 0)


def test_without_a_way_to_go_it_has_arrived():
    profile = SpeedProfile.fastest(0.0, None)
    assert (profile.end, profile.duration_s, profile.share_at(0)) == (1.0, 0, 1.0)
