"""The keys of a simulated cell in a file: the options of its command, no others.

Each key is the name of an option without its dashes: ``--allow-remote`` is ``allow_remote``. What a
value may be is asked of the option itself, so that file and command line cannot differ.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click

from robolink.errors import ConfigError, RobolinkError
from robolink.files.key_problems import at_least, at_most, is_not_known, one_of
from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink_cli.commands.simulate.epson import EPSON_KIND
from robolink_cli.commands.simulate.plc import PLC_KIND
from robolink_cli.commands.simulate.service import host_and_port
from robolink_cli.commands.simulate.simulated_kind import SimulatedKind
from robolink_cli.commands.simulate.softmotion import SOFTMOTION_KIND

ADDRESS: Final = "HOST:PORT"
"""Metavar of an option that takes a listening address."""

_OF_THE_RUN: Final = frozenset({"control", "with_parent", "idle_exit", "json", "help", "replay"})
"""Options that concern the process instead of a simulator, or that serve no simulator."""

Objection = Callable[[str, str], None]
"""Reports a key and what is wrong with it."""


class DeclaredKeys:
    """What a table of one kind may hold.

    Args:
        command: The command that serves one simulator of this kind.
        folder: From where relative paths count.
    """

    def __init__(self, command: click.Command, folder: Path) -> None:
        self._command = command
        self._folder = folder
        self.options = {
            key: option
            for option in command.params
            if isinstance(option, click.Option)
            and option.expose_value
            and not option.hidden
            and (key := _key_of(option)) not in _OF_THE_RUN
        }

    def addresses(self) -> Iterator[str]:
        """Yield the keys that take an address to listen on."""
        return (key for key, option in self.options.items() if option.metavar == ADDRESS)

    def values(self, table: Mapping[str, object], object_to: Objection) -> dict[str, Any]:
        """Return the values for a call of the command; none if one is wrong.

        Args:
            table: What stands in the file.
            object_to: Is told all that is wrong.
        """
        good = True

        def wrong(key: str, what: str) -> None:
            nonlocal good
            good = False
            object_to(key, what)

        line: list[str] = []
        for key in table:
            if key not in self.options:
                wrong(key, is_not_known(key[:80], self.options))
        for key, option in self.options.items():
            if key not in table and option.required:
                wrong(key, tr("is missing"))
            elif key in table:
                try:
                    line += self._typed(option, table[key])
                except click.BadParameter as error:
                    wrong(key, error.message)
                except ConfigError as error:
                    wrong(key, error.what)
        if not good:
            return {}
        try:
            return self._command.make_context("sim", line).params
        except click.UsageError as error:  # options that cannot be combined
            object_to("", error.message)
            return {}

    def _typed(self, option: click.Option, given: object) -> list[str]:
        """Return the words that a person would type for a value, if the option takes it.

        Raises:
            click.BadParameter, ConfigError: It is none.
        """
        if option.is_flag:
            if not isinstance(given, bool):
                raise click.BadParameter(tr("must be true or false"))
            return [option.opts[0]] * given
        pieces = self._pieces(option, given) if option.multiple else [self._plain(option, given)]
        if option.metavar == ADDRESS:
            host_and_port(str(given), option.opts[0])
        for piece in pieces:
            option.type.convert(piece, option, None)
        return [f"{option.opts[0]}={piece}" for piece in pieces]

    def _pieces(self, option: click.Option, given: object) -> list[object]:
        if _is_named(option):
            if not isinstance(given, dict):
                raise click.BadParameter(tr("must be a table"))
            return [f"{name}={_as_text(value)}" for name, value in given.items()]
        if not isinstance(given, list):
            raise click.BadParameter(tr("must be a list in brackets"))
        return [self._plain(option, one) for one in given]

    def _plain(self, option: click.Option, given: object) -> object:
        match option.type:
            case click.types.IntParamType():
                if type(given) is not int:
                    raise click.BadParameter(tr("must be a whole number"))
            case click.types.FloatParamType():
                if type(given) not in (int, float):
                    raise click.BadParameter(tr("must be a number"))
            case _:
                if not isinstance(given, str):
                    raise click.BadParameter(tr("must be a text in quotes"))
                if isinstance(option.type, click.Path):
                    return str(self._folder / given)
        return given


def _key_of(option: click.Option) -> str:
    return max(option.opts, key=len).lstrip("-").replace("-", "_")


def _is_named(option: click.Option) -> bool:
    """Return whether an option is NAME=VALUE, which is a table in a file."""
    return bool(re.fullmatch(r"\w+=\w+", str(option.metavar)))


def _as_text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float, str)):
        return str(value)
    raise click.BadParameter(tr("must be a table of numbers, texts, true or false"))


_LAST_PORT: Final = 0xFFFF
_LAST_NODE: Final = 127
_PLACEHOLDER: Final = "{name}"

CellObjection = Callable[[str, str, str], None]
"""Reports a cell, one of its keys, and what is wrong with that key."""


@dataclass(frozen=True, slots=True)
class CellTable:
    """A table of the file.

    Attributes:
        name: Of the cell; of a fleet, what its names begin with.
        kind: Of its simulators.
        count: How many there are; ``None`` for one, under the name itself.
        assist: Whether a person stands beside each.
        given: The options of the first.
        keys: Where they come from.
    """

    name: str
    kind: SimulatedKind
    count: int | None
    assist: bool
    given: dict[str, Any]
    keys: DeclaredKeys


@dataclass(frozen=True, slots=True)
class PlannedCell:
    """One cell that is to be served.

    Attributes:
        name: Its name.
        table: The name of its table.
        kind: Of its simulator.
        assist: Whether a person stands beside it.
        given: The options of the command that would serve it alone.
    """

    name: str
    table: str
    kind: SimulatedKind
    assist: bool
    given: dict[str, Any]


def numbered(tables: Iterable[CellTable], object_to: CellObjection) -> tuple[PlannedCell, ...]:
    """Return each cell by itself; refuse values that two of them would share."""
    cells: list[PlannedCell] = []
    places: dict[object, str] = {}
    for table in tables:
        for cell in _one_by_one(table, object_to):
            if any(cell.name == other.name for other in cells[-1:]) or cell.name in places:
                object_to(table.name, "", tr("two cells have the name {name}", name=cell.name))
                break
            places[cell.name] = cell.name
            clash = next(
                (
                    it
                    for it in _claims(table, cell)
                    if places.setdefault(it[1], cell.name) != cell.name
                ),
                None,
            )
            if clash is not None:
                key, place = clash
                object_to(
                    table.name,
                    key,
                    tr("{name} uses it already; every cell needs its own", name=places[place]),
                )
                break
            cells.append(cell)
    return tuple(cells)


def _one_by_one(table: CellTable, object_to: CellObjection) -> Iterator[PlannedCell]:
    """Yield the cells of a table, each with its own seed, ports, node and files."""
    digits = len(str(table.count))
    for number in range(table.count or 1):
        name = table.name if table.count is None else f"{table.name}-{number + 1:0{digits}}"
        given = {**table.given, "seed": table.given["seed"] + number, "cell": name}
        for key in table.keys.addresses():
            option = str(table.keys.options[key].name)
            if given[option] is not None and (moved := _moved(given[option], number)) is None:
                object_to(table.name, key, tr("there are not that many ports"))
                return
            elif given[option] is not None:
                given[option] = moved
        if given.get("can") is not None:
            given["node"] += number
            if given["node"] > _LAST_NODE:
                object_to(table.name, "count", tr("a bus has at most 127 nodes"))
                return
        named = {key: _named(value, name) for key, value in given.items()}
        yield PlannedCell(name, table.name, table.kind, table.assist, named)


def _moved(address: str, by: int) -> str | None:
    """Return an address so many ports further, ``None`` where there is none; 0 stays free."""
    host, port = host_and_port(address, "")
    if port == 0:
        return address
    shown = address.rpartition(":")[0] or host
    return f"{shown}:{port + by}" if port + by <= _LAST_PORT and host else None


def _named(value: object, name: str) -> object:
    """Return a value with the cell's own name where ``{name}`` stands."""
    if isinstance(value, str):
        return value.replace(_PLACEHOLDER, name)
    if isinstance(value, Path):
        return Path(str(value).replace(_PLACEHOLDER, name))
    if isinstance(value, (list, tuple)):
        return tuple(_named(one, name) for one in value)
    return value


