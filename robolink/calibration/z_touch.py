"""Length of a tool from touching a surface, with the latency of the trigger taken out.

The faster the tip comes down, the further it is when the trigger is read, and the further again
when the robot brakes before its position is read:

    z = z_read + latency v + overshoot v^2,   overshoot = 1 / (2 a) for a deceleration a

(docs/reference/calibration.md 2.7). Two speeds tell z and latency, three the overshoot as well,
which is believed when an F test says that it is there (docs/reference/evidence.md 13).
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.budget import DIVISORS, BudgetRow, UncertaintyBudget
from robolink.calibration.core.pose_checks import keep_unmeasured, require_finite, require_poses
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import NORMAL_95, shifted_half95
from robolink.calibration.flange_plane import FlangePlane, TipHeight, solvable_planes
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.tolerances import Tolerance
from robolink.calibration.touch_latency import TouchFit, fit_touches, require_plausible
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

PROBE_TOLERANCE = Tolerance(rms_mm=0.05, max_residual_mm=0.15)

RECOMMENDED_TOUCHES = 3

USUAL_DECELERATION_MM_S2 = 300.0
"""How hard a robot brakes at least where nobody knows it; see docs/reference/evidence.md 13."""

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
        overshoot_s2_per_mm: Of the braking, ``None`` where it was not found or not looked for.
        f_quadratic: How much better the touches fit with an overshoot, ``None`` without a test.
        f_limit: What that would have to exceed, likewise.
    """

    latency_s: float
    flange_z_mm: float
    overshoot_s2_per_mm: float | None = None
    f_quadratic: float | None = None
    f_limit: float | None = None


def solve_z_touch(
    touches: Sequence[Touch],
    surface_z_mm: float,
    *,
    stored: ToolOffset | None = None,
    flange: Pose | None = None,
    latency_s: float | None = None,
    deceleration_mm_s2: float = USUAL_DECELERATION_MM_S2,
    deceleration_told: bool = False,
    sigma_mm: float | None = None,
    step_mm: float | None = None,
    tolerance: Tolerance = PROBE_TOLERANCE,
) -> ZTouchResult:
    """Return Z of a tip that touched a surface.

    Args:
        touches: Repeated from the same side; at two speeds unless ``latency_s`` is given. Three
            speeds in four touches show whether the robot overshoots.
        surface_z_mm: Height of the surface in the base.
        stored: The offset stored now; all but Z is kept from it, or 0 without one.
        flange: A pose with the angles of all touches; upright without one. Where it leans, X and
            Y of the tip reach its height and are taken from ``stored``.
        latency_s: Of the trigger, when an earlier measurement found it.
        deceleration_mm_s2: How hard the robot brakes at least. What that may shift Z by, where
            the speeds cannot show it, is in the interval and a row of the budget.
        deceleration_told: Whether the controller tells so: then the way of braking is taken out
            of each reading, and the row stays as wide as that.
        sigma_mm: Standard deviation of one reading, when it is known.
        step_mm: How finely the place of the trigger is told, at the fastest of the touches.
            Touches that repeat each other fall on the same step, so it counts in full.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``one_speed``, ``implausible_latency``,
            ``tilted_pose``, ``non_finite`` or ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.calibration import Touch, solve_z_touch
        >>> touches = [Touch(z, v) for z, v in ((-60.02, 2), (-60.05, 5), (-60.02, 2), (-60.05, 5))]
        >>> found = solve_z_touch(touches, -80, stored=ToolOffset(12, -3.5, -19))
        >>> round(found.offset.z_mm, 2)
        -20.0
    """
    require_poses(len(touches), 1 if latency_s is not None else 2)
    require_finite(surface_z_mm=surface_z_mm, latency_s=latency_s or 0.0)
    _check_touches(touches)
    if latency_s is None:
        _require_two_speeds(touches)
    plane = _plane(flange, stored)
    speeds = [touch.speed_mm_s for touch in touches]
    ahead_s2_per_mm = 1 / (2 * deceleration_mm_s2) if deceleration_told else 0.0
    heights = [touch.z_mm + ahead_s2_per_mm * touch.speed_mm_s**2 for touch in touches]
    found = fit_touches(heights, speeds, latency_s)
    alike = min(Counter(speeds).values())
    grid_mm = None if step_mm is None else step_mm * math.sqrt(alike)
    require_plausible(found, sigma_mm, step_mm=step_mm)
    result = _result(found, len(touches), _length(plane, surface_z_mm, found.flange_z_mm, stored))
    result = judged(
        replace(result, offset=keep_unmeasured(stored, z_mm=result.offset.z_mm)),
        found.fit.residuals[:, None],
        found.fit.unit_covariance[:1, :1] / plane.r33**2,
        unknowns=found.fit.rank,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
        grid_mm=grid_mm,
    )
    result = replace(result, budget=_budget(result))
    if found.overshoot_s2_per_mm is not None:
        return result
    overshoot_s2_per_mm = 1 / (2 * deceleration_mm_s2)
    if found.overshoot_upper_s2_per_mm is not None and not deceleration_told:
        overshoot_s2_per_mm = min(overshoot_s2_per_mm, found.overshoot_upper_s2_per_mm)
    half_mm = found.braking_mm2_per_s2 * overshoot_s2_per_mm / abs(plane.r33)
    origin = tr("{deceleration:g} mm/s^2, not measured", deceleration=deceleration_mm_s2)
    return _with_braking(result, half_mm, origin)


