"""The budget's camera errors match those of sightings that are really wrong."""

import math
from dataclasses import replace

import numpy as np
import pytest

from robolink.calibration import (
    AccuracyFacts,
    CalibrationResult,
    CameraModel,
    FlangePlane,
    Sighting,
    assessed,
    solve_board,
    solve_board_round,
    solve_camera_round,
    solve_runout_table,
    solve_up_camera,
)
from robolink.model import Pose, ToolOffset, rotate_xy
from robolink.stations import Station, StationKind, camera_station
from tests.calibration import test_coverage_statement as cells

MIDDLE = (300.0, 80.0)
CAMERA = CameraModel(((0.02, 0.0), (0.0, 0.02)), (290.0, 70.0), centre_mm=MIDDLE)
STORED = ToolOffset(0, 0, -20)
DRAWING = cells.DRAWING


def look(u_deg, place, *, aside, v_deg=0.0, w_deg=0.0):
    """Return the sighting of a point of the flange that was brought near the middle."""
    at = Pose(0, 0, -60, u_deg, v_deg, w_deg)
    dx, dy = FlangePlane.of(at).in_base(place[0], place[1], STORED.z_mm)
    x_mm, y_mm = MIDDLE[0] + aside[0], MIDDLE[1] + aside[1]
    return Sighting(replace(at, x_mm=x_mm - dx, y_mm=y_mm - dy), x_mm, y_mm)


def looks(angles_deg, place=(12.0, -4.0), **lean):
    random = np.random.default_rng(31)
    return [look(u, place, aside=random.normal(0, 1, 2).tolist(), **lean) for u in angles_deg]


def board(angles_deg, **lean):
    random = np.random.default_rng(32)
    seen, drawn = [], []
    for u_deg in angles_deg:
        for mark in DRAWING:
            x, y = rotate_xy(*mark, 7.0)
            aside = random.normal(0, 1, 2).tolist()
            seen.append(look(u_deg, (12.0 + x, -4.0 + y), aside=aside, **lean))
            drawn.append(mark)
    return seen, lambda some: solve_board_round(some, drawn, stored=STORED, camera=CAMERA), drawn


def pair():
    seen = [*looks((10.0,), (30.0, 2.0)), *looks((40.0,), (-10.0, -3.0))]
    return seen, lambda some: solve_board(*some, stored=STORED, camera=CAMERA), [0, 1]


def round_of(angles_deg, **lean):
    def solve(some):
        return solve_camera_round(some, stored=STORED, camera=CAMERA)

    return looks(angles_deg, **lean), solve, None


def in_space():
    (seen,) = looks((20.0,), v_deg=15.0, w_deg=170.0)
    return [replace(seen, z_mm=-30.0)], lambda some: solve_up_camera(some[0], camera=CAMERA), None


def table(**lean):
    def solve(some):
        return solve_runout_table(some, camera=CAMERA)

    return looks(range(0, 360, 45), **lean), solve, None


CASES = {
    "one look": round_of((20.0,)),
    "one look, leaning": round_of((20.0,), v_deg=3.0, w_deg=2.0),
    "one look, upside down": round_of((20.0,), w_deg=180.0),
    "one look in space": in_space(),
    "several": round_of((20.0, 70.0, 140.0, 200.0)),
    "several, leaning": round_of((20.0, 70.0, 140.0, 200.0), v_deg=2.0, w_deg=4.0),
    "table": table(),
    "table, upside down": table(w_deg=180.0),
    "pair": pair(),
    "board": board((10.0,)),
    "board, leaning": board((10.0,), v_deg=2.0, w_deg=183.0),
    "board round": board((0.0, 120.0)),
    "board round, leaning": board((0.0, 120.0), v_deg=2.0, w_deg=3.0),
}


def components(result: CalibrationResult):
    return np.array([getattr(result.offset, name) for name in result.measured])


def changed(seen, solve, move, step=1e-4):
    """Return the change of the result for one unit of an input."""
    ends = []
    for by in (step, -step):
        moved = []
        for k, one in enumerate(seen):
            dx, dy = move(k, one)
            moved.append(replace(one, x_mm=one.x_mm + by * dx, y_mm=one.y_mm + by * dy))
        ends.append(components(solve(moved)))
    return (ends[0] - ends[1]) / (2 * step)


def gain_of(result: CalibrationResult, row: str):
    (source,) = [one for one in result.sources or () if one.row == row]
    return np.array(source.gain)


@pytest.mark.parametrize("name", CASES)
def test_a_camera_that_turned_or_is_of_another_scale(name):
    seen, solve, _ = CASES[name]
    result = solve(seen)
    for row, unit in (("camera_turn_deg", 1j * math.radians(1)), ("camera_scale_percent", 0.01)):

        def away(_, one, unit=unit):
            by = unit * complex(one.x_mm - MIDDLE[0], one.y_mm - MIDDLE[1])
            return by.real, by.imag

        expected = changed(seen, solve, away)
        assert gain_of(result, row)[:, 0] == pytest.approx(expected, abs=2e-6)
        # None of them is trivially zero.
        assert np.abs(expected).max() > 1e-4


