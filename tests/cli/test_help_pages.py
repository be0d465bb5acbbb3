"""Every help page fits into 80 columns, in whole sentences, in each language alike."""

import re

import click
import pytest
from robolink_cli import main
from robolink_cli.console.columns import columns

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
