"""A budget of uncertainty: what each source brings, and what they bring together.

After the Guide to the expression of uncertainty in measurement (JCGM 100, G.4, G.6):
u_c is the root of the sum of (c_i u_i)^2, nu_eff = u_c^4 / sum((c_i u_i)^4 / nu_i), and the
expanded uncertainty is Student's t for nu_eff, cut to a whole number, times u_c
(docs/reference/evidence.md 7).
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, Self

from robolink.calibration.core.statistics import student_t

DIVISORS: Final = {
    "rectangular": math.sqrt(3),
    "triangular": math.sqrt(6),
    "arcsine": math.sqrt(2),
    "normal": 1.0,
}
"""By what a half width is divided to be a standard uncertainty, by its distribution."""


@dataclass(frozen=True, slots=True)
class BudgetRow:
    """One source of uncertainty.

    Attributes:
        name: What it is, in words that a person reads.
        u_mm: Its standard uncertainty, before ``sensitivity``.
        nu: Its degrees of freedom; infinite where the value is taken as known.
        sensitivity: By how much it counts in the result.
        origin: Where the value comes from: a record, a data sheet, these touches.
        kind: ``A`` when it was found by statistics, else ``B``.
    """

    name: str
    u_mm: float
    nu: float = math.inf
    sensitivity: float = 1.0
    origin: str = ""
    kind: Literal["A", "B"] = "B"

    @property
    def part_mm(self) -> float:
        """What it brings to the result."""
        return abs(self.sensitivity) * self.u_mm


@dataclass(frozen=True, slots=True)
class UncertaintyBudget:
    """Rows and what they come to.

    Attributes:
        rows: The sources that were counted.
        not_assessed: Names of sources whose size nobody knows; they are not zero.
        probability: What the expanded uncertainty is to hold, 0.95 unless it was asked otherwise.
    """

    rows: tuple[BudgetRow, ...]
    not_assessed: tuple[str, ...] = ()
    probability: float = 0.95

    @classmethod
    def of(
        cls,
        rows: Iterable[BudgetRow],
        *,
        not_assessed: Iterable[str] = (),
        probability: float = 0.95,
    ) -> Self:
        """Return the budget of some rows.

        Args:
            rows: What is uncertain, a row each.
            not_assessed: What nobody stated, by name.
            probability: How much the expanded uncertainty covers.

        Example:
            >>> from robolink.calibration import BudgetRow, UncertaintyBudget
            >>> rows = [BudgetRow("touches", 0.03, nu=5, kind="A"), BudgetRow("pin", 0.04)]
            >>> budget = UncertaintyBudget.of(rows)
            >>> round(budget.u_c_mm, 3), round(budget.expanded_mm, 3)
            (0.05, 0.101)
        """
        return cls(tuple(rows), tuple(not_assessed), probability)

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """Return the budget that :meth:`as_json` wrote.

        Raises:
            KeyError, TypeError, ValueError: It is none.
        """
        rows = (
            BudgetRow(
                row["name"],
                float(row["u_mm"]),
                math.inf if row["nu"] is None else float(row["nu"]),
                float(row["sensitivity"]),
                row["origin"],
                row["kind"],
            )
            for row in document["rows"]
        )
        return cls(tuple(rows), tuple(document["not_assessed"]), float(document["probability"]))

    def with_row(self, row: BudgetRow) -> "UncertaintyBudget":
        """Return the budget with one row more, which then counts as assessed."""
        left = tuple(name for name in self.not_assessed if name != row.name)
        return UncertaintyBudget((*self.rows, row), left, self.probability)

    @property
    def u_c_mm(self) -> float:
        """Combined standard uncertainty."""
        return math.hypot(*(row.part_mm for row in self.rows))

    @property
    def type_a_mm(self) -> float:
        """What statistics found, as one standard uncertainty."""
        return math.hypot(*(row.part_mm for row in self.rows if row.kind == "A"))

    @property
    def type_b_mm(self) -> float:
        """What is known otherwise, as one standard uncertainty."""
        return math.hypot(*(row.part_mm for row in self.rows if row.kind == "B"))

    @property
    def nu_eff(self) -> float:
        """Effective degrees of freedom, after Welch and Satterthwaite; may be infinite."""
        return effective_dof((row.part_mm, row.nu) for row in self.rows)

    @property
    def k(self) -> float:
        """The factor from ``u_c_mm`` to ``expanded_mm``."""
        return coverage_factor(self.nu_eff, self.probability)

    @property
    def expanded_mm(self) -> float:
        """Half the interval that holds the truth with ``probability``."""
        return self.k * self.u_c_mm

    def as_json(self) -> dict[str, object]:
        """Return it as plain values: rows with share in %, and the sums."""
        whole = self.u_c_mm**2
        return {
            "rows": [
                {
                    "name": row.name,
                    "u_mm": row.u_mm,
                    "sensitivity": row.sensitivity,
                    "part_mm": row.part_mm,
                    "share_percent": 100 * row.part_mm**2 / whole if whole > 0 else 0.0,
                    "nu": _finite(row.nu),
                    "kind": row.kind,
                    "origin": row.origin,
                }
                for row in self.rows
            ],
            "not_assessed": list(self.not_assessed),
            "type_a_mm": self.type_a_mm,
            "type_b_mm": self.type_b_mm,
            "u_c_mm": self.u_c_mm,
            "nu_eff": _finite(self.nu_eff),
            "coverage_factor": self.k,
            "probability": self.probability,
            "expanded_mm": self.expanded_mm,
        }


def effective_dof(parts: Iterable[tuple[float, float]]) -> float:
    """Return the degrees of freedom of a sum of independent parts.

    Args:
        parts: Standard uncertainty, mm, and degrees of freedom of each.
    """
    known = [(part, nu) for part, nu in parts if part > 0]
    largest = max((part for part, _ in known), default=0.0)
    # In units of the largest part, so that no fourth power underflows.
    whole = sum((part / largest) ** 2 for part, _ in known)
    told = sum((part / largest) ** 4 / nu for part, nu in known)
    return whole**2 / told if told > 0 else math.inf


def coverage_factor(nu_eff: float, probability: float = 0.95) -> float:
    """Return Student's t for degrees of freedom cut to a whole number, 1 at least."""
    whole = nu_eff if math.isinf(nu_eff) else max(math.floor(nu_eff), 1)
    return student_t((1 + probability) / 2, whole)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None  # JSON has no infinity
