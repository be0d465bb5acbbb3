"""The 95 % interval of looks at several angles holds the truth in 95 % of them."""

from dataclasses import replace

import pytest

from robolink.calibration import Sighting, solve_board_round, solve_camera_round
from robolink.model import ToolOffset, rotate_xy
from tests.calibration._simulated import assert_honest, coverage, touching

TIP = (12.3, -3.9)
HELD = ToolOffset(12.3, -3.9, -20.0, 1.2)
DRAWING = ((20.0, 12.5), (-20.0, 12.5), (-20.0, -12.5), (20.0, -12.5))
SIGMA_MM = 0.01
OFF_MM = (0.3, -0.2)


def seen(mark, u_deg):
    """Return a mark in the middle of a camera that was moved."""
    flange = touching(mark, u_deg)
    dx, dy = rotate_xy(mark[0], mark[1], u_deg)
    return Sighting(flange, flange.x_mm + dx + OFF_MM[0], flange.y_mm + dy + OFF_MM[1])


def shaken(sightings, random):
    noise = random.normal(0, SIGMA_MM, (len(sightings), 2)).tolist()
    return [
        replace(s, x_mm=s.x_mm + dx, y_mm=s.y_mm + dy)
        for s, (dx, dy) in zip(sightings, noise, strict=True)
    ]


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize("angles_deg", [(0, 60, 120, 180), (0, 90, 180)])
def test_a_tip(angles_deg, stated, trials):
    exact, sigma = [seen(TIP, u_deg) for u_deg in angles_deg], SIGMA_MM if stated else None
    assert_honest(
        coverage(lambda r: solve_camera_round(shaken(exact, r), sigma_mm=sigma), TIP, trials),
        trials,
        stated=stated,
    )


@pytest.mark.parametrize("stated", [False, True])
def test_a_board_at_two_angles_that_do_not_balance(stated, trials):
    marks = [
        (HELD.x_mm + dx, HELD.y_mm + dy)
        for dx, dy in (rotate_xy(place[0], place[1], HELD.u_deg) for place in DRAWING)
    ]
    exact = [seen(mark, u_deg) for u_deg in (0.0, 120.0) for mark in marks]
    sigma, truth = SIGMA_MM if stated else None, (HELD.x_mm, HELD.y_mm, HELD.u_deg)
    assert_honest(
        coverage(
            lambda r: solve_board_round(shaken(exact, r), DRAWING * 2, sigma_mm=sigma),
            truth,
            trials,
        ),
        trials,
        stated=stated,
    )


def test_at_one_angle_the_cameras_error_cannot_be_told():
    exact = [seen(place, 0.0) for place in DRAWING]
    result = solve_board_round(exact, DRAWING)
    assert result.camera_error_mm is None
    assert (result.offset.x_mm, result.offset.y_mm) == pytest.approx(OFF_MM)
