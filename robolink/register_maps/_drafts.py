"""Starts a map from a register list, as PLC programmers keep one in a spreadsheet.

CSV with a header line; commas, semicolons or tabs; UTF-8 or GBK. ``name`` and one of ``address``
(counted from 0) and ``register`` (as 40101) are needed; ``type``, ``unit`` and ``scale`` are taken
when they are there, each in English or Chinese::

    name,register,type
    Tool1_X,40101,REAL
    Tool1_Y,40103,REAL
    GVL.T2.x,40105,REAL
    Commit,00001,BOOL

A column ``address`` that holds nothing but numbers as 40101 is read as ``register``, and the draft
says so. A hexadecimal address is written 0x1F4, 16#1F4 or 1F4h, or its heading says hex. A row
that cannot be used is named with its line; the others are kept.

What a list does not say (word order, handshake) is left open in the draft and named there;
a draft is no map before a person has filled it in.

Which component of which tool a PLC variable is, by its name.

Names are as people write them in PLC programs: a path (``Application.GVL.``) before them, array
indices, prefixes that tell the type (``rX``, ``diTool1X``), and words behind them
(``Tool1_X_Offset_mm``).
"""

import csv
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.register_maps._map import LAST_ADDRESS, RegisterTable
from robolink.register_maps._places import COMPONENTS

_TOOL: Final = frozenset({"tool", "tools", "nozzle", "nozzles", "needle", "needles", "t"})
_BESIDE: Final = frozenset(
    {"offset", "offsets", "offs", "off", "pos", "position", "value", "val", "corr", "correction"}
    | {"shift", "tcp", "data"}
)
"""Words beside an axis that do not change its meaning."""

_UNIT_WORDS: Final = {"mm": "mm", "um": "um", "inch": "inch", "deg": "deg", "rad": "rad"}
_IDENTIFIER: Final = re.compile(r"[A-Za-z0-9]+")
_PREFIX: Final = re.compile(
    r"^(?:a|ar|arr|ast|st|s|g|gv|p|r|lr|i|si|di|li|ui|udi|usi|w|dw|b|by|x|n|f|lf|fl|fb)(?=[A-Z])"
)
"""Prefixes of Hungarian notation. Other words in lower case (old, new, cmd) make it another
variable."""

_WORD: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_HIGHEST: Final = 15
_MOST_DIGITS: Final = 9


_CHINESE: Final = {
    **dict.fromkeys(("刀具", "工具", "吸嘴", "喷嘴", "针头", "针嘴", "刀"), "tool"),
    **dict.fromkeys(("偏移量", "偏移", "偏置", "补偿值", "补偿", "位置", "坐标"), "offset"),
    **dict.fromkeys(("数据", "值"), "value"),
    "毫米": "mm",
    "微米": "um",
    **dict.fromkeys(("角度", "轴", "向", "号"), ""),
}
"""Words of Chinese register lists. A name with other words has another meaning, such as an old
value."""

_CHINESE_WORD: Final = re.compile("|".join(_CHINESE))


class Component(NamedTuple):
    """A component of a tool.

    Attributes:
        tool: Number of the tool.
        axis: One of ``xyzuvw``.
        unit: What the name says about the unit, empty for nothing.
    """

    tool: int
    axis: str
    unit: str


def component_of(name: str) -> Component | None:
    """Return the component that a variable's name means, ``None`` if that is unclear."""
    name = unicodedata.normalize("NFKC", name)
    name = _CHINESE_WORD.sub(lambda word: f" {_CHINESE[word[0]]} ", name)
    if not name.isascii():
        return None
    identifiers = [_PREFIX.sub("", it) for it in _IDENTIFIER.findall(name)]
    for position, identifier in enumerate(identifiers):
        words = [word.lower() for word in _WORD.findall(identifier)]
        if not words or words[0] not in _TOOL:
            continue  # part of a path, or a prefix (Old, New, Cmd) that makes it another variable
        rest = words[1:] + [
            word.lower() for it in identifiers[position + 1 :] for word in _WORD.findall(it)
        ]
        return _read(rest)
    return None


