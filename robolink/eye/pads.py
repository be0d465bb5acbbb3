"""Finds round pads of a board, by numpy alone.

A pad is filled and round, and its edge goes the same way all round: from bright to dark, or from
dark to bright. Edges vote for the middles of circles in a smaller picture; rays from the best of
them find the edge in the picture itself, between its pixels (docs/reference/eye.md, "Fiducials of
a board").
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from robolink.eye._mark_edges import (
    Numbers,
    edge_width,
    leaves_picture,
    local_maxima,
    noise_of,
    sampled,
    shrunk,
    smoothed_slope,
)
from robolink.eye.candidate import (
    Candidate,
    CandidateRefusal,
    MarkShape,
    Polarity,
    RefusalCode,
    ranked,
)

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["find_pads"]

_VOTING_RADIUS_PX: Final = 9.0
"""A picture is made smaller until a pad has about this radius."""

_MOST_VOTERS: Final = 60_000
_CANDIDATES: Final = 8
_LEAST_VOTES: Final = 0.30
"""Share of a circle's pixels that votes for its middle."""

_RAYS: Final = 96
_TRIPLES: Final = 120
_SMOOTH_PX: Final = 1.2
_SMOOTH_OF_EDGE: Final = 0.3
"""Width of the Gaussian before an edge is looked for, as a share of the edge's own."""

_LEAST_RAYS: Final = 0.60
_LEAST_CONTRAST: Final = 6.0
_LEAST_CONTRAST_NOISES: Final = 1.5
_MOST_UNEVEN: Final = 0.5
"""How far its middle may be from the rest of it, as a share of its contrast: a hole is beyond."""

_MOST_OTHER: Final = 0.30
"""Share of its inside that may be nearer to what is around it."""

_MOST_OUT_OF_ROUND: Final = 0.022
_MOST_OUT_OF_ROUND_PX: Final = 0.16
_MOST_OVAL: Final = 0.08
_CORNER: Final = 0.09
"""How far the corners of a hexagon are from the circle of its size, with a margin."""

_BLURRED: Final = 2.0
"""Width of an edge as a multiple of the taught one: beyond, it is out of focus."""


def find_pads(grey: "Grey", shape: MarkShape) -> tuple[Candidate, ...]:
    """Return all that may be a round pad, the accepted ones first.

    Args:
        grey: A picture, rows by columns.
        shape: What is known of the pads.

    Example:
        >>> import numpy as np
        >>> from robolink.eye.candidate import MarkShape
        >>> from robolink.eye.pads import find_pads
        >>> y, x = np.mgrid[0:120, 0:160]
        >>> cover = np.clip(12.5 - np.hypot(x - 70.4, y - 50.0), 0, 1)
        >>> (pad,) = find_pads((40 + 150 * cover).astype(np.uint8), MarkShape(radius_px=12))
        >>> pad.accepted, round(pad.x_px, 1), round(pad.y_px, 1), round(pad.radius_px, 1)
        (True, 70.4, 50.0, 12.0)
    """
    if min(grey.shape) < 2 * shape.radius_px or shape.radius_px < 2:
        return ()
    noise = noise_of(grey)
    found = list[Candidate]()
    for bright in _polarities(shape.polarity):
        for x_px, y_px in _voted(grey, shape, bright=bright):
            candidate = _judged(grey, shape, (x_px, y_px), bright=bright, noise=noise)
            if candidate is not None:
                found.append(candidate)
    return ranked(found, apart_px=0.5 * shape.radius_px)


def _polarities(polarity: Polarity) -> tuple[bool, ...]:
    if polarity is Polarity.EITHER:
        return (True, False)
    return (polarity is Polarity.BRIGHT,)


