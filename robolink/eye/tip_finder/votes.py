"""Where a circle may be: each edge pixel votes for the middles that its gradient points to.

The picture is shrunk first, so that the circle is some ten pixels in radius: a rough place is all
that is wanted of the votes, and the rays look at the full picture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["VotedPlace", "places"]

_Floats = npt.NDArray[np.float32]
_Counts = npt.NDArray[np.uint32]

SMALL_PX: Final = 9.0
"""Least radius after shrinking; a picture is shrunk by a whole number."""

RADII_STEP: Final = 0.09
"""Step of the radii voted for, as a share of the radius."""

MOST_EDGES: Final = 40_000
"""So many edge pixels vote at most, those with the steepest gradient."""

MARGIN: Final = 0.6
"""Middles as far outside of the picture as this share of the radius are found too: cut tips."""


class VotedPlace(NamedTuple):
    """A rough middle in the full picture.

    Attributes:
        x_px, y_px: Where.
        votes: Share of a whole circle's votes that it got.
    """

    x_px: float
    y_px: float
    votes: float


def places(grey: Grey, radius_px: float, within: float, count: int) -> list[VotedPlace]:
    """Return the places with the most votes, the first with the most.

    Args:
        grey: The picture.
        radius_px: Radius in its pixels.
        within: Share by which the radius may differ.
        count: How many at most.
    """
    factor = max(1, int(radius_px / SMALL_PX))
    small = _shrunk(grey, factor)
    if min(small.shape) < 3:
        return []
    rows, columns, gx, gy = _edges(small)
    if not rows.size:
        return []
    radius = radius_px / factor
    pad = int(radius * MARGIN) + 2
    steps = max(1, round(within / RADII_STEP))
    shares = 1.0 + within * np.arange(-steps, steps + 1) / steps
    votes = np.zeros((small.shape[0] + 2 * pad, small.shape[1] + 2 * pad), np.float32)
    for share in shares:
        reach = radius * share
        one = _votes(rows, columns, gx * reach, gy * reach, votes.shape, pad)
        whole = np.float32(2 * np.pi * reach)
        np.maximum(votes, _boxed(one).astype(np.float32) / whole, out=votes)
    return [
        VotedPlace(
            (column - pad + 0.5) * factor - 0.5,
            (row - pad + 0.5) * factor - 0.5,
            float(share),
        )
        for row, column, share in _peaks(votes, count, max(2, int(0.35 * radius)))
    ]


def _shrunk(grey: Grey, factor: int) -> _Floats:
    """Return the means of squares of so many pixels; what is left over at the end is cut off."""
    if factor == 1:
        return grey.astype(np.float32)
    height, width = (side // factor * factor for side in grey.shape)
    # Sixteen bits hold the sum of 16 by 16 pixels.
    kind = np.dtype(np.uint16 if factor <= 16 else np.uint32)
    tall = np.zeros((height // factor, width), kind)
    for i in range(factor):
        np.add(tall, grey[i:height:factor, :width], out=tall)
    flat = np.zeros((height // factor, width // factor), kind)
    for i in range(factor):
        np.add(flat, tall[:, i::factor], out=flat)
    return flat.astype(np.float32) / np.float32(factor * factor)


def _edges(
    small: _Floats,
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], _Floats, _Floats]:
    """Return rows, columns and unit gradients of the edge pixels."""
    smooth = small[:-2] + 2 * small[1:-1] + small[2:]
    smooth = (smooth[:, :-2] + 2 * smooth[:, 1:-1] + smooth[:, 2:]) / 16
    gx, gy = np.zeros_like(smooth), np.zeros_like(smooth)
    gx[:, 1:-1] = smooth[:, 2:] - smooth[:, :-2]
    gy[1:-1] = smooth[2:] - smooth[:-2]
    steep = gx * gx + gy * gy
    thinned = steep[::3, ::3]
    limit = max(1.0, 9.0 * float(np.median(thinned)))
    if np.count_nonzero(thinned > limit) * 9 > MOST_EDGES:
        limit = float(np.partition(thinned, -(MOST_EDGES // 9), axis=None)[-(MOST_EDGES // 9)])
    at = np.flatnonzero(steep > limit)
    rows, columns = np.divmod(at, steep.shape[1])
    size = np.sqrt(steep.ravel()[at])
    return rows + 1, columns + 1, gx.ravel()[at] / size, gy.ravel()[at] / size


def _votes(
    rows: npt.NDArray[np.intp],
    columns: npt.NDArray[np.intp],
    dx: _Floats,
    dy: _Floats,
    shape: tuple[int, int],
    pad: int,
) -> _Counts:
    """Return how many edge pixels point to each place, along and against their gradient."""
    at = []
    for sign in (1, -1):
        row = np.rint(rows + sign * dy).astype(np.intp) + pad
        column = np.rint(columns + sign * dx).astype(np.intp) + pad
        inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
        at.append(row[inside] * shape[1] + column[inside])
    counts = np.bincount(np.concatenate(at), minlength=shape[0] * shape[1])
    return counts.reshape(shape).astype(np.uint32)


def _boxed(votes: _Counts) -> _Counts:
    """Return sums over three by three places."""
    tall = votes.copy()
    np.add(tall[1:], votes[:-1], out=tall[1:])
    np.add(tall[:-1], votes[1:], out=tall[:-1])
    out = tall.copy()
    np.add(out[:, 1:], tall[:, :-1], out=out[:, 1:])
    np.add(out[:, :-1], tall[:, 1:], out=out[:, :-1])
    return out


def _peaks(votes: _Floats, count: int, apart: int) -> list[tuple[int, int, float]]:
    """Return the largest values, none nearer than so far to a larger one."""
    left = votes.copy()
    found: list[tuple[int, int, float]] = []
    for _ in range(count):
        row, column = divmod(int(np.argmax(left)), left.shape[1])
        if (value := float(left[row, column])) <= 0:
            break
        found.append((row, column, value))
        left[max(0, row - apart) : row + apart + 1, max(0, column - apart) : column + apart + 1] = 0
    return found
