"""SPEL+ in the simulator: simple statements of a program a second, one core."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from time import perf_counter

from robolink_simulators.epson import EpsonOptions, EpsonSimulator

from benchmarks.table import Amount, Figure

PASSES = 20_000
STATEMENTS = 5 * PASSES
ROUNDS = 5
WANTED_PER_S = 50_000
"""Statements per second above which a program that never waits runs faster than its simulated 50 us
per statement.
"""

_PROGRAM = f"""
Function main
  Long i, n
  Double x
  Integer a(9)
  For i = 1 To {PASSES}
    n = (n + i) Mod 1000
    x = x + Sin(n) / 2
    If n > 500 Then
      a(n Mod 10) = n
    EndIf
  Next
Fend
"""


def measure_spel_programs() -> Iterator[Figure]:
    """Yield how many statements of a loop with sums, calls and an array run a second."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "main.prg"
        path.write_text(_PROGRAM, encoding="utf-8")
        simulator = EpsonSimulator(options=EpsonOptions(loop_passes=10 * PASSES))
        runner = simulator.load([path])
    rates = []
    for _ in range(ROUNDS):
        runner.start("main", simulator.now_ns)
        began = perf_counter()
        simulator.advance(simulator.now_ns + 3600 * 10**9)
        rates.append(STATEMENTS / (perf_counter() - began))
        if runner.tasks or runner.failure:
            raise AssertionError(runner.failure)
    rate = median(rates)
    yield Figure(
        "SPEL+ program, statements",
        Amount(rate, "/s"),
        "wanted",
        Amount(WANTED_PER_S, "/s"),
        WANTED_PER_S / rate,
        1.0,
    )
