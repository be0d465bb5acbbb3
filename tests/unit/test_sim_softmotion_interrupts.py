"""Interrupting movements, and continuing them."""

import math
from itertools import pairwise

import pytest
from robolink_simulators.softmotion import (
    CoordSystem,
    ErrorKind,
    SmcBufferMode,
    SmcGroupState,
    Target,
)

from tests.unit._softmotion_machine import (
    FACTORS,
    LINE,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
    tcp_mm,
    way,
)


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


@pytest.mark.parametrize("end", ["stop", "halt", "disable", "fail_axis"])
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
