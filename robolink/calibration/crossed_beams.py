"""Tool offset from moves through two crossed beams.

Half way through a beam with normal n, ``n (middle + A t + c t_z) = distance``; A and c are those
of the flange, which may lean or hang upside down (docs/reference/evidence.md 3).

How the uncertainty of beams goes into a tip that is measured with them.

The equation of one crossing is n'(middle + R t) = distance. Where the beam is off by (d, a),
distance and direction, the crossing is off by d + lever a, the lever being how far along the beam
the tip went through it from where the beam was found. The fit is linear, so the offset is off by
the same mixture of the rows as of their scatter (docs/reference/evidence.md 12).
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robolink.calibration.beam_lines import (
    Beam,
    Crossing,
    Lean,
    ShaftSeen,
    check_crossings,
    lean_exceeds,
    require_crossed,
    with_unknown_length,
)
from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    angle_spread_deg,
    components,
    refuses_by_name,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.rotations import rotation_of
from robolink.calibration.flange_plane import (
    FlangePlane,
    TipHeight,
    height_of,
    known_z_mm,
    require_flange_in_base,
    solvable_planes,
    with_height_error,
)
from robolink.calibration.quality.doubts import PLANAR_TOLERANCE, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.station import StationPart, with_station
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset


def beams_part(
    design: Floats, crossings: Sequence[Crossing], beams: tuple[Beam, Beam], offset: ToolOffset
) -> StationPart:
    """Return the uncertainty that two beams add to X and Y.

    Args:
        design: The design matrix of the fit, one row a crossing, X and Y its first two columns.
        crossings: The crossings, in the order of the rows.
        beams: The beams, each with its covariance.
        offset: The tip that was found.
    """
    mixture = np.linalg.pinv(design)[:2]
    through = [_through_mm(crossing, offset) for crossing in crossings]
    total = np.zeros((2, 2))
    for number, beam in enumerate(beams):
        rows = [row for row, crossing in enumerate(crossings) if crossing.beam == number]
        levers = [(1.0, beam.along_mm(*through[row])) for row in rows]
        part = mixture[:, rows] @ np.array(levers)
        total += part @ np.array(beam.covariance) @ part.T
    known = [beam.dof for beam in beams if beam.dof is not None]
    return StationPart(
        tr("place of the beams"),
        total.tolist(),
        dof=min(known, default=math.inf),
        origin=tr("record of the station"),
    )


def _through_mm(crossing: Crossing, offset: ToolOffset) -> tuple[float, float]:
    """Return where the tip went through a beam, base."""
    dx, dy, _ = (rotation_of(crossing.entry) @ np.array(offset.components()[:3])).tolist()
    x_mm, y_mm = crossing.middle_mm
    return x_mm + dx, y_mm + dy


@dataclass(frozen=True, slots=True, kw_only=True)
class BeamsResult(CalibrationResult):
    """A tool offset from beams.

    Attributes:
        lag_mm: For each beam, by how much latency and backlash shift a crossing along its
            travel; ``None`` where only one direction was driven.
        u_without_beams_mm: Standard uncertainty of X and of Y by the crossings alone; empty
            without an interval.
        lean: How the needle leans, ``None`` where its shaft was not looked at; X and Y are those
            of its end, and hold the correction.
        moved_mm: By how far each beam lies from where it was learnt, across it along its normal;
            empty where its place was relied on.
        step_mm: How finely the place of an edge is told; ``None`` where nobody said.
        seen_above_mm: How far above its end the beams saw the needle, as it was planned; ``None``
            where a solver alone was called. Without ``lean`` nobody knows what that does to X and
            Y: half a degree at 1.5 mm is 0.013 mm.
    """

    lag_mm: tuple[float | None, float | None]
    u_without_beams_mm: tuple[float, ...] = ()
    lean: Lean | None = None
    moved_mm: tuple[float, ...] = ()
    step_mm: float | None = None
    seen_above_mm: float | None = None

    def details(self) -> dict[str, object]:
        """Return how the needle leans, and where the beams were found; see the base class."""
        lean = {} if self.lean is None else {"needle": self.lean.as_json()}
        moved = {"beams_moved_mm": list(self.moved_mm)} if self.moved_mm else {}
        return {**lean, **moved}

    @property
    def inputs_per_look(self) -> int:
        """Both beams, both ways."""
        return 4


@refuses_by_name
def solve_crossed_beams(
    crossings: Sequence[Crossing],
    beams: tuple[Beam, Beam],
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    sigma_mm: float | None = None,
    beams_may_have_moved: bool = False,
    shaft: ShaftSeen | None = None,
    step_mm: float | None = None,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> BeamsResult:
    """Return the offset of a tip that moved through two crossed beams.

    Args:
        crossings: Travels through both beams, best in both directions.
        beams: Where the beams are, from :func:`find_beams` with a reference pin; what is
            uncertain about them goes into the interval.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        height: Z of the tip, for a flange that leans; without it that of ``stored`` counts. Where
            no shaft is given, Z of the place at which the beams see the needle.
        sigma_mm: Standard deviation of one crossing's middle, across the beam.
        beams_may_have_moved: Take only the directions of the beams as known. Needs crossings
            at two angles of U, best half a turn apart; the offset is then absolute.
        shaft: Crossings of the shaft, which show how the needle leans: what was seen is corrected
            for it. The error of the tip's height, or 0.6 mm where nobody knows it, then reaches X
            and Y by the lean.
        step_mm: How finely the place of an edge is told. Crossings that repeat each other fall on
            the same steps, so it counts in full however many there are.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``insufficient_rotation``, ``parallel_beams``,
            ``no_crossing``, ``turned_in_crossing``, ``implausible_offset``, ``tool_pose``,
            ``local_pose``, ``tilted_pose``, and those of ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Beam, Crossing, solve_crossed_beams
        >>> beams = Beam(300, 80, 0), Beam(300, 80, 90)
        >>> crossings = [
        ...     Crossing(0, Pose(288, 83.0, -60, 0), Pose(288, 84.0, -60, 0)),
        ...     Crossing(0, Pose(288, 84.0, -60, 0), Pose(288, 83.0, -60, 0)),
        ...     Crossing(1, Pose(287.5, 83.5, -60, 0), Pose(288.5, 83.5, -60, 0)),
        ...     Crossing(1, Pose(288.5, 83.5, -60, 0), Pose(287.5, 83.5, -60, 0)),
        ... ]
        >>> found = solve_crossed_beams(crossings, beams)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.0, -3.5)
    """
    warnings = check_crossings(crossings, minimum=1)
    require_flange_in_base([crossing.entry for crossing in crossings])
    require_crossed(beams)
    if beams_may_have_moved:
        _require_turned(crossings)
    if shaft is not None:
        check_crossings(shaft.crossings, minimum=2)
        require_flange_in_base([crossing.entry for crossing in shaft.crossings])
    two_ways = _two_ways(crossings, beams)
    if not all(two_ways):
        warnings = (*warnings, "one_direction")
    height = height_of(stored, height)
    system = _System.of(crossings, beams, two_ways, moved=beams_may_have_moved, shaft=shaft)
    a, b, per_height = system.equations(height)
    fit = linear_fit(a, b) if len(a) >= a.shape[1] else None
    if fit is None or fit.rank < a.shape[1]:
        raise _too_few(len(a))
    lags = fit.x[2 : 2 + sum(two_ways)].tolist()
    result = BeamsResult(
        method="beams",
        **components(stored, x_mm=float(fit.x[0]), y_mm=float(fit.x[1])),
        reference_point_mm=where_they_cross(beams),
        sigma_gain=_gain(fit),
        warnings=warnings,
        inputs=tuple(crossing.entry for crossing in crossings),
        residuals_mm=_vectors(fit.residuals[: len(crossings)], crossings, beams),
        condition_number=fit.condition_number,
        rank=fit.rank,
        sources=()
        if beams_may_have_moved
        else (ErrorSource.of_lengths("place_mm", 2, turning="in_base"),),
        lag_mm=(
            lags.pop(0) if two_ways[0] else None,
            lags.pop(0) if two_ways[1] else None,
        ),
        moved_mm=tuple(fit.x[system.moved].tolist()),
        step_mm=step_mm,
    )
    # The crossings of the shaft add unknowns used only by them, so they check no other crossing,
    # unless both have their lags in common.
    own = system.width - system.lean.start if shaft and not system.one_lag else 0
    checked = len(crossings) if not system.one_lag else len(a)
    result = judged(
        result,
        fit.residuals[:checked, None],
        fit.unit_covariance[:2, :2],
        unknowns=a.shape[1] - own,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
        grid_mm=None if step_mm is None else _middles_step_mm(crossings, beams, step_mm),
    )
    by_height = linear_fit(a, per_height).x[:2].tolist()
    result = with_height_error(result, (by_height[0], by_height[1]), height)
    if shaft is not None:
        result = _leaning(result, fit, system.lean, shaft, height)
    alone = tuple(math.sqrt(row[index]) for index, row in enumerate(result.covariance))
    result = replace(result, u_without_beams_mm=alone)
    return with_station(result, beams_part(a, system.crossings, beams, result.offset))


def _leaning(
    result: BeamsResult,
    fit: LinearFit,
    columns: slice,
    shaft: ShaftSeen,
    height: TipHeight | None,
) -> BeamsResult:
    """Return a result with the needle's lean, and the effect of an unknown length."""
    x, y = fit.x[columns].tolist()
    variance = (result.sigma_mm or 0.0) ** 2
    spread = (fit.unit_covariance[columns, columns] * variance).tolist()
    lean = Lean(x, y, shaft.above_mm, lean_exceeds(x, y, spread))
    notes = (*result.notes, "needle_leans") if lean.sure else result.notes
    result = replace(result, lean=lean, notes=notes)
    return with_unknown_length(result, lean, None if height is None else height.sigma_mm)


