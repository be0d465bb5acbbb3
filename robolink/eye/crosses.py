"""Finds crosses of a board, by numpy alone: four arms of one length, open between them.

What has four arms turns into itself by a quarter of a turn: a filter of that symmetry gives place
and direction in a smaller picture. Then both edges of each arm are found in the picture itself at
many places. The middles between them give two lines, and the lines meet in the middle of the cross
(docs/reference/eye.md, "Fiducials of a board").
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from robolink.eye._mark_edges import (
    Numbers,
    edge_width,
    leaves_picture,
    line_through,
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

__all__ = ["find_crosses"]

_FILTER_RADIUS_PX: Final = 10.0
"""A picture is made smaller until half a cross is about this long."""

_CANDIDATES: Final = 10
_LEAST_RESPONSE: Final = 0.12

_PLACES: Final = np.linspace(0.30, 0.80, 14, dtype=np.float32)
"""Where edges of an arm are looked for, from the middle, as shares of its length."""

_ASIDE: Final = 0.55
"""How far beside its axis, likewise."""

_LEAST_WIDTH: Final = 0.06
_MOST_WIDTH: Final = 0.60
"""Width of an arm, likewise."""

_LEAST_OF_USUAL: Final = 0.3
"""How steep an edge is at least, as a share of the median of all."""

_LEAST_ARMS: Final = 0.60
_LEAST_ARM: Final = 0.30
_LEAST_ENDS: Final = 3
_MOST_OFF_END: Final = 0.12
_MOST_OFF_END_PX: Final = 1.5
_MOST_LEAN_DEG: Final = 6.0
_LEAST_CONTRAST: Final = 6.0
_LEAST_CONTRAST_NOISES: Final = 1.5
_MOST_BETWEEN: Final = 0.4
"""Share of the places between two arms that may be nearer to the arms than to the ground."""

_ROUNDS: Final = 4
"""How often the lines are found anew about the middle that they gave."""

_SMOOTH_PX: Final = 1.2
_SMOOTH_OF_EDGE: Final = 0.3
_BLURRED: Final = 2.0


def find_crosses(grey: "Grey", shape: MarkShape) -> tuple[Candidate, ...]:
    """Return all that may be a cross, the accepted ones first.

    Args:
        grey: A picture, rows by columns.
        shape: What is known of the crosses.

    Example:
        >>> import numpy as np
        >>> from robolink.eye.candidate import MarkShape
        >>> from robolink.eye.crosses import find_crosses
        >>> y, x = np.mgrid[0:120, 0:160]
        >>> u, v = abs(x - 70.4), abs(y - 50.0)
        >>> arms = np.minimum(np.maximum(u - 20, v - 4), np.maximum(v - 20, u - 4))
        >>> drawn = 40 + 150 * np.clip(0.5 - arms, 0, 1)
        >>> (cross,) = find_crosses(drawn.astype(np.uint8), MarkShape(radius_px=20))
        >>> cross.accepted, round(cross.x_px, 1), round(cross.y_px, 1), round(cross.radius_px)
        (True, 70.4, 50.0, 20)
    """
    if min(grey.shape) < 2 * shape.radius_px or shape.radius_px < 5:
        return ()
    noise = noise_of(grey)
    found = list[Candidate]()
    for x_px, y_px, turn in _filtered(grey, shape, noise):
        for bright in (True, False):
            if shape.polarity is (Polarity.DARK if bright else Polarity.BRIGHT):
                continue
            here = turn if bright else turn + math.pi / 4
            candidate = _judged(grey, shape, (x_px, y_px), here, bright=bright, noise=noise)
            if candidate is not None:
                found.append(candidate)
    return ranked(found, apart_px=0.5 * shape.radius_px)


def _filtered(grey: "Grey", shape: MarkShape, noise: float) -> list[tuple[float, float, float]]:
    """Return places with their direction in radians, where the picture is fourfold."""
    factor = max(1, int(shape.radius_px / _FILTER_RADIUS_PX))
    small = shrunk(grey, factor)
    small -= np.float32(small.mean())
    radius = shape.radius_px / factor
    reach = math.ceil(radius)
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float64)
    ring = np.hypot(u, v)
    weight = ((ring >= 0.25 * radius) & (ring <= radius)) * np.exp(4j * np.arctan2(v, u))
    # The mean of a square of pixels is not quite nought.
    used = weight != 0
    weight[used] -= weight[used].mean()
    # The edge of the picture goes on, or it would be an edge in the picture.
    height, width = small.shape
    small = np.pad(small, reach, mode="edge")
    size = (_smooth_size(small.shape[0]), _smooth_size(small.shape[1]))
    spectrum = np.fft.rfft2(small, size)

    def against(kernel: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        turned = np.fft.rfft2(kernel[::-1, ::-1], size)
        # What wraps round lies in the margin, which is twice as wide as the reach at one end.
        full = np.fft.irfft2(spectrum * turned, size)
        return full[2 * reach : 2 * reach + height, 2 * reach : 2 * reach + width]

    response = against(weight.real) + 1j * against(weight.imag)
    middle_of = np.s_[reach : reach + height, reach : reach + width]
    energy = (_box_mean(small * small, reach) - _box_mean(small, reach) ** 2)[middle_of]
    floor = 4 + (noise / factor) ** 2
    scale = used.sum() * np.sqrt(np.maximum(energy, 0) + floor)
    strength = (abs(response) / scale).astype(np.float32)
    peaks = local_maxima(
        strength, apart=max(2, round(0.5 * radius)), count=_CANDIDATES, least=_LEAST_RESPONSE
    )
    middle = (factor - 1) / 2
    return [
        (factor * x + middle, factor * y + middle, float(np.angle(response[y, x])) / 4)
        for x, y in peaks
    ]


def _smooth_size(least: int) -> int:
    """Return the next number whose prime factors are 2, 3 and 5: transforms of it are quick."""
    size = least
    while True:
        rest = size
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return size
        size += 1


def _box_mean(values: Numbers, reach: int) -> npt.NDArray[np.float64]:
    """Return the means of squares of ``2 reach + 1``, of what of them is in the picture."""
    height, width = values.shape
    total = np.zeros((height + 1, width + 1))
    total[1:, 1:] = values.cumsum(axis=0, dtype=np.float64).cumsum(axis=1)
    top, bottom = (np.clip(np.arange(height) + k, 0, height) for k in (-reach, reach + 1))
    left, right = (np.clip(np.arange(width) + k, 0, width) for k in (-reach, reach + 1))
    whole = total[bottom][:, right] - total[top][:, right]
    whole -= total[bottom][:, left] - total[top][:, left]
    count = (bottom - top)[:, None] * (right - left)[None, :]
    mean: npt.NDArray[np.float64] = whole / count
    return mean


@dataclass(frozen=True, slots=True)
class _Axes:
    """Two lines that meet, and how wide the arms along them are.

    Attributes:
        x, y: Where they meet.
        turns: Directions of the two, in radians.
        width: Width of an arm in pixels.
    """

    x: float
    y: float
    turns: tuple[float, float]
    width: float

    def arms(self) -> tuple[float, ...]:
        """Return the directions of the four arms."""
        first, second = self.turns
        return (first, second, first + math.pi, second + math.pi)


@dataclass(frozen=True, slots=True)
class _Edges:
    """Both edges of each arm at each place, beside its axis in pixels.

    Attributes:
        middle: Between the two; by arm and place.
        width: From one to the other.
        met: Whether both are there.
    """

    middle: Numbers
    width: Numbers
    met: npt.NDArray[np.bool_]


def _judged(
    grey: "Grey",
    shape: MarkShape,
    seed: tuple[float, float],
    turn: float,
    *,
    bright: bool,
    noise: float,
) -> Candidate | None:
    """Return what is at a place, with all that speaks against it; ``None`` for no cross."""
    axes = _Axes(*seed, (turn, turn + math.pi / 2), 0.0)
    sign = np.float32(1 if bright else -1)
    smooth_px = _SMOOTH_PX
    least_steep = max(0.6, 0.5 * noise)
    edge_px: float | None = None
    for step in range(_ROUNDS):
        edges = _edges(grey, axes, shape.radius_px, sign, smooth_px, least_steep)
        met = None if edges is None else _met(edges, axes, shape.radius_px)
        if edges is None or met is None:
            return None
        axes = met
        if step == 1:
            edge_px = _edge_px(grey, axes, shape.radius_px, sign)
            wide_px = min(_SMOOTH_OF_EDGE * (edge_px or 0.0), 0.3 * axes.width)
            smooth_px = max(_SMOOTH_PX, wide_px)
            least_steep /= smooth_px
        if step == _ROUNDS - 1:
            return _refused_for(grey, shape, axes, edges, sign, noise=noise, edge_px=edge_px)
    return None


def _edges(
    grey: "Grey",
    axes: _Axes,
    radius: float,
    sign: np.float32,
    smooth_px: float,
    least_steep: float,
) -> _Edges | None:
    """Return both edges of each arm: where the mean of the arm has them, and near that."""
    step = 0.5
    reach = _ASIDE * radius
    beside = np.arange(-reach, reach + step / 2, step, dtype=np.float32)
    levels = np.stack(
        [
            sampled(
                grey,
                axes.x + radius * _PLACES[:, None] * math.cos(arm) - beside * math.sin(arm),
                axes.y + radius * _PLACES[:, None] * math.sin(arm) + beside * math.cos(arm),
            )
            for arm in axes.arms()
        ]
    )
    slopes = smoothed_slope(
        sign * levels.reshape(-1, len(beside)), max(1.0, smooth_px / step)
    ).reshape(levels.shape)
    pair = _pair(np.median(slopes, axis=1), beside, radius, axes.width)
    if pair is None:
        return None
    within = max(2.0, 0.08 * radius) if not axes.width else max(1.5, 0.05 * radius)
    places, steep = list[Numbers](), list[Numbers]()
    for side in (0, 1):
        windowed = np.where(
            abs(beside[None, None, :] - pair[:, side, None, None]) <= within,
            slopes if side == 0 else -slopes,
            0,
        )
        at = np.clip(windowed.argmax(axis=2), 1, len(beside) - 2)
        index = at[..., None] + np.arange(-1, 2)
        before, here, after = np.moveaxis(
            np.take_along_axis(slopes if side == 0 else -slopes, index, axis=2), 2, 0
        )
        bend = before - 2 * here + after
        shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, -1), 0)
        places.append(beside[at] + step * np.clip(shift, -0.5, 0.5))
        steep.append(here / step)
    width = places[1] - places[0]
    usual = float(np.median(width))
    weaker = np.minimum(*steep)
    # An arm that is not there has edges too, those of grain and dirt.
    met = weaker > max(least_steep, _LEAST_OF_USUAL * float(np.median(weaker)))
    met &= abs(width - usual) < max(1.5, 0.25 * usual)
    middle = (places[0] + places[1]) / 2
    return _Edges(middle.astype(np.float32), width.astype(np.float32), met)


def _pair(
    slopes: Numbers, beside: Numbers, radius: float, width: float
) -> npt.NDArray[np.float32] | None:
    """Return a rising and a falling edge of each arm's mean profile, of one distance.

    The distance is that at which all four together are steepest, or the one that is known.
    """
    step = float(beside[1] - beside[0])
    low, high = _LEAST_WIDTH * radius, _MOST_WIDTH * radius
    if width:
        low, high = max(low, 0.8 * width - 1), min(high, 1.2 * width + 1)
    best, found = 0.0, None
    for gap in range(max(1, int(low / step)), int(high / step) + 1):
        both = np.minimum(slopes[:, :-gap], -slopes[:, gap:])
        near = np.where(abs(beside[:-gap] + gap * step / 2) <= 0.25 * radius, both, -np.inf)
        if not near.shape[1]:
            break
        at = near.argmax(axis=1)
        # The third best of four: one arm may be under dirt.
        value = float(np.sort(near[np.arange(len(near)), at])[1])
        if value > best:
            best = value
            found = np.stack([beside[at], beside[at + gap]], axis=1)
    return found


def _met(edges: _Edges, axes: _Axes, radius: float) -> _Axes | None:
    """Return the two lines through the middles of opposite arms, and where they meet."""
    lines = list[tuple[float, float]]()
    for one, other in ((0, 2), (1, 3)):
        # Along the axis, and beside it, both seen from the first of the two arms.
        along = np.concatenate([_PLACES, -_PLACES]) * radius
        middles = np.concatenate([edges.middle[one], -edges.middle[other]])
        met = np.concatenate([edges.met[one], edges.met[other]])
        if met.sum() < len(_PLACES) // 2:
            return None
        lines.append(line_through(along[met], middles[met], tolerance=max(0.5, 0.02 * radius)))
    (first_at, first_slope), (second_at, second_slope) = lines
    turns = (axes.turns[0] + math.atan(first_slope), axes.turns[1] + math.atan(second_slope))
    points = [
        (axes.x - at * math.sin(turn), axes.y + at * math.cos(turn))
        for at, turn in zip((first_at, second_at), axes.turns, strict=True)
    ]
    ux, uy = math.cos(turns[0]), math.sin(turns[0])
    vx, vy = math.cos(turns[1]), math.sin(turns[1])
    across = ux * vy - uy * vx
    if abs(across) < 0.5:
        return None
    dx, dy = points[1][0] - points[0][0], points[1][1] - points[0][1]
    far = (dx * vy - dy * vx) / across
    width = float(np.median(edges.width[edges.met]))
    return _Axes(points[0][0] + far * ux, points[0][1] + far * uy, turns, width)


def _edge_px(grey: "Grey", axes: _Axes, radius: float, sign: np.float32) -> float | None:
    """Return the width of an arm's edges: the mean of both sides of all four."""
    reach = min(max(4.0, 0.12 * radius), 0.5 * axes.width + 2.0)
    beside = np.arange(-reach, reach + 0.1, 0.25, dtype=np.float32)
    profiles = list[Numbers]()
    for arm in axes.arms():
        for side in (-1, 1):
            across = side * (axes.width / 2 - beside)
            levels = sampled(
                grey,
                axes.x + radius * _PLACES[:, None] * math.cos(arm) - across * math.sin(arm),
                axes.y + radius * _PLACES[:, None] * math.sin(arm) + across * math.cos(arm),
            )
            profiles.append(np.median(levels, axis=0))
    return edge_width(sign * np.median(np.stack(profiles), axis=0).astype(np.float32), 0.25)


