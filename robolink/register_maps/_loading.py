"""From a file to a map, or to all its errors.

What no key says alone: that places do not overlap and can be read and written as needed.
"""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import ConfigError
from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink.register_maps._map import (
    LAST_ADDRESS,
    MapSlot,
    Number,
    RegisterMap,
    RegisterTable,
    Signal,
    Word,
    describe_place,
    span_of,
)
from robolink.register_maps._places import CommitKind
from robolink.register_maps._symbols import SymbolMap

if TYPE_CHECKING:
    from pydantic import ValidationError

    from robolink.register_maps._symbol_tables import SymbolFile
    from robolink.register_maps._tables import MapFile

MAP_FILE: Final = FileKind(
    named=lambda path: tr("The PLC map {path}", path=path),
    unreadable_remedy=lambda: tr("Nothing was sent. Give a map file; docs/plc-maps.md shows one."),
    wrong_remedy=lambda: tr("Nothing was sent. Correct it; docs/plc-maps.md explains every key."),
)


def load_plc_map(path: Path) -> RegisterMap | SymbolMap:
    """Return the map in a file, of registers or of symbols.

    Raises:
        ConfigError: It cannot be read, is no TOML, or is wrong; every problem is told with
            its path.
    """
    plc_map, problems = _checked(path)
    if plc_map is None or problems:
        raise MAP_FILE.refusal(path, problems)
    return plc_map


def load_map(path: Path) -> RegisterMap:
    """Return the map of registers in a file.

    Raises:
        ConfigError: As :func:`load_plc_map`, or it is a map of symbols.
    """
    found = load_plc_map(path)
    if isinstance(found, RegisterMap):
        return found
    raise ConfigError(
        tr("{map} names symbols, not registers.", map=MAP_FILE.named(path)),
        remedy=_which_link(),
    )


def load_symbol_map(path: Path) -> SymbolMap:
    """Return the map of symbols in a file.

    Raises:
        ConfigError: As :func:`load_plc_map`, or it is a map of registers.
    """
    found = load_plc_map(path)
    if isinstance(found, SymbolMap):
        return found
    raise ConfigError(
        tr("{map} names registers, not symbols.", map=MAP_FILE.named(path)),
        remedy=_which_link(),
    )


def _which_link() -> str:
    return tr(
        "A map of registers goes with plc+modbus-tcp://HOST or plc+modbus-rtu:///DEVICE, one of "
        "symbols with plc+opcua://HOST:4840."
    )


