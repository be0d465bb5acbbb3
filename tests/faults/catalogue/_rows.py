"""The rows of the catalogue, as the files in ``rows`` have them: possible faults, F01 to F87.

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
    """One fault; the first row of ``rows/1_links.toml`` shows the style of each field."""

    id: str
    """F and two digits; never reused for another fault."""
    fault: str
    layer: str
    """The links or parts concerned."""
    sees: str
    """What a user of the library or the command line notices, and the right state afterwards."""
    never: str
    """What never happens, at whatever instant the fault occurs; each test looks for it."""
    injected: str
    """The way in which tests cause the fault."""
    not_run: str = ""
    """The reason why an ordinary computer cannot show this row at all. Such a row has no test."""
    not_shown: str = ""
    """The part of the row that its tests leave out, and why; they show the rest."""


@dataclass(frozen=True, slots=True)
class Group:
    """The rows of one file, under its title."""

    title: str
    rows: tuple[Row, ...]


@cache
def groups() -> tuple[Group, ...]:
    """Return all rows in the order of the files. An unknown key is a ``TypeError``."""
    read = [tomllib.loads(f.read_text(encoding="utf-8")) for f in sorted(FOLDER.glob("*.toml"))]
    return tuple(Group(file["title"], tuple(Row(**r) for r in file["fault"])) for file in read)


def rows() -> tuple[Row, ...]:
    """Return all rows, without their groups."""
    return tuple(row for group in groups() for row in group.rows)
