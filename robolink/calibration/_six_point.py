"""A whole tool frame: tip by a pivot, orientation by two more points.

After the pivot the tool is moved, without turning, along its own X and then along its own Z
(or anywhere in its XZ plane). The ways of the flange, seen from the flange, are the axes
(calibration.md 2).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from robolink.calibration._checks import check_poses, keep_unmeasured
from robolink.calibration._judging import judged
from robolink.calibration._pivot import solve_pivot
from robolink.calibration._pivot_fit import UNKNOWNS, fit_pivot, pivot_design
from robolink.calibration._propagate import unit_covariance
from robolink.calibration._result import CalibrationResult
from robolink.calibration._robust import Floats
from robolink.calibration._rotations import pose_arrays, rotation_of, uvw_deg
from robolink.calibration._scatter import require_positive
from robolink.calibration._tolerance import TOUCH_TOLERANCE, Tolerance
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose

LEAST_WAY_MM = 5.0
MOST_OFF_SQUARE_DEG = 2.0
"""Raw axes that are further from a right angle are refused (calibration.md 2)."""

_TURNED_DEG = 0.01

_MEASURED = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")


@dataclass(frozen=True, slots=True, kw_only=True)
class SixPointResult(CalibrationResult):
    """A whole tool frame.

    Attributes:
        off_square_deg: By how much the two raw axes missed a right angle; ``None`` when the
            second one only had to lie in the XZ plane.
    """

    off_square_deg: float | None


@dataclass(frozen=True, slots=True)
class ToolAxis:
    """Direction of one axis of the tool, from two touches along it.

    Attributes:
        direction: Unit vector in the flange's axes.
        sigma_deg: Standard deviation of its direction across, ``None`` without a stated sigma.
    """

    direction: tuple[float, float, float]
    sigma_deg: float | None

    @property
    def tilt_deg(self) -> float:
        """Angle between this axis and the flange's Z."""
        x, y, z = self.direction
        return math.degrees(math.atan2(math.hypot(x, y), z))


def solve_six_point(
    pivot_poses: Sequence[Pose],
    along_x: Pose,
    second: Pose,
    *,
    second_is: Literal["z", "xz"] = "z",
    sigma_mm: float | None = None,
    tolerance: Tolerance = TOUCH_TOLERANCE,
) -> SixPointResult:
    """Return position and orientation of a tool.

    Args:
        pivot_poses: Flange poses (Tool 0) with the tip on one point, at least three; the
            ways below start at the last of them.
        along_x: Flange pose after a way along the tool's +X, not turned.
        second: Flange pose after a way from the same start, not turned.
        second_is: ``z``: along the tool's +Z; ``xz``: in its XZ plane, on the side of +Z.
        sigma_mm: Standard deviation of one coordinate of one placement, when it is known.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``short_axis``, ``axes_not_square``, ``turned_on_the_way``, and
            those of :func:`solve_pivot`.
        ConfigError: ``sigma_mm`` is not positive.
    """
    pivot = solve_pivot(pivot_poses, tolerance=tolerance)
    start = pivot_poses[-1]
    poses = (*pivot_poses, along_x, second)
    check_poses(poses, allow_mixed_hand=False)
    x_axis, second_axis = _way(start, along_x), _way(start, second)
    off = None if second_is == "xz" else _off_square_deg(x_axis, second_axis)
    if off is not None and abs(off) > MOST_OFF_SQUARE_DEG:
        raise CalibrationError(
            "axes_not_square",
            tr("The ways along X and Z are {angle:.1f} degrees off a right angle.", angle=off),
            remedy=tr("Move along the tool's own axes; start both ways at the last pivot pose."),
        )
    frame = _frame(x_axis, second_axis, square=second_is == "xz")
    u, v, w = uvw_deg(frame)
    positions, turned = pose_arrays(poses)
    unit = _unit_covariance(positions, turned, frame, square=second_is == "xz")
    result = SixPointResult(
        method="six_point",
        offset=keep_unmeasured(pivot.offset, u_deg=u, v_deg=v, w_deg=w),
        measured=_MEASURED,
        kept=(),
        reference_point_mm=pivot.reference_point_mm,
        sigma_gain=pivot.sigma_gain,
        warnings=tuple(doubt for doubt in pivot.warnings if not doubt.startswith("large_")),
        inputs=poses,
        residuals_mm=pivot.residuals_mm,
        condition_number=pivot.condition_number,
        rank=pivot.rank,
        off_square_deg=off,
    )
    return judged(
        result,
        np.array(pivot.residuals_mm),
        unit,
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )


