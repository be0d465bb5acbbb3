"""A screen as lines: rows, width, tables. ASCII in the layout, so that no console breaks it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink_cli.console.shell_words import state_word
from robolink_cli.console.tables import SCREEN, columns, cut, filled, pieces
from robolink_cli.wizard.happenings import Reading
from robolink_cli.wizard.state import WizardState

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


class JobStep(IntEnum):
    """The steps of a change, as they are numbered."""

    CHOOSE = 1
    CHECK = 2
    ON_THE_WAY = 3
    TOUCH = 4
    FIT = 5
    VALUES = 6
    TURN_TEST = 7


def title_row(state: WizardState, name: str, step: JobStep | None = None) -> tuple[str, str]:
    """Return the first row: cell and job at the left, the step at the right.

    Args:
        state: The state.
        name: What the screen is called.
        step: Which step it belongs to, ``None`` for none; its number is left out where the job's
            steps have none, and where it would cut off something else.
    """
    header = state.header
    left, simulated = f"{header.cell}   {header.job}", ""
    if header.simulated:
        simulated = "  " + tr("SIMULATED")
    if step is not None and header.steps:
        numbered = tr("{k} of {n}  {step}", k=min(step, header.steps), n=header.steps, step=name)
        if columns(left) + 3 + columns(numbered + simulated) <= WIDTH:
            name = numbered
    return left, f"{name}{simulated}"


def status_row(state: WizardState, now_s: float) -> str:
    """Return the second row: the state of the machine, and the age of the reading."""
    reading = state.reading
    if reading is None:
        return tr("No reading from the controller yet.")
    tool = ""
    if reading.pose is not None and reading.pose.tool is not None:
        tool = "   " + tr("tool {n} selected", n=reading.pose.tool)
    age = tr("reading {s} s", s=f"{max(0.0, now_s - reading.at_s):.1f}")
    known = "".join(f"   {word}" for word in _switched(reading))
    return f"{state_word(reading.state).upper()}{known}{tool}   {age}"


def _switched(reading: Reading) -> Iterator[str]:
    """Yield what was read of motors and power, and nothing else."""
    if reading.motors is not None:
        yield tr("motors on") if reading.motors else tr("motors OFF")
    if reading.low_power is not None:
        yield tr("power LOW") if reading.low_power else tr("power HIGH")


UPRIGHT: Final = ("X", "Y", "Z", "U")
_TILTED: Final = (*UPRIGHT, "V", "W")
_TILTS_DEG: Final = 0.005
"""Smallest angle in degrees that is not 0 in the two decimals shown."""


def coordinate_names(*shown: Pose | ToolOffset) -> tuple[str, ...]:
    """Return the coordinates of a table: V and W only if one of its rows tilts."""
    tilts = any(abs(angle) >= _TILTS_DEG for one in shown for angle in (one.v_deg, one.w_deg))
    return _TILTED if tilts else UPRIGHT


def mm(value: float) -> str:
    """Return a length with three decimals, no negative zero."""
    return f"{round(value, 3) + 0.0:.3f}"


def signed(value: float, digits: int = 3) -> str:
    """Return a difference with its sign."""
    return f"{round(value, digits) + 0.0:+.{digits}f}"
