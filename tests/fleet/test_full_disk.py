"""A disk of the record that becomes full anywhere in a change: nothing is sent, or it is sent once.

On a real file system of 3 MB, in a name space of its own (``_full_disk.py``). What a file keeps for
that is tested in ``tests/contract/journal/test_journal_reserve.py``.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fleet._full_disk import NEW_MM, NOT_MOUNTED

ROOT = Path(__file__).parents[2]
COMMITS = 7
"""One more than a change by an order makes."""


def found_on(disk, *given):
    if sys.platform != "linux":
        pytest.skip("a small file system of its own needs Linux' name spaces")
    disk.mkdir()
    command = [sys.executable, "-m", "tests.fleet._full_disk", str(disk), json.dumps(given)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if ended.returncode == NOT_MOUNTED:
        pytest.skip(f"no small file system can be mounted here: {ended.stderr.strip()}")
    assert ended.returncode == 0, ended.stderr
    return [json.loads(line) for line in ended.stdout.splitlines()]


def require_once(found):
    """Check every case; return how many were written while the disk was full."""
    written = 0
    for one in found:
        first, again = one["first"], one["again"]
        if first["code"] == 0:
            assert (first["writes"], first["holds"]) == (1, NEW_MM), one
            assert again["what"] == "Written before.", one
            written += 1
        else:
            assert (first["writes"], first["holds"]) == (0, one["old"]), one
            assert first["error"] in ("JournalError", "PlantError"), one
            assert again["what"] == "Written and read back.", one
        assert (again["code"], again["writes"], again["holds"]) == (0, 1, NEW_MM), one
        assert (one["put_back"], one["problems"]) == (0, []), one
    return written


@pytest.mark.fault("F61")
@pytest.mark.timeout(300)
def test_a_change_on_a_disk_that_becomes_full_is_written_once_or_not(tmp_path):
    full = {"earlier": [0], "commits": [*range(1, COMMITS + 1)], "free_pages": [0]}
    nearly = {"earlier": [2], "commits": [2], "free_pages": [24]}
    found = found_on(tmp_path / "disk", full, nearly)
    assert len(found) == COMMITS + 1
    assert 0 < require_once(found) < len(found)


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("earlier", [0, 1, 2, 9, 14, 15, 16, 17])
def test_at_every_commit_and_every_page_that_is_left(tmp_path, earlier):
    given = {
        "earlier": [earlier],
        "commits": [*range(1, COMMITS + 1)],
        "free_pages": [*range(90)],
    }
    found = found_on(tmp_path / "disk", given)
    assert len(found) == COMMITS * 90
    assert require_once(found)
