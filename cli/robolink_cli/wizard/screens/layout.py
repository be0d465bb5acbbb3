"""A screen as lines: rows, width, tables. ASCII in the layout, so that no console breaks it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink_cli.console.tables import SCREEN, columns, cut, filled, pieces
from robolink_cli.wizard.views.records import Head, Status, View

WIDTH: Final = SCREEN
HEIGHT: Final = 24
BODY: Final = 17
"""Number of rows between the two rules."""


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
        """Return the number of free rows in the body, two left for a message."""
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
        # The keys are at the same place on every screen.
        below = [""] * (room - len(body))
        return [
            cut(row, WIDTH) for row in [*shown, rule, *body[:room], *below, *messages, rule, *keys]
        ]


@dataclass(frozen=True, slots=True)
class TerminalDraft:
    """What stands on a terminal alone: its marked row, what is typed there, the part that is shown.

    Attributes:
        marked: Index of the marked row; ``None`` for none.
        typed: What stands in the field.
        typing: Whether the field of a pose is open at a touch.
        page: Which part of a longer screen is shown, from 0.
    """

    marked: int | None = None
    typed: str = ""
    typing: bool = False
    page: int = 0


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


def title_row(head: Head) -> tuple[str, str]:
    """Return the first row: cell and job at the left, the step at the right.

    The number of the step is left out where it would cut off something else.
    """
    left, name, simulated = f"{head.cell}   {head.job}", head.title, ""
    if head.simulated:
        simulated = "  " + tr("SIMULATED")
    if head.step is not None:
        number, count = head.step
        numbered = tr("{k} of {n}  {step}", k=number, n=count, step=name)
        if columns(left) + 3 + columns(numbered + simulated) <= WIDTH:
            name = numbered
    return left, f"{name}{simulated}"


def status_row(status: Status | None) -> str:
    """Return the second row: the state of the machine, and the age of the reading."""
    if status is None:
        return tr("No reading from the controller yet.")
    tool = "" if status.tool is None else "   " + tr("tool {n} selected", n=status.tool)
    age = tr("reading {s} s", s=f"{status.age_s:.1f}")
    known = "".join(f"   {word}" for word in _switched(status))
    return f"{status.state.upper()}{known}{tool}   {age}"


def _switched(status: Status) -> Iterator[str]:
    """Yield what was read of motors and power, and nothing else."""
    if status.motors is not None:
        yield tr("motors on") if status.motors else tr("motors OFF")
    if status.low_power is not None:
        yield tr("power LOW") if status.low_power else tr("power HIGH")


def keys_of(view: View) -> tuple[tuple[str, str], ...]:
    """Return the keys of what can be pressed."""
    return tuple((one.key, one.label) for one in view.actions)
