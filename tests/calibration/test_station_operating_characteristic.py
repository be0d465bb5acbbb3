"""The shares of moved stations detected and of unmoved ones called moved: 4,000 runs a cell.

docs/reference/evidence.md 11 has the table; `python -m
tests.calibration.test_station_operating_characteristic` prints it anew.
"""

import math
from pathlib import Path

import numpy as np
import pytest

from robolink.calibration import TipShift, judge_shifts

PAGE = Path(__file__).parents[2] / "docs/reference/evidence.md"
RUNS = 4000
TOUCH = 0.02
MOVED = (0.0, 0.1, 0.2, 0.3, 0.5, 1.0)
SEATS = ((0.0, 0.0), (0.05, 0.02), (0.1, 0.05), (0.2, 0.1))
TOOLS = (1, 2, 3, 4)


def share(seat: tuple[float, float], tools: int, moved_mm: float, runs: int = RUNS) -> float:
    """Return the share of runs in which the station is called moved, in %.

    Args:
        seat: Scatter of the seating in the plane and along Z, mm; 0 for nozzles that stayed.
        tools: The number of tools.
        moved_mm: The shift of the station, in any direction.
        runs: The number of runs.
    """
    rng = np.random.default_rng([17, tools, round(1000 * moved_mm), round(1000 * seat[0])])
    seats = (seat[0], seat[0], seat[1]) if seat[0] else ()
    v = np.sqrt(2 * TOUCH**2 + np.square(seats or (0.0, 0.0, 0.0)))
    ways = rng.normal(size=(runs, 3))
    ways *= moved_mm / np.linalg.norm(ways, axis=1, keepdims=True)
    found = 0
    for way in ways:
        drawn = way + rng.normal(0, v, (tools, 3))
        shift = judge_shifts([TipShift(1, tuple(row), TOUCH, seats) for row in drawn.tolist()])
        found += shift is not None and shift.moved
    return 100 * found / runs


def name_of(seat: tuple[float, float]) -> str:
    return "the same nozzles" if not seat[0] else f"{seat[0]:g}, {seat[1]:g}"


def row(seat: tuple[float, float]) -> str:
    """Return one line of the table."""
    cells = [
        " / ".join(f"{share(seat, tools, moved):.1f}".removesuffix(".0") for moved in MOVED)
        for tools in TOOLS
    ]
    return f"| {name_of(seat)} | " + " | ".join(cells) + " |"


def documented(seat: tuple[float, float]) -> dict[tuple[int, float], float]:
    """Return the figures of the page, by number of tools and movement."""
    start = f"| {name_of(seat)} |"
    (line,) = [one for one in PAGE.read_text().splitlines() if one.startswith(start)]
    cells = line.removeprefix(start).strip("|").split("|")
    return {
        (tools, moved): float(said)
        for tools, cell in zip(TOOLS, cells, strict=True)
        for moved, said in zip(MOVED, cell.split("/"), strict=True)
    }


def check(seat: tuple[float, float], cells: list[tuple[int, float]], runs: int) -> None:
    said = documented(seat)
    for tools, moved in cells:
        stated = said[tools, moved]
        likely = min(max(stated, 0.3), 99.7)
        apart = 4 * math.sqrt(likely * (100 - likely) * (1 / runs + 1 / RUNS)) + 0.1
        assert share(seat, tools, moved, runs) == pytest.approx(stated, abs=apart)


def test_some_cells_of_the_table_are_what_the_code_does():
    check((0.1, 0.05), [(1, 0.5), (2, 0.3), (3, 0.2)], 300)
    check((0.2, 0.1), [(3, 0.0)], 300)


@pytest.mark.soak
@pytest.mark.parametrize("seat", SEATS)
def test_the_table_is_what_the_code_does(seat):
    check(seat, [(tools, moved) for tools in TOOLS for moved in MOVED], 2000)


if __name__ == "__main__":
    for of in SEATS:
        print(row(of))  # noqa: T201 - a table for the page
