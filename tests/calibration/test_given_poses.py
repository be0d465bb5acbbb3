"""Poses: given, suggested, of several tools on one pin, and the largest set that agrees."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robolink.calibration import (
    JointTouch,
    PoseLimits,
    Robust,
    better_fit,
    flange_pose,
    precise_enough,
    quaternion_rotations,
    solve_joint,
    solve_n_angle,
    solve_pivot,
    solve_two_pose,
    suggest_poses,
    tool_fits,
    two_of,
)
from robolink.calibration.core.least_squares import _best_set, draw_poses
from robolink.calibration.pin import pivot
from robolink.errors import CalibrationError, ConfigError
from robolink.model import Pose, ToolOffset, WorkBox, rotate_xy
from tests.calibration._simulated import PIN as JOINT_PIN
from tests.calibration._simulated import PIN as SUGGEST_PIN
from tests.calibration._simulated import assert_honest, pivoting, refused, shaken, touching

# Existing poses: how many, how upright, and which tool they fit.

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


# The most informative poses within the robot's reach.

GUESS = ToolOffset(12, -4, 60)


def plan(count, taken=(), **limits):
    return suggest_poses(
        count, guess=GUESS, point_mm=SUGGEST_PIN, limits=PoseLimits(**limits), taken=taken
    )


@pytest.mark.parametrize("count", [2, 3, 4, 6, 8])
def test_a_whole_turn_is_divided_evenly(count):
    found = plan(count)
    assert found.sigma_gains[-1] == pytest.approx(1 / math.sqrt(count), rel=2e-3)
    assert solve_n_angle(found.poses).condition_number == pytest.approx(1, abs=0.08)


def test_the_poses_bring_the_guessed_tip_onto_the_point():
    result = solve_pivot(plan(6, tilt_deg=25).poses)
    assert result.offset.components()[:3] == pytest.approx((12, -4, 60))
    assert result.reference_point_mm == pytest.approx(SUGGEST_PIN)


def test_the_range_of_u_is_kept_and_used_to_its_ends():
    angles = [pose.u_deg for pose in plan(4, u_min_deg=-60, u_max_deg=60).poses]
    assert min(angles) == -60
    assert max(angles) == 60


def test_no_flange_position_leaves_the_box():
    box = WorkBox(x_min_mm=312, x_max_mm=400, y_min_mm=0, y_max_mm=200, z_min_mm=-200, z_max_mm=50)
    free, boxed = plan(4), plan(4, box=box)
    assert min(pose.x_mm for pose in free.poses) < 312
    assert all(box.x_min_mm <= pose.x_mm <= box.x_max_mm for pose in boxed.poses)
    assert boxed.sigma_gains[-1] > free.sigma_gains[-1]


def test_each_further_pose_says_what_it_would_bring():
    gains = plan(6).sigma_gains
    assert gains[0] == math.inf
    assert gains[1] == pytest.approx(1 / math.sqrt(2), rel=1e-6)
    assert all(later <= earlier for earlier, later in pairwise(gains))


def test_a_plan_adds_to_what_was_taken():
    taken = [touching((12, -4), angle) for angle in (0.0, 20.0)]
    (pose,) = plan(1, taken=taken).poses
    assert abs(abs(pose.u_deg - 10) - 180) <= 15


def test_tilt_makes_the_length_known():
    found = plan(8, tilt_deg=30)
    result = solve_pivot(found.poses)
    assert result.condition_number == pytest.approx(3, abs=1)
    assert found.sigma_gains[-1] == pytest.approx(result.sigma_gain)
    assert len({(p.u_deg, p.v_deg, p.w_deg) for p in found.poses}) == 8


def test_it_beats_poses_drawn_at_random():
    rng = np.random.default_rng(1)
    best = min(
        solve_pivot(
            [
                pivoting((12, -4, 60), a)
                for a in zip(rng.uniform(-180, 180, 6), *rng.uniform(-30, 30, (2, 6)), strict=True)
            ]
        ).sigma_gain
        for _ in range(50)
    )
    assert plan(6, tilt_deg=30).sigma_gains[-1] < best


def test_the_measurement_may_stop_when_the_interval_is_inside_the_tolerance():
    rng = np.random.default_rng(3)
    poses = list(plan(12).poses)
    stopped = None
    for count in range(2, 13):
        result = solve_n_angle(shaken(poses[:count], rng, 0.03))
        if precise_enough(result, 0.04):
            stopped = count
            break
    assert stopped is not None
    assert 2 < stopped < 12
    assert not precise_enough(solve_n_angle(poses[:2]), 10.0)


def test_senseless_plans_are_refused():
    with pytest.raises(ConfigError, match="0 poses"):
        plan(0)
    with pytest.raises(ConfigError, match="negative"):
        plan(3, u_min_deg=10, u_max_deg=-10)
    far = WorkBox(x_min_mm=0, x_max_mm=1, y_min_mm=0, y_max_mm=1, z_min_mm=0, z_max_mm=1)
    with refused("insufficient_rotation"):
        plan(3, box=far)


# Several tools on one pin, one tool on several pins.

TIPS = {1: (12.3, -3.9), 2: (-20.1, 4.4)}
ANGLES = (-150.0, -30.0, 60.0)
TILTS = [(0, 0, 0), (40, 30, 0), (-75, -15, 25), (120, 10, -30)]


def planar(rng=None, sigma_mm=0.0, tools=(1, 2)):
    found = []
    for tool in tools:
        poses = [touching(TIPS[tool], angle) for angle in ANGLES]
        poses = shaken(poses, rng, sigma_mm) if rng else poses
        found += [JointTouch(pose, tool) for pose in poses]
    return found


def xy(result):
    return (result.offset.x_mm, result.offset.y_mm)


def test_several_tools_on_one_pin():
    result = solve_joint(planar(), stored={1: ToolOffset(0, 0, -20, 5)})
    assert {tool: pytest.approx(xy(r)) for tool, r in result.tools.items()} == TIPS
    assert result.pins_mm == {0: pytest.approx(JOINT_PIN[:2])}
    assert (result.tools[1].offset.z_mm, result.tools[2].offset.z_mm) == (-20, 0)
    assert result.tools[1].dof == 12 - 6


def test_one_tool_on_several_pins_in_space():
    tip, pins = (4.2, -7.9, 131.6), {5: JOINT_PIN, 6: (250.0, 20.0, -10.0)}
    touches = [
        JointTouch(pivoting(tip, angles, pin=place), 3, pin)
        for pin, place in pins.items()
        for angles in TILTS
    ]
    result = solve_joint(touches)
    assert result.tools[3].offset.components()[:3] == pytest.approx(tip)
    assert {pin: pytest.approx(place) for pin, place in result.pins_mm.items()} == pins
    assert result.tools[3].measured == ("x_mm", "y_mm", "z_mm")


def test_one_tool_on_one_pin_is_the_usual_fit():
    flat = planar(np.random.default_rng(1), 0.05, tools=(1,))
    alone = solve_n_angle([touch.flange for touch in flat])
    joint = solve_joint(flat).tools[1]
    assert xy(joint) == pytest.approx(xy(alone))
    assert np.array(joint.covariance) == pytest.approx(np.array(alone.covariance), abs=1e-9)
    assert np.array(joint.residuals_mm) == pytest.approx(np.array(alone.residuals_mm), abs=1e-9)
    poses = shaken(
        [pivoting((4, -8, 130), t) for t in TILTS], np.random.default_rng(2), 0.1, axes=3
    )
    space = solve_joint([JointTouch(pose, 1) for pose in poses]).tools[1]
    assert space.half_width95 == pytest.approx(solve_pivot(poses).half_width95)


def test_a_tool_with_one_touch_is_found_through_the_pin_of_another():
    touches = [*planar(tools=(1,)), JointTouch(touching(TIPS[2], 45.0), 2)]
    assert xy(solve_joint(touches).tools[2]) == pytest.approx(TIPS[2])


def test_the_difference_of_tools_is_known_better_than_each():
    touches = planar(np.random.default_rng(1), 0.05)
    # All angles near each other: the pin mixes with both offsets alike.
    near = [JointTouch(touching(TIPS[t], a), t) for t in TIPS for a in (0.0, 25.0, 50.0)]
    result = solve_joint(near, sigma_mm=0.05)
    difference = result.difference(1, 2)
    assert difference.vector_mm == pytest.approx((32.4, -8.3))
    # Six placements at three angles: three differences of two remain.
    assert difference.half_width95_mm == pytest.approx([1.959964 * 0.05 * (2 / 3) ** 0.5] * 2)
    assert max(difference.half_width95_mm) < 0.7 * max(result.tools[1].half_width95)
    assert solve_joint(touches).difference(2, 1).vector_mm == pytest.approx((-32.4, 8.3), abs=0.2)


def test_without_residual_or_sigma_a_difference_has_no_interval():
    touches = [JointTouch(touching(TIPS[1], a), 1) for a in (0.0, 180.0)]
    result = solve_joint([*touches, JointTouch(touching(TIPS[2], 0.0), 2)])
    assert result.difference(1, 2).half_width95_mm == ()
    assert result.tools[2].half_width95 == ()


def test_what_cannot_be_told_apart_is_refused():
    with refused("rank_deficient"):
        solve_joint([JointTouch(touching(TIPS[t], 30.0), t) for t in (1, 2, 1)])
    with refused("insufficient_rotation"):
        solve_joint([JointTouch(touching(TIPS[1], a), 1) for a in (0.0, 0.2, 0.4)])
    with refused("too_few_poses"):
        solve_joint([JointTouch(touching(TIPS[t], 0.0), t) for t in (1, 2)])


def test_the_intervals_of_offsets_and_difference_hold_the_truth(trials):
    rng, hits = np.random.default_rng(4), np.zeros(6)
    truth = np.array([*TIPS[1], *TIPS[2], 32.4, -8.3])
    for _ in range(trials):
        result = solve_joint(planar(rng, 0.05))
        difference = result.difference(1, 2)
        found = [*xy(result.tools[1]), *xy(result.tools[2]), *difference.vector_mm]
        halves = [
            *result.tools[1].half_width95,
            *result.tools[2].half_width95,
            *difference.half_width95_mm,
        ]
        hits += np.abs(np.array(found) - truth) <= np.array(halves)
    assert_honest(hits / trials, trials)


# The largest set of poses that agree, whichever of the samples are followed together.

KINDS = [(threshold, outliers) for threshold in (0.12, 0.16, 0.3) for outliers in (0.0, 0.1, 0.3)]


def agreement_of(seed, outliers, monkeypatch):
    """Return the search's criterion for touches of one point, some of them elsewhere."""
    random = np.random.default_rng(seed)
    count = int(random.integers(6, 40))
    turned = quaternion_rotations(random.normal(size=(count, 4)) * (0.3, 0.3, 1.0, 1.0))
    positions = np.array([350.0, -120.0, 85.0]) - turned @ np.array([4.2, -7.9, 131.6])
    positions += random.normal(0, 0.1, positions.shape)
    spoilt = random.permutation(count)[: int(outliers * count)]
    positions[spoilt] += random.normal(0, random.choice([0.5, 3.0, 30.0]), (len(spoilt), 3))
    asked = []
    with monkeypatch.context() as seen:
        seen.setattr(
            pivot, "largest_consensus", lambda agreement, *_, **__: asked.append(agreement)
        )
        pivot.pivot_consensus(positions, turned, Robust(), sigma_mm=None)
    return asked[0]


@pytest.mark.parametrize("seed", range(len(KINDS)))
def test_samples_that_begin_with_the_same_set_end_as_each_would_by_itself(seed, monkeypatch):
    threshold, outliers = KINDS[seed]
    agreement = agreement_of(seed, outliers, monkeypatch)
    robust, samples = Robust(), draw_poses(agreement.count, 3, 25, seed)
    together = _best_set(agreement, samples, robust, threshold, {})
    each = [_best_set(agreement, samples[n : n + 1], robust, threshold, {}) for n in range(25)]
    ends = [end for end in each if end is not None]
    assert together is not None
    best = min(ends, key=lambda end: end[:2])
    assert together[0] == best[0]
    assert together[1] == pytest.approx(best[1], rel=1e-9)
