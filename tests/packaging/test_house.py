"""The house: manageable folders and names, and call paths that do not grow unnoticed."""

import ast
import importlib
import re
import subprocess
from collections import defaultdict
from contextlib import suppress
from pathlib import Path

import pytest

from robolink.deprecation import OLD_NAMES
from tests.packaging._way_to_the_wire import (
    follow_a_tool_write,
    follow_into_the_simulator,
    follow_typed_poses,
)
from tools import api, house

# The house: folders that are understood at a glance, and one thing under one name.

ROOT = Path(__file__).parents[2]
PACKAGES = ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")
MOST_MODULES = 16
"""Fewer folders are easier to find one's way in than shorter ones: a subject is split when it is
two, not when it is long.
"""
MOST_LINES = 500
"""The most lines of a module; most are far shorter."""
IMPORT = re.compile(r"^from (robolink[\w.]*) import (\([^)]*\)|[\w, ]+)", re.MULTILINE)
CLASS = re.compile(r"^class ([A-Za-z]\w*)", re.MULTILINE)


def modules():
    """Yield every module of the three packages."""
    for package in PACKAGES:
        yield from sorted((ROOT / package).rglob("*.py"))


def test_a_folder_holds_no_more_modules_than_a_newcomer_can_tell_apart():
    held = defaultdict(list)
    for path in modules():
        kept_for_one_version = path.read_text(encoding="utf-8").startswith('"""The old name of ')
        if path.name != "__init__.py" and not kept_for_one_version:
            held[str(path.parent.relative_to(ROOT))].append(path.stem)
    assert {folder: names for folder, names in held.items() if len(names) > MOST_MODULES} == {}


def test_nothing_lies_on_the_doorstep():
    known = {".gitignore", "CHANGELOG.md", "LICENSE", "Makefile", "NOTICE", "README.md"}
    known |= {"README.zh.md", "SECURITY.md", "pyproject.toml", "requirements.lock"}
    known |= {"requirements-dev.lock"}
    tracked = subprocess.run(
        ("git", "ls-files", "--", ":(glob)*"), cwd=ROOT, capture_output=True, text=True, check=False
    )
    if tracked.returncode:
        pytest.skip("no git checkout: what is tracked cannot be told from what was made")
    assert set(tracked.stdout.split()) == known


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


def calls_of(name, text):
    """Yield the calls of a function, each parsed alone, as the formatter leaves them."""
    for found in re.finditer(rf"(?<!class )\b{name}\(", text):
        end = found.end()
        while end := text.find(")", end) + 1:
            with suppress(SyntaxError):
                yield ast.parse(text[found.start() : end], mode="eval").body
                break


def test_whoever_gave_something_wrong_is_told_what_to_do_next():
    calls = [
        (path.relative_to(ROOT).as_posix(), call)
        for path in modules()
        for call in calls_of("ConfigError", path.read_text(encoding="utf-8"))
    ]
    assert len(calls) > 100
    bare = [
        (path, ast.unparse(call))
        for path, call in calls
        if "remedy" not in [given.arg for given in call.keywords]
    ]
    assert bare == []


MOST_GROWTH = 1.02
"""A growth by this much over docs/contributing.md is accepted; beyond it the page is rewritten."""


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


# The public names: one place to import each from, shown by ``dir`` and on docs/api.md.

PLAIN = (int, float, str, bool)
"""Two constants of equal value may mean different things."""


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
    """Yield each package with the text of its ``__init__``."""
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
    """``from x import a as a`` is how only the type checker is told."""
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


def test_what_an_old_name_leads_to_is_public(public):
    homes = [new for row in OLD_NAMES.values() for new in row.values()]
    listed = {f"{home}.{name}" for home, names in public.items() for name in names}
    assert [new for new in homes if new not in listed] == []


def test_what_pages_and_examples_import_is_public(public):
    pages = [ROOT / "README.md", ROOT / "simulators/README.md", *ROOT.glob("docs/*.md")]
    strange = []
    for path in [*pages, *ROOT.glob("examples/*/*.py")]:
        for home, names in IMPORT.findall(path.read_text(encoding="utf-8")):
            for name in re.findall(r"\w+", names):
                if name not in public.get(home, ()) and f"{home}.{name}" not in public:
                    strange.append(f"{path.name}: {home}.{name}")
    assert strange == []


# The call paths of a tool write to the wire, and of poses to the solver, do not grow unnoticed.
# docs/decisions/0023-how-short-the-way-of-a-tool-write-is.md says what the figures mean.

MOST_FILES = {"set_tool": 84, "change_tools": 46}
MOST_CALLS = 14
MOST_FILES_OPEN = 10
MOST_FILES_TO_SOLVE = 8
MOST_FILES_OPEN_FROM_THE_POSES = 5
MOST_FILES_OPEN_FROM_THE_COMMAND = 9


@pytest.fixture
def way(epson_tcp, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    return follow_a_tool_write(epson_tcp.url)


@pytest.fixture(scope="module")
def told():
    return house.told(house.PAGE.read_text(encoding="utf-8"))[1]


def test_a_tool_write_passes_through_no_more_files_than_are_known(way, told):
    files = sorted(way.of_the_library("run"))
    assert len(files) <= told["`tool set` to its bytes"], files
    opened = {file for file, _ in way.stack[-MOST_CALLS + 1 :]}
    for name, most in MOST_FILES.items():
        files = sorted(way.entered[name])
        assert opened <= set(files)
        assert len(files) <= most, f"{len(files)} files from {name}() on: {files}"


def test_what_is_open_when_the_request_leaves_can_be_read_from_top_to_bottom(way):
    functions = [function for _, function in way.stack]
    calls = way.stack[functions.index("set_tool") :]
    assert len(calls) <= MOST_CALLS, calls
    assert len({file for file, _ in calls}) <= MOST_FILES_OPEN, calls
    page = Path(__file__).parents[2] / "docs" / "architecture.md"
    told = page.read_text(encoding="utf-8")
    assert [file for file, _ in calls if f"`{file}`" not in told] == []


def test_typed_poses_pass_through_no_more_files_than_are_known(epson_tcp, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    way = follow_typed_poses(epson_tcp.url)
    files, opened = sorted(way.entered["solve"]), {file for file, _ in way.stack}
    assert "robolink/calibration/pin/two_pose.py" in opened
    assert len(files) <= MOST_FILES_TO_SOLVE, files
    assert len(opened) <= MOST_FILES_OPEN_FROM_THE_POSES, way.stack
    assert len({file for file, _ in way.command}) <= MOST_FILES_OPEN_FROM_THE_COMMAND, way.command
    page = Path(__file__).parents[2] / "docs" / "architecture.md"
    told = page.read_text(encoding="utf-8")
    assert [file for file in sorted({*files, *opened}) if f"`{file}`" not in told] == []


def test_a_request_passes_through_no_more_files_of_the_simulator_than_are_known(told):
    entered = sorted(follow_into_the_simulator().entered["receive"])
    assert "simulators/robolink_simulators/epson/memory/tools.py" in entered
    assert len(entered) <= told["a request to the simulator's `TLSet`"], entered


@pytest.mark.soak
def test_a_recipe_passes_through_no_more_files_than_are_known(told, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    way = "a recipe to its first movement"
    assert house.walks()[way] <= told[way]