def _refused_for(
    grey: "Grey",
    shape: MarkShape,
    axes: _Axes,
    edges: _Edges,
    sign: np.float32,
    *,
    noise: float,
    edge_px: float | None,
) -> Candidate:
    arms = edges.met.mean(axis=1)
    share, worst = float(arms.mean()), float(arms.min())
    ends = _ends(grey, axes, shape.radius_px, sign, noise)
    known = [end for end in ends if end is not None]
    radius = float(np.median(known)) if known else 0.0
    near = max(_MOST_OFF_END_PX, _MOST_OFF_END * radius)
    agree = sum(abs(end - radius) <= near for end in known)
    lean_deg = abs(math.degrees(axes.turns[1] - axes.turns[0]) - 90)
    face, ground, between = _levels(grey, axes, shape.radius_px, sign)
    contrast = face - ground
    least_contrast = max(_LEAST_CONTRAST, _LEAST_CONTRAST_NOISES * noise)
    off = abs(radius / shape.radius_px - 1)
    blurred = edge_px or 0.0
    blur_limit = math.inf if shape.edge_px is None else _BLURRED * shape.edge_px
    reach = radius if known else shape.radius_px
    cut_px = max(
        leaves_picture(
            grey, axes.x + reach * math.cos(arm), axes.y + reach * math.sin(arm), axes.width / 2
        )
        for arm in axes.arms()
    )
    checks = (
        (RefusalCode.CUT, cut_px, 0.0, cut_px > 0),
        (RefusalCode.OTHER_RADIUS, off, shape.within, off > shape.within),
        (RefusalCode.OTHER_RADIUS, agree, _LEAST_ENDS, agree < _LEAST_ENDS),
        (RefusalCode.FEW_RAYS, share, _LEAST_ARMS, share < _LEAST_ARMS),
        (RefusalCode.FEW_RAYS, worst, _LEAST_ARM, worst < _LEAST_ARM),
        (RefusalCode.FAINT_EDGE, contrast, least_contrast, contrast < least_contrast),
        (RefusalCode.OTHER_MARK, between, _MOST_BETWEEN, between > _MOST_BETWEEN),
        (RefusalCode.OTHER_MARK, lean_deg, _MOST_LEAN_DEG, lean_deg > _MOST_LEAN_DEG),
        (RefusalCode.BLURRED, blurred, blur_limit, blurred > blur_limit),
    )
    refused = tuple(
        CandidateRefusal(code, float(value), limit) for code, value, limit, fails in checks if fails
    )
    return Candidate(axes.x, axes.y, radius, share, rays=share, edge_px=edge_px, refused=refused)


