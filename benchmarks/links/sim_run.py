"""``robolink sim run`` with thousands of simulated EPSON controllers, as a pipeline starts it."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Final

from benchmarks.links.served_fleet import allow_descriptors, resident_kib
from benchmarks.table import Amount, Figure

_CELLS: Final = """schema = "robolink/sim-cells/1"
[cells.fleet]
kind = "epson"
count = {count}
tcp = "127.0.0.1:0"
"""


@dataclass(frozen=True, slots=True)
class Started:
    """A run that was ready.

    Attributes:
        seconds: From its start until it said so.
        kib: What its process takes then.
    """

    seconds: float
    kib: float


def measure_sim_run(count: int, wanted_s: float, wanted_kib: float) -> Iterator[Figure]:
    """Yield until when so many cells are ready, and what each takes, over a run with one cell."""
    allow_descriptors()
    one, all_of_them = started(1), started(count)
    for name, unit, ours, limit in (
        (f"sim run, ready with {count} cells", "s", all_of_them.seconds - one.seconds, wanted_s),
        ("memory of each of them", "KiB", (all_of_them.kib - one.kib) / (count - 1), wanted_kib),
    ):
        against = "wanted, over one cell"
        yield Figure(name, Amount(ours, unit), against, Amount(limit, unit), ours / limit, 1.0)


def started(count: int) -> Started:
    """Serve so many cells by the command, wait until they are ready, and end it."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "cells.toml"
        file.write_text(_CELLS.format(count=count), encoding="utf-8")
        command = [sys.executable, "-m", "robolink_cli", "sim", "run", str(file)]
        command += ["--wait-ready", "--with-parent", "--json"]
        began = perf_counter()
        run = subprocess.run(command, stdout=subprocess.PIPE, check=True)
        seconds = perf_counter() - began
        pid = json.loads(run.stdout)["pid"]
        try:
            return Started(seconds, resident_kib(pid))
        finally:
            os.kill(pid, signal.SIGTERM)
