"""The middle of a tip by its own radial profile, for edges that are not round."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from robolink.eye.tip_finder.rays import COS, SIN, unrolled

if TYPE_CHECKING:
    from robolink.eye.picture import Grey
    from robolink.eye.tip_finder.circles import Circle

__all__ = ["centred_by_profile"]

ROUNDS: Final = 6
REACH: Final = 0.2
"""Share of the radius inside and outside of the edge that is looked at."""

MOST_MOVED: Final = 0.12
"""Share of the radius beyond which the middle has run away."""

SETTLED_PX: Final = 0.02
TUKEY: Final = 4.685
"""Width of Tukey's weights in standard deviations, for 95 % efficiency."""


def centred_by_profile(grey: Grey, circle: Circle) -> tuple[float, float] | None:
    """Return the middle about which the picture is most alike all the way round.

    The median over all rays is the profile of the tip. The middle moves until what is left of the
    picture no longer looks like a shift of that profile (Gauss-Newton with Tukey's weights).
    Shading and slant that change once or twice on the way round are solved for at the same time.

    Args:
        grey: The picture.
        circle: The edge that was found.

    Returns:
        The middle, ``None`` where it did not settle near the circle's.
    """
    x, y, radius = circle.x_px, circle.y_px, circle.radius_px
    step = max(0.5, radius / 80)
    c, s = COS[:, None].astype(np.float64), SIN[:, None].astype(np.float64)
    twice, twice_s = 2 * c * c - 1, 2 * s * c
    for _ in range(ROUNDS):
        rays = unrolled(grey, x, y, (1 - REACH) * radius, (1 + REACH) * radius, step)
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
        if np.hypot(x - circle.x_px, y - circle.y_px) > MOST_MOVED * radius:
            return None
        if np.hypot(*move) < SETTLED_PX:
            return x, y
    return x, y
