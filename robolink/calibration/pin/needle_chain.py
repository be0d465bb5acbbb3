"""What differences add up to since the last full calibration, and how far that is trusted."""

import math
from dataclasses import dataclass

from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.quality.update_guard import NEEDLE_LIMIT_MM


@dataclass(frozen=True, slots=True)
class NeedleChain:
    """What has happened since the last full calibration.

    Attributes:
        sigma_mm: Standard deviation of each measured length that the offset carries now.
        changes: How many differences were added to it.
    """

    sigma_mm: float
    changes: int = 0

    def after(self, difference_sigma_mm: float) -> "NeedleChain":
        """Return the chain with one more difference."""
        return NeedleChain(math.hypot(self.sigma_mm, difference_sigma_mm), self.changes + 1)


@dataclass(frozen=True, slots=True)
class NeedleLimits:
    """How far differences are trusted.

    Attributes:
        max_change_mm: Largest shift that is believed.
        tolerance_mm: Half the 95 % interval that the process can bear.
        max_changes: Differences after which a full calibration is due in any case.
    """

    max_change_mm: float = NEEDLE_LIMIT_MM
    tolerance_mm: float = 0.1
    max_changes: int = 20


def chain_of(result: CalibrationResult) -> NeedleChain | None:
    """Return what the differences up to this result add up to; ``None`` for other methods.

    It asks for the attribute, because the class that has it brings numpy along.
    """
    chain = getattr(result, "chain", None)
    return chain if isinstance(chain, NeedleChain) else None
