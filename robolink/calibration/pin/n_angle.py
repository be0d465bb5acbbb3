"""Tool offset from one point touched or seen at several known angles, on four axes.

One tip on one point at known angles, in the plane, as complex numbers.

With the flange at p and z = exp(iU), the tip is at p + z t. Taking means off leaves one
unknown, and the least squares over all poses is a division (docs/reference/calibration.md 1.1,
2.1):

    t = -sum(conj(z - mean z) p) / sum |z - mean z|^2,   P = mean p + mean z t

The angles are used as the controller knows them; nothing is fitted to an unlabelled circle.
Under a flange that stands on its head (W = 180) the Y of the tip counts the other way, so that
t is the conjugate.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    MIN_ROTATION_DEG,
    UPRIGHT_WITHIN_DEG,
    WARN_ROTATION_DEG,
    check_rotation,
    components,
    refuses_by_name,
    require_poses,
    some_on_their_head,
    tilted_pose,
)
from robolink.calibration.core.result import CalibrationResult, ResidualVectors
from robolink.calibration.core.rotations import checked_table
from robolink.calibration.quality.doubts import PLANAR_TOLERANCE, Tolerance
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

Complexes = NDArray[np.complex128]

UNKNOWNS = 4

_NEARLY_PARALLEL = 0.2
"""Smallest |z1 - z2| of a sample of two poses: about 11 degrees. Samples with a smaller turn are
not used."""


@dataclass(frozen=True, slots=True)
class PlanarFit:
    """The tip and the point that it touched, mm, as x + iy.

    Attributes:
        tip: Offset in the flange's axes.
        point: The touched point in the base.
        residuals: Where each tip lies from that point.
        weight: Sum of |z - mean z|^2: how much the angles tell.
        mean: Of z, over the poses that count: 0 for angles that balance, near 1 in size when they
            are all alike.
    """

    tip: complex
    point: complex
    residuals: Complexes
    weight: float
    mean: complex

    @property
    def sigma_gain(self) -> float:
        """Standard deviation of each offset axis, in those of one coordinate."""
        return 1 / math.sqrt(self.weight)

    @property
    def condition_number(self) -> float:
        """Of the 2N x 4 system in offset and point."""
        imbalance = min(abs(self.mean), 1 - 1e-16)
        return math.sqrt((1 + imbalance) / (1 - imbalance))


def fit_planar(p: Complexes, z: Complexes, kept: Mask | None = None) -> PlanarFit:
    """Return the least squares of the kept poses; residuals are those of all poses."""
    chosen_p, chosen_z = (p, z) if kept is None else (p[kept], z[kept])
    # Plain sums: ``mean`` takes three times as long for a few poses.
    mean_p, mean_z = (
        complex(chosen_p.sum()) / chosen_p.size,
        complex(chosen_z.sum()) / chosen_z.size,
    )
    turned = chosen_z - mean_z
    weight = float(np.vdot(turned, turned).real)
    tip = -complex(np.vdot(turned, chosen_p - mean_p)) / weight
    point = mean_p + mean_z * tip
    return PlanarFit(tip, point, p + z * tip - point, weight, mean_z)


def planar_consensus(
    p: Complexes, z: Complexes, robust: Robust, *, sigma_mm: float | None
) -> Consensus:
    """Return which poses belong together.

    Raises:
        CalibrationError: ``too_many_outliers``.
    """

    def of_samples(samples: Indices) -> Floats:
        first, second = samples.T
        turned = z[first] - z[second]
        parallel = np.abs(turned) < _NEARLY_PARALLEL
        tips = (p[second] - p[first]) / np.where(parallel, 1.0, turned)
        points = p[first] + z[first] * tips
        distances: Floats = np.abs(p + z * tips[:, None] - points[:, None])
        distances[parallel] = np.inf
        return distances

    def of_fit(kept: Mask) -> Floats | None:
        chosen = z[kept]
        if chosen.size < 2 or np.abs(chosen - chosen[0]).max() < _NEARLY_PARALLEL:
            return None
        residuals: Floats = np.abs(fit_planar(p, z, kept).residuals)
        return residuals

    agreement = Agreement(z.size, 2, 2, UNKNOWNS, of_samples, of_fit)
    return largest_consensus(agreement, robust, sigma_mm=sigma_mm)


def as_rotations(z: Complexes) -> Floats:
    """Return exp(iU) as N x 2 x 2 rotations."""
    turned = np.empty((z.size, 2, 2))
    turned[:, 0, 0] = turned[:, 1, 1] = z.real
    turned[:, 1, 0], turned[:, 0, 1] = z.imag, -z.imag
    return turned


RECOMMENDED_POSES = 4

ROBUST_POSES = 6
"""Smallest number of poses for which an outlier search is reliable (docs/reference/evidence.md 10).
"""

_ONE = np.eye(2)


@refuses_by_name
def solve_n_angle(
    poses: Sequence[Pose],
    *,
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
    robust: Robust | None = None,
    min_rotation_deg: float = MIN_ROTATION_DEG,
    allow_mixed_hand: bool = False,
    tolerance: Tolerance = PLANAR_TOLERANCE,
    grid_mm: float | None = None,
) -> CalibrationResult:
    """Return the offset of a tip that was on one point in all flange poses.

    The angles are taken as known, so the fit is linear and exact on any arc
    (docs/reference/calibration.md 2.1). X and Y are measured, the rest is kept.

    Args:
        poses: Flange poses (Tool 0), mm and degrees, at least two, in the order in which they
            were taken. All may be given in one local: the point is then a point of it.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one placement, when it is known.
        robust: Look for outliers first; needs six poses.
        min_rotation_deg: Smallest arc over which the angles have to spread.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.
        tolerance: Residuals above which the result carries a warning.
        grid_mm: Step of the jogs with which the tip was brought onto the point, if it is known.

    Raises:
        CalibrationError: ``too_few_poses``, ``degenerate_angles``, ``insufficient_rotation``,
            ``tilted_pose``, ``non_finite``, ``suspect_units``, ``mixed_hand``,
            ``mixed_local``, ``mixed_tool``, ``tool_pose``, ``robust_too_few``,
            ``robust_unstable``, ``too_many_outliers`` or ``implausible_offset``.
        ConfigError: ``sigma_mm``, ``grid_mm`` or the threshold is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import carrying, solve_n_angle
        >>> tip, pin_mm = ToolOffset(12.5, -3.25, -20), (300, 100, -80)
        >>> poses = [carrying(Pose(0, 0, 0, u_deg), tip, pin_mm) for u_deg in (0, 90, 180, -90)]
        >>> found = solve_n_angle(poses, sigma_mm=0.02)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.5, -3.25)
    """
    require_poses(len(poses), 2)
    table, doubts = checked_table(poses, allow_mixed_hand=allow_mixed_hand)
    p, z, down = _planar(table, poses)
    duplicates = copies(table)
    kept: Mask = np.ones(len(poses), dtype=bool)
    if duplicates:
        kept[list(duplicates)] = False
    distinct = len(poses) - len(duplicates)
    if distinct < 2:
        raise _all_copies()
    doubts = (*doubts, *_turned_enough(poses, z, min_rotation_deg))
    few = ("few_poses",) if distinct < RECOMMENDED_POSES else ()
    spread_mm = 0.0
    if robust is not None:
        require_robust_poses(distinct, ROBUST_POSES)
        kept, spread_mm = _agreeing(p, z, np.flatnonzero(kept), robust, sigma_mm)
        _turned_enough(poses, z[kept], min_rotation_deg)
    all_kept = bool(kept.all())
    fit = fit_planar(p, z, None if all_kept else kept)
    among = slice(None) if all_kept else kept
    residuals = fit.residuals[among].view(float).reshape(-1, 2)
    unit_covariance = _ONE * fit.sigma_gain**2
    result = judged(
        _result(
            fit,
            stored,
            down=down,
            warnings=(*doubts, *few),
            inputs=tuple(poses),
            rejected=left_out(kept, duplicates),
        ),
        residuals,
        unit_covariance,
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
        grid_mm=grid_mm,
    )
    result = with_evidence(
        result,
        as_rotations(z[among] - fit.mean),
        residuals,
        unit_covariance=unit_covariance,
        kept=np.flatnonzero(kept),
        duplicates=duplicates,
        unknowns=UNKNOWNS,
    )
    return with_consensus(result, kept, spread_mm) if robust else result


def _result(
    fit: PlanarFit,
    stored: ToolOffset | None,
    *,
    down: bool,
    warnings: tuple[str, ...],
    inputs: tuple[Pose, ...],
    rejected: tuple[int, ...],
) -> CalibrationResult:
    """Return the offset of a fit; ``down`` where the flange's Z points down."""
    tip = fit.tip.conjugate() if down else fit.tip
    return CalibrationResult(
        method="n-angle",
        **components(stored, x_mm=tip.real, y_mm=tip.imag),
        reference_point_mm=(fit.point.real, fit.point.imag),
        sigma_gain=fit.sigma_gain,
        warnings=warnings,
        inputs=inputs,
        rejected=rejected,
        residuals_mm=ResidualVectors(fit.residuals.tobytes(), 2),
        condition_number=fit.condition_number,
        rank=UNKNOWNS,
        sources=(ErrorSource.of_lengths("touch_mm", 2),),
    )