def _result(found: TouchFit, count: int, z_mm: float) -> ZTouchResult:
    warnings = ("few_poses",) if count < RECOMMENDED_TOUCHES else ()
    return ZTouchResult(
        method="z-touch",
        offset=ToolOffset(z_mm=z_mm),
        measured=("z_mm",),
        kept=_KEPT,
        reference_point_mm=(),
        sigma_gain=found.gain,
        warnings=(*warnings, "overshoot") if found.overshoot_s2_per_mm is not None else warnings,
        inputs=(),
        residuals_mm=tuple((0.0, 0.0, residual) for residual in found.fit.residuals.tolist()),
        condition_number=found.fit.condition_number,
        rank=found.fit.rank,
        unobservable=_KEPT,
        sources=(ErrorSource.of_lengths("plate_mm", 1),),
        latency_s=found.latency_s,
        flange_z_mm=found.flange_z_mm,
        overshoot_s2_per_mm=found.overshoot_s2_per_mm,
        f_quadratic=found.f_quadratic,
        f_limit=found.f_limit,
    )


def touch_sigma_gain(touches: Sequence[Touch]) -> float:
    """Return the standard deviation of Z as a multiple of one touch's; only the speeds count."""
    return fit_touches([0.0] * len(touches), [touch.speed_mm_s for touch in touches], None).gain


def _plane(flange: Pose | None, stored: ToolOffset | None) -> FlangePlane:
    """Return how the flange hangs; X and Y of the tip have to be known where it leans."""
    pose = Pose(0.0, 0.0, 0.0, 0.0) if flange is None else flange
    known = None if stored is None else TipHeight(0.0)
    (plane,) = solvable_planes((pose,), known)
    return plane


def _length(
    plane: FlangePlane, surface_z_mm: float, flange_z_mm: float, stored: ToolOffset | None
) -> float:
    aside = 0.0
    if stored is not None:
        aside = plane.level[0] * stored.x_mm + plane.level[1] * stored.y_mm
    return (surface_z_mm - flange_z_mm - aside) / plane.r33


def _budget(result: ZTouchResult) -> UncertaintyBudget:
    """Return the scatter of the touches as a budget."""
    rows = []
    if result.sigma_mm is not None:
        nu = float("inf") if result.sigma_stated else float(result.dof or 1)
        origin = tr("stated") if result.sigma_stated else tr("residuals")
        rows.append(
            BudgetRow(tr("scatter"), result.sigma_mm, nu, result.sigma_gain, origin, kind="A")
        )
    return UncertaintyBudget.of(rows, not_assessed=(tr("height of the surface"),))


def _with_braking(result: ZTouchResult, shift_mm: float, origin: str) -> ZTouchResult:
    """Return the result with what braking may have shifted Z by, in interval and budget.

    A robot that brakes is shifted by the same at every touch, and perhaps by all of it.
    """
    u_mm = shift_mm / DIVISORS["rectangular"]
    row = BudgetRow(tr("braking"), u_mm, origin=origin)
    result = replace(result, budget=(result.budget or UncertaintyBudget.of(())).with_row(row))
    if not result.half_width95:
        return result
    # Not by degrees of freedom of both together: few touches that agree by luck would make the
    # factor of their own scatter small as well, and 92 % of the intervals held the truth.
    half_mm = shifted_half95(shift_mm, result.half_width95[0] / NORMAL_95)
    return replace(
        result,
        covariance=((result.covariance[0][0] + u_mm**2,),),
        half_width95=(half_mm,),
        region95_radius_mm=half_mm,
    )


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
