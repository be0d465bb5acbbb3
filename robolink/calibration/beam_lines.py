"""Two crossed light beams: their places, found with a pin, and what one crossing shows.

A beam is a line in the base. The tip breaks it on entering and frees it on leaving; half way
between, its middle is on the line, whatever its thickness and the beam's. Latency and
backlash shift that middle along the travel, one way going and the other way coming back, so
they are an unknown of their own that both directions show (docs/reference/calibration.md 2.6).

A needle that leans, as two light beams see it at two heights.

The tip dips below the beams, so they see the shaft above it. Of a shaft that leans by l, X and Y of
the flange per mm above the tip, they see t + l h at a height h above the end, and once the tip is
deeper t + l (h + s): so l, and the tip itself

    t = seen + (seen - deeper) h / s

are known together, and the end is less sure than what was seen: with h = 1.5 and s = 3 by 1.6
(docs/reference/evidence.md 12).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from robolink.calibration.core.accuracy import BudgetRow
from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import check_poses, refuses_by_name
from robolink.calibration.core.statistics import NORMAL_95, chi_square_quantile
from robolink.calibration.flange_plane import FlangePlane, require_flange_in_base, solvable_planes
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, angle_difference_deg

if TYPE_CHECKING:
    from robolink.calibration.core.result import CalibrationResult


LEAST_ANGLE_DEG = 20.0
"""Smallest angle between two beams; below it, one direction is poorly determined."""

LEAST_LENGTH_MM = 5.0

_ALONG_THE_BEAM = 0.2

_REFINEMENTS = 5


@dataclass(frozen=True, slots=True)
class Beam:
    """A light beam: a point on it, its direction in the base, and the uncertainty of both.

    Attributes:
        x_mm, y_mm: A point on it, base: the one at which its distance is stated.
        direction_deg: Its direction, counter-clockwise from X.
        sigma_mm: Standard deviation of its distance there, across it.
        direction_sigma_deg: Standard deviation of its direction.
        correlation: Between the two, -1 to 1; a shift to the left of the beam and a turn
            counter-clockwise count as positive.
        dof: Degrees of freedom of both deviations, ``None`` where they were stated.
    """

    x_mm: float
    y_mm: float
    direction_deg: float
    sigma_mm: float = 0.0
    direction_sigma_deg: float = 0.0
    correlation: float = 0.0
    dof: int | None = None

    @property
    def covariance(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Covariance of distance, mm, and direction, radians."""
        turn = math.radians(self.direction_sigma_deg)
        both = self.correlation * self.sigma_mm * turn
        return (self.sigma_mm**2, both), (both, turn**2)

    def along_mm(self, x_mm: float, y_mm: float) -> float:
        """Return how far along the beam a place is from where its distance is stated."""
        angle = math.radians(self.direction_deg)
        return (x_mm - self.x_mm) * math.cos(angle) + (y_mm - self.y_mm) * math.sin(angle)

    @property
    def normal(self) -> tuple[float, float]:
        """Unit vector across the beam."""
        angle = math.radians(self.direction_deg)
        return -math.sin(angle), math.cos(angle)

    @property
    def distance_mm(self) -> float:
        """Distance of the beam from the base's origin, along :attr:`normal`."""
        nx, ny = self.normal
        return nx * self.x_mm + ny * self.y_mm


@dataclass(frozen=True, slots=True)
class Crossing:
    """One straight travel of the tip through a beam, without turning.

    Attributes:
        beam: Which beam, 0 or 1.
        entry: Flange pose (Tool 0) at which the beam was broken.
        exit: Flange pose at which it was free again.
    """

    beam: int
    entry: Pose
    exit: Pose

    @property
    def middle_mm(self) -> tuple[float, float]:
        """Flange position half way."""
        return (self.entry.x_mm + self.exit.x_mm) / 2, (self.entry.y_mm + self.exit.y_mm) / 2

    def direction_over(self, beam: Beam) -> float:
        """Return 1 or -1: to which side of ``beam`` the travel led.

        Raises:
            CalibrationError: ``no_crossing`` when it ran along the beam.
        """
        return math.copysign(1.0, self.across(beam))

    def across(self, beam: Beam) -> float:
        """Return by how much the travel led across ``beam``, in mm per mm, to its left above 0.

        What shifts a crossing along its travel shifts it by this share across the beam.

        Raises:
            CalibrationError: ``no_crossing`` when it ran along the beam.
        """
        nx, ny = beam.normal
        dx, dy = self.exit.x_mm - self.entry.x_mm, self.exit.y_mm - self.entry.y_mm
        way_mm = math.hypot(dx, dy)
        across_mm = nx * dx + ny * dy
        if abs(across_mm) <= _ALONG_THE_BEAM * way_mm:
            raise CalibrationError(
                "no_crossing",
                tr("One pass went along beam {beam} instead of across it.", beam=self.beam + 1),
                remedy=tr("Drive the tip straight across each beam."),
            )
        return across_mm / way_mm


