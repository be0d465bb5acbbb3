"""How far from a surface the robot stops before each touch: drawn, and not what a tip could be."""

import random
from collections.abc import Sequence

from robolink.calibration.core.robust import Floats
from robolink.calibration.touch.surface_evidence import LEAST_UNEXPLAINED_MM2, unexplained_mm2
from robolink.calibration.touch.touch_limits import LEVELS_MM


class SurfaceStandoffs:
    """Draws the distances of one measurement, one after the other.

    Args:
        seed: Of the run; the same one gives the same distances.
        clearance_mm: The least distance.
    """

    def __init__(self, seed: int, clearance_mm: float) -> None:
        self.seed = seed
        self._random = random.Random(f"surface {seed}")
        self._clearance_mm = clearance_mm
        self._last_mm: float | None = None

    def next(
        self, taken_mm: Sequence[float], columns: Floats | None = None, *, further_mm: float = 0.0
    ) -> float:
        """Return how far from the surface to stop before the next touch, mm.

        Args:
            taken_mm: The distances before the touches so far.
            columns: Derivatives of the distances by tip and surface, one row for each of those
                touches and one for the next; ``None`` while the surface is not known.
            further_mm: How much more than the clearance it is at least.

        Example:
            >>> from robolink.calibration import SurfaceStandoffs
            >>> standoffs = SurfaceStandoffs(seed=7, clearance_mm=2)
            >>> standoffs.next([]) >= 2
            True
        """
        levels = self._random.sample(LEVELS_MM, len(LEVELS_MM))
        free = [level for level in levels if level != self._last_mm]
        least_mm = self._clearance_mm + further_mm
        self._last_mm = free[0]
        if columns is not None and len(columns) > columns.shape[1]:
            needed_mm2 = LEAST_UNEXPLAINED_MM2 * (len(columns) - columns.shape[1])
            found = {
                level: unexplained_mm2(columns, [*taken_mm, least_mm + level]) for level in free
            }
            enough = [level for level in free if found[level] >= needed_mm2]
            self._last_mm = enough[0] if enough else max(free, key=found.__getitem__)
        return least_mm + self._last_mm
