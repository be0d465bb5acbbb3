"""A new offset that is not believed is not let through."""

import pytest

from robolink.calibration import update_guard
from robolink.model import ToolOffset
from tests.calibration._simulated import refused

STORED = ToolOffset(12.0, -3.0, -20.0)


def test_an_ordinary_change_passes_and_is_told():
    correction = update_guard(ToolOffset(12.3, -3.4, -20.0), stored=STORED)
    assert correction.distance_mm == pytest.approx(0.5)
    assert (correction.dx_mm, correction.dy_mm) == pytest.approx((0.3, -0.4))
    assert correction.ratio is None


def test_a_jump_is_refused_and_the_limit_can_be_set():
    far = ToolOffset(15.0, -3.0, -20.0)
    with refused("implausible_change"):
        update_guard(far, stored=STORED)
    assert update_guard(far, stored=STORED, max_change_mm=5.0).distance_mm == pytest.approx(3)


@pytest.mark.parametrize("gain", [-1.0, -0.6, 2.05, 2.2])
def test_a_loop_with_a_wrong_sign_or_gain_is_stopped_at_its_second_turn(gain):
    # Each turn measures the error that is left and applies gain times too much of it.
    error, stored = 0.4, STORED
    history: list[float] = []
    with refused("diverging"):
        for _ in range(4):
            step = gain * error
            new = ToolOffset(stored.x_mm + step, stored.y_mm, stored.z_mm)
            correction = update_guard(new, stored=stored, earlier_mm=history, max_change_mm=9)
            history.append(correction.distance_mm)
            stored, error = new, error - step
    assert len(history) == 1


def test_a_loop_that_converges_goes_on():
    correction = update_guard(ToolOffset(12.1, -3, -20), stored=STORED, earlier_mm=[0.9, 0.3])
    assert correction.ratio == pytest.approx(1 / 3)


def test_growth_within_the_noise_is_no_divergence():
    update_guard(ToolOffset(12.03, -3, -20), stored=STORED, earlier_mm=[0.01])
    with refused("diverging"):
        update_guard(ToolOffset(12.03, -3, -20), stored=STORED, earlier_mm=[0.01], noise_mm=0.02)
