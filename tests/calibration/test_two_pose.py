"""Two poses, and the conclusions about spot and camera from a seen movement."""

import cmath
import math
import random

import pytest

from robolink.calibration import (
    CameraChangeRows,
    CameraModel,
    MovementVerdict,
    SeenMovement,
    camera_changed,
    same_radius,
    solve_two_pose,
    spot_changed,
    tip_did_not_move,
)
from robolink.errors import CalibrationError
from robolink.model import Hand, Pose, Spot, SpotUnit, ToolOffset, rotate_xy
from robolink.procedures.camera_watch import SpotWatch
from robolink.runner import SeenAt
from robolink.stations import CameraStation

# The two-pose solver against exact cases and against the seed's own formula.


def flange(x_mm, y_mm, u_deg, **more):
    return Pose(x_mm, y_mm, 0.0, u_deg, **{"tool": 0, **more})


def touching(pin, tip, u_deg):
    """Return the flange pose that puts ``tip`` on ``pin`` at ``u_deg``."""
    dx, dy = rotate_xy(tip[0], tip[1], u_deg)
    return flange(pin[0] - dx, pin[1] - dy, u_deg)


def xy(result):
    return (result.offset.x_mm, result.offset.y_mm)


def test_the_seed_example_gives_half_the_difference():
    result = solve_two_pose(flange(287.5, 103.25, 0), flange(312.5, 96.75, 180))
    assert xy(result) == pytest.approx((12.5, -3.25), abs=1e-9)
    assert result.reference_point_mm == pytest.approx((300, 100), abs=1e-9)
    assert result.sigma_gain == pytest.approx(1 / math.sqrt(2))


def test_poses_across_the_180_degree_seam():
    first = flange(85.19255493500165, 422.1300603398874, 179.5)
    second = flange(114.80744506499835, 377.8699396601126, -0.5)
    result = solve_two_pose(first, second)
    assert xy(result) == pytest.approx((-15, 22), abs=1e-9)
    assert result.reference_point_mm == pytest.approx((100, 400), abs=1e-9)


def test_poses_only_90_degrees_apart_cost_precision_and_say_so():
    first = flange(309.0093492025006, 62.807376534906005, -20)
    second = flange(287.192623465094, -40.990650797499406, 70)
    result = solve_two_pose(first, second)
    assert xy(result) == pytest.approx((60, -45), abs=1e-9)
    assert result.sigma_gain == pytest.approx(1.0)


@pytest.mark.parametrize("cases", [1_000, pytest.param(10_000, marks=pytest.mark.soak)])
def test_it_agrees_with_the_seeds_formula_on_random_cases(cases):
    rng = random.Random(5)
    worst = 0.0
    for _ in range(cases):
        pin = (rng.uniform(-400, 400), rng.uniform(100, 500))
        tip = (rng.uniform(-80, 80), rng.uniform(-80, 80))
        first, second = touching(pin, tip, 0.0), touching(pin, tip, 180.0)
        seed = ((second.x_mm - first.x_mm) / 2, (second.y_mm - first.y_mm) / 2)
        got = xy(solve_two_pose(first, second))
        worst = max(worst, math.dist(seed, got), math.dist(tip, got))
    assert worst < 1e-10


@pytest.mark.parametrize("start_deg", [-170.0, -33.3, 0.0, 12.5, 90.0, 179.9, 355.0])
@pytest.mark.parametrize("turn_deg", [-180.0, 45.0, 120.0, 180.0, 200.0])
def test_any_start_angle_and_swapped_poses_are_right(start_deg, turn_deg):
    pin, tip = (310.0, 95.0), (12.34, -5.6)
    first, second = touching(pin, tip, start_deg), touching(pin, tip, start_deg + turn_deg)
    for a, b in ((first, second), (second, first)):
        result = solve_two_pose(a, b)
        assert xy(result) == pytest.approx(tip, abs=1e-10)
        assert result.reference_point_mm == pytest.approx(pin, abs=1e-10)


