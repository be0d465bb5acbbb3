"""Bad input gives its named code and never a number; good input never gives an interval of 0."""

import math

import pytest

from robolink.calibration import (
    Beam,
    CalibrationResult,
    CameraModel,
    Crossing,
    JointTouch,
    PixelSighting,
    Robust,
    Sighting,
    Touch,
    carrying,
    require_same_camera,
    solve_board,
    solve_camera_affine,
    solve_crossed_beams,
    solve_joint,
    solve_n_angle,
    solve_one_touch,
    solve_pivot,
    solve_two_pose,
    solve_up_camera,
    solve_z_touch,
    update_guard,
    verify_drift,
)
from robolink.calibration.pin.one_touch import Pin
from robolink.errors import ConfigError
from robolink.model import Hand, Pose, ToolOffset, rotate_xy
from tests.calibration._simulated import pivoting, refused, touching

# Every bad input gives its named code, from Python, and never a number.

TIP = (12.3, -3.9)
TIP_3D = (4.2, -7.9, 131.6)
ROUND = [touching(TIP, angle) for angle in (0, 90, 180, 270)]
TILTS = [(0, 0, 0), (40, 30, 0), (-75, -15, 25), (120, 10, -30)]
PIVOT = [pivoting(TIP_3D, angles) for angles in TILTS]
SQUARE = CameraModel(((0.01, 0.0), (0.0, -0.01)), (0.0, 0.0))


def changed(poses, index, **values):
    given = list(poses)
    old = given[index]
    fields = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg", "hand", "local", "tool")
    given[index] = Pose(**{name: values.get(name, getattr(old, name)) for name in fields})
    return given


def spoilt(count, off_mm=30.0):
    return [
        changed([pose], 0, x_mm=pose.x_mm + (off_mm * (k + 1) if k < count else 0))[0]
        for k, pose in enumerate(touching(TIP, 45.0 * k) for k in range(8))
    ]


def fiducial(x, y):
    return Sighting(Pose(300, 50, 0, 0), 300 + x, 50 + y)


