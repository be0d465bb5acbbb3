"""The tables of a map of symbols: keys and limits, and what no key says alone.

Imported when such a map is loaded, for pydantic.
"""

import re
from collections.abc import Iterator
from itertools import combinations
from typing import Annotated, Any, Final, NamedTuple

from pydantic import ConfigDict, Field

from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.register_maps._places import NumberType
from robolink.register_maps._symbols import (
    CYCLE_MS,
    Step,
    SymbolCell,
    SymbolMap,
    SymbolNumber,
    SymbolSignal,
    SymbolSlot,
    SymbolWord,
    steps_of,
)
from robolink.register_maps._tables import (
    HANDSHAKE_KEYS,
    AngleUnit,
    CommitBitKeys,
    FlangeTable,
    Keys,
    LengthUnit,
    LevelKeys,
    Line,
    MappedToolTable,
    MapTables,
    NoneKeys,
    Resolving,
    TypeName,
    keys_of,
)

NodeName = Annotated[str, Field(min_length=1, max_length=400, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
"""A node, whole or the end of one; no control characters, as in all texts of a map."""

Element = Annotated[int, Field(ge=0, le=65_535)]
Length = Annotated[int, Field(ge=1, le=65_536)]
SymbolValue = Annotated[int, Field(ge=-(2**31), le=2**32 - 1)]

_NODE: Final = re.compile(r"(?:ns=\d{1,5};)?[isgb]=.+|/.+")


class SymbolDefaults(Keys):
    """``[numbers]``: applies to every number that does not say otherwise."""

    root: NodeName | None = None
    type: TypeName | None = None
    scale: float = 1.0
    length_unit: LengthUnit = "mm"
    angle_unit: AngleUnit = "deg"


class PlaceKeys(Keys):
    """A node, or one element or one field of it."""

    node: NodeName | None = None
    element: Element | None = None
    field: NodeName | None = None
    length: Length | None = None


class SymbolNumberKeys(PlaceKeys):
    """One number: value = what is stored times scale, in unit."""

    type: TypeName | None = None
    scale: float | None = None
    unit: LengthUnit | AngleUnit | None = None


class SymbolProbeKeys(SymbolNumberKeys):
    """``[probe]``: a constant, compared before any value is believed; in no unit."""

    value: float


class SymbolSignalKeys(PlaceKeys):
    """A BOOL, a whole number, or one bit of one."""

    bit: Annotated[int, Field(ge=0, le=31)] | None = None
    on: SymbolValue = 1
    off: SymbolValue = 0


class SymbolInputKeys(SymbolSignalKeys):
    """One ``[[inputs]]``."""

    number: Annotated[int, Field(ge=0, le=0xFFFF)]
    name: Line = ""


class SymbolToolTable(MappedToolTable[SymbolNumberKeys, SymbolSignalKeys]):
    """One ``[[tools]]``: what names its array, element or structure counts for its components."""

    node: NodeName | None = None
    element: Element | None = None
    length: Length | None = None


class SymbolFlangeTable(FlangeTable[SymbolNumberKeys]):
    """``[flange]``, with a node as for a tool."""

    node: NodeName | None = None
    element: Element | None = None
    length: Length | None = None


class SymbolFile(MapTables):
    """One whole map of symbols."""

    model_config = ConfigDict(title="robolink PLC map by symbol")

    cycle_ms: Annotated[float, Field(gt=0, le=10_000)] | None = None
    cycle_counter: PlaceKeys | None = None
    change_counter: PlaceKeys | None = None
    numbers: SymbolDefaults = Field(default_factory=SymbolDefaults)
    tools: Annotated[list[SymbolToolTable], Field(min_length=1)]
    commit: Annotated[
        CommitBitKeys[SymbolSignalKeys, PlaceKeys]
        | LevelKeys[SymbolSignalKeys, PlaceKeys]
        | NoneKeys,
        Field(discriminator="kind"),
    ]
    probe: SymbolProbeKeys | None = None
    permit: SymbolSignalKeys | None = None
    selected: PlaceKeys | None = None
    device_id: PlaceKeys | None = None
    flange: SymbolFlangeTable | None = None
    inputs: list[SymbolInputKeys] = Field(default_factory=list)


SYMBOL_KEYS: Final = keys_of(
    SymbolFile,
    SymbolDefaults,
    SymbolProbeKeys,
    SymbolInputKeys,
    SymbolToolTable,
    CommitBitKeys,
    LevelKeys,
    NoneKeys,
)
"""All keys of a map of symbols."""


class SymbolResolving(Resolving):
    """The places of a map of symbols."""

    _shared: SymbolToolTable | SymbolFlangeTable | None = None
    """The table that gives node and length to its components."""

    def _made(self, found: dict[str, Any]) -> SymbolMap:
        file = self._file
        return SymbolMap(
            **found,
            device_id=self._word("device_id", file.device_id),
            cycle_ms=file.cycle_ms or (0.0 if file.cycle_counter else CYCLE_MS),
            cycle_counter=self._word("cycle_counter", file.cycle_counter),
            change_counter=self._word("change_counter", file.change_counter),
        )

    def _slot(self, path: str, keys: SymbolToolTable) -> SymbolSlot:
        return SymbolSlot(
            keys.number,
            keys.name,
            self._components(path, keys),
            self._signal(f"{path}.defined", keys.defined),
            asked=self._file.commit.kind != "none",
        )

    def _components(
        self, path: str, keys: SymbolToolTable | SymbolFlangeTable
    ) -> dict[str, SymbolNumber]:
        self._shared = keys
        try:
            return super()._components(path, keys)
        finally:
            self._shared = None

    def _placed(
        self, path: str, keys: SymbolNumberKeys, kind: NumberType, factor: float
    ) -> SymbolNumber | None:
        found = self._cell(path, keys)
        return found and SymbolNumber(found.cell, kind, factor, found.length)

    def _signal(self, path: str, keys: SymbolSignalKeys | None) -> SymbolSignal | None:
        found = keys and self._cell(path, keys)
        if keys is None or not found:
            return None
        if keys.bit is not None and keys.on > 1:
            self._tell(f"{path}.on", tr("must be 0 or 1 for one bit"))
        return SymbolSignal(found.cell, keys.bit, keys.on, keys.off, found.length)

    def _word(self, path: str, keys: PlaceKeys | None) -> SymbolWord | None:
        found = keys and self._cell(path, keys)
        return SymbolWord(found.cell, found.length) if found else None

    def _cell(self, path: str, keys: PlaceKeys) -> "_Found | None":
        node, length, element = keys.node, keys.length, keys.element
        shared = self._shared
        if node is None and shared is not None:
            node, length = shared.node, length or shared.length
            element = shared.element if element is None else element
        if node is None:
            self._tell(f"{path}.node", tr("is missing: name the node"))
            return None
        self._check_length(path, element, length)
        steps = (*(() if element is None else (element,)), *self._field(path, keys.field))
        return _Found(
            SymbolCell(self._whole_name(path, node), steps), None if element is None else length
        )

    def _check_length(self, path: str, element: int | None, length: int | None) -> None:
        if element is None:
            if length is not None:
                self._tell(f"{path}.length", tr("is only for an element of an array"))
        elif length is None:
            self._tell(f"{path}.length", tr("is missing: how many elements the array has"))
        elif element >= length:
            self._tell(
                f"{path}.element",
                tr("must be less than {length}: elements count from 0", length=length),
            )

    def _field(self, path: str, name: str | None) -> tuple[Step, ...]:
        try:
            steps = () if name is None else steps_of(name)
        except ValueError:
            steps = (0,)
        if steps and isinstance(steps[0], int):
            self._tell(
                f"{path}.field", tr("must be the name of a field, such as rX or stTip.aValue[2]")
            )
        return steps

    def _whole_name(self, path: str, node: str) -> str:
        root = self._file.numbers.root
        named = node if _NODE.fullmatch(node) or root is None else root + node
        if not _NODE.fullmatch(named):
            self._tell(
                f"{path}.node",
                tr(
                    "must begin with ns=, i= or /, or root in [numbers] must: for example "
                    '"ns=4;s=|var|PLC.Application.GVL."'
                ),
            )
        return named


class _Found(NamedTuple):
    cell: SymbolCell
    length: int | None


class _Use(NamedTuple):
    """Something in the map and its cell; ``shared`` is what is only looked at."""

    where: str
    cell: SymbolCell
    shared: bool = False
    sort: tuple[int | None, int] | None = None

    def clashes(self, other: "_Use") -> bool:
        if self.cell.node != other.cell.node:
            return False
        depth = min(len(self.cell.steps), len(other.cell.steps))
        if self.cell.steps[:depth] != other.cell.steps[:depth]:
            return False
        return not (self.shared and other.shared and self.sort != other.sort)


def symbol_problems(found: SymbolMap) -> Iterator[Problem]:
    """Return errors between the places of a map of symbols."""
    lengths: dict[str, int | None] = {}
    for where, place in _places(found):
        if place.cell.steps and lengths.setdefault(place.cell.node, place.length) != place.length:
            yield Problem(where, tr("gives {node} another length", node=place.cell.node))
    yield from _requests(found)
    if found.probe is not None and not found.probe.value:
        yield Problem("probe.value", tr("must not be 0, which is what an unused variable holds"))
    for first, second in combinations(_uses(found), 2):
        if first.clashes(second):
            yield Problem(
                second.where,
                tr(
                    "is at the same place as {other}: {place}",
                    other=first.where,
                    place=second.cell.place,
                ),
            )


def _requests(found: SymbolMap) -> Iterator[Problem]:
    commit = found.commit
    if commit.request is not None:
        where = f"commit.{HANDSHAKE_KEYS[commit.kind][0]}"
        if not commit.request.writable:
            yield Problem(where, tr("must be a node of its own, because it is written alone"))
        elif commit.request.on == commit.request.off:
            yield Problem(where, tr("reads the same on and off"))
    if commit.tool_number is not None and commit.tool_number.cell.steps:
        yield Problem(
            "commit.tool_number", tr("must be a node of its own, because it is written alone")
        )


def _places(
    found: SymbolMap,
) -> Iterator[tuple[str, SymbolNumber | SymbolSignal | SymbolWord]]:
    """Yield all that the map names, each with the path of its key."""
    for position, slot in enumerate(found.slots.values(), start=1):
        for name, number in slot.components.items():
            yield f"tools#{position}.{name}", number
        if slot.defined is not None:
            yield f"tools#{position}.defined", slot.defined
    for name, number in found.flange.items():
        yield f"flange.{name}", number
    commit = found.commit
    asking, answering = HANDSHAKE_KEYS.get(commit.kind, ("", ""))
    named = (
        ("probe", None if found.probe is None else found.probe.number),
        ("device_id", found.device_id),
        (f"commit.{asking}", commit.request),
        (f"commit.{answering}", commit.answer),
        ("commit.busy", commit.busy),
        ("commit.error", commit.error),
        ("commit.error_code", commit.error_code),
        ("commit.tool_number", commit.tool_number),
        ("permit", found.permit),
        ("selected", found.selected),
        ("cycle_counter", found.cycle_counter),
        ("change_counter", found.change_counter),
    )
    yield from ((where, place) for where, place in named if place is not None)
    for position, one in enumerate(found.inputs.values(), start=1):
        yield f"inputs#{position}", one.signal


def _uses(found: SymbolMap) -> Iterator[_Use]:
    for where, place in _places(found):
        ours = place is found.commit.request or (
            where.endswith(".defined") and isinstance(place, SymbolSignal) and place.writable
        )
        looked_at = where == "commit.error_code" or (isinstance(place, SymbolSignal) and not ours)
        sort = (place.bit, place.on) if isinstance(place, SymbolSignal) else None
        yield _Use(where, place.cell, looked_at, sort)
