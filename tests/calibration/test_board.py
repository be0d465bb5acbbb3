"""A held board from two or more fiducials, and its uncertainty from the camera that saw it."""

import cmath
import math
import random

import numpy as np
import pytest
from scipy.optimize import least_squares

from robolink.calibration import (
    CameraModel,
    Sighting,
    solve_board,
    solve_board_fit,
    solve_board_round,
)
from robolink.model import Hand, Pose, ToolOffset, angle_difference_deg, rotate_xy
from tests.calibration._seed_routines import calc_board_tool
from tests.calibration._simulated import assert_honest, coverage, refused

# A held board from two fiducials, and from more.

POSES = ((280.0, 60.0, 15.0), (220.0, 36.0, -75.0), (250.0, 90.0, 100.0), (260.0, 30.0, 200.0))
DRAWING = ((0.0, 0.0), (40.0, 0.0), (40.0, 25.0), (5.0, 25.0))
BOARD = (3.0, -2.0, 21.8)


def seen_at(place, pose, noise=(0.0, 0.0), hand=None):
    """Return the sighting of a point at ``place`` in the flange's axes."""
    dx, dy = rotate_xy(place[0], place[1], pose[2])
    flange = Pose(pose[0], pose[1], 0, pose[2], hand=hand, tool=0)
    return Sighting(flange, pose[0] + dx + noise[0], pose[1] + dy + noise[1])


def fiducials(count=4, noise=None):
    found = []
    for index in range(count):
        dx, dy = rotate_xy(*DRAWING[index], BOARD[2])
        shake = (0.0, 0.0) if noise is None else tuple(noise[index])
        found.append(seen_at((BOARD[0] + dx, BOARD[1] + dy), POSES[index], shake))
    return found


def xyu(result):
    return (result.offset.x_mm, result.offset.y_mm, result.offset.u_deg)


def pair(f1=(7.0, 4.5), f2=(-3.0, 0.5), **more):
    return seen_at(f1, POSES[0], **more), seen_at(f2, POSES[1])


def test_the_direction_runs_from_the_second_to_the_first():
    result = solve_board(*pair())
    assert xyu(result) == pytest.approx((2.0, 2.5, 21.80140948635181), abs=1e-9)
    first, second = pair()
    turned = solve_board(second, first)
    assert abs(angle_difference_deg(turned.offset.u_deg, result.offset.u_deg)) == pytest.approx(180)


@pytest.mark.parametrize("cases", [1_000, pytest.param(10_000, marks=pytest.mark.soak)])
def test_it_agrees_with_the_seed_s_routine_on_random_cases(cases):
    rng = random.Random(3)
    worst_mm = worst_deg = 0.0
    for _ in range(cases):
        poses = [
            (rng.uniform(100, 400), rng.uniform(-300, 300), rng.uniform(-360, 360))
            for _ in range(2)
        ]
        marks = [(p[0] + rng.uniform(-60, 60), p[1] + rng.uniform(-60, 60)) for p in poses]
        x, y, u = calc_board_tool(marks[0], poses[0], marks[1], poses[1])
        sights = [
            Sighting(Pose(p[0], p[1], 0, p[2]), *m) for p, m in zip(poses, marks, strict=True)
        ]
        if math.dist(sights[0].in_flange_mm(), sights[1].in_flange_mm()) < 5:
            continue
        got = xyu(solve_board(*sights))
        worst_mm = max(worst_mm, math.dist(got[:2], (x, y)))
        worst_deg = max(worst_deg, abs(angle_difference_deg(got[2], u)))
    assert worst_mm < 1e-10
    assert worst_deg < 1e-9


def test_the_spacing_is_checked():
    with refused("coincident_fiducials"):
        solve_board(*pair(f1=(1, 1), f2=(1, 5)))
    spacing = math.hypot(10, 4)
    assert solve_board(*pair(), spacing_mm=spacing * 1.009).measured == ("x_mm", "y_mm", "u_deg")
    for wrong in (spacing * 1.02, 0.0):
        with refused("spacing_mismatch"):
            solve_board(*pair(), spacing_mm=wrong)


def test_two_hands_are_refused_or_warned_of():
    first, _ = pair(hand=Hand.LEFT)
    second = seen_at((-3, 0.5), POSES[1], hand=Hand.RIGHT)
    with refused("mixed_hand"):
        solve_board(first, second)
    assert solve_board(first, second, allow_mixed_hand=True).warnings == ("mixed_hand",)


def test_what_is_not_measured_is_kept():
    result = solve_board(*pair(), stored=ToolOffset(9, 9, -7, 5, 1, 2))
    assert (result.offset.z_mm, result.offset.v_deg, result.offset.w_deg) == (-7, 1, 2)


