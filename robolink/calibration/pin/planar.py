"""One tip on one point at known angles, in the plane, as complex numbers.

With the flange at p and z = exp(iU), the tip is at p + z t. Taking means off leaves one
unknown, and the least squares over all poses is a division (docs/reference/calibration.md 1.1,
2.1):

    t = -sum(conj(z - mean z) p) / sum |z - mean z|^2,   P = mean p + mean z t

The angles are used as the controller knows them; nothing is fitted to an unlabelled circle.
Under a flange that stands on its head (W = 180) the Y of the tip counts the other way, so that
t is the conjugate.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robolink.calibration.core.robust import (
    Agreement,
    Consensus,
    Floats,
    Indices,
    Mask,
    Robust,
    largest_consensus,
)

Complexes = NDArray[np.complex128]

UNKNOWNS = 4

_NEARLY_PARALLEL = 0.2
"""Samples of two poses that differ by less than about 11 degrees are not believed."""


@dataclass(frozen=True, slots=True)
class PlanarFit:
    """The tip and the point that it touched, mm, as x + iy.

    Attributes:
        tip: Offset in the flange's axes.
        point: The touched point in the base.
        residuals: Where each tip lies from that point.
        weight: Sum of |z - mean z|^2: how much the angles tell.
        mean: Of z, over the poses that count: 0 for angles that balance, near 1 in size when they
            are all alike.
    """

    tip: complex
    point: complex
    residuals: Complexes
    weight: float
    mean: complex

    @property
    def sigma_gain(self) -> float:
        """Standard deviation of each offset axis, in those of one coordinate."""
        return 1 / math.sqrt(self.weight)

    @property
    def condition_number(self) -> float:
        """Of the 2N x 4 system in offset and point."""
        imbalance = min(abs(self.mean), 1 - 1e-16)
        return math.sqrt((1 + imbalance) / (1 - imbalance))


def fit_planar(p: Complexes, z: Complexes, kept: Mask | None = None) -> PlanarFit:
    """Return the least squares of the kept poses; residuals are those of all poses."""
    chosen_p, chosen_z = (p, z) if kept is None else (p[kept], z[kept])
    # A sum by itself: ``mean`` costs three times that at a few poses.
    mean_p, mean_z = (
        complex(chosen_p.sum()) / chosen_p.size,
        complex(chosen_z.sum()) / chosen_z.size,
    )
    turned = chosen_z - mean_z
    weight = float(np.vdot(turned, turned).real)
    tip = -complex(np.vdot(turned, chosen_p - mean_p)) / weight
    point = mean_p + mean_z * tip
    return PlanarFit(tip, point, p + z * tip - point, weight, mean_z)


def planar_consensus(
    p: Complexes, z: Complexes, robust: Robust, *, sigma_mm: float | None
) -> Consensus:
    """Return which poses belong together.

    Raises:
        CalibrationError: ``too_many_outliers``.
    """

    def of_samples(samples: Indices) -> Floats:
        first, second = samples.T
        turned = z[first] - z[second]
        parallel = np.abs(turned) < _NEARLY_PARALLEL
        tips = (p[second] - p[first]) / np.where(parallel, 1.0, turned)
        points = p[first] + z[first] * tips
        distances: Floats = np.abs(p + z * tips[:, None] - points[:, None])
        distances[parallel] = np.inf
        return distances

    def of_fit(kept: Mask) -> Floats | None:
        chosen = z[kept]
        if chosen.size < 2 or np.abs(chosen - chosen[0]).max() < _NEARLY_PARALLEL:
            return None
        residuals: Floats = np.abs(fit_planar(p, z, kept).residuals)
        return residuals

    agreement = Agreement(z.size, 2, 2, UNKNOWNS, of_samples, of_fit)
    return largest_consensus(agreement, robust, sigma_mm=sigma_mm)


def as_rotations(z: Complexes) -> Floats:
    """Return exp(iU) as N x 2 x 2 rotations."""
    turned = np.empty((z.size, 2, 2))
    turned[:, 0, 0] = turned[:, 1, 1] = z.real
    turned[:, 1, 0], turned[:, 0, 1] = z.imag, -z.imag
    return turned