def _voted(grey: "Grey", shape: MarkShape, *, bright: bool) -> list[tuple[float, float]]:
    """Return the places for which most edges vote, in pixels of the picture."""
    factor = max(1, int(shape.radius_px / _VOTING_RADIUS_PX))
    small = shrunk(grey, factor)
    height, width = small.shape
    # Three by three, weighted 1-2-1: the noise of a pixel is no edge.
    quarter = np.float32(0.25)
    small = quarter * (small[:-2] + 2 * small[1:-1] + small[2:])
    small = quarter * (small[:, :-2] + 2 * small[:, 1:-1] + small[:, 2:])
    gx = (small[1:-1, 2:] - small[1:-1, :-2]) / 2
    gy = (small[2:, 1:-1] - small[:-2, 1:-1]) / 2
    steep = np.hypot(gx, gy)
    least = max(1.5, 3 * float(np.median(steep)))
    rows, columns = np.nonzero(steep > least)
    if len(rows) > _MOST_VOTERS:
        best = np.argpartition(steep[rows, columns], -_MOST_VOTERS)[-_MOST_VOTERS:]
        rows, columns = rows[best], columns[best]
    if not len(rows):
        return []
    size = steep[rows, columns]
    sign = np.float32(1 if bright else -1)
    along_x, along_y = sign * gx[rows, columns] / size, sign * gy[rows, columns] / size
    radius = shape.radius_px / factor
    votes = np.zeros(height * width, np.float32)
    radii = np.arange(radius * (1 - shape.within), radius * (1 + shape.within) + 0.5, 1.0)
    for at in radii:
        x = np.rint(columns + 2 + at * along_x).astype(np.intp)
        y = np.rint(rows + 2 + at * along_y).astype(np.intp)
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        votes += np.bincount(y[inside] * width + x[inside], minlength=votes.size)
    square = votes.reshape(height, width)
    square = square[:-2] + square[1:-1] + square[2:]
    square = square[:, :-2] + square[:, 1:-1] + square[:, 2:]
    peaks = local_maxima(
        square,
        apart=max(2, round(radius * 0.4)),
        count=_CANDIDATES,
        least=_LEAST_VOTES * math.tau * radius,
    )
    middle = (factor - 1) / 2
    return [(factor * (x + 1) + middle, factor * (y + 1) + middle) for x, y in peaks]


@dataclass(frozen=True, slots=True)
class _Circle:
    x: float
    y: float
    radius: float
    met: float
    oval: float = 0.0


@dataclass(frozen=True, slots=True)
class _Rays:
    """Edges along rays from one place: by ray, up to two of them."""

    x: Numbers
    y: Numbers
    steep: Numbers


_DIRECTIONS: Final = np.arange(_RAYS) * (math.tau / _RAYS)
_COS: Final = np.cos(_DIRECTIONS)[:, None]
_SIN: Final = np.sin(_DIRECTIONS)[:, None]


def _rays(
    grey: "Grey",
    x: float,
    y: float,
    low: float,
    high: float,
    *,
    bright: bool,
    smooth_px: float = _SMOOTH_PX,
) -> _Rays:
    """Return the two steepest edges of each ray that go the right way."""
    step = max(0.5, (high - low) / 60)
    radii = np.arange(low, high, step, dtype=np.float32)[None, :]
    levels = sampled(grey, x + radii * _COS, y + radii * _SIN)
    slope = smoothed_slope(levels, max(1.0, smooth_px / step))
    response = -slope if bright else slope
    inner = response[:, 1:-1]
    top = np.where((inner >= response[:, :-2]) & (inner > response[:, 2:]), inner, 0)
    all_x, all_y, all_steep = [], [], []
    each = np.arange(_RAYS)
    for _ in range(2):
        at = top.argmax(axis=1)
        steep = top[each, at]
        before, here, after = (response[each, at + k] for k in (0, 1, 2))
        bend = before - 2 * here + after
        shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, -1), 0)
        radius = low + step * (at + 1 + np.clip(shift, -0.5, 0.5))
        all_x.append(x + radius * _COS[:, 0])
        all_y.append(y + radius * _SIN[:, 0])
        all_steep.append(steep / step)
        top[each, at] = 0
    return _Rays(*(np.stack(those, axis=1) for those in (all_x, all_y, all_steep)))


