"""Soft shapes on grey pictures: what drawn pictures are made of, on numpy alone.

A blurred edge is drawn as the step that a Gaussian makes of it, not by blurring the picture: the
same to second order in width over radius, and a tenth of the time.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import numpy.typing as npt

from robolink_simulators.pictures.scene import Placed

Grey = npt.NDArray[np.float32]
"""Brightness, rows by columns; 0 is black, 255 white."""

PIXEL_VARIANCE: Final = 1 / 12
"""Variance of the place of light inside of a pixel, in pixels squared: each sums over its area."""

_WIDTH: Final = 4.0
_STEPS: Final = 1024


@cache
def _step_table() -> Grey:
    """Return the Gaussian's integral from -4 to 4 standard deviations, in equal steps."""
    at = np.linspace(-_WIDTH, _WIDTH, 2 * _STEPS + 1)
    return np.array([0.5 * (1 + math.erf(x / math.sqrt(2))) for x in at], np.float32)


def soft_step(inside: Grey, sigma: float) -> Grey:
    """Return how much of a blurred shape there is: 0 outside, 1 inside, one half on its edge.

    Args:
        inside: How far inside of the edge each pixel is; negative outside.
        sigma: Standard deviation of the blur, in the same unit.
    """
    scaled = inside * np.float32(_STEPS / _WIDTH / sigma)
    scaled += np.float32(_STEPS + 0.5)
    np.clip(scaled, 0, 2 * _STEPS, out=scaled)
    return _step_table()[scaled.astype(np.int32)]


def round_edge(radius: float, sigma: float) -> float:
    """Return where one half of a blurred disc's brightness is: a little inside of its edge.

    Its area stays as it is: that of the step with this radius is pi (r'^2 + sigma^2).
    """
    return math.sqrt(max(radius * radius - sigma * sigma, 0.25 * radius * radius))


def disc(distance: Grey, radius: float, sigma: float) -> Grey:
    """Return how much of a blurred disc there is, given the distance from its middle."""
    return soft_step(np.float32(round_edge(radius, sigma)) - distance, sigma)


def lay(grey: Grey, cover: Grey, brightness: Grey | float) -> None:
    """Lay something over a picture, where ``cover`` says how much of it there is."""
    grey += cover * (brightness - grey)


@dataclass(frozen=True, slots=True)
class Patch:
    """A rectangle of a picture that holds all of a shape.

    Attributes:
        rows, columns: Which part.
        x, y: Of the middle of each pixel in it, seen from the place that it was made for, pixels.
    """

    rows: slice
    columns: slice
    x: Grey
    y: Grey

    @classmethod
    def about(
        cls, at: tuple[float, float], reach: float, size_px: tuple[int, int]
    ) -> "Patch | None":
        """Return the one that reaches so far about a place; ``None``: not in the picture.

        Args:
            at: The place; (0, 0) is the corner of the first pixel.
            reach: How far, in pixels.
            size_px: Width and height of the picture.
        """
        (x, y), (width, height) = at, size_px
        left, right = max(0, math.floor(x - reach)), min(width, math.ceil(x + reach))
        top, bottom = max(0, math.floor(y - reach)), min(height, math.ceil(y + reach))
        if left >= right or top >= bottom:
            return None
        across = (np.arange(left, right) + 0.5 - x).astype(np.float32)[None, :]
        down = (np.arange(top, bottom) + 0.5 - y).astype(np.float32)[:, None]
        shape = (bottom - top, right - left)
        return cls(
            slice(top, bottom),
            slice(left, right),
            np.broadcast_to(across, shape),
            np.broadcast_to(down, shape),
        )

    def of(self, grey: Grey) -> Grey:
        """Return that part of a picture, to be drawn on."""
        return grey[self.rows, self.columns]


def own_coordinates(patch: Patch, placed: Placed) -> tuple[Grey, Grey]:
    """Return where each pixel of a patch about something is in its own X and Y, mm."""
    (a, b), (c, d) = placed.mm_per_px
    x, y = patch.x, patch.y
    return (
        np.float32(a) * x + np.float32(b) * y,
        np.float32(c) * x + np.float32(d) * y,
    )


def enlarged(coarse: Grey, size_px: tuple[int, int]) -> Grey:
    """Return a coarse picture drawn out to a size, straight lines between its points."""
    width, height = size_px
    down, across = _weights(coarse.shape[0], height), _weights(coarse.shape[1], width)
    return (down @ coarse @ across.T).astype(np.float32)


def _weights(points: int, pixels: int) -> Grey:
    """Return by which part each of some equally spaced points counts at each pixel."""
    place = np.linspace(0, points - 1, pixels)
    near: Grey = np.maximum(0, 1 - np.abs(place[:, None] - np.arange(points))).astype(np.float32)
    return near


def textured(u: Grey, v: Grey, seed: int, grain: int = 32) -> Grey:
    """Return a random pattern with mean 0 and deviation 1 that is fixed to coordinates.

    Args:
        u: The first coordinate, -1 to 1; the pattern repeats beyond.
        v: The second one.
        seed: Of the pattern.
        grain: How many grains there are from -1 to 1.
    """
    table = np.random.default_rng(seed).standard_normal((grain, grain)).astype(np.float32)
    x, y = (u + 1) * (grain / 2), (v + 1) * (grain / 2)
    left, top = np.floor(x), np.floor(y)
    x, y = x - left, y - top
    at_x, at_y = left.astype(np.int32) % grain, top.astype(np.int32) % grain
    next_x, next_y = (at_x + 1) % grain, (at_y + 1) % grain
    upper = table[at_y, at_x] * (1 - x) + table[at_y, next_x] * x
    lower = table[next_y, at_x] * (1 - x) + table[next_y, next_x] * x
    # Between four points values scatter by two thirds of what they do on a point.
    pattern: Grey = (upper * (1 - y) + lower * y) * np.float32(1.5)
    return pattern
