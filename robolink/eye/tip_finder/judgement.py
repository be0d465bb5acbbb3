"""Whether a circle is a tip: its edge, its bore, and every reason against it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode, TipShape
from robolink.eye.tip_finder.circles import Circle, circles
from robolink.eye.tip_finder.own_profile import MOST_MOVED, centred_by_profile, on_one_axis
from robolink.eye.tip_finder.rays import (
    COS,
    SIN,
    Edges,
    Floats,
    Unrolled,
    averaged,
    edges_of,
    slopes,
    unrolled,
)

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["Scene", "judged", "scene_of"]

LEAST_RAYS: Final = 0.6
LEAST_BORE_RAYS: Final = 0.5
WORTH_A_LOOK: Final = 0.45
"""Share of the rays below which a circle is not looked at more closely."""

MOST_ASIDE: Final = 0.22
"""Share of the radius by which the bore may be beside the middle."""

LEAST_EDGE: Final = 6.0
LEAST_OF_NOISE: Final = 0.8
"""Height of an edge: so many grey levels, and so many times the noise."""

BORES: Final = (0.18, 0.72)
"""Radii of an untaught bore as shares of the face's: wider ones are rings more often than tips."""

MOST_OVAL_BORE: Final = 0.1
ROUGHEST_BORE: Final = (0.075, 0.05)
"""Shares of the bore's own radius, and pixels, beyond which it is a slot, or chance."""

BORE_AS_TAUGHT: Final = 0.15
"""Share by which a bore may differ from the taught one."""

ROUGH: Final = (0.012, 0.15)
"""Share of the radius and pixels of the edge's scatter beyond which it is rough."""

TEXTURE_RAYS: Final = 2
TEXTURE: Final = 0.04
"""Rays on either side, and smoothing as a share of the radius, by which texture is weakened."""

SMOOTH: Final = 0.008
RAYS_FOR_ROUGHNESS: Final = 5.0
"""A rougher edge needs more rays: edges that are there by chance fit a wide tolerance."""

HEIGHT_FOR_ROUGHNESS: Final = 0.02
"""At this scatter, a share of the radius, the edge has to be twice as high."""

HALVED_BY: Final = 0.04
BORE_HALVED_BY: Final = 0.06
"""Scatter of an edge, as a share of its radius, that halves the score: of a rim, of a bore."""

LEAST_SCORE: Final = 0.38
"""Rays of rim and bore, how round the worse of them is, and one middle: each may be poor, but not
all of them. What is there by chance, or is the head of a screw, is poor in several; a worn tip is
worn at its rim and its bore alike.
"""

GROUND: Final = 0.3
STEEP: Final = 4.2
"""A ring shows the ground: its bore is as bright as what is around it. About such a bore an edge of
untaught width has to be as steep as so many grey levels per pixel of its width: rings far from the
plane of focus are faint and wide. The darker the bore is than the ground, the less is asked, and
nothing where it is so by this share of the face's height.
"""

MOST_OVAL: Final = 0.035
MOST_LOBES: Final = (0.015, 0.6)
"""Scatter, as a share of the radius, and share of it in one wave that make a polygon."""

MOST_BLUR: Final = (14.0, 0.2)
"""Width of an untaught edge: the larger of so many pixels and this share of the radius."""

MOST_OF_TAUGHT: Final = 2.0


@dataclass(frozen=True, slots=True)
class Scene:
    """What all candidates of a picture have in common.

    Attributes:
        grey: The picture.
        shape: What is looked for.
        radius_px: Its radius.
        noise: Standard deviation of the picture's noise, in grey levels.
        smooth_px: How much slopes are smoothed.
    """

    grey: Grey
    shape: TipShape
    radius_px: float
    noise: float
    smooth_px: float

    @property
    def least_height(self) -> float:
        """Return the height of the faintest edge, in grey levels."""
        return max(LEAST_EDGE, LEAST_OF_NOISE * self.noise)

    def least_slope(self, smooth_px: float) -> float:
        """Return the slope, in grey levels per pixel, that noise alone seldom has."""
        # Of noise 1, averaged over two lines, after the derivative of a bell of standard
        # deviation s: 0.375 / sqrt(2) / s ** 1.5.
        of_noise = self.noise * 0.265 / math.pow(smooth_px, 1.5)
        return max(0.5, 2.5 * of_noise, 0.25 * self.least_height / smooth_px)


class Bore(NamedTuple):
    """The edge of a hole inside of a circle.

    Attributes:
        circle: Its edge.
        share: Share of the rays that met it.
        ratio: Its radius as a share of the circle's.
        aside: How far its middle is from the circle's, as a share of the circle's radius.
    """

    circle: Circle
    share: float
    ratio: float
    aside: float

    @property
    def roughness(self) -> float:
        """Return how far its edges scatter, as a share of its own radius."""
        return self.circle.rms_px / self.circle.radius_px


