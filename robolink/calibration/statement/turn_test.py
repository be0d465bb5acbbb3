"""A turn test is held to what the measurement said, not only to the limit of the process.

A drift is a linear function of all looks, of measurement and test, and of the rows of the budget.
Of two fresh looks at angles that differ by a it has, in each coordinate,

    v = s^2 + s_offset^2 + (2 sin(a / 2))^2 u_place^2

and against a place that was fitted v = s^2 (1 + h), h being the leverage of the test in the fit.
Each drift is held to its own limit sqrt(q v) (docs/reference/evidence.md 20).
"""

import cmath
import math
from collections.abc import Sequence
from typing import Final

from robolink.calibration.core.accuracy import AccuracyFacts, ErrorSource
from robolink.calibration.core.frames import tip_pose
from robolink.calibration.core.result import CalibrationResult, Drift, VerifyResult
from robolink.calibration.core.statistics import chi_square_quantile, f_quantile
from robolink.calibration.core.turn_claim import (
    CONTRADICTS_ACCURACY,
    CONTRADICTS_REPEATABILITY,
    DriftLimits,
    TurnClaim,
    TurnJudgement,
)
from robolink.calibration.statement.accuracy import row_covariance, usual_look_sigma_mm
from robolink.model import angle_difference_deg

_FALSE_ALARMS: Final = 0.001
"""So often may a right result be contradicted, all drifts of one test together."""

_ENOUGH_NU: Final = 6
"""From so many degrees of freedom on an estimated scatter may be used in place of a usual one."""

LEAST_TURN_DEG: Final = 90.0
"""A tool that is turned by less from where it was measured is not called tested."""

_SHOWN: Final = 0.5
"""A drift that shows less than this share of an error tells no wider statement."""

_REGION95: Final = 2.45
"""Of two coordinates with a known scatter, together."""


def turn_claim(result: CalibrationResult, facts: AccuracyFacts) -> TurnClaim | None:
    """Return what a turn test of a result is held to; ``None`` where nothing tells a scatter.

    Args:
        result: What was measured; :func:`~robolink.calibration.assessed` has judged it.
        facts: What the cell knows of the rows of its budget.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import AccuracyFacts, assessed, solve_two_pose, turn_claim
        >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
        >>> found = assessed(solve_two_pose(*touches, sigma_mm=0.02), AccuracyFacts())
        >>> claim = turn_claim(found, AccuracyFacts())
        >>> claim.finds_place, claim.look_sigma_mm, claim.headings_deg
        (True, 0.02, (0.0, 180.0))
    """
    known = _look_scatter(result, facts)
    if known is None:
        return None
    sigma_mm, nu = known
    sources = result.sources or ()
    place = [one for one in sources if one.turning == "in_base"]
    aside = [one for one in sources if one.turning == "as_offset"]
    # A look of several inputs has the mean of them in each coordinate.
    single_mm = sigma_mm * math.sqrt(max(result.inputs_per_look / 2, 1.0))
    return TurnClaim(
        look_sigma_mm=sigma_mm,
        look_nu=nu,
        offset_sigma_mm=single_mm * result.sigma_gain,
        # Touches of a surface tell a height, at whatever angle.
        headings_deg=tuple(
            tip_pose(pose, result.offset, tool=0).u_deg if pose.tool in (None, 0) else pose.u_deg
            for pose in result.inputs
        )
        or (0.0,),
        inputs_per_look=result.inputs_per_look,
        finds_place=not place,
        place_u_mm=math.hypot(*(_u_mm(one, facts) for one in place)),
        offset_u_mm=math.hypot(*(_u_mm(one, facts) for one in aside)),
        repeatable_mm=result.repeatable_to_mm,
        accurate_mm=result.accurate_to_mm,
        by_camera=any(one.row == "tip_image_px" for one in sources),
    )


def _u_mm(source: ErrorSource, facts: AccuracyFacts) -> float:
    """Return what a row brings to one coordinate, the worst; without its growth by age.

    The growth is in the statement, but would blunt the test.
    """
    covariance = row_covariance(source, facts.of(source.row).half_width)
    return math.sqrt(max(covariance.diagonal().tolist(), default=0.0))


def _look_scatter(
    result: CalibrationResult, facts: AccuracyFacts
) -> tuple[float, float | None] | None:
    """Return the scatter of one look and its degrees of freedom, ``None`` for known."""
    usual_mm = usual_look_sigma_mm(result, by_contact=facts.by_contact)
    of_look = math.sqrt(max(result.inputs_per_look / 2, 1.0))
    step_mm = (result.evidence.grid_mm if result.evidence is not None else None) or 0.0
    if usual_mm is not None:
        # Looks on a grid can be off by its step without scattering at all.
        usual_mm = max(usual_mm, step_mm / math.sqrt(12) / of_look)
    own_mm = None if result.sigma_mm is None else result.sigma_mm / of_look
    from_residuals = result.interval_from == "residuals"
    if own_mm is not None and from_residuals and (result.dof or 0) >= _ENOUGH_NU:
        return own_mm, float(result.dof or 0)
    if own_mm is not None and result.sigma_stated:
        # Residuals of few looks that contradict what was stated are not a better scatter.
        return (max(own_mm, usual_mm or 0.0) if from_residuals else own_mm), None
    if facts.look_sigma_mm is not None and facts.look_nu >= _ENOUGH_NU:
        return facts.look_sigma_mm, facts.look_nu
    if usual_mm is not None:
        return usual_mm, None
    return None if own_mm is None else (own_mm, None)


