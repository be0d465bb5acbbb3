"""How well a camera measures on the simulator: errors against their own 95 % intervals.

    python -m benchmarks.cameras [CELLS]

Every cell has another seed: another nozzle, board and camera, other noise. The figures stand in
docs/reference/cameras.md 4.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from robolink.calibration import BoardDrawing, CalibrationResult
from robolink.methods import BoardSource, CameraAffineSource, CameraSource
from robolink.model import ToolOffset
from robolink.timing import NS_PER_S
from tests.contract._camera_cell import camera_station, cell_of, furnish, run_source
from tests.contract._sensor_cell import SensorCell

CELLS: Final = 80
ANSWERS_MS: Final = (0, 20)


@dataclass
class Tally:
    """What the cells gave so far.

    Attributes:
        squares_mm2: Sum of the squared errors of X and Y.
        halves_mm: Sum of their half widths.
        lengths: How many X and Y there were.
        inside: How many components of all kinds their interval held.
        components: How many there were.
    """

    squares_mm2: float = 0.0
    halves_mm: float = 0.0
    lengths: int = 0
    inside: int = 0
    components: int = 0

    def add(self, result: CalibrationResult, truth: ToolOffset) -> None:
        """Count one measurement."""
        for name, half in zip(result.measured, result.half_width95, strict=True):
            error = getattr(result.offset, name) - getattr(truth, name)
            self.components += 1
            self.inside += abs(error) <= half
            if name.endswith("_mm"):
                self.squares_mm2 += error * error
                self.halves_mm += half
                self.lengths += 1

    def line(self, name: str) -> str:
        """Return it in words."""
        rms_um = 1000 * math.sqrt(self.squares_mm2 / self.lengths)
        half_um, share = 1000 * self.halves_mm / self.lengths, self.inside / self.components
        return f"{name:14} rms {rms_um:4.1f} um   half {half_um:4.1f} um   inside {share:.1%}"


def camera(cell: SensorCell) -> tuple[Any, ToolOffset]:
    """Return a source with a calibrated camera, and the truth."""
    return CameraSource(cell.url, camera_station(cell)), cell.truth


def camera_affine(cell: SensorCell) -> tuple[Any, ToolOffset]:
    """Return a source with a camera to be found, and the truth."""
    station = camera_station(cell, known=False)
    return CameraAffineSource(cell.url, replace(station, x_mm=station.x_mm + 0.7)), cell.truth


def board(cell: SensorCell, count: int) -> tuple[Any, ToolOffset]:
    """Return a source with a held board of some fiducials, and the truth."""
    furnish(cell, board_held=True)
    held = cell.simulator.world.board
    drawing = BoardDrawing(held.drawing_mm[:count])
    return BoardSource(cell.url, camera_station(cell), drawing), held.frame(cell.truth)


SOURCES: Final[dict[str, Callable[[SensorCell], tuple[Any, ToolOffset]]]] = {
    "camera": camera,
    "camera-affine": camera_affine,
    "board, 2": lambda cell: board(cell, 2),
    "board, 4": lambda cell: board(cell, 4),
}


def change_s(kind: str, name: str, answer_ms: float) -> float:
    """Return how long a change with its turn test takes, by how fast the controller answers."""
    with cell_of(kind) as cell:
        cell.simulator.answer_s = answer_ms / 1000
        source, _ = SOURCES[name](cell)
        began_ns = cell.clock.now_ns()
        run_source(cell, source)
        return (cell.clock.now_ns() - began_ns) / NS_PER_S


def main(cells: int) -> None:
    """Measure in so many cells with each source, and print two lines for each."""
    for name, source_for in SOURCES.items():
        tally = Tally()
        for seed in range(1, cells + 1):
            with cell_of("epson", seed) as cell:
                source, truth = source_for(cell)
                tally.add(run_source(cell, source, write=False).proposal.result, truth)
        print(tally.line(name))
        for answer_ms in ANSWERS_MS:
            epson_s, plc_s = (change_s(kind, name, answer_ms) for kind in ("epson", "softmotion"))
            print(f"  answers after {answer_ms:2} ms: EPSON {epson_s:.1f} s, PLC {plc_s:.1f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else CELLS)
