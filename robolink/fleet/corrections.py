"""What a change moved a tip by, compared with the earlier changes of the same tool and cell."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean, median, stdev
from typing import Final

from robolink.calibration import f_exceeded, normal_quantile
from robolink.drift import MeasuredChange

LEAST_EARLIER: Final = 20
"""Fewest earlier values of a tool at a cell by which another one is judged."""

_NORMAL_MAD: Final = 1.4826
"""Standard deviation of normal values in units of their median absolute deviation."""

_RESOLUTION_MM: Final = 0.001 / math.sqrt(12)
"""Standard deviation due to a controller's three decimals alone, mm."""

_LEAST_CHANCE: Final = 1e-15
"""A chance below it is not told from it; its score is 7.9."""


@dataclass(frozen=True, slots=True)
class TipCorrection:
    """One axis of a measured tip, and the earlier ones of that tool at that cell.

    Attributes:
        tool: Number of the tool.
        axis: ``x``, ``y`` or ``z``.
        value_mm: What was measured, mm.
        earlier: How many earlier values there are.
        mean_mm: Their mean.
        sigma_mm: Their standard deviation.
        median_mm: Their median.
        mad_mm: Their median absolute deviation.
    """

    tool: int
    axis: str
    value_mm: float
    earlier: int = 0
    mean_mm: float = 0.0
    sigma_mm: float = 0.0
    median_mm: float = 0.0
    mad_mm: float = 0.0

    @classmethod
    def of(cls, tool: int, axis: str, value_mm: float, earlier: Sequence[float]) -> "TipCorrection":
        """Return a value beside those before it.

        Args:
            tool: Number of the tool.
            axis: Its axis.
            value_mm: The value, mm.
            earlier: Those before it, mm; fewer than two tell nothing.

        Example:
            >>> from robolink.fleet import TipCorrection
            >>> TipCorrection.of(1, "x", 12.4, [12.0, 12.1, 11.9] * 10).off_mm()
            0.4
        """
        if len(earlier) < 2:
            return cls(tool, axis, value_mm, len(earlier))
        middle = median(earlier)
        mad = median(abs(value - middle) for value in earlier)
        return cls(tool, axis, value_mm, len(earlier), fmean(earlier), stdev(earlier), middle, mad)

    @property
    def judged(self) -> bool:
        """Whether there are enough earlier values to judge it."""
        return self.earlier >= LEAST_EARLIER

    def off_mm(self, accepted_mm: float = 0.0) -> float:
        """Return how far it is from the mean of the earlier ones, mm.

        Args:
            accepted_mm: By how much a person has said that it may be.
        """
        return round(self.value_mm - self.mean_mm - accepted_mm, 9)

    def chance(self, accepted_mm: float = 0.0) -> float:
        """Return how likely a value of a steady cell is at least as far off: Student's t.

        The prediction of one more value from n earlier ones has n - 1 degrees of freedom, so that
        what is known of a cell's own scatter from few values counts for no more than it is worth.
        """
        spread = max(self.sigma_mm, _RESOLUTION_MM) * math.sqrt(1 + 1 / self.earlier)
        t = self.off_mm(accepted_mm) / spread
        return f_exceeded(t * t, 1.0, self.earlier - 1.0)

    def score(self, accepted_mm: float = 0.0) -> float:
        """Return how far off it is as a standard normal value of the same chance.

        Scores of cells with different scatter, known from different numbers of values, can be
        added: for steady cells each is standard normal.
        """
        chance = max(self.chance(accepted_mm), _LEAST_CHANCE)
        return math.copysign(normal_quantile(1 - chance / 2), self.off_mm(accepted_mm))

    def robust_off(self, accepted_mm: float = 0.0) -> float:
        """Return how far it is from the median of the earlier ones, in robust deviations."""
        spread = max(_NORMAL_MAD * self.mad_mm, _RESOLUTION_MM)
        return (self.value_mm - self.median_mm - accepted_mm) / spread

    def as_json(self) -> dict[str, object]:
        """Return it as plain JSON."""
        return asdict(self)

    @classmethod
    def from_json(cls, said: Mapping[str, object]) -> "TipCorrection":
        """Return what :meth:`as_json` gave."""
        return cls(**said)  # type: ignore[arg-type]


def corrections_of(changes: Sequence[MeasuredChange], change: str) -> Iterator[TipCorrection]:
    """Yield what one change measured, beside the earlier changes of the same tools.

    A nozzle that was measured before, by its id, says how well that is known and not how nozzles
    sit: its repeats are left out, as in the charts of :mod:`robolink.drift`.

    Args:
        changes: The measured changes of one controller, oldest first.
        change: Id of the change.

    Example:
        >>> from robolink.drift import MeasuredChange
        >>> from robolink.fleet import corrections_of
        >>> first = MeasuredChange(1, "", "c-1", 1, "", "", {"x": 12.0}, None, None)
        >>> then = MeasuredChange(2, "", "c-2", 1, "", "", {"x": 12.1}, None, None)
        >>> [(one.axis, one.earlier) for one in corrections_of([first, then], "c-2")]
        [('x', 1)]
    """
    before: dict[tuple[int, str], list[float]] = {}
    mounted: dict[int, str] = {}
    for one in changes:
        if one.change == change:
            for axis, value in one.tip_mm.items():
                yield TipCorrection.of(one.tool, axis, value, before.get((one.tool, axis), ()))
            continue
        repeat = bool(one.nozzle) and mounted.get(one.tool) == one.nozzle
        mounted[one.tool] = one.nozzle
        if not repeat:
            for axis, value in one.tip_mm.items():
                before.setdefault((one.tool, axis), []).append(value)
