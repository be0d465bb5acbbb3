"""What all tests have in common."""

import gc
import os
import signal
import sys

import pytest

# Before anything imports numpy: threads for matrices of six rows cost far more than they bring,
# the more so the more cores a machine has.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")


def pytest_sessionstart():
    """Let Ctrl-C interrupt: a shell starts what runs in the background with it ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish():
    """Leave thousands of collected tests out of each later search for garbage."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _journals_are_closed():
    """Close the journal of each test: thousands of open files would be too many."""
    yield
    if "robolink.journal" in sys.modules:
        from robolink.journal import close_files

        close_files()
