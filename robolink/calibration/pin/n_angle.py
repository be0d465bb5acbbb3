"""Tool offset from one point touched or seen at several known angles, on four axes."""

from collections.abc import Sequence

import numpy as np

from robolink.calibration.core.planar_checks import MIN_ROTATION_DEG, check_planar
from robolink.calibration.core.pose_checks import keep_unmeasured
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Mask, Robust
from robolink.calibration.pin.planar import UNKNOWNS, Complexes, fit_planar, fit_planar_robust
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.tolerances import PLANAR_TOLERANCE, Tolerance
from robolink.model import Pose, ToolOffset

RECOMMENDED_POSES = 4


# Two poses always agree with each other: more have to confirm them before any is an outlier.
_ROBUST_POSES = 4

_KEPT = ("z_mm", "u_deg", "v_deg", "w_deg")


def solve_n_angle(
    poses: Sequence[Pose],
    *,
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
    robust: Robust | None = None,
    min_rotation_deg: float = MIN_ROTATION_DEG,
    allow_mixed_hand: bool = False,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> CalibrationResult:
    """Return the offset of a tip that was on one point in all flange poses.

    The angles are taken as known, so the fit is linear and exact on any arc
    (docs/reference/calibration.md 2.1). X and Y are measured, the rest is kept.

    Args:
        poses: Flange poses (Tool 0), mm and degrees, at least two.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one placement, when it is known.
        robust: Look for outliers first; needs four poses.
        min_rotation_deg: Smallest arc over which the angles have to spread.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``degenerate_angles``, ``insufficient_rotation``,
            ``tilted_pose``, ``non_finite``, ``suspect_units``, ``mixed_hand``,
            ``mixed_local``, ``mixed_tool``, ``too_many_outliers`` or ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    warnings = check_planar(
        poses,
        minimum=_ROBUST_POSES if robust else 2,
        min_rotation_deg=min_rotation_deg,
        allow_mixed_hand=allow_mixed_hand,
    )
    if len(poses) < RECOMMENDED_POSES:
        warnings = (*warnings, "few_poses")
    p, z = planar_arrays(poses)
    kept: Mask = np.ones(len(poses), dtype=bool)
    if robust is None:
        fit = fit_planar(p, z)
    else:
        fit, kept = fit_planar_robust(p, z, robust, sigma_mm=sigma_mm)
        _require_spread_of_kept(poses, kept, min_rotation_deg)
    result = CalibrationResult(
        method="n-angle",
        offset=keep_unmeasured(stored, x_mm=fit.tip.real, y_mm=fit.tip.imag),
        measured=("x_mm", "y_mm"),
        kept=_KEPT,
        reference_point_mm=(fit.point.real, fit.point.imag),
        sigma_gain=fit.sigma_gain,
        warnings=warnings,
        inputs=tuple(poses),
        residuals_mm=tuple((e.real, e.imag) for e in fit.residuals.tolist()),
        rejected=tuple(np.flatnonzero(~kept).tolist()),
        condition_number=fit.condition_number,
        rank=UNKNOWNS,
        unobservable=_KEPT,
    )
    return judged(
        result,
        fit.residuals[kept].view(float).reshape(-1, 2),
        np.eye(2) * fit.sigma_gain**2,
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )


def _require_spread_of_kept(poses: Sequence[Pose], kept: Mask, min_rotation_deg: float) -> None:
    chosen = [pose for pose, keep in zip(poses, kept, strict=True) if keep]
    check_planar(chosen, minimum=2, min_rotation_deg=min_rotation_deg, allow_mixed_hand=True)


def planar_arrays(poses: Sequence[Pose]) -> tuple[Complexes, Complexes]:
    """Return flange positions x + iy in mm and orientations exp(iU)."""
    table = np.array([(pose.x_mm, pose.y_mm, pose.u_deg) for pose in poses])
    return table[:, 0] + 1j * table[:, 1], np.exp(1j * np.radians(table[:, 2]))
