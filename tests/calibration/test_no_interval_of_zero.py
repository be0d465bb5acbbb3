"""No method states an interval of 0, however well what it was given agrees."""

import math

import pytest

from robolink.calibration import (
    Beam,
    CalibrationResult,
    Crossing,
    Pin,
    Touch,
    carrying,
    solve_crossed_beams,
    solve_n_angle,
    solve_one_touch,
    solve_pivot,
    solve_two_pose,
    solve_z_touch,
)
from robolink.model import Pose, ToolOffset, rotate_xy

TIP = ToolOffset(12.0, -4.0, -20.0)
PIN = (310.0, 95.0, -40.0)
LEAST = 0.0005


def touching(u_deg, v_deg=0.0, w_deg=0.0):
    return carrying(Pose(0, 0, 0, u_deg, v_deg, w_deg), TIP, PIN)


UPRIGHT = [touching(60.0 * k) for k in range(6)]
TILTED = [touching(60.0 * k, 20.0 * math.cos(k), 20.0 * math.sin(k)) for k in range(8)]
BEAMS = Beam(300, 80, 0), Beam(300, 80, 90)


def crossings():
    dx, dy = rotate_xy(TIP.x_mm, TIP.y_mm, 0.0)
    for way in (0.5, -0.5):
        entry, leaving = (Pose(300 - dx, 80 - dy + side * way, -20, 0) for side in (-1, 1))
        yield Crossing(0, entry, leaving)
        entry, leaving = (Pose(300 - dx + side * way, 80 - dy, -20, 0) for side in (-1, 1))
        yield Crossing(1, entry, leaving)


def of_a_plugin():
    return CalibrationResult(
        method="ours",
        offset=TIP,
        measured=("x_mm", "y_mm"),
        kept=(),
        reference_point_mm=(),
        sigma_gain=1.0,
        warnings=(),
        inputs=(),
        half_width95=(0.0, 0.0),
        region95_radius_mm=0.0,
    )


@pytest.mark.parametrize(
    "solve",
    [
        lambda: solve_n_angle(UPRIGHT),
        lambda: solve_n_angle(UPRIGHT, sigma_mm=1e-9),
        lambda: solve_pivot(TILTED),
        lambda: solve_two_pose(UPRIGHT[0], UPRIGHT[3], sigma_mm=1e-9),
        lambda: solve_one_touch(UPRIGHT[0], Pin(*PIN, sigma_mm=0.0), sigma_mm=1e-9),
        lambda: solve_crossed_beams([*crossings()] * 2, BEAMS),
        lambda: solve_z_touch([Touch(-60 - 0.01 * v, v) for v in (2.0, 1.0) * 2], -80.0),
        of_a_plugin,
    ],
    ids=["n-angle", "stated", "pivot", "two-pose", "one-touch", "beams", "z-touch", "plug-in"],
)
def test_residuals_that_are_all_0_leave_what_nobody_can_read(solve):
    result = solve()
    assert min(result.half_width95) >= LEAST
    assert all(f"{half:.3f}" != "0.000" for half in result.half_width95)
    assert result.region95_radius_mm is None or f"{result.region95_radius_mm:.3f}" != "0.000"
    assert all(result.covariance[i][i] > 0 for i in range(len(result.covariance)))
