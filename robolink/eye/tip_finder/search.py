"""All that may be a tip in a picture, and why most of it is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from robolink.eye.candidate import Candidate, CandidateRefusal, Polarity, RefusalCode, TipShape
from robolink.eye.tip_finder.circles import circles
from robolink.eye.tip_finder.judgement import Scene, judged, scene_of
from robolink.eye.tip_finder.rays import edges_of, slopes, unrolled
from robolink.eye.tip_finder.votes import places

if TYPE_CHECKING:
    from robolink.eye.picture import Grey


LEAST_RADIUS_PX: Final = 5.0
"""Below it a face with its bore has too few pixels, and nothing is found."""

PLACES: Final = 6
SIGNS: Final = {Polarity.BRIGHT: (1,), Polarity.DARK: (-1,), Polarity.EITHER: (1, -1)}
BESIDE: Final = 0.35
"""Share of the radius by which the votes may miss the middle."""

WORTH_TELLING: Final = 0.35
"""Share of the rays from which a circle becomes a candidate."""

MOST_OF_SHARPEST: Final = (2.5, 4.0)
"""An edge so many times as wide as the sharpest tip's, and so many pixels wider, is behind it."""

AS_GOOD: Final = 0.75
"""Share of the best score from which one of two circles about one middle is as good."""

LARGER: Final = 0.10
"""Share of the stated radius by which the outline of a face may be larger."""

TEACHING_STEP: Final = 1.4
TEACHING_WITHIN: Final = 0.19
SMALLEST: Final = 0.012
LARGEST: Final = 0.45
"""Radii looked for where none is stated, as shares of the picture's shorter side."""


def find_tips(grey: Grey, shape: TipShape) -> tuple[Candidate, ...]:
    """Return all that may be a tip, the accepted ones first, the best of them first.

    docs/reference/eye.md, "The finder" says how it is looked for and how often it was right.

    Args:
        grey: The picture: rows by columns, eight bits, one channel.
        shape: What is known of the tip. Without a radius all sizes are tried, which takes five to
            ten times as long and is for teaching, with a person looking.

    Raises:
        ValueError: It is no grey picture of eight bits.

    Example:
        >>> import numpy as np
        >>> from robolink.eye.candidate import TipShape
        >>> from robolink.eye.tip_finder import find_tips
        >>> y, x = np.mgrid[0:120, 0:160]
        >>> far = np.hypot(x - 90.0, y - 50.0)
        >>> grey = np.where((far < 30) & (far > 12), 200, 20).astype(np.uint8)
        >>> (tip,) = [one for one in find_tips(grey, TipShape(28.0)) if one.accepted]
        >>> round(tip.x_px), round(tip.y_px), round(tip.radius_px)
        (90, 50, 30)
    """
    if grey.ndim != 2 or grey.dtype.name != "uint8":
        told = f"a grey picture of eight bits is needed, not {grey.dtype} of shape {grey.shape}"
        raise ValueError(told)
    if min(grey.shape) < 2 * LEAST_RADIUS_PX:
        return ()
    grey = np.ascontiguousarray(grey)
    if shape.radius_px is not None:
        return _told_apart(_candidates(grey, shape, shape.radius_px), shape.radius_px)
    side, found = min(grey.shape), list[Candidate]()
    radius = max(LEAST_RADIUS_PX, SMALLEST * side)
    while radius <= LARGEST * side:
        found += _candidates(grey, replace(shape, within=TEACHING_WITHIN), radius)
        radius *= TEACHING_STEP
    return _for_teaching(found)


def _candidates(grey: Grey, shape: TipShape, radius_px: float) -> list[Candidate]:
    """Return everything of about this radius."""
    # Half of a cut tip may lie outside; what is larger than the picture has no place in it.
    if not LEAST_RADIUS_PX <= radius_px <= max(grey.shape):
        return []
    scene = scene_of(grey, shape, radius_px)
    found: list[Candidate] = []
    for place in places(grey, radius_px, shape.within, PLACES):
        if not any(_is_at(one, place.x_px, place.y_px) for one in found):
            found += _candidates_at(scene, place.x_px, place.y_px)
    return found


def _is_at(one: Candidate, x_px: float, y_px: float) -> bool:
    """Return whether a place is that of a clear candidate."""
    return one.rays > 0.9 and math.hypot(one.x_px - x_px, one.y_px - y_px) < 0.3 * one.radius_px


