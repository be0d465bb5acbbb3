"""Finds entries of the journal by what a person types; adds nothing."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.transaction import id_of_change
from robolink_cli.access.cell import complete_cell, is_cell_name
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import GIVEN

if TYPE_CHECKING:
    from robolink.journal import Journal
    from robolink.model import Recorded

SHORTEST_ID: Final = 4
"""Fewest characters of a change's id that are accepted."""

_LONGEST_NUMBER: Final = 18
_NAMED: Final = 5


def journal_to_read(address: str | None = None) -> "Journal":
    """Open the journal for reading, where environment and cell files say that it is.

    Args:
        address: Of the controller that it is about; by default the one of the line, else all.

    Raises:
        JournalError: There is none yet, or it cannot be read.
        ConfigError: A cell file is wrong, and one names a journal.
    """
    from robolink.journal import open_journal

    return open_journal(place_to_read(address), read_only=True)


def place_to_read(address: str | None = None) -> str:
    """Return where the journal is by environment and cell files; see :func:`journal_to_read`."""
    from robolink.config import use_journals_of_files
    from robolink.journal import default_location

    use_journals_of_files()
    return default_location(address or controller_meant(None) or "")


OfController = Annotated[
    str | None,
    CliOption(
        "-c",
        "--controller",
        metavar="CELL|URL",
        shell_complete=complete_cell,
        help="Only of this controller; without it, of all.",
    ),
]


def controller_meant(named: str | None) -> str | None:
    """Return the address of the controller named here or before the command.

    The journal knows who was met there last.

    Args:
        named: A cell or a URL; ``None`` for what ``robolink -c`` said.

    Raises:
        ConfigError: There is no such cell, or it is no URL.
    """
    from robolink.transport import parse_url

    chosen = _named(named)
    if chosen is None:
        return None
    if is_cell_name(chosen):
        from robolink.config import find_cell

        chosen = find_cell(chosen).url
    return parse_url(chosen).address


def cell_meant(named: str | None) -> str:
    """Return the name of the cell named here or before the command; else nothing."""
    chosen = _named(named)
    return chosen if chosen is not None and is_cell_name(chosen) else ""


def _named(named: str | None) -> str | None:
    return named or click.get_current_context().meta.get(GIVEN, {}).get("url")


def entries_named(journal: "Journal", name: str) -> "list[Recorded]":
    """Return one entry by its number, or those of a change by the beginning of its id.

    They come in the order in which they were stored.

    Raises:
        ConfigError: There is nothing of that name, or more than one change.
        JournalError: The journal cannot be read.
    """
    entry = _entry_numbered(journal, name)
    return [entry] if entry else entries_of_change(journal, name)


def entries_of_change(
    journal: "Journal", name: str, *, controller: str | None = None
) -> "list[Recorded]":
    """Return the entries of a change in the order in which they were stored.

    Args:
        journal: Where to look.
        name: The beginning of its id, or the number of one of its entries.
        controller: Only of this controller.

    Raises:
        ConfigError: There is no such change, or more than one.
        JournalError: The journal cannot be read.
    """
    entry = _entry_numbered(journal, name)
    names = None if controller is None else journal.names_of(controller)
    meant = entry is not None and (names is None or entry.controller in names)
    wanted = id_of_change(entry) if entry and meant else ""
    if not wanted:
        wanted = change_named(journal.entries(controller=controller), name)
    found = list(journal.entries(controller=controller, change=wanted, newest_first=False))
    if found:
        return found
    # A single write, known by its operation.
    every = journal.entries(controller=controller, newest_first=False)
    return [entry for entry in every if id_of_change(entry) == wanted]


def change_named(entries: "Iterable[Recorded]", name: str) -> str:
    """Return the id of the one change whose id begins with ``name``, or has that entry.

    Raises:
        ConfigError: There is none, or more than one.
    """
    ids: dict[str, None] = {}
    for entry in entries:
        if str(entry.number) == name and id_of_change(entry):
            return id_of_change(entry)
        if id_of_change(entry).startswith(name.lower()):
            ids[id_of_change(entry)] = None
    if len(name) >= SHORTEST_ID and len(ids) == 1:
        return next(iter(ids))
    raise ConfigError(
        _what_is_wrong(name, list(ids)),
        remedy=tr(
            "Give a number, or {count} characters of an id. To see them: robolink journal list",
            count=SHORTEST_ID,
        ),
    )


def _entry_numbered(journal: "Journal", name: str) -> "Recorded | None":
    if not (name.isascii() and name.isdecimal()) or len(name) > _LONGEST_NUMBER:
        return None
    return journal.entry(int(name))


def _what_is_wrong(name: str, ids: list[str]) -> str:
    if len(name) < SHORTEST_ID:
        return tr("{name!r} is neither the number of an entry nor an id.", name=name)
    if not ids:
        return tr("No entry and no change in the journal is called {name!r}.", name=name)
    shown = ", ".join(found[: len(name) + 4] for found in ids[:_NAMED])
    return tr(
        "{count} changes begin with {name!r}: {shown}.", count=len(ids), name=name, shown=shown
    )
