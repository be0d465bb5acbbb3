"""Checks of given poses: each finds its fault and passes good poses."""

import math
from dataclasses import replace

import numpy as np
import pytest

from robolink.calibration import (
    RobotReach,
    Robust,
    StationPart,
    flange_poses,
    in_base,
    require_near,
    require_stored_scale,
    require_within_reach,
    rotation_of,
    solve_n_angle,
    solve_pivot,
    solve_two_pose,
    uvw_deg,
    with_approach_bias,
    with_station,
    writes_refused_unattended,
)
from robolink.calibration.core.pose_checks import tilted
from robolink.errors import CalibrationError, ConfigError
from robolink.model import Pose, ToolOffset
from tests.calibration._scipy_quantiles import fisher
from tests.calibration._simulated import pivoting, refused, shaken, touching

TIP = (12.3, -3.9)
TIP_3D = (4.2, -7.9, 131.6)
SPREAD = (0, 180, 90, -90, 45, -135, 135, -45)
TILTS = [
    *((0, 0, 0), (40, 30, 0), (-75, -15, 25), (120, 10, -30)),
    *((-160, -25, 5), (80, 20, 20), (20, -28, -12), (-110, 5, 28), (150, -12, -20)),
]
PLAIN = [touching(TIP, angle) for angle in SPREAD]
SPATIAL = [pivoting(TIP_3D, angles) for angles in TILTS]


def told(result):
    assert result.evidence is not None
    return result.evidence


def order_of(result):
    assert told(result).run_order is not None
    return told(result).run_order


def budget_of(result):
    assert result.budget is not None
    return result.budget


def moved(poses, after, x_mm, y_mm=0.0, z_mm=0.0):
    """Return the poses for a pin that was moved after some of them."""
    return [
        replace(p, x_mm=p.x_mm + x_mm, y_mm=p.y_mm + y_mm, z_mm=p.z_mm + z_mm)
        if index >= after
        else p
        for index, p in enumerate(poses)
    ]


@pytest.mark.parametrize("after", [2, 3, 4, 5, 6])
def test_a_bumped_pin_is_found_where_it_was_bumped(after):
    poses = moved(shaken(PLAIN, np.random.default_rng(3), 0.003), after, 0.12, -0.09)
    result = solve_n_angle(poses)
    order = order_of(result)
    assert "step_in_run_order" in result.warnings
    assert order.step_after == after
    assert order.step_mm == pytest.approx((0.12, -0.09), abs=0.02)
    assert writes_refused_unattended(result) == "step_in_run_order"


def test_a_bumped_pin_is_found_in_space_too():
    poses = moved(shaken(SPATIAL, np.random.default_rng(3), 0.01, axes=3), 4, 0.3, -0.2, 0.25)
    result = solve_pivot(poses)
    assert "step_in_run_order" in result.warnings
    assert order_of(result).step_after == 4
    assert order_of(result).step_mm == pytest.approx((0.3, -0.2, 0.25), abs=0.1)


@pytest.mark.parametrize(("solve", "exact"), [(solve_n_angle, PLAIN), (solve_pivot, SPATIAL)])
def test_a_warming_arm_is_a_drift(solve, exact):
    axes = 3 if solve is solve_pivot else 2
    shaky = shaken(exact, np.random.default_rng(5), 0.003, axes=axes)
    count = len(exact) - 1
    warm = [replace(p, x_mm=p.x_mm + 0.2 * k / count) for k, p in enumerate(shaky)]
    result = solve(warm)
    assert "drift_in_run_order" in result.warnings
    assert order_of(result).drift_mm[0] == pytest.approx(0.2, abs=0.04)
    assert writes_refused_unattended(result) == "drift_in_run_order"
    assert writes_refused_unattended(solve(shaky)) == ""


def test_exact_poses_show_no_order_and_five_touches_cannot():
    for result in (solve_n_angle(PLAIN), solve_pivot(SPATIAL)):
        assert result.warnings == ()
        # Nothing scatters, so the interval rests on the resolution of the positions.
        assert result.notes == ("resolution_floor",)
        assert order_of(result).step_f == 0.0
    rough = [replace(pose, x_mm=pose.x_mm + 0.02 * (-1) ** k) for k, pose in enumerate(PLAIN)]
    assert solve_n_angle(rough[:5]).notes == ("order_not_testable",)
    assert told(solve_n_angle(rough[:5])).run_order is None