def _middles_step_mm(
    crossings: Sequence[Crossing], beams: tuple[Beam, Beam], step_mm: float
) -> float:
    """Return the step of a crossing's middle that does for all of them as if each had its own.

    Crossings of one beam in one direction at one U are all rounded alike. So may be both edges of
    one, for the way to the second begins where the step put the first. And what one direction
    rounds up the other rounds down, for both begin equally far from the expected place: the error
    of a tip is that of a single edge.
    """
    alike = Counter(
        (c.beam, c.direction_over(beams[c.beam]), round(c.entry.u_deg, 3)) for c in crossings
    )
    return step_mm * math.sqrt(2 * min(alike.values()))


def crossing_sigma_gain(
    crossings: Sequence[Crossing],
    beams: tuple[Beam, Beam],
    *,
    beams_may_have_moved: bool = False,
    shaft: ShaftSeen | None = None,
) -> float:
    """Return the standard deviation of X or Y, the larger, as a multiple of one crossing's.

    Only the directions and angles of the crossings count; see :func:`solve_crossed_beams`.

    Args:
        crossings: The crossings that are planned; where they are does not count.
        beams: Where the beams are.
        beams_may_have_moved: As for :func:`solve_crossed_beams`.
        shaft: Likewise.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Beam, Crossing, crossing_sigma_gain
        >>> beams = Beam(300, 80, 0), Beam(300, 80, 90)
        >>> once = [
        ...     Crossing(0, Pose(288, 83.0, -60, 0), Pose(288, 84.0, -60, 0)),
        ...     Crossing(1, Pose(287.5, 83.5, -60, 0), Pose(288.5, 83.5, -60, 0)),
        ... ]
        >>> round(crossing_sigma_gain(once, beams), 3)
        1.0
        >>> round(crossing_sigma_gain(once * 4, beams), 3)
        0.5
    """
    two_ways = _two_ways(crossings, beams)
    system = _System.of(crossings, beams, two_ways, moved=beams_may_have_moved, shaft=shaft)
    # Any height gives the same gain, because the gain does not depend on the right-hand side.
    a, b, _ = system.equations(TipHeight(0.0))
    return _gain(linear_fit(a, b))


