"""Citations and roles lead to existing targets, and pages stay short."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from inspect import get_annotations
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import pytest

from tools.api import public

# Every citation of a document leads to a page of this repository, and to a heading on it.
#
# Code and pages cite in two ways, and nothing else:
#
# * a path from the root, with the numbers of headings where the page numbers them, or with a
# heading
#   in quotes: ``docs/reference/epson.md 1.2, 1.4`` and ``docs/reference/mailbox.md, "Owners"``;
# * in Markdown, a link with the heading behind ``#``.
#
# The numbers of faults (F and two digits) are headings of docs/reference/faults.md.

ROOT = Path(__file__).parents[2]
ROOMS = ("robolink", "cli", "simulators", "companions", "benchmarks", "tests", "examples", "docs")
SUFFIXES = (".py", ".md", ".lark", ".toml", ".st", ".prg")

GAP = r"\s+(?:(?:#|//|\*)\s+)?"
"""Blanks, or a line break followed by a comment sign."""

NUMBER = r"(?:F\d\d|\d{1,2}(?:\.\d{1,2})?)(?![\d/]|\.\d)"
CITED = re.compile(
    r"(?P<page>docs/(?<![\w/]docs/)(?:[\w./-]*\.(?:md|json)|decisions/\d{4}[\w-]*))"
    rf"(?:{GAP}(?P<numbers>{NUMBER}(?:,{GAP}{NUMBER})*)(?!\w)"
    rf'|,{GAP}"(?P<heading>[^"]+)")?'
)
LINK = re.compile(r"\]\((?![a-z]+:)(?P<page>[^)#\s]*)(?:#(?P<anchor>[^)\s]+))?\)")
FAULTS = re.compile(r"\((?:[^()]{0,60}[;,] )?(?P<numbers>F\d\d(?:, F\d\d)*)[).;]")
FILE = re.compile(r"`((?:robolink|cli|simulators|tests|docs|companions)/[\w./*-]*)`")
BARE = re.compile(r"(?<![\w./{}-])(?P<name>[a-z][\w-]*\.md)(?![\w#])")
UNKNOWN = re.compile(rf"design(?<!\wdesign){GAP}(?:parts?{GAP})?\d")


@pytest.fixture(scope="module")
def texts() -> list[tuple[Path, str]]:
    """The text of every file that may cite another, read once."""
    files = [ROOT / "README.md", ROOT / "CHANGELOG.md"]
    for room in ROOMS:
        files += sorted(f for f in (ROOT / room).rglob("*") if f.suffix in SUFFIXES)
    return [(file, file.read_text(encoding="utf-8")) for file in files if file != Path(__file__)]


def slug(heading: str) -> str:
    """Return a heading's anchor on GitHub, and on the pages that `make docs` builds."""
    plain = re.sub(r"[`*]|\[([^]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")


@cache
def headings(page: Path) -> tuple[str, ...]:
    plain = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    return tuple(re.findall(r"^#{1,6} (.+?)\s*$", plain, flags=re.M))


def numbers(page: Path) -> set[str]:
    found = (re.match(r"(F\d\d|\d+(?:\.\d+)*)\.? ", h) for h in headings(page))
    return {m.group(1) for m in found if m}


def pages_of(name: str) -> list[Path]:
    """Return the page of a cited path: the path itself, or a decision record by its number."""
    path = ROOT / name
    return [path] if path.exists() else sorted(path.parent.glob(f"{path.name}-*.md"))


def wrong_citations(text: str) -> Iterator[str]:
    for found in CITED.finditer(text):
        pages = pages_of(found["page"])
        if len(pages) != 1:
            yield f"{found['page']}: no such page"
            continue
        for number in re.findall(NUMBER, found["numbers"] or ""):
            if number not in numbers(pages[0]):
                yield f"{found['page']} has no heading {number}"
        heading = re.sub(GAP, " ", found["heading"] or "")
        if heading and heading not in headings(pages[0]):
            yield f"{found['page']} has no heading {heading!r}"


