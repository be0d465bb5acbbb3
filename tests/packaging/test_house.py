"""The house: rooms that can be taken in at a look, and one thing under one name."""

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")
MOST_MODULES = 16
"""Fewer folders are easier to find one's way in than shorter ones: a subject is split when it is
two, not when it is long."""
MOST_LINES = 500
"""Of a module that stays one idea; most are far shorter."""


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
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(str(path.relative_to(ROOT)))
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}


def test_whoever_gave_something_wrong_is_told_what_to_do_next():
    bare = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in modules()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "ConfigError"
        and "remedy" not in [given.arg for given in node.keywords]
    ]
    assert bare == []
