"""Figures, each beside what it is compared with, and the table of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple


class Amount(NamedTuple):
    """A value with its unit, shown with three figures.

    Attributes:
        value: The number.
        unit: Its unit.
    """

    value: float
    unit: str

    def __str__(self) -> str:
        digits = 0 if self.value >= 100 else 1 if self.value >= 10 else 2
        return f"{self.value:,.{digits}f} {self.unit}"


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured value, next to the floor or peer that it is compared with.

    Attributes:
        name: What was measured.
        ours: How much it is.
        against: What it is compared with: the floor, a peer, or what is wanted.
        floor: How much that is.
        ratio: Ours over the floor's, in the same run; of a rate the wanted over the reached, so
            that less is better everywhere.
        goal: The largest ratio aimed at.
    """

    name: str
    ours: Amount
    against: str = ""
    floor: Amount | None = None
    ratio: float | None = None
    goal: float | None = None

    @property
    def met(self) -> bool | None:
        """Whether the goal is reached, ``None`` without one."""
        if self.ratio is None or self.goal is None:
            return None
        return self.ratio <= self.goal

    def document(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        floor = None if self.floor is None else self.floor._asdict()
        return {
            "name": self.name,
            "ours": self.ours._asdict(),
            "against": self.against,
            "floor": floor,
            "ratio": self.ratio,
            "goal": self.goal,
            "met": self.met,
        }

    def cells(self) -> tuple[str, ...]:
        """Return what stands in a row of the table."""
        return (
            self.name,
            self.against or "-",
            "-" if self.floor is None else str(self.floor),
            str(self.ours),
            "-" if self.ratio is None else _short(self.ratio),
            "-" if self.goal is None else f"<= {self.goal:.2f}",
            {True: "met", False: "missed", None: ""}[self.met],
        )


def _short(ratio: float) -> str:
    return f"{ratio:.{2 if ratio >= 0.1 else 3}f}"


HEAD = ("what", "floor or peer", "its figure", "robolink", "ratio", "goal", "")


def print_table(figures: Sequence[Figure]) -> None:
    """Print figures as a table."""
    rows = [HEAD, *(figure.cells() for figure in figures)]
    widths = [max(len(row[at]) for row in rows) for at in range(len(HEAD))]
    for row in rows:
        named, others = row[:2], row[2:]
        left = [text.ljust(width) for text, width in zip(named, widths, strict=False)]
        right = [text.rjust(width) for text, width in zip(others, widths[2:], strict=True)]
        print("  ".join((*left, *right)).rstrip())
