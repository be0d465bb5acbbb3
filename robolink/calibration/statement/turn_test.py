"""Compares a turn test with the measurement's own statements, not only with the process limit.

A drift is a linear function of all looks, of measurement and test, and of the rows of the budget.
Of two fresh looks at angles that differ by a it has, in each coordinate,

    v = s^2 + s_offset^2 + (2 sin(a / 2))^2 u_place^2

and against a place that was fitted v = s^2 (1 + h), h being the leverage of the test in the fit.
A mark beside the middle of a board, a row of a table and a surface have more of it, and each drift
of a mark has what is uncertain of where it is on the tool.
Each drift is held to its own limit sqrt(q v) (docs/reference/evidence.md 20).

Its power is from what shift of the tip on it shows one.
A tip that shifted by t between measurement and test gives a drift as long as t at every angle, in
any direction, and what scatters beside it: v = s^2 (1 + h) in each of m coordinates. Beside t the
m - 1 others bring (m - 1) v on average, so a single drift is beyond its limit L in 95 % from

    t = sqrt(L^2 - (m - 1) v) + z sqrt(v)

on, z being the 95 % quantile of the normal distribution, or of Student's t where L and v rest on
the same residuals. This is the power of a test of a mean (ISO 3494); the noncentral chi-squared
distribution gives the same within 1 %. Several drifts have their looks for themselves and the
measurement in common, at most; the test shows what any of them shows.
"""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Self

from robolink.calibration.core.accuracy import AccuracyFacts, ErrorSource
from robolink.calibration.core.frames import tip_pose
from robolink.calibration.core.result import GUARD_FACTOR, CalibrationResult, Drift, VerifyResult
from robolink.calibration.core.statistics import (
    chi_square_quantile,
    f_quantile,
    normal_quantile,
    student_t,
)
from robolink.calibration.core.turn_claim import (
    CONTRADICTS_ACCURACY,
    CONTRADICTS_REPEATABILITY,
    DriftLimits,
    TurnClaim,
    TurnJudgement,
)
from robolink.calibration.statement.accuracy import row_covariance, usual_look_sigma_mm
from robolink.model import angle_difference_deg

SHOWN_IN: Final = 0.95
"""Share of tests that must contradict a shift before a turn test counts as showing that shift."""

_NODES: Final = tuple((step / 2, math.exp(-step * step / 8)) for step in range(-12, 13))
"""Nodes of an integration over the error that all drifts share, in standard deviations; weights."""
_WHOLE: Final = sum(weight for _, weight in _NODES)
_ROOT_2: Final = math.sqrt(2)

_HALVINGS: Final = 16


@dataclass(frozen=True, slots=True)
class TurnView:
    """The limit of one drift, and the scatter of each of its coordinates.

    Attributes:
        limit_mm: From where on it is contradicted.
        own_mm: Standard deviation by the looks of the test.
        shared_mm: Standard deviation by what other drifts of the test may have as well.
    """

    limit_mm: float
    own_mm: float
    shared_mm: float

    def limit_along_mm(self, coordinates: int) -> float:
        """Return the limit along a shift, with the other coordinates at their average."""
        aside = (coordinates - 1) * (self.own_mm**2 + self.shared_mm**2)
        return math.sqrt(max(self.limit_mm**2 - aside, 0.0))


@lru_cache(maxsize=64)  # tests of a tool mostly have the same limits, and an integral takes long
def shows_from_mm(views: tuple[TurnView, ...], coordinates: int, nu: float | None) -> float:
    """Return the smallest shift of the tip that a test shows in 95 %.

    Args:
        views: Its drifts.
        coordinates: How many coordinates each has.
        nu: Degrees of freedom of their scatter, ``None`` where it is known.

    Example:
        >>> from robolink.calibration.statement.turn_test import TurnView, shows_from_mm
        >>> one = TurnView(limit_mm=0.0526, own_mm=0.01, shared_mm=0.01)
        >>> round(shows_from_mm((one,), 2, None), 4), round(shows_from_mm((one, one), 2, None), 4)
        (0.0739, 0.0662)
    """
    known = normal_quantile(SHOWN_IN)
    limits = [(one, one.limit_along_mm(coordinates)) for one in views]
    nearest = min(limit for _, limit in limits)
    found = min(limit + known * math.hypot(one.own_mm, one.shared_mm) for one, limit in limits)
    least = 0.0
    for _ in range(_HALVINGS if len(limits) > 1 else 0):
        middle = (least + found) / 2
        shown = _missed(middle, limits) <= 1 - SHOWN_IN
        least, found = (least, middle) if shown else (middle, found)
    # The true scatter may be larger than the estimated one.
    wider = student_t(SHOWN_IN, nu) / known if nu else 1.0
    return max(found, nearest + wider * (found - nearest))