def test_exact_fiducials_give_the_drawing_s_place():
    for count in (2, 3, 4):
        result = solve_board_fit(fiducials(count), DRAWING[:count])
        assert xyu(result) == pytest.approx(BOARD, abs=1e-9)
        assert result.rms_mm == pytest.approx(0, abs=1e-9)
        assert result.dof == 2 * count - 3


def test_two_fiducials_of_a_centred_drawing_agree_with_the_two_fiducial_method():
    half = math.hypot(10, 4) / 2
    fit = solve_board_fit(pair(), [(half, 0), (-half, 0)])
    assert xyu(fit) == pytest.approx(xyu(solve_board(*pair())), abs=1e-9)


def test_the_fit_and_its_covariance_are_those_of_scipy():
    noise = np.random.default_rng(2).normal(0, 0.05, (4, 2))
    sights = fiducials(noise=noise)
    places = [sight.in_flange_mm() for sight in sights]

    def misses(x):
        laid = [rotate_xy(*d, x[2]) for d in DRAWING]
        return np.ravel(
            [(p[0] - x[0] - a[0], p[1] - x[1] - a[1]) for p, a in zip(places, laid, strict=True)]
        )

    oracle = least_squares(misses, BOARD, x_scale=[1, 1, 50], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    result = solve_board_fit(sights, DRAWING)
    assert xyu(result) == pytest.approx(oracle.x, abs=1e-6)
    expected = 2 * oracle.cost / 5 * np.linalg.inv(oracle.jac.T @ oracle.jac)
    assert np.array(result.covariance) == pytest.approx(expected, rel=2e-2, abs=1e-5)
    assert result.residual_distances_mm == pytest.approx(
        np.hypot(*misses(oracle.x).reshape(4, 2).T), abs=1e-6
    )


def test_marks_in_the_wrong_order_or_scale_do_not_fit():
    with refused("spacing_mismatch"):
        solve_board_fit(fiducials(), [DRAWING[i] for i in (2, 0, 1, 3)])
    with refused("spacing_mismatch"):
        solve_board_fit(fiducials(), [(x * 1.02, y * 1.02) for x, y in DRAWING])
    with refused("coincident_fiducials"):
        solve_board_fit(fiducials(3), [(x / 20, y / 20) for x, y in DRAWING[:3]])
    with refused("too_few_poses"):
        solve_board_fit(fiducials(1), DRAWING[:1])
    with pytest.raises(ValueError, match="3 sightings for 4 places"):
        solve_board_fit(fiducials(3), DRAWING)


def test_the_intervals_of_two_fiducials_hold_the_truth_with_the_stated_sigma(trials):
    spread = 0.02

    def measure(rng):
        shake = rng.normal(0, spread, (2, 2))
        first = seen_at((17.0, 4.5), POSES[0], shake[0])
        return solve_board(first, seen_at((-13.0, 0.5), POSES[1], shake[1]), sigma_mm=spread)

    truth = (2.0, 2.5, math.degrees(math.atan2(4, 30)))
    assert_honest(coverage(measure, truth, trials), trials)


@pytest.mark.parametrize(
    ("stated", "count"),
    [
        (None, 3),
        (0.02, 4),
        pytest.param(None, 4, marks=pytest.mark.soak),
        pytest.param(0.02, 3, marks=pytest.mark.soak),
    ],
)
def test_the_intervals_of_a_fit_hold_the_truth(count, stated, trials):
    def measure(rng):
        sights = fiducials(count, rng.normal(0, 0.02, (4, 2)))
        return solve_board_fit(sights, DRAWING[:count], sigma_mm=stated)

    assert_honest(coverage(measure, BOARD, trials), trials, stated=stated is not None)


# The uncertainty that a board has from the camera that saw it.

CAMERA = CameraModel(
    ((0.02, 0.0), (0.0, -0.02)),
    (0.0, 0.0),
    centre_mm=(100.0, 50.0),
    place_sigma_mm=0.02,
    scale_sigma=0.002,
)
CENTRE = complex(100.0, 50.0)
SEEN_BOARD = ((0.0, 0.0), (40.0, 0.0), (10.0, 30.0), (35.0, 25.0))


def seen_by_a_camera_that_is_off(angles, drawing, place=0j, turn=0j, turned_deg=10.0):
    """Fiducials of a board that is held at (5, -3), turned by 10 degrees, below the camera."""
    tool, looks = ToolOffset(5.0, -3.0, 0.0, turned_deg), []
    for u_deg in angles:
        for d in drawing:
            at = complex(*rotate_xy(d[0], d[1], tool.u_deg)) + complex(tool.x_mm, tool.y_mm)
            beside = at * cmath.exp(1j * math.radians(u_deg))
            flange = Pose(100.0 - beside.real + d[0] / 8, 50.0 - beside.imag, 0.0, u_deg)
            true = complex(flange.x_mm, flange.y_mm) + beside
            seen = true + place + turn * (true - CENTRE)
            looks.append(Sighting(flange, seen.real, seen.imag))
    return looks


@pytest.mark.parametrize(
    ("angles", "drawing", "solve"),
    [
        ((30.0,), SEEN_BOARD[:2], lambda looks, **k: solve_board(*looks, **k)),
        ((30.0,), SEEN_BOARD, lambda looks, **k: solve_board_fit(looks, SEEN_BOARD, **k)),
        ((30.0,), SEEN_BOARD, lambda looks, **k: solve_board_round(looks, SEEN_BOARD, **k)),
        ((0.0, 90.0), SEEN_BOARD, lambda looks, **k: solve_board_round(looks, SEEN_BOARD * 2, **k)),
        ((0.0, 90.0), SEEN_BOARD, lambda looks, **k: solve_board_fit(looks, SEEN_BOARD * 2, **k)),
    ],
)
def test_a_board_carries_what_its_camera_is_unsure_of(angles, drawing, solve):
    """The stated part equals the covariance of results with cameras that are off by as much.

    The camera's place and scale are each off in two directions, independently; a result moves
    along with each, so what one standard deviation of each does makes up the covariance.
    """
    exact = seen_by_a_camera_that_is_off(angles, drawing)
    told = np.array(solve(exact, sigma_mm=1e-9, camera=CAMERA).covariance)
    moves = []
    for b, e in ((0.02, 0), (0.02j, 0), (0, 0.002), (0, 0.002j)):
        ahead, behind = (
            np.array(xyu(solve(seen_by_a_camera_that_is_off(angles, drawing, way * b, way * e))))
            for way in (1, -1)
        )
        moves.append((ahead - behind) / 2)
    found = np.transpose(moves) @ np.array(moves)
    size = np.sqrt(np.maximum(np.diag(found), 1e-12))
    assert told / np.outer(size, size) == pytest.approx(found / np.outer(size, size), abs=0.03)


def test_a_board_is_no_surer_than_the_camera_that_saw_it():
    looks = seen_by_a_camera_that_is_off((30.0,), SEEN_BOARD[:2])
    plain = solve_board(*looks, sigma_mm=0.001)
    result = solve_board(*looks, sigma_mm=0.001, camera=CAMERA)
    assert plain.half95_mm is not None
    assert plain.half95_mm < 0.002
    assert result.half95_mm is not None
    assert result.region95_radius_mm is not None
    assert result.budget is not None
    assert 0.039 < result.half95_mm < 0.05
    assert result.region95_radius_mm > 1.2 * result.half95_mm
    assert [row.kind for row in result.budget.rows] == ["B", "B"]
    assert result.budget.rows[-1].name == "place and scale of the camera"
    # The robot brings both marks near the centre, 5 of 40 mm apart: that share of the camera's own
    # direction counts, and nothing of its place.
    own_deg = math.degrees(math.hypot(0.002 * 5 / 40, math.sqrt(2) * 0.001 / 40))
    assert result.half_width95[2] == pytest.approx(1.96 * own_deg, rel=0.01)
    # Looks over a whole turn find the error of the camera's place.
    twice = seen_by_a_camera_that_is_off((0.0, 180.0), SEEN_BOARD)
    sure = CameraModel(CAMERA.mm_per_px, (0.0, 0.0), (100.0, 50.0), 0.02, 0.0)
    alone = solve_board_round(twice, SEEN_BOARD * 2, sigma_mm=0.001)
    found = solve_board_round(twice, SEEN_BOARD * 2, sigma_mm=0.001, camera=sure)
    assert found.half95_mm == pytest.approx(alone.half95_mm, rel=1e-3)


@pytest.mark.parametrize(
    "solve",
    [
        lambda looks: solve_board(*looks[:2], sigma_mm=1e-9, camera=CAMERA),
        lambda looks: solve_board_fit(looks, SEEN_BOARD, sigma_mm=1e-9, camera=CAMERA),
    ],
)
def test_a_board_that_hangs_the_wrong_way_round_is_known_as_well_as_any(solve):
    """At 180 degrees, where angles continue at -180."""
    some, other = (
        solve(seen_by_a_camera_that_is_off((30.0,), SEEN_BOARD, turned_deg=turned_deg)).covariance[
            2
        ][2]
        for turned_deg in (10.0, 180.0)
    )
    assert other == pytest.approx(some, rel=1e-3)