def solve_tool_axis(first: Pose, second: Pose, *, sigma_mm: float | None = None) -> ToolAxis:
    """Return the direction of a tool axis along which the tip went from ``first`` to ``second``.

    Args:
        first: Flange pose (Tool 0) at the start.
        second: Flange pose at the end of the way, not turned.
        sigma_mm: Standard deviation of one coordinate of one placement.

    Raises:
        CalibrationError: ``short_axis``, ``turned_on_the_way``, and those of
            :func:`check_poses`.
        ConfigError: ``sigma_mm`` is not positive.
    """
    check_poses((first, second), allow_mixed_hand=False)
    way = _way(first, second)
    length = float(np.linalg.norm(way))
    x, y, z = (way / length).tolist()
    if sigma_mm is None:
        return ToolAxis((x, y, z), None)
    require_positive(sigma_mm, "sigma_mm")
    return ToolAxis((x, y, z), math.degrees(math.sqrt(2) * sigma_mm / length))


def _way(start: Pose, end: Pose) -> Floats:
    """Return the way of the flange in its own axes."""
    before, after = rotation_of(start), rotation_of(end)
    # Half of |R1 - R2| is sqrt2 sin(angle / 2).
    if float(np.linalg.norm(before - after)) > math.sqrt(2) * math.radians(_TURNED_DEG):
        raise CalibrationError(
            "turned_on_the_way",
            tr("The tool turned on the way that should show its axis."),
            remedy=tr("Keep the orientation of the last pivot pose."),
        )
    way: Floats = before.T @ np.subtract(end.coordinates()[:3], start.coordinates()[:3])
    if float(np.linalg.norm(way)) < LEAST_WAY_MM:
        raise CalibrationError(
            "short_axis",
            tr("The way along the axis is {way:.2f} mm.", way=float(np.linalg.norm(way))),
            remedy=tr("Move 50 mm or more; the direction is as good as the way is long."),
        )
    return way


def _off_square_deg(x_axis: Floats, z_axis: Floats) -> float:
    cosine = float(x_axis @ z_axis / (np.linalg.norm(x_axis) * np.linalg.norm(z_axis)))
    return 90.0 - math.degrees(math.acos(cosine))


def _frame(x_axis: Floats, second: Floats, *, square: bool) -> Floats:
    """Return the rotation nearest to the measured axes, or with X exact when ``square``."""
    x = x_axis / np.linalg.norm(x_axis)
    z = second / np.linalg.norm(second)
    if square:
        z = z - (z @ x) * x
        z = z / np.linalg.norm(z)
    y = np.cross(z, x)
    u, _, v = np.linalg.svd(np.column_stack((x, y / np.linalg.norm(y), z)))
    frame: Floats = u @ v
    return frame


def _unit_covariance(positions: Floats, turned: Floats, frame: Floats, *, square: bool) -> Floats:
    """Return the covariance of x, y, z and of small changes of u, v, w, for sigma = 1 mm.

    Numeric, because the last pivot pose serves the tip and both axes.
    """
    condition = pivot_design(turned[:-2]).condition_number
    start_turn = turned[-3].T
    around = np.array(uvw_deg(frame))

    def calculate(p: Floats) -> Floats:
        tip = fit_pivot(p[:-2], turned[:-2], condition_number=condition).tip
        ways = (start_turn @ (p[-2] - p[-3]), start_turn @ (p[-1] - p[-3]))
        angles = np.array(uvw_deg(_frame(*ways, square=square)))
        # Away from the jump at 180 degrees.
        return np.concatenate((tip, (angles - around + 180.0) % 360.0 - 180.0))

    return unit_covariance(calculate, positions)