def test_a_shift_too_small_to_matter_has_its_figure_and_no_name():
    moved = [
        replace(pose, x_mm=pose.x_mm + (0.001 if k > 3 else 0.0)) for k, pose in enumerate(PLAIN)
    ]
    result = solve_n_angle(moved)
    order = order_of(result)
    assert order.step_f > 100 * order.step_f_limit
    assert order.step_mm[0] == pytest.approx(0.001, rel=0.05)
    assert result.warnings == ()


def test_the_limits_are_shared_among_the_splits():
    found, spatial = order_of(solve_n_angle(PLAIN)), order_of(solve_pivot(SPATIAL))
    assert found.step_f_limit == pytest.approx(fisher(1 - 0.01 / 7, 2, 10))
    assert found.drift_f_limit == pytest.approx(fisher(0.99, 2, 10))
    assert spatial.step_f_limit == pytest.approx(fisher(1 - 0.01 / 8, 3, 18))


@pytest.mark.parametrize(("solve", "exact"), [(solve_n_angle, PLAIN), (solve_pivot, SPATIAL)])
def test_copies_count_once(solve, exact):
    axes = 3 if solve is solve_pivot else 2
    poses = shaken(exact, np.random.default_rng(2), 0.02, axes=axes)
    once = solve(poses)
    twice = solve([*poses, poses[2], *poses[4:6]])
    count = len(poses)
    assert "duplicate_poses" in twice.warnings
    assert told(twice).duplicates == (count, count + 1, count + 2)
    assert told(twice).distinct == count
    assert (twice.dof, twice.half_width95) == (once.dof, pytest.approx(once.half_width95))
    assert twice.offset.components() == pytest.approx(once.offset.components())
    assert twice.rejected == ()
    another = replace(poses[2], x_mm=poses[2].x_mm + 0.001)
    assert told(solve([*poses, another])).duplicates == ()


def test_copies_of_one_pose_tell_nothing():
    with refused("degenerate_angles") as caught:
        solve_n_angle([PLAIN[0]] * 5)
    assert caught.value.others == ("too_few_poses",)
    with refused("too_few_poses"):
        solve_pivot([SPATIAL[0], SPATIAL[1], SPATIAL[0], SPATIAL[1]])
    with refused("robust_too_few"):
        solve_n_angle([*PLAIN[:5], *PLAIN[:5]], robust=Robust())


def test_one_angle_is_degenerate_even_where_any_rotation_is_accepted():
    shifted = [replace(PLAIN[0], x_mm=300.0 + k) for k in range(3)]
    with refused("degenerate_angles"):
        solve_n_angle(shifted, min_rotation_deg=0.0)
    with refused("degenerate_angles"):
        solve_two_pose(*shifted[:2], min_rotation_deg=0.0)


def test_a_pose_that_decides_alone_is_named():
    lonely = [touching(TIP, angle) for angle in (0, 10, 20, 30, 180)]
    result = solve_n_angle(lonely)
    assert told(result).high_leverage == (4,)
    assert sum(told(result).leverage) == pytest.approx(2.0)
    assert "high_leverage" not in solve_n_angle([*lonely, touching(TIP, 170)]).warnings
    flat = [(u, 0.0, 0.0) for u in (0, 60, 120, -60, 30)]
    spatial = solve_pivot(
        [pivoting(TIP_3D, angles) for angles in (*flat, (40, 40, 10), (0, 0, 40))]
    )
    assert sum(told(spatial).leverage) == pytest.approx(2.0)