CASES = {
    "one pose, planar": ("too_few_poses", lambda: solve_n_angle(ROUND[:1])),
    "two poses, six axes": ("too_few_poses", lambda: solve_pivot(PIVOT[:2])),
    "the same U modulo 360": (
        "degenerate_angles",
        lambda: solve_n_angle([touching(TIP, a) for a in (10, 370, -350)]),
    ),
    "a spread below the limit": (
        "insufficient_rotation",
        lambda: solve_n_angle([touching(TIP, a) for a in (0, 10, 25)]),
    ),
    "tilts too alike": (
        "insufficient_rotation",
        lambda: solve_pivot([pivoting(TIP_3D, (a, 0.2 * (a > 0), 0)) for a in (0, 60, 120, 180)]),
    ),
    "rotation about one axis": (
        "rank_deficient",
        lambda: solve_pivot([pivoting(TIP_3D, (a, 0, 0)) for a in (0, 60, 120, 200)]),
    ),
    "NaN": ("non_finite", lambda: solve_n_angle(changed(ROUND, 1, x_mm=math.nan))),
    "infinity": ("non_finite", lambda: solve_pivot(changed(PIVOT, 2, w_deg=math.inf))),
    "NaN from a camera": ("non_finite", lambda: solve_up_camera(fiducial(math.nan, 1))),
    "metres": (
        "suspect_units",
        lambda: solve_n_angle(
            [touching((0.012, -0.004), a, pin=(0.31, 0.09, 0)) for a in (0, 120, 240)]
        ),
    ),
    "radians, planar": (
        "suspect_units",
        lambda: solve_n_angle([changed([p], 0, u_deg=math.radians(p.u_deg))[0] for p in ROUND]),
    ),
    "radians, six axes": (
        "suspect_units",
        lambda: solve_pivot(
            [
                changed(
                    [p],
                    0,
                    u_deg=math.radians(p.u_deg),
                    v_deg=math.radians(p.v_deg),
                    w_deg=math.radians(p.w_deg),
                )[0]
                for p in PIVOT
            ]
        ),
    ),
    "two hands": (
        "mixed_hand",
        lambda: solve_n_angle(changed(changed(ROUND, 0, hand=Hand.LEFT), 1, hand=Hand.RIGHT)),
    ),
    "two locals": ("mixed_local", lambda: solve_n_angle(changed(ROUND, 1, local=2))),
    "two tools": ("mixed_tool", lambda: solve_pivot(changed(PIVOT, 1, tool=3))),
    "more than a third rejected": (
        "too_many_outliers",
        lambda: solve_n_angle(spoilt(3), robust=Robust(threshold_mm=0.1)),
    ),
    "coincident fiducials": (
        "coincident_fiducials",
        lambda: solve_board(fiducial(1, 1), fiducial(1, 1)),
    ),
    "fiducials 4.9 mm apart": (
        "coincident_fiducials",
        lambda: solve_board(fiducial(0, 0), fiducial(4.9, 0)),
    ),
    "spacing off by 1.1 %": (
        "spacing_mismatch",
        lambda: solve_board(fiducial(0, 0), fiducial(40, 0), spacing_mm=40.45),
    ),
    "another camera": (
        "camera_changed",
        lambda: require_same_camera(CameraModel(((0.01, 0), (0, 0.01)), (0, 0)), SQUARE),
    ),
    "a jump": (
        "implausible_change",
        lambda: update_guard(ToolOffset(15), stored=ToolOffset(12)),
    ),
    "growing corrections": (
        "diverging",
        lambda: update_guard(ToolOffset(13), stored=ToolOffset(12), earlier_mm=[0.5]),
    ),
    "a tool of 1.2 m": (
        "implausible_offset",
        lambda: solve_n_angle([touching((1200, 0), a) for a in (0, 120, 240)]),
    ),
    "a tilted pose in a planar method": (
        "tilted_pose",
        lambda: solve_n_angle(changed(ROUND, 1, v_deg=4.0)),
    ),
    "a proof by tips that hardly turned": (
        "insufficient_rotation",
        lambda: verify_drift([touching(TIP, a) for a in (0, 3, 6, 9)], ToolOffset(*TIP)),
    ),
    "pictures that never move": (
        "rank_deficient",
        lambda: solve_camera_affine([PixelSighting(pose, 5.0, 6.0) for pose in ROUND]),
    ),
    "tools that never turn": (
        "rank_deficient",
        lambda: solve_joint([JointTouch(touching(TIP, 5), tool) for tool in (1, 1, 2)]),
    ),
    "a pin far away": (
        "implausible_offset",
        lambda: solve_one_touch(ROUND[0], Pin(0, 4000, 0)),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_input_is_refused_by_name(name):
    code, act = CASES[name]
    with refused(code):
        act()


@pytest.mark.parametrize("value", [None, "12,5"])
def test_what_is_no_number_never_becomes_a_pose(value):
    with pytest.raises(ConfigError, match="u_deg is not a number"):
        changed(ROUND, 1, u_deg=value)


def test_a_pose_that_is_no_number_is_named_with_its_field():
    with refused("non_finite") as caught:
        solve_n_angle(changed(ROUND, 2, y_mm=math.nan))
    assert "Pose 3" in caught.value.what
    assert "y_mm" in caught.value.what


def test_small_angles_alone_are_no_radians():
    with refused("insufficient_rotation"):
        solve_n_angle([touching(TIP, a) for a in (0, 2, 5)])


@pytest.mark.parametrize(
    "solve", [solve_n_angle, lambda poses, **more: solve_two_pose(*poses[:2], **more)]
)
def test_offline_two_hands_are_only_warned_of(solve):
    poses = changed(changed(ROUND, 0, hand=Hand.LEFT), 1, hand=Hand.RIGHT)
    result = solve(poses, allow_mixed_hand=True)
    assert "mixed_hand" in result.warnings
    assert result.offset.x_mm == pytest.approx(TIP[0])


# No method states an interval of 0, however well what it was given agrees.

EXACT_TIP = ToolOffset(12.0, -4.0, -20.0)
PIN = (310.0, 95.0, -40.0)
LEAST = 0.0005


def exactly_touching(u_deg, v_deg=0.0, w_deg=0.0):
    return carrying(Pose(0, 0, 0, u_deg, v_deg, w_deg), EXACT_TIP, PIN)


UPRIGHT = [exactly_touching(60.0 * k) for k in range(6)]
TILTED = [exactly_touching(60.0 * k, 20.0 * math.cos(k), 20.0 * math.sin(k)) for k in range(8)]
BEAMS = Beam(300, 80, 0), Beam(300, 80, 90)


def crossings():
    dx, dy = rotate_xy(EXACT_TIP.x_mm, EXACT_TIP.y_mm, 0.0)
    for way in (0.5, -0.5):
        entry, leaving = (Pose(300 - dx, 80 - dy + side * way, -20, 0) for side in (-1, 1))
        yield Crossing(0, entry, leaving)
        entry, leaving = (Pose(300 - dx + side * way, 80 - dy, -20, 0) for side in (-1, 1))
        yield Crossing(1, entry, leaving)


def of_a_plugin():
    return CalibrationResult(
        method="ours",
        offset=EXACT_TIP,
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