def _ends(
    grey: "Grey", axes: _Axes, radius: float, sign: np.float32, noise: float
) -> list[float | None]:
    """Return how long each arm is, in pixels; ``None`` for one of which no end is seen."""
    step = 0.5
    along = np.arange(0.45 * radius, 1.7 * radius, step, dtype=np.float32)
    beside = axes.width * np.array((-0.25, 0.0, 0.25), np.float32)
    found = list[float | None]()
    for arm in axes.arms():
        levels = sampled(
            grey,
            axes.x + along * math.cos(arm) - beside[:, None] * math.sin(arm),
            axes.y + along * math.sin(arm) + beside[:, None] * math.cos(arm),
        )
        profile = sign * np.median(levels, axis=0).astype(np.float32)
        fall = -smoothed_slope(profile[None], _SMOOTH_PX / step)[0] / step
        at = int(fall.argmax())
        found.append(float(along[at]) if fall[at] > max(0.6, 0.5 * noise) else None)
    return found


def _levels(
    grey: "Grey", axes: _Axes, radius: float, sign: np.float32
) -> tuple[float, float, float]:
    """Return the level on the arms, between them, and how much of that is like an arm.

    What is between two arms is compared with these two: glare lies on one side.
    """
    on, between = list[Numbers](), list[Numbers]()
    arms = axes.arms()
    # Where an arm of the largest width does not reach.
    away = radius * np.linspace(0.55, 0.85, 8, dtype=np.float32)
    for arm, following in zip(arms, (*arms[1:], arms[0] + math.tau), strict=True):
        half = (arm + following) / 2
        on.append(sampled(grey, axes.x + away * math.cos(arm), axes.y + away * math.sin(arm)))
        between.append(
            sampled(grey, axes.x + away * math.cos(half), axes.y + away * math.sin(half))
        )
    faces = np.median(sign * np.stack(on), axis=1)
    grounds = np.median(sign * np.stack(between), axis=1)
    contrast = float(np.median(faces) - np.median(grounds))
    beside = np.minimum(faces, np.roll(faces, -1))
    like = (sign * np.stack(between) > (beside - contrast / 2)[:, None]).mean(axis=1)
    # Dirt between two arms is no arm; an arm between two is between all.
    return float(np.median(faces)), float(np.median(grounds)), float(np.sort(like)[-2])
