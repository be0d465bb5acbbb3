"""A way of the flange along an axis of the tool: what it shows, and when it shows nothing."""

import math
from typing import Final

import numpy as np

from robolink.calibration.core.robust import Floats
from robolink.calibration.core.rotations import rotation_of
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose

LEAST_WAY_MM: Final = 5.0
"""A shorter way shows no direction."""

GOOD_WAY_MM: Final = 50.0
"""With a scatter of 0.01 mm at both ends it shows one to 0.02 degrees."""

_TURNED_DEG: Final = 0.01


def axis_displacement(start: Pose, end: Pose, *, wanted_mm: float | None = None) -> Floats:
    """Return the way of the flange in its own axes, mm.

    Args:
        start: Flange pose at its start.
        end: Flange pose at its end.
        wanted_mm: How long it was to be, ``None`` for long enough to show a direction at all.

    Raises:
        CalibrationError: ``turned_on_the_way``, ``short_axis``.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import axis_displacement
        >>> way = axis_displacement(Pose(300, 100, -60, 90), Pose(300, 150, -60, 90))
        >>> [round(float(part), 3) for part in way]
        [50.0, 0.0, 0.0]
    """
    require_unturned(start, end)
    way: Floats = rotation_of(start).T @ np.subtract(end.coordinates()[:3], start.coordinates()[:3])
    if float(np.linalg.norm(way)) < (wanted_mm or LEAST_WAY_MM):
        raise CalibrationError(
            "short_axis",
            tr("The move along the axis is {way:.2f} mm long.", way=float(np.linalg.norm(way))),
            remedy=tr(
                "Move {least:g} mm or more; the longer the move, the better the "
                "direction is known.",
                least=wanted_mm or GOOD_WAY_MM,
            ),
        )
    return way


def require_unturned(start: Pose, end: Pose) -> None:
    """Refuse a way on which the tool turned.

    Raises:
        CalibrationError: ``turned_on_the_way``.
    """
    # Half of |R1 - R2| is sqrt2 sin(angle / 2).
    off = float(np.linalg.norm(rotation_of(start) - rotation_of(end)))
    if off > math.sqrt(2) * math.radians(_TURNED_DEG):
        raise CalibrationError(
            "turned_on_the_way",
            tr("The tool turned during the move that should show its axis."),
            remedy=tr("Keep the orientation in which the move began."),
        )


def between_deg(one: Floats, other: Floats) -> float:
    """Return the angle between two vectors."""
    cosine = float(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)))
    return math.degrees(math.acos(min(1.0, max(-1.0, cosine))))
