"""In which tilts a plane is touched: those that tell most about the tip, once it is known to lie.

What a plane shows of a tip is ``n R``: turning about the plane's own normal shows nothing. So which
tilts are good depends on how the plane lies, and a tip may not be told at all: on a level plane
with a robot that leans about one axis of its flange only.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robolink.calibration import Floats, linear_fit, plane_columns, rotation_of, tip_is_told
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.tilts import TURNS_DEG, Tilt
from robolink.methods.plane_touch.survey import PlaneSurvey
from robolink.methods.surface_drive import SurfaceSpot, Vector
from robolink.model import ToolOffset

if TYPE_CHECKING:
    from robolink.methods.surface_drive import SurfaceDrive

_FAINT = 1e-6
"""Makes two plans comparable before any combination of their touches tells everything."""

_SIX = 6

_LEAST_ALTITUDE = 0.3
"""Of a triangle, as a share of its longest side: 0.87 where all sides are equal."""


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
    """Refuse a plane that leans by more than the robot kept away from it.

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


def candidates(tilt_deg: float, axes: int, *, turned_deg: float = 0.0) -> tuple[Tilt, ...]:
    """Return tilts among which to choose.

    Args:
        tilt_deg: How far the tool leans.
        axes: How many axes the robot has, 0 where nobody knows.
        turned_deg: Turned by so much more; 30 makes them others than those without.
    """
    leans = [Tilt(lean_deg=tilt_deg), Tilt(lean_deg=-tilt_deg)]
    if axes >= _SIX:
        leans += [Tilt(roll_deg=tilt_deg), Tilt(roll_deg=-tilt_deg)]
    return tuple(
        Tilt(turn + turned_deg, lean.lean_deg, lean.roll_deg)
        for turn in TURNS_DEG
        for lean in leans
    )


def informative_spots(
    drive: "SurfaceDrive",
    uprights: Sequence[SurfaceSpot],
    survey: PlaneSurvey,
    choice: Sequence[Tilt],
    guess: ToolOffset,
) -> tuple[tuple[SurfaceSpot, ...], Floats]:
    """Return the spots of all touches in their order, and the derivatives at them.

    Each further touch is the one with which the tip would be known best. They are taken in the
    order of their turns, so that the robot goes round once.

    Args:
        drive: Tells the pose of a spot.
        uprights: The spots that were touched already.
        survey: How many there are to be, and where.
        choice: The tilts that may be taken.
        guess: About where the tip is.
    """
    first, leans = uprights[0], _leans(drive, uprights[0], choice)
    upright = _leans(drive, first, [first.tilt])[0]
    normal = _FAINT * np.eye(_SIX)
    for number in range(len(uprights)):
        row = _row(upright, survey, number)
        normal = normal + np.outer(row, row)
    further = []
    for number in range(len(uprights), survey.count):
        rows = np.array([_row(lean, survey, number) for lean in leans])
        with_each = np.linalg.inv(normal + rows[:, :, None] * rows[:, None, :])
        best = int(np.einsum("nii->n", with_each[:, :3, :3]).argmin())
        normal = normal + np.outer(rows[best], rows[best])
        place = on_plane(first.place_mm, first.normal, survey.beside_mm(number))
        further.append(SurfaceSpot(choice[best], place, first.normal))
    further.sort(key=lambda one: (one.tilt.turn_deg, one.tilt.lean_deg, one.tilt.roll_deg))
    spots = (*uprights, *further)
    poses = [drive.pose(spot) for spot in spots]
    return spots, plane_columns(poses, guess, first.normal)


def _leans(drive: "SurfaceDrive", spot: SurfaceSpot, tilts: Sequence[Tilt]) -> Floats:
    """Return how the plane's normal lies on the flange in each tilt, one a row."""
    turned = [rotation_of(drive.pose(replace(spot, tilt=tilt))) for tilt in tilts]
    leans: Floats = np.array(turned).transpose(0, 2, 1) @ np.array(spot.normal)
    return leans


def _row(lean: Floats, survey: PlaneSurvey, number: int) -> Floats:
    """Return the derivatives at one touch: the tip, how the plane leans, its distance."""
    beside = np.array(survey.beside_mm(number)) / survey.spread_mm
    return np.concatenate((lean, beside, [-1.0]))


def require_observable(columns: Floats) -> None:
    """Refuse a plan whose touches could not tell the tip, before any of them is made.

    Args:
        columns: The derivatives at all spots.

    Raises:
        CalibrationError: ``rank_deficient`` or ``insufficient_rotation``.
    """
    fit = linear_fit(columns, np.zeros(len(columns)))
    if tip_is_told(fit, _SIX):
        return
    variances = fit.unit_covariance.diagonal()[:3]
    # Columns of very different lengths: which of X, Y and Z is weak shows unscaled.
    weak = "XYZ"[int(np.abs(np.linalg.svd(columns)[2][-1][:3]).argmax())]
    if np.isfinite(variances).all():
        weak = "XYZ"[int(variances.argmax())]
    raise CalibrationError(
        "rank_deficient" if fit.rank < _SIX else "insufficient_rotation",
        tr(
            "Touches of a plane at this angle do not tell where the tip is along "
            "{axis} of the flange: the tilts that this robot can reach change nothing "
            "there.",
            axis=weak,
        ),
        remedy=tr(
            "Nothing was written. Put the plane at an angle of 15 to 30 degrees, or measure with "
            "'calibrate sphere-touch' or 'calibrate pivot'."
        ),
    )
