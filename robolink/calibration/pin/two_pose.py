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
from dataclasses import replace

from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.dispersion import Dispersion, interval_of
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    check_planar,
    components,
    heading_deg,
    on_its_head,
    planar_sigma_gain,
    refuses_by_name,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg, rotate_xy


@refuses_by_name
def solve_two_pose(
    first: Pose,
    second: Pose,
    *,
    stored: ToolOffset | None = None,
    min_rotation_deg: float = MIN_ROTATION_DEG,
    allow_mixed_hand: bool = False,
    sigma_mm: float | None = None,
    grid_mm: float | None = None,
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
        grid_mm: Step of the jogs with which the tip was brought onto the point, if it is known.

    Raises:
        CalibrationError: ``degenerate_angles``, ``insufficient_rotation``, ``non_finite``,
            ``suspect_units``, ``mixed_hand``, ``mixed_local``, ``mixed_tool``, ``tool_pose``,
            ``implausible_offset`` or ``tilted_pose``.
        ConfigError: ``sigma_mm`` or ``grid_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import solve_two_pose
        >>> found = solve_two_pose(Pose(287.5, 103.25, -60, 0), Pose(312.5, 96.75, -60, 180))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.5, -3.25)
    """
    warnings = check_planar(
        (first, second),
        minimum=2,
        min_rotation_deg=min_rotation_deg,
        allow_mixed_hand=allow_mixed_hand,
    )
    start_deg, end_deg = heading_deg(first), heading_deg(second)
    half = math.radians(angle_difference_deg(end_deg, start_deg) / 2)
    d_x, d_y = second.x_mm - first.x_mm, second.y_mm - first.y_mm
    mean_deg = start_deg + math.degrees(half)
    m_x, m_y = rotate_xy(d_x, d_y, -mean_deg)
    scale = 2 * math.sin(half)
    t_x, t_y = -m_y / scale, m_x / scale
    at_x, at_y = rotate_xy(t_x, t_y, start_deg)
    if on_its_head(first):  # the second one is the same way up, as checked above
        t_y = -t_y
    result = CalibrationResult(
        method="two-pose",
        **components(stored, x_mm=t_x, y_mm=t_y),
        reference_point_mm=(first.x_mm + at_x, first.y_mm + at_y),
        sigma_gain=planar_sigma_gain((first, second)),
        warnings=warnings,
        inputs=(first, second),
        rank=4,
        dof=0,
        sources=(ErrorSource.of_lengths("touch_mm", 2),),
        sigma_stated=sigma_mm is not None,
    )
    return _with_interval(result, Dispersion.of(0.0, 0, sigma_mm, grid_mm))


def _with_interval(result: CalibrationResult, spread: Dispersion | None) -> CalibrationResult:
    from_grid = spread is not None and spread.source == "resolution"
    notes = ("resolution_floor",) if from_grid else ("order_not_testable",)
    if spread is None:
        return replace(result, notes=notes)
    variance = (spread.sigma_mm * result.sigma_gain) ** 2
    return replace(
        result,
        notes=notes,
        **interval_of(spread, (variance, variance), 2),
        sigma_mm=spread.sigma_mm,
        interval_from=spread.source,
        budget=spread.budget(result.sigma_gain),
    )


def two_of(poses: Sequence[Pose]) -> tuple[Pose, Pose]:
    """Return the two poses that the method uses.

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
