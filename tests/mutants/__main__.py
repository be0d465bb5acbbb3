"""``python -m tests.mutants``: automatically made mutants, and the tests that kill them.

Mutants are drawn by a seed from every place of the product that can be changed. Each runs against
the tests that execute its line, the quickest first, until one fails; if none does, against the
adversary's two hundred virtual hours. Every judgement is a line of ``build/mutants/results.jsonl``,
so that a run can be continued at any time. Survivors must be reviewed by hand:
``tests/mutants/gone_through.toml`` says of each whether it is equivalent, or what finds it now.
Ends with 1 while one is missing there.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

from tests.mutants.judging import Copy
from tests.mutants.lines import Lines, record
from tests.mutants.places import ROOT, drawn
from tests.mutants.table import Results, table

FOLDER = ROOT / "build" / "mutants"


def main() -> int:
    """Judge the rest of a draw while there is time, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants")
    parser.add_argument("--seed", type=int, default=32, help="of the draw")
    parser.add_argument("--draw", type=int, default=300, help="how many mutants")
    parser.add_argument("--minutes", type=float, help="begin no other after so many minutes")
    parser.add_argument("--limit", type=int, help="judge so many that were not judged yet, at most")
    parser.add_argument("--again", action="store_true", help="judge the survivors of before again")
    parser.add_argument("--table", action="store_true", help="judge nothing, print the table")
    given = parser.parse_args()
    end_s = time.monotonic() + 60 * given.minutes if given.minutes is not None else float("inf")
    results = Results(FOLDER / "results.jsonl", Path(__file__).with_name("gone_through.toml"))
    chosen = drawn(ROOT, seed=given.seed, count=given.draw)
    if given.again:
        left = [one for one in chosen if results.survived(one)]
    else:
        left = [one for one in chosen if not results.judged(one)]
    if left and not given.table:
        record(FOLDER / "lines")
        lines, copy = Lines(FOLDER / "lines"), Copy(FOLDER / "tree")
        for mutant in left[: given.limit]:
            if time.monotonic() > end_s:
                break
            judgement = copy.judge(mutant, lines)
            results.keep(mutant, judgement, _commit())
            print(f"{judgement.by:8} {mutant.name}", file=sys.stderr, flush=True)
        copy.close()
    print("\n".join(table(chosen, results)))
    return 1 if any(not results.verdict(one) for one in chosen if results.survived(one)) else 0


def _commit() -> str:
    command = ["git", "rev-parse", "--short=10", "HEAD"]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
