"""The latency of a trigger and the braking after it, from touches at several speeds.

A line z_read = z - latency v always; with three speeds and four touches also a parabola
z_read = z - latency v - overshoot v^2, which counts when F(1, N - 3) at 1 % says that it is
there (docs/reference/evidence.md 13).

Length of a tool from touching a surface, with the latency of the trigger taken out.

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
from typing import Any

import numpy as np

from robolink.calibration.core.accuracy import DIVISORS, BudgetRow, ErrorSource, UncertaintyBudget
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    components,
    refuses_by_name,
    require_finite,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import NORMAL_95, f_quantile, shifted_half95, student_t95
from robolink.calibration.flange_plane import FlangePlane, TipHeight, solvable_planes
from robolink.calibration.quality.doubts import Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

LATENCY_S = (-0.002, 0.2)
"""Plausible latency of a trigger, in s: a scan takes 1 to 20 ms, a filter 1 to 50 ms, a polled
network up to 200 ms; slightly negative values come from rounding of the clock."""

OVERSHOOT_S2_PER_MM = (0.0, 0.005)
"""Plausible overshoot from braking: 0.005 corresponds to a deceleration of 100 mm/s^2."""

_BEYOND_SIGMAS = 3.0
_AS_RARE = 0.9973

_OVERSHOOT_QUANTILE = 0.99

_ROUNDING_MM = 1e-9


@dataclass(frozen=True, slots=True)
class TouchFit:
    """The fit of touches at several speeds.

    Attributes:
        fit: Unknowns: z, then the latency unless it was given, then the overshoot if it counts.
        flange_z_mm: Height of the flange when the tip really touched.
        latency_s: As it was found or given.
        latency_gain: Its standard deviation for a scatter of 1 mm; 0 where it was given.
        overshoot_s2_per_mm: ``None`` where it does not count.
        overshoot_gain: Its standard deviation for a scatter of 1 mm.
        f_quadratic: How much the overshoot explains, ``None`` without a test.
        f_limit: What that has to exceed.
        overshoot_upper_s2_per_mm: The largest overshoot, in 97.5 %, that the test may have missed;
            ``None`` without a test.
        braking_mm2_per_s2: By how much an overshoot of 1 s^2/mm that the fit does not know shifts
            the height: v1 v2 for a line through two speeds, the mean of v^2 for a latency that
            was given.
    """

    fit: LinearFit
    flange_z_mm: float
    latency_s: float
    latency_gain: float
    overshoot_s2_per_mm: float | None = None
    overshoot_gain: float = 0.0
    f_quadratic: float | None = None
    f_limit: float | None = None
    overshoot_upper_s2_per_mm: float | None = None
    braking_mm2_per_s2: float = 0.0

    @property
    def gain(self) -> float:
        """Standard deviation of the height as a multiple of one touch's."""
        return math.sqrt(float(self.fit.unit_covariance[0, 0]))


def fit_touches(
    z_mm: Sequence[float], speeds_mm_s: Sequence[float], latency_s: float | None
) -> TouchFit:
    """Return height, latency and, where three speeds show it, overshoot.

    Args:
        z_mm: Heights of the flange when the trigger was read.
        speeds_mm_s: Speed of each touch.
        latency_s: Where an earlier measurement found it.
    """
    z, v = np.array(z_mm, dtype=float), np.array(speeds_mm_s, dtype=float)
    columns = [np.ones(len(z))]
    if latency_s is None:
        columns.append(-v)
    else:
        z = z + v * latency_s
    line = replace(_with(columns, z, latency_s), braking_mm2_per_s2=_braking(columns, v))
    dof = len(z) - len(columns) - 1
    if len(set(speeds_mm_s)) < 3 or dof < 1:
        return line
    parabola = _with([*columns, -(v**2)], z, latency_s)
    left = float(parabola.fit.residuals @ parabola.fit.residuals)
    won = float(line.fit.residuals @ line.fit.residuals) - left
    floor = len(z) * _ROUNDING_MM**2
    ratio = max(won, 0.0) * dof / max(left, floor)
    limit = f_quantile(_OVERSHOOT_QUANTILE, 1, dof)
    gain, found = math.sqrt(float(parabola.fit.unit_covariance[-1, -1])), float(parabola.fit.x[-1])
    upper = max(found, 0.0) + student_t95(dof) * gain * math.sqrt(left / dof)
    best = parabola if ratio > limit else line
    return replace(
        best,
        overshoot_s2_per_mm=found if best is parabola else None,
        overshoot_gain=gain,
        f_quadratic=ratio,
        f_limit=limit,
        overshoot_upper_s2_per_mm=upper,
    )


