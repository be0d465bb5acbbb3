"""journal sync: copies the journal to the plant's database; and what verify asks there."""

from typing import TYPE_CHECKING, Annotated, Final, NamedTuple

import click

from robolink.errors import ConfigError, RobolinkError
from robolink.messages import tr
from robolink.model import json_fields
from robolink_cli.access.cell import complete_cells, is_cell_name
from robolink_cli.commands.record.journal_lookup import place_to_read
from robolink_cli.console.exit_codes import exit_code
from robolink_cli.console.render import emit, say, table
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robolink.journal import ChainCopy, Journal, JournalCopy, Witness

_SHOWN: Final = 12
"""Digits of a hash in a table."""


@click.command("sync", short_help="Copy journals to the plant's database.")
@json_option
def sync(
    *,
    cells: Annotated[
        tuple[str, ...], CliArgument(metavar="[CELL]...", shell_complete=complete_cells)
    ] = (),
    new_chain: Annotated[
        bool,
        CliOption(
            help="Copy this journal although another one was copied from this place before: a new "
            "record was begun on purpose. The copies of the other one stay."
        ),
    ] = False,
) -> int:
    """Copy the entries that the plant's database lacks, in order.

    CELL is a name, a URL, a pattern in quotes ('line3-*') or a group of the cell file (@line3); the
    journals of these cells are copied, several at a time. Without CELL it is the journal of the
    cell of -c, or else that of this user.

    ROBOLINK_PLANT names that database, or plant = "postgresql://..." at the top of a cell file.
    Each command that recorded something does the same at its end, and so does the panel. Exit code
    2 if the plant has other entries than a journal, 3 if its database does not answer; of several
    journals that of the first that failed, and the others are copied all the same.
    """
    from robolink.config import named_plant
    from robolink.journal import copy_journals, plant_place

    plant = named_plant()
    if plant is None or not plant.takes_copies:
        raise ConfigError(
            tr("No PostgreSQL database of a plant is named."),
            remedy=tr(
                'Set ROBOLINK_PLANT, or plant = "postgresql://user@host/database" at the top of a '
                "cell file."
            ),
        )
    name = plant_place(plant.location).name
    journals = _journals_of(cells) if cells else {place_to_read(): []}
    if new_chain and len(journals) > 1:
        raise ConfigError(
            tr("A new record is begun of one journal at a time; these are {n}.", n=len(journals)),
            remedy=tr("Nothing was copied. Name one cell."),
        )
    copies = list(copy_journals(list(journals), plant.location, new_chain=new_chain))
    failed = [one.error for one in copies if one.error is not None]
    if failed and len(copies) == 1:
        raise failed[0]
    of = dict(zip((one.journal for one in copies), journals.values(), strict=True))
    payload = {
        "ok": not failed,
        "plant": name,
        "named_by": plant.origin,
        "journals": [_payload(one, of[one.journal]) for one in copies],
    }

    def show() -> None:
        say(tr("plant: {plant} ({origin})", plant=name, origin=plant.origin))
        heads = [
            tr("journal"),
            tr("chain"),
            tr("copied now"),
            tr("last at the plant"),
            tr("behind"),
        ]
        rows = [_row(one.journal, one.copy) for one in copies if one.copy is not None]
        if rows:
            table(tr("copies"), heads, rows)
        for one in copies:
            if one.error is not None:
                called = ", ".join(of[one.journal])
                say(tr("{cells}: not copied.", cells=called))
                say(f"  {one.error}")

    emit("journal-synced", payload, show)
    return exit_code(failed[0]) if failed else 0


def _journals_of(names: "Sequence[str]") -> dict[str, list[str]]:
    """Return the journals of the cells that names mean, with the cells that each is of.

    Raises:
        ConfigError: A name, pattern or group means none, or a cell file is wrong.
    """
    from robolink.config import load_cell_files, use_journals_of
    from robolink.journal import default_location
    from robolink.transport import parse_url

    found: dict[str, list[str]] = {}
    files = load_cell_files()
    use_journals_of(files.cells.values(), files.journal)
    named = [name for name in names if is_cell_name(name)]
    cells = files.select(named) if named else ()
    places = [(cell.name, cell.url) for cell in cells]
    places += [(url, url) for url in names if not is_cell_name(url)]
    for name, url in places:
        found.setdefault(default_location(parse_url(url).address), []).append(name)
    return found


def _payload(one: "JournalCopy", cells: "Sequence[str]") -> dict[str, object]:
    """Return what became of a journal as plain JSON; ``None`` for what is not known."""
    names = ("chain", "copied_count", "number", "hash", "behind_count")
    told = dict.fromkeys(names) if one.copy is None else json_fields(one.copy, *names)
    error = one.error and {
        "kind": type(one.error).__name__,
        **json_fields(one.error, "what", "remedy"),
    }
    return {"journal": one.journal, "cells": list(cells), **told, "error": error}


def _row(journal: str, copy: "ChainCopy") -> list[object]:
    chain = copy.chain[:_SHOWN] or "-"
    return [journal, chain, copy.copied_count, copy.number, copy.behind_count]


class PlantAnswer(NamedTuple):
    """What the plant's database answered about a journal.

    Attributes:
        plant: The database; what names it, where that names none.
        witness: What it says; ``None`` where it could not be asked.
        error: Why not.
    """

    plant: str
    witness: "Witness | None" = None
    error: RobolinkError | None = None

    @property
    def problems(self) -> tuple[str, ...]:
        """What differs, one sentence each."""
        return () if self.witness is None else self.witness.problems

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON."""
        seen = self.witness
        return {
            "plant": self.plant,
            "number": None if seen is None else seen.number,
            "hash": None if seen is None else seen.hash,
            "error": None if self.error is None else self.error.what,
        }

    def sentence(self) -> str:
        """Return how far the plant confirms the journal, or why it could not be asked."""
        if self.error is not None:
            return str(self.error)
        if self.witness is None or not self.witness.number:
            return tr("The plant {plant} has no copy of this journal.", plant=self.plant)
        if self.problems:
            return tr("Compared with the plant {plant}.", plant=self.plant)
        return tr(
            "The plant {plant} has the same entries, up to {number}.",
            plant=self.plant,
            number=self.witness.number,
        )


def asked_plant(journal: "Journal") -> PlantAnswer | None:
    """Compare a journal with the plant's copy; ``None`` where no plant is named."""
    from robolink.config import named_plant

    plant = named_plant()
    if plant is None or not plant.takes_copies:
        return None
    name = plant.origin
    try:
        with journal.outbox(plant.location) as outbox:
            name = outbox.plant
            return PlantAnswer(name, outbox.witness())
    except RobolinkError as error:
        return PlantAnswer(name, error=error)