def _fitted(
    rays: _Rays, least_steep: float, tolerance: float, radius: float, within: float
) -> _Circle | None:
    """Return the circle on which most rays have an edge: triples at random, then least squares."""
    usable = rays.steep[:, 0] > least_steep
    index = np.flatnonzero(usable)
    if len(index) < _RAYS // 4:
        return None
    rng = np.random.default_rng(len(index))
    triples = index[rng.integers(0, len(index), (_TRIPLES, 3))]
    x, y = rays.x[:, 0], rays.y[:, 0]
    ax, ay = x[triples[:, 0]], y[triples[:, 0]]
    bx, by = x[triples[:, 1]] - ax, y[triples[:, 1]] - ay
    cx, cy = x[triples[:, 2]] - ax, y[triples[:, 2]] - ay
    turn = 2 * (bx * cy - by * cx)
    good = abs(turn) > 1e-3
    turn = np.where(good, turn, 1)
    b2, c2 = bx * bx + by * by, cx * cx + cy * cy
    ux, uy = (cy * b2 - by * c2) / turn, (bx * c2 - cx * b2) / turn
    radii = np.hypot(ux, uy)
    # A fifth more than is allowed: one that is too large is to be named so.
    good &= (radii > radius * (1 - 1.5 * within)) & (radii < radius * (1 + 1.5 * within))
    if not good.any():
        return None
    mx, my, radii = (ax + ux)[good], (ay + uy)[good], radii[good]
    off = abs(
        np.hypot(rays.x[None] - mx[:, None, None], rays.y[None] - my[:, None, None])
        - radii[:, None, None]
    )
    near = ((off < tolerance) & (rays.steep[None] > least_steep)).any(axis=2)
    best = int(near.sum(axis=1).argmax())
    circle = (float(mx[best]), float(my[best]), float(radii[best]))
    met = 0.0
    for _ in range(4):
        off = abs(np.hypot(rays.x - circle[0], rays.y - circle[1]) - circle[2])
        off = np.where(rays.steep > least_steep, off, np.inf)
        nearest = off.argmin(axis=1)
        each = np.arange(_RAYS)
        inlier = off[each, nearest] < tolerance
        met = float(inlier.mean())
        if inlier.sum() < 8:
            return None
        circle = _least_squares(rays.x[each, nearest][inlier], rays.y[each, nearest][inlier])
    return _Circle(*circle, met)


def _least_squares(x: Numbers, y: Numbers) -> tuple[float, float, float]:
    """Return the circle through points: x² + y² linear in its unknowns (Kasa)."""
    mx, my = float(x.mean()), float(y.mean())
    dx, dy = (x - mx).astype(np.float64), (y - my).astype(np.float64)
    matrix = np.stack([dx, dy, np.ones_like(dx)], axis=1)
    (a, b, c), *_ = np.linalg.lstsq(matrix, dx * dx + dy * dy, rcond=None)
    radius = math.sqrt(max(0.0, float(c + (a * a + b * b) / 4)))
    return mx + float(a) / 2, my + float(b) / 2, radius


def _judged(
    grey: "Grey", shape: MarkShape, seed: tuple[float, float], *, bright: bool, noise: float
) -> Candidate | None:
    """Return what is at a place, with all that speaks against it; ``None`` for no circle."""
    radius = shape.radius_px
    low, high = radius * 0.55, radius * (1 + 1.5 * shape.within) + 2
    rays = _rays(grey, *seed, low, high, bright=bright)
    least_steep = max(0.6, 0.5 * noise)
    circle = _fitted(rays, least_steep, max(0.8, 0.05 * radius), radius, shape.within)
    if circle is None:
        return None
    edge_px = _edge_px(grey, circle, bright=bright) or 0.0
    smooth_px = max(_SMOOTH_PX, min(_SMOOTH_OF_EDGE * edge_px, 0.1 * radius))
    tolerance = max(0.8, 0.03 * radius, 0.2 * edge_px)
    for _ in range(2):
        low, high = circle.radius * 0.7, circle.radius * 1.3 + 1
        rays = _rays(grey, circle.x, circle.y, low, high, bright=bright, smooth_px=smooth_px)
        circle = _oval(rays, circle, least_steep / max(1.0, smooth_px), tolerance)
        if circle is None:
            return None
    return _refused_for(grey, shape, circle, rays, bright=bright, noise=noise)


def _oval(rays: _Rays, near: _Circle, least_steep: float, tolerance: float) -> _Circle | None:
    """Return the middle of an edge that is round or a little oval, by waves of its radius.

    The first wave moves the middle; the second is what a lens that leans makes of a circle.
    """
    around = np.arctan2(rays.y - near.y, rays.x - near.x)
    from_middle = np.hypot(rays.x - near.x, rays.y - near.y)
    each = np.arange(_RAYS)
    waves = np.array([near.radius, 0, 0, 0, 0])
    met = 0.0
    for turn in range(5):
        columns = (np.ones_like(around), *(f(k * around) for k in (1, 2) for f in (np.cos, np.sin)))
        basis = np.stack(columns, axis=2)
        off = abs(from_middle - basis @ waves)
        off = np.where(rays.steep > least_steep, off, np.inf)
        nearest = off.argmin(axis=1)
        inlier = off[each, nearest] < tolerance * (2 if turn < 2 else 1)
        met = float(inlier.mean())
        if inlier.sum() < _RAYS // 4:
            return None
        waves, *_ = np.linalg.lstsq(
            basis[each, nearest][inlier], from_middle[each, nearest][inlier], rcond=None
        )
    radius, x, y, *oval = (float(wave) for wave in waves)
    if not 0.5 * near.radius < radius < 1.5 * near.radius or math.hypot(x, y) > near.radius:
        return None  # no edge that goes round
    return _Circle(near.x + x, near.y + y, radius, met, math.hypot(*oval) / radius)


