"""The picture along rays from a middle, and the edges that each ray meets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = [
    "COS",
    "Edges",
    "Floats",
    "RAYS",
    "SIN",
    "Unrolled",
    "averaged",
    "edges_of",
    "slopes",
    "unrolled",
]

Floats = npt.NDArray[np.float32]

RAYS: Final = 96
BESIDE: Final = 2
"""So many neighbouring lines of pixels are averaged for a ray."""

PER_RAY: Final = 3
"""Edges of a ray that are kept, the steepest."""

LEAST_OF_STEEPEST: Final = 0.2
"""Share of the steepest slope of a ray that an edge of it has at least."""

_NOTHING: Final = np.zeros((), np.float32)
_ANGLES: Final = 2 * np.pi * np.arange(RAYS) / RAYS
COS: Final = np.cos(_ANGLES).astype(np.float32)
SIN: Final = np.sin(_ANGLES).astype(np.float32)
_FINE: Final = 2 * np.pi * (np.arange(RAYS * BESIDE) - (BESIDE - 1) / 2) / (RAYS * BESIDE)
_FINE_COS: Final = np.cos(_FINE).astype(np.float32)[:, None]
_FINE_SIN: Final = np.sin(_FINE).astype(np.float32)[:, None]


@dataclass(frozen=True, slots=True)
class Unrolled:
    """The picture along rays.

    Attributes:
        x_px, y_px: Where the rays begin.
        start_px, step_px: Distance of the first column, and between columns.
        grey: Rays by columns.
        inside: Which of them lie in the picture.
    """

    x_px: float
    y_px: float
    start_px: float
    step_px: float
    grey: Floats
    inside: npt.NDArray[np.bool_]

    @property
    def distances_px(self) -> Floats:
        """Return how far each column is from the middle."""
        columns = np.arange(self.grey.shape[1], dtype=np.float32)
        return np.float32(self.start_px) + np.float32(self.step_px) * columns


class Edges(NamedTuple):
    """Edges of one sign.

    Attributes:
        distances_px: Rays by edges, the steepest first; infinite where there is none.
        x_px, y_px: Where they are, seen from the middle; zero where there is none.
    """

    distances_px: Floats
    x_px: Floats
    y_px: Floats


def unrolled(
    grey: Grey, x_px: float, y_px: float, start_px: float, end_px: float, step_px: float
) -> Unrolled:
    """Return the picture along rays, between pixels by straight lines.

    Args:
        grey: The picture, two by two pixels or more.
        x_px: Where the rays begin.
        y_px: The same, downwards.
        start_px: First distance.
        end_px: Last distance.
        step_px: Between two.
    """
    columns = max(5, int(np.ceil((end_px - start_px) / step_px)) + 1)
    distances = (start_px + step_px * np.arange(columns)).astype(np.float32)
    across = np.float32(x_px) + _FINE_COS * distances
    down = np.float32(y_px) + _FINE_SIN * distances
    height, width = grey.shape
    inside = (across >= 0) & (across <= width - 1) & (down >= 0) & (down <= height - 1)
    # In single precision the last pixel of a wide picture less a thousandth would be the last.
    np.clip(across, 0, width - 1.01, out=across)
    np.clip(down, 0, height - 1.01, out=down)
    column, row = across.astype(np.int32), down.astype(np.int32)
    across -= column
    down -= row
    at = row * width + column
    flat = grey.ravel()
    upper = flat[at] * (1 - across) + flat[at + 1] * across
    at += width
    lower = flat[at] * (1 - across) + flat[at + 1] * across
    lower -= upper
    lower *= down
    upper += lower
    shape = (RAYS, BESIDE, columns)
    return Unrolled(
        x_px,
        y_px,
        start_px,
        step_px,
        upper.reshape(shape).mean(axis=1),
        inside.reshape(shape).all(axis=1),
    )


def averaged(rays: Unrolled, beside: int) -> Unrolled:
    """Return the rays, each averaged with so many on either side: texture and wear grow weaker.

    Args:
        rays: The picture along them.
        beside: How many.
    """
    grey = sum((np.roll(rays.grey, i, axis=0) for i in range(-beside, beside + 1)), _NOTHING)
    inside = np.logical_and.reduce(
        [np.roll(rays.inside, i, axis=0) for i in range(-beside, beside + 1)]
    )
    mean = np.asarray(grey / np.float32(2 * beside + 1), np.float32)
    return Unrolled(rays.x_px, rays.y_px, rays.start_px, rays.step_px, mean, inside)


def slopes(rays: Unrolled, smooth_px: float) -> Floats:
    """Return the slope along each ray in grey levels per pixel, 0 outside of the picture.

    Args:
        rays: The picture along them.
        smooth_px: Standard deviation of the bell whose derivative it is.
    """
    sigma = max(0.5, smooth_px / rays.step_px)
    half = int(np.ceil(3 * sigma))
    offsets = np.arange(1, half + 1)
    bell = offsets * np.exp(-0.5 * (offsets / sigma) ** 2)
    kernel = bell / (2 * (bell * offsets).sum() * rays.step_px)
    wide = np.pad(rays.grey, ((0, 0), (half, half)), mode="edge")
    columns = rays.grey.shape[1]
    out = np.zeros_like(rays.grey)
    for i, weight in zip(offsets, kernel.astype(np.float32), strict=True):
        out += weight * (
            wide[:, half + i : half + i + columns] - wide[:, half - i : columns + half - i]
        )
    out[~rays.inside] = 0
    return out


def edges_of(rays: Unrolled, slope: Floats, sign: int, least: float) -> Edges:
    """Return the steepest edges of each ray.

    Args:
        rays: The picture along them.
        slope: Its slope.
        sign: +1 for edges that are brighter inside, -1 for those that are darker.
        least: Slope below which there is none, in grey levels per pixel.
    """
    fall = slope if sign < 0 else -slope
    middle = fall[:, 1:-1]
    steepest = fall.max(axis=1, keepdims=True)
    peak = (middle >= fall[:, :-2]) & (middle > fall[:, 2:])
    peak &= middle > np.maximum(np.float32(least), np.float32(LEAST_OF_STEEPEST) * steepest)
    height = np.where(peak, middle, np.float32(0))
    kept = min(PER_RAY, height.shape[1])
    at = np.argsort(-height, axis=1)[:, :kept] if height.shape[1] <= 12 else _largest(height, kept)
    steep = np.take_along_axis(height, at, axis=1)
    before = np.take_along_axis(fall, at, axis=1)
    after = np.take_along_axis(fall, at + 2, axis=1)
    bend = before - 2 * steep + after
    between = 0.5 * (before - after) / np.where(bend < 0, bend, np.float32(-1e9))
    distance = rays.start_px + rays.step_px * (at + 1 + np.clip(between, -0.5, 0.5))
    there = steep > 0
    distance = np.where(there, distance, np.float32(0)).astype(np.float32)
    return Edges(
        np.where(there, distance, np.float32(np.inf)),
        distance * COS[:, None],
        distance * SIN[:, None],
    )


def _largest(height: Floats, kept: int) -> npt.NDArray[np.intp]:
    """Return the columns of the largest of each row, the largest first."""
    at = np.argpartition(-height, kept - 1, axis=1)[:, :kept]
    order = np.argsort(-np.take_along_axis(height, at, axis=1), axis=1)
    return np.take_along_axis(at, order, axis=1)