def scene_of(grey: Grey, shape: TipShape, radius_px: float) -> Scene:
    """Return what all candidates of a picture have in common.

    The noise is the median of second differences along some lines: edges and shading are too few
    to matter.

    Args:
        grey: The picture.
        shape: What is looked for.
        radius_px: Its radius.
    """
    lines = grey[:: max(1, grey.shape[0] // 64)].astype(np.float32)
    bend = np.abs(lines[:, 2:] - 2 * lines[:, 1:-1] + lines[:, :-2])
    noise = float(np.median(bend)) / (0.6745 * math.sqrt(6.0)) if bend.size else 0.0
    smooth_px = min(3.0, max(1.0, 0.035 * radius_px))
    return Scene(grey, shape, radius_px, noise, max(smooth_px, 1.5) if noise > 6 else smooth_px)


def judged(scene: Scene, circle: Circle) -> Candidate:
    """Return a circle as a candidate, with every reason against it.

    Args:
        scene: The picture and what is looked for.
        circle: The circle, roughly.
    """
    if circle.share < WORTH_A_LOOK:
        few = CandidateRefusal(RefusalCode.FEW_RAYS, circle.share, LEAST_RAYS)
        return Candidate(*circle[:3], 0.0, circle.share, refused=(few,))
    rays, edges, circle, rough = _finer(scene, circle)
    radius, shape = circle.radius_px, scene.shape
    height, agreeing = _step(scene, circle, reach=0.12, gap=0.03, least_px=3.0)
    share = min(circle.share, agreeing)
    width = _width(rays, edges, circle)
    bore = _bore(scene, circle) if shape.bore else None
    refused = [
        *_faults_of_the_edge(scene, circle, share, height),
        *(_faults_of_the_bore(shape, bore) if shape.bore else ()),
    ]
    limit = max(MOST_BLUR[0], MOST_BLUR[1] * radius)
    if shape.edge_px is not None:
        limit = MOST_OF_TAUGHT * shape.edge_px
    if width > limit:
        refused.append(CandidateRefusal(RefusalCode.BLURRED, width, limit))
    score = _score(share, circle, bore) if bore or not shape.bore else 0.0
    if score < LEAST_SCORE and not refused:
        refused.append(CandidateRefusal(RefusalCode.POOR_FIT, score, LEAST_SCORE))
    steep = STEEP * width
    if bore and shape.edge_px is None and height < steep and not refused:
        steep *= 1 - min(1.0, _below_the_ground(scene, circle, bore.circle) / GROUND)
        if height < steep:
            refused.append(CandidateRefusal(RefusalCode.FAINT_EDGE, height, steep))
    x, y = circle.x_px, circle.y_px
    if not refused and rough:
        middle = centred_by_profile(scene.grey, circle, width)
        moved = math.hypot(middle[0] - x, middle[1] - y) / radius
        if moved > MOST_MOVED:  # the picture about it is not round
            refused.append(CandidateRefusal(RefusalCode.POOR_FIT, moved, MOST_MOVED))
        else:
            x, y = on_one_axis(middle, circle, bore.circle if bore else None)
    return Candidate(
        x, y, radius, score, share, width, bore.ratio if bore else None, tuple(refused)
    )


def _score(share: float, circle: Circle, bore: Bore | None) -> float:
    """Return how well rim and bore fit, 0 to 1: a product, as each part is evidence by itself."""
    uneven = circle.rms_px / circle.radius_px / HALVED_BY
    if bore:
        uneven = max(uneven, bore.roughness / BORE_HALVED_BY)
        share *= bore.share / (1 + (bore.aside / MOST_ASIDE) ** 2)
    return share / (1 + uneven**2)


def _below_the_ground(scene: Scene, circle: Circle, hole: Circle) -> float:
    """Return how much darker a bore is than what is around the face; of a dark face, brighter.

    As a share of the height of the face above the bore, 0 where it is not darker.
    """
    radius, within = circle.radius_px, hole.radius_px
    between = 0.5 * (radius + within)

    def level(of: Circle, start_px: float, end_px: float) -> float:
        step_px = (end_px - start_px) / 8
        rays = unrolled(scene.grey, of.x_px, of.y_px, start_px, end_px, step_px)
        return circle.sign * float(np.median(rays.grey))

    inside = level(hole, 0.0, max(1.5, 0.4 * within))
    face = level(circle, between - 1, between + 1)
    around = level(circle, 1.25 * radius, 1.5 * radius)
    return max(0.0, around - inside) / max(1.0, face - inside)


def _faults_of_the_edge(
    scene: Scene, circle: Circle, share: float, height: float
) -> list[CandidateRefusal]:
    """Return what speaks against a circle as the outline of a face."""
    radius, refused = circle.radius_px, []
    roughness = circle.rms_px / radius
    needed = LEAST_RAYS + RAYS_FOR_ROUGHNESS * max(0.0, roughness - SMOOTH)
    if share < needed:
        refused.append(CandidateRefusal(RefusalCode.FEW_RAYS, share, needed))
    least = scene.least_height * (1 + (roughness / HEIGHT_FOR_ROUGHNESS) ** 2)
    if height < least:
        refused.append(CandidateRefusal(RefusalCode.FAINT_EDGE, height, least))
    if circle.oval > MOST_OVAL:
        refused.append(CandidateRefusal(RefusalCode.NOT_ROUND, circle.oval, MOST_OVAL))
    elif roughness > MOST_LOBES[0] and circle.lobes > MOST_LOBES[1]:
        refused.append(CandidateRefusal(RefusalCode.NOT_ROUND, circle.lobes, MOST_LOBES[1]))
    rows, columns = scene.grey.shape
    room = min(circle.x_px, circle.y_px, columns - 1 - circle.x_px, rows - 1 - circle.y_px)
    if room < radius:
        refused.append(CandidateRefusal(RefusalCode.CUT, room, radius))
    allowed = scene.radius_px * scene.shape.within
    if abs(radius - scene.radius_px) > allowed:
        limit = scene.radius_px + math.copysign(allowed, radius - scene.radius_px)
        refused.append(CandidateRefusal(RefusalCode.OTHER_RADIUS, radius, limit))
    return refused


def _faults_of_the_bore(shape: TipShape, bore: Bore | None) -> list[CandidateRefusal]:
    """Return what speaks against the hole in the middle."""
    if bore is None or bore.share < LEAST_BORE_RAYS:
        return [CandidateRefusal(RefusalCode.NO_BORE, bore.share if bore else 0.0, LEAST_BORE_RAYS)]
    if bore.aside > MOST_ASIDE:
        return [CandidateRefusal(RefusalCode.BORE_ASIDE, bore.aside, MOST_ASIDE)]
    if bore.circle.oval > MOST_OVAL_BORE:
        return [CandidateRefusal(RefusalCode.NOT_ROUND, bore.circle.oval, MOST_OVAL_BORE)]
    roughest = ROUGHEST_BORE[0] + ROUGHEST_BORE[1] / bore.circle.radius_px
    if bore.roughness > roughest:
        return [CandidateRefusal(RefusalCode.NOT_ROUND, bore.roughness, roughest)]
    low, high = _bores(shape)
    if not low <= bore.ratio <= high:
        return [
            CandidateRefusal(RefusalCode.OTHER_BORE, bore.ratio, low if bore.ratio < low else high)
        ]
    return []


def _bores(shape: TipShape) -> tuple[float, float]:
    """Return least and largest radius of the bore as shares of the face's."""
    if shape.bore_ratio is None:
        return BORES
    return (1 - BORE_AS_TAUGHT) * shape.bore_ratio, (1 + BORE_AS_TAUGHT) * shape.bore_ratio


def _finer(scene: Scene, circle: Circle) -> tuple[Unrolled, Edges, Circle, bool]:
    """Return rays from the middle of a circle, their edges, the circle through them, if rough.

    Where the edge is rough, it is looked for once more with rays averaged: the grain of a turned
    face is steeper than its outline, which is out of focus or worn.
    """
    radius = circle.radius_px
    reach = max(6.0, 0.3 * radius)
    rays = unrolled(
        scene.grey,
        circle.x_px,
        circle.y_px,
        max(0.5, radius - reach),
        radius + reach,
        max(0.5, radius / 240),
    )
    edges, found = _nearby(scene, rays, circle, min(scene.smooth_px, 1.5))
    if found is None:
        # An edge that is gone where it is looked at closely was none.
        return rays, edges, circle._replace(share=0.0), False
    if rough := _is_rough(found):
        rays = averaged(rays, TEXTURE_RAYS)
        smooth_px = max(scene.smooth_px, TEXTURE * radius)
        again, smoother = _nearby(scene, rays, circle, smooth_px)
        if smoother is not None and smoother.share >= found.share:
            return rays, again, smoother, True
    return rays, edges, found, rough


def _is_rough(circle: Circle) -> bool:
    return circle.rms_px > ROUGH[0] * circle.radius_px + ROUGH[1]


def _nearby(
    scene: Scene, rays: Unrolled, circle: Circle, smooth_px: float
) -> tuple[Edges, Circle | None]:
    """Return edges along rays from the middle of a circle, and the circle through them."""
    radius = circle.radius_px
    edges = edges_of(rays, slopes(rays, smooth_px), circle.sign, scene.least_slope(smooth_px))
    found = circles(
        rays,
        edges,
        circle.sign,
        radii_px=(0.9 * radius, 1.1 * radius),
        beside_px=0.1 * radius + 1,
        tolerance_px=max(0.8, 0.06 * radius),
        count=1,
    )
    return edges, found[0] if found else None


def _bore(scene: Scene, circle: Circle) -> Bore | None:
    """Return the clearest hole about the middle of a circle."""
    radius = circle.radius_px
    low, high = _bores(scene.shape)
    rays = unrolled(
        scene.grey,
        circle.x_px,
        circle.y_px,
        0.5 * low * radius,
        min(0.95, 1.25 * high) * radius,
        max(0.4, radius / 60),
    )
    smooth_px = max(0.8, 0.8 * scene.smooth_px)
    slope = slopes(rays, smooth_px)
    found = circles(
        rays,
        edges_of(rays, slope, -circle.sign, scene.least_slope(smooth_px)),
        -circle.sign,
        radii_px=(low * radius, min(0.92, 1.1 * high) * radius),
        beside_px=0.3 * radius,
        tolerance_px=max(0.8, 0.05 * radius),
        count=1,
    )
    if not found:
        return None
    hole = found[0]
    _, agreeing = _step(scene, hole, reach=0.3, gap=0.06, least_px=2.0)
    aside = math.hypot(hole.x_px - circle.x_px, hole.y_px - circle.y_px)
    return Bore(hole, min(hole.share, agreeing), hole.radius_px / radius, aside / radius)


def _step(
    scene: Scene, circle: Circle, *, reach: float, gap: float, least_px: float
) -> tuple[float, float]:
    """Return the height of an edge, the median of the rays, and the share that agrees with it.

    Args:
        scene: The picture.
        circle: The edge.
        reach: How far inside and outside of it the levels are taken, as a share of its radius.
        gap: How far from it they begin.
        least_px: At least so far.
    """
    radius = circle.radius_px
    reach_px, gap_px = max(least_px, reach * radius), max(1.0, gap * radius)
    rays = unrolled(
        scene.grey,
        circle.x_px,
        circle.y_px,
        max(0.0, radius - reach_px),
        radius + reach_px,
        max(0.5, reach_px / 12),
    )
    off = rays.distances_px - radius
    inner = off <= max(-gap_px, float(off[0]))
    outer = off >= gap_px
    height = rays.grey[:, inner].mean(axis=1) - rays.grey[:, outer].mean(axis=1)
    height = np.where(rays.inside.all(axis=1), circle.sign * height, np.float32(0))
    middle = float(np.median(height))
    return middle, float(np.mean(height >= 0.3 * max(middle, scene.least_height)))


def _width(rays: Unrolled, edges: Edges, circle: Circle) -> float:
    """Return how wide the edge is, 10 to 90 % in pixels; 0 where no ray met it.

    Of the median of all rays, each shifted so that its own edge lies in the middle: a rough edge in
    focus is narrow. A bell of standard deviation s has a height of s sqrt(2 pi) times its steepest
    slope, and 2.563 s from 10 to 90 %.
    """
    radius = circle.radius_px
    expected = radius + (circle.x_px - rays.x_px) * COS + (circle.y_px - rays.y_px) * SIN
    off = np.abs(edges.distances_px - expected[:, None])
    which = np.argmin(off, axis=1)
    every = np.arange(len(which))
    taken = np.flatnonzero(off[every, which] < max(1.0, 0.06 * radius))
    if taken.size < 12:
        return 0.0
    reach = min(max(4.0, 0.25 * radius), 16.0 + 0.05 * radius)
    steps = math.ceil(reach / 0.5)
    offsets = np.linspace(-reach, reach, 2 * steps + 1, dtype=np.float32)
    at = edges.distances_px[taken, which[taken]][:, None] + offsets
    profile = circle.sign * np.median(_sampled(rays, taken, at), axis=0)
    height = float(profile[: steps + 1].max() - profile[steps:].min())
    step = float(offsets[1] - offsets[0])
    fall = (profile[:-2] - profile[2:]) / (2 * step)
    beside = max(1, round(1.0 / step))
    steepest = float(fall[max(0, steps - 1 - beside) : steps + beside].max())
    return 2.563 / math.sqrt(2 * math.pi) * height / steepest if steepest > 0 else 0.0


def _sampled(rays: Unrolled, taken: npt.NDArray[np.intp], distances_px: Floats) -> Floats:
    """Return the picture along some rays at other distances."""
    last = rays.grey.shape[1] - 1.01
    at = np.clip((distances_px - rays.start_px) / rays.step_px, 0, last)
    low = at.astype(np.intp)
    share = (at - low).astype(np.float32)
    ray = taken[:, None]
    seen: Floats = rays.grey[ray, low] * (1 - share) + rays.grey[ray, low + 1] * share
    return seen
