"""Options as they are declared, and every help page in 80 columns and in each language."""

import re
from functools import cache
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import click
import pytest
from click.testing import CliRunner
from hypothesis import example, given, settings
from hypothesis import strategies as st
from robolink_cli import main
from robolink_cli.console import language
from robolink_cli.console.help_pages import WideHelpFormatter
from robolink_cli.console.tables import columns
from robolink_cli.options.declaration import CliArgument, CliOption, add_declared, declared_options

from robolink import messages
from robolink.locale import languages

# Every help page fits into 80 columns, in whole sentences, in each language alike.

COPIED = ["fish", "powershell"]
"""Lines of ``completion`` that begin so are to be copied, and are not wrapped."""

CODE_WORDS = re.compile(r"^  -.*? (?:INTEGER|FLOAT|TEXT|BOOLEAN|[^ ]*%[YmdHMS]|文件)\b")
"""The words that click shows for an option without a metavar, after the option's name."""


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
    # A catalogue is read once, and not for each page.
    monkeypatch.setattr(language, "translator", cache(languages.translator))
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


# No escape sequences: click's own wrapping never ends where a word is cut inside one. Nor does it
# end where a paragraph is indented by more than its column is wide, so no indent is a long one:
# two tabs are sixteen blanks already.
DEEP = re.compile(r"^(?:[ \t]*\t[ \t]*|[ \t]{3,})", re.MULTILINE)
WORDS = st.lists(st.text("ab-.\t\n é", max_size=9), max_size=6).map(
    lambda words: DEEP.sub("  ", " ".join(words))
)


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


# The options of a command, declared in the signature of its function.


class Offset(NamedTuple):
    x_mm: Annotated[float | None, CliOption(help="Sideways.")] = None
    u_deg: Annotated[float, click.FloatRange(0, 360), CliOption("--turn")] = 90.0


def shared(command):
    return click.option("--json", is_flag=True, expose_value=False)(command)


def command_of(function):
    return click.command()(add_declared(function, shared))


def called(function, *line):
    ended = CliRunner().invoke(command_of(function), line, standalone_mode=False)
    assert ended.exception is None
    return ended.return_value


def refused(function, *line):
    return CliRunner().invoke(command_of(function), line).output


def lift(
    *,
    tool: Annotated[int, CliArgument()],
    files: Annotated[tuple[Path, ...], CliOption("--file")] = (),
    height_mm: Annotated[float, CliOption(help="How high.")] = 5.0,
    mode: Annotated[Literal["set", "active"] | None, CliOption()] = None,
    offset: Offset,
    yes: Annotated[bool, CliOption(late=True)] = False,
    _plain: Annotated[bool, CliOption("--plain", late=True, expose_value=False)] = False,
):
    return tool, files, height_mm, mode, offset, yes, _plain


def test_what_is_left_out_is_what_the_signature_says():
    assert called(lift, "3") == (3, (), 5.0, None, Offset(None, 90.0), False, False)


def test_what_is_typed_arrives_in_the_types_of_the_signature():
    line = [
        "3",
        "--file",
        "a",
        "--file",
        "b",
        "--height",
        "2.5",
        "--mode",
        "active",
        "--x",
        "-1",
        "--turn",
        "7",
        "--yes",
        "--plain",
    ]
    offset = Offset(-1.0, 7.0)
    assert called(lift, *line) == (3, (Path("a"), Path("b")), 2.5, "active", offset, True, False)


def test_a_value_that_is_none_of_its_type_is_refused():
    assert "'1_0' is not a decimal number" in refused(lift, "3", "--height", "1_0")
    assert "'last' is not one of 'set', 'active'" in refused(lift, "3", "--mode", "last")
    assert "361.0 is not in the range 0<=x<=360" in refused(lift, "3", "--turn", "361")
    assert "Missing argument 'TOOL'" in refused(lift)


def test_an_option_without_a_default_must_be_given():
    def needs(
        *,
        url: Annotated[str, CliOption()],
        seeds: Annotated[tuple[int, ...], CliArgument()] = (),
    ):
        return url, seeds

    assert called(needs, "--url", "a", "1", "2") == ("a", (1, 2))
    assert "Missing option '--url'" in refused(needs)


def test_the_page_shows_units_and_defaults_in_the_order_of_the_signature():
    page = refused(lift, "--help")
    assert "--height MM  " in page
    assert "How high.  [default: 5.0]" in page
    assert "--file FILE" in page
    names = ["--file", "--height", "--mode", "--x MM", "--turn DEG", "--json", "--yes", "--plain"]
    places = [page.index(f"  {name}") for name in names]
    assert places == sorted(places)


def test_another_command_can_take_all_that_a_function_declares():
    @click.command()
    @declared_options(lift)
    def beside(**given):
        return given

    given = CliRunner().invoke(beside, ["3"], standalone_mode=False).return_value
    names = {"tool", "files", "height_mm", "mode", "x_mm", "u_deg", "yes"}
    assert given.keys() == names
