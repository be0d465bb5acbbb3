"""What a board carries of the camera that saw it."""

import cmath
import math

import numpy as np
import pytest

from robolink.calibration import (
    CameraModel,
    Sighting,
    solve_board,
    solve_board_fit,
    solve_board_round,
)
from robolink.model import Pose, ToolOffset, rotate_xy

CAMERA = CameraModel(
    ((0.02, 0.0), (0.0, -0.02)),
    (0.0, 0.0),
    centre_mm=(100.0, 50.0),
    place_sigma_mm=0.02,
    scale_sigma=0.002,
)
CENTRE = complex(100.0, 50.0)
BOARD = ((0.0, 0.0), (40.0, 0.0), (10.0, 30.0), (35.0, 25.0))


def xyu(result):
    return (result.offset.x_mm, result.offset.y_mm, result.offset.u_deg)


def seen_by_a_camera_that_is_off(angles, drawing, place=0j, turn=0j, turned_deg=10.0):
    """Fiducials of a board that is held at (5, -3), turned by 10 degrees, below the camera."""
    tool, looks = ToolOffset(5.0, -3.0, 0.0, turned_deg), []
    for u_deg in angles:
        for d in drawing:
            at = complex(*rotate_xy(d[0], d[1], tool.u_deg)) + complex(tool.x_mm, tool.y_mm)
            beside = at * cmath.exp(1j * math.radians(u_deg))
            flange = Pose(100.0 - beside.real + d[0] / 8, 50.0 - beside.imag, 0.0, u_deg)
            true = complex(flange.x_mm, flange.y_mm) + beside
            seen = true + place + turn * (true - CENTRE)
            looks.append(Sighting(flange, seen.real, seen.imag))
    return looks


@pytest.mark.parametrize(
    ("angles", "drawing", "solve"),
    [
        ((30.0,), BOARD[:2], lambda looks, **k: solve_board(*looks, **k)),
        ((30.0,), BOARD, lambda looks, **k: solve_board_fit(looks, BOARD, **k)),
        ((30.0,), BOARD, lambda looks, **k: solve_board_round(looks, BOARD, **k)),
        ((0.0, 90.0), BOARD, lambda looks, **k: solve_board_round(looks, BOARD * 2, **k)),
        ((0.0, 90.0), BOARD, lambda looks, **k: solve_board_fit(looks, BOARD * 2, **k)),
    ],
)
def test_a_board_carries_what_its_camera_is_unsure_of(angles, drawing, solve):
    """Against cameras that are off as they say: the part is the covariance of what they find."""
    rng = np.random.default_rng(6)
    exact = seen_by_a_camera_that_is_off(angles, drawing)
    told = np.array(solve(exact, sigma_mm=1e-9, camera=CAMERA).covariance)
    true, wrong = np.array(xyu(solve(exact))), []
    for _ in range(200):
        b, e = rng.normal(0, 0.02, 2), rng.normal(0, 0.002, 2)
        looks = seen_by_a_camera_that_is_off(angles, drawing, complex(*b), complex(*e))
        wrong.append(np.array(xyu(solve(looks))) - true)
    found = np.cov(np.transpose(wrong))
    size = np.sqrt(np.maximum(np.diag(found), 1e-12))
    assert told / np.outer(size, size) == pytest.approx(found / np.outer(size, size), abs=0.25)


def test_a_board_is_no_surer_than_the_camera_that_saw_it():
    looks = seen_by_a_camera_that_is_off((30.0,), BOARD[:2])
    plain = solve_board(*looks, sigma_mm=0.001)
    result = solve_board(*looks, sigma_mm=0.001, camera=CAMERA)
    assert plain.half95_mm is not None
    assert plain.half95_mm < 0.002
    assert result.half95_mm is not None
    assert result.region95_radius_mm is not None
    assert result.budget is not None
    assert 0.039 < result.half95_mm < 0.05
    assert result.region95_radius_mm > 1.2 * result.half95_mm
    assert [row.kind for row in result.budget.rows] == ["B", "B"]
    assert result.budget.rows[-1].name == "place and scale of the camera"
    # The robot brings both marks near the centre, 5 of 40 mm apart: so much of the camera's own
    # direction counts, and nothing of its place.
    own_deg = math.degrees(math.hypot(0.002 * 5 / 40, math.sqrt(2) * 0.001 / 40))
    assert result.half_width95[2] == pytest.approx(1.96 * own_deg, rel=0.01)
    # Over a turn the round finds what the camera's place is off by.
    twice = seen_by_a_camera_that_is_off((0.0, 180.0), BOARD)
    sure = CameraModel(CAMERA.mm_per_px, (0.0, 0.0), (100.0, 50.0), 0.02, 0.0)
    alone = solve_board_round(twice, BOARD * 2, sigma_mm=0.001)
    found = solve_board_round(twice, BOARD * 2, sigma_mm=0.001, camera=sure)
    assert found.half95_mm == pytest.approx(alone.half95_mm, rel=1e-3)


@pytest.mark.parametrize(
    "solve",
    [
        lambda looks: solve_board(*looks[:2], sigma_mm=1e-9, camera=CAMERA),
        lambda looks: solve_board_fit(looks, BOARD, sigma_mm=1e-9, camera=CAMERA),
    ],
)
def test_a_board_that_hangs_the_wrong_way_round_is_known_as_well_as_any(solve):
    """At 180 degrees, where an angle goes on at -180."""
    some, other = (
        solve(seen_by_a_camera_that_is_off((30.0,), BOARD, turned_deg=turned_deg)).covariance[2][2]
        for turned_deg in (10.0, 180.0)
    )
    assert other == pytest.approx(some, rel=1e-3)