def _refused_for(
    grey: "Grey", shape: MarkShape, circle: _Circle, rays: _Rays, *, bright: bool, noise: float
) -> Candidate:
    x, y, radius = circle.x, circle.y, circle.radius
    shares = np.array((0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.7, 0.8), np.float32)[None, :]
    inside = sampled(grey, x + radius * shares * _COS, y + radius * shares * _SIN)
    reach = max(0.2, 2.5 / radius)
    around = (1 + np.array((0.6, 0.8, 1.0), np.float32) * reach)[None, :] * radius
    outside = sampled(grey, x + around * _COS, y + around * _SIN)
    face, ground = float(np.median(inside[:, 5:])), float(np.median(outside))
    contrast = (face - ground) * (1 if bright else -1)
    middle = float(np.median(inside[:, :4]))
    uneven = abs(middle - face) / max(1.0, contrast)
    half_way = (face + ground) / 2
    other = inside < half_way if bright else inside > half_way
    other_share = float((other * shares).sum() / (shares.sum() * _RAYS))
    out_of_round = _out_of_round(rays, circle)
    round_limit = _MOST_OUT_OF_ROUND + _MOST_OUT_OF_ROUND_PX / radius
    edge_px = _edge_px(grey, circle, bright=bright)
    least_contrast = max(_LEAST_CONTRAST, _LEAST_CONTRAST_NOISES * noise)
    cut_px = leaves_picture(grey, x, y, radius + 1)
    off = abs(radius / shape.radius_px - 1)
    blurred = edge_px or 0.0
    blur_limit = math.inf if shape.edge_px is None else _BLURRED * shape.edge_px
    checks = (
        (RefusalCode.CUT, cut_px, 0.0, cut_px > 0),
        (RefusalCode.OTHER_RADIUS, off, shape.within, off > shape.within),
        (RefusalCode.FEW_RAYS, circle.met, _LEAST_RAYS, circle.met < _LEAST_RAYS),
        (RefusalCode.FAINT_EDGE, contrast, least_contrast, contrast < least_contrast),
        (RefusalCode.NOT_FILLED, uneven, _MOST_UNEVEN, uneven > _MOST_UNEVEN),
        (RefusalCode.NOT_FILLED, other_share, _MOST_OTHER, other_share > _MOST_OTHER),
        (RefusalCode.NOT_ROUND, out_of_round, round_limit, out_of_round > round_limit),
        (RefusalCode.NOT_ROUND, circle.oval, _MOST_OVAL, circle.oval > _MOST_OVAL),
        (RefusalCode.BLURRED, blurred, blur_limit, blurred > blur_limit),
    )
    refused = tuple(
        CandidateRefusal(code, value, limit) for code, value, limit, fails in checks if fails
    )
    score = circle.met * max(0.0, 1 - out_of_round / round_limit / 2)
    return Candidate(
        x, y, radius, min(1.0, score), rays=circle.met, edge_px=edge_px, refused=refused
    )


def _out_of_round(rays: _Rays, circle: _Circle) -> float:
    """Return the largest of the waves three to eight in the edge's radius, as a share of it.

    A polygon has one of them; an oval, as a lens that leans makes it, has the second.
    """
    from_middle = np.hypot(rays.x - circle.x, rays.y - circle.y)
    off = np.where(rays.steep > 0, from_middle - circle.radius, np.inf)
    nearest = abs(off).argmin(axis=1)
    near = off[np.arange(_RAYS), nearest]
    # What is further off is dirt, or a trace that leads to the pad.
    near = np.where(abs(near) < _CORNER * circle.radius, near, 0)
    waves = abs(np.fft.rfft(near))[3:9] * 2 / _RAYS
    return float(waves.max()) / circle.radius


def _edge_px(grey: "Grey", circle: _Circle, *, bright: bool) -> float | None:
    reach = min(max(6.0, 0.25 * circle.radius), 0.6 * circle.radius)
    radii = np.arange(-reach, reach + 0.1, 0.25, dtype=np.float32)[None, :] + circle.radius
    levels = sampled(grey, circle.x + radii * _COS, circle.y + radii * _SIN)
    profile = np.median(levels, axis=0)
    return edge_width(-profile if bright else profile, 0.25)
