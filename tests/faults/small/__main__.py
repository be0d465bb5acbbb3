"""Runs all small faults, or a part of them: ``python -m tests.faults.small --help``.

Every completed run is one line in a file, so that the whole can be interrupted and continued.
"""

import argparse
import os
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from tests.faults.small.cells import KINDS
from tests.faults.small.faults_of_a_run import Planned, planned
from tests.faults.small.outcomes import split_off


def _done(results: Path) -> dict[str, tuple[int, str]]:
    lines = results.read_text().splitlines() if results.exists() else []
    told = (line.split("\t") for line in lines)
    return {run: (int(members), ended) for members, run, ended in told}


def _counts(done: Iterable[tuple[str, tuple[int, str]]], kind: str) -> str:
    runs, faults, ends = 0, 0, Counter[str]()
    for run, (members, ended) in done:
        if run.startswith(kind):
            runs, faults = runs + 1, faults + members
            ends[ended.partition(":")[0]] += members
    shown = ", ".join(f"{end} {count}" for end, count in sorted(ends.items()))
    return f"{kind}: {faults} faults in {runs} runs: {shown}"


def main() -> int:
    """Make the runs and print the counts."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults.small")
    parser.add_argument("--kind", choices=list(KINDS), action="append")
    parser.add_argument("--results", type=Path, default=Path("build/small-faults.tsv"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1, help="of which are made, with --most")
    parser.add_argument("--most", type=int, default=None, help="how many of a kind, at most")
    given = parser.parse_args()
    given.results.parent.mkdir(parents=True, exist_ok=True)
    os.environ["ROBOLINK_STATE_DIR"] = tempfile.mkdtemp(prefix="robolink-small-")
    for kind in given.kind or KINDS:
        runs = list(planned(kind))
        random.Random(given.seed).shuffle(runs)
        done = _done(given.results)
        left = [run for run in runs if str(run) not in done][: given.most]
        with given.results.open("ab", buffering=0) as results:

            def tell(run: Planned, ended: str) -> None:
                results.write(f"{run.members}\t{run}\t{ended}\n".encode())

            split_off(kind, left, tell, jobs=given.jobs)
        print(_counts(_done(given.results).items(), kind), flush=True)  # noqa: T201 - what it is for
    ended = _done(given.results).items()
    wrong = [f"{run}: {how}" for run, (_, how) in ended if how.startswith("WRONG")]
    print("\n".join(wrong))  # noqa: T201
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