def _missed(shift_mm: float, limits: Sequence[tuple[TurnView, float]]) -> float:
    """Return the probability that no drift shows a shift, whatever part they share."""
    missed = 0.0
    for node, weight in _NODES:
        for one, limit_mm in limits:
            over = (limit_mm - shift_mm - node * one.shared_mm) / one.own_mm
            weight *= math.erfc(-over / _ROOT_2) / 2
        missed += weight
    return missed / _WHOLE


FALSE_ALARMS: Final = 0.001
"""Share of tests in which a right result may be contradicted, all drifts of one test together."""

_ENOUGH_NU: Final = 6
"""Smallest number of degrees of freedom from which an estimated scatter replaces a usual one; fewer
are accepted only where the usual scatter would let too much pass."""

LEAST_TURN_DEG: Final = 90.0
"""Smallest turn from the orientation of the measurement that counts as a test."""

_SHOWN: Final = 0.5
"""Smallest share of an error that a drift must show to widen the statement."""

_ROUGHER: Final = 0.99
"""Quantile of chi-square above which looks are rougher than usual."""

_WITH_DIRECTION: Final = 3
"""Number of coordinates with direction: X, Y and the direction of a tool."""

_PLANE: Final = 2

_LEAST_TILTED: Final = 4

_TELLS_NOTHING: Final = 1e-9

_REGION95: Final = 2.45
"""95 % factor for two coordinates together, with a known scatter."""


def turn_claim(result: CalibrationResult, facts: AccuracyFacts) -> TurnClaim | None:
    """Return what a turn test of a result is compared with; ``None`` without a scatter.

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
    marks = _Marks.of(result)
    # One look of several inputs is their mean in each coordinate.
    single_mm = sigma_mm * math.sqrt(max(result.inputs_per_look / 2, 1.0))
    return TurnClaim(
        look_sigma_mm=sigma_mm,
        look_nu=nu,
        offset_sigma_mm=single_mm * (marks.middle_gain or result.sigma_gain),
        # Touches of a surface measure a height, at any angle.
        headings_deg=tuple(
            tip_pose(pose, result.offset, tool=0).u_deg if pose.tool in (None, 0) else pose.u_deg
            for pose in result.inputs
        )
        or (0.0,),
        inputs_per_look=result.inputs_per_look,
        finds_place=not place,
        place_u_mm=math.hypot(*(marks.u_mm(one, facts) for one in place)),
        offset_u_mm=math.hypot(*(marks.u_mm(one, facts) for one in aside)),
        tilted_leverage=_tilted_leverage(result),
        mark_leverage=marks.leverage,
        mark_u_mm=math.hypot(
            (result.held_to_table_mm or 0.0) / math.sqrt(3),
            *(marks.printed_u_mm(facts) for one in sources if one.row == "print_mm"),
        ),
        by_surface=result.by_surface,
        repeatable_mm=result.repeatable_to_mm,
        accurate_mm=result.accurate_to_mm,
        by_camera=any(one.row == "tip_image_px" for one in sources),
        measures_z="z_mm" in result.found,
    )


@dataclass(frozen=True, slots=True)
class _Marks:
    """The marks that a turn test looks at, as they lie on the tool.

    Attributes:
        places: X and Y of each in the axes of the tool.
        leverage: What scatter brings to their drifts by the direction of the tool, or by the table
            that they are held to, as a multiple of the variance of one look.
        middle_gain: Gain of the middle of several, ``None`` for a tip.
    """

    places: tuple[tuple[float, float], ...]
    leverage: float
    middle_gain: float | None

    @classmethod
    def of(cls, result: CalibrationResult) -> Self:
        """Return the marks of a method's turn test."""
        looks = max(len(result.inputs), 1)
        if not result.marks_mm:
            # With a runout table, the test compares one look, not all of them, with its row.
            row = 0.0 if result.held_to_table_mm is None else max(1 - 2 / looks, 0.0)
            return cls(((0.0, 0.0),), row, None)
        places, count = result.marks_mm, len(result.marks_mm)
        x_mm, y_mm = (sum(axis) / count for axis in zip(*places, strict=True))
        squares = [(x - x_mm) ** 2 + (y - y_mm) ** 2 for x, y in places]
        turned = max(squares) / (sum(squares) * looks / count)
        return cls(places, turned, 1 / math.sqrt(looks))

    def u_mm(self, source: ErrorSource, facts: AccuracyFacts) -> float:
        """Return what a row adds to one coordinate of a mark, the worst; without its growth.

        The growth by age is in the statement, but would blunt the test.
        """
        half_width, worst = facts.of(source.row).half_width, 0.0
        if len(self.places) == 1 or len(source.gain) < _WITH_DIRECTION:
            covariance = row_covariance(source, half_width)
            return math.sqrt(max(covariance.diagonal().tolist(), default=0.0))
        along_x, along_y, turn = source.gain[:_WITH_DIRECTION]
        degree = math.radians(1.0)
        for x_mm, y_mm in self.places:
            by_x = sum((g - degree * y_mm * t) ** 2 for g, t in zip(along_x, turn, strict=True))
            by_y = sum((g + degree * x_mm * t) ** 2 for g, t in zip(along_y, turn, strict=True))
            worst = max(worst, by_x, by_y)
        return half_width * math.sqrt(worst / 3)

    def printed_u_mm(self, facts: AccuracyFacts) -> float:
        """Return how far a fiducial lies from where all of them put it."""
        share = 1 - 1 / len(self.places)
        return facts.of("print_mm").half_width * math.sqrt(share / 3)


