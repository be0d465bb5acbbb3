"""TAB completion of tools, stations and recipes: from files and the journal, no controller.

Nothing heavy is loaded for it and nothing is checked: whoever presses TAB waits for the answer.
"""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click
from click.shell_completion import CompletionItem

from robolink_cli.access.cell import is_cell_name
from robolink_cli.options.shared import GIVEN

if TYPE_CHECKING:
    from robolink.config import CellGlimpse


_TOOLS: Final = range(1, 16)
_RECIPE_MARK: Final = b"robolink/recipe/"
_LOOKED_AT: Final = 64 * 1024
"""Number of bytes of a file that are searched for the mark. Its line comes before all tables."""


def complete_tool(context: click.Context, parameter: click.Parameter, start: str) -> list[str]:  # noqa: ARG001 - click's form
    """Return the recorded tools of the named cell, or all numbers without one."""
    from robolink.journal import names_on_record

    known = names_on_record(address_of(_cell(context).url)).tools or _TOOLS
    return [str(number) for number in known if str(number).startswith(start)]


def complete_station(context: click.Context, parameter: click.Parameter, start: str) -> list[str]:  # noqa: ARG001 - click's form
    """Return the stations of the cell file and of the journal whose names begin so."""
    from robolink.journal import names_on_record

    cell = _cell(context)
    names = [*cell.stations, *names_on_record(address_of(cell.url)).stations]
    return [name for name in dict.fromkeys(names) if name.startswith(start)]


def complete_recipe(
    context: click.Context,  # noqa: ARG001 - click's form
    parameter: click.Parameter,  # noqa: ARG001 - click's form
    start: str,
) -> list[CompletionItem]:
    """Return the recipes of the typed folder; if it has none, files in general."""
    folder, typed = os.path.split(start)
    try:
        found = sorted(path.name for path in Path(folder or ".").iterdir() if is_recipe(path))
    except OSError:
        found = []
    names = [os.path.join(folder, name) for name in found if name.startswith(typed)]
    return [CompletionItem(name) for name in names] or [CompletionItem(start, type="file")]


def is_recipe(path: Path) -> bool:
    """Return whether a file is a recipe, by the line that every recipe has."""
    if path.suffix != ".toml" or not path.is_file():
        return False
    with path.open("rb") as file:
        return _RECIPE_MARK in file.read(_LOOKED_AT)


def _cell(context: click.Context) -> "CellGlimpse":
    """Return what is known of the line's cell or URL; nothing if it names none."""
    from robolink.config import CellGlimpse, glimpse_of_cell

    named = str(context.meta.get(GIVEN, {}).get("url") or "")
    return glimpse_of_cell(named) if named and is_cell_name(named) else CellGlimpse(named, ())


def address_of(url: str | None) -> str:
    """Return the address under which the journal knows a URL; empty if unknown."""
    from robolink.errors import ConfigError
    from robolink.transport import parse_url

    try:
        return parse_url(url).address if url else ""
    except ConfigError:
        return ""
