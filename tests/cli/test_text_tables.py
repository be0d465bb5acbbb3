"""A table that is text alone is drawn without rich, and looks as rich would print it."""

import io
import sys
from itertools import islice

from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console
from rich.text import Text
from robolink_cli.console import render
from robolink_cli.console.output import shown_by, visible
from robolink_cli.console.tables import columns, drawn_table, pieces, text_table

WORDS = st.sampled_from(
    [
        "tool",
        "-112.512",
        "+3",
        "",
        " ",
        "  a  ",
        "\n",
        "位置",
        "针尖在第一个工具上。",
        "(mm)",
        "±0.02",
        "é",
    ]
)
WORD = WORDS | st.text(max_size=24).map(visible)
CELL = st.lists(WORD, max_size=5).map(" ".join) | st.sampled_from(["1.0", "-250.112", "*3", ""])


@st.composite
def tables(draw):
    """Draw a title, heads and rows."""
    count = draw(st.integers(1, 6))
    row = st.lists(CELL, min_size=count, max_size=count)
    return draw(CELL), draw(row), draw(st.lists(row, max_size=4))


def by_rich(title, heads, rows, width):
    """Return what rich prints of a table where nothing is coloured."""
    out = io.StringIO()
    drawn = drawn_table(title, heads, rows, width)
    shown = Text(drawn) if isinstance(drawn, str) else drawn
    Console(file=out, width=width, highlight=False, color_system=None).print(shown, crop=False)
    return out.getvalue()


@given(tables(), st.integers(20, 120))
@settings(max_examples=30)
def test_a_table_of_text_is_what_rich_prints(table, width):
    title, heads, rows = table
    text = text_table(title, heads, rows, width)
    printed = by_rich(title, heads, rows, width)
    if text is None:
        across = columns(printed.split("\n")[-2]) or width
        assert "\n" in title or columns(title) > across, "rich had nothing to fold"
    else:
        assert f"{text}\n" == printed
        assert max(map(columns, text.split("\n"))) <= width


def test_a_head_as_wide_as_the_console_stands_above_its_cell():
    head = "what the sensor saw of it"
    rows = [["a long sentence about the sensor", "-112.512"]] * 2
    drawn = drawn_table("t", [head, "measured at last in mm"], rows, 20)
    assert isinstance(drawn, str)
    lines = drawn.split("\n")
    assert max(map(len, lines)) <= 20
    assert lines[2:6] == [
        "  what the sensor",
        "  saw of it",
        "  a long sentence",
        "  about the sensor",
    ]


def test_a_character_that_does_not_fit_is_a_piece_of_its_own():
    assert list(islice(pieces("位置位", 1), 9)) == ["位", "置", "位"]


class Terminal(io.StringIO):
    """A terminal that shows colours."""

    def isatty(self):
        return True


def shown_on(stream, monkeypatch):
    monkeypatch.setattr(sys, "stdout", stream)
    render.table("tools", ["tool", "X mm"], [["1", "-112.512"]])
    return stream.getvalue()


def test_a_table_in_a_file_loads_no_rich(monkeypatch):
    """Importing it takes longer than many a command that shows a table."""
    for name in [name for name in sys.modules if name.split(".")[0] == "rich"]:
        monkeypatch.delitem(sys.modules, name)
    text = shown_on(io.StringIO(), monkeypatch)
    assert text.split("\n")[2].split() == ["tool", "X", "mm"]
    assert "rich" not in sys.modules


def test_a_terminal_has_its_heads_in_bold_and_so_has_who_asks_for_it(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert "\x1b[1m" in shown_on(Terminal(), monkeypatch)
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert "\x1b[1m" in shown_on(io.StringIO(), monkeypatch)


def test_an_encoding_without_lines_has_a_frame_of_signs(monkeypatch):
    out = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", out)
    render.table("tools", ["tool", "X mm"], [["1", "-112.512"]])
    out.seek(0)
    assert "| tool |" in out.read()


def test_a_table_on_a_drawn_screen_holds_no_codes_of_a_terminal(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr(sys, "stdout", Terminal())
    shown = []
    with shown_by(lambda text, beside: shown.append(text)):
        render.table("tools", ["tool", "X mm"], [["1", "-112.512"]])
    assert "-112.512" in shown[0]
    assert "x1b" not in shown[0]
