"""Coordinate systems from taught points: Local and Plane by three, Local by two pairs.

Source: docs/reference/spel.md 5.4, 5.5.
"""

import math
from typing import Final

from robolink.model import rotate_xy
from robolink_simulators.cell.frames import (
    Frame,
    Vector,
    cross,
    dot,
    scale,
    subtract,
    transposed,
)
from robolink_simulators.epson.arm.joints import wrapped
from robolink_simulators.epson.definitions.local_frames import Coordinates, coordinates_of_frame
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

_SHORTEST_MM: Final = 1e-3
"""Assumed: points nearer than this, or nearer to one line, give no direction."""

Pair = tuple[Coordinates, Coordinates]
"""A place as a local sees it, and as the base does."""


def frame_of_points(origin: Vector, x_at: Vector, y_at: Vector, *, along_x: bool = True) -> Frame:
    """Return the frame of an origin and a point on each axis.

    One of them lies on its axis; the other says to which side, and how far the frame leans
    (documented for both ways; that it is the plane through all three is inferred).

    Args:
        origin: The origin in mm.
        x_at: A point on the X axis, or on its side.
        y_at: A point on the Y axis, or on its side.
        along_x: Whether the X axis goes through its point, or the Y axis through its own.

    Raises:
        Refusal: They lie on one line.
    """
    to_x, to_y = subtract(x_at, origin), subtract(y_at, origin)
    z = _unit(cross(to_x, to_y))
    if along_x:
        x = _unit(to_x)
        y = cross(z, x)
    else:
        y = _unit(to_y)
        x = cross(y, z)
    return Frame(origin, transposed((x, y, z)))


def coordinates_of_points(
    origin: Coordinates, x_at: Coordinates, y_at: Coordinates, *, along_x: bool = True
) -> Coordinates:
    """Return :func:`frame_of_points` of the places of three points, as coordinates.

    Raises:
        Refusal: They lie on one line.
    """
    places = [(c[0], c[1], c[2]) for c in (origin, x_at, y_at)]
    return coordinates_of_frame(frame_of_points(places[0], places[1], places[2], along_x=along_x))


def fit_of_pairs(first: Pair, second: Pair, aligned: str = "") -> Coordinates:
    """Return the local, turned about Z alone, that brings two places onto two others.

    The distances may differ: then the middles lie on each other, or the first or the second
    places do (documented).

    Args:
        first: A place seen from the local and from the base.
        second: Another one.
        aligned: ``l`` for the first, ``r`` for the second, else the middles.

    Raises:
        Refusal: The two places are one.
    """
    (l1, b1), (l2, b2) = first, second
    for a, b in ((l1, l2), (b1, b2)):
        if math.dist(a[:2], b[:2]) < _SHORTEST_MM:
            raise _no_direction()
    turn_deg = wrapped(math.degrees(_heading(b1, b2) - _heading(l1, l2)))
    weight = {"l": 0.0, "r": 1.0}.get(aligned, 0.5)
    seen, there = _between(l1, l2, weight), _between(b1, b2, weight)
    dx_mm, dy_mm = rotate_xy(seen[0], seen[1], turn_deg)
    return (there[0] - dx_mm, there[1] - dy_mm, there[2] - seen[2], turn_deg, 0.0, 0.0)


def _between(start: Coordinates, end: Coordinates, share: float) -> list[float]:
    return [(1 - share) * a + share * b for a, b in zip(start, end, strict=True)]


def _heading(start: Coordinates, end: Coordinates) -> float:
    return math.atan2(end[1] - start[1], end[0] - start[0])


def _unit(vector: Vector) -> Vector:
    length = math.sqrt(dot(vector, vector))
    if length < _SHORTEST_MM:
        raise _no_direction()
    return scale(vector, 1 / length)


def _no_direction() -> SpelRefusal:
    return SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "The points give no direction")
