"""One tip on one point in many orientations of a six-axis robot."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from robolink.calibration import Robust, fit_pivot, pivot_design, solve_pivot
from robolink.calibration.core.rotations import pose_arrays
from robolink.calibration.pin.pivot import QR_ABOVE_CONDITION, _by_normal_equations, _by_qr
from robolink.model import ToolOffset
from tests.calibration._simulated import (
    PIN,
    assert_about,
    assert_honest,
    coverage,
    pivoting,
    refused,
    rotation,
    shaken,
)

TIP = (4.2, -7.9, 131.6)


def cone(count, half_deg=30.0, spin=True):
    """Orientations on a cone, each turned about the tool besides."""
    found = []
    for k in range(count):
        lean = Rotation.from_euler("z", 360 * k / count, degrees=True)
        tilt = lean * Rotation.from_euler("y", half_deg, degrees=True) * lean.inv()
        turned = tilt * Rotation.from_euler("z", 137.5 * k if spin else 0.0, degrees=True)
        found.append(tuple(turned.as_euler("ZYX", degrees=True)))
    return found


def poses_on(count=12, half_deg=30.0, sigma_mm=0.0, seed=1, **more):
    exact = [pivoting(TIP, angles) for angles in cone(count, half_deg, **more)]
    return shaken(exact, np.random.default_rng(seed), sigma_mm, axes=3) if sigma_mm else exact


def xyz(result):
    return result.offset.components()[:3]


def test_exact_poses_give_tip_and_point():
    result = solve_pivot(poses_on(), stored=ToolOffset(0, 0, 0, 7, 8, 9))
    assert xyz(result) == pytest.approx(TIP, abs=1e-9)
    assert result.reference_point_mm == pytest.approx(PIN, abs=1e-9)
    assert result.offset.components()[3:] == (7, 8, 9)
    assert result.warnings == ()


def test_the_order_of_the_angles_is_u_then_v_then_w():
    pose = pivoting(TIP, (35, 20, -50))
    _, (ours,) = pose_arrays([pose])
    assert ours == pytest.approx(rotation(35, 20, -50), abs=1e-12)
    expected = Rotation.from_euler("ZYX", [35, 20, -50], degrees=True).as_matrix()
    assert ours == pytest.approx(expected, abs=1e-12)


def test_the_fit_and_its_covariance_are_those_of_scipy():
    poses = poses_on(sigma_mm=0.1)
    p, r = pose_arrays(poses)
    oracle = least_squares(
        lambda x: (p + r @ x[:3] - x[3:]).ravel(), np.zeros(6), method="lm", xtol=1e-15, ftol=1e-15
    )
    result = solve_pivot(poses)
    assert xyz(result) == pytest.approx(oracle.x[:3], abs=1e-6)
    assert result.reference_point_mm == pytest.approx(oracle.x[3:], abs=1e-6)
    expected = 2 * oracle.cost / 30 * np.linalg.inv(oracle.jac.T @ oracle.jac)[:3, :3]
    assert np.array(result.covariance) == pytest.approx(expected, rel=1e-5, abs=1e-9)
    assert result.rms_mm == pytest.approx(math.sqrt(2 * oracle.cost / 12))
    assert result.condition_number == pytest.approx(np.linalg.cond(oracle.jac), rel=1e-5)
    assert (result.rank, result.dof) == (6, 30)


def test_the_design_is_that_of_the_whole_system():
    _, r = pose_arrays(poses_on(7, 20))
    whole = np.hstack([r.reshape(-1, 3), np.tile(-np.eye(3), (7, 1))])
    design = pivot_design(r)
    assert design.smallest_singular_value == pytest.approx(
        np.linalg.svd(whole, compute_uv=False)[-1]
    )
    assert design.unit_covariance == pytest.approx(np.linalg.inv(whole.T @ whole)[:3, :3])


@pytest.mark.parametrize("half_deg", [1.0, 10.0])
def test_both_ways_to_solve_agree_and_the_bad_case_takes_qr(half_deg):
    p, r = pose_arrays(poses_on(sigma_mm=0.01, half_deg=half_deg))
    design = pivot_design(r)
    assert (design.condition_number > QR_ABOVE_CONDITION) == (half_deg == 1.0)
    by_qr, _ = _by_qr(p, r, r.mean(axis=0))
    normal, _ = _by_normal_equations(p, r, r.mean(axis=0))
    assert normal == pytest.approx(by_qr, abs=1e-9)
    chosen = fit_pivot(p, r, condition_number=design.condition_number)
    assert np.array_equal(chosen.tip, by_qr if half_deg == 1.0 else normal)


def test_qr_keeps_digits_where_the_normal_equations_lose_them():
    p, r = pose_arrays(poses_on(half_deg=0.0005))
    tips = [solve(p, r, r.mean(axis=0))[0] for solve in (_by_qr, _by_normal_equations)]
    errors = [float(np.linalg.norm(tip - TIP)) for tip in tips]
    assert errors[0] < errors[1] / 10


@pytest.mark.parametrize(("half_deg", "condition"), [(5, 23), (15, 7.6), (30, 3.7)])
def test_the_condition_is_what_the_cone_allows(half_deg, condition):
    _, r = pose_arrays(poses_on(24, half_deg))
    assert pivot_design(r).condition_number == pytest.approx(condition, rel=0.03)


def test_a_small_cone_is_warned_of_and_a_tiny_one_refused_with_its_gain():
    assert "small_rotation" in solve_pivot(poses_on(24, 5)).warnings
    with refused("insufficient_rotation") as caught:
        solve_pivot(poses_on(24, 0.5))
    assert "along Z" in caught.value.what
    assert solve_pivot(poses_on(24, 0.5), max_condition=1000).rank == 6


def test_turning_about_one_axis_names_the_axis_and_offers_the_plane():
    poses = [pivoting(TIP, (angle, 0, 0)) for angle in (0, 60, 120, 200)]
    with refused("rank_deficient") as caught:
        solve_pivot(poses)
    assert "along Z" in caught.value.what
    assert "n-angle" in caught.value.remedy


def test_an_oblique_axis_is_told_by_its_direction():
    lean = rotation(0, 45, 0)
    turned = [rotation(0, 45, 0) @ rotation(a, 0, 0) @ lean.T for a in (0, 70, 140, 210)]
    angles = [tuple(Rotation.from_matrix(m).as_euler("ZYX", degrees=True)) for m in turned]
    with refused("rank_deficient") as caught:
        solve_pivot([pivoting(TIP, a) for a in angles])
    assert "0.71" in caught.value.what


def test_three_poses_have_three_degrees_of_freedom():
    result = solve_pivot(poses_on(3, sigma_mm=0.05))
    assert result.dof == 3
    assert "few_poses" in result.warnings
    with refused("too_few_poses"):
        solve_pivot(poses_on(2))


@pytest.mark.parametrize("options", [{"threshold_mm": 0.5}, {}])
def test_outliers_are_left_out_and_named(options):
    poses = poses_on(20, sigma_mm=0.05)
    for index in (3, 8, 15):
        poses[index] = replace(poses[index], z_mm=poses[index].z_mm + 5 + index)
    result = solve_pivot(poses, robust=Robust(**options))
    good = solve_pivot([pose for index, pose in enumerate(poses) if index not in (3, 8, 15)])
    assert result.rejected == (3, 8, 15)
    assert xyz(result) == pytest.approx(xyz(good), abs=1e-9)
    assert result.dof == good.dof
    assert solve_pivot(poses, robust=Robust(**options)) == result


def test_a_stated_sigma_sets_the_threshold():
    poses = poses_on(20, sigma_mm=0.05, seed=2)
    poses[4] = replace(poses[4], x_mm=poses[4].x_mm + 3)
    assert solve_pivot(poses, robust=Robust(), sigma_mm=0.05).rejected == (4,)
    assert solve_pivot(poses, robust=Robust(), sigma_mm=2.0).rejected == ()


def test_more_than_a_third_of_outliers_is_refused():
    poses = poses_on(9, sigma_mm=0.01)
    for index in (0, 2, 4, 6):
        poses[index] = replace(poses[index], x_mm=poses[index].x_mm + 10 * (index + 1))
    with refused("too_many_outliers"):
        solve_pivot(poses, robust=Robust(threshold_mm=0.2))
    with refused("robust_too_few"):
        solve_pivot(poses_on(6), robust=Robust())


@pytest.mark.parametrize("stated", [None, 0.1])
@pytest.mark.parametrize("count", [3, 4, 8])
def test_the_interval_holds_the_truth(count, stated, trials):
    exact = poses_on(count)

    def measure(rng):
        return solve_pivot(shaken(exact, rng, 0.1, axes=3), sigma_mm=stated)

    assert_honest(
        coverage(measure, TIP, trials),
        trials,
        stated=stated is not None,
    )


def test_a_robust_fit_is_less_honest_refuses_nothing_good_and_that_is_known(trials):
    exact = poses_on(8)

    def measure(rng):
        return solve_pivot(shaken(exact, rng, 0.1, axes=3), robust=Robust())

    shares = coverage(measure, TIP, trials)
    sys.stdout.write(f"robust pivot, 8 poses, no outlier: {shares}\n")
    assert_about(shares, 0.945, trials)
