"""Axes of a group that move alone; numbers are those of docs/reference/softmotion.md 5."""

import pytest
from robolink_simulators.softmotion import (
    AxisState,
    ErrorKind,
    SmcGroupState,
)

from tests.unit._softmotion_machine import (
    LINE,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
    state_of,
)


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


@pytest.mark.parametrize(
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
