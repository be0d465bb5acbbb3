"""Least squares for a tip that touches a surface in several orientations: plane or sphere.

The surface is where ``f(p + R t) = 0``. Its shape and the tip are found together by Gauss-Newton;
what the last step's matrix says about itself is what the data can tell
(docs/reference/calibration.md 2.13).

Whether touches of a surface were made: distances from it jogged away, and one surface fits all.

Before each touch but the first the robot stops at a distance from the surface that was drawn. Who
brings the tip onto the surface undoes it; who does not leaves a share of it, and that share stands
beside tip and surface in one least-squares fit (docs/reference/evidence.md 1).

How far from a surface the robot stops before each touch: drawn, and not what a tip could be.
"""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np

from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import check_poses, components
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import student_t
from robolink.calibration.flange_plane import require_flange_in_base
from robolink.calibration.quality.doubts import LEVELS_MM, MOST_LEFT, MOST_RESIDUAL_MM, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

MAX_CONDITION = 150.0
"""Largest condition number of touches that separate tip and surface."""

MAX_GAIN = 50.0
"""Largest gain of one touch's error in a length of the tip. The condition number does not show a
column that is nearly zero, because all columns are scaled to one length."""

SURFACE_TOLERANCE = Tolerance(rms_mm=0.3, max_residual_mm=1.0)


ResultT = TypeVar("ResultT", bound=CalibrationResult)

_STEPS = 60

_SETTLED_MM = 1e-10

_FARTHEST_MM = 1e5

State = TypeVar("State")


def refined(
    start: State,
    linear: Callable[[State], tuple[Floats, Floats]],
    stepped: Callable[[State, Floats], State],
) -> tuple[State, LinearFit] | None:
    """Return where Gauss-Newton converges and the fit there, ``None`` if it does not.

    Args:
        start: First guess.
        linear: Returns the derivatives of the misses, one row a touch, and the misses.
        stepped: Returns the state after a step in the order of the columns.
    """
    state = start
    for _ in range(_STEPS):
        derivatives, misses = linear(state)
        if not np.isfinite(derivatives).all() or np.abs(misses).max() > _FARTHEST_MM:
            return None
        fit = linear_fit(derivatives, -misses)
        state = stepped(state, fit.x)
        if float(np.abs(fit.x).max()) < _SETTLED_MM:
            derivatives, misses = linear(state)
            return state, linear_fit(derivatives, -misses)
    return None


def square_sum(found: tuple[object, LinearFit]) -> float:
    """Return the sum of the squared residuals of a fit."""
    return float(found[1].residuals @ found[1].residuals)


def tip_is_told(fit: LinearFit, unknowns: int) -> bool:
    """Return whether touches separate tip and surface; the first three unknowns are the tip."""
    if fit.rank < unknowns or fit.condition_number > MAX_CONDITION:
        return False
    return float(fit.unit_covariance.diagonal()[:3].max()) <= MAX_GAIN**2


def require_told_apart(fit: LinearFit, unknowns: int, remedy: str) -> None:
    """Refuse touches that do not separate tip and surface.

    Raises:
        CalibrationError: ``rank_deficient`` or ``insufficient_rotation``.
    """
    if tip_is_told(fit, unknowns):
        return
    code = "rank_deficient" if fit.rank < unknowns else "insufficient_rotation"
    what = tr("The orientations differ too little to separate tip and surface.")
    raise CalibrationError(code, what, remedy=remedy)


def distinct_touches(poses: Sequence[Pose], least: int) -> tuple[list[Pose], tuple[str, ...]]:
    """Return the touches without copies, and lesser doubts.

    Raises:
        CalibrationError: ``too_few_poses``, ``tool_pose``, ``local_pose``, and those of
            ``pose_checks.check_poses``.
    """
    doubts = check_poses(poses, allow_mixed_hand=False)
    require_flange_in_base(poses)
    taken = list(dict.fromkeys(poses))
    if len(taken) < len(poses):
        doubts, poses = (*doubts, "duplicate_poses"), taken
    if len(poses) < least:
        raise CalibrationError(
            "too_few_poses",
            tr("{count} touches are too few; {least} are needed.", count=len(poses), least=least),
            remedy=tr("Touch it in more orientations: turned, and tilted to several sides."),
        )
    return taken, doubts


