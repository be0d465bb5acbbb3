"""How one look scatters at a station: residuals of its calibrations on record, pooled."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final

from robolink.model import EntryKind, Recorded

LEAST_DOF: Final = 6
"""From so many degrees of freedom on the record tells the scatter of a look."""

_NEWEST: Final = 200

_LAST_DIGIT_MM: Final = 0.001 / math.sqrt(12)
"""No look scatters less than the last digit that a controller prints."""


@dataclass(frozen=True, slots=True)
class LooksAlike:
    """Which calibrations on record were made like one.

    Attributes:
        station: Name of the station; without one nothing is alike.
        method: Name of the method.
        by_contact: Whether an input showed each touch.
        change: Id of the tool change under way, which is none of them.
    """

    station: str
    method: str
    by_contact: bool = False
    change: str = ""

    def made(self, entry: Recorded) -> bool:
        """Tell whether an entry was made like it."""
        said = entry.details
        return (
            entry.kind is EntryKind.CALIBRATION
            and entry.signature.station == self.station
            and said.get("method") == self.method
            and _by_contact(said.get("touches")) is self.by_contact
            and not (self.change and entry.change == self.change)
        )


def pooled_look(entries: Iterable[Recorded], alike: LooksAlike) -> tuple[float, float] | None:
    """Return the standard deviation of one coordinate of one placement, and its freedom.

    s^2 = sum of the squares of all residuals that were kept, by the sum of the degrees of freedom.

    Args:
        entries: Calibrations on record, newest first; the newest 200 that are alike count.
        alike: Which of them.

    Returns:
        mm and degrees of freedom; ``None`` for fewer than six of these.
    """
    if not alike.station:
        return None
    squares, dof = 0.0, 0
    for entry in islice(filter(alike.made, entries), _NEWEST):
        found = _residuals(entry)
        if found is not None:
            squares, dof = squares + found[0], dof + found[1]
    if dof < LEAST_DOF:
        return None
    return max(math.sqrt(squares / dof), _LAST_DIGIT_MM), float(dof)


def _residuals(entry: Recorded) -> tuple[float, int] | None:
    """Return the sum of squares and the degrees of freedom of a fit; ``None`` without any."""
    vectors, dof = entry.details.get("residuals_mm"), entry.details.get("dof")
    rejected = entry.details.get("rejected", [])
    if not isinstance(vectors, list) or not isinstance(dof, int) or dof < 1:
        return None
    left_out = set(rejected) if isinstance(rejected, list) else set()
    squares = 0.0
    for index, vector in enumerate(vectors):
        if not isinstance(vector, list):
            return None
        if index in left_out:
            continue
        for value in vector:
            if not isinstance(value, (int, float)) or not math.isfinite(value):
                return None
            squares += value * value
    return squares, dof


def _by_contact(touches: object) -> bool:
    """Tell whether an input showed every touch of an entry."""
    if not isinstance(touches, Sequence) or isinstance(touches, str) or not touches:
        return False
    return all(isinstance(one, dict) and one.get("contact") is True for one in touches)
