"""Where the cell files say that journals are, for whatever opens one."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from robolink.config._cells import Cell, load_cell_files
from robolink.config._files import config_files, read_document, whole_place
from robolink.journal import name_journals, shown_location
from robolink.journal._places import without_user
from robolink.transport import parse_url

_KEY: Final = re.compile(
    r"""\s*(?:[\w."'-]+\.)?journal\s*=\s*(?P<quote>["'])(?P<place>.*?)(?P=quote)"""
)


def use_journals_of(cells: Iterable[Cell], otherwise: str = "") -> None:
    """Look for the journals of cells where their files say, from now on in this process.

    Their homes count from then on, too.

    The environment goes before: :func:`robolink.journal.default_location`.

    Args:
        cells: The cells.
        otherwise: Where everything else is on record; empty for where it is without cell files.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import add_cell, select_cells, use_journals_of
        >>> said = {"url": "epson+tcp://192.168.0.1:5000", "journal": "line3.db"}
        >>> add_cell(Path("robolink.toml"), "line3", said)
        >>> use_journals_of(select_cells(["line3"]))
    """
    of = {parse_url(cell.url).address: cell for cell in cells}
    places = {address: cell.settings.journal or "" for address, cell in of.items()}
    homes = {address: cell.home for address, cell in of.items()}
    name_journals({**places, "": otherwise}, homes=homes, afresh=True)


def use_journals_of_files() -> None:
    """Look for all journals where the cell files say, from now on in this process.

    Homes count from then on, too.

    Raises:
        ConfigError: A cell file is wrong: the journal that it names is not known.
    """
    present = [file.path for file in config_files() if file.present]
    if any(_says_where(read_document(path)) for path in present):
        files = load_cell_files()
        use_journals_of(files.cells.values(), files.journal)


def lines_naming_journal(location: str) -> tuple[tuple[Path, int], ...]:
    """Return the files and the numbers of the lines in which cell files name a journal.

    Args:
        location: Where it is, as :func:`robolink.journal.default_location` says.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import add_cell, lines_naming_journal
        >>> said = {"url": "epson+tcp://192.168.0.1:5000", "journal": "line4.db"}
        >>> add_cell(Path("robolink.toml"), "line4", said)
        >>> place = Path("line4.db").absolute().as_posix()
        >>> [file.name for file, _ in lines_naming_journal(f"sqlite:///{place}")]
        ['robolink.toml']
    """
    found: list[tuple[Path, int]] = []
    for path in [file.path for file in config_files() if file.present]:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        for number, line in enumerate(lines, start=1):
            key = _KEY.match(line)
            if key and _bare(whole_place(key["place"], path)) == _bare(location):
                found.append((path, number))
    return tuple(found)


def _bare(location: str) -> str:
    """Return a location in one spelling: a path, or a URL without its driver and its user."""
    shown = without_user(shown_location(location))
    return shown.replace("+psycopg", "") if "://" in shown else Path(shown).as_posix()


def _says_where(document: dict[str, object]) -> bool:
    """Return whether a file names a journal or a home."""
    cells = document.get("cells")
    tables = (document, *(cells.values() if isinstance(cells, dict) else ()))
    return any(not {"journal", "home"}.isdisjoint(one) for one in tables if isinstance(one, dict))
