"""Results from a turning tip: offset, ellipse, second harmonic, a table by angle."""

import cmath
import math
from itertools import pairwise

import numpy as np
import pytest

from robolink.calibration import RunoutRow, RunoutTable, Sighting, runout_report, solve_runout_table
from robolink.methods import AllRoundPlan
from robolink.model import Pose
from tests.calibration._simulated import LEAST, MOST, assert_honest, refused

# Results from a turning tip: offset, ellipse, second harmonic.

TIP, CENTRE = 0.25 - 0.1j, 0.05 + 0.02j


def turning(count=12, *, ellipse=0j, second=0j, rng=None, sigma_mm=0.0, arc_deg=360.0, angles=()):
    found = []
    for k, u in enumerate(angles or [arc_deg * k / count for k in range(count)]):
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


def test_four_sightings_show_no_harmonics():
    report = runout_report(turning(4, ellipse=0.06j))
    assert (report.ellipse_mm, report.second_mm, report.rms_after_mm) == (None, None, None)
    assert report.rms_mm == pytest.approx(0.06)


def test_a_short_arc_or_few_sightings_are_refused():
    with refused("insufficient_rotation"):
        runout_report(turning(arc_deg=25.0))
    with refused("too_few_poses"):
        runout_report(turning(3))


@pytest.mark.parametrize(
    ("count", "stated"),
    [
        (4, None),
        (9, 0.01),
        pytest.param(4, 0.01, marks=pytest.mark.soak),
        pytest.param(9, None, marks=pytest.mark.soak),
    ],
)
def test_the_interval_of_the_offset_holds_the_truth(count, stated, trials):
    rng, hits = np.random.default_rng(3), np.zeros(2)
    for _ in range(trials):
        report = runout_report(turning(count, rng=rng, sigma_mm=0.01), sigma_mm=stated)
        hits += np.abs(np.subtract(report.tip_mm, (TIP.real, TIP.imag))) <= report.half_width95_mm
    assert_honest(hits / trials, trials, stated=stated is not None)


@pytest.mark.parametrize(
    ("angles", "rank"),
    [
        ((0.0, 180.0) * 4, 2),
        ((0.0, 180.0, 0.004, 179.996) * 2, 2),  # read with the noise of an encoder
        ((10.1, 190.1, 370.1, -169.9) * 2, 2),
        ((0.0, 90.0, 180.0) * 3, 3),
        ((0.0, 90.0) * 4, 2),
        ((0.0, 0.5, 180.0, 180.5) * 2, 4),  # four, and too close together to show anything
    ],
)
def test_angles_that_cannot_tell_an_offset_from_an_ellipse_say_so(angles, rank):
    rng = np.random.default_rng(4)
    report = runout_report(turning(angles=angles, rng=rng, sigma_mm=0.003))
    assert report.warnings == ("wobble_not_identifiable",)
    assert (report.rank, report.distinct_angles) == (rank, rank)
    assert (report.ellipse_mm, report.second_mm, report.amplitude_limit_mm) == (None, None, None)
    # Half of it is the result of the shortest solution.
    assert complex(*report.tip_mm) == pytest.approx(TIP, abs=0.01)


def test_one_angle_is_no_turn():
    with refused("degenerate_angles"):
        runout_report(turning(angles=(40.0, 400.0, 40.0, 40.0)))


def test_a_wobble_hidden_from_two_angles_is_half_the_story():
    # The error that two angles cannot show goes into the offset in full; only the warning says so.
    seen = turning(angles=(0.0, 180.0) * 4, ellipse=0.06 + 0j)
    report = runout_report(seen)
    assert complex(*report.tip_mm) == pytest.approx(TIP + 0.06)
    assert "wobble_not_identifiable" in report.warnings
    told = runout_report(turning(angles=(0.0, 90.0, 180.0, 270.0) * 2, ellipse=0.06 + 0j))
    assert complex(*told.tip_mm) == pytest.approx(TIP)
    assert told.warnings == ("wobble",)


@pytest.mark.parametrize(("count", "stated"), [(8, None), (6, 0.003)])
def test_a_round_circle_is_said_to_wobble_as_rarely_as_is_stated(count, stated):
    # One in a hundred: of 300, at most 9 in 99.9 %. A fixed limit of three gives 9.6 in a hundred.
    rng, runs = np.random.default_rng(6), 300
    reports = (
        runout_report(turning(count, rng=rng, sigma_mm=0.01), sigma_mm=stated) for _ in range(runs)
    )
    false = sum("wobble" in report.warnings for report in reports)
    assert 1 <= false <= 9


def test_an_ellipse_of_three_times_the_scatter_is_found():
    rng = np.random.default_rng(8)
    found = [
        runout_report(turning(8, ellipse=0.03j, rng=rng, sigma_mm=0.01)).harmonics_matter
        for _ in range(100)
    ]
    assert sum(found) > 94


# A table of runout by angle, for a tip with known runout.

