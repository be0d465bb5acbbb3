"""Sentences say ``+-``, which every console has; a page makes the sign of it, at one place."""

from pathlib import Path

import pytest

from robolink.report._markup import plain
from tests.packaging.test_translations import CHINESE, entries

ROOT = Path(__file__).parents[2]
SHIPPED = ("robolink", "cli", "simulators", "companions", "docs")
OTHER_WAYS = ("\u00b1", r"\u00b1", "+/-")
ONE_PLACE = "robolink/report/_markup.py"
OF_OTHERS = "cli/robolink_cli/console/output.py"
"""Writes what people typed, or a page says, for a console that lacks the sign."""


def test_no_source_and_no_page_has_another_way():
    found = {
        path.relative_to(ROOT).as_posix()
        for folder in SHIPPED
        for ending in ("py", "html", "md", "st", "prg")
        for path in (ROOT / folder).rglob(f"*.{ending}")
        if any(way in path.read_text(encoding="utf-8") for way in OTHER_WAYS)
    }
    assert found == {ONE_PLACE, OF_OTHERS}


def test_no_translation_has_another_way():
    said = [one.string for one in entries(CHINESE / "robolink.po")]
    assert len(said) > 1000
    assert [text for text in said if any(way in str(text) for way in OTHER_WAYS)] == []


@pytest.mark.parametrize(
    ("sentence", "shown"),
    [
        ("X, Y: repeatable to +-0.035 mm (95 %).", "X, Y: repeatable to \u00b1 0.035 mm (95 %)."),
        ("seems longer (+-0.14 mm)", "seems longer (\u00b1 0.14 mm)"),
        (
            "the +- is taken from how well they agree",
            "the \u00b1 is taken from how well they agree",
        ),
        ("+-", "\u00b1 "),
        ("可重复至+-0.035 mm", "可重复至\u00b1 0.035 mm"),
        # What is no half width stays as it was written.
        ("needle A+-2", "needle A+-2"),
        ("x+-y", "x+-y"),
    ],
)
def test_a_page_shows_the_sign(sentence, shown):
    assert plain(sentence) == shown
