"""A table of runout by angle: against a tip that wobbles in a known way."""

import cmath
import math
from itertools import pairwise

import numpy as np
import pytest

from robolink.calibration import RunoutRow, RunoutTable, Sighting, solve_runout_table
from robolink.methods import AllRoundPlan
from robolink.model import Pose
from tests.calibration._simulated import LEAST, MOST, refused

TIP, CENTRE, ELLIPSE, SECOND = 0.3 - 0.1j, 0.05 + 0.02j, 0.04j, 0.03 - 0.02j
TWELVE = tuple(30.0 * k for k in range(12))


def wobble(u_deg, amount=1.0):
    z = cmath.exp(1j * math.radians(u_deg))
    return amount * (ELLIPSE * z.conjugate() + SECOND * z * z)


def looks(angles=TWELVE, rng=None, sigma_mm=0.0, amount=1.0):
    found = []
    for k, u in enumerate(angles):
        z = cmath.exp(1j * math.radians(u))
        seen = CENTRE + TIP * z + wobble(u, amount)
        seen += complex(*rng.normal(0, sigma_mm, 2)) if rng is not None else 0
        flange = Pose(300 + k, 90 - k, -10, u, tool=0)
        found.append(Sighting(flange, flange.x_mm + seen.real, flange.y_mm + seen.imag))
    return found


def test_the_tool_gets_the_constant_part_and_the_table_the_rest():
    result = solve_runout_table(looks())
    assert complex(*result.offset.components()[:2]) == pytest.approx(TIP)
    assert result.camera_error_mm == pytest.approx((CENTRE.real, CENTRE.imag))
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
        hits += np.abs((x - TIP.real, y - TIP.imag)) <= np.array(result.half_width95)
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