@refuses_by_name
def find_beams(
    crossings: Sequence[Crossing],
    tip_mm: tuple[float, float],
    *,
    tip_sigma_mm: float = 0.0,
    sigma_mm: float | None = None,
) -> tuple[Beam, Beam]:
    """Return both beams and their uncertainty, from a reference pin whose tip is known.

    Args:
        crossings: Travels of the pin through both beams at several places along each, four
            or more, in both directions.
        tip_mm: The pin's offset in the flange's axes.
        tip_sigma_mm: Standard deviation of each of its coordinates. It shifts all crossings
            alike, so it is added to that of the distance and shows in no residual.
        sigma_mm: Standard deviation of one crossing's middle, across the beam; else the residuals
            of both beams tell it together.

    Covariance of (distance, direction): s^2 (A'A)^-1 of the straight line, at the middle of its
    crossings (docs/reference/evidence.md 12).

    Raises:
        CalibrationError: ``too_few_poses``, ``short_beam``, ``parallel_beams``,
            ``no_crossing``, ``tool_pose``, ``local_pose``, ``tilted_pose``, or those of
            :func:`check_crossings`.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Crossing, find_beams
        >>> def passed(beam, x_mm, y_mm, dx_mm, dy_mm):  # by a tip at 12, -3.5 of the flange
        ...     entry = Pose(x_mm - dx_mm - 12, y_mm - dy_mm + 3.5, -60, 0)
        ...     return Crossing(beam, entry, Pose(x_mm + dx_mm - 12, y_mm + dy_mm + 3.5, -60, 0))
        >>> along_x = [passed(0, 300 + at, 80, 0, way) for at in (-8, 8) for way in (0.5, -0.5)]
        >>> along_y = [passed(1, 300, 80 + at, way, 0) for at in (-8, 8) for way in (0.5, -0.5)]
        >>> first, second = find_beams([*along_x, *along_y], (12, -3.5))
        >>> round(first.y_mm, 3), round(second.x_mm, 3)
        (80.0, 300.0)
    """
    check_crossings(crossings, minimum=4)
    entries = [crossing.entry for crossing in crossings]
    require_flange_in_base(entries)
    solvable_planes(entries, None)
    first, second = (
        _fit_beam([crossing for crossing in crossings if crossing.beam == beam], tip_mm)
        for beam in (0, 1)
    )
    require_crossed((first.beam, second.beam))
    total = first.sum_of_squares + second.sum_of_squares
    dof = first.dof + second.dof
    scatter = Dispersion.of(total, dof, sigma_mm)
    spread = scatter.sigma_mm if scatter else 0.0
    known = None if scatter is None or scatter.source != "residuals" else dof
    return first.with_spread(spread, known, tip_sigma_mm), second.with_spread(
        spread, known, tip_sigma_mm
    )


def check_crossings(crossings: Sequence[Crossing], *, minimum: int) -> tuple[str, ...]:
    """Refuse crossings that cannot be used; return the names of lesser doubts.

    Raises:
        CalibrationError: ``too_few_poses``, ``turned_in_crossing``, and those of
            ``pose_checks.check_poses``.
    """
    for beam in (0, 1):
        count = sum(crossing.beam == beam for crossing in crossings)
        if count < minimum:
            raise CalibrationError(
                "too_few_poses",
                tr("Beam {beam} was crossed {count} times.", beam=beam + 1, count=count),
                remedy=tr("Cross each beam {minimum} times or more.", minimum=minimum),
            )
    poses = [pose for crossing in crossings for pose in (crossing.entry, crossing.exit)]
    # A turn test may let a known tip, already stored in the controller, cross the beams.
    doubts = check_poses(poses, allow_mixed_hand=False, of_one_tip=True)
    for crossing in crossings:
        angles = zip(crossing.exit.coordinates()[3:], crossing.entry.coordinates()[3:], strict=True)
        if any(abs(angle_difference_deg(after, before)) > 0.01 for after, before in angles):
            raise CalibrationError(
                "turned_in_crossing",
                tr("The tool turned while it crossed beam {beam}.", beam=crossing.beam + 1),
                remedy=tr("Keep U while the tip crosses a beam."),
            )
    return doubts


