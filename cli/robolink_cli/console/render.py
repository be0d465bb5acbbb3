"""Output of a command: text for people, or one JSON document for machines.

With ``--json``, stdout carries exactly one document and everything for people goes to
stderr. That there is one document and not two is so by construction: :func:`emit_json` hands
it over, and it is printed once, when the command has ended well; an error prints its own
document instead.
"""

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Final, Literal, TextIO

import click

from robolink.messages import tr
from robolink_cli.console.output import (
    beside,
    draw,
    drawn_elsewhere,
    hand_over,
    sentences,
    show,
    visible,
)
from robolink_cli.console.person import is_terminal
from robolink_cli.console.tables import SCREEN, drawn_table, text_table

if TYPE_CHECKING:
    from robolink.methods import NextStep

_JSON = "robolink.json"
_DOCUMENT = "robolink.document"
_LOG = "robolink.log"

_FAR: Final = 1000
"""Columns of a file, whose lines are not folded at the width that is assumed of a terminal."""


def json_is_on() -> bool:
    """Return whether ``--json`` was given, before or after the command's name."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(_JSON))


def switch_json_on(context: click.Context) -> None:
    """Make this invocation speak JSON."""
    context.meta[_JSON] = True


LOG_LEVELS: Final = ("debug", "info", "warning", "error")


def want_log(context: click.Context, option: str, value: str) -> None:
    """Keep the log options of this invocation."""
    context.meta.setdefault(_LOG, {})[option] = value


def log_wanted() -> tuple[str, str]:
    """Return the file and the level of the requested log; empty without one."""
    wanted: dict[str, str] = click.get_current_context().meta.get(_LOG, {})
    return wanted.get("log_file", ""), wanted.get("log_level", "")


def say(text: str = "") -> None:
    """Show a person a line: on stdout, or on stderr when stdout is for machines."""
    show(text, beside=json_is_on())


def say_listed(texts: Mapping[str, str]) -> None:
    """Show a name and a text in each line, the texts below each other."""
    width = max(map(len, texts), default=0) + 2
    for name, text in texts.items():
        first, *more = beside(text, width).split("\n")
        say("\n".join([f"{name:{width}}{first}", *(" " * width + line for line in more)]))


def note(text: str) -> None:
    """Show a person a remark beside the result; always on stderr, and no word is cut."""
    show(text if drawn_elsewhere() else sentences(text), beside=True)


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Show a person a table: numbers to the right and whole, words to the left and folded.

    One that is too wide for the terminal is turned (:mod:`robolink_cli.console.tables`).
    """
    title, heads = visible(title), [visible(column) for column in columns]
    cells = [[visible(str(cell)) for cell in row] for row in rows]
    separate, elsewhere = json_is_on(), drawn_elsewhere()
    if not elsewhere and _takes_text_alone(sys.stderr if separate else sys.stdout):
        text = text_table(title, heads, cells, _FAR)
        if text is not None:
            draw(text, beside=separate)
            return
    from rich.console import Console
    from rich.text import Text

    colours: Literal["auto"] | None = None if elsewhere else "auto"  # they would be escaped there
    console = Console(stderr=separate, highlight=False, color_system=colours)
    if elsewhere:
        console.width = min(console.width, SCREEN)  # a drawn screen is no wider
    elif not console.is_terminal:
        console.width = _FAR
    drawn = drawn_table(title, heads, cells, console.width)
    shown = Text(drawn) if isinstance(drawn, str) else drawn
    if elsewhere:
        with console.capture() as captured:
            console.print(shown, crop=False)
        say(captured.get().rstrip("\n"))
        return
    console.print(shown, crop=False)


def _takes_text_alone(stream: TextIO) -> bool:
    """Return whether rich would print no colours there, and lines as lines."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    wants = any(map(os.environ.get, ("FORCE_COLOR", "TTY_COMPATIBLE")))
    return not wants and not is_terminal(stream) and encoding.lower().startswith("utf")


def emit(kind: str, payload: Mapping[str, object], show: Callable[[], None]) -> None:
    """Give the result: the document ``robolink/KIND/1`` to a machine, else ``show()``."""
    if json_is_on():
        emit_json(f"robolink/{kind}/1", payload)
    else:
        show()


def show_requests(requests: Sequence[str]) -> None:
    """Show the requests that a dry run would have sent, as sent on the wire."""
    emit("dry-run", {"requests": list(requests)}, lambda: say("\n".join(requests)))


def emit_json(schema: str, payload: Mapping[str, object]) -> None:
    """Keep the document of this command, which is printed when the command has ended.

    Args:
        schema: For example ``robolink/status/1``.
        payload: Plain JSON values; the names of numbers carry their units.
    """
    meta = click.get_current_context().meta
    if _DOCUMENT in meta:
        raise RuntimeError(f"a second document was emitted: {schema}")
    meta[_DOCUMENT] = dumps(schema, payload)


def print_document(context: click.Context) -> None:
    """Print the document from :func:`emit_json`, if any."""
    if _DOCUMENT in context.meta:
        hand_over(context.meta[_DOCUMENT])


def dumps(schema: str, payload: Mapping[str, object]) -> str:
    """Return one JSON document in ASCII, so that no console can spoil it."""
    import json  # here, because --help needs none

    return json.dumps({"schema": schema, **payload}, indent=2, allow_nan=False)


def next_lines(steps: "Sequence[NextStep]", cell: str = "") -> list[str]:
    """Return what a person does next, a sentence and a command each; nothing without a step.

    Args:
        steps: What follows.
        cell: Name of the cell, for the commands; empty where it need not be named.
    """
    if not steps:
        return []
    named = f'robolink -c "{cell}"' if cell else "robolink"
    lines = [tr("Next:")]
    for number, step in enumerate(steps, start=1):
        lines += [f"  {number}. {step.sentence}", f"       {named} {step.command}"]
    return lines
