"""Packages that load their names when they are used offer exactly the names that they list."""

import ast
import importlib
from pathlib import Path

import pytest

import robolink

ROOT = Path(robolink.__file__).parent
PACKAGES = [
    path
    for path in sorted(ROOT.rglob("__init__.py"))
    if "lazy_exports(" in path.read_text(encoding="utf-8")
]


def listed(source):
    """Return the names under TYPE_CHECKING, each with the module that it comes from."""
    (block,) = (node for node in ast.parse(source).body if isinstance(node, ast.If))
    return {
        alias.name: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


@pytest.mark.parametrize("path", PACKAGES, ids=lambda path: path.parent.name)
def test_the_list_for_readers_is_the_list_of_the_program(path):
    parts = path.parent.relative_to(ROOT.parent).parts
    package = importlib.import_module(".".join(parts))
    names = listed(path.read_text(encoding="utf-8"))
    assert names
    for name, module in names.items():
        assert getattr(package, name) is getattr(importlib.import_module(module), name)
    with pytest.raises(AttributeError, match="no attribute 'nothing_of_the_kind'"):
        package.nothing_of_the_kind  # noqa: B018 - the look-up is the test
