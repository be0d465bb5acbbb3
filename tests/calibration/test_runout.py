"""What a turning tip shows: offset, ellipse, second harmonic."""

import cmath
import math

import numpy as np
import pytest

from robolink.calibration import Sighting, runout_report
from robolink.model import Pose
from tests.calibration._simulated import TRIALS, assert_honest, refused

TIP, CENTRE = 0.25 - 0.1j, 0.05 + 0.02j


def turning(count=12, *, ellipse=0j, second=0j, rng=None, sigma_mm=0.0, arc_deg=360.0):
    found = []
    for k in range(count):
        u = arc_deg * k / count
        z = cmath.exp(1j * math.radians(u))
        seen = CENTRE + TIP * z + ellipse * z.conjugate() + second * z * z
        if rng is not None:
            seen += complex(*rng.normal(0, sigma_mm, 2))
        flange = Pose(300 + k, 90 - k, -10, u, tool=0)
        found.append(Sighting(flange, flange.x_mm + seen.real, flange.y_mm + seen.imag))
    return found


def test_a_round_runout_is_all_offset():
    report = runout_report(turning())
    assert complex(*report.tip_mm) == pytest.approx(TIP)
    assert complex(*report.centre_mm) == pytest.approx(CENTRE)
    assert report.runout_mm == pytest.approx(abs(TIP))
    assert (report.ellipse_mm, report.second_mm) == pytest.approx((0, 0), abs=1e-9)
    assert report.rms_mm == pytest.approx(0, abs=1e-9)


def test_harmonics_are_kept_apart_from_the_offset():
    rng = np.random.default_rng(1)
    report = runout_report(turning(ellipse=0.06j, second=-0.03 + 0j, rng=rng, sigma_mm=0.002))
    assert complex(*report.tip_mm) == pytest.approx(TIP, abs=0.003)
    assert report.ellipse_mm == pytest.approx(0.06, abs=0.003)
    assert report.second_mm == pytest.approx(0.03, abs=0.003)
    assert report.harmonics_matter
    assert report.warnings == ("wobble",)
    assert report.rms_after_mm is not None
    assert report.rms_after_mm < 0.004 < report.rms_mm
    assert report.peak_mm > 0.08


def test_noise_alone_is_no_wobble():
    rng = np.random.default_rng(2)
    report = runout_report(turning(rng=rng, sigma_mm=0.01))
    assert not report.harmonics_matter
    assert report.warnings == ()


def test_few_sightings_show_no_harmonics():
    report = runout_report(turning(6, ellipse=0.06j))
    assert (report.ellipse_mm, report.second_mm, report.rms_after_mm) == (None, None, None)
    assert report.rms_mm == pytest.approx(0.06)


def test_a_short_arc_or_few_sightings_are_refused():
    with refused("insufficient_rotation"):
        runout_report(turning(arc_deg=150.0))
    with refused("too_few_poses"):
        runout_report(turning(3))


@pytest.mark.parametrize("stated", [None, 0.01])
@pytest.mark.parametrize("count", [4, 9])
def test_the_interval_of_the_offset_holds_the_truth(count, stated):
    rng, hits = np.random.default_rng(3), np.zeros(2)
    for _ in range(TRIALS):
        report = runout_report(turning(count, rng=rng, sigma_mm=0.01), sigma_mm=stated)
        hits += np.abs(np.subtract(report.tip_mm, (TIP.real, TIP.imag))) <= report.half_width95_mm
    assert_honest(hits / TRIALS, stated=stated is not None)
