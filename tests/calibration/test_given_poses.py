"""Poses that exist already: how many, how upright, and which tool they fit."""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robolink.calibration import better_fit, flange_pose, solve_two_pose, tool_fits, two_of
from robolink.errors import CalibrationError, ConfigError
from robolink.model import Pose, ToolOffset, rotate_xy

PIN = (310.0, 195.0)
STORED = {1: ToolOffset(12, -3.5, -20), 2: ToolOffset(-8, 40, -15, 30), 3: ToolOffset(0, 25, 0)}
FRAMES = {0: ToolOffset(), **STORED}


def touched(real, u_deg, frame):
    """Return the pose that tool ``frame`` shows when the ``real`` tip is on the pin."""
    dx, dy = rotate_xy(real.x_mm, real.y_mm, u_deg)
    own_x, own_y = rotate_xy(frame.x_mm, frame.y_mm, u_deg)
    return Pose(PIN[0] - dx + own_x, PIN[1] - dy + own_y, -50, u_deg + frame.u_deg)


def poses(real, really, first_deg=10.0, turn_deg=180.0):
    frame = FRAMES[really]
    return [touched(real, u, frame) for u in (first_deg, first_deg + turn_deg)]


def judged(real, *, really, said, calibrated=1):
    pair = poses(real, really)
    result = solve_two_pose(*(flange_pose(pose, FRAMES[said]) for pose in pair))
    fits = tool_fits(result, taught=said, stored=STORED, calibrated=calibrated)
    return fits, better_fit(fits, taught=said, plausible_mm=2.0)


TENTHS = st.floats(-0.5, 0.5)


@given(st.sampled_from([0, 1, 2, 3]), st.sampled_from([0, 1, 2, 3]), TENTHS, TENTHS)
@settings(max_examples=80, deadline=None)
def test_the_tool_that_was_really_used_is_named_and_the_right_one_never_doubted(
    really, said, dx, dy
):
    real = ToolOffset(12 + dx, -3.5 + dy, -20)
    fits, better = judged(real, really=really, said=said)
    assert fits[0].tool == really
    assert fits[0].change_mm == pytest.approx((dx**2 + dy**2) ** 0.5, abs=1e-9)
    if really == said:
        assert better is None
    else:
        assert better is not None
        assert better.tool == really


@given(
    st.sampled_from([0, 1, 2, 3]),
    st.sampled_from([0, 1, 2, 3]),
    st.floats(-170, 170),
    st.floats(40, 320),
)
@settings(max_examples=60, deadline=None)
def test_each_fit_is_what_solving_with_that_tool_gives(really, other, first_deg, turn_deg):
    assume(abs(turn_deg - 180) < 140)
    pair = poses(ToolOffset(12.3, -3.9), really, first_deg, turn_deg)
    zero = solve_two_pose(*(flange_pose(pose, FRAMES[0]) for pose in pair))
    fits = tool_fits(zero, taught=0, stored=STORED, calibrated=1)
    solved = solve_two_pose(*(flange_pose(pose, FRAMES[other]) for pose in pair)).offset
    change = ((solved.x_mm - 12) ** 2 + (solved.y_mm + 3.5) ** 2) ** 0.5
    assert {fit.tool: fit.change_mm for fit in fits}[other] == pytest.approx(change, abs=1e-6)


def test_a_coaxial_nozzle_tells_nothing_and_nothing_is_said():
    stored = {1: ToolOffset(0.2, 0.1, -20)}
    pair = [touched(ToolOffset(0.3, -0.2), u, ToolOffset()) for u in (0, 180)]
    result = solve_two_pose(*(flange_pose(pose, stored[1]) for pose in pair))
    fits = tool_fits(result, taught=1, stored=stored, calibrated=1)
    assert better_fit(fits, taught=1, plausible_mm=2.0) is None


def test_nothing_is_judged_without_a_stored_value():
    result = solve_two_pose(*poses(ToolOffset(12.3, -3.9), 0))
    assert tool_fits(result, taught=0, stored=STORED, calibrated=7) == ()
    assert better_fit((), taught=0, plausible_mm=2.0) is None


def test_a_wild_measurement_accuses_no_tool():
    _, better = judged(ToolOffset(90, 90), really=0, said=1)
    assert better is None


def test_a_tilted_tool_is_no_candidate():
    stored = {1: STORED[1], 4: ToolOffset(5, 5, 0, w_deg=180)}
    result = solve_two_pose(*poses(ToolOffset(12.3, -3.9), 0))
    fits = tool_fits(result, taught=0, stored=stored, calibrated=1)
    assert {fit.tool for fit in fits} == {0, 1}


@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_poses_are_too_few(count):
    with pytest.raises(CalibrationError) as caught:
        two_of([Pose(300, 100, 0, 0)] * count)
    assert caught.value.code == "too_few_poses"


def test_three_poses_are_a_mistake_in_the_command():
    with pytest.raises(ConfigError, match="3 poses"):
        two_of([Pose(300, 100, 0, 0)] * 3)


def test_a_tilted_pose_is_refused_by_name():
    with pytest.raises(CalibrationError) as caught:
        solve_two_pose(Pose(300, 100, 0, 0), Pose(300, 100, 0, 180, w_deg=180))
    assert caught.value.code == "tilted_pose"


def test_an_offset_that_no_tool_has_is_said_by_its_whole_length():
    long = ToolOffset(1131.9, 930.0, -20)
    touches = [touched(long, u, ToolOffset()) for u in (0.0, 180.0)]
    with pytest.raises(CalibrationError, match=r"1465\.0 mm long") as caught:
        solve_two_pose(*touches)
    assert caught.value.code == "implausible_offset"
