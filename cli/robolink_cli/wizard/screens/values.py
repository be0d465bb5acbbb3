"""Screen (f): the new values, and the question before they are written."""

from collections.abc import Iterable, Iterator

from robolink.messages import tr
from robolink_cli.console.tables import padded
from robolink_cli.wizard.screens.layout import (
    BODY,
    Screen,
    TerminalDraft,
    broken,
    row_of,
    title_row,
)
from robolink_cli.wizard.views.frame import UPRIGHT
from robolink_cli.wizard.views.records import ToolValues, ValuesView, View

_HEAD = 18
_COLUMN = 11
_NARROW = 10
"""Width of a column when six columns of numbers are beside the names."""

_ROOM = BODY - 2


def values_screen(view: View, body: ValuesView, draft: TerminalDraft) -> Screen:
    """Return the screen of a proposal; several tools in a short form."""
    typed = tr(
        "To write, type the tool number, then [*] or Space.   Tool: {typed}_", typed=draft.typed
    )
    shown, pages = _shown(body, draft.page)
    onward = ((".", tr("The rest")),) if pages > 1 else ()
    *first, last = ((one.key, one.label) for one in view.actions)
    return Screen(
        title_row(view.head),
        (*shown, "", typed),
        (*first, *onward, last),
        message=view.message,
    )


def _shown(body: ValuesView, page: int) -> tuple[list[str], int]:
    """Return what stands above the field, and the number of parts of the whole.

    Room is left for the field, a message and a second row of keys. Nothing is left out: before a
    write a person reads all of it.
    """
    several = len(body.tools) > 1
    lines = [line for tool in body.tools for line in _tool_lines(tool, short=several)]
    if not several and body.tools[0].rows[0].before:
        lines.append("")
    lines += [row for line in body.taught for row in broken(line)]
    rows = [row for line in lines for row in broken(line)]
    if len(rows) > _ROOM:
        rows = [row for row in rows if row.strip()]
    if len(rows) <= _ROOM:
        return rows, 1
    size = _ROOM - 1
    pages = -(-len(rows) // size)
    page %= pages
    part = rows[page * size : (page + 1) * size]
    told = tr("Part {k} of {n}; [.] shows the rest.", k=page + 1, n=pages)
    return [*part, *[""] * (size - len(part)), told], pages


def _tool_lines(tool: ToolValues, *, short: bool) -> Iterator[str]:
    """Yield the table of old and new values, and what limits and doubts say of them."""
    rows, undefined = tool.rows, not tool.rows[0].before

    def row(name: str, values: Iterable[str]) -> str:
        width = _COLUMN if len(rows) == len(UPRIGHT) else _NARROW
        return padded(f" {name}", _HEAD) + row_of([*values], width)

    yield row(tr("Tool {n}", n=tool.tool), (one.name for one in rows))
    if not undefined:
        yield row(tr("now"), (one.before for one in rows))
    yield row(tr("new"), (one.new for one in rows))
    if not undefined:
        yield row(tr("change"), (one.change for one in rows))
    if short:
        return
    if not undefined:
        yield ""
    yield from tool.statements
    yield ""
    for _mark, word, said in tool.verdicts:
        first, *more = broken(said, 73)
        yield f" {padded(word, 5)}{first}"
        yield from (f"      {line}" for line in more)