def _candidates_at(scene: Scene, x_px: float, y_px: float) -> list[Candidate]:
    """Return every circle about a place."""
    radius, within = scene.radius_px, scene.shape.within
    low, high = (1 - within) * radius, (1 + within) * radius
    beside = BESIDE * radius
    rays = unrolled(
        scene.grey,
        x_px,
        y_px,
        max(1.0, low - beside),
        high + beside,
        max(0.5, radius / 60),
    )
    slope = slopes(rays, scene.smooth_px)
    found = []
    for sign in SIGNS[scene.shape.polarity]:
        edges = edges_of(rays, slope, sign, scene.least_slope(scene.smooth_px))
        found += [
            judged(scene, one)
            for one in circles(
                rays,
                edges,
                sign,
                radii_px=(low, high),
                beside_px=beside + 0.1 * radius,
                tolerance_px=max(1.0, 0.06 * radius),
                count=2,
            )
            if one.share >= WORTH_TELLING
        ]
    return found


def _told_apart(found: Sequence[Candidate], radius_px: float) -> tuple[Candidate, ...]:
    """Return the candidates, of those in one place only the best accepted."""
    left = sorted(_in_focus(found), key=lambda one: (not one.accepted, -one.score))
    kept: list[Candidate] = []
    while left:
        group = [one for one in left if _overlap(one, left[0])]
        left = [one for one in left if not any(one is other for other in group)]
        best = _outline(group, radius_px)
        kept.append(best)
        for one in group:
            if one is not best and not _same(one, best):
                kept.append(_refused_beside(one, best))
    return tuple(sorted(kept, key=lambda one: (not one.accepted, -one.score)))


def _for_teaching(found: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Return the candidates of all sizes, each circle once, the sharpest clear ones first.

    A face lies within a cone, and a bore within a face: which one is meant, a person says.
    """
    kept: list[Candidate] = []
    for one in sorted(found, key=_by_sharpness):
        if not any(_same(one, other) for other in kept):
            kept.append(one)
    return tuple(kept)


def _by_sharpness(one: Candidate) -> tuple[bool, float]:
    return not one.accepted, -one.score / max(one.edge_px or 0.0, 1.0)


def _in_focus(found: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates, those far less sharp than the sharpest accepted one refused."""
    sharpest = min((one.edge_px or 0.0 for one in found if one.accepted), default=0.0)
    limit = max(MOST_OF_SHARPEST[0] * sharpest, sharpest + MOST_OF_SHARPEST[1])
    return [
        replace(one, refused=(CandidateRefusal(RefusalCode.BLURRED, one.edge_px or 0.0, limit),))
        if one.accepted and (one.edge_px or 0.0) > limit
        else one
        for one in found
    ]


def _overlap(one: Candidate, other: Candidate) -> bool:
    apart = math.hypot(one.x_px - other.x_px, one.y_px - other.y_px)
    return apart < 0.9 * max(one.radius_px, other.radius_px)


def _same(one: Candidate, other: Candidate) -> bool:
    apart = math.hypot(one.x_px - other.x_px, one.y_px - other.y_px)
    return max(apart, abs(one.radius_px - other.radius_px)) < 0.05 * other.radius_px


def _outline(group: Sequence[Candidate], radius_px: float) -> Candidate:
    """Return which of the circles in one place is the outline of the face.

    The outermost of the good ones: a chamfer is a second edge inside of it. One that is much larger
    than stated is taken only where there is no other.
    """
    accepted = [one for one in group if one.accepted]
    if not accepted:
        return group[0]
    good = [one for one in accepted if one.score >= AS_GOOD * accepted[0].score]
    small = [one for one in good if one.radius_px <= (1 + LARGER) * radius_px]
    return max(small or good, key=lambda one: one.radius_px)


def _refused_beside(one: Candidate, best: Candidate) -> Candidate:
    """Return a candidate that shares its place with a better one."""
    if not best.accepted:
        return one
    inside = one.radius_px < best.radius_px
    if inside:
        reason = CandidateRefusal(RefusalCode.INSIDE_ANOTHER, one.radius_px, best.radius_px)
    else:
        reason = CandidateRefusal(RefusalCode.WORSE_THAN_ANOTHER, one.score, best.score)
    return replace(one, refused=(*one.refused, reason))
