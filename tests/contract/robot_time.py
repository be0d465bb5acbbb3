"""Prints how long each shipped recipe takes, by how fast the controller answers.

python -m tests.contract.robot_time [RECIPE ...]

Each is carried out in simulated time, with its turn test; what the simulated person needs is in it,
and the robot's own part is printed apart. Where a person touches, the stop above the pin is drawn
anew each time, so the seconds scatter: the median of a few runs is printed.
"""

import sys
from statistics import median
from typing import Final, NamedTuple

from tests.contract._shipped_cells import CELLS, PLC_CELLS, seconds_of_touches, shipped_cell

ANSWERS_MS: Final = (0, 5, 20, 50)
RUNS: Final = 3


class Measured(NamedTuple):
    """What a change by a recipe took.

    Attributes:
        took_s: Seconds of simulated time.
        exchanges: Requests.
        traffic_bytes: The bytes of these and of their answers.
        robot_s: The robot's own seconds.
    """

    took_s: float
    exchanges: int
    traffic_bytes: int
    robot_s: float


def measured(name: str, answer_ms: float) -> Measured:
    """Return what a change by a recipe takes."""
    with shipped_cell(name, answer_ms) as cell, seconds_of_touches() as touching_s:
        done = cell.change(*cell.words)
        if done.code:
            sys.exit(f"{name} at {answer_ms} ms: exit code {done.code}\n{done.err}")
        document = done.document
        took_s = document["took_s"]
        took = (took_s, document["exchanges"], document["traffic_bytes"])
        return Measured(*took, took_s - touching_s())


def main(names: list[str]) -> None:
    """Print the table."""
    heads = " | ".join(f"{answer_ms} ms" for answer_ms in ANSWERS_MS)
    _show(f"| recipe | requests at 0 ms, at 20 ms | kB | {heads} | the robot at 0 ms |")
    _show(f"|---|---:|---:|{'---:|' * len(ANSWERS_MS)}---:|")
    for name in names or [*CELLS, *PLC_CELLS]:
        found = {
            answer_ms: [measured(name, answer_ms) for _ in range(RUNS)] for answer_ms in ANSWERS_MS
        }
        took = " | ".join(f"{median(run.took_s for run in runs):.1f} s" for runs in found.values())
        asked = ", ".join(f"{median(run.exchanges for run in found[ms]):,}" for ms in (0, 20))
        carried = ", ".join(
            f"{median(run.traffic_bytes for run in found[ms]) / 1000:.0f}" for ms in (0, 20)
        )
        robot_s = median(run.robot_s for run in found[0])
        _show(f"| `{name}` | {asked} | {carried} | {took} | {robot_s:.1f} s |")


def _show(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
