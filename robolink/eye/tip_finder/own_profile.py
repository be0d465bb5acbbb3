"""The middle of a tip whose rim is rough: by its own radial profile, and by its bore."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from robolink.eye.tip_finder.rays import COS, SIN, unrolled

if TYPE_CHECKING:
    from robolink.eye.picture import Grey
    from robolink.eye.tip_finder.circles import Circle

__all__ = ["MOST_MOVED", "centred_by_profile", "on_one_axis"]

ROUNDS: Final = 6
INSIDE: Final = 0.1
OUTSIDE: Final = 0.2
"""Shares of the radius inside and outside of the edge that are looked at: a worn face is textured,
and what is behind it is out of focus and smooth.
"""

INNER_HALF: Final = 0.7
"""Share of an edge's width, 10 to 90 %, that is inside of its middle as a whole: 1.8 of 2.563
standard deviations.
"""

MOST_MOVED: Final = 0.12
"""Share of the radius beyond which the middle has run away, so that the circle is no outline."""

SETTLED_PX: Final = 0.02
TUKEY: Final = 4.685
"""Width of Tukey's weights in standard deviations, for 95 % efficiency."""

RIM_ERROR: Final = 0.43
BORE_ERROR: Final = 0.26
"""Standard errors of a middle along one axis, as shares of the scatter of its edge. Of an edge that
is beside its circle at 24 to 63 angles, each by itself, the least is 0.26; that of a rim is larger
for the texture beside it.
"""

OFF_AXIS: Final = 0.006
"""How far the bore of a turned tip is off its axis, as a share of the rim's radius."""

MOST_OFF: Final = 0.08
"""Share of the rim's radius by which the two middles may differ; beyond, the bore is eccentric. Up
to there it counts less and less: a step would let the place jump from picture to picture of one
tip, and so would a limit that follows the scatter, which changes with light and focus.
"""


def centred_by_profile(grey: Grey, circle: Circle, edge_px: float) -> tuple[float, float]:
    """Return the middle about which the picture is most alike all the way round.

    The median over all rays is the profile of the tip. The middle moves until what is left of the
    picture no longer looks like a shift of that profile (Gauss-Newton with Tukey's weights).
    Shading and slant that change once or twice on the way round are solved for at the same time.
    It ends where it is further than :data:`MOST_MOVED` from the circle's.

    Args:
        grey: The picture.
        circle: The edge that was found.
        edge_px: How wide it is, 10 to 90 %.
    """
    x, y, radius = circle.x_px, circle.y_px, circle.radius_px
    step = max(0.5, radius / 80)
    outside = OUTSIDE * radius
    inside = min(max(INSIDE * radius, INNER_HALF * edge_px), outside)
    c, s = COS[:, None].astype(np.float64), SIN[:, None].astype(np.float64)
    twice, twice_s = 2 * c * c - 1, 2 * s * c
    for _ in range(ROUNDS):
        rays = unrolled(grey, x, y, radius - inside, radius + outside, step)
        seen = rays.grey.astype(np.float64)
        profile = np.median(seen, axis=0)
        slope = np.gradient(profile, step)
        level = np.ones_like(profile)
        parts = [-c * slope, -s * slope, -twice * slope, -twice_s * slope]
        for wave in (c, s, twice, twice_s):
            parts += [wave * level, wave * profile]
        columns = np.stack([part.ravel() for part in parts], axis=1)
        rest = (seen - profile).ravel()
        size = TUKEY * 1.4826 * float(np.median(np.abs(rest))) + 1e-6
        weighted = columns * (np.clip(1 - (rest / size) ** 2, 0, None) ** 2)[:, None]
        square = weighted.T @ columns
        square += np.eye(len(parts)) * (1e-9 * float(np.trace(square)) + 1e-9)
        change = np.linalg.solve(square, weighted.T @ rest)
        move = np.clip(change[:2], -0.05 * radius, 0.05 * radius)
        x, y = x + float(move[0]), y + float(move[1])
        away = np.hypot(x - circle.x_px, y - circle.y_px) > MOST_MOVED * radius
        if away or np.hypot(*move) < SETTLED_PX:
            break
    return x, y


def on_one_axis(
    middle_px: tuple[float, float], rim: Circle, bore: Circle | None
) -> tuple[float, float]:
    """Return the middle of a rough rim, drawn to that of the bore where the two agree.

    Rim and bore are turned about one axis, and each is worn by itself: their weighted mean errs by
    half as much as the rim alone. The further off a bore is, the less it counts (Tukey's weights):
    one that is further off than their scatter explains is eccentric.

    Args:
        middle_px: The middle of the rim, as well as it is known.
        rim: Its circle.
        bore: That of the bore, ``None`` for a solid tip.
    """
    if bore is None:
        return middle_px
    x, y = middle_px
    of_rim = (RIM_ERROR * rim.rms_px) ** 2
    both = of_rim + (BORE_ERROR * bore.rms_px) ** 2 + (OFF_AXIS * rim.radius_px) ** 2
    dx, dy = bore.x_px - x, bore.y_px - y
    off = np.hypot(dx, dy) / (MOST_OFF * rim.radius_px)
    trust = max(0.0, 1 - float(off) ** 2) ** 2
    return x + trust * of_rim / both * dx, y + trust * of_rim / both * dy
