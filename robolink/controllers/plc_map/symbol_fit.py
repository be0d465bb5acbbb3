"""Whether the nodes of a server are those of a map: each is there, once, and of its type."""

from collections.abc import Iterator
from typing import Final

from robolink.controllers.plc_map.symbol_client import (
    BITS,
    STRUCTURE,
    PartFacts,
    SymbolClient,
    part_at,
)
from robolink.errors import RejectedError
from robolink.messages import tr
from robolink.register_maps import (
    NumberType,
    SymbolMap,
    SymbolNumber,
    SymbolSignal,
    SymbolWord,
)

_KINDS: Final = {
    NumberType.INT16: "Int16",
    NumberType.UINT16: "UInt16",
    NumberType.INT32: "Int32",
    NumberType.UINT32: "UInt32",
    NumberType.REAL: "Float",
    NumberType.LREAL: "Double",
}
_KEPT: Final = frozenset({"Boolean", "String", "Float", "Double"})
"""Kinds besides whole numbers that are written back as they were read, to the last bit."""

_UNKNOWN: Final = frozenset({0, 0x80330000, 0x80340000})
"""Codes of a refusal when the server has no such node: none, BadNodeIdInvalid, BadNodeIdUnknown."""


def misfits(client: SymbolClient, symbol_map: SymbolMap) -> Iterator[tuple[str, str]]:
    """Yield each place of the map at which the server has something else."""
    for number in _numbers(symbol_map):
        yield from _misfit(client, number, (_KINDS[number.type],))
    for signal in _signals(symbol_map):
        whole = signal.bit is not None or {signal.on, signal.off} - {0, 1}
        yield from _misfit(client, signal, (*BITS, *(() if whole else ("Boolean",))))
    for word in _words(symbol_map):
        yield from _misfit(client, word, tuple(BITS))
    yield from _doubles(client, symbol_map)


def _doubles(client: SymbolClient, symbol_map: SymbolMap) -> Iterator[tuple[str, str]]:
    """Yield each node that has two names in the map, where one place would be two."""
    names: dict[str, str] = {}
    nodes = (
        *(number.cell.node for number in _numbers(symbol_map)),
        *(signal.cell.node for signal in _signals(symbol_map)),
        *(word.cell.node for word in _words(symbol_map)),
    )
    for node in nodes:
        try:
            first = names.setdefault(client.describe(node).id, node)
        except RejectedError:  # told already
            continue
        if first != node:
            yield node, tr("it is the same node as {other}", other=first)


def _misfit(
    client: SymbolClient, place: SymbolNumber | SymbolSignal | SymbolWord, kinds: tuple[str, ...]
) -> Iterator[tuple[str, str]]:
    node, steps = place.cell
    try:
        facts = client.describe(node)
    except RejectedError as error:
        if error.code not in _UNKNOWN:  # it is there; that it cannot be read is no misfit
            raise
        yield place.place, error.what
        return
    if not facts.readable:
        yield place.place, tr("it cannot be read")
        return
    if place.length is not None and facts.lengths != (place.length,):
        yield (
            place.place,
            tr(
                "the server has {type}, the map an array of {length}",
                type=facts.type_name,
                length=place.length,
            ),
        )
        return
    if facts.kind == STRUCTURE and not facts.fields:
        yield place.place, tr("the server does not define this structure")
        return
    own = part_at(facts, steps)
    if own is None or own.lengths or own.kind not in kinds:
        yield (
            place.place,
            tr(
                "the server has {type}, the map {wanted}",
                type=facts.type_name if own is None else own.type_name,
                wanted=tr("one of {kinds}", kinds=", ".join(kinds)) if len(kinds) > 1 else kinds[0],
            ),
        )


def kinds_not_kept(facts: PartFacts) -> Iterator[str]:
    """Yield the kinds of values in a node that are not written as they were read."""
    if facts.kind == STRUCTURE:
        for one in facts.fields:
            yield from kinds_not_kept(one)
    elif facts.kind not in _KEPT and facts.kind not in BITS:
        yield facts.kind


def _numbers(symbol_map: SymbolMap) -> Iterator[SymbolNumber]:
    for slot in symbol_map.slots.values():
        yield from slot.components.values()
    yield from symbol_map.flange.values()
    if symbol_map.probe is not None:
        yield symbol_map.probe.number


def _signals(symbol_map: SymbolMap) -> Iterator[SymbolSignal]:
    commit = symbol_map.commit
    named = [
        *(commit.request, commit.answer, commit.busy, commit.error, symbol_map.permit),
        *(slot.defined for slot in symbol_map.slots.values()),
        *(one.signal for one in symbol_map.inputs.values()),
    ]
    yield from (signal for signal in named if signal is not None)


def _words(symbol_map: SymbolMap) -> Iterator[SymbolWord]:
    commit = symbol_map.commit
    named = (
        *(commit.error_code, commit.tool_number, symbol_map.selected, symbol_map.device_id),
        *(symbol_map.cycle_counter, symbol_map.change_counter),
    )
    yield from (word for word in named if word is not None)