def _braking(columns: list[Floats], v: Floats) -> float:
    """Return by how much the height of a line is off for an overshoot of 1 s^2/mm."""
    return abs(float(np.linalg.pinv(np.column_stack(columns))[0] @ v**2))


def require_plausible(
    found: TouchFit, sigma_mm: float | None, *, step_mm: float | None = None
) -> None:
    """Refuse an impossible latency or braking: the speeds or the touches are wrong.

    Args:
        found: The fit.
        sigma_mm: Standard deviation of one touch, where it is known; else the residuals tell it.
        step_mm: How finely its place is told, where it is known: what repeats itself hides that.

    Raises:
        CalibrationError: ``implausible_latency``.
    """
    residuals = found.fit.residuals
    dof = residuals.size - found.fit.rank
    slack = max(_BEYOND_SIGMAS * (sigma_mm or 0.0), step_mm or 0.0)
    if dof > 0:
        # With a scatter estimated from a few touches, Student's t gives the same probability.
        scatter = math.sqrt(float(residuals @ residuals) / dof)
        slack = max(slack, math.sqrt(f_quantile(_AS_RARE, 1, dof)) * scatter)
    low, high = LATENCY_S
    if not low - slack * found.latency_gain <= found.latency_s <= high + slack * found.latency_gain:
        raise _implausible(
            tr(
                "The trigger delay would be {latency:.4f} s; possible are {low:g} to {high:g} s.",
                latency=found.latency_s,
                low=low,
                high=high,
            )
        )
    overshoot, (low, high) = found.overshoot_s2_per_mm, OVERSHOOT_S2_PER_MM
    slack *= found.overshoot_gain
    if overshoot is not None and not low - slack <= overshoot <= high + slack:
        raise _implausible(
            tr(
                "The braking distance would be {overshoot:.5f} s^2/mm times the "
                "squared speed; possible are {low:g} to {high:g}.",
                overshoot=overshoot,
                low=low,
                high=high,
            )
        )


def _with(columns: list[Floats], z: Floats, latency_s: float | None) -> TouchFit:
    fit = linear_fit(np.column_stack(columns), z)
    if latency_s is not None:
        return TouchFit(fit, float(fit.x[0]), latency_s, 0.0)
    gain = math.sqrt(float(fit.unit_covariance[1, 1]))
    return TouchFit(fit, float(fit.x[0]), float(fit.x[1]), gain)


def _implausible(what: str) -> CalibrationError:
    return CalibrationError(
        "implausible_latency",
        what,
        remedy=tr("Check input number and speeds; clean surface and tip, then touch again."),
    )


PROBE_TOLERANCE = Tolerance(rms_mm=0.05, max_residual_mm=0.15)

RECOMMENDED_TOUCHES = 3

USUAL_DECELERATION_MM_S2 = 300.0
"""Assumed least deceleration of a robot (docs/reference/evidence.md 13)."""

_SPEEDS_APART = 1.5
"""Smallest ratio of the speeds that separates the latency."""


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


@refuses_by_name
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
    z_mm = _length(plane, surface_z_mm, found.flange_z_mm, stored)
    result = judged(
        _result(found, len(touches), components(stored, z_mm=z_mm)),
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


def _result(found: TouchFit, count: int, told: dict[str, Any]) -> ZTouchResult:
    warnings = ("few_poses",) if count < RECOMMENDED_TOUCHES else ()
    return ZTouchResult(
        method="z-touch",
        **told,
        reference_point_mm=(),
        sigma_gain=found.gain,
        warnings=(*warnings, "overshoot") if found.overshoot_s2_per_mm is not None else warnings,
        inputs=(),
        residuals_mm=tuple((0.0, 0.0, residual) for residual in found.fit.residuals.tolist()),
        condition_number=found.fit.condition_number,
        rank=found.fit.rank,
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
    """Return the result with the Z shift that braking may cause, in interval and budget.

    A robot that brakes is shifted by the same at every touch, and perhaps by all of it.
    """
    u_mm = shift_mm / DIVISORS["rectangular"]
    row = BudgetRow(tr("braking"), u_mm, origin=origin)
    result = replace(result, budget=(result.budget or UncertaintyBudget.of(())).with_row(row))
    if not result.half_width95:
        return result
    # The degrees of freedom of both are not combined: a few touches that agree by luck would reduce
    # the factor of their own scatter too, and only 92 % of the intervals held the true value.
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
