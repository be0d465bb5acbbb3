"""From tables to single cells: names, seeds, ports and nodes of a fleet, each used once."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from robolink.messages import tr
from robolink_cli.commands.simulate.kinds.simulated_kind import SimulatedKind
from robolink_cli.commands.simulate.run.declared_keys import DeclaredKeys
from robolink_cli.commands.simulate.serving import host_and_port

_LAST_PORT: Final = 0xFFFF
_LAST_NODE: Final = 127
_PLACEHOLDER: Final = "{name}"

CellObjection = Callable[[str, str, str], None]
"""Is told a cell, a key of it, and what is wrong with that."""


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
    """Return each cell by itself; objects to what two of them would have to share."""
    cells: list[PlannedCell] = []
    places: dict[object, str] = {}
    for table in tables:
        for cell in _one_by_one(table, object_to):
            if any(cell.name == other.name for other in cells[-1:]) or cell.name in places:
                object_to(table.name, "", tr("two cells are called {name}", name=cell.name))
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
                    tr("{name} has it already; every cell needs its own", name=places[place]),
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
                object_to(table.name, key, tr("there are not so many ports"))
                return
            elif given[option] is not None:
                given[option] = moved
        if given.get("can") is not None:
            given["node"] += number
            if given["node"] > _LAST_NODE:
                object_to(table.name, "count", tr("a bus has no more than 127 nodes"))
                return
        named = {key: _named(value, name) for key, value in given.items()}
        yield PlannedCell(name, table.name, table.kind, table.assist, named)


def _moved(address: str, by: int) -> str | None:
    """Return an address so many ports further, ``None`` where there is none; 0 stays free."""
    host, port = host_and_port(address, "")
    if port == 0:
        return address
    shown = address.rpartition(":")[0]
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
    """Yield what a cell must have for itself: keys, and what they say."""
    for key in table.keys.addresses():
        address = cell.given[str(table.keys.options[key].name)]
        if address is not None and (place := host_and_port(address, ""))[1]:
            yield key, place
    if cell.given.get("state") is not None:
        yield "state", cell.given["state"].resolve()
    if cell.given.get("can") is not None:
        yield "can", (cell.given["can"], cell.given["node"])