def _tilted_leverage(result: CalibrationResult) -> float | None:
    """Return the leverage of a test in the fit of a tip that was tilted, the worst; else ``None``.

    h = 1 / N + (R - mean R) C (R - mean R)', with C that of the tip for sigma = 1; R being any of
    the orientations that were touched, turned as one likes.
    """
    if result.by_surface or len(result.reference_point_mm) < 3 or "z_mm" not in result.measured:
        return None
    # Poses that only show directions leave no residual.
    poses = result.inputs[: len(result.residuals_mm)]
    if len(poses) < _LEAST_TILTED:
        return None
    import numpy as np  # numpy, not needed for a command's help

    from robolink.calibration.core.rotations import rotations

    angles = np.array([(one.u_deg, one.v_deg, one.w_deg) for one in poses])
    touched = rotations(angles)
    count, mean = len(touched), touched.mean(axis=0)
    told, axes = np.linalg.eigh(count * (np.eye(3) - mean.T @ mean))
    if told[0] < _TELLS_NOTHING:
        return None
    about = rotations(np.array([(turn, 0.0, 0.0) for turn in range(0, 360, 15)], dtype=float))
    other = np.einsum("aij,njk->anik", about, touched).reshape(-1, 3, 3) - mean
    spread = other @ ((axes / told) @ axes.T) @ other.transpose(0, 2, 1)
    return 1 / count + float(np.linalg.eigvalsh(spread)[:, -1].max())


