"""A tip that touches a plane, upright and tilted: X, Y and Z, the plane, and the test.

The first three touches are made in one orientation and tell how the plane lies. Then the tilts are
chosen that tell most about the tip, and touched at places round the first one.

What a plane shows of a tip is ``n R``: turning about the plane's own normal shows nothing. So which
tilts are good depends on how the plane lies, and a tip may not be told at all: on a level plane
with a robot that leans about one axis of its flange only.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from robolink.calibration import (
    Floats,
    PlaneTouchResult,
    TouchedPlane,
    VerifyResult,
    linear_fit,
    plane_columns,
    rotation_of,
    solve_plane_touch,
    tilted_from,
    tip_is_told,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.tilts import UPRIGHT, OverPin, Tilt, free_tilts, tip_place
from robolink.methods.surface_touch.drive import (
    FAINT,
    SIX,
    TURNED_DEG,
    SurfaceDrive,
    SurfaceKind,
    SurfaceSampler,
    SurfaceSpot,
    candidates,
    doubts_with_each,
    in_turn,
    places_of,
    proving_spots,
    verify_on_surface,
)
from robolink.methods.surface_touch.survey import PlaneSurvey, Vector
from robolink.model import Pose, ToolOffset
from robolink.procedures.tilt_proof import TiltingProof
from robolink.runner import Procedure

_LEAST_ALTITUDE = 0.3
"""Smallest altitude of a triangle, as a share of its longest side: 0.87 if all sides are equal."""


def normal_of(places_mm: Sequence[Vector]) -> Vector:
    """Return the unit normal of the plane through three places, upward.

    Touches in one orientation put it right however wrong the tip is: it shifts all places alike.

    Raises:
        CalibrationError: ``rank_deficient``: the places lie nearly in one line.
    """
    a, b, c = (np.array(place) for place in places_mm)
    across = np.cross(b - a, c - a)
    longest_mm = max(float(np.linalg.norm(side)) for side in (b - a, c - a, c - b))
    if np.linalg.norm(across) < _LEAST_ALTITUDE * longest_mm**2:
        raise CalibrationError(
            "rank_deficient",
            tr(
                "The first three touches are nearly in one line, so how the plane is "
                "tilted is unknown."
            ),
            remedy=tr("Nothing was written. Jog straight onto the surface, or put it flatter."),
        )
    x, y, z = (across / np.linalg.norm(across) * math.copysign(1.0, across[2])).tolist()
    return x, y, z


def require_lean(normal: Vector, survey: PlaneSurvey) -> None:
    """Refuse a plane that leans more than the clearance of the robot allowed for.

    Raises:
        CalibrationError: ``surface_leans``.
    """
    lean_deg = math.degrees(math.acos(min(1.0, normal[2])))
    if lean_deg <= survey.most_lean_deg:
        return
    raise CalibrationError(
        "surface_leans",
        tr(
            "The plane leans by {lean:.1f} degrees, limit {most:g}.",
            lean=lean_deg,
            most=survey.most_lean_deg,
        ),
        remedy=tr("Nothing was written. Put it flatter, or check that all touches were on it."),
    )


def on_plane(first_mm: Vector, normal: Vector, beside_mm: tuple[float, float]) -> Vector:
    """Return the place of a plane that is so far beside the first one, counted level."""
    dx_mm, dy_mm = beside_mm
    rise_mm = -(normal[0] * dx_mm + normal[1] * dy_mm) / normal[2]
    return first_mm[0] + dx_mm, first_mm[1] + dy_mm, first_mm[2] + rise_mm


def informative_spots(
    drive: SurfaceDrive,
    uprights: Sequence[SurfaceSpot],
    survey: PlaneSurvey,
    choice: Sequence[Tilt],
    guess: ToolOffset,
) -> tuple[tuple[SurfaceSpot, ...], Floats]:
    """Return the spots of all touches in their order, and the derivatives at them.

    Each further touch is the one with which the tip would be known best.

    Args:
        drive: Tells the pose of a spot.
        uprights: The spots that were touched already.
        survey: How many there are to be, and where.
        choice: The tilts that may be taken.
        guess: About where the tip is.
    """
    first, leans = uprights[0], _leans(drive, uprights[0], choice)
    upright = _leans(drive, first, [first.tilt])[0]
    normal = FAINT * np.eye(SIX)
    for number in range(len(uprights)):
        row = _row(upright, survey, number)
        normal = normal + np.outer(row, row)
    further = []
    for number in range(len(uprights), survey.count):
        rows = np.array([_row(lean, survey, number) for lean in leans])
        best = int(doubts_with_each(normal, rows).argmin())
        normal = normal + np.outer(rows[best], rows[best])
        place = on_plane(first.place_mm, first.normal, survey.beside_mm(number))
        further.append(SurfaceSpot(choice[best], place, first.normal))
    spots = (*uprights, *in_turn(further))
    poses = [drive.pose(spot) for spot in spots]
    return spots, plane_columns(poses, guess, first.normal)


def _leans(drive: SurfaceDrive, spot: SurfaceSpot, tilts: Sequence[Tilt]) -> Floats:
    """Return the plane's normal in the flange in each tilt, one a row."""
    turned = [rotation_of(drive.pose(replace(spot, tilt=tilt))) for tilt in tilts]
    leans: Floats = np.array(turned).transpose(0, 2, 1) @ np.array(spot.normal)
    return leans


