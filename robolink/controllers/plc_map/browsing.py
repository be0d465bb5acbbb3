"""What an OPC UA server has below a node, and the beginning of a map of it.

A server says names, types and lengths. It does not say units, which element of an array is X, or
how the program takes values over: a draft leaves that open and names it. It is no map before a
person has filled it in.
"""

import json
import re
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Final, Protocol

from robolink.controllers.plc_map.symbol_client import PartFacts, SymbolFacts
from robolink.errors import RejectedError
from robolink.messages import tr
from robolink.register_maps import COMPONENTS, MapDraft, NumberType, SymbolCell, component_of

MOST: Final = 2000
"""Largest number of nodes that one look takes."""

_STRUCTURE: Final = "Structure"
_TYPES: Final = {
    "Int16": NumberType.INT16,
    "UInt16": NumberType.UINT16,
    "Int32": NumberType.INT32,
    "UInt32": NumberType.UINT32,
    "Float": NumberType.REAL,
    "Double": NumberType.LREAL,
}
_OF_THE_STANDARD: Final = re.compile(r"(?:ns=0;)?[isgb]=")
"""Ids of the server's own nodes, which are no variables of a program."""


class BrowsingClient(Protocol):
    """What a look at a server needs of an OPC UA client."""

    @property
    def identity(self) -> str:
        """Which server this is."""

    def describe(self, node: str) -> SymbolFacts:
        """Return what the server says of a node."""

    def browse(self, node: str | None = None, *, most: int = 1000) -> Sequence[SymbolFacts]:
        """Return the nodes below one."""


@dataclass(frozen=True, slots=True)
class BrowsedNodes:
    """The variables below a node.

    Attributes:
        variables: In the order of the server, level by level.
        unopened: Ids of nodes below which nobody looked.
    """

    variables: tuple[SymbolFacts, ...]
    unopened: tuple[str, ...]


def browse_nodes(client: BrowsingClient, start: str, *, most: int = MOST) -> BrowsedNodes:
    """Return the variables below ``start``, and where the look stopped.

    Args:
        client: An open client.
        start: A node; ``/`` for all.
        most: How many nodes to look at.

    Raises:
        RejectedError, TransportError, RemoteProtocolError: As the client.

    Example:
        >>> from pathlib import Path
        >>> from robolink.controllers import browse_nodes, draft_from_nodes
        >>> from robolink.register_maps import load_symbol_map
        >>> from robolink.transport import open_opcua
        >>> from robolink_simulators.plc import PlcSimulator, serve_plc_opcua
        >>> from robolink_simulators.testkit.operator import written_symbol_map
        >>> path = written_symbol_map(Path.cwd())
        >>> with serve_plc_opcua(PlcSimulator(load_symbol_map(path)), path) as host:
        ...     client = open_opcua(host.url.partition("?")[0] + "?security=none")
        ...     found = browse_nodes(client, "/DeviceSet")
        ...     client.close()
        >>> found.variables[0].type_name, found.unopened
        ('Double[6]', ())
        >>> draft_from_nodes("dispenser", found).text.splitlines()[1]
        'name = "dispenser"'
    """
    variables: list[SymbolFacts] = []
    unopened: list[str] = []
    known: set[str] = set()
    waiting: deque[str | None] = deque([None])
    if start.strip("/"):
        own = client.describe(start)
        known.add(own.id)
        waiting = deque([own.id])
        if own.kind:
            variables.append(own)
            waiting = deque([own.id] if _is_open(own) else [])
    while waiting:
        node = waiting.popleft()
        room = most - len(known)
        try:
            below = client.browse(node, most=room + 1) if room > 0 else None
        except RejectedError:
            below = None
        if below is None or len(below) > room:
            unopened.append(node or "/")
        for one in (below or ())[:room]:
            if one.id in known or _OF_THE_STANDARD.match(one.id):
                continue
            known.add(one.id)
            if one.kind:
                variables.append(one)
            if _is_open(one):
                waiting.append(one.id)
    return BrowsedNodes(tuple(variables), tuple(unopened))


