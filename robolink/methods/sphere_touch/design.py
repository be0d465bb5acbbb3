"""From which sides and in which tilts a sphere is touched: those that tell most about the tip."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robolink.calibration import Floats, rotation_of, sphere_columns, sphere_through
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.tilts import UPRIGHT, Tilt
from robolink.methods.sphere_touch.survey import SphereSurvey, Vector
from robolink.methods.surface_drive import SurfaceSpot
from robolink.model import ToolOffset

if TYPE_CHECKING:
    from robolink.methods.surface_drive import SurfaceDrive

_FAINT = 1e-6
"""Makes two plans comparable before any combination of their touches tells everything."""

_LEAST_ALONG = 0.5
"""Cosine of the largest angle between the tool's shaft and the outward direction: beyond it the
shaft comes too near to the sphere beside the tip."""

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
    drive: "SurfaceDrive",
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
        # Where a shaft points that stands straight up in the first orientation.
        shaft = (rotation_of(drive.pose(spot)) @ upright.T)[:, 2]
        spots += [
            spot_on(centre_mm, radius_mm, tilt, side)
            for side in survey.sides()
            if float(shaft @ np.array(side)) >= _LEAST_ALONG
        ]
    return spots


def informative_spots(
    drive: "SurfaceDrive",
    uprights: Sequence[SurfaceSpot],
    possible: Sequence[SurfaceSpot],
    survey: SphereSurvey,
    guess: ToolOffset,
    centre_mm: Vector,
) -> tuple[tuple[SurfaceSpot, ...], Floats]:
    """Return the spots of all touches in their order, and the derivatives at them.

    Each further touch is the one with which the tip would be known best. They are taken in the
    order of their turns.

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
    normal = known.T @ known + _FAINT * np.eye(known.shape[1])
    free, chosen = np.ones(len(rows), dtype=bool), list[int]()
    for _ in range(len(uprights), survey.count):
        with_each = np.linalg.inv(normal + rows[:, :, None] * rows[:, None, :])
        doubts = np.einsum("nii->n", with_each[:, :3, :3])
        best = int(np.where(free, doubts, np.inf).argmin())
        free[best] = False
        normal = normal + np.outer(rows[best], rows[best])
        chosen.append(best)
    further = sorted(
        (possible[index] for index in chosen),
        key=lambda one: (one.tilt.turn_deg, one.tilt.lean_deg, one.tilt.roll_deg),
    )
    spots = (*uprights, *further)
    return spots, rows_of(spots)
