"""The finder on drawings of its own, on things that are no tips, and on what is no picture."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.eye.candidate import Candidate, Polarity, RefusalCode, TipShape
from robolink.eye.tip_finder import find_tips
from robolink.eye.tip_finder.circles import Circle, _lobes
from robolink.eye.tip_finder.judgement import LEAST_EDGE, Scene
from robolink.eye.tip_finder.own_profile import centred_by_profile, on_one_axis
from robolink.eye.tip_finder.rays import RAYS, Edges, slopes, unrolled
from robolink.eye.tip_finder.search import _same
from tests.eye.drawings import KINDS, Canvas, Face, blurred, drawing, face, taken

SIZE = (400, 300)
FIRST_OF_KIND = sorted({KINDS.index(kind) for kind in KINDS})

WORST_PX = {"worn": 1.6, "brushed": 0.8, "chamfer": 1.2, "blurred": 0.6, "noisy": 0.6}
"""How far a place may be off by kind; docs/reference/eye.md, "The finder", has what is usual."""


def accepted(grey, shape):
    return [one for one in find_tips(grey, shape) if one.accepted]


def drawn(*discs, size=(200, 160), ground=20.0, noise=1.5):
    """Return a picture of discs (x, y, radius, level), each laid on those before it."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width]
    grey = np.full((height, width), ground)
    for middle_x, middle_y, radius, level in discs:
        cover = np.clip(0.5 - (np.hypot(x - middle_x, y - middle_y) - radius) / 1.4, 0, 1)
        grey += cover * (level - grey)
    grey += np.random.default_rng(1).normal(0, noise, grey.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def tip(x=101.3, y=82.6, radius=30.0, bore=13.0, face=180.0, hole=15.0):
    return (x, y, radius, face), (x, y, bore, hole)


def reasons(grey, shape, x=101.3, y=82.6):
    """Return why the candidate at a place was refused, the clearest there."""
    near = [one for one in find_tips(grey, shape) if math.hypot(one.x_px - x, one.y_px - y) < 8]
    assert near, "nothing was found there"
    assert not near[0].accepted
    return {reason.code for reason in near[0].refused}


@pytest.mark.parametrize("seed", FIRST_OF_KIND, ids=[KINDS[seed] for seed in FIRST_OF_KIND])
def test_each_kind_of_drawing(seed):
    one = drawing(seed, SIZE)
    told_px = one.radius_px * np.random.default_rng(seed).uniform(0.93, 1.07)
    found = accepted(one.grey, TipShape(told_px))
    assert len(found) == len(one.tips)
    for truth in one.tips:
        off = min(math.hypot(it.x_px - truth.x_px, it.y_px - truth.y_px) for it in found)
        assert off < WORST_PX.get(one.kind, 0.3)


def test_it_is_found_to_a_hundredth_of_a_pixel_wherever_it_is():
    for x, y in ((80.0, 70.0), (80.25, 70.5), (80.9, 70.1)):
        (found,) = accepted(drawn(*tip(x, y), noise=0.5), TipShape(29.0))
        assert math.hypot(found.x_px - x, found.y_px - y) < 0.05
        assert abs(found.radius_px - 30.0) < 0.3
        assert abs((found.bore_ratio or 0) - 13 / 30) < 0.02
        assert found.rays > 0.95


def test_the_answer_is_the_same_each_time():
    grey = drawing(10, SIZE).grey
    assert find_tips(grey, TipShape(30.0)) == find_tips(grey.copy(), TipShape(30.0))


def test_a_negative_is_the_same_tip_of_the_other_polarity():
    grey = drawn(*tip())
    for shown, polarity, other in (
        (grey, Polarity.BRIGHT, Polarity.DARK),
        (255 - grey, Polarity.DARK, Polarity.BRIGHT),
    ):
        assert len(accepted(shown, TipShape(30.0, polarity=polarity))) == 1
        assert not accepted(shown, TipShape(30.0, polarity=other))


def test_two_tips_are_both_found():
    found = accepted(drawn(*tip(50, 60), *tip(140, 90)), TipShape(30.0))
    assert sorted(round(one.x_px) for one in found) == [50, 140]


@pytest.mark.parametrize("x", [-8.0, 5.0, 20.0, 26.0])
def test_a_cut_tip_is_refused_by_that_name(x):
    grey = drawn(*tip(x))
    assert not accepted(grey, TipShape(30.0))
    if x > 0:
        assert RefusalCode.CUT in reasons(grey, TipShape(30.0), x)


def test_a_disc_has_no_bore_and_is_a_solid_tip():
    grey = drawn((101.3, 82.6, 30, 180))
    assert RefusalCode.NO_BORE in reasons(grey, TipShape(30.0))
    (found,) = accepted(grey, TipShape(30.0, bore=False))
    assert found.bore_ratio is None


@pytest.mark.parametrize("turn_deg", [0, 20])
def test_the_head_of_a_cross_head_screw_has_no_bore(turn_deg):
    y, x = np.mgrid[0:160, 0:200]
    far, angle = np.hypot(x - 101.3, y - 82.6), np.arctan2(y - 82.6, x - 101.3)
    grey = drawn((101.3, 82.6, 20, 170), noise=0.0).astype(np.float32)
    for turn in (math.radians(turn_deg), math.radians(turn_deg + 90)):
        slot = np.clip(0.5 - (np.abs(far * np.sin(angle - turn)) - 2.4) / 1.2, 0, 1)
        grey += slot * np.clip(0.5 - (far - 18) / 1.2, 0, 1) * (40 - grey)
    grey = blurred(grey, 1.0) + np.random.default_rng(1).normal(0, 1.5, grey.shape)
    assert reasons(np.clip(grey, 0, 255).astype(np.uint8), TipShape(20.0))


def out_of_focus(bore, ground=40.0, level=75.0):
    """Return a faint disc with a bore of some level, four pixels out of focus."""
    grey = drawn((101.3, 82.6, 30, level), (101.3, 82.6, 16, bore), ground=ground, noise=0.0)
    grey = blurred(grey.astype(np.float32), 4.0)
    return np.clip(grey + np.random.default_rng(1).normal(0, 1.5, grey.shape), 0, 255)


def test_a_faint_ring_out_of_focus_that_shows_the_ground_is_no_tip():
    ring, tip_of_dark_bore = (out_of_focus(bore).astype(np.uint8) for bore in (40.0, 5.0))
    assert RefusalCode.FAINT_EDGE in reasons(ring, TipShape(30.0))
    (found,) = accepted(tip_of_dark_bore, TipShape(30.0))
    assert found.edge_px is not None
    assert found.edge_px > 8
    # Of a station whose edge was taught, the width alone tells.
    assert accepted(ring, TipShape(30.0, edge_px=8.0))
    assert accepted(255 - tip_of_dark_bore, TipShape(30.0))
    assert RefusalCode.FAINT_EDGE in reasons(255 - ring, TipShape(30.0))


def test_a_hole_beside_the_middle_is_no_bore():
    grey = drawn((101.3, 82.6, 30, 180), (109.5, 82.6, 12, 15))
    assert reasons(grey, TipShape(30.0)) & {RefusalCode.BORE_ASIDE, RefusalCode.NO_BORE}


def test_a_ring_is_a_tip_only_if_so_wide_a_bore_was_taught():
    grey = drawn(*tip(bore=24.5))
    assert reasons(grey, TipShape(30.0)) & {RefusalCode.OTHER_BORE, RefusalCode.NO_BORE}
    assert accepted(grey, TipShape(30.0, bore_ratio=24.5 / 30))
    assert not accepted(drawn(*tip(bore=13)), TipShape(30.0, bore_ratio=0.7))


def test_a_faint_thing_is_refused():
    grey = drawn(*tip(face=25.5, hole=19.0), noise=0.8)
    assert reasons(grey, TipShape(30.0, bore=False)) & {
        RefusalCode.FAINT_EDGE,
        RefusalCode.FEW_RAYS,
    }


def test_a_nut_is_not_round():
    y, x = np.mgrid[0:160, 0:200]
    far, angle = np.hypot(x - 101.3, y - 82.6), np.arctan2(y - 82.6, x - 101.3)
    six = far * np.cos(np.mod(angle, math.pi / 3) - math.pi / 6)
    grey = np.where(six < 29, 180, 20).astype(np.uint8)
    grey[far < 13] = 15
    assert reasons(grey, TipShape(30.0)) & {RefusalCode.NOT_ROUND, RefusalCode.FEW_RAYS}


def test_focus_is_judged_by_what_was_taught():
    sharp = drawn(*tip())
    (found,) = accepted(sharp, TipShape(30.0))
    assert found.edge_px is not None
    unsharp = blurred(sharp.astype(np.float32), 3.0).astype(np.uint8)
    (wide,) = accepted(unsharp, TipShape(30.0))
    assert wide.edge_px is not None
    assert wide.edge_px > 2.2 * found.edge_px
    assert RefusalCode.BLURRED in reasons(unsharp, TipShape(30.0, edge_px=found.edge_px))
    assert accepted(sharp, TipShape(30.0, edge_px=found.edge_px))


def test_the_width_of_an_edge_is_that_of_its_bell():
    for sigma in (2.0, 3.0, 4.0):
        grey = blurred(drawn(*tip(radius=50, bore=20)).astype(np.float32), sigma).astype(np.uint8)
        (found,) = accepted(grey, TipShape(50.0))
        assert found.edge_px is not None
        assert 0.85 < found.edge_px / (2.563 * math.hypot(sigma, 0.4)) < 1.15


def test_the_outline_of_a_chamfered_face_is_its_outer_edge():
    grey = drawn((101.3, 82.6, 30, 120), (101.9, 82.2, 25.5, 200), (101.3, 82.6, 12, 15))
    found = find_tips(grey, TipShape(29.0))
    assert abs(found[0].x_px - 101.3) < 0.1
    assert abs(found[0].radius_px - 30.0) < 0.4
    assert not any(one.accepted for one in found[1:])


def worn_errors_px(aside, count):
    """Return how far the places of worn tips are off, one each."""
    found = []
    for seed in range(count):
        canvas = Canvas.blank(seed, SIZE)
        canvas.grey += 40
        how = Face(180.0, 15.0, 0.45, jag=0.03, grain=12.0, aside=aside)
        truth = face(canvas, 200.0, 150.0, 50.0, how)
        (one,) = accepted(taken(canvas, 1.0, 2.0), TipShape(48.0))
        found.append(math.hypot(one.x_px - truth.x_px, one.y_px - truth.y_px))
    return np.array(found)


def test_a_rough_rim_is_drawn_to_a_bore_on_its_axis_and_not_to_an_eccentric_one():
    on_axis, eccentric = worn_errors_px(0.0, 4), worn_errors_px(0.08, 2)
    assert np.sqrt(np.mean(on_axis**2)) < 0.52
    assert np.sqrt(np.mean(eccentric**2)) < 0.8
    assert eccentric.max() < 1.2


def test_the_middle_moves_to_where_the_rim_is_alike_all_the_way_round():
    beside = Circle(102.5, 82.0, 30.0, -1, 1.0, 0.5, 0.0, 0.0)
    x_px, y_px = centred_by_profile(drawn(*tip()), beside, 1.5)
    assert math.dist((x_px, y_px), (101.3, 82.6)) < 0.3


def test_two_rough_circles_share_an_axis_only_as_far_as_their_scatter_says():
    rim = Circle(100.0, 100.0, 50.0, 1, 1.0, 1.0, 0.0, 0.0)

    def drawn_px(off_px, of=rim):
        bore = Circle(100.0 + off_px, 100.0, 22.0, -1, 1.0, 0.5, 0.0, 0.0)
        x_px, y_px = on_one_axis((100.0, 100.0), of, bore)
        assert y_px == 100.0
        return x_px - 100.0

    assert 0.25 < drawn_px(0.5) < 0.4
    assert drawn_px(4.0) == 0.0
    steps = np.diff([drawn_px(off_px) for off_px in np.arange(0.0, 4.0, 0.05)])
    assert np.abs(steps).max() < 0.05  # it never jumps
    assert abs(drawn_px(0.5, rim._replace(rms_px=0.05))) < 0.01
    assert on_one_axis((100.0, 100.0), rim, None) == (100.0, 100.0)


def test_another_size_is_not_taken():
    grey = drawn(*tip())
    for told_px in (20.0, 42.0):
        assert not accepted(grey, TipShape(told_px))
    assert accepted(grey, TipShape(26.0))
    assert not accepted(grey, TipShape(26.0, within=0.06))


def test_a_radius_that_nobody_knows():
    found = accepted(drawn(*tip()), TipShape(None))
    assert abs(found[0].radius_px - 30.0) < 0.4


def test_of_the_smallest_picture_it_is_told_why_its_tip_is_none():
    grey = drawn(*tip(5.5, 5.5, 5.0, 2.0), size=(12, 12), noise=0.5)
    assert RefusalCode.FEW_RAYS in reasons(grey, TipShape(5.0), 5.5, 5.5)
    assert find_tips(grey[:9], TipShape(5.0)) == ()


def test_a_slope_counts_by_the_faintest_edge_where_there_is_no_noise():
    scene = Scene(np.zeros((9, 9), np.uint8), TipShape(20.0), 20.0, noise=0.0, smooth_px=1.0)
    assert scene.least_slope(0.6) == pytest.approx(0.25 * LEAST_EDGE / 0.6)
    assert scene.least_slope(9.0) == 0.5


@pytest.mark.parametrize(("off_px", "same"), [(0.0, True), (4.9, True), (5.1, False)])
def test_circles_within_a_twentieth_of_a_radius_are_one(off_px, same):
    one = Candidate(60.0, 50.0, 100.0, score=1.0)
    assert _same(replace(one, x_px=60.0 + off_px), one) is same
    assert _same(replace(one, radius_px=100.0 + off_px), one) is same


def test_outside_of_the_picture_nothing_slopes():
    rays = unrolled(drawn(*tip()), 195.0, 80.0, 1.0, 30.0, 0.5)
    slope = slopes(rays, 1.0)
    assert not slope[~rays.inside].any()
    assert slope[rays.inside].any()


@pytest.mark.parametrize("level", [0, 7, 128, 255])
def test_nothing_is_found_in_one_grey(level):
    for shape in (TipShape(20.0), TipShape(None), TipShape(20.0, bore=False)):
        assert find_tips(np.full((90, 120), level, np.uint8), shape) == ()


def test_only_grey_pictures_of_eight_bits_are_looked_at():
    wrong_ones: tuple[Any, ...] = (
        np.zeros((60, 80, 3), np.uint8),
        np.zeros((60, 80), np.float32),
        np.zeros((60, 80), np.uint16),
        np.zeros(80, np.uint8),
    )
    for wrong in wrong_ones:
        with pytest.raises(ValueError, match="grey picture of eight bits"):
            find_tips(wrong, TipShape(20.0))


def test_a_picture_that_is_a_part_of_another_is_read_as_itself():
    whole = drawn(*tip(), size=(260, 200))
    (part,) = accepted(whole[10:180, 20:230], TipShape(30.0))
    (found,) = accepted(np.ascontiguousarray(whole[10:180, 20:230]), TipShape(30.0))
    assert part == found
    turned = accepted(whole.T, TipShape(30.0))
    assert math.hypot(turned[0].x_px - 82.6, turned[0].y_px - 101.3) < 0.1


@given(
    height=st.integers(1, 70),
    width=st.integers(1, 90),
    radius_px=st.one_of(st.none(), st.floats(0.1, 400)),
    within=st.floats(0.01, 0.5),
    bore=st.booleans(),
    steps=st.integers(1, 256),
    seed=st.integers(0, 1000),
)
@settings(max_examples=15, deadline=None)
def test_noise_of_any_size_raises_nothing(height, width, radius_px, within, bore, steps, seed):
    rng = np.random.default_rng(seed)
    grey = (rng.integers(0, steps, (height, width)) * (255 // steps)).astype(np.uint8)
    shape = replace(TipShape(radius_px, within=within), bore=bore)
    for one in find_tips(grey, shape):
        assert all(map(math.isfinite, (one.x_px, one.y_px, one.radius_px, one.score)))
        assert 0 <= one.score <= 1
        assert one.edge_px is None or math.isfinite(one.edge_px)


@pytest.mark.filterwarnings("error")
def test_a_circle_whose_last_step_left_all_its_edges_has_no_lobes():
    nowhere = np.full((RAYS, 4), np.inf, np.float32)
    edges = Edges(nowhere, np.zeros_like(nowhere), np.zeros_like(nowhere))
    assert _lobes(edges, 0.0, 0.0, 25.0) == 0.0
