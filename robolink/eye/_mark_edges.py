"""What finders of fiducials share: smaller pictures, places between pixels, widths of edges."""

import math
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = [
    "Numbers",
    "edge_width",
    "leaves_picture",
    "line_through",
    "local_maxima",
    "noise_of",
    "sampled",
    "shrunk",
    "smoothed_slope",
]

Numbers = npt.NDArray[np.float32]

_NOISE_OF_DIFFERENCES: Final = 1.349 * math.sqrt(2)
"""Distance between the quartiles of the differences of neighbours, for noise of one grey level."""


def shrunk(grey: "Grey", factor: int) -> Numbers:
    """Return the means of squares of ``factor`` pixels; what does not fill one is left out."""
    if factor == 1:
        return grey.astype(np.float32)
    height, width = (side // factor for side in grey.shape)
    cropped = grey[: height * factor, : width * factor]
    rows = np.add.reduceat(cropped, np.arange(0, height * factor, factor), axis=0, dtype=np.uint32)
    both = np.add.reduceat(rows, np.arange(0, width * factor, factor), axis=1)
    result: Numbers = (both / np.float32(factor * factor)).astype(np.float32)
    return result


def sampled(grey: "Grey", x: npt.ArrayLike, y: npt.ArrayLike) -> Numbers:
    """Return grey levels between pixels, linearly; beyond the edge, those of the edge.

    Args:
        grey: A picture of at least 2 by 2 pixels.
        x: Places in pixels, to the right.
        y: The same, down; of the same shape.
    """
    height, width = grey.shape
    px = np.clip(np.asarray(x, np.float32), 0, width - 1.001)
    py = np.clip(np.asarray(y, np.float32), 0, height - 1.001)
    column, row = px.astype(np.intp), py.astype(np.intp)
    fx, fy = px - column, py - row
    flat = grey.ravel()
    at = row * width + column
    upper = flat[at] * (1 - fx) + flat[at + 1] * fx
    lower = flat[at + width] * (1 - fx) + flat[at + width + 1] * fx
    result: Numbers = (upper * (1 - fy) + lower * fy).astype(np.float32)
    return result


def noise_of(grey: "Grey") -> float:
    """Return the noise of a picture in grey levels, by the differences of neighbours.

    Quartiles, so that edges do not count; never below that of rounding.
    """
    rows = grey[:: max(1, grey.shape[0] // 100)].astype(np.int16)
    differences = np.diff(rows, axis=1).ravel()
    low, high = np.percentile(differences, (25, 75))
    return max(0.3, float(high - low) / _NOISE_OF_DIFFERENCES)


def smoothed_slope(profiles: Numbers, sigma: float) -> Numbers:
    """Return the slopes of profiles (one a row), each through a Gaussian, per sample.

    Args:
        profiles: Grey levels.
        sigma: Width of the Gaussian in samples.
    """
    reach = max(1, math.ceil(3 * sigma))
    places = np.arange(-reach, reach + 1, dtype=np.float32)
    kernel = places * np.exp(-0.5 * (places / sigma) ** 2)
    kernel /= float((kernel * places).sum())
    padded = np.pad(profiles, ((0, 0), (reach, reach)), mode="edge")
    count = profiles.shape[1]
    slope = np.zeros_like(profiles)
    for k, weight in enumerate(kernel):
        slope += weight * padded[:, k : k + count]
    return slope


def edge_width(profile: Numbers, step: float) -> float | None:
    """Return the width of a rising edge, 10 to 90 %; ``None`` where there is none.

    Args:
        profile: Grey levels across the edge, which lies in the middle.
        step: Distance between two of them, in pixels.
    """
    quarter = max(1, len(profile) // 5)
    low, high = float(np.median(profile[:quarter])), float(np.median(profile[-quarter:]))
    if high - low <= 0:
        return None
    share = (profile - low) / (high - low)
    middle = len(share) // 2
    below = np.flatnonzero(share[: middle + 1] <= 0.1)
    above = np.flatnonzero(share[middle:] >= 0.9)
    if not len(below) or not len(above):
        return None
    first, last = int(below[-1]), int(above[0]) + middle
    begin = first + _part(share, first, 0.1)
    end = last - 1 + _part(share, last - 1, 0.9)
    return max(0.0, (end - begin) * step)


def _part(share: Numbers, at: int, level: float) -> float:
    if at < 0 or at + 1 >= len(share):
        return 0.0
    rise = float(share[at + 1] - share[at])
    return min(1.0, max(0.0, (level - float(share[at])) / rise)) if rise > 0 else 0.0


def line_through(along: Numbers, middles: Numbers, *, tolerance: float) -> tuple[float, float]:
    """Return place and slope of a line through points, some of which are wrong."""
    weight = np.ones_like(along)
    place = slope = 0.0
    for _ in range(6):
        total = float(weight.sum())
        mean_t = float((weight * along).sum()) / total
        mean_m = float((weight * middles).sum()) / total
        spread = float((weight * (along - mean_t) ** 2).sum())
        if spread > 0:
            slope = float((weight * (along - mean_t) * (middles - mean_m)).sum()) / spread
        place = mean_m - slope * mean_t
        off = abs(middles - place - slope * along)
        scale = max(tolerance, 2 * float(np.median(off)))
        weight = (1 / (1 + (off / scale) ** 4)).astype(np.float32)
    return place, slope


def local_maxima(votes: Numbers, *, apart: int, count: int, least: float) -> list[tuple[int, int]]:
    """Return the highest places of a picture of votes, as (column, row).

    Args:
        votes: Them.
        apart: Distance that two have at least, in its pixels.
        count: How many at most.
        least: Votes that one has at least.
    """
    left = votes.copy()
    found = list[tuple[int, int]]()
    for _ in range(count):
        row, column = np.unravel_index(int(left.argmax()), left.shape)
        if left[row, column] < least:
            break
        found.append((int(column), int(row)))
        left[
            max(0, row - apart) : row + apart + 1, max(0, column - apart) : column + apart + 1
        ] = -np.inf
    return found


def leaves_picture(grey: "Grey", x_px: float, y_px: float, reach_px: float) -> float:
    """Return by how many pixels a circle leaves a picture; nought or less where it is inside."""
    height, width = grey.shape
    inside = min(x_px, y_px, width - 1 - x_px, height - 1 - y_px)
    return float(reach_px - inside)
