"""A new offset that is not believed is not let through.

What a change of an offset does at taught points, against two simulated arms.
"""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.calibration import flange_of, impact_on, tip_pose, update_guard
from robolink.model import Pose, ToolOffset, rotate_xy
from tests.calibration._simulated import refused

STORED = ToolOffset(12.0, -3.0, -20.0)


def test_an_ordinary_change_passes_and_is_told():
    correction = update_guard(ToolOffset(12.3, -3.4, -20.0), stored=STORED)
    assert correction.distance_mm == pytest.approx(0.5)
    assert (correction.dx_mm, correction.dy_mm) == pytest.approx((0.3, -0.4))
    assert correction.ratio is None


def test_a_jump_is_refused_and_the_limit_can_be_set():
    far = ToolOffset(15.0, -3.0, -20.0)
    with refused("implausible_change"):
        update_guard(far, stored=STORED)
    assert update_guard(far, stored=STORED, max_change_mm=5.0).distance_mm == pytest.approx(3)


@pytest.mark.parametrize("gain", [-1.0, -0.6, 2.05, 2.2])
def test_a_loop_with_a_wrong_sign_or_gain_is_stopped_at_its_second_turn(gain):
    # Each turn measures the error that is left and applies gain times too much of it.
    error, stored = 0.4, STORED
    history: list[float] = []
    with refused("diverging"):
        for _ in range(4):
            step = gain * error
            new = ToolOffset(stored.x_mm + step, stored.y_mm, stored.z_mm)
            correction = update_guard(new, stored=stored, earlier_mm=history, max_change_mm=9)
            history.append(correction.distance_mm)
            stored, error = new, error - step
    assert len(history) == 1


def test_a_loop_that_converges_goes_on():
    correction = update_guard(ToolOffset(12.1, -3, -20), stored=STORED, earlier_mm=[0.9, 0.3])
    assert correction.ratio == pytest.approx(1 / 3)


def test_growth_within_the_noise_is_no_divergence():
    update_guard(ToolOffset(12.03, -3, -20), stored=STORED, earlier_mm=[0.01])
    with refused("diverging"):
        update_guard(ToolOffset(12.03, -3, -20), stored=STORED, earlier_mm=[0.01], noise_mm=0.02)


LENGTH = st.floats(-300, 300)
ANGLE = st.floats(-360, 360)
OFFSETS = st.builds(ToolOffset, LENGTH, LENGTH, LENGTH, ANGLE)
POINTS = st.builds(Pose, LENGTH, LENGTH, LENGTH, ANGLE)


def driven(point, believed, real):
    """Return where a ``real`` tip is when a controller drives the ``believed`` one to ``point``."""
    flange_u = point.u_deg - believed.u_deg
    tip_x, tip_y = rotate_xy(real.x_mm - believed.x_mm, real.y_mm - believed.y_mm, flange_u)
    return (
        point.x_mm + tip_x,
        point.y_mm + tip_y,
        point.z_mm + real.z_mm - believed.z_mm,
    )


def at(point, old, new):
    (entry,) = impact_on({1: point}, old=old, new=new).entries
    return entry


@given(POINTS, OFFSETS, OFFSETS)
@settings(max_examples=60, deadline=None)
def test_it_is_where_the_new_tip_goes_with_the_new_value_against_with_the_old(point, old, new):
    entry = at(point, old, new)
    before, after = driven(point, old, new), driven(point, new, new)
    expected = [a - b for a, b in zip(after, before, strict=True)]
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx(expected, abs=1e-9)


@given(POINTS, OFFSETS, st.floats(-5, 5), st.floats(-5, 5))
@settings(max_examples=60, deadline=None)
def test_an_unchanged_nozzle_leaves_the_taught_place_by_as_much(point, old, dx, dy):
    new = ToolOffset(old.x_mm + dx, old.y_mm + dy, old.z_mm, old.u_deg)
    entry = at(point, old, new)
    before, after = driven(point, old, old), driven(point, new, old)
    assert before[:2] == pytest.approx((point.x_mm, point.y_mm))
    assert (entry.dx_mm, entry.dy_mm) == pytest.approx(
        (after[0] - before[0], after[1] - before[1]), abs=1e-9
    )


@given(st.lists(POINTS, min_size=1, max_size=6), OFFSETS, OFFSETS)
@settings(max_examples=40, deadline=None)
def test_on_four_axes_the_distance_is_the_same_at_every_point(points, old, new):
    impact = impact_on(dict(enumerate(points)), old=old, new=new)
    length = math.dist(old.components()[:3], new.components()[:3])
    assert [entry.distance_mm for entry in impact.entries] == pytest.approx(
        [length] * len(points), abs=1e-9
    )
    assert impact.largest is impact.entries[0]


def test_a_hand_calculated_case():
    entry = at(Pose(250, 200, -30, 90), ToolOffset(12, 0, -20), ToolOffset(12.5, 0, -21))
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx((0, -0.5, 1))


def test_a_new_tool_angle_turns_the_nozzle_the_other_way():
    entry = at(Pose(250, 200, -30, 90), ToolOffset(u_deg=350), ToolOffset(u_deg=10))
    assert entry.turn_deg == pytest.approx(-20)
    assert entry.distance_mm == 0


def test_points_that_cannot_be_judged_are_named_and_left_out():
    points = {
        1: Pose(250, 200, 0, 0),
        2: None,
        3: Pose(10, 20, 0, 0, local=2),
    }
    impact = impact_on(points, old=ToolOffset(1), new=ToolOffset(2))
    assert [entry.number for entry in impact.entries] == [1]
    assert impact.undefined == (2,)
    assert impact.other_local == {3: 2}


@pytest.mark.parametrize("pose", [Pose(250, 200, 0, 40, 0, 180), Pose(250, 200, 0, 40, 20, -150)])
def test_a_leaning_tool_is_judged_in_space(pose):
    """The flange with the old offset, and what it carries, worked out the long way."""
    old, new = ToolOffset(12, -3, 120, 10, 5, -4), ToolOffset(12.4, -3.3, 119.5, 12, 6, -4)
    flange = flange_of(pose, old)
    entry = at(pose, old, new)
    # The tip that is on the arm sits at the new offset: there it goes with the old one.
    there = tip_pose(flange, new, tool=1)
    moved = [a - b for a, b in zip(pose.coordinates(), there.coordinates(), strict=True)][:3]
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx(moved)
    assert entry.distance_mm == pytest.approx(math.dist((12, -3, 120), (12.4, -3.3, 119.5)))
    assert 1.0 < entry.turn_deg < 3.0


def test_upside_down_a_longer_tip_moves_up():
    entry = at(Pose(250, 200, 0, 90, 0, 180), ToolOffset(0, 1, 100, 10), ToolOffset(0, 1, 101, 30))
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx((0, 0, 1))
    assert entry.turn_deg == pytest.approx(-20)
