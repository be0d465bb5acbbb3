"""What all tests have in common."""

import sys

import pytest


@pytest.fixture(autouse=True)
def _journals_are_closed():
    """Close the journal of each test: thousands of open files would be too many."""
    yield
    if "robolink.journal" in sys.modules:
        from robolink.journal import close_files

        close_files()
