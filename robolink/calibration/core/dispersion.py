"""The size of the placement errors, and the intervals that follow.

Three things can tell it: the residuals, with Student's t; somebody who knows the cell and states
it; the grid on which the tip was jogged, or a position taken. The one that gives the widest
interval decides, because a residual can be small by luck and a statement wrong
(docs/reference/evidence.md 5, 6). Where none of them exists there is no interval, and none is made
up. Where there is one it is never 0: what two positions hide that are printed alike counts.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, Self

from robolink.calibration.core.accuracy import BudgetRow, UncertaintyBudget
from robolink.calibration.core.statistics import f_quantile, student_t95
from robolink.errors import ConfigError
from robolink.messages import tr

Source = Literal["residuals", "stated", "resolution"]

_REGION: Final = 0.95

PRINT_STEP_MM: Final = 0.001
"""Step of printed positions, in mm, assumed if the controller's own is unknown: EPSON prints three
decimals, and no robot field bus carries fewer."""


@dataclass(frozen=True, slots=True)
class Dispersion:
    """Standard deviation of one coordinate of one placement.

    Attributes:
        sigma_mm: The standard deviation.
        nu: Its degrees of freedom; infinite for what is known otherwise than from residuals.
        source: What told it.
    """

    sigma_mm: float
    nu: float
    source: Source

    @classmethod
    def of(
        cls,
        sum_of_squares: float,
        dof: int,
        stated_mm: float | None,
        grid_mm: float | None = None,
    ) -> Self | None:
        """Return the dispersion with the widest interval; ``None`` when nothing is known.

        Args:
            sum_of_squares: Of all residual coordinates, mm^2.
            dof: Degrees of freedom that are left.
            stated_mm: The stated sigma, if there is one.
            grid_mm: Step of the jogs, or of the positions, if it is known: q / sqrt(12) is its
                standard uncertainty.

        Raises:
            ConfigError: The stated sigma or the grid is not a positive number.
        """
        known = cls.known(sum_of_squares, dof, stated_mm, grid_mm)
        return max(known, key=lambda one: one.sigma_mm * one.factor95, default=None)

    @classmethod
    def known(
        cls,
        sum_of_squares: float,
        dof: int,
        stated_mm: float | None,
        grid_mm: float | None = None,
    ) -> Iterator[Self]:
        """Yield each of the three that there is, and never only zeros; see :meth:`of`."""
        if dof > 0:
            yield cls(math.sqrt(sum_of_squares / dof), dof, "residuals")
        if stated_mm is not None:
            require_positive(stated_mm, "sigma_mm")
            yield cls(stated_mm, math.inf, "stated")
        if grid_mm is not None:
            require_positive(grid_mm, "grid_mm")
        elif dof > 0 or stated_mm is not None:
            grid_mm = PRINT_STEP_MM
        if grid_mm is not None:
            yield cls(max(grid_mm, PRINT_STEP_MM) / math.sqrt(12), math.inf, "resolution")

    @property
    def factor95(self) -> float:
        """Student's t for an estimate, the normal quantile for what is known."""
        return student_t95(self.nu)

    def region_factor(self, dimensions: int) -> float:
        """Return the factor for a region of 95 % in several dimensions together."""
        return math.sqrt(dimensions * f_quantile(_REGION, dimensions, self.nu))

    def region_mm(self, variance_mm2: float, dimensions: int) -> float:
        """Return the radius of the 95 % region of equally well known lengths."""
        return self.region_factor(dimensions) * math.sqrt(variance_mm2)

    def half_widths(self, covariance: Sequence[Sequence[float]]) -> tuple[float, ...]:
        """Return half of each component's 95 % interval."""
        return tuple(
            self.factor95 * math.sqrt(max(row[index], 0.0)) for index, row in enumerate(covariance)
        )

    def budget(self, gain: float) -> UncertaintyBudget:
        """Return the budget of a length in which one placement's error counts ``gain`` times."""
        name, origin = {
            "residuals": (tr("scatter of the touches"), tr("how well they agree")),
            "stated": (tr("error of a touch"), tr("stated for this cell")),
            "resolution": (tr("step of the positions"), tr("the grid that they lie on")),
        }[self.source]
        kind: Literal["A", "B"] = "A" if self.source == "residuals" else "B"
        row = BudgetRow(name, self.sigma_mm, self.nu, gain, origin, kind)
        unknown = (
            tr("angle of U"),
            tr("repeatability of the robot"),
            tr("linearity over the poses"),
            tr("temperature"),
        )
        return UncertaintyBudget.of((row,), not_assessed=unknown)


def interval_of(
    scatter: Dispersion | None, variances: Sequence[float], lengths: int
) -> dict[str, Any]:
    """Return the intervals of components that err independently; nothing without a scatter.

    Args:
        scatter: What tells it.
        variances: Of each component, mm^2 or deg^2.
        lengths: How many of them are lengths; these come first and are known alike.
    """
    if scatter is None:
        return {}
    covariance = tuple(
        tuple(one if row == column else 0.0 for column in range(len(variances)))
        for row, one in enumerate(variances)
    )
    return {
        "covariance": covariance,
        "half_width95": scatter.half_widths(covariance),
        "region95_radius_mm": scatter.region_mm(variances[0], lengths),
    }


def require_positive(value: float, name: str) -> None:
    """Refuse an option that is not a positive number.

    Raises:
        ConfigError: It is not.
    """
    if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0):
        raise ConfigError(
            tr("{name} is {value!r}.", name=name, value=value),
            remedy=tr("Give a positive number."),
        )
