"""Nodes of an OPC UA server as the places of a map: read and written whole, never in part.

A server answers each node of a request at its own instant, and may answer an array while the
program writes it (docs/reference/symbol-maps.md). So a value counts after two equal readings
between which the program had a whole cycle: by its own count of cycles where the map names one,
and after the time that the map states, each where the map has it. The time of the server proves no
cycle: it runs in a stopped PLC.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from typing import Any, Final, NamedTuple

from robolink.controllers.plc_map.places import TRIES, Places
from robolink.controllers.plc_map.symbol_client import SymbolClient, bits_at
from robolink.controllers.plc_map.symbol_fit import kinds_not_kept, misfits
from robolink.errors import ConfigError, RejectedError, RemoteProtocolError, ToolError
from robolink.messages import listed, tr
from robolink.register_maps import (
    Cells,
    MapProbe,
    Step,
    SymbolCell,
    SymbolMap,
    SymbolNumber,
    SymbolSignal,
    SymbolSlot,
    SymbolWord,
    steps_in_words,
)
from robolink.stop_latch import CommandClass
from robolink.timing import Deadline

_POLL_S: Final = 0.005
_CYCLES: Final = 2
"""By how much a count of cycles has to rise so that one whole cycle lies between two readings."""
_STILL_S: Final = 1.0
"""How long a count of cycles may stand still before the program counts as stopped; ten cycles where
those take longer."""


class _Reading(NamedTuple):
    """Values of one request, and the counts of the program around them."""

    values: dict[str, Any]
    change: int
    began: int
    ended: int


class Symbols(Places):
    """The nodes of one PLC; see :class:`~robolink.controllers.plc_map.places.Places`."""

    def __init__(self, client: SymbolClient, symbol_map: SymbolMap) -> None:
        super().__init__(client.identity, client.place, client.clock)
        self._client = client
        self._map = symbol_map
        self._fits = False

    def require_fit(self) -> None:
        """See :meth:`Places.require_fit`: each node is there and has the type of the map."""
        if self._fits:
            return
        if wrong := [f"{where}: {why}" for where, why in misfits(self._client, self._map)]:
            raise RemoteProtocolError(
                listed(
                    tr("The nodes of {identity} are not those of the map:", identity=self.identity),
                    wrong,
                ),
                remedy=tr(
                    "'robolink expert plc check-map' also lists what the server has. Correct the "
                    "map, or the program, then compare the values again."
                ),
            )
        self._fits = True

    def once(self, components: Mapping[str, SymbolNumber]) -> Cells:
        """See :meth:`Places.once`."""
        return self._cells(components, self._read(_nodes(components)))

    def stable(self, components: Mapping[str, SymbolNumber]) -> Cells:
        """See :meth:`Places.stable`; what the map does not name may change."""
        found = self._settled(
            _nodes(components), lambda values: list(self._cells(components, values).values())
        )
        return self._cells(components, found)

    def word(self, word: SymbolWord) -> int:
        """See :meth:`Places.word`."""
        return _whole(word, self._ask([word.cell.node])[0])

    def is_on(self, signal: SymbolSignal | None) -> bool:
        """See :meth:`Places.is_on`."""
        if signal is None:
            return False
        value = _pick(self._ask([signal.cell.node])[0], signal.cell)
        if not isinstance(value, int):
            raise _no_whole_number(signal.cell, value)
        if signal.bit is not None:
            value = value >> signal.bit & 1
        return value == signal.on

    def switch(
        self, signal: SymbolSignal, on: bool, *, kind: CommandClass = CommandClass.WRITE
    ) -> None:
        """See :meth:`Places.switch`."""
        value = signal.on if on else signal.off
        own = bool(value) if self._client.describe(signal.cell.node).kind == "Boolean" else value
        self._send(signal.cell.node, own, kind)

    def tell(self, word: SymbolWord, value: int) -> None:
        """See :meth:`Places.tell`."""
        self._send(word.cell.node, value, CommandClass.WRITE)

    def write(self, cells: Cells) -> None:
        """See :meth:`Places.write`: each node whole, in one request.

        What the map does not name in it is written as it was read in the request before. Should it
        read otherwise afterwards, somebody else writes there.

        Raises:
            RejectedError: Somebody else does, or what is beside the tool does not rest.
        """
        nodes = [node for node in _by_node(cells) if not _is_single(cells, node)]
        before = self._before_write(nodes) if nodes else {}
        sent = {node: _with(before.get(node), parts) for node, parts in _by_node(cells).items()}
        for node, value in sent.items():
            self._send(node, value, CommandClass.WRITE)
        if not nodes:
            return
        after = self._settled(nodes, lambda values: values)
        for node in nodes:
            if not _same(_with(after[node], _by_node(cells)[node]), sent[node]):
                raise RejectedError(
                    tr("{node} changed elsewhere while it was written.", node=node),
                    remedy=tr(
                        "robolink writes it whole. Let the program keep what it changes itself "
                        "in another variable."
                    ),
                )

    def write_requests(self, cells: Cells) -> tuple[str, ...]:
        """See :meth:`Places.write_requests`."""
        return tuple(
            tr("write {place}: {values}", place=node, values=_in_words(parts))
            for node, parts in _by_node(cells).items()
        )

    def require_writable(self, slot: SymbolSlot) -> None:
        """See :meth:`Places.require_writable`."""
        if not slot.writable:
            raise ToolError(
                tr(
                    "Tool {tool} is in {count} nodes and the map has no handshake: robolink only "
                    "reads it.",
                    tool=slot.tool,
                    count=len(slot.nodes),
                ),
                remedy=tr(
                    "Nothing was sent. Let the PLC take values over on a signal, or keep them in "
                    "one array or structure."
                ),
            )
        commit = self._map.commit
        written = [*slot.nodes]
        for own in (slot.defined, commit.request):
            written += [own.cell.node] if own is not None and own.writable else []
        written += [commit.tool_number.cell.node] if commit.tool_number is not None else []
        for node in written:
            self._client.require_writable(node)
            if lost := sorted(set(kinds_not_kept(self._client.describe(node)))):
                raise ToolError(
                    tr(
                        "{node} holds {kinds}, which robolink cannot write back unchanged.",
                        node=node,
                        kinds=", ".join(lost),
                    ),
                    remedy=tr(
                        "Nothing was sent. Keep the tool's numbers in a variable without them."
                    ),
                )

    def own_number(self) -> str | None:
        """See :meth:`Places.own_number`."""
        word = self._map.device_id
        if word is None:
            return None
        number = self.word(word)
        for _ in range(TRIES):
            before, number = number, self.word(word)
            if number == before:
                break
        else:
            raise self._restless(word.place)
        if not number:
            return ""
        bits = bits_at(self._client, word)
        return f"{number % (1 << bits):0{bits // 4}X}"

    def diagnosis(self, probe: MapProbe[SymbolNumber]) -> str:
        """See :meth:`Places.diagnosis`."""
        return tr(
            "Is this the machine of the map? Compare {place} with the PLC's program.",
            place=probe.number.place,
        )

    def close(self) -> None:
        """See :meth:`Places.close`."""
        self._client.close()
        self.gate.close()

    def _before_write(self, nodes: Sequence[str]) -> dict[str, Any]:
        """Return whole values that rest; where they do not, nothing was sent."""
        try:
            return self._settled(nodes, lambda values: values)
        except RemoteProtocolError as error:
            raise RejectedError(
                error.what,
                remedy=tr(
                    "Nothing was written. robolink writes {nodes} whole: let the program keep what "
                    "it changes itself in another variable.",
                    nodes=", ".join(nodes),
                ),
            ) from error

    def _settled(
        self, nodes: Sequence[str], part: Callable[[dict[str, Any]], object]
    ) -> dict[str, Any]:
        """Return values of which ``part`` was the same in two readings, a cycle apart."""
        found = self._reading(nodes)
        for _ in range(TRIES):
            before, found = found, self._reading_of_next_cycle(found, nodes)
            same = _same(part(before.values), part(found.values))
            if same and before.change == found.change:
                return found.values
        raise self._restless(", ".join(nodes))

    def _reading_of_next_cycle(self, before: _Reading, nodes: Sequence[str]) -> _Reading:
        counter = self._map.cycle_counter
        cycle_s = self._map.cycle_ms / 1000
        self.clock.sleep(max(_POLL_S, cycle_s))
        if counter is None:
            return self._reading(nodes)
        span = 1 << bits_at(self._client, counter)
        deadline = Deadline.after(self.clock, max(_STILL_S, 10 * cycle_s))
        while True:
            found = self._reading(nodes)
            if (found.began - before.ended) % span >= _CYCLES:
                return found
            if deadline.expired:
                raise RemoteProtocolError(
                    tr("{place} stands still: it counts no cycles.", place=counter.place),
                    remedy=tr(
                        "Check that the PLC's program runs. Values of a program that stands still "
                        "do not count."
                    ),
                )
            self.clock.sleep(_POLL_S)

    def _reading(self, nodes: Sequence[str]) -> _Reading:
        """Read nodes in one request, and in it the counts: of cycles before and behind them."""
        cycle, change = self._map.cycle_counter, self._map.change_counter
        first = [cycle.cell.node] if cycle else []
        last = [word.cell.node for word in (change, cycle) if word]
        found = self._ask([*first, *nodes, *last])
        values = dict(zip(nodes, found[len(first) :], strict=False))
        return _Reading(
            values,
            change=_whole(change, found[len(first) + len(nodes)]) if change else 0,
            began=_whole(cycle, found[0]) if cycle else 0,
            ended=_whole(cycle, found[-1]) if cycle else 0,
        )

    def _read(self, nodes: Sequence[str]) -> dict[str, Any]:
        return dict(zip(nodes, self._ask(nodes), strict=True))

    def _ask(self, nodes: Sequence[str]) -> tuple[Any, ...]:
        with self.gate:
            self.exchanges += 1
            sent_ns = self.clock.now_ns()
            found = self._client.read(nodes)
            self.answers.answered(sent_ns)
        return found

    def _send(self, node: str, value: object, kind: CommandClass) -> None:
        with self._admitted(node, kind):
            self.exchanges += 1
            try:
                self._client.write(node, value)
            except ConfigError as error:  # nothing was asked of the server
                raise RejectedError(error.what, remedy=error.remedy) from error

    def _cells(self, components: Mapping[str, SymbolNumber], values: Mapping[str, Any]) -> Cells:
        found: Cells = {}
        for number in components.values():
            value = _pick(values[number.cell.node], number.cell)
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise RemoteProtocolError(
                    tr("{place} holds no number: {value!r}.", place=number.place, value=value),
                    remedy=tr("Compare the map with the PLC's program."),
                )
            found[number.cell] = value
        return found

    def _restless(self, place: str) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr("{place} changes at every reading.", place=place),
            remedy=tr(
                "Read it while the program leaves it alone. If the program needs several cycles to "
                "change it, state their time as cycle_ms in the map."
            ),
        )


def _nodes(components: Mapping[str, SymbolNumber]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(number.cell.node for number in components.values()))


def _by_node(cells: Cells) -> dict[str, dict[tuple[Step, ...], float]]:
    found: dict[str, dict[tuple[Step, ...], float]] = {}
    for cell, value in cells.items():
        found.setdefault(cell.node, {})[cell.steps] = value
    return found


def _is_single(cells: Cells, node: str) -> bool:
    """Whether a node holds one number of the map and nothing else."""
    return SymbolCell(node) in cells


def _in_words(parts: Mapping[tuple[Step, ...], float]) -> str:
    return " ".join(
        f"{steps_in_words(steps)}={value!r}" if steps else repr(value)
        for steps, value in parts.items()
    )


def _pick(value: Any, cell: SymbolCell) -> Any:  # noqa: ANN401 - of any type
    """Return a part of a value.

    Raises:
        RemoteProtocolError: It has no such part.
    """
    for step in cell.steps:
        try:
            value = value[step]
        except (LookupError, TypeError) as error:
            raise RemoteProtocolError(
                tr("The server gave a value without {place}.", place=cell.place),
                remedy=tr("Compare the map with the PLC's program."),
            ) from error
    return value


def _with(value: Any, parts: Mapping[tuple[Step, ...], float]) -> Any:  # noqa: ANN401 - as above
    """Return a copy of a value with other parts; a part without steps is all of it."""
    made = deepcopy(value)
    for steps, part in parts.items():
        if not steps:
            return part
        inner = made
        for step in steps[:-1]:
            inner = inner[step]
        inner[steps[-1]] = part
    return made


def _same(a: Any, b: Any) -> bool:  # noqa: ANN401 - as above
    """Whether two values are alike to the last bit that counts: NaN is like NaN here."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(_same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a):
        return math.isnan(b)
    return bool(a == b)


def _whole(word: SymbolWord, value: Any) -> int:  # noqa: ANN401 - as above
    found = _pick(value, word.cell)
    if isinstance(found, bool) or not isinstance(found, int):
        raise _no_whole_number(word.cell, found)
    return found


def _no_whole_number(cell: SymbolCell, value: object) -> RemoteProtocolError:
    return RemoteProtocolError(
        tr("{place} holds no whole number: {value!r}.", place=cell.place, value=value),
        remedy=tr("Compare the map with the PLC's program."),
    )
