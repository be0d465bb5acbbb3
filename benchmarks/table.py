"""Figures and how they are shown."""

import os
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured value, next to the floor or peer it is compared with.

    ``ratio`` is the value over the floor's, ``goal`` the largest ratio aimed at.
    """

    name: str
    value: str
    ratio: float | None = None
    goal: float | None = None

    def line(self) -> str:
        """Return the figure as a row of the table."""
        ratio = "" if self.ratio is None else f"{self.ratio:.2f}"
        goal = "" if self.goal is None else f"<= {self.goal:.2f}"
        reached = ""
        if self.ratio is not None and self.goal is not None:
            reached = "reached" if self.ratio <= self.goal else "missed"
        return f"{self.name:<62} {self.value:>14} {ratio:>7} {goal:>8} {reached}".rstrip()


def print_table(figures: Sequence[Figure]) -> None:
    """Print all figures, and how busy the machine was."""
    load = f"{os.getloadavg()[0]:.2f}" if hasattr(os, "getloadavg") else "unknown"
    print(f"{os.cpu_count()} CPUs, load {load}; medians; a ratio compares within this run only")
    print(f"{'':<62} {'median':>14} {'ratio':>7} {'goal':>8}")
    for figure in figures:
        print(figure.line())