def _gain(fit: LinearFit) -> float:
    return math.sqrt(float(fit.unit_covariance.diagonal()[:2].max()))


def _two_ways(crossings: Sequence[Crossing], beams: tuple[Beam, Beam]) -> tuple[bool, bool]:
    driven = {(c.beam, c.direction_over(beams[c.beam])) for c in crossings}
    return ({(0, 1.0), (0, -1.0)} <= driven, {(1, 1.0), (1, -1.0)} <= driven)


@dataclass(frozen=True, slots=True)
class _System:
    """One equation a crossing: n (middle + A (t + l h) + c (t_z + h)) + direction lag = distance.

    Columns: t (2), a lag for each beam driven both ways; with ``moved`` by how far each beam lies
    from where it was; with a shaft its lean l (2), and lags of its own. Where nothing else checks
    the crossings of the tip, those of the shaft do, by lags in common: as both are driven both
    ways, neither t nor l depends on that, and a lag that differs widens the interval.

    Attributes:
        crossings: Those of the tip, then those of the shaft.
        beams: Where the beams are.
        above_mm: h of each, how far above its end the needle was seen; 0 without a shaft.
        lag_columns: Of each crossing, ``None`` for none.
        moved, lean: Which columns they are.
        width: How many columns there are.
    """

    crossings: tuple[Crossing, ...]
    beams: tuple[Beam, Beam]
    above_mm: tuple[float, ...]
    lag_columns: tuple[int | None, ...]
    moved: slice
    lean: slice
    width: int
    one_lag: bool = False

    @classmethod
    def of(
        cls,
        crossings: Sequence[Crossing],
        beams: tuple[Beam, Beam],
        two_ways: tuple[bool, bool],
        *,
        moved: bool,
        shaft: ShaftSeen | None,
    ) -> "_System":
        """Return that of some crossings; the arguments as in :func:`solve_crossed_beams`."""
        start = 2 + sum(two_ways)
        own = {beam: 2 + sum(two_ways[:beam]) for beam in (0, 1) if two_ways[beam]}
        lags = [own.get(crossing.beam) for crossing in crossings]
        lean = start + (2 if moved else 0)
        everything, above, width = list(crossings), [0.0] * len(crossings), lean
        one_lag = False
        if shaft is not None:
            both = _two_ways(shaft.crossings, beams)
            one_lag = len(crossings) == lean and all(both) and all(two_ways)
            width += 2
            if not one_lag:
                width += sum(both)
                own = {beam: lean + 2 + sum(both[:beam]) for beam in (0, 1) if both[beam]}
            lags += [own.get(crossing.beam) for crossing in shaft.crossings]
            everything += shaft.crossings
            above = [shaft.above_mm] * len(crossings)
            above += [shaft.above_mm + shaft.deeper_mm] * len(shaft.crossings)
        return cls(
            tuple(everything),
            beams,
            tuple(above),
            tuple(lags),
            moved=slice(start, lean),
            lean=slice(lean, lean + (0 if shaft is None else 2)),
            width=width,
            one_lag=one_lag,
        )

    def equations(self, height: TipHeight | None) -> tuple[Floats, Floats, Floats]:
        """Return matrix, right side, and by how much the latter changes for 1 mm of t_z."""
        count = len(self.crossings)
        planes = solvable_planes([crossing.entry for crossing in self.crossings], height)
        a, b, per_height = np.zeros((count, self.width)), np.zeros(count), np.zeros(count)
        for row, crossing in enumerate(self.crossings):
            beam, plane, above_mm = self.beams[crossing.beam], planes[row], self.above_mm[row]
            nx, ny = beam.normal
            (xx, yx), (xy, yy) = plane.columns
            across = nx * xx + ny * yx, nx * xy + ny * yy
            a[row, :2] = across
            per_height[row] = -nx * plane.axis[0] - ny * plane.axis[1]
            lag = self.lag_columns[row]
            if lag is not None:
                a[row, lag] = -crossing.across(beam)
            if self.moved.stop > self.moved.start:
                a[row, self.moved.start + crossing.beam] = -1.0
            if self.lean.stop > self.lean.start:
                a[row, self.lean] = across[0] * above_mm, across[1] * above_mm
            x, y = crossing.middle_mm
            z_mm = known_z_mm(height) + math.copysign(above_mm, plane.r33)
            b[row] = beam.distance_mm - nx * x - ny * y + per_height[row] * z_mm
        return a, b, per_height


