"""A plug-in of pytest that records which test executes which line, and what each test costs.

``pytest -p tests.mutants.contexts`` writes a data file of coverage, each test a context of its own,
and a list of costs to the folder that ``ROBOLINK_MUTANTS_LINES`` names, one of each for every
process that shares the tests. It has to be named on the command line: then it is loaded before the
fixtures of robolink, and sees what is executed when a module is imported.
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
    """Give a test, its fixtures included, a context, and note its CPU time."""
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
    """Write what was seen."""
    _coverage.stop()
    _coverage.save()
