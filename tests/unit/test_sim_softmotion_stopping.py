"""Early ends of a simulated axis group's movements: stop, halt, interrupt, an input."""

import math
from itertools import pairwise

import pytest
from robolink_simulators.softmotion import (
    BlockRefused,
    CoordSystem,
    EdgeWatch,
    ErrorKind,
    GroupOptions,
    JogCommand,
    SmcBufferMode,
    SmcGroupState,
    Target,
)

from tests._rows import each_row
from tests.unit._softmotion_machine import (
    FACTORS,
    LINE,
    at_cycle,
    in_axes,
    in_error,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
    state_of,
    tcp_mm,
    way,
)

# Stop and halt of a simulated axis group; numbers are those of docs/reference/softmotion.md 5.


def stopped(**options):
    group = standing(options=GroupOptions(**options))
    group.stop()
    settled(group)
    assert state_of(group) is SmcGroupState.STOPPING
    return group


@each_row("during", ["movement", "standby", "jog"])
def test_a_stop_holds_the_group_until_execute_falls(during):
    """Behaviour 13."""
    group = standing()
    move = moved(group, x_mm=-40) if during == "movement" else None
    jog = JogCommand(1, 0, CoordSystem.MCS, LINE)
    jogging = group.jog(jog) if during == "jog" else None
    passing(group, 0.3)
    stop = group.stop()
    assert stop.outputs.busy
    settled(group)
    assert stop.outputs.done
    assert move is None or move.outputs.aborted
    assert jogging is None or jogging.outputs.aborted
    passing(group, 5)
    assert state_of(group) is SmcGroupState.STOPPING
    refused = group.move_linear_absolute(shifted(group, x_mm=1), LINE)
    assert kind(refused) is ErrorKind.WRONG_STATE
    assert kind(group.jog(jog)) is ErrorKind.WRONG_STATE
    group.release_stop()
    assert state_of(group) is SmcGroupState.STOPPING
    at_cycle(group)
    assert state_of(group) is SmcGroupState.STANDBY


def test_a_movement_during_a_stop_may_be_aborted_instead():
    """Behaviour 13, the other reading."""
    group = stopped(movement_while_stopping="aborted")
    assert group.move_direct_absolute(in_axes(0, 0, 0, 0), FACTORS).outputs.aborted


def test_a_stop_released_early_still_comes_to_rest_first():
    group = standing()
    moved(group, x_mm=-60)
    passing(group, 0.3)
    stop = group.stop()
    group.release_stop()
    at_cycle(group)
    assert stop.outputs.busy
    assert state_of(group) is SmcGroupState.STOPPING
    settled(group)
    assert stop.outputs.done
    assert state_of(group) is SmcGroupState.STANDBY


def test_a_second_stop_joins_the_first():
    group = standing()
    moved(group, x_mm=-60)
    passing(group, 0.3)
    stops = [group.stop(), group.stop()]
    settled(group)
    assert [stop.outputs.done for stop in stops] == [True, True]
    assert group.stop().outputs.done
    group.release_stop()
    group.stop()
    settled(group)
    assert state_of(group) is SmcGroupState.STOPPING
    group.release_stop()
    settled(group)
    assert state_of(group) is SmcGroupState.STANDBY


@each_row("block", ["halt", "interrupt", "resume"])
def test_a_stop_overrules_every_other_way_of_coming_to_rest(block):
    assert getattr(stopped(), block)().outputs.aborted


def test_halting_goes_through_moving_to_standby_also_from_standby():
    group = standing()
    halt = group.halt()
    assert state_of(group) is SmcGroupState.MOVING
    at_cycle(group)
    assert halt.outputs.done
    assert state_of(group) is SmcGroupState.MOVING
    at_cycle(group)
    assert state_of(group) is SmcGroupState.STANDBY


def test_halting_ends_every_movement_and_rests_before_the_target():
    group = standing()
    first, second = moved(group, x_mm=-60), moved(group, x_mm=-60, mode=SmcBufferMode.BUFFERED)
    passing(group, 0.3)
    before = group.read_actual_position().values
    halt = group.halt()
    assert first.outputs.aborted
    assert second.outputs.aborted
    settled(group)
    assert halt.outputs.done
    way_mm = before[0] - group.read_actual_position().values[0]
    assert 0 < way_mm < 10
    assert group.status().unfinished == 0


def test_a_new_movement_ends_a_halt():
    group = standing()
    moved(group, x_mm=-60)
    passing(group, 0.3)
    halt = group.halt()
    move = moved(group, z_mm=5)
    assert halt.outputs.aborted
    settled(group)
    assert move.outputs.done


