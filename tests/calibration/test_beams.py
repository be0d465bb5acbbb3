"""Two crossed beams: located with a pin, then used for a needle."""

import math
from dataclasses import replace

import numpy as np
import pytest

from robolink.calibration import (
    Beam,
    Crossing,
    TipHeight,
    find_beams,
    rotation_of,
    solve_crossed_beams,
)
from robolink.methods.beams.crossings import CrossingSolver
from robolink.model import Pose, ToolOffset, angle_difference_deg, rotate_xy
from tests.calibration._simulated import assert_honest, coverage, refused

TRUE = (Beam(300.0, 80.0, 3.0), Beam(300.0, 80.0, 88.0))
TIP = (12.0, -3.5)
PIN = (0.4, -0.2)


def crossing(beam, tip, *, u_deg=0.0, way=1, along_mm=0.0, lag_mm=0.0, noise=(0, 0), beams=TRUE):
    """Move ``tip`` straight through a beam; edges come late by ``lag_mm``."""
    line = beams[beam]
    nx, ny = line.normal
    tx, ty = rotate_xy(tip[0], tip[1], u_deg)
    ends = []
    for half_mm, shake in ((-0.6, noise[0]), (0.6, noise[1])):
        across = way * (half_mm + lag_mm) + shake
        x = line.x_mm + ny * along_mm + nx * across - tx
        y = line.y_mm - nx * along_mm + ny * across - ty
        ends.append(Pose(x, y, -20, u_deg, tool=0))
    return Crossing(beam, ends[0], ends[1])


def travels(tip, *, angles=(0.0,), repeats=1, rng=None, sigma_mm=0.0, lag_mm=0.02, beams=TRUE):
    """Cross both beams in both directions at every angle."""
    found = []
    for _ in range(repeats):
        for u_deg in angles:
            for beam in (0, 1):
                for way in (1, -1):
                    noise = rng.normal(0, sigma_mm, 2) if rng else (0, 0)
                    found.append(
                        crossing(
                            beam, tip, u_deg=u_deg, way=way, lag_mm=lag_mm, noise=noise, beams=beams
                        )
                    )
    return found


def xy(result):
    return (result.offset.x_mm, result.offset.y_mm)


@pytest.mark.parametrize("u_deg", [0.0, 130.0])
def test_entry_and_exit_in_both_directions_cancel_width_and_latency(u_deg):
    result = solve_crossed_beams(travels(TIP, angles=(u_deg,)), TRUE)
    assert xy(result) == pytest.approx(TIP, abs=1e-10)
    assert result.lag_mm == pytest.approx((0.02, 0.02))
    assert result.reference_point_mm == pytest.approx((300, 80))
    assert result.warnings == ()


def test_one_direction_alone_carries_the_latency_and_says_so():
    one_way = [c for c in travels(TIP) if c.direction_over(TRUE[c.beam]) > 0]
    result = solve_crossed_beams(one_way, TRUE)
    assert math.dist(xy(result), TIP) > 0.02
    assert result.warnings == ("one_direction",)
    assert result.lag_mm == (None, None)


def test_uneven_numbers_of_directions_do_not_let_the_latency_in():
    uneven = [*travels(TIP), crossing(0, TIP, lag_mm=0.02), crossing(1, TIP, way=-1, lag_mm=0.02)]
    assert xy(solve_crossed_beams(uneven, TRUE)) == pytest.approx(TIP, abs=1e-10)


def test_a_moved_beam_is_told_from_a_moved_tip_by_turning():
    moved = (replace(TRUE[0], y_mm=80.7), replace(TRUE[1], x_mm=299.6))
    seen = travels(TIP, angles=(0.0, 180.0), beams=moved)
    assert math.dist(xy(solve_crossed_beams(seen, TRUE)), TIP) < 1e-9
    assert "large_residual" in solve_crossed_beams(seen, TRUE).warnings
    freed = solve_crossed_beams(seen, TRUE, beams_may_have_moved=True)
    assert xy(freed) == pytest.approx(TIP, abs=1e-10)
    assert freed.max_residual_mm == pytest.approx(0, abs=1e-9)
    with refused("insufficient_rotation"):
        solve_crossed_beams(travels(TIP, beams=moved), TRUE, beams_may_have_moved=True)


def pin_travels(rng=None, sigma_mm=0.0):
    found = []
    for beam in (0, 1):
        for along in (-15, -5, 5, 15):
            for way in (1, -1):
                noise = rng.normal(0, sigma_mm, 2) if rng else (0, 0)
                found.append(
                    crossing(beam, PIN, way=way, along_mm=along, lag_mm=0.03, noise=noise, u_deg=20)
                )
    return found


