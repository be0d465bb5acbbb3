"""Length of a tool from touching a surface, with the latency of the trigger taken out.

The faster the tip comes down, the further it is when the trigger is read:
``z = z_read + v latency`` (docs/reference/calibration.md 2.7). Two speeds tell z and latency.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.planar_checks import require_poses
from robolink.calibration.core.pose_checks import keep_unmeasured, require_finite
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.tolerances import Tolerance
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset

PROBE_TOLERANCE = Tolerance(rms_mm=0.05, max_residual_mm=0.15)

RECOMMENDED_TOUCHES = 3

_SPEEDS_APART = 1.5
"""Speeds that differ by less than this factor do not tell the latency."""

_KEPT = ("x_mm", "y_mm", "u_deg", "v_deg", "w_deg")


@dataclass(frozen=True, slots=True)
class Touch:
    """One touch-off.

    Attributes:
        z_mm: Height of the flange when the trigger was read.
        speed_mm_s: Speed downward then.
    """

    z_mm: float
    speed_mm_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ZTouchResult(CalibrationResult):
    """A tool length.

    Attributes:
        latency_s: Of the trigger, as it was found or given.
        flange_z_mm: Height of the flange when the tip really touched.
    """

    latency_s: float
    flange_z_mm: float


def solve_z_touch(
    touches: Sequence[Touch],
    surface_z_mm: float,
    *,
    stored: ToolOffset | None = None,
    latency_s: float | None = None,
    sigma_mm: float | None = None,
    tolerance: Tolerance = PROBE_TOLERANCE,
) -> ZTouchResult:
    """Return Z of a tip that touched a surface, tool axis straight down.

    Args:
        touches: Repeated from the same side; at two speeds unless ``latency_s`` is given.
        surface_z_mm: Height of the surface in the base.
        stored: The offset stored now; all but Z is kept from it, or 0 without one.
        latency_s: Of the trigger, when an earlier measurement found it.
        sigma_mm: Standard deviation of one reading, when it is known.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``one_speed``, ``non_finite`` or
            ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    require_poses(len(touches), 1 if latency_s is not None else 2)
    require_finite(surface_z_mm=surface_z_mm)
    _check_touches(touches)
    if latency_s is None:
        _require_two_speeds(touches)
    fit = _fit(touches, latency_s)
    flange_z = float(fit.x[0])
    result = ZTouchResult(
        method="z-touch",
        offset=keep_unmeasured(stored, z_mm=surface_z_mm - flange_z),
        measured=("z_mm",),
        kept=_KEPT,
        reference_point_mm=(),
        sigma_gain=_gain(fit),
        warnings=("few_poses",) if len(touches) < RECOMMENDED_TOUCHES else (),
        inputs=(),
        residuals_mm=tuple((0.0, 0.0, residual) for residual in fit.residuals.tolist()),
        condition_number=fit.condition_number,
        rank=fit.rank,
        unobservable=_KEPT,
        latency_s=float(fit.x[1]) if latency_s is None else latency_s,
        flange_z_mm=flange_z,
    )
    return judged(
        result,
        fit.residuals[:, None],
        fit.unit_covariance[:1, :1],
        unknowns=fit.rank,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )


def touch_sigma_gain(touches: Sequence[Touch]) -> float:
    """Return the standard deviation of Z as a multiple of one touch's; only the speeds count."""
    return _gain(_fit(touches, None))


def _fit(touches: Sequence[Touch], latency_s: float | None) -> LinearFit:
    z = np.array([touch.z_mm for touch in touches], dtype=float)
    speeds = np.array([touch.speed_mm_s for touch in touches], dtype=float)
    ones = np.ones(len(z))
    if latency_s is None:
        return linear_fit(np.column_stack([ones, -speeds]), z)
    return linear_fit(ones[:, None], z + speeds * latency_s)


def _gain(fit: LinearFit) -> float:
    return math.sqrt(float(fit.unit_covariance[0, 0]))


def _check_touches(touches: Sequence[Touch]) -> None:
    for number, touch in enumerate(touches, start=1):
        require_finite(
            **{f"z_mm of touch {number}": touch.z_mm},
            **{f"speed_mm_s of touch {number}": touch.speed_mm_s},
        )


def _require_two_speeds(touches: Sequence[Touch]) -> None:
    speeds = [touch.speed_mm_s for touch in touches]
    if min(speeds) <= 0 or max(speeds) < _SPEEDS_APART * min(speeds):
        raise CalibrationError(
            "one_speed",
            tr("The touches have nearly the same speed; the trigger's latency is unknown."),
            remedy=tr("Touch at two speeds, one twice the other, or give the latency."),
        )
