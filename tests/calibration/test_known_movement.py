"""What a seen movement says of the spot and of the camera."""

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
    spot_changed,
    tip_did_not_move,
)
from robolink.model import Pose, Spot, SpotUnit
from robolink.procedures.camera_watch import SpotWatch
from robolink.runner import SeenAt
from robolink.stations import CameraStation

ROWS = CameraChangeRows()
KNOWN = (1.0, 1.0)


def seen_by(factor, known=KNOWN, noise=0.003):
    """What a camera sees whose map multiplies each way by a complex factor."""
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
    # One alone has a closer look; only two of them in a row refuse.
    assert alarms <= 2


def test_movements_are_alike_whatever_their_length():
    whole, half = seen_by(turned(10.0)), seen_by(turned(10.0), known=(0.5, 0.5))
    assert whole.like(half, within=0.1)
    assert not seen_by(turned(10.0) + 0.4).like(half, within=0.1)
    # A spot that stands still is like none, however wide the scatter makes the limit.
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
    assert "went 1.41 mm, and it was seen to go 0.00 mm." in still.what
    assert "fleck" in still.remedy
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
