"""A tip that touches a sphere from several sides: X, Y and Z, the sphere, and the test.

The first four touches are made in one orientation and tell where the sphere is, but for the error
of the tip. Then the sides and tilts are chosen that tell most about the tip.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from robolink.calibration import (
    Floats,
    SphereTouchResult,
    VerifyResult,
    rotation_of,
    solve_sphere_touch,
    sphere_columns,
    sphere_through,
    tilted_from,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.tilts import UPRIGHT, OverPin, Tilt, free_tilts
from robolink.methods.surface_touch.drive import (
    FAINT,
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
from robolink.methods.surface_touch.survey import SphereSurvey, Vector
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    SurfaceTouches,
)
from robolink.procedures.tilt_proof import TiltingProof
from robolink.runner import Procedure

_LEAST_ALONG = 0.5
"""Cosine of the largest angle between the tool's shaft and the outward direction: beyond it the
shaft comes too close to the sphere beside the tip."""

_MOST_OFF = 0.2


def spot_on(centre_mm: Vector, radius_mm: float, tilt: Tilt, side: Vector) -> SurfaceSpot:
    """Return the spot of a sphere on one side of it."""
    x, y, z = (c + radius_mm * w for c, w in zip(centre_mm, side, strict=True))
    return SurfaceSpot(tilt, (x, y, z), side)


def sphere_of(places_mm: Sequence[Vector], survey: SphereSurvey) -> tuple[Vector, float]:
    """Return where the sphere is and its radius, from the first touches.

    Raises:
        CalibrationError: ``radius_contradicted``, or ``off_top``: the first touch was not near the
            top, so the robot cannot keep clear of the sides.
    """
    centre, radius_mm = sphere_through(np.array(places_mm))
    if abs(radius_mm / survey.radius_mm - 1) > _MOST_OFF:
        raise CalibrationError(
            "radius_contradicted",
            tr(
                "The touches fit a sphere with a radius of {found:.2f} mm; "
                "{stated:.2f} mm was stated.",
                found=radius_mm,
                stated=survey.radius_mm,
            ),
            remedy=tr("Give the radius, not the diameter, and check that all touches were made."),
        )
    x, y, z = centre.tolist()
    aside_mm = math.hypot(places_mm[0][0] - x, places_mm[0][1] - y)
    if aside_mm > survey.aside_mm:
        raise CalibrationError(
            "off_top",
            tr(
                "The first touch was {aside:.1f} mm beside the top of the sphere, "
                "limit {most:.1f} mm.",
                aside=aside_mm,
                most=survey.aside_mm,
            ),
            remedy=tr("Nothing was written. Begin nearer to the top."),
        )
    return (x, y, z), radius_mm


def reachable(
    drive: SurfaceDrive,
    centre_mm: Vector,
    radius_mm: float,
    tilts: Sequence[Tilt],
    survey: SphereSurvey,
) -> list[SurfaceSpot]:
    """Return the spots at which the tool's shaft keeps clear of the sphere."""
    top = spot_on(centre_mm, radius_mm, UPRIGHT, (0.0, 0.0, 1.0))
    upright = rotation_of(drive.pose(top))
    spots = []
    for tilt in tilts:
        spot = spot_on(centre_mm, radius_mm, tilt, (0.0, 0.0, 1.0))
        # Direction of a shaft that is vertical in the first orientation.
        shaft = (rotation_of(drive.pose(spot)) @ upright.T)[:, 2]
        spots += [
            spot_on(centre_mm, radius_mm, tilt, side)
            for side in survey.sides()
            if float(shaft @ np.array(side)) >= _LEAST_ALONG
        ]
    return spots


def informative_spots(
    drive: SurfaceDrive,
    uprights: Sequence[SurfaceSpot],
    possible: Sequence[SurfaceSpot],
    survey: SphereSurvey,
    guess: ToolOffset,
    centre_mm: Vector,
) -> tuple[tuple[SurfaceSpot, ...], Floats]:
    """Return the spots of all touches in their order, and the derivatives at them.

    Each further touch is the one with which the tip would be known best.

    Args:
        drive: Tells the pose of a spot.
        uprights: The spots that were touched already.
        possible: Those that may be touched.
        survey: How many there are to be.
        guess: About where the tip is.
        centre_mm: About where the centre is.
    """

    def rows_of(spots: Sequence[SurfaceSpot]) -> Floats:
        return sphere_columns([drive.pose(spot) for spot in spots], guess, centre_mm)

    known, rows = rows_of(uprights), rows_of(possible)
    normal = known.T @ known + FAINT * np.eye(known.shape[1])
    free, chosen = np.ones(len(rows), dtype=bool), list[int]()
    for _ in range(len(uprights), survey.count):
        best = int(np.where(free, doubts_with_each(normal, rows), np.inf).argmin())
        free[best] = False
        normal = normal + np.outer(rows[best], rows[best])
        chosen.append(best)
    spots = (*uprights, *in_turn(possible[index] for index in chosen))
    return spots, rows_of(spots)


