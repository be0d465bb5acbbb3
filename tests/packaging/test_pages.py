"""Every page names its readers and its kind at the top, and keeps the length for its kind.

Line 1 is the title, line 3 names readers and kind: ``*For technicians. How-to.*``. The page that
lists the others, docs/README.md, has a part for each reader.
"""

import re
from pathlib import Path
from typing import NamedTuple

import pytest

DOCS = Path(__file__).parents[2] / "docs"
INDEX = DOCS / "README.md"
PAGES = sorted(page for page in DOCS.glob("*.md") if page != INDEX)
REFERENCE = sorted((DOCS / "reference").glob("*.md"))
READERS = ("technicians", "integrators", "programmers", "maintainers")
READ_THROUGH = ("Tutorial", "How-to", "Sheet")
LOOKED_UP = ("Overview", "Reference")
MOST_WORDS = 1200

_READER = "|".join(READERS)
_KIND = "|".join((*READ_THROUGH, *LOOKED_UP))
HEAD = re.compile(rf"\*For (?P<readers>({_READER})( and ({_READER}))?)\. (?P<kind>{_KIND})\.\*")
CHINESE = {"技术员": "technicians", "集成商": "integrators", "程序员": "programmers"}
CHINESE_HEAD = re.compile(rf"\*(?P<readers>{'|'.join(CHINESE)})用。(?P<kind>\w{{2,4}})。\*")
FENCED = re.compile(r"^ *```.*?^ *```$", re.M | re.S)
INDENTED = re.compile(r"(?:^|(?<=\n\n))(?: {4,}[^\n]*\n+)+")
TABLE = re.compile(r"^ *\|.*$", re.M)
LISTED = re.compile(r"\]\((?P<page>[\w.-]+\.md)(?:#[\w-]+)?\)")


class Head(NamedTuple):
    """The statements at the top of a page."""

    readers: frozenset[str]
    kind: str


def head(text: str) -> Head | None:
    """Return the statements of a page; None if there are none, or at another place."""
    title, blank, line, after, *_ = [*text.splitlines(), *[""] * 4]
    if not title.startswith("# ") or blank or after:
        return None
    if found := HEAD.fullmatch(line):
        return Head(frozenset(found["readers"].split(" and ")), found["kind"])
    if found := CHINESE_HEAD.fullmatch(line):
        return Head(frozenset({CHINESE[found["readers"]]}), found["kind"])
    return None


def words(text: str) -> int:
    """Count the words to be read through: without tables and code."""
    prose = INDENTED.sub("", TABLE.sub("", FENCED.sub("", text)))
    return len(prose.split())


def listed(index: str) -> list[tuple[str, str]]:
    """Return each page in the index, with the reader under whom it is listed."""
    parts = re.split(r"^## For (\w+)\n", index, flags=re.M)[1:]
    return [
        (found["page"], reader)
        for reader, part in zip(parts[::2], parts[1::2], strict=True)
        for found in LISTED.finditer(part)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_says_for_whom_and_what_it_is_and_keeps_to_its_length(page):
    text = page.read_text(encoding="utf-8")
    said = head(text)
    assert said, (
        "line 3 has to be a line such as *For technicians. How-to.*, between two empty ones"
    )
    if said.kind in READ_THROUGH:
        assert words(text) <= MOST_WORDS, "move what is looked up to docs/reference, or shorten it"


@pytest.mark.parametrize("page", REFERENCE, ids=lambda page: page.name)
def test_a_page_of_the_reference_says_for_whom_it_is(page):
    said = head(page.read_text(encoding="utf-8"))
    assert said, "line 3 has to be a line such as *For programmers. Reference.*"
    assert said.kind == "Reference"


def test_the_index_lists_each_page_once_under_one_of_its_readers():
    places = listed(INDEX.read_text(encoding="utf-8"))
    assert sorted(name for name, _ in places) == [page.name for page in PAGES]
    saying = {page.name: head(page.read_text(encoding="utf-8")) for page in PAGES}
    wrong = [
        (name, reader)
        for name, reader in places
        if (said := saying[name]) and reader not in said.readers
    ]
    assert wrong == []


def test_the_index_has_a_part_for_each_reader_and_says_that_it_is_for_all():
    text = INDEX.read_text(encoding="utf-8")
    assert re.findall(r"^## For (\w+)$", text, re.M) == [*READERS]
    assert text.splitlines()[2] == "*For everybody. Overview.*"


@pytest.mark.parametrize(
    "line",
    [
        "*For technicians. How-to.*",
        "*For integrators and programmers. Reference.*",
        "*技术员用。操作页。*",
    ],
)
def test_a_right_line_is_understood(line):
    assert head(f"# Title\n\n{line}\n\nText.\n")


@pytest.mark.parametrize(
    "text",
    [
        "# Title\n\nText.\n",
        "# Title\n\n*For operators. How-to.*\n\nText.\n",
        "# Title\n\n*For technicians. Essay.*\n\nText.\n",
        "# Title\n\n*For technicians. How-to.*\nText.\n",
        "# Title\n\nText.\n\n*For technicians. How-to.*\n",
        "*For technicians. How-to.*\n",
        "",
    ],
)
def test_a_page_without_a_right_line_is_found(text):
    assert head(text) is None


def test_words_are_counted_without_tables_and_code():
    text = (
        "# Two words\n\nOne `two`.\n\n| a | b |\n|---|---|\n\n    indented code\n\n    more\n\n"
        "```sh\nfenced code\n```\n\n1. A list\n   goes on\n\n   | x | y |\n\n       code in it\n\n"
        "End.\n"
    )
    assert words(text) == 11


def test_a_page_that_is_listed_twice_is_found():
    index = (
        "## For technicians\n[a](wizard.md), [b](reference/spel.md)\n"
        "## For integrators\n[a](wizard.md#keys)\n"
    )
    assert listed(index) == [("wizard.md", "technicians"), ("wizard.md", "integrators")]
