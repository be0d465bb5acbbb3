"""``python -m tests.soak.deed_lengths [KIND ..]``: measure each deed's undisturbed length.

Prints the rows of ``tests/soak/adversary/deed_lengths.py``: the least of three runs of each deed,
so that faults placed within it occur.
"""

import sys
import textwrap
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final
from unittest import mock

from robolink_simulators.faults.counted import CountedFaults

from tests.soak.adversary import CellKind, live_through
from tests.soak.adversary.cell import VirtualCell
from tests.soak.adversary.drawn_hours import deeds_of
from tests.soak.adversary.history import CountedActs, Deed, Habit, History, Hour

RUNS: Final = 3
SEED: Final = 3
WIDTH: Final = 96
REQUESTS: Final = (
    *("", "TLSet", "Tool ", "Move ", "Go ", "Login", "Print Tool"),
    *("WRITE_TOOL", "SELECT_TOOL", "MOVE_LINEAR", "MOVE_DIRECT", "OWNERSHIP", "STOP"),
    *("read_slot", "read_response", "snapshot", "beat", "fc16", "fc5", "fc3"),
    *("HELLO", "BEGIN", "POSE", "SOLVE", "WROTE", "PROOF", "JUDGE", "KEPT"),
)
POINTS: Final = (
    *("", "commit", "commit after", "wire sent", "procedure", "question", "step"),
    *("TLSet", "Tool ", "Move ", "lock Move", "lock TLSet"),
    *("WRITE_TOOL", "SELECT_TOOL", "MOVE_LINEAR", "MOVE_DIRECT", "lock 2103", "lock 5205"),
    *("fc16", "fc5", "WELCOME", "VALUE", "PROVE", "KEEP"),
)


class _Counting:
    """Counts requests and points, hour by hour."""

    def __init__(self) -> None:
        self.requests: list[Counter[str]] = []
        self.points: list[Counter[str]] = []
        self._counts = False

    def patches(self) -> Iterator[Any]:
        """Yield the patches needed for the count."""
        pass_point, take, do = VirtualCell._pass_point, CountedFaults.take, VirtualCell._do
        due, last = CountedActs.due, ""

        def passed(cell: VirtualCell, process: Any, text: str) -> None:
            if self._counts:
                self.points[-1][text] += 1
            pass_point(cell, process, text)

        def taken(faults: Any, request: str, link: Any = None) -> Any:
            if self._counts:
                self.requests[-1][request] += 1
            return take(faults, request, link)

        def asked(acts: CountedActs, text: str) -> Any:
            # Both the line and the controller count each question of a program.
            nonlocal last
            if self._counts and text.startswith("RL1,") and text != last:
                self.requests[-1][text] += 1
            last = text
            return due(acts, text)

        def done(cell: VirtualCell, hour: Hour) -> None:
            self.requests.append(Counter())
            self.points.append(Counter())
            self._counts = True
            try:
                do(cell, hour)
            finally:
                self._counts = False

        yield mock.patch.object(VirtualCell, "_pass_point", passed)
        yield mock.patch.object(VirtualCell, "_do", done)
        yield mock.patch.object(CountedFaults, "take", taken)
        yield mock.patch.object(CountedActs, "due", asked)


def rows(kind: CellKind) -> Iterator[str]:
    """Yield the measured rows for a kind of cell."""
    measured = [deed for deed in deeds_of(kind) if deed is not Deed.COMMAND]
    deeds = measured * RUNS
    hours = tuple(Hour(number, deed, Habit(), ()) for number, deed in enumerate(deeds))
    counting = _Counting()
    patches = list(counting.patches())
    for patch in patches:
        patch.start()
    try:
        story = live_through(History(SEED, kind, hours))
    finally:
        for patch in patches:
            patch.stop()
    assert not story.broken, story.told()
    for deed in measured:
        numbers = [number for number, one in enumerate(deeds) if one is deed]
        yield _row(kind, deed, "requests", REQUESTS, [counting.requests[n] for n in numbers])
        yield _row(kind, deed, "points", POINTS, [counting.points[n] for n in numbers])


def _row(
    kind: CellKind, deed: Deed, what: str, texts: tuple[str, ...], counted: list[Counter[str]]
) -> str:
    found = {
        text: min(sum(n for one, n in run.items() if text in one) for run in counted)
        for text in texts
    }
    counts = ", ".join(f"{_shown(text)} {count}" for text, count in found.items() if count)
    return f"{kind.name} {deed.name} {what}: {counts}"


def _shown(text: str) -> str:
    return text.rstrip() + "_" if text.endswith(" ") else text or "*"


if __name__ == "__main__":
    for one in [CellKind[name] for name in sys.argv[1:]] or CellKind:
        for line in rows(one):
            print("\n".join(textwrap.wrap(line, WIDTH, subsequent_indent="    ")))