def test_components_that_were_not_measured_are_kept_and_named():
    stored = ToolOffset(1, 2, -20.5, 33, 0, 0)
    result = solve_two_pose(flange(287.5, 103.25, 0), flange(312.5, 96.75, 180), stored=stored)
    assert (result.offset.z_mm, result.offset.u_deg) == (-20.5, 33)
    assert result.measured == ("x_mm", "y_mm")
    assert result.kept == ("z_mm", "u_deg", "v_deg", "w_deg")


REFUSED = {
    "degenerate_angles": (flange(300, 100, 10), flange(310, 100, 370)),
    "insufficient_rotation": (flange(300, 100, 0), flange(310, 100, 20)),
    "non_finite": (flange(300, math.nan, 0), flange(310, 100, 180)),
    "suspect_units": (flange(0.3, 0.1, 0), flange(0.31, 0.1, 180)),
    "mixed_local": (flange(300, 100, 0), flange(310, 100, 180, local=1)),
    "mixed_tool": (flange(300, 100, 0), flange(310, 100, 180, tool=2)),
    "mixed_hand": (flange(300, 100, 0, hand=Hand.RIGHT), flange(310, 100, 180, hand=Hand.LEFT)),
    "implausible_offset": (flange(-1500, 100, 0), flange(1500, 100, 180)),
}


@pytest.mark.parametrize("code", REFUSED)
def test_bad_input_gives_its_named_code_and_never_a_number(code):
    with pytest.raises(CalibrationError) as caught:
        solve_two_pose(*REFUSED[code])
    assert caught.value.code == code
    assert caught.value.remedy


def test_an_offline_solve_warns_of_mixed_hands_with_the_number():
    first = flange(230, -45, 0, hand=Hand.RIGHT)
    second = flange(270, -35, 180, hand=Hand.LEFT)
    result = solve_two_pose(first, second, allow_mixed_hand=True)
    assert xy(result) == pytest.approx((20, 5), abs=1e-9)
    assert result.warnings == ("mixed_hand",)


def test_a_small_rotation_is_warned_of():
    result = solve_two_pose(touching((300, 100), (10, 0), 0), touching((300, 100), (10, 0), 60))
    assert result.warnings == ("small_rotation",)


def test_the_refused_near_degenerate_case_names_its_gain():
    first = flange(290.000001, 0.0, 0.0)
    second = flange(290.0000001523087, -0.001746329243133368, 0.01)
    with pytest.raises(CalibrationError, match=r"8102\.8 times") as caught:
        solve_two_pose(first, second, min_rotation_deg=5.0)
    assert caught.value.code == "insufficient_rotation"


# Conclusions about spot and camera from a seen movement.

ROWS = CameraChangeRows()
KNOWN = (1.0, 1.0)


def seen_by(factor, known=KNOWN, noise=0.003):
    """The sighting by a camera that scales each direction by a complex factor."""
    moved = complex(*known) * factor
    return SeenMovement(known, (moved.real, moved.imag), noise)


def turned(degrees, scale=1.0):
    return cmath.rect(scale, math.radians(degrees))


@pytest.mark.parametrize(
    ("factor", "verdict"),
    [
        (1.0, MovementVerdict.AS_KNOWN),
        (turned(0.7), MovementVerdict.AS_KNOWN),
        (1.015, MovementVerdict.AS_KNOWN),
        (0.985, MovementVerdict.AS_KNOWN),
        (turned(2.0), MovementVerdict.ANOTHER),
        (turned(-10.0), MovementVerdict.ANOTHER),
        (turned(90.0), MovementVerdict.ANOTHER),
        (1.04, MovementVerdict.ANOTHER),
        (1.25, MovementVerdict.ANOTHER),
        (0.8, MovementVerdict.ANOTHER),
        (-1.0, MovementVerdict.ANOTHER),
        (0.3, MovementVerdict.NONE),
        (0.0, MovementVerdict.NONE),
    ],
)
def test_what_a_calibrated_camera_may_see_of_a_movement(factor, verdict):
    assert seen_by(factor).judged(ROWS, play_mm=0.0) is verdict