@each_row("block", ["stop", "halt", "interrupt", "resume"])
@each_row("state", [SmcGroupState.DISABLED, SmcGroupState.ERROR_STOP])
def test_nothing_can_come_to_rest_in_disabled_or_error(block, state):
    group = in_error() if state is SmcGroupState.ERROR_STOP else standing()
    if state is SmcGroupState.DISABLED:
        group.disable()
    assert kind(getattr(group, block)()) is ErrorKind.WRONG_STATE
    assert state_of(group) is state


# Interrupting movements, and continuing them.


def test_interrupted_in_a_corner_the_first_arrives_and_the_second_goes_on():
    group = standing()
    first = moved(group, x_mm=-40)
    second = moved(group, x_mm=-40, z_mm=40, mode=SmcBufferMode.BLENDING_LOW)
    while not second.outputs.active:
        group.advance(group.next_change())
    passing(group, 0.03)
    assert not first.outputs.done
    group.interrupt()
    places = way(group)
    assert first.outputs.done
    assert group.status().interrupted_movement == 2
    assert group.resume().outputs.done
    places += way(group)
    assert second.outputs.done
    jumps = [math.dist(a, b) for a, b in pairwise(places)]
    assert max(jumps) < 0.5


def test_an_interrupted_movement_stays_busy_and_goes_on_along_its_way():
    group = standing()
    target = shifted(group, x_mm=-60)
    move = group.move_linear_absolute(target, LINE)
    passing(group, 0.3)
    interrupt = group.interrupt()
    assert interrupt.outputs.busy
    settled(group)
    assert interrupt.outputs.done
    assert group.state is SmcGroupState.STANDBY
    assert move.outputs.busy
    assert group.status().interrupted_movement == 1
    assert tcp_mm(group)[0] > target.position[0] + 1
    assert group.resume().outputs.done
    settled(group)
    assert move.outputs.done
    assert tcp_mm(group) == pytest.approx(target.position[:3])


def test_what_waits_is_interrupted_too():
    group = standing()
    moved(group, x_mm=-40)
    waiting = moved(group, x_mm=-40, z_mm=10, mode=SmcBufferMode.BUFFERED)
    passing(group, 0.2)
    group.interrupt()
    settled(group)
    assert group.status().unfinished == 2
    group.resume()
    settled(group)
    assert waiting.outputs.done


def test_continuing_needs_the_place_of_the_interruption():
    group = standing()
    move = moved(group, x_mm=-60)
    passing(group, 0.3)
    group.interrupt()
    settled(group)
    back = Target((*group.values, 0.0, 0.0), CoordSystem.ACS)
    moved(group, z_mm=20)
    assert kind(group.resume()) is ErrorKind.WRONG_STATE
    settled(group)
    assert kind(group.resume()) is ErrorKind.NOT_AT_CONTINUE_POSITION
    group.move_direct_absolute(back, FACTORS)
    settled(group)
    assert group.resume().outputs.done
    settled(group)
    assert move.outputs.done


@each_row("end", ["stop", "halt", "disable", "fail_axis"])
def test_an_interrupted_movement_ends_with_the_group(end):
    group = standing()
    move = moved(group, x_mm=-60)
    passing(group, 0.3)
    group.interrupt()
    settled(group)
    group.fail_axis(0) if end == "fail_axis" else getattr(group, end)()
    assert move.outputs.aborted
    assert group.status().interrupted_movement == 0


def test_while_an_interrupt_is_under_way_only_a_stop_gets_in():
    group = standing()
    move = moved(group, x_mm=-60)
    passing(group, 0.3)
    interrupt = group.interrupt()
    assert group.interrupt().outputs.aborted
    assert kind(group.halt()) is ErrorKind.WRONG_STATE
    assert kind(group.move_linear_absolute(shifted(group), LINE)) is ErrorKind.WRONG_STATE
    stop = group.stop()
    assert interrupt.outputs.aborted
    assert move.outputs.aborted
    settled(group)
    assert stop.outputs.done
    assert group.status().unfinished == 0


def test_what_was_taken_over_is_not_continued():
    group = standing()
    moved(group, x_mm=-60)
    passing(group, 0.3)
    second = moved(group, z_mm=15)
    group.interrupt()
    settled(group)
    assert group.status().interrupted_movement == 2
    assert group.status().unfinished == 1
    group.resume()
    settled(group)
    assert second.outputs.done


def test_there_must_be_something_to_interrupt_and_to_continue():
    group = standing()
    assert kind(group.interrupt()) is ErrorKind.NO_SUCH_MOVEMENT
    assert kind(group.resume()) is ErrorKind.NO_SUCH_MOVEMENT


def test_a_second_interrupt_waits_for_the_first_to_be_continued():
    group = standing()
    moved(group, x_mm=-60)
    passing(group, 0.3)
    group.interrupt()
    settled(group)
    moved(group, z_mm=20)
    assert kind(group.interrupt()) is ErrorKind.WRONG_STATE


# Movements until an input changes; inputs and outputs.

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