class _SphereSampler(SurfaceSampler[SphereSurvey, SphereTouchResult]):
    """Touches of a sphere."""

    def solve(self, taken: Sequence[Pose]) -> SphereTouchResult:
        return solve_sphere_touch(taken, stored=self.stored, sigma_mm=self.sigma_mm)

    def derivatives(self, poses: Sequence[Pose]) -> Floats:
        return sphere_columns(poses, self.stored, self._sphere()[0])

    def normal_at(self, place_mm: Vector) -> Vector:
        centre, _ = self._sphere()
        apart_mm = math.dist(place_mm, centre)
        x, y, z = ((at - c) / apart_mm for at, c in zip(place_mm, centre, strict=True))
        return x, y, z

    def aligned(self, spot: SurfaceSpot) -> SurfaceSpot:
        return spot_on(*self._sphere(), spot.tilt, spot.normal)

    def require_made(self, result: SphereTouchResult) -> None:
        x_mm, y_mm, z_mm = result.reference_point_mm
        taken = self.touches.taken
        columns = sphere_columns(taken, result.offset, (x_mm, y_mm, z_mm))
        places = np.array(places_of(taken, result.offset))
        apart_mm = np.linalg.norm(places - np.array(result.reference_point_mm), axis=1)
        self.touches.require_made(columns, apart_mm - result.radius_mm)

    def _upright(self, place: int) -> tuple[SurfaceSpot, float]:
        # As if nothing were known yet: the touch being repeated may be the one that the others
        # contradict.
        survey, first = self.survey, self.upright_places()[0]
        centre = _below(first, survey.radius_mm)
        spot = spot_on(centre, survey.radius_mm, UPRIGHT, survey.upright_side(place))
        return spot, survey.aside_mm

    def _laid_out(self) -> Procedure[tuple[SurfaceSpot, ...]]:
        survey = self.survey
        centre, radius_mm = self._sphere()
        uprights = [
            SurfaceSpot(UPRIGHT, place, survey.upright_side(i))
            for i, place in enumerate(self.upright_places())
        ]
        choice = candidates(survey.tilt_deg, self.axes)
        tilts = yield from free_tilts(self.over, choice, self.touches.plan.lift_mm)
        possible = reachable(self.drive, centre, radius_mm, tilts, survey)
        spots, _ = informative_spots(self.drive, uprights, possible, survey, self.stored, centre)
        return spots

    def _sphere(self) -> tuple[Vector, float]:
        """Return where the sphere is by the upright touches, and its radius.

        Raises:
            CalibrationError: ``radius_contradicted`` or ``off_top``.
        """
        places = self.upright_places()
        if self.touches.plan.nominal:
            return _below(places[0], self.survey.radius_mm), self.survey.radius_mm
        return sphere_of(places, self.survey)


def _below(top_mm: Vector, radius_mm: float) -> Vector:
    return top_mm[0], top_mm[1], top_mm[2] - radius_mm


@dataclass(frozen=True, slots=True)
class TouchedSphere:
    """A sphere in the base."""

    centre_mm: tuple[float, float, float]
    radius_mm: float


def _first_touch() -> str:
    """Return the first request to the person, before anything is known of the sphere."""
    return tr("Jog the tip onto the top of the sphere.")


SPHERE: Final = SurfaceKind(_SphereSampler, _first_touch)


@dataclass(frozen=True, slots=True, kw_only=True)
class SphereTest(TiltingProof):
    """All that the test on a sphere needs.

    Attributes:
        survey: From which sides it may be touched.
        sphere: The sphere as the measurement found it.
        axes: How many axes the robot has, 0 where nobody knows.
    """

    method: ClassVar[str] = "sphere-touch"

    survey: SphereSurvey
    sphere: TouchedSphere
    axes: int

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from over the sphere, lifted and upright.

        They touch it in tilts that were not measured in.
        """
        plan, (x_mm, y_mm, z_mm), radius_mm = (
            self.touch,
            self.sphere.centre_mm,
            self.sphere.radius_mm,
        )
        top = (x_mm, y_mm, z_mm + radius_mm)
        over = OverPin(here, top, tip=tilted_from(self.written, self.tip), frame=self.written)
        drive = SurfaceDrive(plan, over, SurfaceTouches(plan))
        choice = candidates(self.survey.tilt_deg, self.axes, turned_deg=TURNED_DEG)
        tilts = yield from free_tilts(over, choice, plan.lift_mm)
        possible = reachable(drive, (x_mm, y_mm, z_mm), radius_mm, tilts, self.survey)
        return (
            yield from verify_on_surface(
                plan,
                over=over,
                spots=proving_spots(over, possible),
                tolerance_mm=self.tolerance_mm,
                u_mm=self.u_mm,
            )
        )

    def _first(self) -> tuple[str, str]:
        return SPHERE.asked(), tr("Lifting off the surface.")

    def _apart_mm(self, found: Pose) -> Vector:
        (place,) = places_of([found], tilted_from(self.written, self.tip))
        out = [at - middle for at, middle in zip(place, self.sphere.centre_mm, strict=True)]
        # Vertically above a point beside the top the sphere is in the way: treated as far away,
        # however near.
        on_top = math.hypot(*out[:2]) <= self.survey.most_aside * self.sphere.radius_mm
        nearest = out if on_top and out[2] > 0 else [0.0, 0.0, 1.0]
        share = self.sphere.radius_mm / math.hypot(*nearest)
        x_mm, y_mm, z_mm = (at - share * to for at, to in zip(out, nearest, strict=True))
        return x_mm, y_mm, z_mm
