"""The rows of the catalogue, as the files in ``rows`` have them: what can go wrong, F01 to F80.

A row says what the user sees and what never happens. Tests carry its number
(``pytest.mark.fault("F01")``); the page and the table of ``make faults`` are made from both.
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

FOLDER = Path(__file__).parent / "rows"


@dataclass(frozen=True, slots=True)
class Row:
    """One fault; see the first row of ``rows/1_links.toml`` for the tone of each field."""

    id: str
    """F and two digits; never used again for another fault."""
    fault: str
    layer: str
    """Which links or parts it concerns."""
    sees: str
    """What a user of the library or the command line notices, and what is right afterwards."""
    never: str
    """What does not happen, however the fault falls; each test looks for it."""
    injected: str
    """How tests bring the fault about."""
    not_run: str = ""
    """Why a plain machine cannot show this row at all. Such a row has no test."""
    not_shown: str = ""
    """Which part of the row its tests leave out, and why; the rest is shown."""


@dataclass(frozen=True, slots=True)
class Group:
    """The rows of one file, under its title."""

    title: str
    rows: tuple[Row, ...]


@cache
def groups() -> tuple[Group, ...]:
    """Return all rows in the order of the files. A key that is no field is a ``TypeError``."""
    read = [tomllib.loads(f.read_text(encoding="utf-8")) for f in sorted(FOLDER.glob("*.toml"))]
    return tuple(Group(file["title"], tuple(Row(**r) for r in file["fault"])) for file in read)


def rows() -> tuple[Row, ...]:
    """Return all rows, without their groups."""
    return tuple(row for group in groups() for row in group.rows)
