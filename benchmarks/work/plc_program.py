"""The exported PLC program in the interpreter: how long one cycle of it takes."""

from collections.abc import Iterator
from statistics import median
from time import process_time

from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.program.structured_plc import (
    PROGRAM_SOURCES,
    StructuredPlc,
    program_plc,
)
from robolink_simulators.structured_text import SourceText

from benchmarks.table import Amount, Figure
from robolink.protocols.mailbox.exports import program_texts

CYCLES = 250
ROUNDS = 5
PERIOD_MS = 4.0
"""Period of the task in ms. If a cycle takes less, a simulated PLC runs in real time on one core.
"""


def measure_plc_program() -> Iterator[Figure]:
    """Yield the median time of a cycle of the full profile with the group at rest."""
    texts = program_texts(kinematics="Kin_Scara3_Z")
    sources = [SourceText(name, texts[name], dialect) for name, dialect in PROGRAM_SOURCES]
    simulator = SoftMotionSimulator("Kin_Scara3_Z", make_plc=program_plc(sources))
    plc = simulator.plc
    if not isinstance(plc, StructuredPlc):
        raise AssertionError(plc)
    times_ms = []
    for turn in range(ROUNDS):
        began = process_time()
        for cycle in range(1, CYCLES + 1):
            plc.output((turn * CYCLES + cycle) * 4_000_000)
        times_ms.append((process_time() - began) / CYCLES * 1000)
    scan_ms = median(times_ms)
    yield Figure(
        "exported PLC program, one cycle",
        Amount(scan_ms, "ms"),
        "the period of its task",
        Amount(PERIOD_MS, "ms"),
        scan_ms / PERIOD_MS,
        1.0,
    )
