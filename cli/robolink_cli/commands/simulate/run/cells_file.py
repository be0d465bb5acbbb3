"""A file of simulated cells: ``[cells.NAME]`` by ``[cells.NAME]`` (docs/simulated-fleet.md)."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import click

from robolink.errors import RobolinkError
from robolink.files.key_problems import at_least, at_most, is_not_known, one_of
from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink_cli.commands.simulate.kinds.epson import EPSON_KIND
from robolink_cli.commands.simulate.kinds.plc import PLC_KIND
from robolink_cli.commands.simulate.kinds.simulated_kind import SimulatedKind
from robolink_cli.commands.simulate.kinds.softmotion import SOFTMOTION_KIND
from robolink_cli.commands.simulate.run.declared_keys import DeclaredKeys
from robolink_cli.commands.simulate.run.fleet import CellTable, PlannedCell, numbered

SCHEMA: Final = "robolink/sim-cells/1"
MOST_OF_A_TABLE: Final = 10_000

KINDS: Final[Mapping[str, SimulatedKind]] = {
    "epson": EPSON_KIND,
    "softmotion": SOFTMOTION_KIND,
    "plc": PLC_KIND,
}

CELLS_FILE: Final = FileKind(
    named=lambda path: tr("The file of simulated cells {path}", path=path),
    unreadable_remedy=lambda: tr("docs/simulated-fleet.md shows what such a file looks like."),
    wrong_remedy=lambda: tr("Correct it; docs/simulated-fleet.md explains every key."),
)

_OWN_KEYS: Final = ("kind", "count", "assist")
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,59}")


def read_cells(path: Path, commands: Mapping[str, click.Command]) -> tuple[PlannedCell, ...]:
    """Return the cells of a file, those of a fleet one by one.

    Args:
        path: The file.
        commands: What serves one simulator of each kind, whose options its tables may hold.

    Raises:
        ConfigError: It cannot be read, or something in it is wrong: all of it at once, each
            with its line and key.
    """
    content = CELLS_FILE.read(path)
    document = CELLS_FILE.parse(path, content)
    text, folder = content.decode("utf-8-sig"), path.absolute().parent
    reader = _CellsReader(document, text, folder, commands)
    cells = reader.cells()
    if not reader.problems:
        reader.try_first_of_each_table(cells)
    if reader.problems:
        raise CELLS_FILE.refusal(path, reader.problems)
    return cells


class _CellsReader:
    """Turns a document into cells, and notes all that is wrong with it."""

    def __init__(
        self,
        document: Mapping[str, object],
        text: str,
        folder: Path,
        commands: Mapping[str, click.Command],
    ) -> None:
        self.problems: list[Problem] = []
        self._document = document
        self._lines = text.splitlines()
        self._folder = folder
        self._commands = commands

    def cells(self) -> tuple[PlannedCell, ...]:
        """Return the cells; of use only where there are no problems."""
        for key in self._document:
            if key not in ("schema", "cells"):
                self._object("", key, is_not_known(key[:80], ("schema", "cells")))
        if self._document.get("schema") != SCHEMA:
            self._object("", "schema", one_of([SCHEMA]))
        tables = self._document.get("cells")
        if not isinstance(tables, dict) or not tables:
            self._object("", "cells", tr("must be a table"))
            return ()
        read = [self._table(name, table) for name, table in tables.items()]
        return numbered([table for table in read if table is not None], self._object)

    def try_first_of_each_table(self, cells: Sequence[PlannedCell]) -> None:
        """Make one simulator of each table, and note what it objects to; no file is touched."""
        tried = set[str]()
        for cell in cells:
            if cell.table in tried:
                continue
            tried.add(cell.table)
            try:
                cell.kind.make(**{**cell.given, "state": None})
            except RobolinkError as error:
                self._object(cell.table, "", error.what)
            except click.UsageError as error:
                self._object(cell.table, "", error.message)

    def _table(self, name: str, table: object) -> CellTable | None:
        if not _NAME.fullmatch(name):
            self._object(name, "", tr("a name has letters, digits, - and _, at most 60"))
            return None
        if not isinstance(table, dict):
            self._object(name, "", tr("must be a table"))
            return None
        kind = KINDS.get(str(table.get("kind")))
        if kind is None:
            self._object(name, "kind", one_of(KINDS))
            return None
        before = len(self.problems)
        count = self._count(name, table.get("count"))
        assist = table.get("assist", "count" not in table and kind.person)
        if not isinstance(assist, bool):
            self._object(name, "assist", tr("must be true or false"))
        elif assist and not kind.person:
            self._object(name, "assist", tr("must be false: this kind has no person at the cell"))
        keys = DeclaredKeys(self._commands[str(table["kind"])], self._folder)
        said = {key: value for key, value in table.items() if key not in _OWN_KEYS}
        given = keys.values(said, lambda key, what: self._object(name, key, what))
        if len(self.problems) > before:
            return None
        return CellTable(name, kind, count, bool(assist), given, keys)

    def _count(self, name: str, given: Any) -> int | None:  # noqa: ANN401 - whatever stands there
        if given is None:
            return None
        if type(given) is not int:
            self._object(name, "count", tr("must be a whole number"))
        elif not 1 <= given <= MOST_OF_A_TABLE:
            least, most = at_least(1), at_most(MOST_OF_A_TABLE)
            self._object(name, "count", least if given < 1 else most)
        else:
            return given
        return None

    def _object(self, cell: str, key: str, what: str) -> None:
        where = ".".join(part for part in ("cells" if cell else "", cell[:80], key[:80]) if part)
        line = self._line(cell, key)
        self.problems.append(Problem(f"line {line}, {where}" if line else where, what))

    def _line(self, cell: str, key: str) -> int:
        """Return the line of a key, else of its table; 0 where the form of the file hides it."""
        header = re.compile(r"^\s*\[\s*cells\s*\.\s*[\"']?([^\"'\]]+?)[\"']?\s*\]")
        at, inside = 0, cell == ""
        for number, text in enumerate(self._lines, 1):
            if text.lstrip().startswith("["):
                found = header.match(text)
                owner = found[1].split(".")[0].strip("\"' ") if found else None
                inside = cell != "" and owner == cell
                sub = found[1].partition(".")[2].strip("\"' ") if found else ""
                if inside and (not at or sub == key):
                    at = number
                elif not cell and key and re.match(rf"\s*\[+\s*{re.escape(key)}\b", text):
                    return number
            elif inside and key and re.match(rf"^\s*\"?{re.escape(key)}\"?\s*[=.]", text):
                return number
        return at
