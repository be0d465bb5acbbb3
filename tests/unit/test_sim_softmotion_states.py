"""States of a simulated axis group; numbers are those of docs/reference/softmotion.md 5."""

from dataclasses import replace

import pytest
from robolink_simulators.softmotion import (
    AxisState,
    BlockState,
    ErrorKind,
    GroupOptions,
    SmcBufferMode,
    SmcGroupState,
    SmcNumbers,
)

from tests.unit._softmotion_machine import (
    CYCLE_NS,
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
)


def test_enabling_twice_and_disabling_when_disabled_are_errors():
    """Behaviour 10."""
    group = standing()
    again = group.enable()
    assert kind(again) is ErrorKind.WRONG_STATE
    assert again.outputs.error.number == 11000
    assert again.outputs.error.symbol == "SMC_AXIS_GROUP_WRONG_STATE"
    assert state_of(group) is SmcGroupState.STANDBY
    assert group.disable().outputs.done
    assert kind(group.disable()) is ErrorKind.WRONG_STATE
    assert state_of(group) is SmcGroupState.DISABLED


def test_resetting_in_standby_says_that_there_is_nothing_to_reset():
    """Behaviour 11."""
    group = standing()
    reset = group.reset()
    assert kind(reset) is ErrorKind.NOTHING_TO_RESET
    assert reset.outputs.error.number == 120
    assert state_of(group) is SmcGroupState.STANDBY


def test_a_movement_that_has_arrived_is_over_a_cycle_before_standby():
    """Behaviour 12: Moving in the cycle of the last setpoint, Standby in the next."""
    group = standing()
    target = shifted(group, x_mm=-20)
    move = group.move_linear_absolute(target, LINE)
    while not move.outputs.done:
        assert state_of(group) is SmcGroupState.MOVING
        at_cycle(group)
    assert group.read_actual_position().values[:3] == pytest.approx(target.position[:3])
    assert state_of(group) is SmcGroupState.MOVING
    at_cycle(group)
    assert state_of(group) is SmcGroupState.STANDBY
    assert group.next_change() is None


def test_an_axis_in_error_stays_so_without_power_until_it_is_reset():
    group = in_error()
    group.power(on=False)
    group.power(on=True)
    assert {axis.state for axis in group.axes} == {AxisState.ERRORSTOP}
    assert group.reset().outputs.done
    assert {axis.state for axis in group.axes} == {AxisState.STANDSTILL}


@pytest.mark.parametrize("as_error", [False, True])
def test_an_axis_error_ends_everything_at_once(as_error):
    group = standing(options=GroupOptions(queue_on_error="error" if as_error else "aborted"))
    moves = [moved(group, x_mm=-40), moved(group, x_mm=-50, mode=SmcBufferMode.BUFFERED)]
    passing(group, 0.2)
    group.fail_axis(1, 16)
    stood = group.values
    expected = BlockState.ERROR if as_error else BlockState.COMMAND_ABORTED
    assert [move.outputs.state for move in moves] == [expected, expected]
    assert state_of(group) is SmcGroupState.ERROR_STOP
    assert group.status().error.number == 16
    assert {axis.state for axis in group.axes} == {AxisState.ERRORSTOP}
    passing(group, 1)
    assert group.values == stood


def test_an_error_during_a_stop_aborts_it_and_unlocks_the_group():
    group = standing()
    moved(group, x_mm=-40)
    passing(group, 0.2)
    stop = group.stop()
    group.fail_axis(0)
    assert stop.outputs.aborted
    group.reset()
    assert state_of(group) is SmcGroupState.STANDBY
    assert moved(group, x_mm=-10).outputs.busy


def test_a_reset_leads_from_error_to_standby_and_takes_the_error_away():
    group = in_error()
    assert kind(group.move_linear_absolute(shifted(group, x_mm=1), LINE)) is ErrorKind.WRONG_STATE
    assert group.reset().outputs.done
    assert state_of(group) is SmcGroupState.STANDBY
    assert group.status().error is None
    assert {axis.state for axis in group.axes} == {AxisState.STANDSTILL}


