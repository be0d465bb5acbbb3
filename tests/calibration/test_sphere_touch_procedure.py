"""sphere-touch with a person at the sphere: what it finds, and what it is not fooled by."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from robolink.calibration import rotation_of
from robolink.errors import CalibrationError
from robolink.methods import SphereSurvey, measure_sphere_touch
from robolink.methods.surface_touch.sphere_procedure import SphereTest, TouchedSphere
from robolink.model import Pose, ToolOffset
from tests.calibration._surface_person import PLAN, STORED, TIP, Ball, SurfacePerson, slips

LENGTHS = TIP.components()[:3]
ORIENTATIONS = {"up": (72.0, 0.0, 0.0), "down": (-150.0, 0.0, 180.0), "askew": (30.0, 8.0, -12.0)}


def over_top(ball, *, turned="up", aside=(1.0, -1.0), tip=TIP):
    """Return the flange pose with a tip 5 mm above a ball, so far beside its top."""
    u, v, w = ORIENTATIONS[turned]
    at = Pose(0.0, 0.0, 0.0, u, v, w, tool=0)
    above = ball.centre + np.array([*aside, ball.radius + 5.0])
    x, y, z = (above - rotation_of(at) @ tip.components()[:3]).tolist()
    return replace(at, x_mm=x, y_mm=y, z_mm=z)


def measured(person, *, axes=6, radius_mm=10.0, count=12):
    survey = SphereSurvey(radius_mm, count)
    return person.run(measure_sphere_touch(PLAN, survey, stored=STORED, axes=axes))


LONG = pytest.mark.soak


@pytest.mark.parametrize(
    ("turned", "axes"), [("up", 5), pytest.param("up", 6, marks=LONG), ("down", 6), ("askew", 6)]
)
def test_exact_touches_give_tip_and_sphere_and_the_tip_keeps_clear(turned, axes):
    ball = Ball(10.0)
    person = SurfacePerson(ball, start=over_top(ball, turned=turned), sigma_mm=0.0)
    result = measured(person, axes=axes, radius_mm=9.0)
    assert result.offset.components()[:3] == pytest.approx(LENGTHS, abs=1e-6)
    assert result.reference_point_mm == pytest.approx(ball.centre.tolist(), abs=1e-6)
    assert result.radius_mm == pytest.approx(10.0, abs=1e-6)
    # The stored tip is 0.7 mm beside the true one, and is what the robot goes by.
    assert person.lowest > PLAN.clearance_mm - 1.0
    final = person.moves[-1].target
    assert rotation_of(final) == pytest.approx(rotation_of(person.touches[0]), abs=1e-9)


@pytest.mark.soak
@pytest.mark.timeout(300)
def test_the_interval_of_a_sphere_holds_the_truth_about_as_often_as_it_says():
    held = total = 0
    ball = Ball(10.0)
    for seed in range(200):
        for axes in (5, 6):
            result = measured(SurfacePerson(ball, start=over_top(ball), seed=seed), axes=axes)
            errors = np.abs(np.subtract(result.offset.components()[:3], LENGTHS))
            held += int((errors <= result.half_width95).sum())
            total += 3
    assert 0.92 < held / total < 0.98


@pytest.mark.soak
@pytest.mark.timeout(600)
def test_with_the_least_number_of_touches_no_good_run_is_refused():
    """With one touch fewer 27 of these 60 were."""
    ball = Ball(10.0)
    for seed in range(60):
        person = SurfacePerson(ball, start=over_top(ball), seed=seed, sigma_mm=0.05)
        measured(person, count=SphereSurvey.least_count)


@pytest.mark.parametrize(
    ("hover", "code"),
    [
        (lambda number, height: height if number else 0.0, "not_touched"),
        (lambda number, height: height if number > 6 else 0.0, "not_touched"),
        (lambda number, height: 0.4 * height if number > 3 else 0.0, "large_residual"),
        (lambda number, _: 0.8 if number == 7 else 0.0, "large_residual"),
    ],
    ids=["enter only", "enter in the end", "half way", "once in the air"],
)
def test_touches_of_a_sphere_that_were_not_made_are_refused(hover, code):
    ball = Ball(10.0)
    with pytest.raises(CalibrationError) as refused:
        measured(SurfacePerson(ball, start=over_top(ball), hover=hover), count=14)
    assert refused.value.code == code


def test_who_always_stops_short_by_the_same_finds_the_same_tip_and_a_larger_sphere():
    ball = Ball(10.0)
    person = SurfacePerson(ball, start=over_top(ball), sigma_mm=0.0, hover=lambda *_: 0.2)
    result = measured(person)
    assert result.offset.components()[:3] == pytest.approx(LENGTHS, abs=1e-6)
    assert result.radius_mm == pytest.approx(10.2, abs=1e-6)


@pytest.mark.parametrize(
    ("aside", "radius_mm", "code"),
    [((6.0, 0.0), 10.0, "off_top"), ((0.5, 0.5), 14.0, "radius_contradicted")],
)
def test_a_start_beside_the_top_or_another_radius_is_told_after_four_touches(
    aside, radius_mm, code
):
    ball = Ball(10.0)
    person = SurfacePerson(ball, start=over_top(ball, aside=aside))
    with pytest.raises(CalibrationError) as refused:
        measured(person, radius_mm=radius_mm)
    assert refused.value.code == code
    assert len(person.touches) == 4
    assert person.lowest > 0.0


@cache
def measured_once(axes):
    """Return a ball and what is found on it, of which no test changes anything."""
    ball = Ball(10.0)
    return ball, measured(SurfacePerson(ball, start=over_top(ball), sigma_mm=0.0), axes=axes)


@pytest.mark.parametrize(("axes", "aside"), slips((6,), (5,)))
def test_the_proof_on_a_sphere_shows_a_tip_that_slipped_in_any_direction(axes, aside):
    ball, result = measured_once(axes)
    frame = replace(over_top(ball, tip=ToolOffset()), tool=1)
    proof = SphereTest(
        tool=1,
        written=result.offset,
        tip=result.offset,
        tolerance_mm=0.1,
        touch=PLAN,
        u_mm=0.01,
        upright=frame,
        survey=SphereSurvey(10.0),
        sphere=TouchedSphere(result.reference_point_mm, result.radius_mm),
        axes=axes,
    )
    slipped = ToolOffset(*map(float, aside))
    found = SurfacePerson(ball, start=frame, sigma_mm=0.0, tip=slipped).run(proof.steps(frame))
    assert found.passed is not any(aside)
    # A sphere is no plane: beside the expected place its way along the normal is a little longer.
    assert found.max_drift_mm == pytest.approx(float(np.linalg.norm(aside)), abs=0.02)