def _look_scatter(
    result: CalibrationResult, facts: AccuracyFacts
) -> tuple[float, float | None] | None:
    """Return the scatter of one look and its degrees of freedom, ``None`` for known."""
    usual_mm = usual_look_sigma_mm(result, facts)
    of_look = math.sqrt(max(result.inputs_per_look / 2, 1.0))
    step_mm = (result.evidence.grid_mm if result.evidence is not None else None) or 0.0
    if usual_mm is not None:
        # On a grid, looks can be off by up to one step without any scatter.
        usual_mm = max(usual_mm, step_mm / math.sqrt(12) / of_look)
    own_mm = None if result.sigma_mm is None else result.sigma_mm / of_look
    from_residuals, dof = result.interval_from == "residuals", result.dof or 0
    if own_mm is not None and from_residuals and dof >= _ENOUGH_NU:
        return own_mm, float(dof)
    if own_mm is not None and result.sigma_stated:
        # Few residuals widen the interval by the factor of Student's t, even if they are small: the
        # stated value stands unless they contradict it.
        ratio = result.evidence.birge_ratio if from_residuals and result.evidence else None
        stated_mm = own_mm / (ratio or 1.0)
        if from_residuals and "sigma_contradicted" in result.warnings:
            return _together(own_mm, dof, stated_mm)
        return stated_mm, None
    recorded = facts.look_sigma_mm is not None and facts.look_nu >= _ENOUGH_NU
    least_mm = facts.look_sigma_mm if recorded else usual_mm
    # Even a few looks show it if they are clearly rougher than usual.
    if own_mm is not None and least_mm and from_residuals and dof:
        squares = dof * (own_mm / least_mm) ** 2
        if squares > chi_square_quantile(_ROUGHER, dof):
            return _together(own_mm, dof, least_mm)
        if _tells_more(result, own_mm, dof, least_mm, facts.look_nu if recorded else None):
            return own_mm, float(dof)
    if facts.look_sigma_mm is not None and facts.look_nu >= _ENOUGH_NU:
        return facts.look_sigma_mm, facts.look_nu
    if usual_mm is not None:
        return usual_mm, None
    return None if own_mm is None else (own_mm, None)


def _tells_more(
    result: CalibrationResult, own_mm: float, dof: int, usual_mm: float, nu: float | None
) -> bool:
    """Return whether few residuals tell more than the usual value.

    They do where a usual scatter would let a drift pass that is larger than what the result, by
    the same residuals, says it is accurate to, and their own F lets less pass. Two fresh looks are
    taken for the geometry.
    """
    coordinates = 3 if result.by_surface or "z_mm" in result.measured else 2
    usual_limit_mm = usual_mm * math.sqrt(2 * _quantile(1, coordinates, nu))
    own_limit_mm = own_mm * math.sqrt(2 * _quantile(1, coordinates, dof))
    stated_mm = result.accurate_to_mm
    return stated_mm is not None and max(stated_mm, own_limit_mm) < usual_limit_mm


def _together(own_mm: float, dof: int, expected_mm: float) -> tuple[float, float]:
    """Return a scatter that few residuals tell, with what was expected of it, and its freedom.

    Residuals that are few, and rough by chance, would let a turn test pass whatever is seen: F is
    five times as large at four degrees of freedom as at ten. So what was expected counts as much as
    the residuals that it takes to do without it (docs/reference/evidence.md 20).
    """
    nu = _ENOUGH_NU + dof
    return math.sqrt((_ENOUGH_NU * expected_mm**2 + dof * own_mm**2) / nu), float(nu)


