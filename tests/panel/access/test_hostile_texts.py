"""Texts from outside on a page: a controller's, a file's, a person's. They become no element.

The content security policy lets no script of a page run. An element of a text could still be a
button of ours, with an address to post to.
"""

from dataclasses import replace
from html.parser import HTMLParser

import pytest
from robolink_cli.panel.guard.gate import POSTS
from robolink_cli.panel.pages import Pages, Watcher
from robolink_cli.wizard.views.wire import from_wire, to_wire

from tests.panel.browser import samples

EVIL = "\"'><script>pwned()</script><button data-post=/pwned onclick=pwned() data-action=pwned>&lt;"
FIXED = {"kind", "mark", "name", "weight", "field", "place", "axis", "key", "side", "value"}
"""What the views themselves choose from, and no text from outside is."""


def hostile(value, key=""):
    """Return a view's document with each text replaced."""
    if isinstance(value, dict):
        return {name: hostile(one, name) for name, one in value.items()}
    if isinstance(value, list):
        return [hostile(one, key) for one in value]
    return EVIL if isinstance(value, str) and key not in FIXED else value


class Elements(HTMLParser):
    """The elements of a page, and what they would post to."""

    def __init__(self, html):
        super().__init__()
        self.found, self.posts = [], set()
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        self.found.append((tag, *names))
        self.posts |= {value for name, value in attrs if name == "data-post"}


def require_harmless(html):
    page = Elements(html)
    assert page.found
    for tag, *names in page.found:
        assert tag not in {"iframe", "object", "embed", "base"}
        assert not any(name.startswith("on") or "pwned" in name for name in names)
        assert "srcdoc" not in names
        assert "style" not in names
    assert sum(tag == "script" for tag, *_ in page.found) <= 1  # panel.js
    assert page.posts <= set(POSTS)
    assert "<script>pwned" not in html
    assert "<button data-post=/pwned" not in html


@pytest.mark.parametrize("language", ["en", "zh"])
def test_on_each_screen(language):
    pages = Pages()
    watcher = Watcher(language=language, seat=EVIL, who=EVIL, role="engineer")
    for name, view in samples.views(language).items():
        harmed = from_wire(hostile(to_wire(view)))
        for seat in (EVIL, "here", ""):
            parts = pages.screen(harmed, replace(watcher, seat=seat))
            assert EVIL not in parts.head + parts.main + parts.foot, name
            html = parts.head + parts.main + parts.foot
            assert "pwned" in html  # it is shown, as text
            require_harmless(html)


def test_on_whole_pages():
    pages = Pages()
    watcher = Watcher(seat=EVIL, who=EVIL, role="engineer")
    cells = tuple(
        replace(card, name=EVIL, word=EVIL, lines=(EVIL,), seat=EVIL) for card in samples.CELLS
    )
    changes = tuple(
        replace(row, change=EVIL, when=EVIL, who=EVIL, what=EVIL, moved=EVIL, word=EVIL)
        for row in samples.CHANGES
    )
    for html in (
        pages.page("overview", watcher, cells=cells, token=EVIL),
        pages.page("cell", watcher, cell=EVIL, parts=pages.idle(cells[0], watcher), token=EVIL),
        pages.page("history", watcher, cell=EVIL, changes=changes, charts=()),
        pages.page("login", watcher, names=(EVIL,), onward=EVIL),
        pages.page("pairing", watcher, names=(EVIL,), onward=EVIL),
    ):
        require_harmless(html)
