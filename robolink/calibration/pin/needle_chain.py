"""The sum of the differences since the last full calibration, and how far it is trusted.

What is known of the Z that a one-touch change is added to.

One touch tells by how much the new tip differs from the old one. How long it is, is known only as
well as the old Z was: where nobody ever measured that, the result is a change of Z and says
nothing of Z itself (docs/reference/evidence.md 12).
"""

import math
from dataclasses import dataclass

from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import student_t95
from robolink.calibration.quality.offset_change import NEEDLE_LIMIT_MM


@dataclass(frozen=True, slots=True)
class StoredZ:
    """The stored Z of a tool, with what the record says about it.

    Attributes:
        value_mm: The stored value.
        half95_mm: Half the 95 % interval of the measurement that it goes back to; ``None`` where
            none is on record.
        entry: Number of that entry in the journal, ``None`` where there is none.
    """

    value_mm: float
    half95_mm: float | None = None
    entry: int | None = None

    @property
    def on_record(self) -> bool:
        """Whether an earlier measurement states its uncertainty."""
        return self.half95_mm is not None

    def as_json(self) -> dict[str, object]:
        """Return it as plain JSON."""
        return {"value_mm": self.value_mm, "half95_mm": self.half95_mm, "entry": self.entry}


@dataclass(frozen=True, slots=True)
class NeedleChain:
    """What has happened since the last full calibration.

    Attributes:
        sigma_mm: Standard deviation of each measured length that the offset carries now.
        changes: How many differences were added to it.
        full_sigma_mm: What it was after the full calibration, where that is known; needed only
            while each difference starts from the touch of the one before.
    """

    sigma_mm: float
    changes: int = 0
    full_sigma_mm: float | None = None

    def after(self, difference_sigma_mm: float, *, shared_touch: bool = False) -> "NeedleChain":
        """Return the chain with one more difference.

        Args:
            difference_sigma_mm: Standard deviation of one difference: that of two touches.
            shared_touch: Whether each difference starts from the touch at which the one before it
                ended. The touches between then cancel, t_k = t_0 + R'(c_k - c_0), and the chain
                is as good as one difference: u^2 = u_0^2 + 2 s^2 for any k. Where old and new tip
                are touched at each change it is u_0^2 + 2 k s^2 (docs/reference/evidence.md 12).
        """
        start = self.full_sigma_mm
        if start is None and self.changes == 0:
            start = self.sigma_mm
        longer = math.hypot(self.sigma_mm, difference_sigma_mm)
        # An older record does not say how its chain began: it starts from the present uncertainty.
        known = self.sigma_mm if start is None else start
        sigma_mm = math.hypot(known, difference_sigma_mm) if shared_touch else longer
        return NeedleChain(sigma_mm, self.changes + 1, known if shared_touch else None)

    def is_due(self, limits: "NeedleLimits") -> bool:
        """Return whether a full calibration is due: too many changes, or too wide an interval.

        Args:
            limits: How far differences are trusted.
        """
        half95_mm = student_t95(math.inf) * self.sigma_mm
        return self.changes >= limits.max_changes or half95_mm > limits.tolerance_mm

    def changes_left(
        self, difference_sigma_mm: float, limits: "NeedleLimits", *, shared_touch: bool = False
    ) -> int:
        """Return how many more differences are allowed before a full calibration; 0 for none.

        Args:
            difference_sigma_mm: Standard deviation of one difference, as for :meth:`after`.
            limits: How far differences are trusted.
            shared_touch: As for :meth:`after`.

        Example:
            >>> from robolink.calibration import NeedleChain, NeedleLimits
            >>> limits = NeedleLimits(tolerance_mm=0.1, max_changes=20)
            >>> NeedleChain(0.02, changes=14).changes_left(0.01, limits, shared_touch=True)
            6
        """
        chain, left = self, 0
        # The differences after a full calibration do not depend on how accurate it was.
        while not (chain.changes and chain.is_due(limits)):
            chain = chain.after(difference_sigma_mm, shared_touch=shared_touch)
            left += 1
        return left


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


def chain_sigma_mm(
    full_sigma_mm: float, touch_sigma_mm: float, changes: int, *, shared_touch: bool
) -> float:
    """Return the standard deviation of a length after some needle changes.

    Args:
        full_sigma_mm: Standard deviation after the full calibration.
        touch_sigma_mm: Standard deviation of one coordinate of one touch.
        changes: How many changes followed, 0 or more.
        shared_touch: As for :meth:`NeedleChain.after`.

    Raises:
        ConfigError: A standard deviation is not positive.

    Example:
        >>> from robolink.calibration import chain_sigma_mm
        >>> round(chain_sigma_mm(0.02, 0.03, changes=4, shared_touch=False), 3)
        0.087
        >>> round(chain_sigma_mm(0.02, 0.03, changes=4, shared_touch=True), 3)
        0.047
    """
    require_positive(full_sigma_mm, "u0_mm")
    require_positive(touch_sigma_mm, "sigma_mm")
    chain = NeedleChain(full_sigma_mm)
    for _ in range(changes):
        chain = chain.after(math.sqrt(2) * touch_sigma_mm, shared_touch=shared_touch)
    return chain.sigma_mm


def chain_of(result: CalibrationResult) -> NeedleChain | None:
    """Return the sum of the differences up to this result; ``None`` for other methods.

    It asks for the attribute, because the class that has it brings numpy along.
    """
    chain = getattr(result, "chain", None)
    return chain if isinstance(chain, NeedleChain) else None