@pytest.mark.parametrize(("v", "w"), [(0.0, 180.0), (180.0, 0.0), (180.0, 180.0), (1e-4, -1e-4)])
def test_a_flange_on_its_head_is_solved_and_a_leaning_one_is_not(v, w):
    tip = np.array([12.3, -3.9, 0.0])
    pin = np.array([310.0, 95.0, -40.0])

    def pose(u, lean=0.0):
        turned = Pose(0.0, 0.0, 0.0, float(u), v + lean, w)
        return replace(
            turned,
            **dict(zip(("x_mm", "y_mm", "z_mm"), pin - rotation_of(turned) @ tip, strict=True)),
        )

    poses = [
        replace(p, x_mm=float(p.x_mm), y_mm=float(p.y_mm), z_mm=float(p.z_mm))
        for p in map(pose, SPREAD)
    ]
    for result in (solve_n_angle(poses), solve_two_pose(*poses[:2]), solve_two_pose(*poses[1:3])):
        assert (result.offset.x_mm, result.offset.y_mm) == pytest.approx(TIP, abs=1e-4)
        assert result.reference_point_mm == pytest.approx((310.0, 95.0), abs=1e-4)
    leaning = [*poses[:-1], replace(poses[-1], v_deg=v + 0.02)]
    with refused("tilted_pose"):
        solve_n_angle(leaning)
    with refused("tilted_pose"):
        solve_two_pose(leaning[0], leaning[-1])


def test_some_poses_on_their_head_are_refused():
    mixed = [*PLAIN[:-1], replace(PLAIN[-1], w_deg=180.0)]
    with refused("tilted_pose"):
        solve_n_angle(mixed)
    with refused("tilted_pose"):
        solve_two_pose(mixed[0], mixed[-1])


def as_matrix(x, y, z, u, v, w):
    found = np.eye(4)
    found[:3, :3] = rotation_of(Pose(0, 0, 0, u, v, w))
    found[:3, 3] = (x, y, z)
    return found


@pytest.mark.parametrize("local", [ToolOffset(10, -20, 5, 30), ToolOffset(10, -20, 5, 30, 8, -4)])
@pytest.mark.parametrize("tool", [ToolOffset(30, 8, -15, 25), ToolOffset(30, 8, -15, 25, 40, -10)])
def test_poses_of_a_tool_in_a_local_become_flange_poses(tool, local):
    """Compared with matrices: flange = Local * pose * inverse(Tool)."""
    flange = np.array([as_matrix(*pose.coordinates()) for pose in SPATIAL])
    inverse = np.linalg.inv(as_matrix(*local.components()))
    for pose, matrix in zip(SPATIAL, inverse @ flange @ as_matrix(*tool.components()), strict=True):
        x, y, z = matrix[:3, 3].tolist()
        given = Pose(x, y, z, *uvw_deg(matrix[:3, :3]), local=2, tool=3)
        (found,) = flange_poses([given], tools={3: tool}, local_frames={2: local})
        assert as_matrix(*found.coordinates()) == pytest.approx(as_matrix(*pose.coordinates()))
        assert (found.local, found.tool) == (0, 0)
        assert flange_poses([given]) == (given,)
        assert in_base(given, local).tool == 3


def test_a_tool_that_is_not_known_is_refused_and_a_common_local_is_not():
    with refused("tool_pose"):
        solve_n_angle([replace(pose, tool=3) for pose in PLAIN])
    with refused("tool_pose"):
        solve_two_pose(*(replace(pose, tool=3) for pose in PLAIN[:2]))
    with refused("mixed_tool"):
        solve_pivot([replace(SPATIAL[0], tool=3), *SPATIAL[1:]])
    there = solve_n_angle([replace(pose, local=4) for pose in PLAIN])
    assert there.offset.components() == pytest.approx(solve_n_angle(PLAIN).offset.components())


def test_the_grid_of_the_jogs_leaves_an_interval_where_no_residual_is():
    coarse = solve_n_angle(PLAIN[:4], grid_mm=0.1)
    assert coarse.half_width95 == pytest.approx([1.959964 * 0.1 / math.sqrt(12) / 2] * 2)
    assert (coarse.interval_from, coarse.notes) == ("resolution", ("resolution_floor",))
    assert coarse.region95_radius_mm == pytest.approx(2.44775 * 0.1 / math.sqrt(12) / 2, rel=1e-5)
    pair = solve_two_pose(*PLAIN[:2], grid_mm=0.1, sigma_mm=0.001)
    assert pair.interval_from == "resolution"
    assert budget_of(pair).expanded_mm == pytest.approx(pair.half_width95[0])
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(ConfigError, match="grid_mm"):
            solve_n_angle(PLAIN, grid_mm=wrong)