@pytest.mark.parametrize("name", CASES)
def test_the_place_counts_where_nothing_finds_it(name):
    seen, solve, _ = CASES[name]
    result = solve(seen)
    rows = [one.row for one in result.sources or ()]
    expected = changed(seen, solve, lambda *_: (1.0, 0.0))
    if "place_mm" not in rows:
        assert np.abs(expected).max() < 1e-6
        return
    gain = gain_of(result, "place_mm")
    if len(result.measured) > 2 and "z_mm" in result.measured:
        # In space it has the same length in every direction, however the flange is tilted.
        assert (gain == np.eye(3)).all()
        assert np.hypot.reduce(expected) == pytest.approx(1.0)
    else:
        assert gain[:, 0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case[2]])
def test_a_fiducial_beside_its_drawing(name):
    seen, solve, drawn = CASES[name]
    gain = gain_of(solve(seen), "print_mm")
    marks = list(dict.fromkeys(drawn))
    assert gain.shape == (3, 2 * len(marks))
    for number, mark in enumerate(marks):
        for axis, along in enumerate(((1.0, 0.0), (0.0, 1.0))):

            def aside(k, one, mark=mark, along=along):
                turned = FlangePlane.of(one.flange).in_base(*along)
                return turned if drawn[k] == mark else (0.0, 0.0)

            expected = changed(seen, solve, aside)
            assert gain[:, 2 * number + axis] == pytest.approx(expected, abs=1e-4)


def test_a_pixel_is_what_it_is_at_most():
    random = np.random.default_rng(33)
    for _ in range(20):
        matrix = random.normal(0, 0.02, (2, 2))
        (a, b), (c, d) = matrix.tolist()
        camera = CameraModel(((a, b), (c, d)), (0.0, 0.0))
        largest = float(np.linalg.svd(matrix, compute_uv=False)[0])
        assert camera.largest_mm_per_px == pytest.approx(largest)
        found = solve_camera_round(looks((0.0, 90.0)), camera=camera)
        assert gain_of(found, "tip_image_px") == pytest.approx(largest * np.eye(2))


def test_a_camera_that_answers_in_millimetres_has_pixels_of_the_usual_size():
    found = solve_camera_round(looks((0.0, 90.0)))
    assert gain_of(found, "tip_image_px") == pytest.approx(0.02 * np.eye(2))


def test_a_middle_that_nobody_knows_is_a_millimetre_away_in_either_direction():
    unknown = replace(CAMERA, centre_mm=None)
    for camera in (unknown, None):
        one = solve_camera_round(looks((20.0,)), camera=camera)
        gain = gain_of(one, "camera_scale_percent")
        assert np.hypot.reduce(gain, axis=0) == pytest.approx((0.0, 0.01, 0.01))
    # Several looks need no middle.
    several = looks((20.0, 70.0, 140.0, 200.0))
    known, guessed = (solve_camera_round(several, camera=one) for one in (CAMERA, unknown))
    assert gain_of(guessed, "camera_turn_deg") == pytest.approx(gain_of(known, "camera_turn_deg"))


def test_a_station_is_known_best_in_its_middle_unless_its_record_says_otherwise():
    pixels = {"mm_per_px": [[0.02, 0.0], [0.0, 0.02]], "origin_mm": [290.0, 70.0]}

    def model(**more):
        known = Station(
            id="CAM", kind=StationKind.CAMERA, x_mm=300, y_mm=80, z_mm=-30, details=pixels | more
        )
        found = camera_station(known).model
        assert found is not None
        return found

    assert model().centre_mm == (300, 80)
    assert model(centre_mm=[301.0, 79.0]).centre_mm == (301.0, 79.0)


def test_a_camera_found_with_the_tip_relies_on_none_of_its_own_values():
    random = np.random.default_rng(34)
    found = cells.of_unknown_place(random)
    assert [one.row for one in found.sources or ()] == ["tip_image_px"]
    assert gain_of(found, "tip_image_px")[0, 0] == pytest.approx(0.02, rel=0.02)


def test_several_angles_see_through_the_place_and_one_look_does_not():
    random = np.random.default_rng(35)
    for angles_deg, row in (((0.0,), "place_mm"), (cells.HALF_ROUND, "tip_image_px")):
        found = solve_camera_round(
            cells.seen(random, angles_deg, sigma_mm=0.002), camera=CAMERA, sigma_mm=0.002
        )
        accuracy = assessed(found, AccuracyFacts()).accuracy
        assert accuracy is not None
        assert accuracy.largest.key == row
