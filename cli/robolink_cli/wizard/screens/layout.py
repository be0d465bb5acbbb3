"""A screen as lines: rows, width, tables. ASCII in the layout, so that no console breaks it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from robolink_cli.console.columns import SCREEN, columns, cut, filled, pieces

WIDTH: Final = SCREEN
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

    def room(self) -> int:
        """Return how many rows of the body are free, two left for a message."""
        used = sum(1 for line in self.lines for _ in broken(line))
        keys = sum(1 for _ in key_rows(self.actions))
        return HEIGHT - 1 - bool(self.status) - 2 - keys - 2 - used

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
        # The keys stand at the same place on every screen.
        below = [""] * (room - len(body))
        return [
            cut(row, WIDTH) for row in [*shown, rule, *body[:room], *below, *messages, rule, *keys]
        ]


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


def broken(text: str, width: int = WIDTH) -> Iterator[str]:
    """Yield the rows of a text; one that fits keeps its blanks."""
    for line in text.split("\n"):
        if columns(line) <= width:
            yield line.rstrip()
        else:
            for row in filled(line, width).split("\n"):
                yield from pieces(row, width)


def row_of(values: Sequence[str], width: int = 11) -> str:
    """Return values in columns of equal width, each to the right."""
    return "".join(" " * max(0, width - columns(value)) + value for value in values)