def require_crossed(beams: tuple[Beam, Beam]) -> None:
    """Refuse beams that are nearly parallel.

    Raises:
        CalibrationError: ``parallel_beams``.
    """
    between = abs(angle_difference_deg(beams[0].direction_deg, beams[1].direction_deg))
    angle = min(between, 180.0 - between)
    if angle < LEAST_ANGLE_DEG:
        raise CalibrationError(
            "parallel_beams",
            tr("The beams cross at {angle:.1f} degrees.", angle=angle),
            remedy=tr("Mount them at a right angle, or nearly so."),
        )


@dataclass(frozen=True, slots=True)
class _BeamFit:
    """A beam, with the residuals of its fit."""

    beam: Beam
    unit_covariance: Floats
    sum_of_squares: float
    dof: int

    def with_spread(self, sigma_mm: float, dof: int | None, tip_sigma_mm: float) -> Beam:
        """Return the beam with its uncertainty for crossings of standard deviation ``sigma_mm``."""
        (turn, both), (_, shift) = (self.unit_covariance * sigma_mm**2).tolist()
        distance = math.sqrt(shift + tip_sigma_mm**2)
        spread = distance * math.sqrt(turn)
        return replace(
            self.beam,
            sigma_mm=distance,
            direction_sigma_deg=math.degrees(math.sqrt(turn)),
            correlation=both / spread if spread else 0.0,
            dof=dof,
        )


def _fit_beam(crossings: Sequence[Crossing], tip_mm: tuple[float, float]) -> _BeamFit:
    points = np.array([_tip_at(crossing, tip_mm) for crossing in crossings])
    middle = points.mean(axis=0)
    beam = _first_line(points, middle)
    for _ in range(_REFINEMENTS):
        beam, fit = _straightened(beam, points, [c.direction_over(beam) for c in crossings])
    rest = float(fit.residuals @ fit.residuals)
    return _BeamFit(beam, fit.unit_covariance[:2, :2], rest, len(points) - len(fit.x))


def _first_line(points: Floats, middle: Floats) -> Beam:
    _, spread, axes = np.linalg.svd(points - middle)
    if 2 * spread[0] / math.sqrt(len(points)) < LEAST_LENGTH_MM:
        raise CalibrationError(
            "short_beam",
            tr("The crossings lie too close together along the beam to find its direction."),
            remedy=tr("Spread them over {least:.0f} mm or more.", least=2 * LEAST_LENGTH_MM),
        )
    x, y = middle.tolist()
    return Beam(x, y, math.degrees(math.atan2(axes[0, 1], axes[0, 0])))


def _straightened(
    beam: Beam, points: Floats, directions: Sequence[float]
) -> tuple[Beam, LinearFit]:
    """Return the beam after one fit of its tilt, its place and the shift by the travel."""
    nx, ny = beam.normal
    away = points - (beam.x_mm, beam.y_mm)
    along, across = away @ (ny, -nx), away @ (nx, ny)
    columns = [along, np.ones(len(points))]
    if len(set(directions)) == 2:
        columns.append(np.array(directions))
    fit = linear_fit(np.column_stack(columns), across)
    tilt, shift = fit.x[:2].tolist()
    direction = beam.direction_deg + math.degrees(math.atan(tilt))
    return Beam(beam.x_mm + shift * nx, beam.y_mm + shift * ny, direction), fit


def _tip_at(crossing: Crossing, tip_mm: tuple[float, float]) -> tuple[float, float]:
    x, y = crossing.middle_mm
    dx, dy = FlangePlane.of(crossing.entry).in_base(*tip_mm)
    return x + dx, y + dy