def _read(words: list[str]) -> Component | None:
    """Return what follows the word for a tool: its number, its axis, and further words."""
    numbers = [word for word in words if word.isdigit()]
    axes = [word for word in words if word in COMPONENTS]
    units = [word for word in words if word in _UNIT_WORDS]
    rest = [w for w in words if not w.isdigit() and w not in (*axes, *units, *_BESIDE)]
    if rest or len(numbers) != 1 or len(axes) != 1 or len(units) > 1:
        return None
    # Python does not read numbers of thousands of digits.
    if len(numbers[0]) > _MOST_DIGITS or not 1 <= int(numbers[0]) <= _HIGHEST:
        return None
    return Component(int(numbers[0]), axes[0], _UNIT_WORDS[units[0]] if units else "")


_REGISTER: Final = re.compile(r"([0134])(\d{4,5})")
_TABLES: Final = {
    "0": RegisterTable.COIL,
    "1": RegisterTable.DISCRETE,
    "3": RegisterTable.INPUT,
    "4": RegisterTable.HOLDING,
}
_TYPES: Final = {
    "int16": {"int", "int16"},
    "uint16": {"uint", "uint16", "word"},
    "int32": {"dint", "int32"},
    "uint32": {"udint", "uint32", "dword"},
    "REAL": {"real", "float", "float32"},
    "LREAL": {"lreal", "double", "float64"},
}
_HEADINGS: Final = {
    "name": {"name", "variable", "symbol", "tag", "名称", "变量", "变量名", "变量名称", "标签"},
    "address": {"address", "addr", "地址", "起始地址", "modbus地址", "modbus address"},
    "register": {"register", "寄存器", "寄存器地址", "寄存器号"},
    "type": {"type", "data type", "datatype", "类型", "数据类型"},
    "unit": {"unit", "单位"},
    "scale": {"scale", "factor", "系数", "比例", "倍率"},
}
_HEX_HEADING: Final = re.compile(r"\s*[(\[]?\s*(?:hex|十六进制|16进制)\s*[)\]]?\s*$")
_HEX: Final = re.compile(r"(?:0x|16#)([0-9a-f]{1,4})|([0-9][0-9a-f]{0,4})h", re.IGNORECASE)
_UNITS: Final = frozenset({"mm", "um", "m", "inch", "deg", "rad"})
_MOST_BYTES: Final = 1_000_000
_DIGITS: Final = len(str(LAST_ADDRESS))


@dataclass(frozen=True, slots=True)
class MapDraft:
    """The beginning of a map.

    Attributes:
        text: TOML, with comments that say what is to be filled in.
        found: How many components of tools were recognised.
        left: Names of the rows that were not.
        bad: What cannot be used of the rows that were, each with its line.
        notes: How the list was understood where it could be understood in two ways.
    """

    text: str
    found: int
    left: tuple[str, ...]
    bad: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


class _BadRowError(ValueError):
    """A row cannot be used; the text says why."""


def draft_from_csv(path: Path) -> MapDraft:
    """Return the beginning of a map; unusable rows are named and left out.

    Raises:
        ConfigError: The list cannot be read, or names no component of a tool that can be used.
    """
    rows = list(_rows(path))
    references = _are_references(row.get("address", "") for _, row in rows)
    tools: dict[int, dict[str, str]] = {}
    left: list[tuple[str, str]] = []
    bad: list[str] = []
    for line, row in rows:
        known = component_of(row["name"])
        try:
            place = _place(row, references=references)
            if known is None:
                left.append((row["name"], place))
                continue
            components = tools.setdefault(known.tool, {})
            if known.axis in components:
                raise _BadRowError(
                    tr(
                        "{axis} of tool {tool} is in an earlier line already",
                        axis=known.axis.upper(),
                        tool=known.tool,
                    )
                )
            components[known.axis] = f"{{ {_number(row, place, known.unit)} }}"
        except _BadRowError as error:
            bad.append(tr("line {line} ({name}): {why}", line=line, name=row["name"], why=error))
    found = sum(len(components) for components in tools.values())
    if not found:
        named = tr("no name in it is that of a tool's component, such as Tool1_X or GVL.T1.x")
        raise _unusable(path, "; ".join(bad) or named)
    notes = []
    if references:
        notes.append(
            tr(
                "The addresses are read as manuals print them: 40401 is holding "
                "register 400, counted from 0."
            )
        )
    used = {tool: components for tool, components in tools.items() if components}
    text = "\n".join(_lines(path.stem, used, left, [*notes, *bad])) + "\n"
    return MapDraft(text, found, tuple(name for name, _ in left), tuple(bad), tuple(notes))


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    try:
        text = _text(read_named(path, most_bytes=_MOST_BYTES))
    except OSError as error:
        raise _unusable(path, error.strerror or str(error)) from error
    except UnicodeError as error:
        raise _unusable(path, tr("it is neither UTF-8 nor GBK text")) from error
    lines = text.splitlines()
    header = lines[0] if lines else ""
    reader = csv.reader(lines, delimiter=max(",;\t", key=header.count))
    try:
        headings = [unicodedata.normalize("NFKC", it).strip().lower() for it in next(reader, [])]
        columns = [_HEX_HEADING.sub("", heading) for heading in headings]
        names = [
            next((name for name, spelt in _HEADINGS.items() if column in spelt), column)
            for column in columns
        ]
        hexadecimal = any(
            name == "address" and column != heading
            for name, column, heading in zip(names, columns, headings, strict=True)
        )
        if "name" not in names or not {"address", "register"} & set(names):
            raise _unusable(path, tr("its first line must name the columns name and address"))
        for cells in reader:
            row = dict(zip(names, (cell.strip() for cell in cells), strict=False))
            if hexadecimal and row.get("address"):
                row["address"] = f"16#{row['address'].removeprefix('16#').removeprefix('0x')}"
            if row.get("name"):
                yield reader.line_num, row
    except csv.Error as error:  # a cell of more than 131072 characters: an unclosed quote
        raise _unusable(path, str(error)) from error


