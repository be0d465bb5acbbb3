"""Circles through the edges that rays meet: RANSAC, then least squares."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from robolink.eye.tip_finder.rays import RAYS, Edges, Floats, Unrolled

__all__ = ["Circle", "circles"]

TRIES: Final = 240
SEED: Final = 20261128
LIKELY: Final = (0.55, 0.28, 0.17)
"""How likely the steepest edge of a ray is tried, and the next ones."""

TIGHT: Final = (0.8, 0.02)
"""Tolerance of a sharp, round edge: the larger of so many pixels and this share of the radius."""

LEAST_SHARE: Final = 0.2
"""Share of the rays below which a circle is not looked at."""

ANOTHER: Final = 0.07
"""Share of the radius by which another circle about the same middle differs."""

LOBED: Final = 0.18
"""Share of the radius within which edges beside the circle tell whether it is a polygon."""

ROUNDS: Final = 6
SETTLED_PX: Final = 0.002


class Circle(NamedTuple):
    """A circle in the picture.

    Attributes:
        x_px, y_px: Its middle.
        radius_px: Its radius.
        sign: +1 where it is brighter inside, -1 where it is darker.
        share: Share of the rays that met it.
        rms_px: How far their edges are from it.
        oval: How far it is from round, as a share of its radius: half the difference of its axes.
        lobes: Share of the edges' variance that one wave of three to ten lobes explains: near 1
            for a nut, 0.1 for a rough edge.
    """

    x_px: float
    y_px: float
    radius_px: float
    sign: int
    share: float
    rms_px: float
    oval: float
    lobes: float


def _drawn() -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return rays and edges of all tries, three each: the same at every call."""
    dice = np.random.default_rng(SEED)
    first = dice.integers(0, RAYS, TRIES)
    gap = dice.integers(RAYS // 8, RAYS // 2, (2, TRIES))
    rays = np.stack([first, first + gap[0], first - gap[1]]) % RAYS
    return rays, dice.choice(len(LIKELY), (3, TRIES), p=LIKELY)


_RAY, _WHICH = _drawn()
_ALL: Final = np.arange(RAYS)
_LOBES: Final = 1j * np.arange(3, 11)[:, None]


def circles(
    rays: Unrolled,
    edges: Edges,
    sign: int,
    *,
    radii_px: tuple[float, float],
    beside_px: float,
    tolerance_px: float,
    count: int,
) -> list[Circle]:
    """Return circles through many edges, that with the most first; each has another radius.

    Circles through three edges each (Fischler and Bolles 1981, with a fixed seed) are counted by
    how near the edges of all rays lie. An edge counts twice where it is as near as that of a sharp
    round tip: else two edges near each other would be fitted by one circle between them.

    Args:
        rays: Where the rays begin.
        edges: What they met.
        sign: Of the edges.
        radii_px: Least and largest radius.
        beside_px: How far the middle may lie beside the rays' beginning.
        tolerance_px: How far an edge may lie from the circle.
        count: How many circles at most.
    """
    tight_px = min(tolerance_px, max(TIGHT[0], TIGHT[1] * radii_px[1]))
    tried = _through_three(edges)
    usable = (tried[2] >= radii_px[0]) & (tried[2] <= radii_px[1])
    usable &= tried[0] ** 2 + tried[1] ** 2 <= beside_px**2
    if not usable.any():
        return []
    x, y, radius = (values[usable] for values in tried)
    near = _distances(edges, x, y, radius)
    score = np.clip(1 - (near / tolerance_px) ** 2, 0, None).sum(axis=1)
    score += np.clip(1 - (near / tight_px) ** 2, 0, None).sum(axis=1)
    found: list[Circle] = []
    for _ in range(count):
        best = int(np.argmax(score))
        if score[best] < LEAST_SHARE * RAYS:
            break
        sharp = float(np.mean(near[best] < tight_px)) > 0.5
        one = _fitted(
            rays,
            edges,
            (float(x[best]), float(y[best]), float(radius[best])),
            sign,
            (tight_px, tolerance_px),
            tight_px if sharp else tolerance_px,
        )
        score[np.abs(radius - radius[best]) < max(tolerance_px, ANOTHER * radius[best])] = 0
        if one is not None and not any(_alike(one, other) for other in found):
            found.append(one)
    return found


def _alike(one: Circle, other: Circle) -> bool:
    return abs(one.radius_px - other.radius_px) < ANOTHER * one.radius_px


def _through_three(edges: Edges) -> tuple[Floats, Floats, Floats]:
    """Return middles and radii of circles through three edges each, radius 0 where there is none.

    The circumcircle of three points, in coordinates from the first.
    """
    which = np.minimum(_WHICH, edges.x_px.shape[1] - 1)
    x0, x1, x2 = edges.x_px[_RAY, which]
    y0, y1, y2 = edges.y_px[_RAY, which]
    there = (edges.distances_px[_RAY, which] < np.inf).all(axis=0)
    ax, ay, bx, by = x1 - x0, y1 - y0, x2 - x0, y2 - y0
    twice = 2 * (ax * by - ay * bx)
    there &= np.abs(twice) > 1e-3
    twice[~there] = 1
    a, b = ax * ax + ay * ay, bx * bx + by * by
    dx, dy = (by * a - ay * b) / twice, (ax * b - bx * a) / twice
    return x0 + dx, y0 + dy, np.where(there, np.hypot(dx, dy), np.float32(0))


def _distances(edges: Edges, x: Floats, y: Floats, radius: Floats) -> Floats:
    """Return how far each ray's nearest edge is from each circle: circles by rays."""
    size = np.full((len(radius), RAYS), np.inf, np.float32)
    for kept in range(edges.x_px.shape[1]):
        off = edges.x_px[:, kept] - x[:, None]
        off *= off
        down = edges.y_px[:, kept] - y[:, None]
        down *= down
        off += down
        np.sqrt(off, out=off)
        off -= radius[:, None]
        np.abs(off, out=off)
        off[:, np.isinf(edges.distances_px[:, kept])] = np.inf
        np.minimum(size, off, out=size)
    return size


def _nearest(edges: Edges, x: float, y: float, radius: float) -> tuple[Floats, Floats, Floats]:
    """Return of each ray's edge nearest to a circle: where, from its middle, and how far off."""
    px, py = edges.x_px - np.float32(x), edges.y_px - np.float32(y)
    off = np.hypot(px, py) - np.float32(radius)
    size = np.where(edges.distances_px < np.inf, np.abs(off), np.float32(np.inf))
    which = np.argmin(size, axis=1)
    return px[_ALL, which], py[_ALL, which], size[_ALL, which]


def _fitted(
    rays: Unrolled,
    edges: Edges,
    circle: tuple[float, float, float],
    sign: int,
    tolerances_px: tuple[float, float],
    tolerance_px: float,
) -> Circle | None:
    """Return the circle of least squares through the edges near one, its tolerance following them.

    With a second harmonic, so that a face that is seen at a slant is not taken for a rough one.
    """
    x, y, radius = circle
    for _ in range(ROUNDS):
        px, py, size = _nearest(edges, x, y, radius)
        taken = size <= tolerance_px
        if np.count_nonzero(taken) < 12:
            return None
        px, py = px[taken].astype(np.float64), py[taken].astype(np.float64)
        away = np.hypot(px, py)
        c, s = px / away, py / away
        columns = np.stack([c, s, np.ones_like(c), c * c - s * s, 2 * c * s])
        # Never without rank: a trace of the diagonal is added.
        square = columns @ columns.T + 1e-9 * np.eye(len(columns))
        change = np.linalg.solve(square, columns @ (away - radius))
        rest = away - radius - change @ columns
        x, y, radius = x + float(change[0]), y + float(change[1]), radius + float(change[2])
        if radius <= 0:
            return None
        spread = 1.4826 * float(np.median(np.abs(rest)))
        before = tolerance_px
        tolerance_px = min(max(3.5 * spread, tolerances_px[0]), tolerances_px[1])
        settled = np.abs(change[:3]).max() < SETTLED_PX
        if settled and abs(tolerance_px - before) < 0.02 * before:
            break
    return Circle(
        rays.x_px + x,
        rays.y_px + y,
        radius,
        sign,
        float(np.count_nonzero(taken)) / RAYS,
        float(np.sqrt(np.mean(rest * rest))),
        float(np.hypot(change[3], change[4])) / radius,
        _lobes(edges, x, y, radius),
    )


def _lobes(edges: Edges, x: float, y: float, radius: float) -> float:
    """Return the share of the edges' variance in the strongest wave of three to ten lobes."""
    px, py, size = _nearest(edges, x, y, radius)
    taken = size < LOBED * radius
    if not taken.any():  # the last step of the fit left all of its edges behind
        return 0.0
    off = np.hypot(px[taken], py[taken]) - radius
    off = off - np.median(off)
    total = float(off @ off)
    if total <= 0:
        return 0.0
    waves = np.exp(_LOBES * np.arctan2(py[taken], px[taken]))
    power = np.abs(waves @ off) ** 2 / len(off)
    return min(1.0, 2.0 * float(power.max()) / total)
