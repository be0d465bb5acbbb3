"""Tool offset from one point touched in many orientations, on six axes.

Tilt shows Z, turning about the tool shows X and Y; a plan needs both
(docs/reference/calibration.md 2.2).

The algebra of a pivot: one tip on one point in many orientations, on plain arrays.

With the flange at p and its rotation R, the tip is at p + R t, always at c. The least squares
over t and c, with the means Rm and pm taken off, is a 3 x 3 system
(docs/reference/calibration.md 2.2):

    (N I - N Rm' Rm) t = -(sum R_i' p_i - N Rm' pm),   c = Rm t + pm

The eigenvalues of the whole 3N x 6 system are N (1 +- s) with s the singular values of Rm, so
its condition number and rank are known before it is solved. Normal equations cost twice the
digits that the condition costs; where it is bad, the system is solved by QR instead.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.least_squares import (
    Agreement,
    Consensus,
    Floats,
    Indices,
    Mask,
    Robust,
    largest_consensus,
)
from robolink.calibration.core.pose_checks import (
    angle_spread_deg,
    components,
    refuse_radians,
    refuses_by_name,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult, ResidualVectors
from robolink.calibration.core.rotations import checked_table, rotations
from robolink.calibration.quality.doubts import TOUCH_TOLERANCE, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.pose_evidence import (
    copies,
    left_out,
    require_robust_poses,
    with_consensus,
    with_evidence,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

UNKNOWNS = 6

MINIMAL = 3

QR_ABOVE_CONDITION = 50.0

_ONE = np.eye(3)

_RANK_BELOW = 1e-9
"""If 1 - s is below this, the rotations do not determine that direction."""


@dataclass(frozen=True, slots=True, eq=False)  # arrays have no equality or hash
class PivotDesign:
    """What the orientations of the poses allow, before any position is used.

    Attributes:
        condition_number: Of the 3N x 6 system.
        rank: Of the same.
        smallest_singular_value: Of the same.
        weakest_axis: Unit vector in flange axes along which the tip is known worst.
        unit_covariance: Of the tip for sigma = 1, 3 x 3; infinite where the rank is short.
        mean: Of the rotations, 3 x 3.
    """

    condition_number: float
    rank: int
    smallest_singular_value: float
    weakest_axis: Floats
    unit_covariance: Floats
    mean: Floats


@dataclass(frozen=True, slots=True, eq=False)  # arrays have no equality or hash
class PivotFit:
    """Tip and pivot point, mm, with the residual vector of every pose in base axes."""

    tip: Floats
    point: Floats
    residuals: Floats


def pivot_design(rotations: Floats) -> PivotDesign:
    """Return what N x 3 x 3 rotations can determine about a tip."""
    count = len(rotations)
    # Plain sums and floats: for a few poses the calls cost more than the arithmetic.
    mean = np.einsum("ijk->jk", rotations) / count  # three times as fast as a sum along an axis
    _, s, axes = np.linalg.svd(mean)
    largest, *_ = singular = s.tolist()
    gaps = [max(1 - value, 0.0) for value in singular]
    lost = sum(gap < _RANK_BELOW for gap in gaps)
    if lost:
        covariance = np.full((3, 3), np.inf)
    else:
        told = [count * gap * (1 + value) for gap, value in zip(gaps, singular, strict=True)]
        covariance = (axes.T / told) @ axes
    return PivotDesign(
        condition_number=math.sqrt((1 + largest) / gaps[0]) if gaps[0] > 0 else math.inf,
        rank=UNKNOWNS - lost,
        smallest_singular_value=math.sqrt(count * gaps[0]),
        weakest_axis=axes[0],
        unit_covariance=covariance,
        mean=mean,
    )


def fit_pivot(
    positions: Floats,
    rotations: Floats,
    *,
    condition_number: float,
    kept: Mask | None = None,
    mean: Floats | None = None,
) -> PivotFit:
    """Return the least squares of the kept poses; residuals are those of all poses.

    Args:
        positions: N x 3, mm.
        rotations: N x 3 x 3.
        condition_number: As :func:`pivot_design` tells it; decides how it is solved.
        kept: Which poses count.
        mean: Of their rotations, where :func:`pivot_design` told it.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import fit_pivot
        >>> rotations = np.array([np.eye(3), np.diag([1, -1, -1]), np.diag([-1, 1, -1])])
        >>> tip, point = np.array([12.5, -3.25, 80.0]), np.array([300.0, 100.0, -80.0])
        >>> fit = fit_pivot(point - rotations @ tip, rotations, condition_number=2.0)
        >>> [round(float(value), 3) for value in fit.tip]
        [12.5, -3.25, 80.0]
    """
    p, r = (positions, rotations) if kept is None else (positions[kept], rotations[kept])
    solve = _by_qr if condition_number > QR_ABOVE_CONDITION else _by_normal_equations
    tip, point = solve(p, r, r.sum(axis=0) / len(r) if mean is None else mean)
    # One tall matrix: multiplying many small ones takes six times as long.
    turned = (rotations.reshape(-1, 3) @ tip).reshape(-1, 3)
    return PivotFit(tip, point, positions + turned - point)


def pivot_consensus(
    positions: Floats, rotations: Floats, robust: Robust, *, sigma_mm: float | None
) -> Consensus:
    """Return which poses belong together.

    Raises:
        CalibrationError: ``too_many_outliers``.
    """

    def of_fit(kept: Mask) -> Floats | None:
        if np.count_nonzero(kept) < MINIMAL:
            return None
        design = pivot_design(rotations[kept])
        if design.rank < UNKNOWNS:
            return None
        condition = design.condition_number
        return _lengths(
            fit_pivot(positions, rotations, condition_number=condition, kept=kept).residuals
        )

    agreement = Agreement(
        len(positions),
        MINIMAL,
        3,
        UNKNOWNS,
        lambda samples: _of_samples(positions, rotations, samples),
        of_fit,
    )
    return largest_consensus(agreement, robust, sigma_mm=sigma_mm)


def fit_pivot_robust(
    positions: Floats, rotations: Floats, robust: Robust, *, sigma_mm: float | None
) -> tuple[PivotFit, Mask]:
    """Return the fit of the poses that belong together, and which these are.

    Args:
        positions: N x 3, mm.
        rotations: N x 3 x 3.
        robust: How outliers are looked for.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.

    Raises:
        CalibrationError: ``too_many_outliers``.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import Robust, fit_pivot_robust
        >>> turns = [np.eye(3), np.diag([1, -1, -1]), np.diag([-1, 1, -1]), np.diag([-1, -1, 1])]
        >>> rotations = np.array(turns * 3, dtype=float)
        >>> tip, point = np.array([12.5, -3.25, 80.0]), np.array([300.0, 100.0, -80.0])
        >>> positions = point - rotations @ tip
        >>> positions[5] += 1.0  # a touch that was none
        >>> fit, kept = fit_pivot_robust(positions, rotations, Robust(), sigma_mm=0.02)
        >>> [round(float(value), 3) for value in fit.tip], np.flatnonzero(~kept).tolist()
        ([12.5, -3.25, 80.0], [5])
    """
    kept = pivot_consensus(positions, rotations, robust, sigma_mm=sigma_mm).kept
    condition = pivot_design(rotations[kept]).condition_number
    return fit_pivot(positions, rotations, condition_number=condition, kept=kept), kept


def _by_normal_equations(p: Floats, r: Floats, rm: Floats) -> tuple[Floats, Floats]:
    pm = np.einsum("ij->j", p) / len(p)
    # Centred: far from the origin, p would swamp the differences that matter.
    right = (r.reshape(-1, 3).T @ (p - pm).reshape(-1)) / len(p)
    tip = np.linalg.solve(_ONE - rm.T @ rm, -right)
    return tip, rm @ tip + pm


def _by_qr(p: Floats, r: Floats, rm: Floats) -> tuple[Floats, Floats]:
    pm = p.mean(axis=0)
    q, upper = np.linalg.qr((r - rm).reshape(-1, 3))
    tip = np.linalg.solve(upper, -q.T @ (p - pm).reshape(-1))
    return tip, rm @ tip + pm


def _of_samples(positions: Floats, rotations: Floats, samples: Indices) -> Floats:
    """Return the residual distances of all poses from the solution of each sample."""
    p, r = positions[samples], rotations[samples]
    rm, pm = r.mean(axis=1), p.mean(axis=1)
    left = np.eye(3) - rm.transpose(0, 2, 1) @ rm
    right = np.einsum("bkji,bkj->bi", r, p - pm[:, None]) / MINIMAL
    weak = np.linalg.eigvalsh(left)[:, 0] < _RANK_BELOW
    left[weak] = np.eye(3)
    tips = np.linalg.solve(left, -right[..., None])[..., 0]
    points = np.einsum("bij,bj->bi", rm, tips) + pm
    ends = (rotations.reshape(-1, 3) @ tips.T).reshape(*positions.shape, -1)
    ends += positions[..., None] - points.T
    distances: Floats = np.sqrt(np.einsum("nib,nib->bn", ends, ends))
    distances[weak] = np.inf
    return distances


def _lengths(residuals: Floats) -> Floats:
    lengths: Floats = np.sqrt(np.einsum("ij,ij->i", residuals, residuals))
    return lengths


WARN_CONDITION = 20.0

MAX_CONDITION = 100.0

LEAST_SINGULAR_VALUE = 0.1
"""Smallest singular value of the 3N x 6 system for 30 poses; it grows with the square root of N."""

RECOMMENDED_POSES = 4

ROBUST_POSES = 7
"""Smallest number of poses for which an outlier search is reliable (docs/reference/evidence.md 10).
"""

_CLEARLY_ALONG = 0.98


@refuses_by_name
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
    x_mm, y_mm, z_mm = fit.tip.tolist()
    return CalibrationResult(
        method="pivot",
        **components(stored, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm),
        reference_point_mm=tuple(fit.point.tolist()),
        sigma_gain=math.sqrt(float(design.unit_covariance.diagonal().max())),
        warnings=warnings,
        inputs=inputs,
        rejected=rejected,
        residuals_mm=ResidualVectors(fit.residuals.tobytes(), 3),
        condition_number=design.condition_number,
        rank=design.rank,
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
