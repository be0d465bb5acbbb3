"""Movements one after another: buffered, blended, aborting."""

import math
from itertools import pairwise

import pytest
from robolink_simulators.softmotion import (
    AxisGroup,
    ErrorKind,
    SmcBufferMode,
    Target,
    machine_named,
)

from tests.unit._softmotion_machine import (
    CYCLE_NS,
    FACTORS,
    LINE,
    in_axes,
    moved,
    passing,
    settled,
    shifted,
    standing,
    tcp_mm,
    way,
)

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


@pytest.mark.parametrize("mode", BLENDING)
@pytest.mark.parametrize("line", [True, False])
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
