"""A tool's length, with the trigger's latency taken out."""

import pytest

from robolink.calibration import Touch, solve_z_touch
from robolink.model import ToolOffset
from tests.calibration._simulated import assert_honest, coverage, refused

SURFACE, LENGTH, LATENCY = -50.0, -23.4, 0.004
SPEEDS = (2.0, 2.0, 8.0, 8.0)


def touches(speeds=SPEEDS, rng=None, sigma_mm=0.0):
    """The flange is lower than where the tip touched when the trigger is read."""
    noise = rng.normal(0, sigma_mm, len(speeds)) if rng else [0.0] * len(speeds)
    return [
        Touch(SURFACE - LENGTH - v * LATENCY + e, v) for v, e in zip(speeds, noise, strict=True)
    ]


def test_two_speeds_tell_length_and_latency():
    result = solve_z_touch(touches(), SURFACE, stored=ToolOffset(1, 2, 0, 4))
    assert result.offset.components() == pytest.approx((1, 2, LENGTH, 4, 0, 0))
    assert result.latency_s == pytest.approx(LATENCY)
    assert result.flange_z_mm == pytest.approx(SURFACE - LENGTH)
    assert (result.measured, result.dof) == (("z_mm",), 2)


def test_a_known_latency_needs_one_speed():
    result = solve_z_touch(touches((5.0, 5.0, 5.0)), SURFACE, latency_s=LATENCY)
    assert result.offset.z_mm == pytest.approx(LENGTH)
    assert (result.rank, result.dof) == (1, 2)


def test_too_little_is_named():
    with refused("one_speed"):
        solve_z_touch(touches((5.0, 5.0, 6.0)), SURFACE)
    with refused("one_speed"):
        solve_z_touch(touches((0.0, 5.0, 6.0)), SURFACE)
    with refused("too_few_poses"):
        solve_z_touch(touches((5.0,)), SURFACE)
    with refused("non_finite") as caught:
        solve_z_touch([*touches(), Touch(float("nan"), 2)], SURFACE)
    assert "z_mm of touch 5" in caught.value.what
    assert solve_z_touch(touches((2, 8)), SURFACE).warnings == ("few_poses",)


@pytest.mark.parametrize("stated", [None, 0.01])
@pytest.mark.parametrize("speeds", [SPEEDS, SPEEDS[1:]])
def test_the_interval_holds_the_truth(speeds, stated):
    assert_honest(
        coverage(
            lambda rng: solve_z_touch(touches(speeds, rng, 0.01), SURFACE, sigma_mm=stated),
            (LENGTH,),
        ),
        stated=stated is not None,
    )