def _row(lean: Floats, survey: PlaneSurvey, number: int) -> Floats:
    """Return the derivatives at one touch: the tip, the plane's lean, its distance."""
    beside = np.array(survey.beside_mm(number)) / survey.spread_mm
    return np.concatenate((lean, beside, [-1.0]))


def require_observable(columns: Floats) -> None:
    """Refuse a plan whose touches could not determine the tip, before any of them is made.

    Args:
        columns: The derivatives at all spots.

    Raises:
        CalibrationError: ``rank_deficient`` or ``insufficient_rotation``.
    """
    fit = linear_fit(columns, np.zeros(len(columns)))
    if tip_is_told(fit, SIX):
        return
    variances = fit.unit_covariance.diagonal()[:3]
    # The columns have very different lengths: only unscaled ones show which of X, Y and Z is weak.
    weak = "XYZ"[int(np.abs(np.linalg.svd(columns)[2][-1][:3]).argmax())]
    if np.isfinite(variances).all():
        weak = "XYZ"[int(variances.argmax())]
    raise CalibrationError(
        "rank_deficient" if fit.rank < SIX else "insufficient_rotation",
        tr(
            "Touches of a plane at this angle cannot show where the tip is along {axis} of the "
            "flange.",
            axis=weak,
        ),
        remedy=tr("Nothing was written. Tilt the plane 15 to 30 degrees, or touch a sphere."),
    )


_LEVEL: Vector = (0.0, 0.0, 1.0)


