"""Whether the nozzle that is mounted now changes from one measurement to the next.

A straight line through its values in the order of time, Student's t of the slope. Towards the
flange it wears; sideways, or away from the flange, it moves in its mount or bends.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Final

from robolink.calibration import student_t
from robolink.drift.history import MeasuredChange
from robolink.drift.significance import LEVEL, slope_of

LEAST_MEASUREMENTS: Final = 6


@dataclass(frozen=True, slots=True)
class MountedTrend:
    """A nozzle that changes.

    Attributes:
        first: Its first measurement.
        count: How many there are.
        moved_mm: By how much, by axis, along the line, mm.
        shorter: Whether it is its length alone, towards the flange.
    """

    first: MeasuredChange
    count: int
    moved_mm: dict[str, float]
    shorter: bool


def mounted_trend(changes: Sequence[MeasuredChange]) -> MountedTrend | None:
    """Return how the nozzle that is mounted changes, ``None`` if it does not.

    Args:
        changes: The measured changes of one tool, oldest first. A nozzle without an id is not
            known to be the same one, and is not judged.
    """
    nozzle = changes[-1].nozzle if changes else ""
    count = next((i for i, c in enumerate(reversed(changes)) if c.nozzle != nozzle), len(changes))
    mounted = changes[len(changes) - count :]
    if not nozzle:
        return None
    moved, towards_flange = dict[str, float](), False
    for axis in ("x", "y", "z"):
        values = [change.tip_mm[axis] for change in mounted if axis in change.tip_mm]
        if len(values) < LEAST_MEASUREMENTS:
            continue
        slope, steepness = slope_of(values)
        if abs(steepness) > student_t(1 - LEVEL / 2, len(values) - 2):
            moved[axis] = slope * (len(values) - 1)
            towards_flange = axis == "z" and slope * fmean(values) < 0
    if not moved:
        return None
    return MountedTrend(mounted[0], count, moved, shorter=towards_flange and set(moved) == {"z"})
