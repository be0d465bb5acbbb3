"""``robolink --help`` against ``python -c "import click"``, as whole processes."""

import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from time import perf_counter_ns

from benchmarks.table import Amount, Figure

ROUNDS = 15


def measure_start_up() -> Iterator[Figure]:
    """Yield the start-up figures; the two commands are run in turn."""
    beside = Path(sys.executable).with_name("robolink")
    robolink = str(beside) if beside.exists() else shutil.which("robolink") or "robolink"
    floor, ours = [sys.executable, "-c", "import click"], [robolink, "--help"]
    _run(floor), _run(ours)
    pairs = [(_run(floor), _run(ours)) for _ in range(ROUNDS)]
    yield Figure(
        "robolink --help",
        Amount(median(b for _, b in pairs), "ms"),
        'python -c "import click"',
        Amount(median(a for a, _ in pairs), "ms"),
        median(b / a for a, b in pairs),
        1.30,
    )


def _run(command: Sequence[str]) -> float:
    start = perf_counter_ns()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return (perf_counter_ns() - start) / 1e6