def _text(content: bytes) -> str:
    """Return the text of a list; what is no UTF-8 is GBK, as Chinese spreadsheets save it."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("gb18030")


def _are_references(addresses: Iterable[str]) -> bool:
    """Whether a column of addresses holds numbers as manuals print them, counted from 1.

    Only a whole column says so: 40401 alone may also be an address that counts from 0.
    """
    given = [address for address in addresses if address]
    return bool(given) and all(_REGISTER.fullmatch(address) for address in given)


def _place(row: Mapping[str, str], *, references: bool) -> str:
    """Return table and address as a map writes them."""
    address = row.get("address", "")
    text = row.get("register", "") or (address if references else "")
    register = _REGISTER.fullmatch(text)
    if register is not None and 1 <= int(register[2]) <= LAST_ADDRESS + 1:
        return f'table = "{_TABLES[register[1]]}", address = {int(register[2]) - 1}'
    sixteen = _HEX.fullmatch(address)
    if sixteen is not None and int(sixteen[1] or sixteen[2], 16) <= LAST_ADDRESS:
        return f"address = {int(sixteen[1] or sixteen[2], 16)}"
    counted = not references and address.isascii() and address.isdigit() and len(address) <= _DIGITS
    if counted and int(address) <= LAST_ADDRESS:
        return f"address = {int(address)}"
    raise _BadRowError(
        tr("it has no place: give an address counted from 0, or a register such as 40101")
    )


def _number(row: Mapping[str, str], place: str, unit_in_name: str) -> str:
    parts = [place]
    given = row.get("type", "").lower()
    if given:
        known = next((name for name, spelt in _TYPES.items() if given in spelt), None)
        if known is None:
            raise _BadRowError(tr("its type {type!r} is not known", type=row["type"]))
        parts.append(f'type = "{known}"')
    unit = row.get("unit", "").lower() or unit_in_name
    if unit in _UNITS:
        parts.append(f'unit = "{unit}"')
    if row.get("scale"):
        try:
            parts.append(f"scale = {float(row['scale'])!r}")
        except ValueError as error:
            raise _BadRowError(tr("its scale is not a number")) from error
    return ", ".join(parts)


def _lines(
    name: str,
    tools: Mapping[int, Mapping[str, str]],
    left: list[tuple[str, str]],
    remarks: list[str],
) -> Iterator[str]:
    for remark in remarks:
        yield f"# {_printable(remark)}"
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
            yield f"#   {_printable(other)}: {place}"


def _printable(text: str) -> str:
    return re.sub("[^ -~]", "?", text)


def _unusable(path: Path, why: str) -> ConfigError:
    return ConfigError(
        tr("The register list {path} cannot be used: {why}.", path=path, why=why),
        remedy=tr("Nothing was written. Give a list with the columns of docs/plc-maps.md."),
    )
