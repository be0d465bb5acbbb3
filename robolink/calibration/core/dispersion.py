"""How large the placement errors are, and what follows for an interval.

Either the poses tell it themselves, by their residuals and with Student's t, or somebody who
knows the cell states it. Without one of them there is no interval, and none is made up.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from robolink.calibration.core.statistics import NORMAL_95, student_t95
from robolink.errors import ConfigError
from robolink.messages import tr

DISBELIEVED_ABOVE = 3.0
"""Residuals this many times larger than the stated sigma contradict it."""


@dataclass(frozen=True, slots=True)
class Dispersion:
    """Standard deviation of one coordinate of one placement, and the factor for 95 %.

    Attributes:
        sigma_mm: The standard deviation.
        stated: Whether a person stated it.
        factor95: Student's t for an estimate, the normal quantile for a stated value.
    """

    sigma_mm: float
    stated: bool
    factor95: float

    @classmethod
    def of(cls, sum_of_squares: float, dof: int, stated_mm: float | None) -> Self | None:
        """Return what is known, ``None`` when nothing is.

        Args:
            sum_of_squares: Of all residual coordinates, mm^2.
            dof: Degrees of freedom that are left.
            stated_mm: The stated sigma, if there is one; it goes before the estimate.

        Raises:
            ConfigError: The stated sigma is not a positive number.
        """
        if stated_mm is not None:
            require_positive(stated_mm, "sigma_mm")
            return cls(stated_mm, True, NORMAL_95)
        if dof < 1:
            return None
        return cls(math.sqrt(sum_of_squares / dof), False, student_t95(dof))

    def contradicted_by(self, sum_of_squares: float, dof: int) -> bool:
        """Tell whether the residuals are far larger than a stated sigma allows."""
        if not self.stated or dof < 1:
            return False
        return math.sqrt(sum_of_squares / dof) > DISBELIEVED_ABOVE * self.sigma_mm

    def half_widths(self, covariance: Sequence[Sequence[float]]) -> tuple[float, ...]:
        """Return half of each component's 95 % interval."""
        return tuple(
            self.factor95 * math.sqrt(max(row[index], 0.0)) for index, row in enumerate(covariance)
        )


def require_positive(value: float, name: str) -> None:
    """Refuse an option that has to be a positive number.

    Raises:
        ConfigError: It is not.
    """
    if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0):
        raise ConfigError(
            tr("{name} is {value!r}.", name=name, value=value),
            remedy=tr("Give a positive number."),
        )
