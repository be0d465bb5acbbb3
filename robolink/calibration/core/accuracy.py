"""What a result is accurate to: its scatter, and the errors that scatter does not show.

A fit that agrees with itself to a hundredth says nothing about a station that was moved, a camera
that was turned, or a person who always sees contact on the same side. Each of these is a row of
the budget with a half width: stated for the cell, learnt from its record, or the default of
``ACCURACY_ROWS`` (docs/reference/evidence.md 19).

A budget of uncertainty: what each source brings, and what they bring together.

After the Guide to the expression of uncertainty in measurement (JCGM 100, G.4, G.6):
u_c is the root of the sum of (c_i u_i)^2, nu_eff = u_c^4 / sum((c_i u_i)^4 / nu_i), and the
expanded uncertainty is Student's t for nu_eff, cut to a whole number, times u_c
(docs/reference/evidence.md 7).
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, Self

from robolink.calibration.core.statistics import student_t
from robolink.messages import declared
from robolink.model import from_fields, json_fields

DIVISORS: Final = {
    "rectangular": math.sqrt(3),
    "triangular": math.sqrt(6),
    "arcsine": math.sqrt(2),
    "normal": 1.0,
}
"""Divisors from a half width to a standard uncertainty, by distribution."""


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
        """Its contribution to the result."""
        return abs(self.sensitivity) * self.u_mm


@dataclass(frozen=True, slots=True)
class UncertaintyBudget:
    """Rows and their combined uncertainty.

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
        rows = [
            {**row, "nu": math.inf if row["nu"] is None else row["nu"]} for row in document["rows"]
        ]
        return from_fields(cls, {**document, "rows": rows})

    def with_row(self, row: BudgetRow) -> "UncertaintyBudget":
        """Return the budget with one more row, which then counts as assessed."""
        left = tuple(name for name in self.not_assessed if name != row.name)
        return UncertaintyBudget((*self.rows, row), left, self.probability)

    @property
    def u_c_mm(self) -> float:
        """Combined standard uncertainty."""
        return math.hypot(*(row.part_mm for row in self.rows))

    @property
    def type_a_mm(self) -> float:
        """Contribution of statistics, as one standard uncertainty."""
        return math.hypot(*(row.part_mm for row in self.rows if row.kind == "A"))

    @property
    def type_b_mm(self) -> float:
        """Contribution of everything else, as one standard uncertainty."""
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
        """Half the interval that contains the truth with ``probability``."""
        return self.k * self.u_c_mm

    def as_json(self) -> dict[str, object]:
        """Return it as plain values: rows with share in %, and the sums."""
        whole = self.u_c_mm**2
        return {
            "rows": [
                {
                    **json_fields(row, "name", "u_mm", "sensitivity", "part_mm"),
                    "share_percent": 100 * row.part_mm**2 / whole if whole > 0 else 0.0,
                    **json_fields(row, "nu", "kind", "origin"),
                }
                for row in self.rows
            ],
            **json_fields(self, "not_assessed", "type_a_mm", "type_b_mm", "u_c_mm", "nu_eff"),
            "coverage_factor": self.k,
            **json_fields(self, "probability", "expanded_mm"),
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


Basis = Literal["stated", "record", "default"]
"""The source of a row's size: the cell file, the record, or the default."""

Turning = Literal["with_tool", "in_base", "as_offset"]
"""How an error behaves when the tool turns about the tip that was found.

``with_tool``: it turns with the tool, so a turn test never shows it. ``in_base``: it stays with the
station, so tip and station move apart. ``as_offset``: only the offset is wrong.
"""


@dataclass(frozen=True, slots=True)
class AccuracyRow:
    """A kind of error that no scatter shows.

    Attributes:
        key: Its name in recipes, cell files and JSON.
        unit: Unit of its half width.
        default: The half width where a cell neither states nor has learnt one.
        title: What it is, for a person.
        month: By how much the half width grows in a month since the station was learnt.
        most: What the default grows to at most.
    """

    key: str
    unit: Literal["mm", "deg", "percent", "px"]
    default: float
    title: str
    month: float = 0.0
    most: float = 0.0


ACCURACY_ROWS: Final[Mapping[str, AccuracyRow]] = {
    row.key: row
    for row in (
        AccuracyRow("touch_mm", "mm", 0.05, declared("judging contact by eye")),
        AccuracyRow("place_mm", "mm", 0.02, declared("place of the station"), month=0.01, most=0.1),
        AccuracyRow("camera_turn_deg", "deg", 0.5, declared("turn of the camera")),
        AccuracyRow("camera_scale_percent", "percent", 0.5, declared("scale of the camera")),
        AccuracyRow("plate_mm", "mm", 0.1, declared("height of the surface")),
        AccuracyRow("tip_image_px", "px", 0.5, declared("what the camera sees of the tip")),
        AccuracyRow("bend_deg", "deg", 2.0, declared("bend of the needle")),
        AccuracyRow("print_mm", "mm", 0.01, declared("print of the fiducials")),
    )
}
"""The rows that a budget can have, by key (docs/reference/evidence.md 19)."""


@dataclass(frozen=True, slots=True)
class ErrorSource:
    """How one row affects what a method measured.

    Attributes:
        row: Key of the row.
        gain: By how much each measured component changes, mm or degrees, for one unit of the row:
            one line a component, one column for each direction in which the error can lie.
            It may end before angles that it has no part in.
        turning: What becomes of it when the tool turns about the tip.
    """

    row: str
    gain: tuple[tuple[float, ...], ...]
    turning: Turning = "with_tool"

    @classmethod
    def of_lengths(
        cls, row: str, count: int, *, gain: float = 1.0, turning: Turning = "with_tool"
    ) -> Self:
        """Return a source that is the same in every direction.

        Args:
            row: Key of the row.
            count: How many lengths are measured; they come first.
            gain: By how much each changes for one unit of the row.
            turning: What becomes of it when the tool turns.

        Example:
            >>> from robolink.calibration import ErrorSource
            >>> ErrorSource.of_lengths("place_mm", 2, turning="in_base").gain
            ((1.0, 0.0), (0.0, 1.0))
        """
        lines = tuple(
            tuple(gain if line == column else 0.0 for column in range(count))
            for line in range(count)
        )
        return cls(row, lines, turning)

    def of_first(self, count: int) -> Self:
        """Return the same source for only the first measured components."""
        return replace(self, gain=self.gain[:count])


@dataclass(frozen=True, slots=True)
class RowFact:
    """The size of one row in a cell.

    Attributes:
        half_width: Half its width, in the unit of the row.
        basis: What tells it.
        growth: What has to be added for the age of a station.
        told: Where it is told, in words; empty for a default.
    """

    half_width: float
    basis: Basis
    growth: float = 0.0
    told: str = ""


@dataclass(frozen=True, slots=True)
class AccuracyFacts:
    """What a cell knows about the rows of its budgets; an unknown row has its default.

    Attributes:
        rows: What is stated or learnt, by the key of the row.
        months: How long ago the station was learnt, in months; ``None`` where nothing says it.
        by_contact: Whether an input showed each touch, so that nobody had to see it.
        by_program: Whether a program brought the tip there, so that nobody aimed at a pin either.
        look_sigma_mm: Standard deviation of one coordinate of one look, pooled over the record of
            the station; ``None`` where too little is on record.
        look_nu: Its degrees of freedom.
    """

    rows: Mapping[str, RowFact] = field(default_factory=dict, hash=False)
    months: float | None = None
    by_contact: bool = False
    by_program: bool = False
    look_sigma_mm: float | None = None
    look_nu: float = 0.0

    def of(self, key: str) -> RowFact:
        """Return the size of a row.

        A default grows with the time since the station was learnt, and so does what was learnt
        from how well learning repeats; what the cell states is taken as it stands.

        Raises:
            KeyError: There is no such row.

        Example:
            >>> from robolink.calibration import AccuracyFacts
            >>> fresh, old = AccuracyFacts(months=0), AccuracyFacts(months=3)
            >>> fresh.of("place_mm").growth, round(old.of("place_mm").growth, 3)
            (0.0, 0.03)
        """
        row = ACCURACY_ROWS[key]
        fact = self.rows.get(key) or RowFact(row.default, "default")
        if not row.month or fact.basis == "stated":
            return fact
        grown = row.month * max(self.months or 0.0, 0.0)
        growth = max(min(fact.half_width + grown, row.most) - fact.half_width, 0.0)
        return RowFact(fact.half_width, fact.basis, growth, fact.told)


@dataclass(frozen=True, slots=True)
class AssessedRow:
    """One row of a budget, as a result uses it.

    Attributes:
        key: Its key; ``scatter`` for what the measurement shows by itself.
        title: What it is, for a person, in the language of the day.
        half_width: Half its width, in ``unit``, growth included; ``None`` for the scatter.
        unit: Unit of the half width; empty for the scatter.
        basis: What tells it; empty for the scatter.
        told: Where it is told, in words.
        u_mm: What it brings to the length that is known worst, as a standard uncertainty.
    """

    key: str
    title: str
    half_width: float | None
    unit: str
    basis: str
    told: str
    u_mm: float

    def as_json(self) -> dict[str, object]:
        """Return it as plain values."""
        shown = json_fields(self, "title", "half_width", "unit", "basis", "told", "u_mm")
        return {"row": self.key, **shown}


@dataclass(frozen=True, slots=True)
class Accuracy:
    """What a result is accurate to.

    Attributes:
        within_mm: The tip lies within this of the truth in 95 %, all measured lengths together.
        half_width95: Half the 95 % interval of each measured component alone, in their order.
        rows: What it is made of, the largest first.
        budget: The same rows for the length that is known worst.
        without_defaults_mm: What ``within_mm`` would be if no row had to be a default.
    """

    within_mm: float
    half_width95: tuple[float, ...]
    rows: tuple[AssessedRow, ...]
    budget: UncertaintyBudget
    without_defaults_mm: float

    @property
    def largest(self) -> AssessedRow:
        """The largest row."""
        return self.rows[0]

    @property
    def largest_default(self) -> AssessedRow | None:
        """The largest row that is neither stated nor recorded."""
        return next((row for row in self.rows if row.basis == "default"), None)

    def as_json(self, measured: Sequence[str] = ()) -> dict[str, object]:
        """Return it as plain values.

        Args:
            measured: Names of the measured components, in their order.
        """
        halves = dict(zip(measured, self.half_width95, strict=False))
        return {
            "within_mm": self.within_mm,
            "half_width95": halves if measured else list(self.half_width95),
            "largest_row": self.largest.key,
            "without_defaults_mm": self.without_defaults_mm,
            **json_fields(self, "rows", "budget"),
        }

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """Return what :meth:`as_json` wrote.

        Raises:
            KeyError, TypeError, ValueError: It is none.
        """
        halves = document["half_width95"]
        values = halves.values() if isinstance(halves, Mapping) else halves
        rows = [{**row, "key": row["row"]} for row in document["rows"]]
        return from_fields(cls, {**document, "half_width95": values, "rows": rows})
