"""Starts a map from a register list, as PLC programmers keep one in a spreadsheet.

CSV with a header line, comma or semicolon. ``name`` and one of ``address`` (counted from 0)
and ``register`` (as 40101) are needed; ``type``, ``unit`` and ``scale`` are taken when they
are there::

    name,register,type
    Tool1_X,40101,REAL
    Tool1_Y,40103,REAL
    Commit,00001,BOOL

What a list does not say (word order, handshake) is left open in the draft and named there;
a draft is no map before a person has filled it in.
"""

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.named_files import read_named
from robolink.register_maps._map import COMPONENTS
from robolink.register_maps._places import LAST_ADDRESS, Table

_TOOL: Final = re.compile(
    r"(?:tool|nozzle|needle|t)[\W_]{0,2}(\d{1,2})[\W_]*(?:[a-z]+[\W_]+)?([xyzuvw])"
    r"(?:[\W_]+(?:mm|deg))?[\W_]*",
    re.IGNORECASE,
)
_REGISTER: Final = re.compile(r"([0134])(\d{4,5})")
_TABLES: Final = {"0": Table.COIL, "1": Table.DISCRETE, "3": Table.INPUT, "4": Table.HOLDING}
_TYPES: Final = {
    "int16": {"int", "int16"},
    "uint16": {"uint", "uint16", "word"},
    "int32": {"dint", "int32"},
    "uint32": {"udint", "uint32", "dword"},
    "REAL": {"real", "float", "float32"},
    "LREAL": {"lreal", "double", "float64"},
}
_UNITS: Final = frozenset({"mm", "um", "m", "inch", "deg", "rad"})
_MOST_BYTES: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class Draft:
    """The beginning of a map.

    Attributes:
        text: TOML, with comments that say what is to be filled in.
        found: How many components of tools were recognised.
        left: Names of the rows that were not.
    """

    text: str
    found: int
    left: tuple[str, ...]


def draft_from_csv(path: Path) -> Draft:
    """Return the beginning of a map.

    Raises:
        ConfigError: The list cannot be read, or names no component of a tool.
    """
    tools: dict[int, dict[str, str]] = {}
    left: list[tuple[str, str]] = []
    for line, row in _rows(path):
        place = _place(path, line, row)
        known = _TOOL.fullmatch(row["name"])
        if known is None or not 1 <= int(known[1]) <= 15:
            left.append((row["name"], place))
            continue
        components, name = tools.setdefault(int(known[1]), {}), known[2].lower()
        if name in components:
            raise _unusable(path, tr("line {line} names a component again", line=line))
        components[name] = f"{{ {_number(path, line, row, place)} }}"
    if not tools:
        raise _unusable(
            path, tr("no name in it is one of a tool's component, such as Tool1_X or T1.X")
        )
    found = sum(len(components) for components in tools.values())
    text = "\n".join(_lines(path.stem, tools, left)) + "\n"
    return Draft(text, found, tuple(name for name, _ in left))


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    try:
        text = read_named(path, most_bytes=_MOST_BYTES).decode("utf-8-sig")
    except OSError as error:
        raise _unusable(path, error.strerror or str(error)) from error
    except UnicodeError as error:
        raise _unusable(path, tr("it is not UTF-8 text")) from error
    lines = text.splitlines()
    header = lines[0] if lines else ""
    reader = csv.reader(lines, delimiter=";" if header.count(";") > header.count(",") else ",")
    names = [name.strip().lower() for name in next(reader, [])]
    if "name" not in names or not {"address", "register"} & set(names):
        raise _unusable(path, tr("its first line must name the columns name and address"))
    for cells in reader:
        row = dict(zip(names, (cell.strip() for cell in cells), strict=False))
        if row.get("name"):
            yield reader.line_num, row


def _place(path: Path, line: int, row: Mapping[str, str]) -> str:
    """Return table and address as a map writes them."""
    register = _REGISTER.fullmatch(row.get("register", ""))
    if register is not None and 1 <= int(register[2]) <= LAST_ADDRESS + 1:
        return f'table = "{_TABLES[register[1]]}", address = {int(register[2]) - 1}'
    address = row.get("address", "")
    if address.isascii() and address.isdigit() and int(address) <= LAST_ADDRESS:
        return f"address = {int(address)}"
    raise _unusable(
        path,
        tr(
            "line {line} has no place: give an address counted from 0, or a register such as 40101",
            line=line,
        ),
    )


def _number(path: Path, line: int, row: Mapping[str, str], place: str) -> str:
    parts = [place]
    given = row.get("type", "").lower()
    if given:
        known = next((name for name, spelt in _TYPES.items() if given in spelt), None)
        if known is None:
            raise _unusable(
                path, tr("line {line} has an unknown type {type!r}", line=line, type=row["type"])
            )
        parts.append(f'type = "{known}"')
    if row.get("unit", "").lower() in _UNITS:
        parts.append(f'unit = "{row["unit"].lower()}"')
    if row.get("scale"):
        try:
            parts.append(f"scale = {float(row['scale'])!r}")
        except ValueError as error:
            raise _unusable(
                path, tr("line {line} has a scale that is no number", line=line)
            ) from error
    return ", ".join(parts)


def _lines(
    name: str, tools: Mapping[int, Mapping[str, str]], left: list[tuple[str, str]]
) -> Iterator[str]:
    yield 'schema = "robolink/plc-map/1"'
    yield f'name = "{re.sub("[^A-Za-z0-9._ -]+", "-", name)}"'
    yield ""
    yield "[numbers]"
    yield '# type = "REAL"                # where no line below says it'
    yield '# word_order = "low_first"     # or "high_first": ask the PLC\'s programmer'
    for number in sorted(tools):
        yield ""
        yield "[[tools]]"
        yield f"number = {number}"
        for component in COMPONENTS:
            if component in tools[number]:
                yield f"{component} = {tools[number][component]}"
    yield ""
    yield "# How does the PLC take new values over? docs/plc-maps.md explains the three ways."
    yield "# [commit]"
    yield '# kind = "commit_bit"'
    yield '# trigger = { table = "coil", address = 0 }'
    yield '# done = { table = "discrete", address = 0 }'
    if left:
        yield ""
        yield "# In the list, and not used yet:"
        for other, place in left:
            yield f"#   {re.sub('[^ -~]', '?', other)}: {place}"


def _unusable(path: Path, why: str) -> ConfigError:
    return ConfigError(
        tr("The register list {path} cannot be used: {why}.", path=path, why=why),
        remedy=tr("docs/plc-maps.md shows the columns. Nothing was written."),
    )
