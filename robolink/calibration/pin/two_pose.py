"""Tool offset from two flange poses on one reference point.

With the tip on the same point in both poses, ``p1 + Rz(U1) t = p2 + Rz(U2) t``, hence

    (Rz(U1) - Rz(U2)) t = p2 - p1

EPSON's formula ``t = (p2 - p1) / 2`` is the case U1 = 0, U2 = 180. The closed form below
holds for any two angles (docs/reference/calibration.md 1.1): with d = p2 - p1, h = (U2 - U1) / 2
and m = Rz(-(U1 + U2) / 2) d,

    t = (-m_y, m_x) / (2 sin h)

Two poses leave no degree of freedom: no residual exists, and the result cannot tell its own
error. Each length has the standard deviation of one placement times 1 / (sqrt2 sin|h|).
"""

import math
from collections.abc import Sequence

from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.planar_checks import (
    MIN_ROTATION_DEG,
    check_planar,
    planar_sigma_gain,
)
from robolink.calibration.core.pose_checks import keep_unmeasured
from robolink.calibration.core.result import CalibrationResult
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg, rotate_xy

MEASURED = ("x_mm", "y_mm")


def solve_two_pose(
    first: Pose,
    second: Pose,
    *,
    stored: ToolOffset | None = None,
    min_rotation_deg: float = MIN_ROTATION_DEG,
    allow_mixed_hand: bool = False,
    sigma_mm: float | None = None,
) -> CalibrationResult:
    """Return the offset of a tip that touched one point in both flange poses.

    Args:
        first: Flange pose (Tool 0), mm and degrees.
        second: Flange pose with another U; the order does not matter.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        min_rotation_deg: Smallest difference of U, modulo 360, that is accepted.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.
        sigma_mm: Standard deviation of one coordinate of one placement. Without it the result
            has no interval, because two poses leave no residual.

    Raises:
        CalibrationError: ``degenerate_angles``, ``insufficient_rotation``, ``non_finite``,
            ``suspect_units``, ``mixed_hand``, ``mixed_local``, ``mixed_tool`` or
            ``implausible_offset``, or ``tilted_pose``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    warnings = check_planar(
        (first, second),
        minimum=2,
        min_rotation_deg=min_rotation_deg,
        allow_mixed_hand=allow_mixed_hand,
    )
    half = math.radians(angle_difference_deg(second.u_deg, first.u_deg) / 2)
    d_x, d_y = second.x_mm - first.x_mm, second.y_mm - first.y_mm
    mean_deg = first.u_deg + math.degrees(half)
    m_x, m_y = rotate_xy(d_x, d_y, -mean_deg)
    scale = 2 * math.sin(half)
    t_x, t_y = -m_y / scale, m_x / scale
    at_x, at_y = rotate_xy(t_x, t_y, first.u_deg)
    gain = planar_sigma_gain((first, second))
    scatter = Dispersion.of(0.0, 0, sigma_mm)
    variance = (scatter.sigma_mm * gain) ** 2 if scatter else 0.0
    covariance = ((variance, 0.0), (0.0, variance)) if scatter else ()
    return CalibrationResult(
        method="two-pose",
        offset=keep_unmeasured(stored, x_mm=t_x, y_mm=t_y),
        measured=MEASURED,
        kept=("z_mm", "u_deg", "v_deg", "w_deg"),
        reference_point_mm=(first.x_mm + at_x, first.y_mm + at_y),
        sigma_gain=gain,
        warnings=warnings,
        inputs=(first, second),
        covariance=covariance,
        half_width95=scatter.half_widths(covariance) if scatter else (),
        sigma_mm=sigma_mm,
        sigma_stated=scatter is not None,
        rank=4,
        dof=0,
        unobservable=("z_mm", "u_deg", "v_deg", "w_deg"),
    )


def two_of(poses: Sequence[Pose]) -> tuple[Pose, Pose]:
    """Return the two poses that the method takes.

    Raises:
        CalibrationError: ``too_few_poses``.
        ConfigError: There are more than two.
    """
    if len(poses) < 2:
        raise CalibrationError(
            "too_few_poses",
            tr("{count} pose was given; the method needs two.", count=len(poses)),
            remedy=tr("Touch the same point at two angles of U, best half a turn apart."),
        )
    if len(poses) > 2:
        raise ConfigError(
            tr("{count} poses were given; the method takes two.", count=len(poses)),
            remedy=tr("Choose the two that differ most in U."),
        )
    first, second = poses
    return first, second
