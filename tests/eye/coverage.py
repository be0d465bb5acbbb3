"""How often what a nozzle change by an own eye states holds the truth.

    python -m tests.eye.coverage 200 --first 700000

Both kinds of controllers, pictures over HTTP and from a GigE camera on loopback, the robot's time
virtual. Each cell has a tip, light and a camera of its own; the tip's roughness, dirt and bevel
turn with U. A cell is decided by its number, so any of them can be run alone.
"""

import argparse
import os
import random
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from multiprocessing import get_context
from statistics import median
from typing import Any, Final

from tests.certificate.live import Ended, change
from tests.eye.cells import course
from tests.eye.gige.conftest import alone

PLACES: Final = (("EPSON", "HTTP"), ("PLC", "HTTP"), ("EPSON", "GigE"), ("PLC", "GigE"))
TIPS: Final = ("clean", "rough", "needle")


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
    with alone(patient_s=3600.0) if way == "GigE" else nullcontext():
        ended = change(course("camera", kind, way, **world), number)
    return Cell(number, kind, way, world["tip_kind"], ended)


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
    options = parser.parse_args()
    begun_s = time.monotonic()
    cells = list[Cell]()
    jobs = [(options.first + at, options.ways) for at in range(options.count)]
    with get_context("spawn").Pool(options.processes) as pool:
        for cell in pool.imap_unordered(_told, jobs):
            cells.append(cell)
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
