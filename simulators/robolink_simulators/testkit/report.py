"""What is attached to a test that failed: what it takes to see why, and to run it again."""

import json
from collections.abc import Iterable

from robolink.timing import NS_PER_S
from robolink_simulators.testkit.served import SimulatedCell

_SHOWN_LINES = 200


def sections_of(cells: Iterable[SimulatedCell]) -> list[tuple[str, str]]:
    """Return heading and text of what is attached for some cells."""
    sections = []
    for cell in cells:
        simulator = cell.simulator
        with simulator.lock:
            head = f"{simulator.machine_name}, seed {simulator.seed}, {cell.url}"
            state = {
                "simulated_s": simulator.now_ns / NS_PER_S,
                "counters": simulator.counters(),
                "faults": cell.do("faults"),
                "truth": simulator.truth(),
            }
            wire, motions = cell.wire.shown(_SHOWN_LINES), cell.motions.shown()
        sections += [
            (f"robolink wire: {head}", wire or "(nothing crossed the wire)"),
            (f"robolink motions: {head}", motions or "(nothing moved)"),
            (f"robolink state: {head}", json.dumps(state, indent=1)),
        ]
    return sections
