"""Two processes that share the tests share the compiling of them too.

In a fresh copy each of them would compile all that is tested, and every test with its assertions
spelled out, at the same moment as the other. So every second process imports the tests from the
other end first: each then finds what the other has compiled.
"""

import importlib
import os
from contextlib import suppress
from pathlib import Path

import pytest


def import_from_the_other_end(config: pytest.Config) -> None:
    """Import all tests backwards, in every second process that is given all of them.

    What cannot be imported is told when it is collected.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    tests = config.rootpath / "tests"
    asked = [Path(argument).resolve() for argument in config.args]
    if int(worker[2:]) % 2 == 0 or asked != [tests]:
        return
    for path in sorted(tests.rglob("test_*.py"), reverse=True):
        name = ".".join(path.relative_to(config.rootpath).with_suffix("").parts)
        with suppress(Exception, pytest.skip.Exception):
            importlib.import_module(name)