def _all_copies() -> CalibrationError:
    return CalibrationError(
        "degenerate_angles",
        tr("All poses are copies of one; they do not determine the offset."),
        remedy=tr("Turn the tool between the poses, best over half a turn or more."),
        others=("too_few_poses",),
    )


def _planar(table: Floats, poses: Sequence[Pose]) -> tuple[Complexes, Complexes, bool]:
    """Return positions, directions of the flange's X, and whether its Z points down.

    Raises:
        CalibrationError: ``tilted_pose``.
    """
    p = table[:, 0] + 1j * table[:, 1]
    z = np.exp(1j * np.radians(table[:, 3]))
    if not table[:, 4:].any():
        return p, z, False
    forward, sideways = np.cos(np.radians(table[:, 4:])).T
    upward = forward * sideways
    leaning = np.degrees(np.arccos(np.minimum(np.abs(upward), 1.0))) >= UPRIGHT_WITHIN_DEG
    if leaning.any():
        first = int(np.argmax(leaning))
        raise tilted_pose(first + 1, poses[first])
    down = upward < 0
    if down.any() and not down.all():
        raise some_on_their_head()
    return p, z * np.sign(forward), bool(down[0])


def _turned_enough(poses: Sequence[Pose], z: Complexes, min_rotation_deg: float) -> tuple[str, ...]:
    """Return the doubts about how far the flange turned.

    Raises:
        CalibrationError: As ``pose_checks.check_rotation``.
    """
    wanted_deg = max(min_rotation_deg, WARN_ROTATION_DEG)
    # Directions within an arc have a mean of length cos(arc / 2) or more. A shorter mean shows that
    # they spread further, so the arc itself need not be found.
    if wanted_deg <= 180.0 and abs(complex(z.mean())) < math.cos(math.radians(wanted_deg / 2)):
        return ()
    return check_rotation(poses, _spread_deg(z), min_rotation_deg)


def _spread_deg(z: Complexes) -> float:
    """Return the shortest arc that holds all directions."""
    turned = np.sort(np.degrees(np.angle(z)) % 360.0)
    gaps = np.diff(turned, append=turned[0] + 360.0)
    return 360.0 - float(gaps.max())


def _agreeing(
    p: Complexes, z: Complexes, among: Indices, robust: Robust, sigma_mm: float | None
) -> tuple[Mask, float]:
    """Return which poses agree, and how far results of other draws lie apart."""
    some_p, some_z = p[among], z[among]
    found = planar_consensus(some_p, some_z, robust, sigma_mm=sigma_mm)
    tips = [fit_planar(some_p, some_z, kept).tip for kept in (found.kept, *found.others)]
    kept: Mask = np.zeros(p.size, dtype=bool)
    kept[among[found.kept]] = True
    return kept, max(abs(a - b) for a in tips for b in tips)
