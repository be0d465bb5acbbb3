"""The picture of a measurement: residuals, the interval as an ellipse, the poses from above."""

import math
from dataclasses import replace
from xml.etree.ElementTree import tostring

import numpy as np
import pytest

from robolink.calibration import Robust, Touch, solve_n_angle, solve_two_pose, solve_z_touch
from robolink.model import ControllerFacts, Pose, ToolOffset
from robolink.report import Outcome, Report, render
from robolink.report.pictures.plans import pose_drawings
from robolink.report.pictures.residuals import fit_drawings, interval_ellipse, order_drawings

TIP = ToolOffset(12.0, -3.5, -20.0)
ERRORS = ((0.012, -0.004), (-0.009, 0.011), (0.003, 0.007), (-0.006, -0.010), (0.004, 0.002))


def touches(*angles_deg, errors=ERRORS):
    poses = []
    for angle, (dx, dy) in zip(angles_deg, errors, strict=False):
        a = math.radians(angle)
        x = 200 + dx - math.cos(a) * TIP.x_mm + math.sin(a) * TIP.y_mm
        y = 300 + dy - math.sin(a) * TIP.x_mm - math.cos(a) * TIP.y_mm
        poses.append(Pose(x, y, -80.0, angle))
    return poses


def report(result):
    return Report(
        made_at="2026-03-04T10:11:12+00:00",
        robolink_version="1.2.3",
        controller="epson+tcp://192.168.0.1:5000",
        facts=ControllerFacts(),
        tool=1,
        before=TIP,
        after=result.offset,
        outcome=Outcome.PROPOSED,
        method=result.method,
        determined=result.measured,
        poses=result.inputs,
        fit=result,
    )


def drawn(parts):
    return "".join(tostring(part.svg, encoding="unicode") + part.caption for part in parts)


@pytest.mark.parametrize("angles", [(0, 20, 45, 60, 90), (0, 72, 144, 216, 288)])
def test_the_ellipse_reaches_as_far_as_the_intervals_of_x_and_y(angles):
    result = solve_n_angle(touches(*angles))
    axes = interval_ellipse(result)
    assert axes is not None
    long_mm, short_mm, turn_deg = axes
    assert long_mm >= short_mm > 0
    turn = math.radians(turn_deg)
    reach_x = math.hypot(long_mm * math.cos(turn), short_mm * math.sin(turn))
    reach_y = math.hypot(long_mm * math.sin(turn), short_mm * math.cos(turn))
    assert (reach_x, reach_y) == pytest.approx(result.half_width95[:2])
    values, vectors = np.linalg.eigh(np.array(result.covariance))
    assert short_mm / long_mm == pytest.approx(math.sqrt(values[0] / values[1]))
    if short_mm < 0.99 * long_mm:
        along = np.array([math.cos(turn), math.sin(turn)])
        assert abs(along @ vectors[:, 1]) == pytest.approx(1.0)


def test_two_touches_have_no_ellipse_and_the_page_says_why():
    result = solve_two_pose(*touches(0, 180))
    assert interval_ellipse(result) is None
    assert drawn(fit_drawings(result)) == ""
    assert "Repeatable: not known (two touches cannot check each other)." in render(report(result))


def test_a_pose_without_a_residual_has_its_number_and_the_plan_names_its_cross():
    result = solve_two_pose(*touches(0, 180))
    page = render(report(result))
    assert "along X" not in page
    assert "second move" not in page
    assert "the cross the reference point" in drawn(pose_drawings(result))
    nowhere = replace(result, reference_point_mm=())
    assert "cross" not in drawn(pose_drawings(nowhere))


def test_three_residuals_have_an_order_and_two_have_none():
    result = solve_n_angle(touches(0, 120, 240))
    assert drawn(order_drawings(result, {}))
    fewer = replace(result, residuals_mm=result.residuals_mm[:2])
    assert not drawn(order_drawings(fewer, {}))


def test_a_stated_sigma_gives_two_touches_an_ellipse():
    result = solve_two_pose(*touches(0, 180), sigma_mm=0.02)
    assert "<ellipse" in drawn(fit_drawings(result))
    assert "stated standard deviation of 0.02 mm" in render(report(result))


def test_each_pose_has_its_dot_its_row_and_its_place():
    result = solve_n_angle(touches(0, 72, 144, 216, 288))
    picture, page = drawn(fit_drawings(result)), render(report(result))
    assert picture.count('class="point"') == len(ERRORS) + 1  # and the middle of the ellipse
    assert 'class="rms"' in picture
    for residual in result.residual_distances_mm:
        assert f'value="{residual!r}"' in page
    assert drawn(pose_drawings(result)).count("<polygon") == len(ERRORS)
    assert "degrees of freedom: 6" in page


def test_a_pose_that_was_left_out_is_marked_in_picture_table_and_plan():
    angles = (0, 60, 120, 180, 240, 300)
    errors = ((0.0, 0.0),) * 3 + ((1.5, 0.0),) + ((0.0, 0.001),) * 2
    result = solve_n_angle(touches(*angles, errors=errors), robust=Robust())
    assert result.rejected == (3,)
    picture, page = drawn(fit_drawings(result)), render(report(result))
    assert picture.count('class="largest"') == 1
    assert "red: left out" in picture
    assert "4 (left out)" in page
    assert drawn(pose_drawings(result)).count('class="largest"') == 1


def test_heights_have_no_picture_from_above_and_need_none():
    touches = [Touch(-106.0 - 0.01 * v + e, v) for v, e in ((2.0, 0.002), (1.0, 0.0), (2.0, 0.0))]
    result = solve_z_touch(touches, -86.0, stored=TIP)
    assert result.residuals_mm
    assert drawn(fit_drawings(result)) == drawn(pose_drawings(result)) == ""
    assert "repeatable to, 95 %" in render(report(result))
