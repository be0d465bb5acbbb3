"""Every help page fits into 80 columns, in whole sentences, in each language alike."""

import re

import click
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from robolink_cli import main
from robolink_cli.console.help_pages import WideHelpFormatter
from robolink_cli.console.tables import columns

from robolink import messages

COPIED = ["fish", "powershell"]
"""Lines of ``completion`` that begin so are copied as they stand, and are not broken."""

CODE_WORDS = re.compile(r"^  -.*? (?:INTEGER|FLOAT|TEXT|BOOLEAN|[^ ]*%[YmdHMS]|文件)\b")
"""What click shows where nobody says what an option takes, with the option before it."""


def pages(command=main.cli, path=()):
    yield path
    if isinstance(command, click.Group):
        context = click.Context(command)
        hidden = ["expert"] if not path else []
        for name in [*command.list_commands(context), *hidden]:
            yield from pages(command.get_command(context, name), (*path, name))


@pytest.fixture(params=["en", "zh"])
def shown(request, monkeypatch, capsys):
    """Every page, by its path."""
    monkeypatch.setenv("COLUMNS", "80")
    texts = {}
    try:
        for path in pages():
            assert main.run(["--lang", request.param, *path, "--help"]) == 0
            texts[" ".join(path)] = capsys.readouterr().out
    finally:
        messages.install(None)
    return texts


def test_a_page_is_shown_as_a_terminal_holds_it(shown):
    assert len(shown) > 90
    lines = [(path, line) for path, text in shown.items() for line in text.splitlines()]
    wide = [one for one in lines if columns(one[1]) > 80 and one[1].split()[0] not in COPIED]
    assert wide == []
    assert [one for one in lines if one[1].endswith("...") and "robolink" not in one[1]] == []
    assert [one for one in lines if CODE_WORDS.match(one[1])] == []


# No escape sequences: click's own wrapping never ends where a word is cut inside one.
WORDS = st.lists(st.text("ab-.\t\n é", max_size=9), max_size=6).map(" ".join)


@given(
    width=st.integers(40, 70),
    indent=st.integers(0, 2),
    rows=st.lists(st.tuples(WORDS, WORDS), min_size=1, max_size=3),
)
@example(width=40, indent=0, rows=[("\x1b[1mbold\x1b[0m", "in \x1b[1mbold\x1b[0m letters")])
@settings(deadline=None, max_examples=60)
def test_a_page_without_wide_characters_is_click_s_own(width, indent, rows):
    written = []
    for formatter in (click.HelpFormatter(width=width), WideHelpFormatter(width=width)):
        for _ in range(indent):
            formatter.indent()
        formatter.write_dl(rows)
        for name, said in rows:
            formatter.write_text(said)
            formatter.write_usage(name[:9], said)
            formatter.write_usage("p", said, prefix=name[:9])
        written.append(formatter.getvalue())
    assert written[0] == written[1]
