"""Residuals above which a result is given with a warning (docs/reference/calibration.md 3)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

BEYOND_TOLERANCE: Final = ("large_residual", "large_rms", "large_pixel_residual")
"""Codes of a result that does not agree with itself, the plainest first: nothing to be written."""


def beyond_tolerance(codes: Sequence[str], *, judged: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the codes for which a result that nobody watched is refused, the plainest first.

    Args:
        codes: Those of the result.
        judged: Codes for which somebody stated a limit, which then decides.
    """
    return tuple(code for code in BEYOND_TOLERANCE if code in codes and code not in judged)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What the residuals of a good calibration stay below, mm.

    Attributes:
        rms_mm: For the root mean square of the residual distances.
        max_residual_mm: For the largest of them.
    """

    rms_mm: float
    max_residual_mm: float

    def doubts(self, rms_mm: float | None, max_residual_mm: float | None) -> tuple[str, ...]:
        """Return the names of the limits that are exceeded."""
        found = []
        if rms_mm is not None and rms_mm > self.rms_mm:
            found.append("large_rms")
        if max_residual_mm is not None and max_residual_mm > self.max_residual_mm:
            found.append("large_residual")
        return tuple(found)


PLANAR_TOLERANCE = Tolerance(rms_mm=0.05, max_residual_mm=0.15)
"""For a camera or a well visible pin on four axes."""

TOUCH_TOLERANCE = Tolerance(rms_mm=0.3, max_residual_mm=1.0)
"""For a pin touched with six axes."""
