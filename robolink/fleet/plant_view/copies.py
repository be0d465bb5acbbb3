"""The entries that a report of many cells reads: the plant's copies, or this home's journals."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from typing import Any, Final

from robolink.config import Cell, named_plant
from robolink.drift import KINDS
from robolink.fleet.errors import PlantError
from robolink.journal import default_location, may_exist, open_journal, plant_place
from robolink.journal._outbox import home_of
from robolink.journal.store.connection import server_parameters
from robolink.messages import listed, tr
from robolink.model import Recorded, Signature
from robolink.transport import parse_url

_NEEDED: Final = (
    *("tip", "proposed", "measured", "method", "reference_point_mm", "repeatable_to_mm"),
    *("accurate_to_mm", "simulated", "max_drift_mm", "z_from", "before", "value"),
)
"""Details that a report needs; a measurement holds every pose besides."""

_HEADS: Final = "SELECT chain, home, copied_at FROM fleet.cell_heads WHERE replaced_by = ''"
_ENTRIES: Final = (
    "SELECT entry, hash FROM fleet.cell_entries WHERE chain = %s AND kind = ANY(%s) ORDER BY number"
)
_SIGNATURE: Final = tuple(field.name for field in fields(Signature))
_PLAIN: Final = ("number", "at", "controller", "change", "operation", "tool", "tolerance")
_KINDS: Final = {str(kind): kind for kind in KINDS}


@dataclass(frozen=True, slots=True)
class CopiedJournal:
    """The entries of one journal.

    Attributes:
        home: Where the journal lies: computer and file, or the URL of its database.
        copied_at: When an entry of it was copied last, as a label; empty for the journal itself.
        entries: Those of the kinds in :data:`robolink.drift.KINDS`, oldest first, with the details
            that a report needs.
    """

    home: str
    copied_at: str
    entries: Iterator[Recorded]


def copied_journals(url: str) -> Iterator[CopiedJournal]:
    """Yield what a plant has copies of, journal by journal.

    Args:
        url: The plant's database.

    Raises:
        PlantError: It cannot be read.
    """
    import psycopg

    place = plant_place(url)
    try:
        with psycopg.connect(**server_parameters(place.url), autocommit=True) as driver:
            driver.execute("SET statement_timeout = '60s'")
            if driver.execute("SELECT to_regclass('fleet.cell_heads')").fetchall() == [(None,)]:
                return
            for chain, home, copied_at in driver.execute(_HEADS).fetchall():
                cursor = driver.execute(_ENTRIES, (chain, list(_KINDS)))
                label = copied_at.astimezone(UTC).isoformat(timespec="seconds")
                yield CopiedJournal(home, label, (_copied(*row) for row in cursor))
    except psycopg.Error as error:
        head = tr("The plant's database {name} cannot be read:", name=place.name)
        raise PlantError(
            listed(head, [" ".join(str(error).split())]),
            remedy=tr("Check the server and the user."),
        ) from error


def own_journals(cells: Iterable[Cell]) -> Iterator[CopiedJournal]:
    """Yield the journals of this computer's cells, each once.

    Raises:
        JournalError: One cannot be read.
    """
    addresses = (
        parse_url(cell.url).address
        for cell in cells
        if "+sim://" not in cell.url and cell.home.is_here
    )
    for location in dict.fromkeys(map(default_location, addresses)):
        if may_exist(location):
            journal = open_journal(location, read_only=True)
            entries = journal.entries(kinds=KINDS, newest_first=False)
            yield CopiedJournal(home_of(journal.location), "", map(_slim, entries))
            journal.close()


def journals_of_plant(cells: Callable[[], Iterable[Cell]]) -> Iterator[CopiedJournal]:
    """Yield the plant's copies where a plant takes them, and else this computer's journals.

    Args:
        cells: Returns the cells of this computer.
    """
    plant = named_plant()
    if plant is not None and plant.takes_copies:
        return copied_journals(plant.location)
    return own_journals(cells())


def _copied(text: str, its_hash: str) -> Recorded:
    said: dict[str, Any] = json.loads(text)
    return Recorded(
        **{name: said[name] for name in _PLAIN},
        kind=_KINDS[said["kind"]],
        verdict=said["verdict"],
        details=_needed(json.loads(said["details"])),
        signature=Signature(**{name: said[name] for name in _SIGNATURE}),
        previous=said["previous"],
        hash=its_hash,
    )


def _slim(entry: Recorded) -> Recorded:
    return replace(entry, details=_needed(entry.details))


def _needed(details: Mapping[str, object]) -> dict[str, object]:
    return {name: details[name] for name in _NEEDED if name in details}


def age_days(label: str, now: datetime) -> float:
    """Return how old a label is, days; not less than none where a clock was set back."""
    return max(0.0, (now - datetime.fromisoformat(label)).total_seconds() / 86400)