def _claims(table: CellTable, cell: PlannedCell) -> Iterator[tuple[str, object]]:
    """Yield what a cell must have for itself: keys, and their values."""
    for key in table.keys.addresses():
        address = cell.given[str(table.keys.options[key].name)]
        if address is not None and (place := host_and_port(address, ""))[1]:
            yield key, place
    if cell.given.get("state") is not None:
        yield "state", cell.given["state"].resolve()
    if cell.given.get("can") is not None:
        yield "can", (cell.given["can"], cell.given["node"])


SCHEMA: Final = "robolink/sim-cells/1"
MOST_OF_A_TABLE: Final = 10_000

KINDS: Final[Mapping[str, SimulatedKind]] = {
    "epson": EPSON_KIND,
    "softmotion": SOFTMOTION_KIND,
    "plc": PLC_KIND,
}

CELLS_FILE: Final = FileKind(
    named=lambda path: tr("The file of simulated cells {path}", path=path),
    unreadable_remedy=lambda: tr("docs/fleet.md has an example."),
    wrong_remedy=lambda: tr("Correct it; docs/fleet.md explains every key."),
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
    """Turns a document into cells, and notes all its errors."""

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
        """Return the cells; use them only if there are no problems."""
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
        """Make one simulator of each table, and note its errors; no file is touched."""
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
        """Return the line of a key, else of its table; 0 if the form of the file hides it."""
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