def _is_open(node: SymbolFacts) -> bool:
    """Whether there may be variables below: not below one whose parts are known."""
    return not node.kind or (node.kind == _STRUCTURE and not node.fields)


def draft_from_nodes(name: str, found: BrowsedNodes) -> MapDraft:
    """Return the beginning of a map of the tools among the variables of a server.

    Args:
        name: What the map calls the machine until a person gives it a name.
        found: What the server has.
    """
    draft = _Draft()
    for one in found.variables:
        draft.add(one)
    notes = []
    if found.unopened:
        notes.append(
            tr(
                "robolink looked at no more than {most} nodes. Not opened: {nodes}. Begin again at "
                "one of them.",
                most=MOST,
                nodes=_printable(", ".join(found.unopened)),
            )
        )
    if draft.from_first:
        notes.append(tr("The first element of an array of structures is taken for tool 1."))
    text = "\n".join(_lines(name, draft, [*notes, *draft.bad])) + "\n"
    left = tuple(one.id for one in draft.left)
    return MapDraft(text, draft.found, left, tuple(draft.bad), tuple(notes))


class _Draft:
    """The tools that names tell of, and all other variables."""

    def __init__(self) -> None:
        self.tools: dict[int, dict[str, tuple[SymbolCell, NumberType, int | None, str]]] = {}
        self.arrays: dict[int, SymbolFacts] = {}
        self.left: list[SymbolFacts] = []
        self.bad: list[str] = []
        self.from_first = False

    @property
    def found(self) -> int:
        """How many components were recognised."""
        return sum(len(components) for components in self.tools.values())

    def add(self, node: SymbolFacts) -> None:
        """Take a variable for a tool, a component of one, or something else."""
        array = component_of(f"{node.name}.x")
        if array is not None and node.kind in _TYPES and len(node.lengths) == 1:
            self.arrays[array.tool] = node
            return
        taken = [self._takes(node, *part) for part in _parts(node)]
        if not any(taken):
            self.left.append(node)

    def _takes(self, node: SymbolFacts, cell: SymbolCell, part: PartFacts, name: str) -> bool:
        known = component_of(name)
        if known is None or part.kind not in _TYPES or part.lengths:
            return False
        components = self.tools.setdefault(known.tool, {})
        if known.axis in components:
            self.bad.append(
                tr(
                    "{place}: {axis} of tool {tool} is in an earlier line already",
                    place=_printable(cell.place),
                    axis=known.axis.upper(),
                    tool=known.tool,
                )
            )
            return False
        self.from_first |= len(cell.steps) > 1
        length = node.lengths[0] if node.lengths else None
        components[known.axis] = (cell, _TYPES[part.kind], length, known.unit)
        return True


def _parts(node: SymbolFacts) -> list[tuple[SymbolCell, PartFacts, str]]:
    """Return what in a variable may be a component: itself, its fields, those of its elements."""
    if node.kind != _STRUCTURE:
        return [(SymbolCell(node.id), node, node.name)]
    if not node.lengths:
        return [
            (SymbolCell(node.id, (one.name,)), one, f"{node.name}.{one.name}")
            for one in node.fields
        ]
    if len(node.lengths) > 1:
        return []
    return [
        (SymbolCell(node.id, (at, one.name)), one, f"{node.name}[{at + 1}].{one.name}")
        for at in range(node.lengths[0])
        for one in node.fields
    ]