def test_an_axis_that_fails_while_the_group_is_disabled_is_reset_there():
    group = standing()
    group.disable()
    group.fail_axis(0)
    assert state_of(group) is SmcGroupState.DISABLED
    group.enable()
    assert kind(group.move_direct_absolute(in_axes(0, 0, 0, 0), FACTORS)) is ErrorKind.AXIS_ERROR
    group.disable()
    assert group.reset().outputs.done
    assert state_of(group) is SmcGroupState.DISABLED


def test_disabling_is_for_standby_only_unless_the_options_say_otherwise():
    group = standing()
    move = moved(group, x_mm=-40)
    passing(group, 0.2)
    assert kind(group.disable()) is ErrorKind.WRONG_STATE
    assert kind(in_error().disable()) is ErrorKind.WRONG_STATE
    assert not move.outputs.aborted
    group = standing(options=GroupOptions(disable_from="any"))
    move = moved(group, x_mm=-40)
    passing(group, 0.2)
    assert group.disable().outputs.done
    assert move.outputs.aborted
    assert state_of(group) is SmcGroupState.DISABLED
    assert in_error(disable_from="any").disable().outputs.done


def test_enabling_does_not_power_the_drives():
    group = standing()
    group.power(on=False)
    assert state_of(group) is SmcGroupState.STANDBY
    assert not group.status().powered
    refused = group.move_linear_absolute(shifted(group, x_mm=-10), LINE)
    assert kind(refused) is ErrorKind.NO_POWER
    assert refused.outputs.error.number == 14


def test_power_lost_while_moving_is_a_group_error():
    group = standing()
    move = moved(group, x_mm=-40)
    passing(group, 0.2)
    group.power(on=False)
    assert move.outputs.aborted
    assert state_of(group) is SmcGroupState.ERROR_STOP
    assert {axis.state for axis in group.axes} == {AxisState.POWER_OFF}
    group.power(on=True)
    assert group.reset().outputs.done


@pytest.mark.parametrize("follow", [True, False])
def test_axes_are_coupled_in_moving_and_freed_as_the_version_does(follow):
    group = standing(options=GroupOptions(axes_follow_group=follow))
    moved(group, x_mm=-10)
    assert {axis.state for axis in group.axes} == {AxisState.SYNCHRONIZED_MOTION}
    settled(group)
    expected = AxisState.STANDSTILL if follow else AxisState.SYNCHRONIZED_MOTION
    assert {axis.state for axis in group.axes} == {expected}


def test_the_status_tells_what_is_active_and_waits():
    group = standing()
    first = moved(group, x_mm=-20)
    second = moved(group, x_mm=-30, mode=SmcBufferMode.BUFFERED)
    assert (first.movement_number, second.movement_number) == (1, 2)
    passing(group, 0.1)
    status = group.status()
    assert (status.active_movement, status.unfinished, status.powered) == (1, 2, True)
    settled(group)
    assert (group.status().active_movement, group.status().unfinished) == (0, 0)


def test_the_cycle_of_the_motion_task_can_be_set():
    group = standing(options=GroupOptions(cycle_us=10_000))
    halt = group.halt()
    group.advance(9_999_999)
    assert halt.outputs.busy
    group.advance(10_000_000)
    assert halt.outputs.done


def test_numbers_that_someone_knows_can_be_filled_in():
    numbers = replace(SmcNumbers(), unreachable=4711)
    group = standing(options=GroupOptions(numbers=numbers))
    refused = group.move_linear_absolute(shifted(group, x_mm=900), LINE)
    assert refused.outputs.error.number == 4711
    assert refused.outputs.error.symbol == ""


def test_time_may_pass_in_any_pieces():
    ways = []
    for piece_ns in (1_234_567, CYCLE_NS, 50 * CYCLE_NS):
        group = standing()
        moved(group, x_mm=-40)
        moved(group, z_mm=10, mode=SmcBufferMode.BLENDING_LOW)
        while group.now_ns < 100 * CYCLE_NS:
            group.advance(min(group.now_ns + piece_ns, 100 * CYCLE_NS))
        ways.append(group.values)
    assert ways[0] == ways[1] == ways[2]
