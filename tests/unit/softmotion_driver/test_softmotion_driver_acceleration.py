"""An acceleration that a cell states: it goes with each straight movement, and is only lowered.

Source: docs/reference/mailbox.md, "Movements".
"""

from dataclasses import replace

import pytest

from robolink.controllers import Jog, open_softmotion
from robolink.controllers.softmotion.movement import run_up_mm, straight, up_to_an_edge
from robolink.errors import ConfigError
from robolink.model import InputEdge, MotionProfile, Path, Pose, WorkBox, require_acceleration
from robolink.protocols.mailbox import Capability

ANYWHERE = WorkBox()
TARGET = Pose(410.0, 90.0, 250.0, 45.0, tool=0)
STATED = 120


def group_of(cell, stated=STATED):
    """Return the group of a PLC whose cell states an acceleration."""
    controller = open_softmotion(
        cell.link, outcomes=cell.outcomes, timeout_s=0.5, acceleration_mm_s2=stated
    )
    controller.take()
    cell.plc.executed.clear()
    return controller.groups[0]


@pytest.mark.parametrize(("speed_mm_s", "expected"), [(100.0, 120.0), (24.0, 120.0), (20.0, 100.0)])
@pytest.mark.parametrize("unit_um", [1000.0, 10.0])
def test_a_straight_movement_is_lowered_to_it_and_never_raised(
    cell, plc, speed_mm_s, expected, unit_um
):
    plc.now = replace(plc.now, unit_um=unit_um)
    profile = MotionProfile(Path.STRAIGHT, speed_mm_s=speed_mm_s)
    group_of(cell).move_to(TARGET, profile, box=ANYWHERE).wait(timeout_s=9)
    velocity, acceleration, deceleration, jerk = plc.executed[-1].dynamics
    assert velocity == pytest.approx(speed_mm_s * 1000 / unit_um)
    assert acceleration == deceleration == pytest.approx(expected * 1000 / unit_um)
    assert jerk == pytest.approx(5 * acceleration)


def test_a_joint_movement_and_a_jog_keep_their_own(cell, plc):
    group = group_of(cell)
    group.move_to(TARGET, MotionProfile(Path.JOINT, speed_percent=5), box=ANYWHERE).wait(
        timeout_s=9
    )
    assert plc.executed[-1].dynamics == (0.05,) * 4
    group.jog(Jog(forward=frozenset({0}), speed_mm_s=80.0), duration_s=0.1, box=ANYWHERE)
    assert plc.executed[-2].dynamics[1] == 160.0


def test_a_search_speeds_up_by_it_and_brakes_at_the_edge_as_before():
    usual, lowered = (
        up_to_an_edge(10.0, unit_um=1000.0, acceleration_mm_s2=one) for one in (None, STATED)
    )
    assert usual[1:3] == (1000.0, 1000.0)
    assert lowered == (usual[0], STATED, *usual[2:])
    # Slower, it never speeds up as hard as the cell allows.
    assert up_to_an_edge(2.0, unit_um=1000.0, acceleration_mm_s2=STATED) == up_to_an_edge(
        2.0, unit_um=1000.0
    )


def test_the_search_that_is_sent_carries_it(cell):
    draft = group_of(cell)._until_draft(TARGET, InputEdge(4), 10.0)
    assert draft.dynamics == up_to_an_edge(10.0, unit_um=1000.0, acceleration_mm_s2=STATED)


def test_the_run_up_is_that_of_the_lower_one(cell):
    assert run_up_mm(10.0, STATED) > 3 * run_up_mm(10.0)
    assert group_of(cell).run_up_mm(10.0) == run_up_mm(10.0, STATED)
    velocity, acceleration, _, jerk = up_to_an_edge(10.0, unit_um=1000.0, acceleration_mm_s2=STATED)
    # The way under a jerk-limited ramp, added up in small steps.
    at_mm_s, a_mm_s2, way_mm, step_s = 0.0, 0.0, 0.0, 1e-5
    while at_mm_s < velocity - 1e-3:
        rest_mm_s = velocity - at_mm_s
        slower = a_mm_s2**2 / (2 * jerk) >= rest_mm_s
        a_mm_s2 = (
            max(a_mm_s2 - jerk * step_s, 1e-3)
            if slower
            else min(a_mm_s2 + jerk * step_s, acceleration)
        )
        at_mm_s += a_mm_s2 * step_s
        way_mm += at_mm_s * step_s
    assert run_up_mm(10.0, STATED) == pytest.approx(way_mm, rel=0.01)


def test_without_it_nothing_is_different():
    assert straight(100.0, unit_um=1000.0) == (100.0, 500.0, 500.0, 2500.0)


def test_a_program_that_moves_nothing_keeps_to_none(cell, plc):
    plc.now = replace(plc.now, capabilities=Capability.TOOLS)
    controller = open_softmotion(
        cell.link, outcomes=cell.outcomes, timeout_s=0.5, acceleration_mm_s2=STATED
    )
    with pytest.raises(ConfigError, match="cannot limit the acceleration"):
        require_acceleration(STATED, controller)