def _lines(name: str, draft: _Draft, remarks: Sequence[str]) -> Iterator[str]:
    cells = [part for components in draft.tools.values() for part in components.values()]
    nodes = [cell.node for cell, *_ in cells] + [node.id for node in draft.arrays.values()]
    root = _root(nodes or [node.id for node in draft.left])
    common = Counter(kind for _, kind, *_ in cells).most_common(1)
    for remark in remarks:
        yield f"# {_printable(remark)}"
    yield 'schema = "robolink/plc-map/1"'
    yield f"name = {_quoted(name)}"
    yield "# cycle_ms = 100                 # no change of values that belong together takes longer"
    yield ""
    yield "[numbers]"
    yield f"{'' if root else '# '}root = {_quoted(root)}"
    yield f"type = {_quoted(common[0][0])}" if common else '# type = "LREAL"'
    yield '# length_unit = "mm"             # the server does not say: ask the PLC\'s programmer'
    yield '# angle_unit = "deg"'
    for tool in sorted({*draft.tools, *draft.arrays}):
        yield from _tool(tool, draft, root, common[0][0] if common else None)
    yield ""
    yield "# How does the PLC take new values over? docs/plc-maps.md explains the three ways."
    yield "# [commit]"
    yield '# kind = "commit_bit"'
    yield '# trigger = { node = "xTrigger" }'
    yield '# done = { node = "xDone" }'
    if draft.left:
        yield ""
        yield "# At the server, and not used yet:"
        for one in draft.left:
            yield f"#   {_printable(one.id)}: {_printable(one.type_name)}"


def _tool(tool: int, draft: _Draft, root: str, common: NumberType | None) -> Iterator[str]:
    yield ""
    yield "[[tools]]"
    yield f"number = {tool}"
    components = draft.tools.get(tool, {})
    array = draft.arrays.get(tool)
    shared = _shared(components)
    if array is not None and not components:
        yield f"node = {_quoted(array.id.removeprefix(root))}"
        yield f"length = {array.lengths[0]}"
        yield "# Which element is which component? The server does not say."
        kind = _TYPES[array.kind]
        typed = "" if kind is common else f", type = {_quoted(kind)}"
        for at, name in enumerate(COMPONENTS[: array.lengths[0]]):
            yield f"# {name} = {{ element = {at}{typed} }}"
        return
    if shared is not None:
        cell, length = shared
        yield f"node = {_quoted(cell.node.removeprefix(root))}"
        if cell.steps:
            yield f"element = {cell.steps[0]}"
            yield f"length = {length}"
    for name in COMPONENTS:
        if name in components:
            cell, kind, length, unit = components[name]
            parts = []
            if shared is None:
                parts.append(f"node = {_quoted(cell.node.removeprefix(root))}")
                if length is not None:
                    parts += [f"element = {cell.steps[0]}", f"length = {length}"]
            if cell.steps:
                parts.append(f"field = {_quoted(str(cell.steps[-1]))}")
            parts += [] if kind is common else [f"type = {_quoted(kind)}"]
            parts += [f"unit = {_quoted(unit)}"] if unit else []
            yield f"{name} = {{ {', '.join(parts)} }}"


def _shared(
    components: Mapping[str, tuple[SymbolCell, NumberType, int | None, str]],
) -> tuple[SymbolCell, int | None] | None:
    """Return the structure that holds all components of a tool, ``None`` where none does."""
    holders = {
        (SymbolCell(cell.node, cell.steps[:-1]), length)
        for cell, _, length, _ in components.values()
        if cell.steps
    }
    whole = all(cell.steps for cell, *_ in components.values())
    return next(iter(holders)) if whole and len(holders) == 1 else None


def _root(nodes: Sequence[str]) -> str:
    """Return what all ids begin with, up to a dot of their names."""
    names = [node.split(".")[:-1] for node in nodes]
    alike = takewhile(lambda parts: len(set(parts)) == 1, zip(*names, strict=False))
    root = "".join(f"{parts[0]}." for parts in alike)
    return root if ";" in root else ""


def _quoted(text: str) -> str:
    return json.dumps(str(text), ensure_ascii=not text.isprintable())


def _printable(text: str) -> str:
    """Return a server's name without what would move or turn the text of a terminal."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