def test_residuals_that_are_too_good_for_the_stated_sigma_are_doubted():
    neat = shaken(PLAIN, np.random.default_rng(1), 0.0002)
    assert "residuals_too_small" in solve_n_angle(neat, sigma_mm=0.02).warnings
    assert solve_n_angle(neat, sigma_mm=0.02, grid_mm=0.05).warnings == ()
    assert solve_n_angle(neat, sigma_mm=0.0002).warnings == ()


def test_residuals_far_beyond_the_stated_sigma_need_somebody_to_look():
    rough = shaken(PLAIN, np.random.default_rng(1), 0.02)
    assert writes_refused_unattended(solve_n_angle(rough, sigma_mm=0.002)) == "sigma_contradicted"
    assert writes_refused_unattended(solve_n_angle(rough, sigma_mm=0.02)) == ""


def test_the_uncertainty_of_a_station_is_added_as_squares():
    result = solve_n_angle(shaken(PLAIN, np.random.default_rng(1), 0.02))
    own, nu = math.sqrt(result.covariance[0][0]), 12
    wider = with_station(result, StationPart("pin", [[0.01**2, 0.0], [0.0, 0.01**2]], 8))
    assert wider.covariance[0][0] == pytest.approx(own**2 + 0.01**2)
    assert [row.kind for row in budget_of(wider).rows] == ["A", "B"]
    assert wider.half_width95[0] == pytest.approx(budget_of(wider).expanded_mm)
    effective = wider.covariance[0][0] ** 2 / (own**4 / nu + 0.01**4 / 8)
    assert budget_of(wider).nu_eff == pytest.approx(effective)
    assert (wider.region95_radius_mm or 0.0) > (result.region95_radius_mm or 0.0)


def scattered(count, tips, random):
    """Return touches, each with the tip that its index names."""
    angles = random.uniform(-180, 180, count)
    return shaken([touching(tip, u) for tip, u in zip(tips, angles, strict=True)], random, 0.02)


@pytest.mark.parametrize("count", [12, 60, 400])
def test_the_largest_set_is_the_same_whatever_the_seed(count):
    """A quarter of the touches agree on another tip; from 201 touches on, samples are drawn."""
    tips = [(14.3, -1.0) if index % 4 == 2 else TIP for index in range(count)]
    poses = scattered(count, tips, np.random.default_rng(8))
    found = [solve_n_angle(poses, robust=Robust(0.1, seeds=(seed,))) for seed in range(6)]
    assert {result.rejected for result in found} == {tuple(range(2, count, 4))}
    together = solve_n_angle(poses, robust=Robust(0.1))
    assert told(together).seed_spread_mm == 0.0
    assert told(together).consensus == count - len(range(2, count, 4))


def test_seeds_that_disagree_are_refused():
    """One draw under each of two seeds: now and then both touches are of the smaller set."""
    random = np.random.default_rng(4)
    tips = [TIP if index % 20 < 14 else (14.3, -1.0) for index in range(300)]
    poses, ends = scattered(300, tips, random), set()
    for seed in range(25):
        try:
            solve_n_angle(poses, robust=Robust(0.1, draws=1, seeds=(seed, 100 + seed)))
        except CalibrationError as error:
            ends.add(error.code)
    assert "robust_unstable" in ends


@pytest.mark.parametrize("factor", [1 / 1000, 1 / 25.4, 25.4, 1000])
def test_an_offset_in_another_unit_is_suspect(factor):
    result = solve_n_angle(PLAIN)
    length = math.hypot(*TIP)
    other = ToolOffset(TIP[0] / factor * 1.03, TIP[1] / factor * 1.03)
    if length / factor >= 1:
        with refused("suspect_units"):
            require_stored_scale(result, other)
    else:
        require_stored_scale(result, other)
    require_stored_scale(result, ToolOffset(TIP[0] / factor * 1.2, TIP[1] / factor * 1.2))
    require_stored_scale(result, None)