def never_settled() -> CalibrationError:
    """Return the error for touches that no surface fits."""
    return CalibrationError(
        "diverging",
        tr("No surface fits these touches."),
        remedy=tr("Check that all of them touched the same surface, and the units."),
    )


def tip_result(
    kind: Callable[..., ResultT],
    method: str,
    poses: Sequence[Pose],
    *,
    stored: ToolOffset | None,
    tip_mm: Floats,
    fit: LinearFit,
    across: Floats,
    unknowns: int,
    sigma_mm: float | None,
    tolerance: Tolerance,
    warnings: tuple[str, ...],
    place_mm: tuple[float, ...] = (),
    **surface: object,
) -> ResultT:
    """Return X, Y and Z of a tip, judged by how far the touches lie from the surface.

    Args:
        kind: The result of the method.
        method: The method's name.
        poses: The touches.
        stored: What U, V and W are kept from.
        tip_mm: The tip in the flange's axes.
        fit: The last fit; its first three unknowns are the tip.
        across: Unit normal of the surface, one for all touches or one for each, base axes.
        unknowns: How many numbers the fit had to find.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
        tolerance: Residuals above which the result carries a warning.
        warnings: Doubts so far.
        place_mm: The point that was found, empty for none.
        surface: What the result holds of the surface beside.

    Raises:
        CalibrationError: ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    x_mm, y_mm, z_mm = tip_mm.tolist()
    misses = -fit.residuals[:, None] * across
    result = kind(
        method=method,
        **components(stored, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm),
        reference_point_mm=place_mm,
        sigma_gain=math.sqrt(float(fit.unit_covariance.diagonal()[:3].max())),
        warnings=warnings,
        inputs=tuple(poses),
        residuals_mm=tuple(map(tuple, misses.tolist())),
        condition_number=fit.condition_number,
        rank=fit.rank,
        sources=(ErrorSource.of_lengths("touch_mm", 3),),
        **surface,
    )
    return judged(
        result,
        fit.residuals[:, None],
        fit.unit_covariance[:3, :3],
        unknowns=unknowns,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )


LEAST_UNEXPLAINED_MM2: Final = 0.28
"""Smallest part of the squared distances that no tip and no surface could explain, in mm^2, for
each touch beyond the unknowns of tip and surface."""

_FAINT_MM: Final = 1e-6


@dataclass(frozen=True, slots=True)
class SurfaceEvidence:
    """What touches of a surface show about how they were made.

    Attributes:
        codes: Why they are refused, the most telling first; empty when they count.
        gamma: Share of the distances that was left, 0 when the jogs undo them; ``None`` where it
            cannot be told.
        gamma_upper99: Its upper 99 % limit.
        max_residual_mm: Largest distance of a touch from the surface that was found.
    """

    codes: tuple[str, ...]
    gamma: float | None
    gamma_upper99: float | None
    max_residual_mm: float

    @property
    def most_telling(self) -> str:
        """The strongest ground; empty without one.

        One touch that fits badly makes the share uncertain too; it is then that one that is told.
        """
        certain = self.gamma is not None and self.gamma > MOST_LEFT
        if not certain and "large_residual" in self.codes:
            return "large_residual"
        return self.codes[0] if self.codes else ""


def judge_surface_touches(
    columns: Floats, misses_mm: Floats, standoffs_mm: Sequence[float]
) -> SurfaceEvidence:
    """Return whether touches of one surface were really made.

    Args:
        columns: Derivatives of the distances from the surface by tip and surface, one row a touch.
        misses_mm: Distance of each touch from the surface that was found.
        standoffs_mm: How far from the surface the robot had stopped, 0 where the person brought
            the tip from wherever it was.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import judge_surface_touches
        >>> columns = np.column_stack([np.ones(8), np.linspace(-1, 1, 8)])
        >>> misses = np.array([0.01, -0.01, 0.0, 0.01, -0.01, 0.0, 0.01, -0.01])
        >>> standoffs_mm = [2.0, 3.1, 2.4, 3.7, 2.2, 3.3, 2.9, 2.6]
        >>> judge_surface_touches(columns, misses, standoffs_mm).codes
        ()
    """
    outcome = np.array(standoffs_mm)
    worst_mm = float(np.abs(misses_mm).max())
    told = _left(columns, misses_mm, outcome)
    grounds = (
        ("touch_not_proven", told is None or told[1] > MOST_LEFT),
        ("large_residual", worst_mm > MOST_RESIDUAL_MM),
    )
    return SurfaceEvidence(
        codes=tuple(code for code, holds in grounds if holds),
        gamma=told[0] if told else None,
        gamma_upper99=told[1] if told else None,
        max_residual_mm=worst_mm,
    )


def unexplained_mm2(columns: Floats, standoffs_mm: Sequence[float]) -> float:
    """Return the sum of squares of the distances that tip and surface do not explain.

    Args:
        columns: As for :func:`judge_surface_touches`.
        standoffs_mm: Likewise.
    """
    left = linear_fit(columns, np.array(standoffs_mm)).residuals
    return float(left @ left)


def _left(columns: Floats, misses_mm: Floats, standing_mm: Floats) -> tuple[float, float] | None:
    """Return which share of the distances is left, and its upper 99 % limit."""
    part = linear_fit(columns, standing_mm)
    square = float(part.residuals @ part.residuals)
    dof = len(misses_mm) - part.rank - 1
    if dof < 1 or square < _FAINT_MM:
        return None
    gamma = float(part.residuals @ misses_mm) / square
    scatter = misses_mm - gamma * part.residuals
    scatter = scatter - columns @ linear_fit(columns, scatter).x
    sigma = float(np.sqrt(scatter @ scatter / dof / square))
    return gamma, gamma + student_t(0.99, dof) * sigma


class SurfaceStandoffs:
    """Draws the distances of one measurement, one by one.

    Args:
        seed: Of the run; the same one gives the same distances.
        clearance_mm: The least distance.
    """

    def __init__(self, seed: int, clearance_mm: float) -> None:
        self.seed = seed
        self._random = random.Random(f"surface {seed}")
        self._clearance_mm = clearance_mm
        self._last_mm: float | None = None

    def next(
        self, taken_mm: Sequence[float], columns: Floats | None = None, *, further_mm: float = 0.0
    ) -> float:
        """Return how far from the surface to stop before the next touch, mm.

        Args:
            taken_mm: The distances before the touches so far.
            columns: Derivatives of the distances by tip and surface, one row for each of those
                touches and one for the next; ``None`` while the surface is not known.
            further_mm: How much more than the clearance it is at least.

        Example:
            >>> from robolink.calibration import SurfaceStandoffs
            >>> standoffs = SurfaceStandoffs(seed=7, clearance_mm=2)
            >>> standoffs.next([]) >= 2
            True
        """
        levels = self._random.sample(LEVELS_MM, len(LEVELS_MM))
        free = [level for level in levels if level != self._last_mm]
        least_mm = self._clearance_mm + further_mm
        self._last_mm = free[0]
        if columns is not None and len(columns) > columns.shape[1]:
            needed_mm2 = LEAST_UNEXPLAINED_MM2 * (len(columns) - columns.shape[1])
            found = {
                level: unexplained_mm2(columns, [*taken_mm, least_mm + level]) for level in free
            }
            enough = [level for level in free if found[level] >= needed_mm2]
            self._last_mm = enough[0] if enough else max(free, key=found.__getitem__)
        return least_mm + self._last_mm
