"""``make faults``: run the tests of the fault catalogue and print which rows they show.

``python -m tests.faults.catalogue [F01 F25 ...]``; without numbers all rows. Ends with 1 if a row
failed or the run was cut short. A row that could not be shown here is listed with its reason, and
never as passed.
"""

import platform
import sys
from collections import Counter

import pytest

from tests.faults.catalogue._rows import rows
from tests.faults.catalogue._shown_by import showings
from tests.faults.catalogue._verdicts import Listener, judged

_TEST_S = 600
"""A minute, as in the suite, is too little on a busy computer."""


def main(wanted: list[str]) -> int:
    """Run and print; return the exit code."""
    chosen = [row for row in rows() if row.id in wanted or not wanted]
    if unknown := set(wanted) - {row.id for row in chosen}:
        print(f"no such row: {', '.join(sorted(unknown))}", file=sys.stderr)
        return 2
    numbers = {row.id for row in chosen}
    nodes = [s.node for s in showings() if numbers & set(s.faults)]
    listener = Listener()
    # An expression with soak in it includes the long tests (tests/conftest.py).
    everything = ["-m", "fault and (soak or not soak)", "--quiet", "--no-header", "-r", "fE"]
    everything += ["--timeout", str(_TEST_S), "--processes", "2"]
    ended = pytest.main([*everything, *nodes], plugins=[listener]) if nodes else 0
    verdicts = [judged(row, showings(), listener.ends) for row in chosen]
    print("\n".join(["", *(verdict.line for verdict in verdicts), ""]))
    count = Counter(verdict.word for verdict in verdicts)
    words = ("passed", "in part", "FAILED", "not run")
    print(f"{len(verdicts)} faults: " + ", ".join(f"{count[word]} {word}" for word in words))
    hardware = sum(end.on_hardware for of_row in listener.ends.values() for end in of_row.values())
    print(f"All of it on {platform.system()}; what holds on another system, no row shows.")
    print(f"Not run, for want of a real controller: {hardware} tests, of rows shown on simulators.")
    return 1 if count["FAILED"] or ended else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