def held_to_claim(claim: TurnClaim, proof: VerifyResult) -> TurnJudgement:
    """Return what the drifts of a turn test show about a measurement.

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
    drifts, coordinates = proof.drifts, proof.coordinates
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
    wider_mm, stated_mm = _wider_mm(claim, pairs), claim.accurate_mm
    shows_mm = _shows_from_mm(claim, proof, limits) if proof.passed else None
    shows_z_mm = _shows_z_from_mm(claim, proof, shows_mm)
    return TurnJudgement(
        code,
        limits,
        worst,
        small_angle=not proof.heights_only and turned < LEAST_TURN_DEG - 0.5,
        wider_mm=wider_mm,
        offers_wider=not claim.by_camera,
        covered=wider_mm is not None and stated_mm is not None and wider_mm <= stated_mm,
        shows_from_mm=None if proof.heights_only else shows_mm,
        shows_z_from_mm=shows_z_mm,
        misses_z=claim.measures_z and proof.passed and shows_z_mm is None,
        accurate_mm=stated_mm,
    )


def _shows_from_mm(claim: TurnClaim, proof: VerifyResult, limits: Sequence[DriftLimits]) -> float:
    """Return the smallest shift of the tip between measurement and test that the test shows.

    Beyond the limit of repeatability it is at least doubted, and beyond that of the process, with
    its guard band, it does not pass. Rows are left out: where an error of the place hides a shift,
    the tip is off by that error alone, which its row holds.
    """
    coordinates, views = proof.coordinates, []
    quantile = _quantile(len(limits), coordinates, claim.look_nu)
    for drift, limit in zip(proof.drifts, limits, strict=True):
        allowed_mm = min(limit.repeatable_mm, proof.tolerance_mm - GUARD_FACTOR * drift.u_mm)
        scatter = limit.repeatable_mm**2 / quantile
        own = min(claim.look_sigma_mm**2 / drift.looks, scatter)
        views.append(TurnView(max(allowed_mm, 0.0), math.sqrt(own), math.sqrt(scatter - own)))
    return shows_from_mm(tuple(views), coordinates, claim.look_nu)


def _shows_z_from_mm(claim: TurnClaim, proof: VerifyResult, shows_mm: float | None) -> float | None:
    """Return the same of a shift in height: by the drifts, or by heights that were compared."""
    if not claim.measures_z or shows_mm is None:
        return None
    by_drifts = shows_mm if proof.coordinates != _PLANE else None
    told = (by_drifts, proof.height_shows_from_mm)
    return min((one for one in told if one is not None), default=None)


def _limits(
    claim: TurnClaim, drift: Drift, count: int, coordinates: int, proof: VerifyResult
) -> DriftLimits:
    look = claim.look_sigma_mm**2
    scatter, place = look / drift.looks + claim.offset_sigma_mm**2, 0.0
    if proof.heights_only:
        # The place of the surface does not change with its height.
        return _both(scatter, 0.0, count, coordinates, claim.look_nu, 180.0)
    if claim.by_surface:
        # Doubled: the test's own touches limit how well the surface is known.
        scatter = 2 * max(look / drift.looks, drift.u_mm**2)
    elif claim.finds_place:
        scatter = look / drift.looks + look * _leverage(claim, drift.u_deg)
    else:
        place = (abs(_turned(claim.headings_deg, drift.u_deg)) * claim.place_u_mm) ** 2
    # The place of a mark on the tool is no movement, so it contradicts neither statement.
    scatter += look * claim.mark_leverage + claim.mark_u_mm**2
    rows = place + claim.offset_u_mm**2
    turn_deg = max(abs(angle_difference_deg(drift.u_deg, one)) for one in claim.headings_deg)
    return _both(scatter, rows, count, coordinates, claim.look_nu, turn_deg)


def _both(
    scatter: float, rows: float, count: int, coordinates: int, nu: float | None, turn_deg: float
) -> DriftLimits:
    known, estimated = _quantile(count, coordinates, None), _quantile(count, coordinates, nu)
    return DriftLimits(
        math.sqrt(estimated * scatter), math.sqrt(estimated * scatter + known * rows), turn_deg
    )


def _quantile(count: int, coordinates: int, nu: float | None) -> float:
    """Return what the square of a drift may be, as a multiple of its variance."""
    likely = 1 - FALSE_ALARMS / count
    if nu is None:
        return chi_square_quantile(likely, coordinates)
    return coordinates * f_quantile(likely, coordinates, nu)


def _turned(headings_deg: Sequence[float], u_deg: float) -> complex:
    """Return what is left, at another angle, of a place that all looks were off by alike."""
    mean = sum(cmath.exp(-1j * math.radians(one)) for one in headings_deg) / len(headings_deg)
    return 1 - cmath.exp(1j * math.radians(u_deg)) * mean


def _leverage(claim: TurnClaim, u_deg: float) -> float:
    """Return the leverage of a test at ``u_deg`` in the fit of offset and place.

    Where the tool was tilted and not turned its headings say nothing: then that of an even spread.
    """
    if claim.tilted_leverage is not None:
        return claim.tilted_leverage
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
        # A movement between the looks shows in the difference from the last look.
        last = claim.headings_deg[-1:] if claim.finds_place else claim.headings_deg
        shown = min(1.0, abs(_turned(last, drift.u_deg)))
        spread_mm = _REGION95 * claim.look_sigma_mm / math.sqrt(drift.looks)
        if shown >= _SHOWN:
            told.append((drift.distance_mm + spread_mm) / shown)
    return max((*told, claim.accurate_mm or 0.0)) if told else None