ResultT = TypeVar("ResultT", bound="CalibrationResult")

UNKNOWN_LENGTH_MM: Final = 0.6
"""Largest difference in length assumed between two needles if nobody measured Z: equal to the usual
sideways difference of two tips. The end of a needle that leans by a degree then shifts by 0.01 mm.
"""

_SIGNIFICANT: Final = 0.99


@dataclass(frozen=True, slots=True)
class ShaftSeen:
    """Crossings of a needle's shaft, made at the same U as those of its tip.

    Attributes:
        crossings: Both beams both ways, with the tip deeper. They tell the lean and nothing else,
            so each needs a lag of its own: a nozzle grows thicker upward.
        above_mm: How far above its end the beams saw the needle in the crossings of the tip,
            along the flange's axis.
        deeper_mm: How much farther above in these, above 0.
    """

    crossings: Sequence[Crossing]
    above_mm: float
    deeper_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "crossings", tuple(self.crossings))


@dataclass(frozen=True, slots=True)
class Lean:
    """How a needle leans.

    Attributes:
        x, y: By how much its shaft lies beside its tip, in mm per mm above it, flange.
        above_mm: How far above its end the beams saw it.
        sure: Whether it is more than the scatter of the crossings explains.
    """

    x: float
    y: float
    above_mm: float
    sure: bool

    @property
    def angle_deg(self) -> float:
        """How far it leans from the flange's axis."""
        return math.degrees(math.atan(math.hypot(self.x, self.y)))

    @property
    def corrected_mm(self) -> tuple[float, float]:
        """X and Y of the tip, less those of what the beams saw."""
        return -self.x * self.above_mm, -self.y * self.above_mm

    def as_json(self) -> dict[str, object]:
        """Return it as plain values."""
        return {
            "lean_deg": self.angle_deg,
            "lean_toward_deg": math.degrees(math.atan2(self.y, self.x)),
            "seen_above_tip_mm": self.above_mm,
            "corrected_mm": list(self.corrected_mm),
            "leans": self.sure,
        }


def lean_exceeds(x: float, y: float, covariance: Sequence[Sequence[float]]) -> bool:
    """Return whether a lean is more than its scatter, a 2 x 2 covariance, explains in 99 %.

    Args:
        x: Along the flange's X, mm per mm.
        y: Along its Y.
        covariance: Of both.

    Example:
        >>> from robolink.calibration.beam_lines import lean_exceeds
        >>> lean_exceeds(0.01, 0.0, [[1e-6, 0.0], [0.0, 1e-6]])
        True
    """
    (a, b), (_, d) = covariance
    area = a * d - b * b
    if area <= 0:
        return x != 0 or y != 0
    square = (d * x * x - 2 * b * x * y + a * y * y) / area
    return square > chi_square_quantile(_SIGNIFICANT, 2)


def with_unknown_length(result: ResultT, lean: Lean, sigma_mm: float | None) -> ResultT:
    """Return a result with how far the end of a leaning needle moves if it is longer.

    Args:
        result: With X and Y as its measured components.
        lean: How the needle leans.
        sigma_mm: Standard deviation of the tool's Z; without one it may be off by
            :data:`UNKNOWN_LENGTH_MM`.
    """
    if not result.half_width95:
        return result
    u_z_mm = UNKNOWN_LENGTH_MM / math.sqrt(3) if sigma_mm is None else sigma_mm
    errors = (lean.x * u_z_mm, lean.y * u_z_mm)
    rows = [list(row) for row in result.covariance]
    for i, one in enumerate(errors):
        for j, other in enumerate(errors):
            rows[i][j] += one * other
    both = math.hypot(*errors)
    halves = (
        math.hypot(half, NORMAL_95 * error)
        for half, error in zip(result.half_width95, errors, strict=True)
    )
    region_mm = result.region95_radius_mm
    row = BudgetRow(tr("length of a needle that leans"), both, origin=tr("its Z was not measured"))
    return replace(
        result,
        covariance=tuple(map(tuple, rows)),
        half_width95=tuple(halves),
        # An upper bound: the error acts in one direction, which need not be the ellipse's long
        # axis.
        region95_radius_mm=None if region_mm is None else math.hypot(region_mm, NORMAL_95 * both),
        budget=None if result.budget is None else result.budget.with_row(row),
    )
