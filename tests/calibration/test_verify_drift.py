"""Turning about an offset shows its error, twice."""

import pytest

from robolink.calibration import verify_drift
from robolink.model import Hand, Pose, ToolOffset
from tests.calibration._simulated import pivoting, refused, touching

TIP = (12.3, -3.9)
TIP_3D = (4.2, -7.9, 131.6)
TILTS = [(0, 0, 0), (40, 30, 0), (-75, -15, 25), (120, 10, -30)]


def around(angles=(0, 90, 180, 270)):
    return [touching(TIP, angle) for angle in angles]


def test_a_right_offset_does_not_drift():
    result = verify_drift(around(), ToolOffset(*TIP))
    assert result.max_drift_mm == pytest.approx(0, abs=1e-10)
    assert result.passed
    assert [drift.u_deg for drift in result.drifts] == [0, 90, 180, 270]
    assert result.warnings == ()


def test_an_error_shows_twice_half_a_turn_later():
    result = verify_drift(around(), ToolOffset(TIP[0] + 0.06, TIP[1]))
    assert [drift.distance_mm for drift in result.drifts] == pytest.approx(
        [0, 0.06 * 2**0.5, 0.12, 0.06 * 2**0.5]
    )
    assert not result.passed
    assert verify_drift(around(), ToolOffset(TIP[0] + 0.06, TIP[1]), tolerance_mm=0.2).passed


def test_a_wrong_length_shows_when_the_tool_is_tilted():
    poses = [pivoting(TIP_3D, angles) for angles in TILTS]
    assert verify_drift(poses, ToolOffset(*TIP_3D)).max_drift_mm < 1e-9
    wrong = ToolOffset(TIP_3D[0], TIP_3D[1], TIP_3D[2] + 0.5)
    result = verify_drift(poses, wrong)
    assert not result.passed
    assert any(abs(drift.dz_mm) > 0.05 for drift in result.drifts)


def test_the_height_of_a_four_axis_robot_is_not_judged():
    first, second = around((0, 180))
    raised = Pose(second.x_mm, second.y_mm, second.z_mm + 3, 180, tool=0)
    assert verify_drift([first, raised], ToolOffset(*TIP)).passed


def test_a_weak_test_says_so():
    assert verify_drift(around((0, 60)), ToolOffset(*TIP)).warnings == (
        "small_rotation",
        "few_poses",
    )


def test_what_proves_nothing_is_refused():
    with refused("insufficient_rotation"):
        verify_drift(around((0, 5, 10)), ToolOffset(*TIP))
    with refused("too_few_poses"):
        verify_drift(around((0,)), ToolOffset(*TIP))
    with refused("mixed_hand"):
        verify_drift(
            [touching(TIP, 0, hand=Hand.LEFT), touching(TIP, 180, hand=Hand.RIGHT)],
            ToolOffset(*TIP),
        )
