"""Movements of a simulated axis group: straight, in axis space, one after another."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.cell.frames import Z_AXIS, turned
from robolink_simulators.softmotion import (
    AxisGroup,
    CoordRef,
    CoordSystem,
    Dynamics,
    ErrorKind,
    SmcBufferMode,
    SmcGroupState,
    Target,
    machine_named,
)
from robolink_simulators.softmotion.kinematics.kinematics import Configuration

from tests._rows import each_row
from tests.unit._softmotion_machine import (
    CYCLE_NS,
    FACTORS,
    LINE,
    MACHINES,
    NOZZLE,
    in_axes,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
    tcp_mm,
    way,
)

# Movements on a line and straight in axis space.


@pytest.mark.parametrize("name", MACHINES)
@settings(max_examples=8, deadline=None)
@given(data=st.data())
def test_a_direct_movement_arrives_and_keeps_every_limit_on_the_way(name, data):
    limits = machine_named(name).limits
    target = [data.draw(st.floats(limit.low, limit.high)) for limit in limits]
    group = standing(name, at=tuple((limit.low + limit.high) / 2 for limit in limits))
    move = group.move_direct_absolute(in_axes(*target), Dynamics(1, 1, 1, 1))
    places = way(group)
    assert move.outputs.done
    assert group.values == tuple(target)
    for n, limit in enumerate(limits):
        speeds = [abs(b[n] - a[n]) / 0.004 for a, b in pairwise(places)]
        assert max(speeds) <= limit.velocity_per_s * 1.001
        changes = [abs(b - a) / 0.004 for a, b in pairwise(speeds)]
        assert max(changes, default=0) <= limit.acceleration_per_s2 * 1.001


def test_half_the_factor_takes_longer():
    ends_ns = []
    for factor in (1.0, 0.5):
        group = standing()
        group.move_direct_absolute(in_axes(90, 45, 15, -20), Dynamics(factor, 1, 1, 1))
        settled(group)
        ends_ns.append(group.now_ns)
    assert ends_ns[0] < ends_ns[1]


def test_a_line_keeps_its_velocity():
    group = standing()
    moved(group, x_mm=-80, z_mm=20)
    places, steps = [tcp_mm(group)], []
    while group.next_change() is not None:
        group.advance(group.now_ns + CYCLE_NS)
        places.append(tcp_mm(group))
    steps = [math.dist(a, b) / 0.004 for a, b in pairwise(places)]
    assert max(steps) == pytest.approx(LINE.velocity, rel=1e-3)
    assert max(abs(b - a) for a, b in pairwise(steps)) <= LINE.acceleration * 0.004 * 1.01


def test_near_the_middle_of_the_arm_a_line_slows_down_for_the_axes():
    group = standing()
    group.move_direct_absolute(Target((120, 110, 0, 0, 0, 0)), FACTORS)
    settled(group)
    fast = Dynamics(2000.0, 20000.0, 20000.0, 1.0)
    assert group.move_linear_absolute(Target((-120, 110, 0, 0, 0, 0)), fast).outputs.busy
    top = [axis.limits.velocity_per_s for axis in group.axes]
    for a, b in pairwise(way(group)):
        speeds = [abs(after - before) / 0.004 for before, after in zip(a, b, strict=True)]
        assert all(speed <= limit * 1.02 for speed, limit in zip(speeds, top, strict=True))


@each_row("system", [CoordSystem.MCS, CoordSystem.WCS, CoordSystem.PCS_2])
@each_row("line", [True, False])
def test_a_target_counts_in_its_coordinate_system(system, line):
    group = standing()
    group.set_tool(NOZZLE)
    group.set_coordinate_transform(CoordSystem.MCS, CoordRef(50, 60, 70, 30))
    group.set_coordinate_transform(CoordSystem.PCS_2, CoordRef(200, 300, 10, -45))
    x, y, z, a, b, c = group.read_actual_position(system).values
    target = Target((x - 10, y + 5, z + 3, a, b, c + 15), system)
    command = group.move_linear_absolute if line else group.move_direct_absolute
    assert command(target, LINE if line else FACTORS).outputs.busy
    settled(group)
    seen = group.read_actual_position(system).values
    assert seen[:3] == pytest.approx(target.position[:3])
    assert math.remainder(seen[3] - (a + c + 15), 360) == pytest.approx(0, abs=1e-6)


def test_a_line_may_lead_to_axis_values():
    group = standing()
    move = group.move_linear_absolute(in_axes(40, 35, 10, -5), LINE)
    settled(group)
    assert move.outputs.done
    assert group.values == pytest.approx((40, 35, 10, -5))


def test_the_position_in_tcs_is_nothing_and_in_acs_the_axes():
    group = standing()
    assert group.read_actual_position(CoordSystem.TCS).values == pytest.approx((0,) * 6, abs=1e-9)
    position = group.read_actual_position(CoordSystem.ACS)
    assert position.values == (30.0, 45.0, 15.0, -20.0)
    assert position.configuration is None


def test_a_direct_movement_may_change_the_elbow_and_a_line_may_not():
    group = standing()
    left = Target(group.read_actual_position().values, configuration=Configuration(False))
    assert kind(group.move_linear_absolute(left, LINE)) is ErrorKind.CONFIGURATION
    assert kind(group.move_linear_absolute(in_axes(75, -45, 0, 0), LINE)) is ErrorKind.CONFIGURATION
    before = tcp_mm(group)
    assert group.move_direct_absolute(left, FACTORS).outputs.busy
    settled(group)
    assert group.values[1] == pytest.approx(-45)
    assert tcp_mm(group) == pytest.approx(before)


def test_a_direct_movement_takes_the_turn_that_the_axis_can_reach():
    group = standing("Kin_Gantry3+Kin_CAxis", at=(0.0, 0.0, 0.0, 300.0))
    assert group.move_direct_absolute(shifted(group, c_deg=90), FACTORS).outputs.busy
    settled(group)
    assert group.values[3] == pytest.approx(30)


@each_row(
    ("target", "expected"),
    [
        (Target((900, 0, 0, 0, 0, 0)), ErrorKind.UNREACHABLE),
        (Target((300, 200, 301, 0, 0, 0)), ErrorKind.AXIS_LIMIT),
        (Target((300, 200, math.nan, 0, 0, 0)), ErrorKind.PARAMETER),
        (Target((300, 200, 0)), ErrorKind.PARAMETER),
        (Target((300, 200, 0, 0, 180, 0)), ErrorKind.UNREACHABLE),
        (in_axes(200, 0, 0, 0), ErrorKind.AXIS_LIMIT),
        (in_axes(math.inf, 0, 0, 0), ErrorKind.PARAMETER),
    ],
)
@each_row("line", [True, False])
def test_a_target_out_of_reach_is_refused_and_nothing_moves(target, expected, line):
    group = standing()
    command = group.move_linear_absolute if line else group.move_direct_absolute
    assert kind(command(target, LINE if line else FACTORS)) is expected
    assert group.state is SmcGroupState.STANDBY
    assert group.movements_started == 0


def test_a_refused_movement_leaves_the_present_one_alone():
    group = standing()
    move = moved(group, x_mm=-40)
    passing(group, 0.1)
    assert kind(group.move_linear_absolute(shifted(group, x_mm=900), LINE)) is ErrorKind.UNREACHABLE
    settled(group)
    assert move.outputs.done


def test_a_line_whose_way_leaves_the_workspace_is_refused():
    group = standing(at=(0.0, 100.0, 0.0, 0.0))
    x, y, z, *angles = group.read_actual_position().values
    through_the_middle = Target((-x, -y, z, *angles))
    refused = group.move_linear_absolute(through_the_middle, LINE)
    assert kind(refused) in (ErrorKind.UNREACHABLE, ErrorKind.AXIS_LIMIT)


@each_row("bad", [0.0, -1.0, math.nan, math.inf, 1.6e-319, 1e-300, 9e-10])
@each_row("place", range(4))
def test_dynamics_must_be_finite_and_large_enough_to_arrive(bad, place):
    group = standing()
    values = [1.0] * 4
    values[place] = bad
    dynamics = Dynamics(*values)
    assert kind(group.move_linear_absolute(shifted(group, x_mm=-1), dynamics)) is ErrorKind.DYNAMICS
    assert kind(group.move_direct_absolute(in_axes(0, 0, 0, 0), dynamics)) is ErrorKind.DYNAMICS


@each_row("place", range(4))
def test_the_least_dynamics_make_a_movement_that_arrives(place):
    group = standing()
    values = [1.0] * 4
    values[place] = 1e-9
    move = group.move_linear_absolute(shifted(group, x_mm=-1), Dynamics(*values))
    passing(group, 1.0)
    assert not move.ended
    group.advance(group.next_change())
    assert move.outputs.done


def test_factors_of_a_direct_movement_end_at_one():
    refused = standing().move_direct_absolute(in_axes(0, 0, 0, 0), Dynamics(1.1, 1, 1, 1))
    assert kind(refused) is ErrorKind.DYNAMICS


def test_a_movement_to_where_the_group_stands_is_done_in_the_next_cycle():
    group = standing()
    move = moved(group)
    group.advance(CYCLE_NS)
    group.advance(2 * CYCLE_NS)
    assert move.outputs.done


def test_a_line_keeps_the_tip_of_its_tool_on_the_straight_way():
    group = standing()
    group.set_tool(NOZZLE)
    x, y, z, _, _, _ = group.read_actual_position().values
    moved(group, x_mm=-60, y_mm=30)
    while group.next_change() is not None:
        passing(group, 0.03)
        seen = group.read_actual_position().values
        share = (x - seen[0]) / 60
        assert seen[1] - y == pytest.approx(30 * share, abs=1e-6)
        assert seen[2] == pytest.approx(z, abs=1e-6)
    assert share == pytest.approx(1)


def test_turning_about_the_tip_leaves_the_tip_where_it_is():
    group = standing()
    group.set_tool(NOZZLE)
    before = group.read_actual_position().values
    move = group.move_linear_absolute(shifted(group, c_deg=90), LINE)
    while group.next_change() is not None:
        passing(group, 0.02)
        assert group.read_actual_position().values[:3] == pytest.approx(before[:3], abs=1e-6)
    assert move.outputs.done
    after = group.read_actual_position().values
    turn_deg = (after[3] + after[5]) - (before[3] + before[5])
    assert math.remainder(turn_deg - 90, 360) == pytest.approx(0, abs=1e-6)


def test_a_tilted_tool_tilts_what_tcs_means():
    group = standing()
    group.set_tool(CoordRef(0, 0, -10, 0, 90, 0))
    before = group.tcp()
    move = group.move_linear_absolute(Target((0, 0, 15, 0, 0, 0), CoordSystem.TCS), LINE)
    settled(group)
    assert move.outputs.done
    way_mm = [b - a for a, b in zip(before.shift_mm, group.tcp().shift_mm, strict=True)]
    assert way_mm == pytest.approx([15 * c for c in turned(before.rotation, Z_AXIS)], abs=1e-6)
    assert way_mm[2] == pytest.approx(0, abs=1e-6)


# Movements one after another: buffered, blended, aborting.

BLENDING = [mode for mode in SmcBufferMode if mode.blends]


def test_buffered_movements_run_one_after_another():
    group = standing()
    first = moved(group, x_mm=-20)
    second = moved(group, x_mm=-20, z_mm=10, mode=SmcBufferMode.BUFFERED)
    while not first.outputs.done:
        assert not second.outputs.active
        group.advance(group.next_change())
    start = tcp_mm(group)
    settled(group)
    assert second.outputs.done
    assert tcp_mm(group)[2] - start[2] == pytest.approx(10)


@each_row("mode", BLENDING)
@each_row("line", [True, False])
def test_a_blended_corner_is_smooth_and_the_second_movement_counts_as_active(mode, line):
    """The second is active from the start of the blend (docs/reference/softmotion.md 2.1)."""
    group = standing()
    corner = shifted(group, x_mm=-40) if line else in_axes(50, 30, 0, 0)
    end = shifted(group, x_mm=-40, z_mm=30) if line else in_axes(50, 60, 0, 40)
    command = group.move_linear_absolute if line else group.move_direct_absolute
    dynamics = LINE if line else FACTORS
    first, second = command(corner, dynamics), command(end, dynamics, mode=mode)
    places, together = [group.values], False
    while group.next_change() is not None:
        group.advance(group.now_ns + CYCLE_NS)
        places.append(group.values)
        if second.outputs.active and not first.outputs.done:
            together = True
            assert group.status().active_movement == 2
    assert together
    assert first.outputs.done
    assert second.outputs.done
    top = [axis.limits for axis in group.axes]
    for n, limit in enumerate(top):
        speeds = [(b[n] - a[n]) / 0.004 for a, b in pairwise(places)]
        jumps = [abs(b - a) for a, b in pairwise(speeds)]
        assert max(jumps) <= 2.1 * limit.acceleration_per_s2 * 0.004
    if line:
        assert tcp_mm(group) == pytest.approx(end.position[:3])


def test_blending_saves_time_and_never_reaches_the_corner():
    ends_ns, nearest_mm = {}, {}
    for mode in (SmcBufferMode.BUFFERED, SmcBufferMode.BLENDING_LOW):
        group = standing()
        x, y, z, *_ = group.read_actual_position().values
        corner = (x - 40, y, z)
        moved(group, x_mm=-40)
        moved(group, x_mm=-40, z_mm=40, mode=mode)
        nearest_mm[mode] = math.inf
        while group.next_change() is not None:
            passing(group, 0.001)
            nearest_mm[mode] = min(nearest_mm[mode], math.dist(tcp_mm(group), corner))
        ends_ns[mode] = group.now_ns
    assert ends_ns[SmcBufferMode.BLENDING_LOW] < ends_ns[SmcBufferMode.BUFFERED]
    assert nearest_mm[SmcBufferMode.BUFFERED] < 0.01
    assert nearest_mm[SmcBufferMode.BLENDING_LOW] > 1


def test_a_corner_that_leaves_the_workspace_is_a_group_error():
    model = machine_named("Kin_Polar_Z", {"a1_low": 200.0})
    group = AxisGroup(model.kinematics, model.limits)
    group.place((135.0, 300.0, 0.0))
    group.power(on=True)
    group.enable()
    gentle, brisk = LINE._replace(deceleration=50.0), LINE._replace(velocity=400.0)
    moves = [
        group.move_linear_absolute(Target((-210, 210, 0, 0, 0, 0)), LINE),
        group.move_linear_absolute(
            Target((210, 210, 0, 0, 0, 0)), gentle, mode=SmcBufferMode.BUFFERED
        ),
        group.move_linear_absolute(
            Target((210, -210, 0, 0, 0, 0)), brisk, mode=SmcBufferMode.BLENDING_HIGH
        ),
    ]
    settled(group)
    assert moves[0].outputs.done
    assert moves[1].outputs.aborted
    error = group.status().error
    assert error is not None
    assert error.kind is ErrorKind.AXIS_LIMIT


def test_a_line_after_a_direct_movement_does_not_blend():
    group = standing()
    first = group.move_direct_absolute(in_axes(50, 30, 0, 0), FACTORS)
    second = group.move_linear_absolute(
        in_axes(55, 30, 0, 0), LINE, mode=SmcBufferMode.BLENDING_NEXT
    )
    while not second.outputs.active:
        group.advance(group.next_change())
    assert first.outputs.done


def test_an_aborting_movement_takes_over_at_once_and_arrives():
    group = standing()
    first = moved(group, x_mm=-60)
    waiting = moved(group, x_mm=-70, mode=SmcBufferMode.BUFFERED)
    passing(group, 0.25)
    second = moved(group, z_mm=15)
    assert first.outputs.aborted
    assert waiting.outputs.aborted
    assert second.outputs.active
    places = way(group)
    assert second.outputs.done
    for n, axis in enumerate(group.axes):
        steps = [abs(b[n] - a[n]) / 0.004 for a, b in pairwise(places)]
        assert max(steps) <= axis.limits.velocity_per_s
