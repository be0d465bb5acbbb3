"""What is public: one place to import each name from, shown by ``dir`` and on docs/api.md."""

import ast
import importlib
from collections import defaultdict
from pathlib import Path

import pytest

from tools import api

ROOT = Path(__file__).parents[2]
PLAIN = (int, float, str, bool)
"""Two constants with one value are not one thing."""


@pytest.fixture(scope="module")
def public():
    return api.public()


def test_each_name_is_listed_once_in_order_and_shown(public):
    assert len(public) > 40
    for package, names in public.items():
        assert [*names] == sorted(set(names)), package
        assert {*names} <= {*dir(importlib.import_module(package))}, package


def test_each_name_has_one_place_to_import_it_from(public):
    places = defaultdict(list)
    for package, names in public.items():
        for name, thing in names.items():
            if package != "robolink" and not isinstance(thing, PLAIN):
                places[name, id(thing)].append(package)
    assert {name: found for (name, _), found in places.items() if len(found) > 1} == {}


def test_what_the_front_door_offers_comes_from_one_package_beneath(public):
    for name, thing in public["robolink"].items():
        found = [package for package, names in public.items() if names.get(name) is thing]
        assert len(found) == 2, (name, found)


def inits():
    """Yield each package with what its ``__init__`` says."""
    for top in ("robolink", "simulators/robolink_simulators"):
        for path in sorted((ROOT / top).rglob("__init__.py")):
            parts = path.parent.relative_to((ROOT / top).parent).parts
            yield ".".join(parts), path.read_text(encoding="utf-8")


LAZY = {package: source for package, source in inits() if "lazy_exports(" in source}


@pytest.mark.parametrize("package", LAZY)
def test_the_list_for_readers_is_the_list_of_the_program(package):
    tree = ast.parse(LAZY[package])
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    module = importlib.import_module(package)
    homes = {
        alias.name: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(homes) == module.__all__
    for name, home in homes.items():
        assert getattr(module, name) is getattr(importlib.import_module(str(home)), name)
    with pytest.raises(AttributeError, match="no attribute 'nothing_of_the_kind'"):
        module.nothing_of_the_kind  # noqa: B018 - the look-up is the test


def test_no_other_package_hands_out_what_it_does_not_list():
    """``from x import a as a`` is how the type checker alone is told."""
    for package, source in inits():
        if package in LAZY:
            continue
        handed = [
            alias.name
            for node in ast.walk(ast.parse(source))
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
            if alias.asname == alias.name
        ]
        assert handed == [], package


def test_the_page_names_what_is_public():
    assert api.PAGE.read_text(encoding="utf-8") == api.page(), ".venv/bin/python -m tools.api"