def _vectors(
    misses: Floats, crossings: Sequence[Crossing], beams: tuple[Beam, Beam]
) -> tuple[tuple[float, ...], ...]:
    normals = [beams[crossing.beam].normal for crossing in crossings]
    return tuple(
        (-miss * nx, -miss * ny) for miss, (nx, ny) in zip(misses.tolist(), normals, strict=True)
    )


def where_they_cross(beams: tuple[Beam, Beam]) -> tuple[float, float]:
    """Return X and Y of the point where two beams cross, base, mm."""
    normals = np.array([beam.normal for beam in beams])
    x, y = np.linalg.solve(normals, [beam.distance_mm for beam in beams]).tolist()
    return x, y


def moved_beams(beams: tuple[Beam, Beam], moved_mm: Sequence[float]) -> tuple[Beam, Beam]:
    """Return beams at the places where :func:`solve_crossed_beams` found them.

    Args:
        beams: Where they were learnt.
        moved_mm: By how far each lies from there, along its normal; empty for nothing.
    """
    if not moved_mm:
        return beams
    first, second = (
        replace(
            beam, x_mm=beam.x_mm + beam.normal[0] * by_mm, y_mm=beam.y_mm + beam.normal[1] * by_mm
        )
        for beam, by_mm in zip(beams, moved_mm, strict=True)
    )
    return first, second


def _too_few(count: int) -> CalibrationError:
    return CalibrationError(
        "too_few_poses",
        tr("{count} crossings are too few.", count=count),
        remedy=tr("Cross each beam in both directions, at each angle of U."),
    )


def _require_turned(crossings: Sequence[Crossing]) -> None:
    headings_deg = [FlangePlane.of(crossing.entry).heading_deg for crossing in crossings]
    spread_deg = angle_spread_deg(headings_deg)
    if spread_deg < MIN_ROTATION_DEG:
        raise CalibrationError(
            "insufficient_rotation",
            tr("All crossings have nearly the same U: a moved beam looks like a moved tip."),
            remedy=tr("Cross the beams again with the tool turned by 180 degrees."),
        )