TABLE_TIP, TABLE_CENTRE, ELLIPSE, SECOND = 0.3 - 0.1j, 0.05 + 0.02j, 0.04j, 0.03 - 0.02j
TWELVE = tuple(30.0 * k for k in range(12))


def wobble(u_deg, amount=1.0):
    z = cmath.exp(1j * math.radians(u_deg))
    return amount * (ELLIPSE * z.conjugate() + SECOND * z * z)


def looks(angles=TWELVE, rng=None, sigma_mm=0.0, amount=1.0):
    found = []
    for k, u in enumerate(angles):
        z = cmath.exp(1j * math.radians(u))
        seen = TABLE_CENTRE + TABLE_TIP * z + wobble(u, amount)
        seen += complex(*rng.normal(0, sigma_mm, 2)) if rng is not None else 0
        flange = Pose(300 + k, 90 - k, -10, u, tool=0)
        found.append(Sighting(flange, flange.x_mm + seen.real, flange.y_mm + seen.imag))
    return found


def test_the_tool_gets_the_constant_part_and_the_table_the_rest():
    result = solve_runout_table(looks())
    assert complex(*result.offset.components()[:2]) == pytest.approx(TABLE_TIP)
    assert result.camera_error_mm == pytest.approx((TABLE_CENTRE.real, TABLE_CENTRE.imag))
    assert [row.u_deg for row in result.table.rows] == list(TWELVE)
    for row in result.table.rows:
        assert complex(row.dx_mm, row.dy_mm) == pytest.approx(wobble(row.u_deg), abs=1e-9)
    assert result.wobble
    assert "wobble" not in result.warnings
    rows = result.details()["runout_table"]
    assert isinstance(rows, list)
    assert rows[1] == pytest.approx(
        {"u_deg": 30, "dx_mm": wobble(30).real, "dy_mm": wobble(30).imag}
    )


def test_between_two_angles_it_is_a_straight_line_all_round():
    table = solve_runout_table(looks()).table
    for u in (15.0, 345.0, -15.0, 359.99, 0.0, 30.0, 720.0 + 195.0):
        low = 30.0 * math.floor(u / 30.0)
        share = (u - low) / 30.0
        straight = (1 - share) * wobble(low) + share * wobble(low + 30.0)
        assert complex(*table.at(u)) == pytest.approx(straight, abs=1e-9)
        # For amplitudes a a (1 - cos 30), each, and that half way between two angles only.
        left = abs(complex(*table.at(u)) - wobble(u))
        assert left < (1 - math.cos(math.radians(30))) * (abs(ELLIPSE) + abs(SECOND))


def test_angles_in_any_order_and_seen_twice_make_one_row_each():
    angles = (-120.0, 240.0, 30.0, 390.0, 90.0, 150.0, 210.0, 300.0, 359.996, 0.004)
    table = solve_runout_table(looks(angles)).table
    assert [round(row.u_deg) % 360 for row in table.rows] == [0, 30, 90, 150, 210, 240, 300, 0]
    rows = [RunoutRow(0.0, 1.0, 3.0), RunoutRow(360.0, 3.0, 5.0), RunoutRow(180.0, 0.0, 0.0)]
    assert RunoutTable.of(rows).at(0.0) == (2.0, 4.0)


def test_what_was_not_looked_at_is_not_made_up():
    with refused("angles_too_far_apart"):
        solve_runout_table(looks(tuple(30.0 * k for k in range(9))))
    with refused("too_few_poses"):
        solve_runout_table(looks(TWELVE[:7]))
    with refused("angles_too_far_apart"):
        solve_runout_table(looks(tuple(10.0 * k for k in range(12))))


def test_a_wobble_does_not_spoil_the_interval_of_the_offset():
    rng, hits, runs = np.random.default_rng(5), np.zeros(2), 400
    for _ in range(runs):
        result = solve_runout_table(looks(rng=rng, sigma_mm=0.005))
        x, y = result.offset.components()[:2]
        hits += np.abs((x - TABLE_TIP.real, y - TABLE_TIP.imag)) <= np.array(result.half_width95)
    assert all(LEAST - 0.01 <= share <= MOST + 0.01 for share in hits / runs), hits / runs
    assert max(result.half_width95) < 0.01


def test_noise_alone_is_called_none():
    rng = np.random.default_rng(6)
    result = solve_runout_table(looks(rng=rng, sigma_mm=0.005, amount=0.0))
    assert not result.wobble
    assert result.table.peak_mm < 0.03


@pytest.mark.parametrize("u", [0.0, 140.0, -1.0, 179.0, -179.0, 200.0, -300.0])
def test_the_looks_stay_within_half_a_turn_and_no_turn_is_one(u):
    angles = AllRoundPlan(turns_deg=TWELVE).angles_deg(u)
    assert all(-180 < angle <= 180 for angle in angles)
    assert sorted((angle - u) % 360 for angle in angles) == pytest.approx(sorted(TWELVE), abs=1e-9)
    steps = [abs(b - a) for a, b in pairwise(angles)]
    assert max(steps) == pytest.approx(30)
    if abs(u) < 180:
        assert abs(angles[0] - u) < 180
