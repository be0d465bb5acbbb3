"""What others find circles with, by OpenCV, to be compared with the finder of robolink.

Each is told the radius and answers all circles that it would take. Their parameters were chosen
once, after what is published, and scaled to the radius; nobody has tuned them.
"""

import math
from collections.abc import Callable
from typing import Any, Final

import cv2
import numpy as np

Circles = list[tuple[float, float, float]]

WITHIN: Final = 0.2
SHRUNK_PX: Final = 20.0


def _shrunk(grey: Any, radius_px: float) -> tuple[Any, float]:
    """Return the picture shrunk until the radius is twenty pixels, and by how much."""
    share = min(1.0, SHRUNK_PX / radius_px)
    if share == 1.0:
        return grey, share
    return cv2.resize(grey, None, fx=share, fy=share, interpolation=cv2.INTER_AREA), share


def hough(grey: Any, radius_px: float) -> Circles:
    """Return what HOUGH_GRADIENT finds, with OpenPnP's first threshold."""
    small, share = _shrunk(grey, radius_px)
    radius = radius_px * share
    found = cv2.HoughCircles(
        cv2.GaussianBlur(small, (5, 5), 1.2),
        cv2.HOUGH_GRADIENT,
        dp=1,
        minDist=1.5 * radius,
        param1=80,
        param2=25,
        minRadius=round((1 - WITHIN) * radius),
        maxRadius=round((1 + WITHIN) * radius),
    )
    if found is None:
        return []
    back = 1 / share
    return [
        ((x + 0.5) * back - 0.5, (y + 0.5) * back - 0.5, r * back)
        for x, y, r in found.reshape(-1, 3).tolist()
    ]


def blob(grey: Any, radius_px: float) -> Circles:
    """Return what SimpleBlobDetector finds, with the circularity of TAMV."""
    limits = cv2.SimpleBlobDetector.Params()
    limits.filterByColor = False  # it looks at the middle, which is the bore
    limits.filterByArea = True
    limits.minArea = math.pi * ((1 - WITHIN) * radius_px) ** 2
    limits.maxArea = math.pi * ((1 + WITHIN) * radius_px) ** 2
    limits.filterByCircularity = True
    limits.minCircularity = 0.8
    limits.filterByConvexity = False
    limits.filterByInertia = True
    limits.minInertiaRatio = 0.3
    found = cv2.SimpleBlobDetector.create(limits).detect(grey)
    return [(one.pt[0], one.pt[1], one.size / 2) for one in found]


def ellipse(grey: Any, radius_px: float) -> Circles:
    """Return ellipses through contours of Canny's edges that most directions meet (RANSAC)."""
    edges = cv2.Canny(cv2.GaussianBlur(grey, (5, 5), 1.4), 30, 80)
    contours, _ = cv2.findContours(edges, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    dice, found = np.random.default_rng(1), list[tuple[float, float, float, float]]()
    for contour in contours:
        points = contour.reshape(-1, 2).astype(np.float32)
        if len(points) < 2.5 * radius_px:
            continue
        best = _through(points, radius_px, dice)
        if best is not None and best[3] >= 0.6:
            found.append(best)
    kept: Circles = []
    for x, y, r, _ in sorted(found, key=lambda one: -one[3]):
        if all(math.hypot(x - a, y - b) > 0.9 * radius_px for a, b, _ in kept):
            kept.append((x, y, r))
    return kept


def _through(points: Any, radius_px: float, dice: Any) -> tuple[float, float, float, float] | None:
    """Return the ellipse that the most directions of a contour meet, and their share."""
    best = None
    for turn in range(12):
        some = points if turn == 0 else points[dice.choice(len(points), 12, replace=False)]
        try:
            (x, y), (a, b), _ = cv2.fitEllipse(some)
        except cv2.error:
            continue
        r = (a + b) / 4
        if not (1 - WITHIN) * radius_px < r < (1 + WITHIN) * radius_px or min(a, b) < 0.8 * max(
            a, b
        ):
            continue
        off = np.hypot(points[:, 0] - x, points[:, 1] - y)
        on = np.abs(off - r) < max(1.0, 0.06 * r)
        turned = np.arctan2(points[on, 1] - y, points[on, 0] - x)
        share = len(np.unique((turned / (2 * math.pi) * 72).astype(int))) / 72
        if best is None or share > best[3]:
            best = (float(x), float(y), float(r), share)
    return best


OTHERS: Final[dict[str, Callable[[Any, float], Circles]]] = {
    "Hough gradient": hough,
    "blob": blob,
    "contour, ellipse": ellipse,
}
