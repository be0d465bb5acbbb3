"""Every citation of a document leads to a page of this repository, and to a heading on it.

Code and pages cite in two ways, and nothing else:

* a path from the root, with the numbers of headings where the page numbers them, or with a heading
  in quotes: ``docs/reference/epson.md 1.2, 1.4`` and ``docs/mailbox.md, "Owners"``;
* in Markdown, a link with the heading behind ``#``.

The numbers of faults (F and two digits) are headings of docs/reference/faults.md.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = ("robolink", "cli", "simulators", "companions", "benchmarks", "tests", "examples", "docs")
SUFFIXES = (".py", ".md", ".lark", ".toml", ".st", ".prg")

GAP = r"\s+(?:(?:#|//|\*)\s+)?"
"""Blanks, or a line break with the sign of a comment behind it."""

NUMBER = r"(?:F\d\d|\d{1,2}(?:\.\d{1,2})?)(?![\d/]|\.\d)"
CITED = re.compile(
    r"(?<![\w/])(?P<page>docs/(?:[\w./-]*\.(?:md|json)|decisions/\d{4}[\w-]*))"
    rf"(?:{GAP}(?P<numbers>{NUMBER}(?:,{GAP}{NUMBER})*)(?!\w)"
    rf'|,{GAP}"(?P<heading>[^"]+)")?'
)
LINK = re.compile(r"\]\((?![a-z]+:)(?P<page>[^)#\s]*)(?:#(?P<anchor>[^)\s]+))?\)")
FAULTS = re.compile(r"\((?:[^()]{0,60}[;,] )?(?P<numbers>F\d\d(?:, F\d\d)*)[).;]")
FILE = re.compile(r"`((?:robolink|cli|simulators|tests|docs|companions)/[\w./*-]*)`")
BARE = re.compile(r"(?<![\w./{}-])(?P<name>[a-z][\w-]*\.md)(?![\w#])")
UNKNOWN = re.compile(rf"\bdesign{GAP}(?:parts?{GAP})?\d")


def texts() -> Iterator[tuple[Path, str]]:
    files = [ROOT / "README.md", ROOT / "CHANGELOG.md"]
    for room in ROOMS:
        files += sorted(f for f in (ROOT / room).rglob("*") if f.suffix in SUFFIXES)
    for file in files:
        if file != Path(__file__):
            yield file, file.read_text(encoding="utf-8")


def slug(heading: str) -> str:
    """The anchor that GitHub, and the pages that `make docs` builds, make of a heading."""
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
    """What a cited path stands for: itself, or a decision record by its number."""
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


def test_every_citation_leads_to_a_heading():
    wrong = [f"{f.relative_to(ROOT)}: {w}" for f, t in texts() for w in wrong_citations(t)]
    assert not wrong, "\n".join(wrong)


def test_every_link_leads_to_a_heading():
    pages = ((f, t) for f, t in texts() if f.suffix == ".md")
    wrong = [f"{f.relative_to(ROOT)}: {w}" for f, t in pages for w in wrong_links(f, t)]
    assert not wrong, "\n".join(wrong)


def test_the_index_lists_every_page():
    index = (ROOT / "docs/README.md").read_text(encoding="utf-8")
    decisions = (ROOT / "docs/decisions/README.md").read_text(encoding="utf-8")
    for page in (ROOT / "docs").glob("*.md"):
        assert page.name == "README.md" or f"]({page.name})" in index, page.name
    for page in (ROOT / "docs/reference").glob("*.md"):
        assert f"](reference/{page.name})" in index, page.name
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


def test_no_page_is_cited_by_its_name_alone_but_one_that_lies_beside_it_or_in_docs():
    named = [(f, m["name"]) for f, t in texts() for m in BARE.finditer(t)]
    wrong = {
        f"{file.relative_to(ROOT)}: {name}"
        for file, name in named
        if not any((folder / name).exists() for folder in (file.parent, ROOT, ROOT / "docs"))
        and not (ROOT / "companions/codesys" / name).exists()
    }
    assert not wrong, "\n".join(sorted(wrong))


def test_every_number_of_a_fault_is_in_the_catalogue():
    known = numbers(ROOT / "docs/reference/faults.md")
    cited = {n for _, t in texts() for m in FAULTS.finditer(t) for n in m["numbers"].split(", ")}
    assert cited
    assert cited <= known


def test_nothing_cites_a_document_that_is_not_here():
    wrong = [f"{f.relative_to(ROOT)}: {m[0]}" for f, t in texts() for m in UNKNOWN.finditer(t)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "text",
    [
        "docs/reference/epson.md 1.99",
        "docs/reference/epson.md 1.4,\n    # 77.7",
        'docs/mailbox.md, "Landlords"',
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
        'docs/mailbox.md, "When a command\n    counts"',
        "docs/decisions/0017",
        "docs/reference/faults.md F46, F47",
    ],
)
def test_a_citation_that_leads_somewhere_is_followed(text):
    assert not list(wrong_citations(text))
