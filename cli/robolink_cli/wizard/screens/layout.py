"""A screen as lines: rows, width, tables. ASCII in the layout, so that no console breaks it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from wcwidth import wcwidth

WIDTH: Final = 80
HEIGHT: Final = 24
BODY: Final = 17
"""Rows between the two rules."""


@dataclass(frozen=True, slots=True)
class Screen:
    """What is shown.

    Attributes:
        title: Left and right end of the first row.
        status: The second row, empty for none.
        lines: The body.
        actions: Keys with what they do.
        message: The row above them.
    """

    title: tuple[str, str]
    lines: tuple[str, ...]
    actions: tuple[tuple[str, str], ...]
    status: str = ""
    message: str = ""

    def rows(self) -> list[str]:
        """Return the rows, each at most 80 columns, 24 at most."""
        left, right = self.title
        space = " " * max(1, WIDTH - columns(left) - columns(right))
        body = [row for line in self.lines for row in broken(line)]
        shown = [f"{left}{space}{right}"]
        if self.status:
            shown.append(self.status)
        rule = "-" * WIDTH
        keys = list(key_rows(self.actions))
        messages = list(broken(self.message))[:2] if self.message else []
        room = HEIGHT - len(shown) - 2 - len(keys) - len(messages)
        return [cut(row) for row in [*shown, rule, *body[:room], *messages, rule, *keys]]


def key_rows(actions: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield the rows of keys, spread over the width; a second row where one is too narrow."""
    shown = [f"[{key}] {does}" for key, does in actions]
    total = sum(map(columns, shown))
    if len(shown) > 1 and total + 2 * (len(shown) - 1) > WIDTH:
        half = (len(shown) + 1) // 2
        yield from key_rows(actions[:half])
        yield from key_rows(actions[half:])
        return
    gap, rest = divmod(max(0, WIDTH - total), max(1, len(shown) - 1))
    row = ""
    for number, one in enumerate(shown):
        space = gap + (1 if number <= rest else 0) if number else 0
        row += " " * space + one
    yield row.rstrip()


def columns(text: str) -> int:
    """Return how many columns a text takes on a terminal."""
    return sum(max(0, wcwidth(character)) for character in text)


def cut(text: str, width: int = WIDTH) -> str:
    """Return as much of a text as fits into a width."""
    if columns(text) <= width:
        return text
    kept = ""
    for character in text:
        if columns(kept + character) > width:
            break
        kept += character
    return kept


def padded(text: str, width: int, *, right: bool = False) -> str:
    """Return a text filled with blanks up to a width."""
    blanks = " " * max(0, width - columns(text))
    return blanks + text if right else text + blanks


def broken(text: str, width: int = WIDTH) -> Iterator[str]:
    """Yield the rows of a text, broken at blanks, and within a word only where it must be.

    Chinese has no blanks: there any place will do.
    """
    for line in text.split("\n"):
        row = ""
        for word in _words(line):
            if columns(row + word.rstrip()) > width and row:
                yield row.rstrip()
                row = word.lstrip()
            else:
                row += word
            while columns(row) > width and columns(row.rstrip()) > width:
                part = cut(row, width)
                yield part
                row = row[len(part) :]
        yield row.rstrip()


def _words(line: str) -> Iterator[str]:
    """Yield pieces between which a line may be broken, blanks at their ends kept."""
    piece = ""
    for character in line:
        if wcwidth(character) == 2:
            if piece:
                yield piece
            piece = ""
            yield character
            continue
        piece += character
        if character == " ":
            yield piece
            piece = ""
    if piece:
        yield piece


def row_of(values: Sequence[str], width: int = 11) -> str:
    """Return values in columns of equal width, each to the right."""
    return "".join(padded(value, width, right=True) for value in values)
