"""Stop and halt of a simulated axis group; numbers are those of docs/reference/softmotion.md 5."""

import pytest
from robolink_simulators.softmotion import (
    CoordSystem,
    ErrorKind,
    GroupOptions,
    JogCommand,
    SmcBufferMode,
    SmcGroupState,
)

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
)


def stopped(**options):
    group = standing(options=GroupOptions(**options))
    group.stop()
    settled(group)
    assert state_of(group) is SmcGroupState.STOPPING
    return group


@pytest.mark.parametrize("during", ["movement", "standby", "jog"])
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


@pytest.mark.parametrize("block", ["halt", "interrupt", "resume"])
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


@pytest.mark.parametrize("block", ["stop", "halt", "interrupt", "resume"])
@pytest.mark.parametrize("state", [SmcGroupState.DISABLED, SmcGroupState.ERROR_STOP])
def test_nothing_can_come_to_rest_in_disabled_or_error(block, state):
    group = in_error() if state is SmcGroupState.ERROR_STOP else standing()
    if state is SmcGroupState.DISABLED:
        group.disable()
    assert kind(getattr(group, block)()) is ErrorKind.WRONG_STATE
    assert state_of(group) is state
