"""How often what a nozzle change by an own eye states holds the truth.

    python -m tests.eye.coverage 200 --first 720000 --kept cells.jsonl

Both kinds of controllers, pictures over HTTP and from a GigE camera on loopback, the robot's time
virtual. Each cell has a tip, light and a camera of its own; the tip's roughness, dirt, chamfer and
bevel turn with U. A cell is decided by its number, so any of them can be run alone; those that are
in the file ``--kept`` are not run again. A cell with a stepped tip states the row that
docs/reference/eye.md asks for.
"""

import argparse
import json
import os
import random
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any, Final

from robolink.errors import CalibrationError
from tests.certificate.live import Ended, change
from tests.eye.cells import course

PLACES: Final = (("EPSON", "HTTP"), ("PLC", "HTTP"), ("EPSON", "GigE"), ("PLC", "GigE"))
TIPS: Final = ("clean", "rough", "needle", "stepped")
STATED: Final[Mapping[str, Mapping[str, float]]] = {"stepped": {"tip_image_px": 1.0}}
"""The rows of the budget that a cell with such a tip states."""


@dataclass(frozen=True)
class Cell:
    """One nozzle change and how it ended.

    Attributes:
        number: Which.
        kind, way, tip: The controller, how pictures came, what was at the end of the tool.
        ended: How it ended.
    """

    number: int
    kind: str
    way: str
    tip: str
    ended: Ended

    @property
    def outside(self) -> bool:
        """Whether a value stayed that is further off than is stated."""
        return not self.ended.code and self.ended.share > 1


def world_of(number: int) -> dict[str, Any]:
    """Return the tip, the light and the camera of a cell."""
    rng = random.Random(f"eye {number}")
    diameter_mm = rng.uniform(0.7, 1.6)
    return {
        "tip_kind": TIPS[number // len(PLACES) % len(TIPS)],
        "tip_diameter_mm": diameter_mm,
        "tip_bore_mm": diameter_mm * rng.uniform(0.38, 0.58),
        "tip_dirt": rng.choice((0, 0, 0, 1)),
        "picture_glare": rng.uniform(0.05, 0.3),
        "picture_noise_grey": rng.uniform(1.0, 4.0),
        "picture_clutter": rng.randint(0, 4),
        "picture_blur_px": rng.uniform(0.6, 1.2),
        "camera_turn_deg": rng.uniform(-180.0, 180.0),
        "camera_mirrored": rng.random() < 0.5,
    }


def run(number: int, ways: Sequence[str] = ("HTTP", "GigE")) -> Cell:
    """Make one nozzle change."""
    kind, way = [place for place in PLACES if place[1] in ways][number % (2 * len(ways))]
    world = world_of(number)
    rows = STATED.get(world["tip_kind"])
    try:
        ended = change(course("camera", kind, way, **world), number, rows=rows)
    except CalibrationError as error:  # it could not be taught; what follows is in its end
        ended = Ended(f"{error.code} when taught")
    return Cell(number, kind, way, world["tip_kind"], ended)


def line_of(cell: Cell) -> str:
    """Return a cell as a line of a file."""
    ended = cell.ended
    told = (ended.code, ended.taken_back, ended.doubts, ended.off_mm, ended.accurate_mm)
    return json.dumps([cell.number, cell.kind, cell.way, cell.tip, *told])


def cell_of(line: str) -> Cell:
    """Return the cell of such a line."""
    number, kind, way, tip, code, taken_back, doubts, off_mm, accurate_mm = json.loads(line)
    ended = Ended(code, taken_back, tuple(doubts), off_mm, accurate_mm)
    return Cell(number, kind, way, tip, ended)


def table(cells: Sequence[Cell]) -> Iterator[str]:
    """Yield the lines of a table: all, by controller, by way, by tip."""
    yield (
        f"{'':16}{'cells':>6}{'outside':>9}{'refused':>9}{'doubted':>9}"
        f"{'U, median':>11}{'error':>9}{'largest share':>15}"
    )
    for name in ("all", "EPSON", "PLC", "HTTP", "GigE", *TIPS):
        those = [one for one in cells if name in ("all", one.kind, one.way, one.tip)]
        stays = [one.ended for one in those if not one.ended.code]
        if not stays:
            continue
        accurate = median(one.accurate_mm or 0.0 for one in stays)
        off = median(one.off_mm or 0.0 for one in stays)
        yield (
            f"{name:16}{len(those):>6}{sum(one.outside for one in those):>9}"
            f"{len(those) - len(stays):>9}{sum(bool(one.doubts) for one in stays):>9}"
            f"{1000 * accurate:>9.1f}µm{1000 * off:>7.1f}µm{max(one.share for one in stays):>15.2f}"
        )


def main() -> None:
    """Run cells and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=200)
    parser.add_argument("--first", type=int, default=700_000)
    parser.add_argument("--ways", nargs="*", default=["HTTP", "GigE"])
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--kept", type=Path, help="file to which each cell is added")
    options = parser.parse_args()
    begun_s = time.monotonic()
    numbers = range(options.first, options.first + options.count)
    kept: Path | None = options.kept
    lines = kept.read_text().splitlines() if kept is not None and kept.exists() else ()
    cells = [cell for cell in map(cell_of, lines) if cell.number in numbers]
    jobs = [(one, options.ways) for one in numbers if all(one != it.number for it in cells)]
    with get_context("spawn").Pool(options.processes) as pool:
        for cell in pool.imap_unordered(_told, jobs):
            cells.append(cell)
            if kept is not None:
                with kept.open("a") as file:
                    file.write(line_of(cell) + "\n")
            if cell.ended.code or cell.outside or cell.ended.doubts:
                ended = cell.ended
                sys.stderr.write(
                    f"{cell.number} {cell.kind} {cell.way} {cell.tip}: {ended.code or 'written'} "
                    f"{ended.doubts} off {ended.off_mm} of {ended.accurate_mm}\n"
                )
            if len(cells) % 20 == 0:
                sys.stderr.write("\n".join(table(cells)) + "\n")
    sys.stdout.write("\n".join(table(cells)) + f"\n{time.monotonic() - begun_s:.0f} s\n")


def _told(job: tuple[int, Sequence[str]]) -> Cell:
    return run(*job)


if __name__ == "__main__":
    main()
