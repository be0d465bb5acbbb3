"""Which poses to take: the best-conditioned plan that limits and workspace allow.

How well the tip will be known depends on the orientations alone. With Rm their mean, the tip's
covariance is sigma^2 (N I - N Rm' Rm)^-1; the choice makes its trace as small as it can
(docs/reference/calibration.md 2.3).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.least_squares import Floats
from robolink.calibration.core.pose_checks import refuses_by_name
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.rotations import pose_arrays, rotations
from robolink.errors import CalibrationError, ConfigError, LimitError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, WorkBox

U_STEP_DEG = 15.0

_EXCHANGES: Final = 20


# Regularisation: makes two poses comparable before any combination determines every unknown.
_FAINT: Final = 1e-6


@dataclass(frozen=True, slots=True)
class PoseLimits:
    """Where the flange may go.

    Attributes:
        u_min_deg, u_max_deg: Range of U, inside the joint's limits.
        tilt_deg: Largest V and W; 0 on four axes.
        box: Box that no flange position may leave, ``None`` for none.
    """

    u_min_deg: float = -180.0
    u_max_deg: float = 180.0
    tilt_deg: float = 0.0
    box: WorkBox | None = None


@dataclass(frozen=True, slots=True)
class PosePlan:
    """Poses to take, the most informative first.

    Attributes:
        poses: Flange poses (Tool 0) that bring the guessed tip onto the point.
        sigma_gains: After each of them, the largest standard deviation of a measured length
            as a multiple of one placement's; infinite while something is still unknown.
    """

    poses: tuple[Pose, ...]
    sigma_gains: tuple[float, ...]


@refuses_by_name
def suggest_poses(
    count: int,
    *,
    guess: ToolOffset,
    point_mm: tuple[float, float, float],
    limits: PoseLimits,
    taken: Sequence[Pose] = (),
) -> PosePlan:
    """Return ``count`` further poses for a tip on a point.

    Args:
        count: How many poses to plan.
        guess: About where the tip is; decides where the flange has to go.
        point_mm: The reference point, base.
        limits: Where the flange may go. Without tilt only X and Y are planned for.
        taken: Poses that have been taken already; the plan adds to them.

    Raises:
        ConfigError: ``count`` or the limits make no sense.
        CalibrationError: ``insufficient_rotation`` when the limits leave too few poses.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.calibration import PoseLimits, suggest_poses
        >>> guess = ToolOffset(12, -3.5, -20)
        >>> limits = PoseLimits(u_min_deg=-90, u_max_deg=90)
        >>> plan = suggest_poses(3, guess=guess, point_mm=(300, 100, -80), limits=limits)
        >>> sorted(round(pose.u_deg) for pose in plan.poses)
        [-90, -75, 90]
    """
    if count < 1:
        raise ConfigError(
            tr("{count} poses cannot be planned.", count=count), remedy=tr("Plan 1 or more.")
        )
    candidates = _candidates(guess, point_mm, limits)
    if len(candidates) < 2:
        raise CalibrationError(
            "insufficient_rotation",
            tr("The limits leave only {count} orientations.", count=len(candidates)),
            remedy=tr("Widen the range of U or the box, or choose another reference point."),
        )
    size = 3 if limits.tilt_deg > 0 else 2
    turned = pose_arrays(candidates)[1][:, :size, :size]
    before = pose_arrays(taken)[1][:, :size, :size] if taken else np.zeros((0, size, size))
    order = select_poses(turned, before, count)
    gains = [
        sigma_gain(np.concatenate((before, turned[order[: k + 1]]))) for k in range(len(order))
    ]
    return PosePlan(tuple(candidates[index] for index in order), tuple(gains))


def precise_enough(result: CalibrationResult, tolerance_mm: float) -> bool:
    """Return whether a measurement may stop: every length is known within the tolerance.

    ``tolerance_mm`` is half of what the process can bear (docs/reference/calibration.md 3). A
    result without an interval is never precise enough.

    Raises:
        ConfigError: ``tolerance_mm`` is not positive.
    """
    require_positive(tolerance_mm, "tolerance_mm")
    if not result.half_width95:
        return False
    return all(
        half <= tolerance_mm
        for name, half in zip(result.measured, result.half_width95, strict=True)
        if name.endswith("_mm")
    )


def _candidates(
    guess: ToolOffset, point_mm: tuple[float, float, float], limits: PoseLimits
) -> list[Pose]:
    span = limits.u_max_deg - limits.u_min_deg
    if span < 0 or limits.tilt_deg < 0:
        raise ConfigError(
            tr("The range of U or the tilt is negative."), remedy=tr("Give the smaller U first.")
        )
    turns = np.linspace(limits.u_min_deg, limits.u_max_deg, max(2, 1 + round(span / U_STEP_DEG)))
    tilts = (-limits.tilt_deg, 0.0, limits.tilt_deg) if limits.tilt_deg > 0 else (0.0,)
    angles = np.array([(u, v, w) for u in turns for v in tilts for w in tilts])
    places = np.array(point_mm) - rotations(angles) @ np.array(guess.components()[:3])
    poses = []
    for (x, y, z), (u, v, w) in zip(places.tolist(), angles.tolist(), strict=True):
        pose = Pose(x, y, z, u, v, w, tool=0)
        if _allowed(pose, limits.box):
            poses.append(pose)
    return poses


def _allowed(pose: Pose, box: WorkBox | None) -> bool:
    try:
        if box is not None:
            box.check(pose)
    except LimitError:
        return False
    return True


def select_poses(turned: Floats, before: Floats, count: int) -> list[int]:
    """Return indices of ``count`` orientations, the most informative first.

    Args:
        turned: What there is to choose from, N x 3 x 3, or N x 2 x 2 in the plane.
        before: Orientations that are taken anyway, of the same size; may be none.
        count: How many are chosen.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import select_poses
        >>> def turn(deg):
        ...     c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))
        ...     return np.array([[c, -s], [s, c]])
        >>> choice = np.array([turn(deg) for deg in (5, 90, 180)])
        >>> select_poses(choice, np.array([turn(0)]), 1)
        [2]
    """
    chosen = _exchanged(turned, before, _greedy(turned, before, range(len(turned)), count))
    return _greedy(turned, before, chosen, count)


def sigma_gain(turned: Floats) -> float:
    """Return the largest standard deviation of a measured length for orientations, N x 3 x 3.

    As a multiple of one placement's; infinite while something is still unknown.
    """
    mean = turned.mean(axis=0)
    told = len(turned) * (np.eye(turned.shape[-1]) - mean.T @ mean)
    if float(np.linalg.eigvalsh(told)[0]) < _FAINT:
        return math.inf
    return math.sqrt(float(np.linalg.inv(told).diagonal().max()))


def _greedy(turned: Floats, before: Floats, among: Sequence[int], count: int) -> list[int]:
    """Return indices into ``turned``, each the best addition to those before it."""
    chosen: list[int] = []
    left = list(among)
    for _ in range(count):
        costs = _costs(np.concatenate((before, turned[chosen])), turned[left])
        best = left[int(np.argmin(costs))]
        chosen.append(best)
        if len(left) > 1:
            left.remove(best)
    return chosen


def _exchanged(turned: Floats, before: Floats, chosen: list[int]) -> list[int]:
    """Replace poses one by one while that improves the plan."""
    for _ in range(_EXCHANGES):
        earlier = list(chosen)
        for place in range(len(chosen)):
            others = chosen[:place] + chosen[place + 1 :]
            free = [index for index in range(len(turned)) if index not in others] or others
            costs = _costs(np.concatenate((before, turned[others])), turned[free])
            best = int(np.argmin(costs))
            if costs[best] < costs[free.index(chosen[place])] * (1 - 1e-9):
                chosen[place] = free[best]
        if chosen == earlier:
            break
    return chosen


def _costs(base: Floats, additions: Floats) -> Floats:
    """Return the trace of the covariance after each single addition to ``base``."""
    count = len(base) + 1
    mean = (base.sum(axis=0) + additions) / count
    size = additions.shape[-1]
    told = count * (np.eye(size) - mean.transpose(0, 2, 1) @ mean)
    costs: Floats = (1 / np.maximum(np.linalg.eigvalsh(told), _FAINT)).sum(axis=1)
    return costs
