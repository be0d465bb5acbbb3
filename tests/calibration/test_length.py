"""Another length shows by the heights of the touches; what cannot show it is refused."""

import math

import numpy as np
import pytest

from robolink.calibration import length_change
from robolink.errors import CalibrationError, ConfigError

BEFORE = (-60.01, -59.98, -60.02, -59.99)


def test_a_longer_tip_puts_the_flange_higher_and_z_further_away():
    after = (-59.48, -59.5, -59.52, -59.47)
    found = length_change(BEFORE, after, stored_z_mm=-20.0, sigma_z_mm=0.03)
    assert found.changed
    assert found.height_change_mm == pytest.approx(0.5075)
    assert found.longer_mm == pytest.approx(0.5075)
    assert found.z_by_difference_mm == pytest.approx(-20.5075)
    assert found.u_mm == pytest.approx(0.03 * math.sqrt(0.5))
    assert found.half95_mm == pytest.approx(0.0416, abs=1e-4)
    assert found.z_mm("difference") == found.z_by_difference_mm
    assert found.z_mm("keep") == -20.0
    assert found.z_mm("measure") is None
    assert found.z_mm(None) is None


@pytest.mark.parametrize(
    ("stored", "v", "w", "expected"),
    [(120.0, 0.0, 180.0, 120.5), (120.0, 180.0, 0.0, 120.5), (-20.0, 0.0, 60.0, -20.25)],
)
def test_the_sign_follows_the_flange(stored, v, w, expected):
    found = length_change((100.0,), (100.5,), stored_z_mm=stored, v_deg=v, w_deg=w)
    assert found.z_by_difference_mm == pytest.approx(expected)


def test_the_same_length_is_kept_whatever_was_decided():
    found = length_change(BEFORE, (-59.97, -60.0, -60.02, -59.96), stored_z_mm=-20.0)
    assert not found.changed
    assert {found.z_mm("difference"), found.z_mm("keep"), found.z_mm(None)} == {-20.0}


def test_few_touches_widen_the_limit():
    one = length_change((0.0,), (0.2,), stored_z_mm=-20.0, sigma_z_mm=0.05)
    assert one.limit_mm == pytest.approx(3.29 * 0.05 * math.sqrt(2))
    assert not one.changed


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"pin_moved": True}, "length_not_observable"),
        ({"before_z_mm": ()}, "too_few_poses"),
        ({"after_z_mm": (math.nan,)}, "non_finite"),
        # A touch in the air: its mean is no height of the pin.
        ({"after_z_mm": (-60.0, -59.99, -59.4, -60.01)}, "touch_heights_differ"),
        ({"before_z_mm": (-60.0, -59.6)}, "touch_heights_differ"),
    ],
)
def test_what_proves_nothing_is_refused(options, code):
    given = {"before_z_mm": BEFORE, "after_z_mm": BEFORE, "stored_z_mm": -20.0} | options
    with pytest.raises(CalibrationError) as refused:
        length_change(given.pop("before_z_mm"), given.pop("after_z_mm"), **given)
    assert refused.value.code == code


def test_a_scatter_of_nothing_is_refused():
    with pytest.raises(ConfigError):
        length_change(BEFORE, BEFORE, stored_z_mm=-20.0, sigma_z_mm=0.0)


def test_how_often_it_is_wrong():
    rng = np.random.default_rng(8)

    def told(change, sigma, runs):
        heights = rng.normal(0, sigma, (runs, 2, 4))
        heights[:, 1] += change
        seen = 0
        for before, after in heights:
            try:
                seen += length_change(
                    before.tolist(), after.tolist(), stored_z_mm=-20.0, sigma_z_mm=sigma
                ).changed
            except CalibrationError:
                seen += 0
        return seen / runs

    assert told(0.0, 0.05, 600) < 0.006
    assert told(0.2, 0.05, 300) > 0.95
    assert told(0.15, 0.03, 300) > 0.95