def distance_from(beam, true):
    nx, ny = true.normal
    return abs(nx * (beam.x_mm - true.x_mm) + ny * (beam.y_mm - true.y_mm))


def test_the_beams_are_found_with_a_pin_whose_tip_is_known():
    for beam, true in zip(find_beams(pin_travels(), PIN), TRUE, strict=True):
        turn = abs(angle_difference_deg(beam.direction_deg, true.direction_deg))
        assert min(turn, 180 - turn) == pytest.approx(0, abs=1e-9)
        assert distance_from(beam, true) == pytest.approx(0, abs=1e-9)


def test_beams_found_with_noise_serve_for_a_needle():
    beams = find_beams(pin_travels(np.random.default_rng(1), 0.01), PIN)
    assert all(distance_from(b, t) < 0.02 for b, t in zip(beams, TRUE, strict=True))
    assert math.dist(xy(solve_crossed_beams(travels(TIP), beams)), TIP) < 0.03


def test_a_pin_seen_in_one_direction_only_still_shows_the_direction():
    one_way = [c for c in pin_travels() if c.direction_over(TRUE[c.beam]) > 0]
    beams = find_beams(one_way, PIN)
    assert beams[0].direction_deg % 180 == pytest.approx(3.0)
    assert distance_from(beams[0], TRUE[0]) == pytest.approx(0.03)


def test_what_cannot_be_used_is_named():
    with refused("too_few_poses"):
        solve_crossed_beams([c for c in travels(TIP) if c.beam == 0], TRUE)
    half_turned = [*travels(TIP), *(c for c in travels(TIP, angles=(180.0,)) if c.beam == 0)]
    with refused("too_few_poses"):
        solve_crossed_beams(half_turned, TRUE, beams_may_have_moved=True)
    with refused("parallel_beams"):
        solve_crossed_beams(travels(TIP), (TRUE[0], replace(TRUE[0], direction_deg=185.0)))
    along = Crossing(0, Pose(290, 80, 0, 0), Pose(310, 81.0, 0, 0))
    with refused("no_crossing"):
        solve_crossed_beams([*travels(TIP), along], TRUE)
    turned = replace(travels(TIP)[0], exit=replace(travels(TIP)[0].exit, u_deg=5.0))
    with refused("turned_in_crossing"):
        solve_crossed_beams([*travels(TIP), turned], TRUE)
    with refused("short_beam"):
        find_beams([c for c in travels(PIN, repeats=2) for _ in (0, 1)], PIN)
    with refused("too_few_poses"):
        find_beams(travels(PIN), PIN)


@pytest.mark.parametrize(
    ("angles", "stated"),
    [
        ((0.0,), 0.02 / math.sqrt(2)),
        ((0.0, 180.0), None),
        pytest.param((0.0,), None, marks=pytest.mark.soak),
        pytest.param((0.0, 180.0), 0.02 / math.sqrt(2), marks=pytest.mark.soak),
    ],
)
def test_the_interval_holds_the_truth(angles, stated, trials):
    moved = len(angles) > 1

    def measure(rng):
        seen = travels(TIP, angles=angles, repeats=2, rng=rng, sigma_mm=0.02)
        return solve_crossed_beams(seen, TRUE, sigma_mm=stated, beams_may_have_moved=moved)

    assert_honest(coverage(measure, TIP, trials), trials, stated=stated is not None)


def needle_crossings(frame, tip, lean, *, dip_mm, beams=TRUE, dz_mm=0.0):
    """Cross both beams both ways with a tilted needle, at the height of the beams, -30.

    The frame is moved so that the expected tip, which is ``dz_mm`` shorter along the flange's axis
    than the real one, is ``dip_mm`` below the beams.
    """
    turn = rotation_of(frame)
    up = math.copysign(1.0, turn[2, 2])
    end = np.array([*tip, 20.0 * -up])
    along = np.array([*lean, up])
    expected = end - np.array([0, 0, -up * dz_mm])
    z_mm = -30.0 - dip_mm - (turn @ expected)[2]
    above_mm = (-30.0 - z_mm - (turn @ end)[2]) / (turn @ along)[2]
    seen = turn @ (end + above_mm * along)
    found = []
    for beam, line in enumerate(beams):
        nx, ny = line.normal
        for way in (1, -1):
            ends = [
                replace(
                    frame,
                    x_mm=line.x_mm + nx * way * half - seen[0],
                    y_mm=line.y_mm + ny * way * half - seen[1],
                    z_mm=z_mm,
                )
                for half in (-0.58, 0.62)
            ]
            found.append(Crossing(beam, *ends))
    return found, ToolOffset(*expected)


LEANING_FRAMES = [
    Pose(0, 0, 0, 0, tool=0),
    Pose(0, 0, 0, 130, tool=0),
    Pose(0, 0, 0, 40, 0, 180, tool=0),
    Pose(0, 0, 0, 20, 4, -6, tool=0),
    Pose(0, 0, 0, -160, -5, 176, tool=0),
]


