"""Movements until an input changes; inputs and outputs."""

import pytest
from robolink_simulators.softmotion import (
    BlockRefused,
    CoordSystem,
    EdgeWatch,
    ErrorKind,
    GroupOptions,
    SmcBufferMode,
    SmcGroupState,
    Target,
)

from tests.unit._softmotion_machine import (
    LINE,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
    tcp_mm,
)

DOWN = Target((0, 0, -30, 0, 0, 0), CoordSystem.TCS)


def plate_at(group, height_mm, number=3):
    group.inputs.connect(number, lambda axes: group.kinematics.flange(axes).shift_mm[2] < height_mm)
    return EdgeWatch(number)


def test_a_movement_until_an_input_stops_past_the_edge_and_tells_where_it_was():
    group = standing()
    watch = plate_at(group, -32.5)
    move = group.move_linear_absolute(DOWN, LINE, watch=watch)
    settled(group)
    assert move.outputs.done
    assert -32.5 - 0.4 <= -20 + move.latched.z_mm <= -32.5
    assert -50 < tcp_mm(group)[2] < -20 + move.latched.z_mm
    assert group.state is SmcGroupState.STANDBY


def test_a_drive_latches_at_the_edge_itself():
    group = standing(options=GroupOptions(latch="edge"))
    move = group.move_linear_absolute(DOWN, LINE, watch=plate_at(group, -32.5))
    settled(group)
    assert move.latched.z_mm == pytest.approx(-12.5, abs=1e-4)


def test_a_movement_may_run_on_past_the_edge():
    group = standing()
    watch = EdgeWatch(plate_at(group, -32.5).number, stops=False)
    move = group.move_linear_absolute(DOWN, LINE, watch=watch)
    settled(group)
    assert tcp_mm(group)[2] == pytest.approx(-50)
    assert move.latched.z_mm == pytest.approx(-12.5, abs=0.4)


@pytest.mark.parametrize("falling", [True, False])
def test_only_the_edge_that_was_asked_for_counts(falling):
    group = standing()
    number = plate_at(group, -32.5).number
    up = Target((0, 0, 30, 0, 0, 0), CoordSystem.TCS)
    down = group.move_linear_absolute(DOWN, LINE, watch=EdgeWatch(number, falling, stops=False))
    settled(group)
    rise = group.move_linear_absolute(up, LINE, watch=EdgeWatch(number, falling, stops=False))
    settled(group)
    assert (down.latched is None) is falling
    assert (rise.latched is None) is not falling
    missed = down if falling else rise
    assert kind(missed) is ErrorKind.NO_EDGE


def test_a_movement_that_stops_at_its_edge_is_not_interrupted_any_more():
    group = standing()
    move = group.move_linear_absolute(DOWN, LINE, watch=plate_at(group, -32.5))
    while move.latched is None:
        group.advance(group.next_change())
    interrupt = group.interrupt()
    settled(group)
    assert interrupt.outputs.done
    assert move.outputs.done
    assert group.status().interrupted_movement == 0


def test_without_an_edge_the_movement_runs_to_its_end_and_says_so():
    group = standing()
    move = group.move_linear_absolute(DOWN, LINE, watch=EdgeWatch(5))
    settled(group)
    assert kind(move) is ErrorKind.NO_EDGE
    assert tcp_mm(group)[2] == pytest.approx(-50)


def test_an_input_switched_by_hand_ends_it_too():
    group = standing()
    move = group.move_linear_absolute(DOWN, LINE, watch=EdgeWatch(5))
    passing(group, 0.2)
    group.inputs.switch(5, True)
    settled(group)
    assert move.outputs.done
    assert -50 < tcp_mm(group)[2] < -20


def test_nothing_can_be_buffered_behind_an_unknown_end():
    group = standing()
    group.move_linear_absolute(DOWN, LINE, watch=EdgeWatch(5))
    after = group.move_linear_absolute(shifted(group), LINE, mode=SmcBufferMode.BUFFERED)
    assert kind(after) is ErrorKind.WRONG_STATE
    assert moved(group, z_mm=10)


@pytest.mark.parametrize("number", [-1, 32])
def test_there_are_32_inputs_and_outputs(number):
    group = standing()
    watched = group.move_linear_absolute(DOWN, LINE, watch=EdgeWatch(number))
    assert kind(watched) is ErrorKind.PARAMETER
    with pytest.raises(BlockRefused):
        group.outputs.switch(number, True)
    group.outputs.switch(31, True)
    assert group.outputs.read(31)
    assert not group.outputs.read(0)
