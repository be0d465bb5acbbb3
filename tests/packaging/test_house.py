"""The house: rooms that can be taken in at a look, and one thing under one name."""

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

from tools import house

ROOT = Path(__file__).parents[2]
PACKAGES = ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")
MOST_MODULES = 16
"""Fewer folders are easier to find one's way in than shorter ones: a subject is split when it is
two, not when it is long."""
MOST_LINES = 500
"""Of a module that stays one idea; most are far shorter."""
CLASS = re.compile(r"^class ([A-Za-z]\w*)", re.MULTILINE)


def modules():
    """Yield every module of the three packages."""
    for package in PACKAGES:
        yield from sorted((ROOT / package).rglob("*.py"))


def test_a_folder_holds_no_more_modules_than_a_newcomer_can_tell_apart():
    held = defaultdict(list)
    for path in modules():
        if path.name != "__init__.py":
            held[str(path.parent.relative_to(ROOT))].append(path.stem)
    assert {folder: names for folder, names in held.items() if len(names) > MOST_MODULES} == {}


def test_a_module_can_be_read_in_one_go():
    lines = {
        str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines())
        for path in modules()
    }
    assert {path: count for path, count in lines.items() if count > MOST_LINES} == {}


def test_a_public_class_shares_its_name_with_no_other():
    homes = defaultdict(list)
    for path in modules():
        for name in CLASS.findall(path.read_text(encoding="utf-8")):
            homes[name].append(str(path.relative_to(ROOT)))
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}


def test_whoever_gave_something_wrong_is_told_what_to_do_next():
    bare = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in modules()
        if "ConfigError(" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "ConfigError"
        and "remedy" not in [given.arg for given in node.keywords]
    ]
    assert bare == []


MOST_GROWTH = 1.02
"""So much more than docs/contributing.md shows goes by; beyond it the page is written anew."""


@pytest.fixture(scope="module")
def counted():
    return house.counts()


@pytest.mark.parametrize("part", house.PARTS)
def test_no_part_grows_unnoticed(part, counted):
    told, _ = house.told(house.PAGE.read_text(encoding="utf-8"))
    grown = {
        column: (before, now)
        for column, before, now in zip(house.COLUMNS, told[part], counted[part], strict=True)
        if now > before * MOST_GROWTH
    }
    assert grown == {}, "meant so? .venv/bin/python -m tools.house --write"


def test_what_is_counted_is_code():
    module = '''"""Prose
of two lines."""

from a import (
    b,
)
import c

# a comment


def first(
    one: int,
) -> int:
    """More prose."""
    import d

    text = """goes
def no_function
on"""
    return one


class Thing:
    """Prose."""

    def second(self): return 1
    # its end
'''
    one = house.count_module(module)
    assert (one.code, sorted(one.lengths)) == (9, [1, 10])
