"""Which component of which tool a PLC variable is, by its name.

Names are as people write them in PLC programs: a path (``Application.GVL.``) before them, array
indices, prefixes that tell the type (``rX``, ``diTool1X``), and words behind them
(``Tool1_X_Offset_mm``).
"""

import re
import unicodedata
from typing import Final, NamedTuple

from robolink.register_maps._map import COMPONENTS

_TOOL: Final = frozenset({"tool", "tools", "nozzle", "nozzles", "needle", "needles", "t"})
_BESIDE: Final = frozenset(
    {"offset", "offsets", "offs", "off", "pos", "position", "value", "val", "corr", "correction"}
    | {"shift", "tcp", "data"}
)
"""Words beside an axis that change nothing."""

_UNITS: Final = {"mm": "mm", "um": "um", "inch": "inch", "deg": "deg", "rad": "rad"}
_IDENTIFIER: Final = re.compile(r"[A-Za-z0-9]+")
_PREFIX: Final = re.compile(
    r"^(?:a|ar|arr|ast|st|s|g|gv|p|r|lr|i|si|di|li|ui|udi|usi|w|dw|b|by|x|n|f|lf|fl|fb)(?=[A-Z])"
)
"""Hungarian notation. Other small letters (old, new, cmd) make it another variable."""

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
"""Words of Chinese register lists. A name with others is something else: an old value, say."""

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
    """Return what a variable stands for, ``None`` where its name does not clearly say it."""
    name = unicodedata.normalize("NFKC", name)
    name = _CHINESE_WORD.sub(lambda word: f" {_CHINESE[word[0]]} ", name)
    if not name.isascii():
        return None
    identifiers = [_PREFIX.sub("", it) for it in _IDENTIFIER.findall(name)]
    for position, identifier in enumerate(identifiers):
        words = [word.lower() for word in _WORD.findall(identifier)]
        if not words or words[0] not in _TOOL:
            continue  # a path, or an Old, New, Cmd before it that makes it another variable
        rest = words[1:] + [
            word.lower() for it in identifiers[position + 1 :] for word in _WORD.findall(it)
        ]
        return _read(rest)
    return None


def _read(words: list[str]) -> Component | None:
    """Return what stands behind the word for a tool: its number, its axis, and words beside."""
    numbers = [word for word in words if word.isdigit()]
    axes = [word for word in words if word in COMPONENTS]
    units = [word for word in words if word in _UNITS]
    rest = [w for w in words if not w.isdigit() and w not in (*axes, *units, *_BESIDE)]
    if rest or len(numbers) != 1 or len(axes) != 1 or len(units) > 1:
        return None
    # Python reads no number of thousands of digits.
    if len(numbers[0]) > _MOST_DIGITS or not 1 <= int(numbers[0]) <= _HIGHEST:
        return None
    return Component(int(numbers[0]), axes[0], _UNITS[units[0]] if units else "")