def test_play_that_was_found_is_allowed_for_up_to_a_tenth():
    off = SeenMovement(KNOWN, (1.08, 0.96), 0.003)
    assert off.judged(ROWS, play_mm=0.0) is MovementVerdict.ANOTHER
    assert off.judged(ROWS, play_mm=0.07) is MovementVerdict.AS_KNOWN
    far = SeenMovement(KNOWN, (1.25, 0.95), 0.003)
    assert far.judged(ROWS, play_mm=5.0) is MovementVerdict.ANOTHER
    assert seen_by(0.0).judged(ROWS, play_mm=5.0) is MovementVerdict.NONE


def test_a_camera_that_was_calibrated_badly_may_differ_more():
    assert seen_by(1.05).judged(CameraChangeRows(scale_sigma=0.02), play_mm=0.0) is (
        MovementVerdict.AS_KNOWN
    )
    assert ROWS.u_scale == pytest.approx(0.0065, abs=1e-4)
    assert ROWS.u_turn_deg == pytest.approx(0.2887, abs=1e-3)


@pytest.mark.parametrize("sigma_px", [0.1, 0.5])
def test_chance_alone_is_no_alarm(sigma_px):
    rng, sigma = random.Random(4), 0.02 * sigma_px
    alarms = 0
    for _ in range(2000):
        seen = (1.0 + rng.gauss(0, sigma), 1.0 + rng.gauss(0, sigma))
        verdict = SeenMovement(KNOWN, seen, sigma).judged(ROWS, play_mm=0)
        alarms += verdict is not MovementVerdict.AS_KNOWN
    # A single one leads to a closer look; only two of them in a row refuse.
    assert alarms <= 2


def test_movements_are_alike_whatever_their_length():
    whole, half = seen_by(turned(10.0)), seen_by(turned(10.0), known=(0.5, 0.5))
    assert whole.like(half, within=0.1)
    assert not seen_by(turned(10.0) + 0.4).like(half, within=0.1)
    # A spot that stands still counts as none, however wide the scatter makes the limit.
    assert not seen_by(0.0, noise=1.0).like(whole, within=0.1)
    assert whole.along(half)
    assert not whole.along(SeenMovement((1.0, -1.0), (1.0, -1.0), 0.003))


def test_a_short_movement_tells_nothing_beside_its_scatter():
    assert SeenMovement((0.2, 0.0), (0.2, 0.0), 0.015).tells
    assert not SeenMovement((0.1, 0.0), (0.1, 0.0), 0.015).tells


@pytest.mark.parametrize(
    ("radius_px", "usual_px", "same"),
    [(12.3, 12.0, True), (12.5, 12.0, False), (3.2, 3.0, True), (3.5, 3.0, False)],
)
def test_spots_of_one_width(radius_px, usual_px, same):
    assert same_radius(radius_px, usual_px) is same


def test_each_refusal_says_what_was_seen_and_what_to_look_after():
    still = tip_did_not_move(SeenMovement(KNOWN, (0.001, 0.0), 0.003), in_mm=True)
    assert "moved 1.41 mm, the spot 0.00 mm." in still.what
    assert "Clean window and tip" in still.remedy
    assert "2.0 pixels" in tip_did_not_move(SeenMovement(KNOWN, (2, 0), 0.1), in_mm=False).what
    assert "one place only" in tip_did_not_move(None, in_mm=True).what
    assert "turned by +10.0 degrees" in camera_changed(seen_by(turned(10.0))).what
    assert {one.code for one in (still, spot_changed(3.0, 4.0))} == {
        "tip_did_not_move",
        "spot_changed",
    }


@pytest.mark.parametrize("mm_per_px", [0.02, 0.5])
def test_a_tenth_of_a_pixel_is_as_long_as_the_camera_says(mm_per_px):
    model = CameraModel(((mm_per_px, 0.0), (0.0, -mm_per_px)), (0.0, 0.0))
    watch = SpotWatch(CameraStation(300.0, 80.0, -30.0, model), calibrated=True)
    before, after = (
        SeenAt.of(Pose(x_mm, 80.0, -30.0, 0.0), Spot(x_mm / mm_per_px, 0.0), SpotUnit.PIXEL)
        for x_mm in (300.0, 301.0)
    )
    movement = watch.movement(before, after)
    assert movement.seen == pytest.approx((1.0, 0.0))
    assert movement.noise == pytest.approx(math.hypot(math.sqrt(2) * 0.1 * mm_per_px, 0.005))
