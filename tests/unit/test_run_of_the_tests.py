"""A run of the tests: what it starts hears signals, and processes share it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import hear_signals

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

HEARD = (signal.SIGINT, signal.SIGHUP)


def ignored_by_what_is_started():
    """Which of the signals a program ignores that this process starts."""
    told = subprocess.run(["cat", "/proc/self/status"], capture_output=True, text=True, check=True)
    (line,) = (line for line in told.stdout.splitlines() if line.startswith("SigIgn:"))
    mask = int(line.split()[1], 16)
    return [number for number in HEARD if mask >> (number - 1) & 1]


def test_what_is_started_hears_signals_that_this_process_was_started_without():
    before = {number: signal.signal(number, signal.SIG_IGN) for number in HEARD}
    try:
        assert ignored_by_what_is_started() == list(HEARD)
        hear_signals()
        assert ignored_by_what_is_started() == []
        signal.raise_signal(signal.SIGHUP)  # the run itself goes on
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


SHARED = {
    "test_a.py": "def test_well(tmp_path): pass\ndef test_wrong(): assert not 1",
    "test_b.py": "import os\ndef test_ends_its_process(): os._exit(0)",
}


@pytest.mark.soak
@pytest.mark.parametrize(
    ("asked", "code", "told"),
    [
        (["test_a.py"], 1, "1 failed, 1 passed"),
        (["-x", "test_a.py"], 1, "stopping after 1 failures"),
        (["test_a.py", "test_b.py"], 2, "ended in the middle"),
    ],
)
def test_processes_that_share_the_tests_tell_how_each_ended(tmp_path, asked, code, told):
    for name, text in SHARED.items():
        (tmp_path / name).write_text(text)
    command = [sys.executable, "-m", "pytest", "-p", "tests._processes", "--processes", "2"]
    done = subprocess.run(
        [*command, "-p", "no:cacheprovider", *asked],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, told in done.stdout) == (code, True), done.stdout
