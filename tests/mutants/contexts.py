"""A pytest plug-in that records which test executes which line, and the cost of each test.

``pytest -p tests.mutants.contexts`` writes a data file of coverage, with a context for each test,
and a list of costs to the folder that ``ROBOLINK_MUTANTS_LINES`` names, one of each for every
process that shares the tests. It must be named on the command line: then it is loaded before the
fixtures of robolink, and records the lines executed by imports.
"""

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import coverage
import pytest

from tests.mutants.lines import FOLDER
from tests.mutants.places import PACKAGES, ROOT

_FOLDER: Final = Path(os.environ[FOLDER])

_coverage: Final = coverage.Coverage(
    data_file=str(_FOLDER / "lines"),
    data_suffix=True,  # one of its own for every process
    source=[str(ROOT / folder) for folder in PACKAGES],
    config_file=False,
)
_coverage.set_option("run:disable_warnings", ["no-data-collected", "module-not-measured"])
_coverage.start()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Give a test, with its fixtures, a context, and note its CPU time."""
    begun_s = time.process_time()
    _coverage.switch_context(item.nodeid)
    try:
        return (yield)
    finally:
        _coverage.switch_context("")
        row = {"test": item.nodeid, "cpu_s": round(time.process_time() - begun_s, 4)}
        with (_FOLDER / f"costs.{os.getpid()}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Note each test that fails here: it cannot judge a mutant."""
    if report.failed:
        with (_FOLDER / f"failed.{os.getpid()}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps({"test": report.nodeid}) + "\n")


def pytest_sessionfinish() -> None:
    """Write the records."""
    _coverage.stop()
    _coverage.save()
