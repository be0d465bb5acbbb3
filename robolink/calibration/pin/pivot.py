"""Tool offset from one point touched in many orientations, on six axes.

Tilt shows Z, turning about the tool shows X and Y; a plan needs both
(docs/reference/calibration.md 2.2).
"""

import math
from collections.abc import Sequence

import numpy as np

from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.pose_checks import (
    angle_spread_deg,
    keep_unmeasured,
    refuse_radians,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult, ResidualVectors
from robolink.calibration.core.robust import Floats, Indices, Mask, Robust
from robolink.calibration.core.rotations import checked_table, rotations
from robolink.calibration.evidence.pose_evidence import copies, left_out, with_evidence
from robolink.calibration.evidence.robust_evidence import require_robust_poses, with_consensus
from robolink.calibration.pin.pivot_fit import (
    MINIMAL,
    UNKNOWNS,
    PivotDesign,
    PivotFit,
    fit_pivot,
    pivot_consensus,
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

ROBUST_POSES = 7
"""Among fewer an outlier search cannot be trusted (docs/reference/evidence.md 10)."""

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
    grid_mm: float | None = None,
) -> CalibrationResult:
    """Return X, Y and Z of a tip that was on one point in all flange poses.

    Args:
        poses: Flange poses (Tool 0), mm and degrees, at least three, in the order in which they
            were taken. All may be given in one local: the point is then a point of it.
        stored: The offset stored now; U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one placement, when it is known.
        robust: Look for outliers first; needs seven poses.
        max_condition: Largest condition number of the whole system that is accepted.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.
        tolerance: Residuals above which the result carries a warning.
        grid_mm: Step of the jogs with which the tip was brought onto the point, if it is known.

    Raises:
        CalibrationError: ``too_few_poses``, ``rank_deficient``, ``insufficient_rotation``,
            ``non_finite``, ``suspect_units``, ``mixed_hand``, ``mixed_local``,
            ``mixed_tool``, ``tool_pose``, ``robust_too_few``, ``robust_unstable``,
            ``too_many_outliers`` or ``implausible_offset``.
        ConfigError: ``sigma_mm``, ``grid_mm`` or the threshold is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import carrying, solve_pivot
        >>> tip, pin_mm = ToolOffset(12.5, -3.25, 80), (300, 100, -80)
        >>> angles = [(0, 0, 180), (90, 20, 180), (180, 0, 160), (-90, -20, 180), (45, 0, 200)]
        >>> poses = [carrying(Pose(0, 0, 0, *uvw), tip, pin_mm) for uvw in angles]
        >>> found = solve_pivot(poses)
        >>> [round(value, 3) for value in (found.offset.x_mm, found.offset.y_mm, found.offset.z_mm)]
        [12.5, -3.25, 80.0]
    """
    require_poses(len(poses), MINIMAL)
    table, warnings = checked_table(poses, allow_mixed_hand=allow_mixed_hand)
    positions, turned = table[:, :3], rotations(table[:, 3:])
    duplicates = copies(table)
    distinct = len(poses) - len(duplicates)
    require_poses(distinct, MINIMAL)
    kept: Mask = np.ones(len(poses), dtype=bool)
    if duplicates:
        kept[list(duplicates)] = False
    design = pivot_design(turned if not duplicates else turned[kept])
    _require_observable(poses, distinct, design, max_condition)
    spread_mm = 0.0
    if robust is not None:
        require_robust_poses(distinct, ROBUST_POSES)
        kept, spread_mm = _agreeing(positions, turned, np.flatnonzero(kept), robust, sigma_mm)
        design = pivot_design(turned[kept])
        _require_observable(poses, int(kept.sum()), design, max_condition)
    all_kept = bool(kept.all())
    fit = fit_pivot(
        positions,
        turned,
        condition_number=design.condition_number,
        kept=None if all_kept else kept,
        mean=design.mean,
    )
    residuals = fit.residuals if all_kept else fit.residuals[kept]
    result = judged(
        _result(
            fit,
            design,
            stored,
            warnings=(*warnings, *_doubts(design, distinct)),
            inputs=tuple(poses),
            rejected=left_out(kept, duplicates),
        ),
        residuals,
        design.unit_covariance,
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
        grid_mm=grid_mm,
    )
    result = with_evidence(
        result,
        (turned if all_kept else turned[kept]) - design.mean,
        residuals,
        unit_covariance=design.unit_covariance,
        kept=np.flatnonzero(kept),
        duplicates=duplicates,
        unknowns=UNKNOWNS,
    )
    return with_consensus(result, kept, spread_mm) if robust else result


def _result(
    fit: PivotFit,
    design: PivotDesign,
    stored: ToolOffset | None,
    *,
    warnings: tuple[str, ...],
    inputs: tuple[Pose, ...],
    rejected: tuple[int, ...],
) -> CalibrationResult:
    return CalibrationResult(
        method="pivot",
        offset=keep_unmeasured(stored, **dict(zip(_MEASURED, fit.tip.tolist(), strict=True))),
        measured=_MEASURED,
        kept=_KEPT,
        reference_point_mm=tuple(fit.point.tolist()),
        sigma_gain=math.sqrt(float(design.unit_covariance.diagonal().max())),
        warnings=warnings,
        inputs=inputs,
        rejected=rejected,
        residuals_mm=ResidualVectors(fit.residuals.tobytes(), 3),
        condition_number=design.condition_number,
        rank=design.rank,
        unobservable=_KEPT,
        sources=(ErrorSource.of_lengths("touch_mm", 3),),
    )


def _agreeing(
    positions: Floats,
    turned: Floats,
    among: Indices,
    robust: Robust,
    sigma_mm: float | None,
) -> tuple[Mask, float]:
    """Return which poses agree, and how far results of other draws lie apart."""
    p, r = positions[among], turned[among]
    found = pivot_consensus(p, r, robust, sigma_mm=sigma_mm)
    tips = []
    for agreeing in (found.kept, *found.others):
        condition = pivot_design(r[agreeing]).condition_number
        tips.append(fit_pivot(p, r, condition_number=condition, kept=agreeing).tip)
    kept: Mask = np.zeros(len(positions), dtype=bool)
    kept[among[found.kept]] = True
    return kept, max(float(np.linalg.norm(a - b)) for a in tips for b in tips)


def _doubts(design: PivotDesign, count: int) -> tuple[str, ...]:
    weak = ("small_rotation",) if design.condition_number > WARN_CONDITION else ()
    return (*weak, "few_poses") if count < RECOMMENDED_POSES else weak


def _require_observable(
    poses: Sequence[Pose], count: int, design: PivotDesign, max_condition: float
) -> None:
    least = LEAST_SINGULAR_VALUE * math.sqrt(count / 30) * MAX_CONDITION / max_condition
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
                "Tilt it by 30 degrees or more; a four-axis robot can find X and Y "
                "only, with the method n-angle."
            ),
        )
    if weak:
        raise CalibrationError(
            "insufficient_rotation",
            tr(
                "The orientations differ too little along {axis}: every error of a "
                "touch would count {gain:.1f} times (condition {condition:.0f}).",
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
