"""The tests that run under Windows' Python have beside them what every test reads."""

import ast
from importlib import import_module
from pathlib import Path

from tests.windows._windows_python import ROOT, TAKEN_ALONG


def of_tests(module):
    """Yield the modules of the tests that a module imports, and those that these import."""
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        name = node.module if isinstance(node, ast.ImportFrom) else None
        if name and name.startswith("tests."):
            found = import_module(name)
            yield found
            yield from of_tests(found)


def test_what_the_tests_read_while_they_are_collected_is_taken_along():
    conftest = import_module("tests.conftest")
    read = {
        value.relative_to(ROOT).as_posix()
        for module in (conftest, *of_tests(conftest))
        for value in vars(module).values()
        if isinstance(value, Path) and value.is_file() and ROOT / "tests" not in value.parents
    }
    assert "docs/documents.schema.json" in read
    assert read <= set(TAKEN_ALONG)
