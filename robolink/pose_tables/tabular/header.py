"""What the columns of a table are called, and in which units: by name, without case."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.values import AngleUnit, ColumnHead, LengthUnit, UnusableText

SKIPPED: Final = "-"

LENGTHS: Final = ("x", "y", "z")
QUATERNION: Final = ("qx", "qy", "qz", "qw")
MATRIX: Final = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))
WORDS: Final = ("name", "hand")
COUNTS: Final = ("number", "local", "tool")
ANGLES: Final = (
    *("u", "v", "w", "a", "b", "c", "r", "p", "rx", "ry", "rz", "o", "t"),
    *("roll", "pitch", "yaw"),
)
MEANINGS: Final = (*LENGTHS, *ANGLES, *QUATERNION, *MATRIX, *WORDS, *COUNTS)

_ALIASES: Final[Mapping[str, str]] = {
    **{f"{before}{axis}": axis for axis in "xyz" for before in ("t", "pos", "p", "position")},
    **{f"r{row}4": axis for row, axis in zip((1, 2, 3), "xyz", strict=True)},
    **{f"m{row}4": axis for row, axis in zip((1, 2, 3), "xyz", strict=True)},
    **{f"m{row}{column}": f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)},
    **{f"position.{axis}": axis for axis in "xyz"},
    **{f"translation.{axis}": axis for axis in "xyz"},
    **{f"orientation.{axis}": f"q{axis}" for axis in "xyzw"},
    **{f"rotation.{axis}": f"q{axis}" for axis in "xyzw"},
    **{f"{before}{axis}": f"q{axis}" for axis in "xyzw" for before in ("quat", "orientation")},
    "qs": "qw",
    "rotw": "qw",
    **{f"rot{axis}": f"r{axis}" for axis in "xyz"},
    "point": "name",
    "label": "name",
    "target": "name",
    "pose": "name",
    "waypoint": "name",
    "pointname": "name",
    "targetname": "name",
    "punkt": "name",
    "bezeichnung": "name",
    "no": "number",
    "nr": "number",
    "no.": "number",
    "nr.": "number",
    "num": "number",
    "#": "number",
    "index": "number",
    "id": "number",
}
_UNITS: Final[Mapping[str, LengthUnit | AngleUnit]] = {
    **dict.fromkeys(
        ("mm", "millimeter", "millimeters", "millimetre", "millimetres"), LengthUnit.MM
    ),
    **dict.fromkeys(("cm", "centimeter", "centimeters"), LengthUnit.CM),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), LengthUnit.M),
    **dict.fromkeys(("in", "inch", "inches", '"'), LengthUnit.INCH),
    **dict.fromkeys(("deg", "degree", "degrees", "°", "º", "deg.", "grd"), AngleUnit.DEG),
    **dict.fromkeys(("rad", "radian", "radians"), AngleUnit.RAD),
}
_BRACKETED: Final = re.compile(r"(.+?)\s*[(\[{<]\s*(.*?)\s*[)\]}>]")
_TAILED: Final = re.compile(r"(.+?)(?:[_\s/]|, )(?:in )?([a-z°º\"]+\.?)")
_ROS_TOPIC: Final = re.compile(
    r"(?:.*[./])?(position|orientation|translation|rotation)[./]([xyzw])", re.IGNORECASE
)
_JOINT: Final = re.compile(
    r"(?:j|jt|joint|axis|achse|a|e|q|theta|j_)[_ ]?[1-7](?:[_ ]?(?:deg|rad|angle|pos|position))?"
    r"|(?:joint|axis)[_ ]?[slurbt]|(?:base|shoulder|elbow|wrist)(?:[_ ](?:pan|lift|[1-3]))?"
    r"(?:[_ ]joint)?|wrist[1-3]|\u5173\u8282\s?[1-7]|\u8f74\s?[1-7]",
    re.IGNORECASE,
)
_UNIT_BEHIND: Final = re.compile(r"\s*[(\[].*[)\]]\s*$")


def column_head(text: str) -> ColumnHead:
    """Return the content of a column called ``text``; an unknown name has none.

    Raises:
        UnusableText: The name says a unit that is none of X's, or one that is not known.
    """
    plain = text.strip().lower()
    ros = _ROS_TOPIC.fullmatch(plain)
    if ros:
        return ColumnHead(_ALIASES[f"{ros[1]}.{ros[2]}"], None, text, from_ros=True)
    meaning = _meaning(plain)
    if meaning:
        return ColumnHead(meaning, None, text)
    for form in (_BRACKETED, _TAILED):
        parts = form.fullmatch(plain)
        meaning = _meaning(parts[1].strip()) if parts else ""
        if parts and meaning and (parts[2] in _UNITS or form is _BRACKETED):
            return ColumnHead(meaning, _unit_of(meaning, parts[2], text), text)
    return ColumnHead(SKIPPED, None, text)


def column_heads(texts: Iterable[str]) -> tuple[ColumnHead, ...]:
    """Return the content of a file's columns; of two names or numbers only one is kept.

    Raises:
        UnusableText: As of :func:`column_head`.
    """
    heads = list(map(column_head, texts))
    for meaning in ("name", "number"):
        alike = [place for place, head in enumerate(heads) if head.meaning == meaning]
        called_so = [place for place in alike if heads[place].text.strip().lower() == meaning]
        for place in alike:
            if place != (called_so or alike)[0] and place not in called_so:
                heads[place] = ColumnHead(SKIPPED, None, heads[place].text)
    return tuple(heads)


def is_unit(text: str) -> bool:
    """Return whether a cell is only a unit, as in a line of units below a header."""
    return text.strip().lower().strip("()[]") in _UNITS


def with_units(heads: Sequence[ColumnHead], units: Sequence[str]) -> tuple[ColumnHead, ...]:
    """Return the columns with the units of the line below.

    Raises:
        UnusableText: As of :func:`column_head`.
    """
    found = []
    for head, cell in zip(heads, units, strict=True):
        word = cell.strip().lower().strip("()[]")
        known = word in _UNITS and head.meaning in (*LENGTHS, *ANGLES)
        unit = _unit_of(head.meaning, word, f"{head.text} {cell}") if known else head.unit
        found.append(ColumnHead(head.meaning, unit, head.text, head.from_ros))
    return tuple(found)


def named_by_person(text: str) -> tuple[ColumnHead, ...]:
    """Return the columns that a person names, with commas between.

    Raises:
        UnusableText: A name is not known, or stands twice.
    """
    heads = []
    for part in text.replace(";", ",").split(","):
        head = column_head(part)
        if head.meaning == SKIPPED and part.strip() != SKIPPED:
            names = ", ".join([*MEANINGS, SKIPPED])
            why = tr(
                "{name!r} is not the name of a column; use one of {names}", name=part, names=names
            )
            raise UnusableText(why)
        heads.append(head)
    require_each_once(heads)
    return tuple(heads)


def require_each_once(heads: Sequence[ColumnHead], line: int = 0) -> None:
    """Refuse two columns that mean the same.

    Raises:
        UnusableText: There are two.
    """
    meanings = [head.meaning for head in heads if head.meaning != SKIPPED]
    twice = next((name for name in meanings if meanings.count(name) > 1), None)
    if twice is not None:
        raise UnusableText(tr("two columns say {name}", name=twice), line)


_LONG_NAMES: Final = (
    *("name", "hand", "number", "local", "tool", "roll", "pitch"),
    *(f"{axis}_{unit}" for axis in LENGTHS for unit in ("mm", "cm", "in")),
    *(f"{angle}_{unit}" for angle in ANGLES for unit in ("deg", "rad")),
)
"""Names long enough to show one wrong letter; ``u``, for example, is one letter from any other."""


def nearly_named(text: str) -> str:
    """Return the name from which a text differs by one letter or two swapped; empty for none."""
    plain = text.strip().lower()
    return next((name for name in _LONG_NAMES if _one_slip(plain, name)), "")


def _one_slip(text: str, name: str) -> bool:
    if abs(len(text) - len(name)) > 1 or text == name:
        return False
    same = 0
    while same < min(len(text), len(name)) and text[same] == name[same]:
        same += 1
    a, b = text[same:], name[same:]
    return a[1:] == b[1:] or a[1:] == b or a == b[1:] or (a[:2] == b[1::-1] and a[2:] == b[2:])


def names_place(heads: Sequence[ColumnHead]) -> bool:
    """Return whether columns hold X and Y: then they are a header."""
    return {"x", "y"} <= {head.meaning for head in heads}


def are_joints(names: Sequence[str]) -> bool:
    """Return whether most columns have names of joints."""
    called = [name for name in names if is_joint(name)]
    return len(called) >= 3 and len(called) * 2 >= len(names)


def is_joint(name: str) -> bool:
    """Return whether a name is that of a joint, with a unit behind it or without."""
    return _JOINT.fullmatch(_UNIT_BEHIND.sub("", name).strip()) is not None


def _meaning(plain: str) -> str:
    if plain in MEANINGS:
        return plain
    bare = plain.replace("_", "").replace(" ", "")
    return _ALIASES.get(plain) or _ALIASES.get(bare) or (bare if bare in MEANINGS else "")


def _unit_of(meaning: str, word: str, text: str) -> LengthUnit | AngleUnit:
    unit = _UNITS.get(word)
    fits = LengthUnit if meaning in LENGTHS else AngleUnit
    if not isinstance(unit, fits):
        raise UnusableText(
            tr("column {name!r} has a unit that is not known here", name=text.strip())
        )
    return unit