def test_poses_out_of_reach_are_suspect():
    require_within_reach(PLAIN, RobotReach(400.0))
    with refused("suspect_units"):
        require_within_reach(PLAIN, RobotReach(280.0))
    inches = [replace(p, x_mm=p.x_mm / 25.4, y_mm=p.y_mm / 25.4, z_mm=p.z_mm / 25.4) for p in PLAIN]
    with refused("suspect_units"):
        require_within_reach(inches, RobotReach(700.0))
    require_within_reach(inches, RobotReach(700.0, inner_mm=0.0))
    with refused("suspect_units"):
        require_near(inches, replace(PLAIN[0], x_mm=290.0))
    require_near(PLAIN, replace(PLAIN[0], x_mm=290.0))


def approached(turns, bias_mm, seed=6):
    """Return touches with a bias toward the approach direction, and their standoffs."""
    random = np.random.default_rng(seed)
    sides = [(math.cos(turn), math.sin(turn)) for turn in turns]
    poses = [
        replace(p, x_mm=p.x_mm + bias_mm * x, y_mm=p.y_mm + bias_mm * y)
        for p, (x, y) in zip(shaken(PLAIN, random, 0.01), sides, strict=True)
    ]
    return with_approach_bias(solve_n_angle(poses), sides)


def test_a_bias_toward_the_approach_is_found_when_the_sides_are_drawn():
    turns = np.random.default_rng(2).uniform(-math.pi, math.pi, 8).tolist()
    biased, fair = approached(turns, 0.06), approached(turns, 0.0)
    assert "approach_bias" in biased.warnings
    assert told(biased).approach_bias_mm == pytest.approx(0.06, abs=0.02)
    assert "approach_bias" not in fair.warnings
    assert told(fair).approach_bias_u_mm == pytest.approx(0.005, abs=0.003)
    # Three touches have six numbers, and five are told by place, tip and bias.
    three = with_approach_bias(solve_n_angle(PLAIN[:3]), [(1, 0), (0, 1), (-1, 0)])
    assert told(three).approach_bias_mm == pytest.approx(0.0, abs=1e-9)
    two = with_approach_bias(solve_n_angle(PLAIN[:2]), [(1, 0), (0, 1)])
    assert told(two).approach_bias_mm is None


def test_a_bias_that_never_turns_against_tool_or_base_cannot_be_found():
    in_the_tool = [math.radians(angle) + 0.4 for angle in SPREAD]
    for turns in (in_the_tool, [0.4] * 8):
        assert told(approached(turns, 0.06)).approach_bias_mm is None
    with pytest.raises(ValueError, match="1 standoffs for 8"):
        with_approach_bias(solve_n_angle(PLAIN), [None])
    assert told(with_approach_bias(solve_n_angle(PLAIN), [None] * 8)).approach_bias_mm is None


def test_a_touch_that_a_person_brought_from_somewhere_does_not_disturb_the_bias():
    random = np.random.default_rng(4)
    sides = [(math.cos(turn), math.sin(turn)) for turn in random.uniform(-3, 3, 8).tolist()]
    poses = [
        replace(p, x_mm=p.x_mm + 0.06 * x, y_mm=p.y_mm + 0.06 * y)
        for p, (x, y) in zip(shaken(PLAIN, random, 0.005), sides, strict=True)
    ]
    poses[0] = replace(poses[0], x_mm=poses[0].x_mm + 0.3)
    without = with_approach_bias(solve_n_angle(poses), [None, *sides[1:]])
    alone = with_approach_bias(solve_n_angle(poses[1:]), sides[1:])
    assert told(without).approach_bias_mm == pytest.approx(told(alone).approach_bias_mm, abs=1e-9)
    assert told(without).approach_bias_mm == pytest.approx(0.06, abs=0.02)
    assert "approach_bias" in without.warnings
    # Seven touches exceed three standard uncertainties by chance in a few per cent.
    strict = with_approach_bias(solve_n_angle(poses[1:]), sides[1:], false_alarm=1e-12)
    assert "approach_bias" not in strict.warnings


@pytest.mark.parametrize(("v_deg", "w_deg"), [(0.0, 0.5), (0.5, 0.0), (0.0, -0.5)])
def test_half_a_degree_about_either_axis_leans(v_deg, w_deg):
    assert tilted(Pose(0, 0, 0, 0, v_deg, w_deg))