def held_to_claim(claim: TurnClaim, proof: VerifyResult) -> TurnJudgement:
    """Return what the drifts of a turn test say about a measurement.

    Args:
        claim: What the measurement lets expect.
        proof: The turn test.

    Example:
        >>> from robolink.calibration import Drift, TurnClaim, VerifyResult, held_to_claim
        >>> claim = TurnClaim(
        ...     look_sigma_mm=0.003, offset_sigma_mm=0.003, headings_deg=(0,), finds_place=False,
        ...     place_u_mm=0.0115, accurate_mm=0.028,
        ... )
        >>> moved = VerifyResult((Drift(180, 0.101, 0),), tolerance_mm=0.2)
        >>> held_to_claim(claim, moved).code
        'proof_contradicts_accuracy'
        >>> little = VerifyResult((Drift(180, 0.06, 0),), tolerance_mm=0.2)
        >>> held_to_claim(claim, little).code
        'proof_contradicts_repeatability'
    """
    drifts = proof.drifts
    coordinates = 1 if proof.heights_only else 3 if any(one.dz_mm for one in drifts) else 2
    limits = tuple(_limits(claim, one, len(drifts), coordinates, proof) for one in drifts)
    pairs = list(zip(drifts, limits, strict=True))
    worst = max(range(len(pairs)), key=lambda i: pairs[i][0].distance_mm / pairs[i][1].accurate_mm)
    code = ""
    if any(drift.distance_mm > limit.accurate_mm for drift, limit in pairs):
        code = CONTRADICTS_ACCURACY
    elif any(drift.distance_mm > limit.repeatable_mm for drift, limit in pairs):
        code = CONTRADICTS_REPEATABILITY
        worst = max(
            range(len(pairs)), key=lambda i: pairs[i][0].distance_mm / pairs[i][1].repeatable_mm
        )
    turned = max(limit.turn_deg for limit in limits)
    return TurnJudgement(
        code,
        limits,
        worst,
        small_angle=not proof.heights_only and turned < LEAST_TURN_DEG - 0.5,
        wider_mm=_wider_mm(claim, pairs),
        offers_wider=not claim.by_camera,
    )


def _limits(
    claim: TurnClaim, drift: Drift, count: int, coordinates: int, proof: VerifyResult
) -> DriftLimits:
    look = claim.look_sigma_mm**2
    scatter, place = look / drift.looks + claim.offset_sigma_mm**2, 0.0
    if proof.heights_only:
        # The surface is where it was, whatever its height.
        return _both(scatter, 0.0, count, coordinates, claim.look_nu, 180.0)
    if claim.finds_place:
        scatter = look / drift.looks + look * _leverage(claim, drift.u_deg)
    else:
        place = (abs(_turned(claim.headings_deg, drift.u_deg)) * claim.place_u_mm) ** 2
    rows = place + claim.offset_u_mm**2
    turn_deg = max(abs(angle_difference_deg(drift.u_deg, one)) for one in claim.headings_deg)
    return _both(scatter, rows, count, coordinates, claim.look_nu, turn_deg)


def _both(
    scatter: float, rows: float, count: int, coordinates: int, nu: float | None, turn_deg: float
) -> DriftLimits:
    known = chi_square_quantile(1 - _FALSE_ALARMS / count, coordinates)
    estimated = known
    if nu is not None:
        estimated = coordinates * f_quantile(1 - _FALSE_ALARMS / count, coordinates, nu)
    return DriftLimits(
        math.sqrt(estimated * scatter), math.sqrt(estimated * scatter + known * rows), turn_deg
    )


def _turned(headings_deg: Sequence[float], u_deg: float) -> complex:
    """Return what is left, at another angle, of a place that all looks were off by alike."""
    mean = sum(cmath.exp(-1j * math.radians(one)) for one in headings_deg) / len(headings_deg)
    return 1 - cmath.exp(1j * math.radians(u_deg)) * mean


def _leverage(claim: TurnClaim, u_deg: float) -> float:
    """Return the leverage of a test at ``u_deg`` in the fit of offset and place.

    Where the tool was tilted and not turned its headings say nothing: then that of an even spread.
    """
    looks = [cmath.exp(1j * math.radians(one)) for one in claim.headings_deg]
    count = len(looks) / claim.inputs_per_look
    mean = sum(looks) / len(looks)
    spread = sum(abs(look - mean) ** 2 for look in looks) / claim.inputs_per_look
    if spread < 0.1 * count:
        return 2 / count
    return 1 / count + abs(cmath.exp(1j * math.radians(u_deg)) - mean) ** 2 / spread


def _wider_mm(claim: TurnClaim, pairs: Sequence[tuple[Drift, DriftLimits]]) -> float | None:
    """Return U = (d + 2.45 s) / min(1, 2 sin(a / 2)), the largest, never below what was said."""
    told = []
    for drift, _ in pairs:
        # What moved in between shows against the last look.
        last = claim.headings_deg[-1:] if claim.finds_place else claim.headings_deg
        shown = min(1.0, abs(_turned(last, drift.u_deg)))
        spread_mm = _REGION95 * claim.look_sigma_mm / math.sqrt(drift.looks)
        if shown >= _SHOWN:
            told.append((drift.distance_mm + spread_mm) / shown)
    return max((*told, claim.accurate_mm or 0.0)) if told else None