class _PlaneSampler(SurfaceSampler[PlaneSurvey, PlaneTouchResult]):
    """Touches of a plane."""

    def solve(self, taken: Sequence[Pose]) -> PlaneTouchResult:
        return solve_plane_touch(taken, stored=self.stored, sigma_mm=self.sigma_mm)

    def derivatives(self, poses: Sequence[Pose]) -> Floats:
        return plane_columns(poses, self.stored, self._normal())

    def normal_at(self, place_mm: Vector) -> Vector:  # noqa: ARG002 - a plane has one normal
        return self._normal()

    def aligned(self, spot: SurfaceSpot) -> SurfaceSpot:
        first, normal = self.upright_places()[0], self._normal()
        beside_mm = spot.place_mm[0] - first[0], spot.place_mm[1] - first[1]
        return replace(spot, place_mm=on_plane(first, normal, beside_mm), normal=normal)

    def require_made(self, result: PlaneTouchResult) -> None:
        plane, taken = result.plane, self.touches.taken
        columns = plane_columns(taken, result.offset, plane.normal)
        places: Floats = np.array(places_of(taken, result.offset))
        misses_mm = places @ plane.normal - plane.distance_mm
        self.touches.require_made(columns, _upward(misses_mm, plane.normal))

    def _upright(self, place: int) -> tuple[SurfaceSpot, float]:
        # As if nothing were known yet: the touch being repeated may be the one that the others
        # contradict.
        at = on_plane(self.upright_places()[0], _LEVEL, self.survey.beside_mm(place))
        return SurfaceSpot(UPRIGHT, at, _LEVEL), self.survey.rise_mm

    def _laid_out(self) -> Procedure[tuple[SurfaceSpot, ...]]:
        survey, plan, normal = self.survey, self.touches.plan, self._normal()
        uprights = [SurfaceSpot(UPRIGHT, place, normal) for place in self.upright_places()]
        tilts = candidates(survey.tilt_deg, self.axes)
        choice = yield from free_tilts(self.over, tilts, plan.lift_mm)
        spots, columns = informative_spots(self.drive, uprights, survey, choice, self.stored)
        if not plan.nominal:
            require_observable(columns)
        return spots

    def _normal(self) -> Vector:
        """Return the plane's orientation by the upright touches.

        Raises:
            CalibrationError: ``rank_deficient`` or ``surface_leans``.
        """
        if self.touches.plan.nominal:
            return _LEVEL
        normal = normal_of(self.upright_places())
        require_lean(normal, self.survey)
        return normal


def _upward(misses_mm: Floats, normal: Vector) -> Floats:
    """Return distances from a plane counted upward; its normal may point either way."""
    return misses_mm if normal[2] > 0 else -misses_mm


def _under(here: Pose, tip: ToolOffset, plane: TouchedPlane) -> tuple[Vector, Vector]:
    """Return the upward normal of the plane, and its place straight below the tip."""
    sign = 1.0 if plane.normal[2] > 0 else -1.0
    nx, ny, nz = (sign * part for part in plane.normal)
    x, y, z = tip_place(here, tip)
    above_mm = x * nx + y * ny + z * nz - sign * plane.distance_mm
    return (nx, ny, nz), (x, y, z - above_mm / nz)


def _first_touch() -> str:
    """Return the first request to the person, before anything is known of the plane."""
    return tr("Jog the tip onto the surface.")


PLANE: Final = SurfaceKind(_PlaneSampler, _first_touch)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaneTest(TiltingProof):
    """All that the test on a plane needs.

    Attributes:
        plane: The plane as the measurement found it.
        tilt_deg: How far the tool leans.
        axes: How many axes the robot has, 0 where nobody knows.
    """

    method: ClassVar[str] = "plane-touch"

    plane: TouchedPlane
    tilt_deg: float
    axes: int

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from over the plane, lifted and upright.

        They touch it below where the tip is, in tilts that were not measured in.
        """
        tip = tilted_from(self.written, self.tip)
        normal, foot = _under(here, tip, self.plane)
        over = OverPin(here, foot, tip=tip, frame=self.written)
        choice = candidates(self.tilt_deg, self.axes, turned_deg=TURNED_DEG)
        tilts = yield from free_tilts(over, choice, self.touch.lift_mm)
        spots = proving_spots(over, [SurfaceSpot(tilt, foot, normal) for tilt in tilts])
        return (
            yield from verify_on_surface(
                self.touch,
                over=over,
                spots=spots,
                tolerance_mm=self.tolerance_mm,
                u_mm=self.u_mm,
            )
        )

    def _first(self) -> tuple[str, str]:
        return PLANE.asked(), tr("Lifting off the surface.")

    def _apart_mm(self, found: Pose) -> Vector:
        (place,) = places_of([found], tilted_from(self.written, self.tip))
        normal = np.array(self.plane.normal)
        away_mm = float(np.array(place) @ normal) - self.plane.distance_mm
        x_mm, y_mm, z_mm = (away_mm * normal).tolist()
        return x_mm, y_mm, z_mm