def check_map(path: Path) -> tuple[Problem, ...]:
    """Return all errors in a map; none if it is right.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    return tuple(_checked(path)[1])


def _checked(path: Path) -> tuple[RegisterMap | SymbolMap | None, list[Problem]]:
    content = MAP_FILE.read(path)
    document = MAP_FILE.parse(path, content)
    registers, symbols = _keys_in(document, _OF_REGISTERS), _keys_in(document, _OF_SYMBOLS)
    if registers and symbols:
        mixed = tr(
            "names a register ({register}) and a symbol ({symbol}): a map is of registers or of "
            "symbols",
            register=registers[0],
            symbol=symbols[0],
        )
        return None, [Problem("", mixed)]
    sha256 = hashlib.sha256(content).hexdigest()
    return _of_symbols(document, sha256) if symbols else _of_registers(document, sha256)


_OF_REGISTERS: Final = frozenset({"address", "table", "word_order", "byte_order"})
_OF_SYMBOLS: Final = frozenset({"node", "root", "element", "field", "cycle_ms"})
"""Keys that tell of which kind of place a map is."""


def _keys_in(document: object, keys: frozenset[str], path: str = "") -> list[str]:
    """Return the paths at which one of ``keys`` stands, as problems name them."""
    if isinstance(document, Mapping):
        found = []
        for key, value in document.items():
            here = f"{path}.{key}" if path else str(key)
            found += [here] if key in keys else _keys_in(value, keys, here)
        return found
    if isinstance(document, list):
        parts = (_keys_in(one, keys, f"{path}#{at}") for at, one in enumerate(document, start=1))
        return [found for part in parts for found in part]
    return []


def _of_registers(document: object, sha256: str) -> tuple[RegisterMap | None, list[Problem]]:
    from pydantic import ValidationError

    from robolink.register_maps._tables import KEYS, MapFile, RegisterResolving

    try:
        file = MapFile.model_validate(document)
    except ValidationError as error:
        return None, problems_of(error, KEYS)
    resolving = RegisterResolving(file)
    found = resolving.resolve(sha256)
    if not isinstance(found, RegisterMap):
        return None, resolving.problems
    return found, problems_together(file, found)


def _of_symbols(document: object, sha256: str) -> tuple[SymbolMap | None, list[Problem]]:
    from pydantic import ValidationError

    from robolink.register_maps._symbol_tables import (
        SYMBOL_KEYS,
        SymbolFile,
        SymbolResolving,
        symbol_problems,
    )

    try:
        file = SymbolFile.model_validate(document)
    except ValidationError as error:
        return None, problems_of(error, SYMBOL_KEYS)
    resolving = SymbolResolving(file)
    found = resolving.resolve(sha256)
    if not isinstance(found, SymbolMap):
        return None, resolving.problems
    return found, [*_twice(file), *symbol_problems(found)]


_COMMIT_DEPTH: Final = 2
"""Length of a pydantic location beyond which it contains the kind of commit."""


def problems_of(error: "ValidationError", keys: Sequence[str]) -> list[Problem]:
    """Return everything that pydantic reports; one of ``keys`` is suggested for an unknown one."""
    return [
        Problem(_path(detail["loc"]), _sentence(detail, keys))
        for detail in error.errors(include_url=False, include_input=False)
    ]


def _path(location: Sequence[int | str]) -> str:
    steps = list(location)
    if len(steps) > _COMMIT_DEPTH and steps[0] == "commit":
        del steps[1]  # the kind of commit, which pydantic inserts and no file contains
    path = ""
    for step in steps:
        joint = "." if path else ""
        path += f"#{step + 1}" if isinstance(step, int) else f"{joint}{step}"
    return path


def _sentence(detail: Any, keys: Sequence[str]) -> str:  # noqa: ANN401 - pydantic's own form
    match detail["type"]:
        case "extra_forbidden":
            return is_not_known(str(detail["loc"][-1]), keys)
        case "union_tag_invalid" | "union_tag_not_found":
            return tr("needs a kind: {kinds}", kinds="commit_bit, level, none")
        case "list_type":
            return tr("must be a list of tables")
        case "too_short":
            return tr("must not be empty")
        case "missing":
            return _missing(detail["loc"]) or sentence(detail)
    return sentence(detail)


def _missing(location: Sequence[int | str]) -> str:
    """Return what to write for a missing table; empty for a key of a table."""
    match tuple(location):
        case ("schema",):
            return tr('is missing: begin the file with schema = "robolink/plc-map/1"')
        case ("tools",):
            return tr("is missing: write one [[tools]] table for each tool")
        case ("commit",):
            return tr(
                "is missing: write in [commit] how the PLC takes new values over: kind = "
                '"commit_bit", "level" or "none"'
            )
    return ""


_MOST_READ: Final = 125
"""Largest number of registers in one read request (docs/reference/softmotion.md 4.3)."""


@dataclass(frozen=True, slots=True)
class _Claim:
    """A place in use by something in the map.

    ``shared`` tells whether it is only looked at, and leaves room for others that are.
    """

    where: str
    table: RegisterTable
    addresses: range
    bit: int | None = None
    on: int | None = None
    shared: bool = False

    def clashes(self, other: "_Claim") -> bool:
        if self.table is not other.table or not _overlap(self.addresses, other.addresses):
            return False
        if not (self.shared and other.shared):
            return True
        return (self.bit, self.on) == (other.bit, other.on)


def problems_together(file: "MapFile", found: RegisterMap) -> list[Problem]:
    """Return errors between the places of a map."""
    return [
        *_twice(file),
        *(
            problem
            for slot in enumerate(found.slots.values(), 1)
            for problem in _slot(*slot, found)
        ),
        *_unreadable("flange", found.flange),
        *_signals(found),
        *_probe(found),
        *_places(found),
    ]


def _twice(file: "MapFile | SymbolFile") -> Iterator[Problem]:
    numbered = (
        ("tools", [t.number for t in file.tools]),
        ("inputs", [i.number for i in file.inputs]),
    )
    for key, numbers in numbered:
        for position, number in enumerate(numbers, start=1):
            if number in numbers[: position - 1]:
                what = tr("{number} is given twice", number=number)
                yield Problem(f"{key}#{position}.number", what)


def _slot(position: int, slot: MapSlot, found: RegisterMap) -> Iterator[Problem]:
    where = f"tools#{position}"
    unreadable = list(_unreadable(where, slot.components))
    if unreadable:
        yield from unreadable
    elif found.commit.kind is CommitKind.NONE and slot.table.writable and not slot.contiguous:
        yield Problem(
            where,
            tr(
                "has gaps between its registers: without a handshake they must follow one another, "
                "so that one request writes them all"
            ),
        )


def _unreadable(where: str, components: Mapping[str, Number]) -> Iterator[Problem]:
    """Check that one request reads all components."""
    if len({number.table for number in components.values()}) > 1:
        yield Problem(where, tr("has components in two tables; one request must read them all"))
    elif components and len(span_of(components)) > _MOST_READ:
        yield Problem(
            where,
            tr(
                "stretches over {count} registers; one request reads at most {most}",
                count=len(span_of(components)),
                most=_MOST_READ,
            ),
        )


def _signals(found: RegisterMap) -> Iterator[Problem]:
    for where, signal in _all_signals(found):
        if signal.table.holds_bits and (signal.bit is not None or {signal.on, signal.off} - {0, 1}):
            yield Problem(where, tr("is a single bit: take bit out, and let on be 0 or 1"))
        elif signal.bit is not None and signal.on > 1:
            yield Problem(f"{where}.on", tr("must be 0 or 1 for one bit of a register"))
    request = found.commit.request
    if request is None:
        return
    where = "commit.trigger" if found.commit.kind is CommitKind.COMMIT_BIT else "commit.request"
    if not request.writable:
        yield Problem(
            where,
            tr(
                "must be a coil or a whole holding register: one bit of a register cannot be "
                "written without the bits beside it"
            ),
        )
    elif request.on == request.off:
        yield Problem(where, tr("reads the same on and off"))
    number = found.commit.tool_number
    if number is not None and not number.table.writable:
        yield Problem("commit.tool_number", tr("must be a holding register"))


def _probe(found: RegisterMap) -> Iterator[Problem]:
    if found.probe is None:
        return
    try:
        words = found.probe.number.encode(found.probe.value)
    except OverflowError:
        words = ()
    if len(set(words)) < len(words) or not any(words):
        yield Problem(
            "probe.value",
            tr(
                "does not show the word order: use a number whose words all differ, for example "
                "12.3456"
            ),
        )


def _places(found: RegisterMap) -> Iterator[Problem]:
    claims = list(_claims(found))
    for claim in claims:
        if claim.addresses.stop - 1 > LAST_ADDRESS:
            yield Problem(claim.where, tr("ends beyond address {last}", last=LAST_ADDRESS))
    for first, second in combinations(claims, 2):
        if first.clashes(second):
            address = max(first.addresses.start, second.addresses.start)
            yield Problem(
                second.where,
                tr(
                    "overlaps {other} at {place}",
                    other=first.where,
                    place=describe_place(second.table, address),
                ),
            )


def _claims(found: RegisterMap) -> Iterator[_Claim]:
    for position, slot in enumerate(found.slots.values(), start=1):
        for name, number in slot.components.items():
            yield _of_number(f"tools#{position}.{name}", number)
    for name, number in found.flange.items():
        yield _of_number(f"flange.{name}", number)
    if found.probe is not None:
        yield _of_number("probe", found.probe.number)
    if found.device_id is not None:
        yield _Claim("device_id", found.device_id.table, found.device_id.registers)
    for where, signal in _all_signals(found):
        ours = signal is found.commit.request or (where.endswith(".defined") and signal.writable)
        yield _Claim(
            where,
            signal.table,
            range(signal.address, signal.address + 1),
            signal.bit,
            signal.on,
            shared=not ours,
        )
    words = (
        ("commit.error_code", found.commit.error_code),
        ("commit.tool_number", found.commit.tool_number),
        ("selected", found.selected),
    )
    for where, word in words:
        if word is not None:
            yield _of_word(where, word, shared=where == "commit.error_code")


def _of_number(where: str, number: Number) -> _Claim:
    return _Claim(where, number.table, number.registers)


def _of_word(where: str, word: Word, *, shared: bool) -> _Claim:
    return _Claim(where, word.table, range(word.address, word.address + 1), shared=shared)


def _all_signals(found: RegisterMap) -> Iterator[tuple[str, Signal]]:
    commit = found.commit
    if commit.kind is not CommitKind.NONE:
        bit = commit.kind is CommitKind.COMMIT_BIT
        named = (
            ("commit.trigger" if bit else "commit.request", commit.request),
            ("commit.done" if bit else "commit.acknowledge", commit.answer),
            ("commit.busy", commit.busy),
            ("commit.error", commit.error),
        )
        yield from ((where, signal) for where, signal in named if signal is not None)
    if found.permit is not None:
        yield "permit", found.permit
    for position, slot in enumerate(found.slots.values(), start=1):
        if slot.defined is not None:
            yield f"tools#{position}.defined", slot.defined
    for position, one in enumerate(found.inputs.values(), start=1):
        yield f"inputs#{position}", one.signal


def _overlap(a: range, b: range) -> bool:
    return a.start < b.stop and b.start < a.stop