@pytest.mark.parametrize("frame", LEANING_FRAMES)
@pytest.mark.parametrize("lean_deg", [0.5, 1.0, 1.9])
@pytest.mark.parametrize("turn_deg", [0.0, 180.0, 90.0])
def test_what_was_seen_of_a_needle_that_leans_is_brought_down_to_its_end(frame, lean_deg, turn_deg):
    slope = math.tan(math.radians(lean_deg))
    lean = slope * math.cos(0.7), slope * math.sin(0.7)
    # If it is found at two angles, moved beams do not matter.
    beams = (replace(TRUE[0], y_mm=80.3), replace(TRUE[1], x_mm=299.8)) if turn_deg else TRUE
    seen, stored = needle_crossings(frame, TIP, lean, dip_mm=1.5, beams=beams)
    if turn_deg:
        turned = replace(frame, u_deg=frame.u_deg + turn_deg)
        seen += needle_crossings(turned, TIP, lean, dip_mm=1.5, beams=beams)[0]
    deeper, _ = needle_crossings(frame, TIP, lean, dip_mm=4.5, beams=beams)
    solver = CrossingSolver(TRUE, frame, 1.5, stored, sigma_mm=0.004)
    moved = bool(turn_deg)
    found = solver.solved(seen, deeper, deeper_mm=3.0, moved=moved)
    assert xy(found) == pytest.approx(TIP, abs=1e-4)
    assert found.lean is not None
    assert (found.lean.x, found.lean.y) == pytest.approx(lean, rel=0.05)
    assert found.lean.sure
    plain = solver.solved(seen, moved=moved)
    assert math.dist(xy(plain), TIP) == pytest.approx(1.5 * slope, rel=0.25)
    # 1.5 times what was seen and half of what is deeper, once each.
    times = {0.0: 1.58, 90.0: 1.38, 180.0: 1.73}[turn_deg]
    assert found.sigma_gain / plain.sigma_gain == pytest.approx(times, abs=0.1)
    # Four crossings leave nothing over; those of the shaft, with the same lags, check them.
    assert (found.dof, plain.dof) == ((2, 2) if turn_deg else (2, 0))
    # Had it been 0.5 mm longer than expected, the interval would hold that too.
    seen, stored = needle_crossings(frame, TIP, lean, dip_mm=1.5, dz_mm=0.5)
    deeper, _ = needle_crossings(frame, TIP, lean, dip_mm=4.5, dz_mm=0.5)
    longer = CrossingSolver(TRUE, frame, 1.5, stored, sigma_mm=0.004)
    found = longer.solved(seen, deeper, deeper_mm=3.0)
    assert 0.4 * slope < math.dist(xy(found), TIP) < 0.6 * slope
    assert all(
        abs(got - true) < half
        for got, true, half in zip(xy(found), TIP, found.half_width95, strict=True)
    )


def test_the_step_of_a_latch_counts_however_often_it_repeats_itself():
    step_mm = 0.02
    for repeats in (1, 2, 5):
        result = solve_crossed_beams(
            travels(TIP, repeats=repeats), TRUE, step_mm=step_mm, sigma_mm=1e-5
        )
        assert result.interval_from == "resolution"
        assert result.half_width95[0] == pytest.approx(1.96 * step_mm / 12**0.5, rel=0.01)
    bare = solve_crossed_beams(travels(TIP, repeats=2), TRUE)
    assert bare.half_width95 == pytest.approx((0.0005, 0.0005))
    assert bare.region95_radius_mm == pytest.approx(0.0005)


@pytest.mark.parametrize(
    "frame", [Pose(0, 0, 0, 0, 9, 0, tool=0), Pose(0, 0, 0, 25, 4, -6, tool=0)]
)
def test_an_unsure_height_enters_x_and_y_as_it_moves_them(frame):
    """The uncertainty of a height counts by the shift of X and Y for a height that is 1 mm off."""
    seen, stored = needle_crossings(frame, TIP, (0.0, 0.0), dip_mm=0.0)

    def found(off_mm=0.0, sigma_mm=None):
        height = TipHeight(stored.z_mm + off_mm, sigma_mm)
        return solve_crossed_beams(seen, TRUE, sigma_mm=0.004, height=height)

    exact, unsure = found(), found(sigma_mm=0.5)
    moved = [a - b for a, b in zip(xy(found(1.0)), xy(exact), strict=True)]
    added = np.subtract(unsure.covariance, exact.covariance)[:2, :2]
    assert np.hypot(*moved) > 0.1
    assert added == pytest.approx(0.25 * np.outer(moved, moved), abs=1e-7)
