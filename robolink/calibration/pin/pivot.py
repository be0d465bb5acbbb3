"""Tool offset from one point touched in many orientations, on six axes.

Tilt shows Z, turning about the tool shows X and Y; a plan needs both
(docs/reference/calibration.md 2.2).
"""

import math
from collections.abc import Sequence

import numpy as np

from robolink.calibration.core.planar_checks import angle_spread_deg, refuse_radians, require_poses
from robolink.calibration.core.pose_checks import check_poses, keep_unmeasured
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Mask, Robust
from robolink.calibration.core.rotations import pose_arrays
from robolink.calibration.pin.pivot_fit import (
    UNKNOWNS,
    PivotDesign,
    fit_pivot,
    fit_pivot_robust,
    pivot_design,
)
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.tolerances import TOUCH_TOLERANCE, Tolerance
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

WARN_CONDITION = 20.0

MAX_CONDITION = 100.0

LEAST_SINGULAR_VALUE = 0.1
"""Of the 3N x 6 system for 30 poses; it grows with the root of their number."""

RECOMMENDED_POSES = 4


# Three poses always agree on something; more have to confirm it before any is an outlier.
_ROBUST_POSES = 5

_MEASURED = ("x_mm", "y_mm", "z_mm")

_KEPT = ("u_deg", "v_deg", "w_deg")

_CLEARLY_ALONG = 0.98


def solve_pivot(
    poses: Sequence[Pose],
    *,
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
    robust: Robust | None = None,
    max_condition: float = MAX_CONDITION,
    allow_mixed_hand: bool = False,
    tolerance: Tolerance = TOUCH_TOLERANCE,
) -> CalibrationResult:
    """Return X, Y and Z of a tip that was on one point in all flange poses.

    Args:
        poses: Flange poses (Tool 0), mm and degrees, at least three.
        stored: The offset stored now; U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one placement, when it is known.
        robust: Look for outliers first; needs five poses.
        max_condition: Largest condition number of the whole system that is accepted.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``rank_deficient``, ``insufficient_rotation``,
            ``non_finite``, ``suspect_units``, ``mixed_hand``, ``mixed_local``,
            ``mixed_tool``, ``too_many_outliers`` or ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    require_poses(len(poses), _ROBUST_POSES if robust else 3)
    warnings = check_poses(poses, allow_mixed_hand=allow_mixed_hand)
    positions, turned = pose_arrays(poses)
    design = pivot_design(turned)
    _require_observable(poses, design, max_condition)
    kept: Mask = np.ones(len(poses), dtype=bool)
    if robust is None:
        fit = fit_pivot(positions, turned, condition_number=design.condition_number)
    else:
        fit, kept = fit_pivot_robust(positions, turned, robust, sigma_mm=sigma_mm)
        design = pivot_design(turned[kept])
        _require_observable(
            [poses[i] for i in np.flatnonzero(kept).tolist()], design, max_condition
        )
    result = CalibrationResult(
        method="pivot",
        offset=keep_unmeasured(stored, **dict(zip(_MEASURED, fit.tip.tolist(), strict=True))),
        measured=_MEASURED,
        kept=_KEPT,
        reference_point_mm=tuple(fit.point.tolist()),
        sigma_gain=math.sqrt(float(design.unit_covariance.diagonal().max())),
        warnings=(*warnings, *_doubts(design, len(poses))),
        inputs=tuple(poses),
        residuals_mm=tuple(map(tuple, fit.residuals.tolist())),
        rejected=tuple(np.flatnonzero(~kept).tolist()),
        condition_number=design.condition_number,
        rank=design.rank,
        unobservable=_KEPT,
    )
    return judged(
        result,
        fit.residuals[kept],
        design.unit_covariance,
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )


def _doubts(design: PivotDesign, count: int) -> tuple[str, ...]:
    weak = ("small_rotation",) if design.condition_number > WARN_CONDITION else ()
    return (*weak, "few_poses") if count < RECOMMENDED_POSES else weak


def _require_observable(poses: Sequence[Pose], design: PivotDesign, max_condition: float) -> None:
    least = LEAST_SINGULAR_VALUE * math.sqrt(len(poses) / 30) * MAX_CONDITION / max_condition
    weak = design.condition_number > max_condition or design.smallest_singular_value < least
    if weak:
        angles = zip(*(pose.coordinates()[3:] for pose in poses), strict=True)
        refuse_radians(poses, max(angle_spread_deg(axis) for axis in angles))
    if design.rank < UNKNOWNS:
        raise CalibrationError(
            "rank_deficient",
            tr(
                "The tool turned about one axis only, so the tip along {axis} is unknown.",
                axis=_axis_name(design),
            ),
            remedy=tr(
                "Tilt it by 30 degrees or more; a robot of four axes can only tell X and Y, "
                "with the method n_angle."
            ),
        )
    if weak:
        raise CalibrationError(
            "insufficient_rotation",
            tr(
                "The orientations differ too little along {axis}: every placement error would "
                "count {gain:.1f} times (condition {condition:.0f}).",
                axis=_axis_name(design),
                gain=math.sqrt(float(design.unit_covariance.diagonal().max())),
                condition=design.condition_number,
            ),
            remedy=tr("Tilt the tool by 15 to 45 degrees and turn it as well."),
        )


def _axis_name(design: PivotDesign) -> str:
    x, y, z = design.weakest_axis.tolist()
    for name, value in zip("XYZ", (x, y, z), strict=True):
        if abs(value) > _CLEARLY_ALONG:
            return name
    return f"({x:.2f}, {y:.2f}, {z:.2f})"
