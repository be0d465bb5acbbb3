"""A test run in the background or under nohup: what it starts hears signals all the same."""

import signal
import subprocess
import sys

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
