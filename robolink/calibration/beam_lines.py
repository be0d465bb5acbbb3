"""Two crossed light beams: where they are, from a pin, and what a crossing of one tells.

A beam is a line in the base. The tip breaks it on entering and frees it on leaving; half way
between, its middle is on the line, whatever its thickness and the beam's. Latency and
backlash shift that middle along the travel, one way going and the other way coming back, so
they are an unknown of their own that both directions show (docs/reference/calibration.md 2.6).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.pose_checks import check_poses
from robolink.calibration.core.robust import Floats
from robolink.calibration.flange_checks import require_flange_in_base
from robolink.calibration.flange_plane import FlangePlane, solvable_planes
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, angle_difference_deg

LEAST_ANGLE_DEG = 20.0
"""Beams that cross at less than this leave one direction badly known."""

LEAST_LENGTH_MM = 5.0

_ALONG_THE_BEAM = 0.2

_REFINEMENTS = 5


@dataclass(frozen=True, slots=True)
class Beam:
    """A light beam: a point on it, its direction in the base, and how sure both are.

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
        nx, ny = beam.normal
        dx, dy = self.exit.x_mm - self.entry.x_mm, self.exit.y_mm - self.entry.y_mm
        across = nx * dx + ny * dy
        if abs(across) <= _ALONG_THE_BEAM * math.hypot(dx, dy):
            raise CalibrationError(
                "no_crossing",
                tr("One pass went along beam {beam} instead of across it.", beam=self.beam + 1),
                remedy=tr("Drive the tip straight across each beam."),
            )
        return math.copysign(1.0, across)


def find_beams(
    crossings: Sequence[Crossing],
    tip_mm: tuple[float, float],
    *,
    tip_sigma_mm: float = 0.0,
    sigma_mm: float | None = None,
) -> tuple[Beam, Beam]:
    """Return where both beams are and how sure that is, from a reference pin whose tip is known.

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
    # A proof lets a tip cross that the controller already knows.
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
    """Refuse beams that run nearly side by side.

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
    """A beam, with what the fit of its line leaves over."""

    beam: Beam
    unit_covariance: Floats
    sum_of_squares: float
    dof: int

    def with_spread(self, sigma_mm: float, dof: int | None, tip_sigma_mm: float) -> Beam:
        """Return the beam and how sure it is, for crossings of standard deviation ``sigma_mm``."""
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
            tr("The crossings lie too close together along the beam to tell its direction."),
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
