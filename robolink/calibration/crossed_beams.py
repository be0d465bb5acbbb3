"""Tool offset from travels through two crossed beams.

Half way through a beam with normal n, ``n (middle + A t + c t_z) = distance``; A and c are those
of the flange, which may lean or hang upside down (docs/reference/evidence.md 3).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robolink.calibration.beam_lines import Beam, Crossing, check_crossings, require_crossed
from robolink.calibration.beam_uncertainty import beams_part
from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    angle_spread_deg,
    keep_unmeasured,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Floats
from robolink.calibration.flange_checks import require_flange_in_base, with_height_error
from robolink.calibration.flange_plane import (
    FlangePlane,
    TipHeight,
    height_of,
    known_z_mm,
    solvable_planes,
)
from robolink.calibration.quality.fit_quality import judged
from robolink.calibration.quality.station_part import with_station
from robolink.calibration.quality.tolerances import PLANAR_TOLERANCE, Tolerance
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset

_KEPT = ("z_mm", "u_deg", "v_deg", "w_deg")


@dataclass(frozen=True, slots=True, kw_only=True)
class BeamsResult(CalibrationResult):
    """A tool offset from beams.

    Attributes:
        lag_mm: For each beam, by how much latency and backlash shift a crossing along its
            travel; ``None`` where only one direction was driven.
        u_without_beams_mm: Standard uncertainty of X and of Y by the crossings alone; empty
            without an interval.
    """

    lag_mm: tuple[float | None, float | None]
    u_without_beams_mm: tuple[float, ...] = ()

    @property
    def inputs_per_look(self) -> int:
        """Both beams, both ways."""
        return 4


def solve_crossed_beams(
    crossings: Sequence[Crossing],
    beams: tuple[Beam, Beam],
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    sigma_mm: float | None = None,
    beams_may_have_moved: bool = False,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> BeamsResult:
    """Return the offset of a tip that was driven through two crossed beams.

    Args:
        crossings: Travels through both beams, best in both directions.
        beams: Where the beams are, from :func:`find_beams` with a reference pin; what is
            uncertain about them goes into the interval.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        height: Z of the tip, for a flange that leans; without it that of ``stored`` counts.
        sigma_mm: Standard deviation of one crossing's middle, across the beam.
        beams_may_have_moved: Take only the directions of the beams as known. Needs crossings
            at two angles of U, best half a turn apart; the offset is then absolute.
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
    two_ways = _two_ways(crossings, beams)
    if not all(two_ways):
        warnings = (*warnings, "one_direction")
    height = height_of(stored, height)
    a, b, per_height = _system(crossings, beams, two_ways, beams_may_have_moved, height)
    fit = linear_fit(a, b) if len(a) >= a.shape[1] else None
    if fit is None or fit.rank < a.shape[1]:
        raise _too_few(len(a))
    lags = fit.x[2 : 2 + sum(two_ways)].tolist()
    result = BeamsResult(
        method="beams",
        offset=keep_unmeasured(stored, x_mm=float(fit.x[0]), y_mm=float(fit.x[1])),
        measured=("x_mm", "y_mm"),
        kept=_KEPT,
        reference_point_mm=where_they_cross(beams),
        sigma_gain=_gain(fit),
        warnings=warnings,
        inputs=tuple(crossing.entry for crossing in crossings),
        residuals_mm=_vectors(fit.residuals, crossings, beams),
        condition_number=fit.condition_number,
        rank=fit.rank,
        unobservable=_KEPT,
        sources=()
        if beams_may_have_moved
        else (ErrorSource.of_lengths("place_mm", 2, turning="in_base"),),
        lag_mm=(
            lags.pop(0) if two_ways[0] else None,
            lags.pop(0) if two_ways[1] else None,
        ),
    )
    result = judged(
        result,
        fit.residuals[:, None],
        fit.unit_covariance[:2, :2],
        unknowns=a.shape[1],
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )
    by_height = linear_fit(a, per_height).x[:2].tolist()
    result = with_height_error(result, (by_height[0], by_height[1]), height)
    alone = tuple(math.sqrt(row[index]) for index, row in enumerate(result.covariance))
    result = replace(result, u_without_beams_mm=alone)
    return with_station(result, beams_part(a, crossings, beams, result.offset))


def crossing_sigma_gain(
    crossings: Sequence[Crossing],
    beams: tuple[Beam, Beam],
    *,
    beams_may_have_moved: bool = False,
) -> float:
    """Return the standard deviation of X or Y, the larger, as a multiple of one crossing's.

    Only the directions and angles of the crossings count; see :func:`solve_crossed_beams`.

    Args:
        crossings: The crossings that are planned; where they are does not count.
        beams: Where the beams are.
        beams_may_have_moved: As for :func:`solve_crossed_beams`.

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
    # Height 0 will do: the gain depends on no right side.
    a, b, _ = _system(
        crossings, beams, _two_ways(crossings, beams), beams_may_have_moved, TipHeight(0.0)
    )
    return _gain(linear_fit(a, b))


def _gain(fit: LinearFit) -> float:
    return math.sqrt(float(fit.unit_covariance.diagonal()[:2].max()))


def _two_ways(crossings: Sequence[Crossing], beams: tuple[Beam, Beam]) -> tuple[bool, bool]:
    driven = {(c.beam, c.direction_over(beams[c.beam])) for c in crossings}
    return ({(0, 1.0), (0, -1.0)} <= driven, {(1, 1.0), (1, -1.0)} <= driven)


def _system(
    crossings: Sequence[Crossing],
    beams: tuple[Beam, Beam],
    two_ways: tuple[bool, bool],
    moved: bool,
    height: TipHeight | None,
) -> tuple[Floats, Floats, Floats]:
    """Return one equation a crossing: n (middle + A t + c t_z) + direction lag = distance.

    Columns: t (2), a lag for each beam driven both ways, and with ``moved`` by how far each
    beam lies from where it was. The last is by how much the right side changes for 1 mm of t_z.
    """
    planes = solvable_planes([crossing.entry for crossing in crossings], height)
    lag_column = {beam: 2 + sum(two_ways[:beam]) for beam in (0, 1) if two_ways[beam]}
    width = 2 + sum(two_ways) + (2 if moved else 0)
    a, b = np.zeros((len(crossings), width)), np.zeros(len(crossings))
    per_height = np.zeros(len(crossings))
    for row, crossing in enumerate(crossings):
        beam = beams[crossing.beam]
        nx, ny = beam.normal
        (xx, yx), (xy, yy) = planes[row].columns
        a[row, 0], a[row, 1] = nx * xx + ny * yx, nx * xy + ny * yy
        per_height[row] = -nx * planes[row].axis[0] - ny * planes[row].axis[1]
        if crossing.beam in lag_column:
            a[row, lag_column[crossing.beam]] = -crossing.direction_over(beam)
        if moved:
            a[row, width - 2 + crossing.beam] = -1.0
        x, y = crossing.middle_mm
        b[row] = beam.distance_mm - nx * x - ny * y
    return a, b + per_height * known_z_mm(height), per_height


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
