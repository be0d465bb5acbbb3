"""Where the robot stops before each touch: beside and above the pin, by a distance that is drawn.

A person who brings the tip onto the pin undoes that distance; who only presses ENTER does not, and
no other needle looks the same (docs/reference/evidence.md 1).
"""

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robolink.calibration.core.robust import Floats
from robolink.calibration.core.rotations import pose_arrays
from robolink.calibration.touch.touch_limits import FARTHEST_MM, LEVELS_MM, NEAREST_MM
from robolink.model import Pose

LEAST_UNEXPLAINED_MM2: Final = 0.28
"""For each touch beyond the second: the part of the squared standoffs that no pin and no needle
could explain as well, so that the test of them finds what it is for."""

_MOST_DRAWS: Final = 1000
"""A draw is kept in about one of three; where the angles leave no room the best one is taken."""


@dataclass(frozen=True, slots=True)
class Standoff:
    """How far from the pin the tip stops, base, mm.

    Attributes:
        x_mm, y_mm: Sideways.
        z_mm: Above.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: float = 0.0


NO_STANDOFF: Final = Standoff()
"""That of a touch to which the person brought the tip from wherever it was."""


class StandoffSeries:
    """Draws the standoffs of one measurement, one after the other.

    Args:
        seed: Of the run; the same one gives the same standoffs.
        clearance_mm: Least height above the pin.
        sideways: Whether the tip also stops beside the pin; a contact input does without.
        planar: Whether the tool stands upright in all touches, so that heights are compared as
            they are.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import StandoffSeries
        >>> series = StandoffSeries(seed=7, clearance_mm=2)
        >>> standoff = series.next([], Pose(0, 0, 0, 90))
        >>> standoff.z_mm >= 2
        True
    """

    def __init__(
        self, seed: int, clearance_mm: float, *, sideways: bool = True, planar: bool = True
    ) -> None:
        self.seed = seed
        self._random = random.Random(f"standoff {seed}")
        self._clearance_mm = clearance_mm
        self._sideways = sideways
        self._planar = planar
        self._levels: list[float] = []
        self._last_mm = math.nan

    def next(self, taken: Sequence[tuple[Pose, Standoff]], orientation: Pose) -> Standoff:
        """Return where to stop before the next touch.

        Args:
            taken: The touches so far that count, with the standoff before each.
            orientation: In which the next one is made; only the angles count.
        """
        level_mm = self._next_level()
        poses = [pose for pose, _ in taken] + [orientation]
        before = [standoff for _, standoff in taken]
        needed_mm2 = LEAST_UNEXPLAINED_MM2 * (len(poses) - 2)
        best, most_mm2 = self._drawn(level_mm), -1.0
        # Three touches of a leaning tool leave no direction that pin and needle do not explain.
        if not self._sideways or len(poses) < (3 if self._planar else 4):
            return best
        explained = _basis(pin_columns(poses, planar=self._planar))
        for _ in range(_MOST_DRAWS):
            one = self._drawn(level_mm)
            found_mm2 = _unexplained_mm2(explained, [*before, one], planar=self._planar)
            if found_mm2 > most_mm2:
                best, most_mm2 = one, found_mm2
            if found_mm2 >= needed_mm2:
                break
        return best

    def _drawn(self, level_mm: float) -> Standoff:
        height_mm = self._clearance_mm + level_mm
        if not self._sideways:
            return Standoff(z_mm=height_mm)
        rho_mm = self._random.uniform(NEAREST_MM, FARTHEST_MM)
        way = self._random.uniform(0.0, math.tau)
        return Standoff(rho_mm * math.cos(way), rho_mm * math.sin(way), height_mm)

    def _next_level(self) -> float:
        """Return one of the levels: each once before any comes again, and never twice in a row."""
        if not self._levels:
            self._levels = self._random.sample(LEVELS_MM, len(LEVELS_MM))
            if self._levels[-1] == self._last_mm:
                self._levels.reverse()
        self._last_mm = self._levels.pop()
        return self._last_mm


def pin_columns(poses: Sequence[Pose], *, planar: bool) -> Floats:
    """Return the design matrix of a tip on one pin: the pin's place, and the tip's in the flange.

    The flange is at ``pin - R tip`` (docs/reference/calibration.md 1.1), so a touch has the rows
    ``(1, -R)``, of X and Y alone where the tool stands upright.

    Args:
        poses: Flange poses, mm and degrees.
        planar: Whether to take X and Y only.

    Returns:
        Two or three rows a pose, and twice as many columns.
    """
    axes = 2 if planar else 3
    turned = pose_arrays(poses)[1][:, :axes, :axes]
    ones = np.broadcast_to(np.eye(axes), turned.shape)
    columns: Floats = np.concatenate([ones, -turned], axis=2).reshape(-1, 2 * axes)
    return columns


def standoff_columns(standoffs: Sequence[Standoff], *, planar: bool) -> Floats:
    """Return how a touch left at its standoff would show: sideways, and in space in height too.

    Returns:
        As many rows as :func:`pin_columns`; one column, in space two.
    """
    sideways = np.array([(one.x_mm, one.y_mm, 0.0) for one in standoffs])
    if planar:
        return sideways[:, :2].reshape(-1, 1)
    upward = np.array([(0.0, 0.0, one.z_mm) for one in standoffs])
    return np.stack([sideways.ravel(), upward.ravel()], axis=1)


def _basis(columns: Floats) -> Floats:
    """Return orthonormal columns that span the same."""
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    kept: Floats = left[:, singular > singular[0] * 1e-9]
    return kept


def _unexplained_mm2(explained: Floats, standoffs: Sequence[Standoff], *, planar: bool) -> float:
    """Return the sum of squares of what pin and needle leave of the standoffs, at its weakest."""
    columns = standoff_columns(standoffs, planar=planar)
    left = columns - explained @ (explained.T @ columns)
    weakest: float = np.linalg.svd(left, compute_uv=False)[-1]
    return float(weakest) ** 2