def wrong_links(file: Path, text: str) -> Iterator[str]:
    plain = re.sub(r"^```.*?^```|`[^`\n]*`", "", text, flags=re.M | re.S)
    for found in LINK.finditer(plain):
        page = (file.parent / found["page"]).resolve() if found["page"] else file
        if not page.exists():
            yield f"{found['page']}: no such page"
        elif found["anchor"] and found["anchor"] not in map(slug, headings(page)):
            yield f"{found['page']} has no heading #{found['anchor']}"


def test_every_citation_leads_to_a_heading(texts):
    wrong = [f"{f.relative_to(ROOT)}: {w}" for f, t in texts for w in wrong_citations(t)]
    assert not wrong, "\n".join(wrong)


def test_every_link_leads_to_a_heading(texts):
    pages = ((f, t) for f, t in texts if f.suffix == ".md")
    wrong = [f"{f.relative_to(ROOT)}: {w}" for f, t in pages for w in wrong_links(f, t)]
    assert not wrong, "\n".join(wrong)


def test_the_lists_of_facts_and_decisions_are_whole():
    decisions = (ROOT / "docs/decisions/README.md").read_text(encoding="utf-8")
    facts = (ROOT / "docs/reference/README.md").read_text(encoding="utf-8")
    for page in (ROOT / "docs/reference").glob("*.md"):
        assert page.name == "README.md" or f"]({page.name})" in facts, page.name
    for page in (ROOT / "docs/decisions").glob("[0-9]*.md"):
        assert f"]({page.name})" in decisions, page.name


@pytest.mark.parametrize("page", ["architecture.md", "contributing.md"])
def test_every_file_that_a_guide_names_exists(page):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    named = {name for name in FILE.findall(text) if "NAME" not in name and "LANGUAGE" not in name}
    assert named
    assert not [name for name in sorted(named) if not list(ROOT.glob(name))]


def test_the_picture_of_the_rooms_is_that_of_the_import_contracts():
    drawn = [sys.executable, str(ROOT / "docs/site/rooms.py"), "--check"]
    assert subprocess.run(drawn, check=False).returncode == 0


def test_no_page_is_cited_by_its_name_alone_but_one_that_lies_beside_it_or_in_docs(texts):
    lines = ((f, line) for f, t in texts if ".md" in t for line in t.splitlines() if ".md" in line)
    named = [(f, m["name"]) for f, line in lines for m in BARE.finditer(line)]
    wrong = {
        f"{file.relative_to(ROOT)}: {name}"
        for file, name in named
        if not any((folder / name).exists() for folder in (file.parent, ROOT, ROOT / "docs"))
        and not (ROOT / "companions/codesys" / name).exists()
    }
    assert not wrong, "\n".join(sorted(wrong))


def test_every_number_of_a_fault_is_in_the_catalogue(texts):
    known = numbers(ROOT / "docs/reference/faults.md")
    cited = {n for _, t in texts for m in FAULTS.finditer(t) for n in m["numbers"].split(", ")}
    assert cited
    assert cited <= known


def test_nothing_cites_a_document_that_is_not_here(texts):
    wrong = [f"{f.relative_to(ROOT)}: {m[0]}" for f, t in texts for m in UNKNOWN.finditer(t)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "text",
    [
        "docs/reference/epson.md 1.99",
        "docs/reference/epson.md 1.4,\n    # 77.7",
        'docs/reference/mailbox.md, "Landlords"',
        "docs/reference/nowhere.md",
        "docs/decisions/9999",
        "docs/reference/faults.md F99",
    ],
)
def test_a_citation_that_leads_nowhere_is_found(text):
    assert list(wrong_citations(text))


@pytest.mark.parametrize(
    "text",
    [
        "docs/reference/epson.md 1.2,\n# 1.4; docs/reference/spel.md 7.1, p. 831",
        'docs/reference/mailbox.md, "When a command\n    counts"',
        "docs/decisions/0017",
        "docs/reference/faults.md F46, F47",
    ],
)
def test_a_citation_that_leads_somewhere_is_followed(text):
    assert not list(wrong_citations(text))


