"""Nobody reads a house full of paper: how many pages and records there are, and how long two are.

The history is in git. A page that would be one too many is joined with the one that its reader has
open anyway; so is a decision record with the one on its subject.
"""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
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
