"""One tip on one point in many orientations, from poses and with a person at the pin."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from robolink.calibration import Robust, fit_pivot, pivot_design, rotation_of, solve_pivot
from robolink.calibration.core.rotations import pose_arrays
from robolink.calibration.pin.pivot import QR_ABOVE_CONDITION, _by_normal_equations, _by_qr
from robolink.errors import CalibrationError
from robolink.methods import (
    OverPin,
    PivotSource,
    Tilt,
    informative_tilts,
    measure_pivot,
    verify_by_tilting,
)
from robolink.methods.pivot.tilts import proving_tilts
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import SamplingPolicy, touches_of
from robolink.runner import TakenAgainError
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
from tests.calibration._tilting_person import (
    FRAMES,
    PLAN,
    STORED,
    UPRIGHT,
    Person,
    tip_mm,
    turned_deg,
)
from tests.calibration._tilting_person import PIN as TILTED_PIN
from tests.calibration._tilting_person import TIP as TILTED_TIP

# One tip on one point in many orientations of a six-axis robot.

TIP = (4.2, -7.9, 131.6)


def cone(count, half_deg=30.0, spin=True):
    """Return orientations on a cone, each also turned about the tool."""
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


@pytest.mark.parametrize(
    ("count", "stated"),
    [
        (3, None),
        (8, 0.1),
        pytest.param(3, 0.1, marks=pytest.mark.soak),
        pytest.param(8, None, marks=pytest.mark.soak),
        *(pytest.param(4, stated, marks=pytest.mark.soak) for stated in (None, 0.1)),
    ],
)
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


# A pivot with a person at the pin: the way there, what it tells, the truth in its interval.
#
# One tilted touch made again when the measurement has ended, and while it goes on.


def course(person, *, count=6, tilt_deg=20.0, sigma_mm=None, **how):
    tilts = informative_tilts(count - 1, tilt_deg)
    return person.run(
        measure_pivot(
            PLAN, tilts=tilts, stored=STORED, sigma_mm=sigma_mm, sampling=SamplingPolicy(**how)
        )
    )


@pytest.mark.parametrize("start", FRAMES)
def test_exact_touches_give_the_tip_and_the_pin_whichever_way_the_flange_points(start):
    person = Person(start, sigma_mm=0.0)
    result = course(person)
    assert result.offset.components()[:3] == pytest.approx(TILTED_TIP.components()[:3], abs=1e-9)
    assert result.reference_point_mm == pytest.approx(TILTED_PIN.tolist(), abs=1e-9)
    assert result.condition_number < 10
    assert {pose.hand for pose in person.touches} == {start.hand}


@pytest.mark.parametrize("start", FRAMES)
def test_it_tilts_in_the_air_only_in_small_steps_and_never_far_from_above_the_pin(start):
    person = Person(start)
    course(person)
    for step, here, there in person.steps:
        if step.path is Path.STRAIGHT:
            assert there.coordinates()[:2] == here.coordinates()[:2]
            assert turned_deg(here, there) == pytest.approx(0.0, abs=1e-4)
            continue
        # The stored tip, which guides the robot, is 0.7 mm from the true one; the robot stops up to
        # 1.2 mm from the pin.
        assert tip_mm(there)[2] > TILTED_PIN[2] + PLAN.lift_mm - 0.5
        assert math.dist(tip_mm(there)[:2], TILTED_PIN[:2]) < 2.7
        same_lean = rotation_of(here)[2] == pytest.approx(rotation_of(there)[2], abs=1e-9)
        assert same_lean or turned_deg(here, there) <= 10.0 + 1e-6
    assert rotation_of(there) == pytest.approx(rotation_of(person.touches[0]), abs=1e-9)
    assert tip_mm(there)[2] == pytest.approx(TILTED_PIN[2] + PLAN.lift_mm, abs=0.1)


def test_it_tells_what_three_lengths_are_repeatable_to_and_ends_when_that_is_enough():
    person = Person()
    result = course(person, count=12, until_mm=0.1)
    assert person.told[0].startswith("3 touches agree within")
    assert "X, Y and Z: repeatable to" in person.told[0]
    assert "One more at U" in person.told[0]
    assert "touches were taken" in person.told[-1]
    assert 4 <= len(result.inputs) < 12


@pytest.mark.parametrize("slip", [1, 4])
def test_the_pose_that_fits_worst_is_taken_again_in_the_same_orientation(slip):
    person = Person(slips=[slip], accepts=1)
    result = course(person, count=8, retake=True)
    assert f"Touch {slip} at U" in person.offers[0]
    assert len(person.touches) == 9
    again, first = person.touches[8], person.touches[slip - 1]
    assert rotation_of(again) == pytest.approx(rotation_of(first), abs=1e-9)
    assert result.max_residual_mm < 0.05


def test_a_robot_that_does_not_take_up_the_tilt_stands_lifted_and_is_refused():
    person = Person(stiff=True)
    with pytest.raises(CalibrationError, match="degrees from the orientation") as refused:
        course(person)
    assert refused.value.code == "not_tilted"
    assert len(person.touches) == 1
    assert tip_mm(person.steps[-1][2])[2] > TILTED_PIN[2] + PLAN.lift_mm - 1.0


def leans_to_one_side(pose):
    """Return tilts to one side, for an arm that stands at a wall."""
    return float(rotation_of(pose)[0, 2]) > -0.02


def test_tilts_out_of_reach_are_replaced_by_others_before_the_tool_tilts():
    person = Person(UPRIGHT, reaches=leans_to_one_side)
    result = course(person)
    assert all(leans_to_one_side(there) for _, _, there in person.steps)
    assert "cannot be reached over this pin: out of reach. Others replace them" in person.told[0]
    assert len(person.touches) == 6
    errors = np.subtract(result.offset.components()[:3], TILTED_TIP.components()[:3])
    assert (np.abs(errors) <= result.half_width95).all()
    # If all of them are in reach, nothing is reported or replaced.
    free = Person(UPRIGHT)
    course(free)
    assert not any("cannot be reached" in text for text in free.told)


def test_an_arm_that_takes_up_hardly_any_tilt_is_refused_before_it_tilts():
    person = Person(UPRIGHT, reaches=lambda pose: turned_deg(pose, UPRIGHT) < 5)
    with pytest.raises(CalibrationError, match="out of reach") as refused:
        course(person)
    assert refused.value.code == "not_tilted"
    assert len(person.touches) == 1
    assert all(turned_deg(there, UPRIGHT) < 1e-3 for _, _, there in person.steps)


def test_a_proof_tilts_where_the_arm_can_and_else_proves_nothing():
    start = Pose(300.0, 100.0, -60.0, 87.0, 8.0, -5.0, tool=1)
    over = OverPin(start, tuple(TILTED_PIN.tolist()), ToolOffset())
    for reaches, able in ((lambda pose: abs(rotation_of(pose)[0, 2]) < 0.3, True), (bool, True)):
        person = Person(start, sigma_mm=0.0, reaches=reaches)
        proof = verify_by_tilting(PLAN, over=over, tilts=proving_tilts(20.0), tolerance_mm=0.1)
        assert person.run(proof, ToolOffset()).passed is able
        assert all(reaches(touch) for touch in person.touches)
        assert turned_deg(*person.touches[:2]) > 20
    person = Person(start, reaches=lambda pose: turned_deg(pose, start) < 5)
    with pytest.raises(CalibrationError) as refused:
        person.run(verify_by_tilting(PLAN, over=over, tilts=proving_tilts(20.0), tolerance_mm=0.1))
    assert refused.value.code == "not_tilted"
    assert person.steps == []


def test_the_interval_holds_the_truth_about_as_often_as_it_says():
    held = total = 0
    for seed in range(60):
        result = course(Person(seed=seed))
        errors = np.subtract(result.offset.components()[:3], TILTED_TIP.components()[:3])
        held += int((np.abs(errors) <= result.half_width95).sum())
        total += 3
    assert 0.90 < held / total < 0.99


@pytest.mark.parametrize("error", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.0, 0.3)])
def test_tilting_about_a_wrong_tip_shows_its_error_in_height_too(error):
    written = ToolOffset(TILTED_TIP.x_mm, TILTED_TIP.y_mm, TILTED_TIP.z_mm, 15.0, 8.0, -5.0)
    own = rotation_of(Pose(0.0, 0.0, 0.0, *written.components()[3:]))
    # In the frame of the tool the true tip is where the error says.
    x_mm, y_mm, z_mm = (own.T @ error).tolist()
    aside = ToolOffset(x_mm, y_mm, z_mm)
    start = Pose(300.0, 100.0, -60.0, 87.0, 8.0, -5.0, tool=1)
    over = OverPin(start, (300.0, 100.0, -60.0), frame=written)
    person = Person(start, sigma_mm=0.0)
    tilts = (Tilt(30.0, 20.0), Tilt(-150.0, 20.0))
    result = person.run(
        verify_by_tilting(PLAN, over=over, tilts=tilts, tolerance_mm=0.05), tip=aside
    )
    assert result.passed is not any(error)
    assert [drift.distance_mm for drift in result.drifts] == pytest.approx(
        [float(np.linalg.norm(error))] * 2, abs=1e-9
    )
    assert all((abs(drift.dz_mm) > 0.05) is any(error) for drift in result.drifts)
    assert len(person.touches) == 2
    first, second = (subject.earlier for subject in person.subjects)
    assert first == ()
    (shown,) = second
    assert (shown.off_mm, shown.within) == (result.drifts[0].distance_mm, not any(error))


TILTS = informative_tilts(4, 20.0)


def miss_mm(result):
    return math.dist(result.offset.components()[:3], TILTED_TIP.components()[:3])


class SlipsALittle(Person):
    """Slips by 0.1 mm: a larger slip is refused before the question about the write."""

    def __init__(self, slip):
        super().__init__(sigma_mm=0.0)
        self.slip, self.slip_mm = slip, 0.1

    def _error(self):
        return [self.slip_mm if len(self.touches) == self.slip else 0.0, 0.0, 0.0]


@pytest.mark.parametrize("again", [0, 3])
def test_a_tilted_touch_is_made_again_in_its_orientation_and_the_tool_ends_upright(again):
    person = SlipsALittle(again)
    first = person.run(measure_pivot(PLAN, tilts=TILTS, stored=STORED))
    assert miss_mm(first) > 0.02
    end = person.steps[-1][2]
    source = PivotSource(TILTS, PLAN)
    result = person.run(source.further_steps(end, touches_of(first), again, STORED))
    assert miss_mm(result) < 1e-6
    assert turned_deg(person.touches[-1], person.touches[again]) < 0.01
    assert rotation_of(person.steps[-1][2]) == pytest.approx(
        rotation_of(person.touches[0]), abs=1e-9
    )
    assert tip_mm(person.steps[-1][2])[2] == pytest.approx(TILTED_PIN[2] + PLAN.lift_mm, abs=0.1)


def test_a_touch_made_again_that_is_refused_leaves_the_tool_upright():
    person = SlipsALittle(-1)
    first = person.run(measure_pivot(PLAN, tilts=TILTS, stored=STORED))
    person.slip_mm, person.slip = 8.0, len(person.touches)
    source, end = PivotSource(TILTS, PLAN), person.steps[-1][2]
    again = source.further_steps(end, touches_of(first), 2, STORED)
    with pytest.raises(CalibrationError):
        person.run(again)
    assert rotation_of(person.steps[-1][2]) == pytest.approx(
        rotation_of(person.touches[0]), abs=1e-9
    )


class GoesBack(Person):
    """Asks for touch 2 again in place of the fourth."""

    def run_back(self, procedure):
        step = next(procedure)
        gone = False
        try:
            while True:
                if len(self.touches) == 3 and not gone and type(step).__name__ == "Ask":
                    gone, step = True, procedure.throw(TakenAgainError(2))
                    continue
                step = procedure.send(self._answer(step, TILTED_TIP))
        except StopIteration as finished:
            return finished.value


def test_while_it_goes_on_an_earlier_tilt_is_taken_up_again():
    person = GoesBack(slips=[2], sigma_mm=0.0)
    result = person.run_back(measure_pivot(PLAN, tilts=TILTS, stored=STORED))
    assert len(person.touches) == 6
    assert len(result.inputs) == 5
    assert miss_mm(result) < 1e-6