# A role of a docstring, such as a function's name to click on, leads to an existing target.
# A short name is looked for where a reader would: in the class and module of the docstring, with
# what these import, and among the names that the packages around the module export.

PACKAGES = ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")
ROLE = re.compile(r":(?:py:)?(mod|class|func|meth|attr|data|exc|const|obj):`([^`]*)`")
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class Role(NamedTuple):
    """A role in a docstring: its place and its target."""

    module: str
    owners: tuple[str, ...]
    target: str


class Cited(NamedTuple):
    """What the docstrings of a module name, and what it imports; a parse tree is large."""

    roles: list[Role]
    imported: dict[str, tuple[str, str]]


@cache
def modules() -> dict[str, Cited]:
    """Return every module with a role, by its dotted name; others have nothing to check."""
    found = {}
    for package in PACKAGES:
        top = (ROOT / package).parent
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(top).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            text = path.read_text(encoding="utf-8")
            if ROLE.search(text):
                tree = ast.parse(text)
                found[name] = Cited(list(roles(name, tree)), imported(tree))
    return found


def texts_with_roles(
    node: ast.AST, owners: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the docstrings inside a node, those of attributes too, with the classes around them."""
    for child in getattr(node, "body", ()):
        inside = (*owners, child.name) if isinstance(child, ast.ClassDef) else owners
        if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
            if isinstance(child.value.value, str):
                yield owners, child.value.value
        elif isinstance(child, DOCUMENTED):
            yield from texts_with_roles(child, inside)


def targets(text: str) -> Iterator[str]:
    """Yield the targets of a docstring's roles."""
    for _, written in ROLE.findall(text):
        named = re.fullmatch(r"[^<]*<([^>]*)>", written)
        target = (named[1] if named else written).strip().lstrip("~!.")
        yield " ".join(target.split()).removesuffix("()")


def roles(module: str, tree: ast.Module) -> Iterator[Role]:
    """Yield the roles in the docstrings of a module."""
    for owners, text in texts_with_roles(tree):
        for target in targets(text):
            yield Role(module, owners, target)


def imported(tree: ast.Module) -> dict[str, tuple[str, str]]:
    """Return what a module imports, for the type checker and inside functions too."""
    return {
        alias.asname or alias.name: (node.module, alias.name)
        for node in statements(tree)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield every statement inside a node; its expressions, ten times as many, hold none."""
    for block in ("body", "handlers", "orelse", "finalbody", "cases"):
        for child in getattr(node, block, ()):
            yield child
            yield from statements(child)


def followed(thing: Any, names: list[str]) -> bool:
    """Return whether a chain of attributes exists, annotated ones included."""
    for number, name in enumerate(names):
        if not hasattr(thing, name):
            said = {key for one in getattr(thing, "__mro__", ()) for key in _said(one)}
            return number == len(names) - 1 and name in said
        thing = getattr(thing, name)
    return True


def _said(one: type) -> set[str]:
    # An attribute that __init__ alone sets counts as well if the docstring names it.
    text = one.__doc__ or ""
    return {*get_annotations(one), *re.findall(r"^ {4,8}([\w, ]+):", text, re.M)}


def absolute(names: list[str]) -> bool:
    """Return whether a whole dotted name leads somewhere."""
    for count in range(len(names), 0, -1):
        try:
            module = import_module(".".join(names[:count]))
        except ImportError:
            continue
        return followed(module, names[count:])
    return False


def leads_somewhere(role: Role) -> bool:
    """Return whether a role's target exists."""
    names = role.target.split(".")
    if names[0] in {package.rpartition("/")[2] for package in PACKAGES} or len(names) > 2:
        return absolute(names)
    home: Any = import_module(role.module)
    for count in range(len(role.owners), -1, -1):
        owner = home
        for one in role.owners[:count]:
            owner = getattr(owner, one)
        if followed(owner, names):
            return True
    if names[0] in (known := modules()[role.module].imported):
        module, name = known[names[0]]
        return absolute([*module.split("."), name, *names[1:]])
    packages = role.module.split(".")
    around = (".".join(packages[:count]) for count in range(len(packages), 0, -1))
    return any(followed(import_module(package), names) for package in around) or absolute(names)


@pytest.mark.parametrize("package", [package.rpartition("/")[2] for package in PACKAGES])
def test_what_a_docstring_names_is_there(package):
    found = [
        role
        for name, module in modules().items()
        if name.split(".")[0] == package
        for role in module.roles
    ]
    assert len(found) > 20
    assert [role for role in found if not leads_somewhere(role)] == []


def without_a_page(text: str, packages: set[str], names: set[str]) -> list[str]:
    """Return the targets with a whole path in a text that no page of the API describes."""
    whole = [target for target in targets(text) if target.startswith("robolink")]
    return [
        one for one in whole if one not in packages and not {one, one.rpartition(".")[0]} & names
    ]


def members(thing: object) -> Iterator[object]:
    """Yield the members that a class's page describes."""
    if isinstance(thing, type):
        shown = (one for name, one in vars(thing).items() if not name.startswith("_"))
        yield from (one for one in shown if isinstance(one, FunctionType | property))


def test_what_a_page_of_the_api_names_has_a_page():
    pages = public()
    texts = [import_module(package).__doc__ or "" for package in pages]
    things = [thing for named in pages.values() for thing in named.values()]
    for one in (*things, *(member for thing in things for member in members(thing))):
        texts.append(getattr(one, "__doc__", "") or "")
    known = {*pages}, {f"{package}.{name}" for package in pages for name in pages[package]}
    assert [one for text in texts for one in without_a_page(text, *known)] == []
    assert without_a_page("Says :mod:`robolink.locale.languages`.", *known)


def test_what_a_page_links_to_is_built_with_it():
    conf = (DOCS / "site" / "conf.py").read_text(encoding="utf-8")
    written = re.search(r"^include_patterns = (\[.*?\])", conf, re.M | re.S)
    assert written
    there = [
        re.escape(one).replace(r"\*\*", ".*").replace(r"\*", "[^/]*")
        for one in ast.literal_eval(written[1])
    ]
    linked = {
        (page.parent / link).resolve().relative_to(ROOT).as_posix()
        for page in DOCS.rglob("*.md")
        for link in re.findall(r"\]\(([\w./-]+\.md)[)#]", page.read_text(encoding="utf-8"))
    }
    assert [one for one in linked if not re.fullmatch("|".join(there), one)] == []


@pytest.mark.parametrize(
    ("module", "owners", "target", "there"),
    [
        ("robolink.model._movement", ("WorkBox",), "about", True),
        ("robolink.model._movement", ("WorkBox",), "above", False),
        ("robolink.methods.given_poses", (), "TwoTouches", True),
        ("robolink.methods.given_poses", (), "robolink.procedures.TipSource", True),
        ("robolink.methods.given_poses", (), "robolink.procedures.TipSink", False),
        ("robolink.methods.given_poses", (), "solve_two_poses", False),
    ],
)
def test_a_wrong_name_is_found(module, owners, target, there):
    assert leads_somewhere(Role(module, owners, target)) is there


# Nobody reads a house full of paper: the number of pages and records, and the length of two.
# The history is in git. A page too many is joined with the one that its reader has open anyway; so
# is a decision record with the one on its subject.

DOCS = ROOT / "docs"


def test_there_are_at_most_forty_five_pages_beside_reference_and_decisions():
    assert len(list(DOCS.glob("*.md"))) <= 45
    folders = {page.parent.name for page in DOCS.rglob("*.md")}
    assert folders == {"docs", "reference", "decisions"}


def test_there_are_at_most_forty_decision_records():
    assert len(list((DOCS / "decisions").glob("*.md"))) <= 40


@pytest.mark.parametrize(("name", "lines"), [("CHANGELOG.md", 80), ("README.md", 80)])
def test_what_everybody_reads_fits_on_its_screens(name, lines):
    text = (ROOT / name).read_text(encoding="utf-8").splitlines()
    assert len(text) <= lines
    assert [line for line in text if len(line) > 120] == []
