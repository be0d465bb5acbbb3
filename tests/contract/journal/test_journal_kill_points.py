"""SIGKILL before each statement and each commit: what was acknowledged is there, all else whole."""

import os
import subprocess
import sys
from pathlib import Path

from robolink.journal import ChainVerification
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._killed import STEPS

ROOT = Path(__file__).parents[3]
ENDED = ["intent", "write", "read back", "done"]

# Open markers and entries after so many steps.
STATES: tuple[tuple[list[str], list[str]], ...] = (
    ([], []),
    ([], []),
    (["a"], ["intent"]),
    ([], ENDED),
    ([], [*ENDED, "verify"]),
    (["b"], [*ENDED, "verify", "intent"]),
)


def killed(location, how):
    """Return how many steps were acknowledged, for each place to be killed at."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.contract.journal._killed", location, how],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=50 if hasattr(os, "fork") else 900,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [int(line) for line in done.stdout.split()]


def state(journal, number):
    log = journal.log(f"cell-{number}")
    kinds = [str(entry.kind) for entry in log.recorded()]
    return [known.operation for known in log.open_markers()], kinds[::-1]


def test_each_step_is_whole_or_was_never_begun(location, journal):
    runs = killed(location, "again")
    assert len(runs) > 20
    assert runs == sorted(runs)
    assert runs[-1] == len(STEPS)
    for number, acknowledged in enumerate(runs, start=1):
        found = state(journal, number)
        # A step whose commit was under way may be done without having been acknowledged.
        assert found in STATES[acknowledged : acknowledged + 2], number
    assert journal.verify().problems == ()


def test_a_journal_whose_making_was_cut_short_is_made_by_the_next(tmp_path, open_anew):
    path = str(tmp_path / "journal.db")
    runs = killed(path, "anew")
    assert len(runs) > 15
    for number in range(1, len(runs) + 1):
        journal = open_anew(f"{path}-{number}")
        journal.log("cell").append(NewEntry(EntryKind.RAW))
        assert journal.verify() == ChainVerification(1, ())
