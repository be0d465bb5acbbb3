"""Least squares for a tip that touches a surface in several orientations: plane or sphere.

The surface is where ``f(p + R t) = 0``. Its shape and the tip are found together by Gauss-Newton;
what the last step's matrix says about itself is what the data can tell
(docs/reference/calibration.md 2.13).
"""

import math
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.pose_checks import check_poses, keep_unmeasured
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Floats
from robolink.calibration.flange_checks import require_flange_in_base
from robolink.calibration.quality.tolerances import Tolerance
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

MAX_CONDITION = 150.0
"""Beyond it the touches do not tell tip and surface apart."""

MAX_GAIN = 50.0
"""Nor where the error of one touch counts more than so many times in a length of the tip: a column
that is nearly zero does not show in the condition, for which all are brought to one length."""

SURFACE_TOLERANCE = Tolerance(rms_mm=0.3, max_residual_mm=1.0)

KEPT = ("u_deg", "v_deg", "w_deg")

_STEPS = 60

_SETTLED_MM = 1e-10

_FARTHEST_MM = 1e5

State = TypeVar("State")


def refined(
    start: State,
    linear: Callable[[State], tuple[Floats, Floats]],
    stepped: Callable[[State, Floats], State],
) -> tuple[State, LinearFit] | None:
    """Return where Gauss-Newton settles and the fit there, ``None`` where it does not.

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
    """Return the sum of the squares that a fit leaves."""
    return float(found[1].residuals @ found[1].residuals)


def tip_is_told(fit: LinearFit, unknowns: int) -> bool:
    """Tell whether touches tell tip and surface apart; the first three unknowns are the tip."""
    if fit.rank < unknowns or fit.condition_number > MAX_CONDITION:
        return False
    return float(fit.unit_covariance.diagonal()[:3].max()) <= MAX_GAIN**2


def require_told_apart(fit: LinearFit, unknowns: int, remedy: str) -> None:
    """Refuse touches that do not tell tip and surface apart.

    Raises:
        CalibrationError: ``rank_deficient`` or ``insufficient_rotation``.
    """
    if tip_is_told(fit, unknowns):
        return
    code = "rank_deficient" if fit.rank < unknowns else "insufficient_rotation"
    what = tr("The orientations differ too little: the tip and the surface cannot be told apart.")
    raise CalibrationError(code, what, remedy=remedy)


def distinct_touches(poses: Sequence[Pose], least: int) -> tuple[list[Pose], tuple[str, ...]]:
    """Return the touches that are no copies of others, and lesser doubts.

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
    method: str,
    poses: Sequence[Pose],
    *,
    stored: ToolOffset | None,
    tip_mm: Floats,
    fit: LinearFit,
    misses: Floats,
    place_mm: tuple[float, ...],
    warnings: tuple[str, ...],
) -> CalibrationResult:
    """Return X, Y and Z of a tip; its residuals are to be judged.

    Args:
        method: The method's name.
        poses: The touches.
        stored: What U, V and W are kept from.
        tip_mm: The tip in the flange's axes.
        fit: The last fit; its first three unknowns are the tip.
        misses: Residual vectors, base axes.
        place_mm: The point that was found, empty for none.
        warnings: Doubts so far.

    Raises:
        CalibrationError: ``implausible_offset``.
    """
    x_mm, y_mm, z_mm = tip_mm.tolist()
    return CalibrationResult(
        method=method,
        offset=keep_unmeasured(stored, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm),
        measured=("x_mm", "y_mm", "z_mm"),
        kept=KEPT,
        reference_point_mm=place_mm,
        sigma_gain=math.sqrt(float(fit.unit_covariance.diagonal()[:3].max())),
        warnings=warnings,
        inputs=tuple(poses),
        residuals_mm=tuple(map(tuple, misses.tolist())),
        condition_number=fit.condition_number,
        rank=fit.rank,
        unobservable=KEPT,
        sources=(ErrorSource.of_lengths("touch_mm", 3),),
    )
