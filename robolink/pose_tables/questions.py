"""What a file leaves open, and the questions about it: columns, units, rotation rule."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from robolink.messages import joined, tr
from robolink.pose_tables.orientation import rules_for
from robolink.pose_tables.values import ColumnHead, LengthUnit, OpenQuestion
from robolink.remedy_words import RemedyWord, remedy_word

_UNIT_IN_COMMENT: Final = re.compile(
    r"\b(?:inch(?:es)?|met(?:er|re)s?|cm|feet|foot|radians?|rad)\b|[(\[](?:in|m)[)\]]"
    r"|\bunits?\s*[:=]\s*(?:in|m)\b",
    re.IGNORECASE,
)
_ANGLE_WORD: Final = re.compile(r"rad", re.IGNORECASE)
_UNIT_WITHIN: Final = 0.01
_KEPT: Final = frozenset({"name", "number", "hand", "local", "tool"})
_NO_TURNS: Final = frozenset({*_KEPT, "x", "y", "z"})
MOST_RAD: Final = 4 * math.pi
"""Largest angle in radians: two turns; degrees mistaken for radians exceed it at once."""

FAR_MM: Final = 100_000.0
"""Largest distance of a robot from its base, in mm, even on a travelling axis."""

_METRES_BELOW: Final = 2.0
_FULL_TURN_RAD: Final = 2 * math.pi * (1 + 1e-6)


def which_columns(numeric: Sequence[bool], rows: Sequence[Sequence[float]] = ()) -> OpenQuestion:
    """Ask for the meaning of the columns of a table without a header.

    Args:
        numeric: Whether each column holds numbers; a first one of words is taken for names.
        rows: The numbers of those that do, to see which readings make rotations.
    """
    readings = _readings(sum(numeric), rows)
    written = tuple(dict.fromkeys(_placed(reading, numeric) for reading in readings))
    what = tr("it has no line that names its {count} columns", count=len(numeric))
    columns = remedy_word(RemedyWord.COLUMNS)
    if not written:
        return OpenQuestion("columns", what, tr("Name each with {columns}.", columns=columns))
    way = tr("Name each with {columns}; '-' skips one, or a joint value.", columns=columns)
    return OpenQuestion("columns", what, way, written)


def _readings(count: int, rows: Sequence[Sequence[float]]) -> list[str]:
    """Return the possible meanings of so many columns of numbers, the likeliest first."""
    if count < 3:
        return []
    if count == 3:
        return ["x,y,u"]
    if count == 6:
        return ["x,y,z,u,v,w", "x,y,z,rx,ry,rz"]
    if count == 7 and all(abs(math.hypot(*row[3:]) - 1) < _UNIT_WITHIN for row in rows):
        return ["x,y,z,qx,qy,qz,qw", "x,y,z,qw,qx,qy,qz"]
    if count == 12:
        return ["r11,r12,r13,x,r21,r22,r23,y,r31,r32,r33,z"]
    named = ["x", "y", "z", "u"] if count < 6 else ["x", "y", "z", "u", "v", "w"]
    return [",".join([*named, *"-" * (count - len(named))])]


def _placed(reading: str, numeric: Sequence[bool]) -> str:
    """Return a reading of the columns of numbers, with a name for each of the others."""
    names = iter(reading.split(","))
    words = iter(["name"])
    return ",".join(next(names) if number else next(words, "-") for number in numeric)


def which_rotation(heads: Sequence[ColumnHead], numeric: Sequence[bool] = ()) -> OpenQuestion:
    """Ask for the meaning of columns of which too few are known to say how a pose turns.

    Args:
        heads: All columns.
        numeric: Whether each holds numbers, as far as that is known.
    """
    names = ", ".join(head.text.strip() for head in heads)
    what = tr("how a pose turns is not clear from its columns {names}", names=names)
    numbers = numeric or [head.meaning not in ("name", "hand") for head in heads]
    turning = [
        place
        for place, head in enumerate(heads)
        if numbers[place] and head.meaning not in _NO_TURNS and head.text.strip() != "-"
    ]
    known = [place for place in turning if heads[place].meaning != "-"]
    readings = [
        _named(heads, dict(zip(places, reading, strict=True)))
        for places, reading in _turns(heads, turning, known)
    ]
    if not readings:
        way = tr(
            "Add a column u (turn about Z in degrees), or name each with {columns}.",
            columns=remedy_word(RemedyWord.COLUMNS),
        )
        return OpenQuestion("columns", what, way)
    way = tr(
        "Name each with {columns}; '-' skips one.",
        columns=remedy_word(RemedyWord.COLUMNS),
    )
    return OpenQuestion("columns", what, way, tuple(dict.fromkeys(readings)))


def _turns(
    heads: Sequence[ColumnHead], turning: Sequence[int], known: Sequence[int]
) -> Iterator[tuple[Sequence[int], Sequence[str]]]:
    """Yield columns that may turn a pose, and in what way."""
    for names in (("u",), ("u", "v", "w"), ("qx", "qy", "qz", "qw")):
        places = [place for place in known if heads[place].meaning in names]
        if len(places) == len(names):
            yield places, [heads[place].meaning for place in places]
    if not any(heads[place].meaning in ("u", "qx") for place in known):
        ways = {1: ["u"], 3: ["u v w", "a b c"], 4: ["qx qy qz qw", "qw qx qy qz"]}
        for reading in ways.get(len(turning), []):
            yield turning, reading.split()


def _named(heads: Sequence[ColumnHead], turns: Mapping[int, str]) -> str:
    """Return what a person types for all columns, in the order of the file."""
    return ",".join(_typed(head, turns.get(place, "")) for place, head in enumerate(heads))


def _typed(head: ColumnHead, turn: str) -> str:
    if turn:
        return turn
    if head.meaning in ("x", "y", "z"):
        unit = "m" if head.from_ros else head.unit
        return f"{head.meaning}_{unit}" if unit else head.meaning
    return head.meaning if head.meaning in _KEPT else "-"


def which_rule(letters: Sequence[str]) -> OpenQuestion:
    """Ask by which rule three angles turn."""
    return OpenQuestion(
        "euler",
        tr("its angles {letters} may turn in several ways", letters=", ".join(letters).upper()),
        tr("Say which with {euler}.", euler=remedy_word(RemedyWord.EULER)),
        tuple(f"{rule.name}: {rule.formula}" for rule in rules_for(letters)),
    )


def which_angle_unit(
    heads: Sequence[ColumnHead], names: Sequence[str], largest: float
) -> OpenQuestion:
    """Ask for the unit of angles.

    Args:
        heads: All columns, in the order of the file.
        names: Meanings of those that are angles.
        largest: The largest angle; radians are offered only where it can be one.

    Example:
        >>> from robolink.pose_tables.questions import which_angle_unit
        >>> from robolink.pose_tables.values import ColumnHead, LengthUnit
        >>> heads = [ColumnHead("x"), ColumnHead("y"), ColumnHead("u")]
        >>> asked = which_angle_unit(heads, ["u"], 3.14)
        >>> asked.way, asked.readings
        ('Name the columns and their unit with columns.', ('x,y,u_deg', 'x,y,u_rad'))
    """
    readings = [
        _named(
            heads,
            {
                at: f"{head.meaning}_{unit}"
                for at, head in enumerate(heads)
                if head.meaning in names
            },
        )
        for unit in ("deg", "rad")
        if unit == "deg" or largest <= MOST_RAD
    ]
    return OpenQuestion(
        "columns",
        tr("its angles may be degrees or radians"),
        tr(
            "Name the columns and their unit with {columns}.",
            columns=remedy_word(RemedyWord.COLUMNS),
        ),
        tuple(readings),
    )


def which_length(why: str, positions: Iterable[Sequence[float]]) -> OpenQuestion:
    """Ask for the unit of length, among those in which a robot could be there."""
    far = max((abs(value) for place in positions for value in place), default=0.0)
    units = [unit for unit in ("mm", "m", "in") if far * LengthUnit(unit).mm <= FAR_MM]
    return OpenQuestion(
        "length",
        why,
        tr(
            "Say the unit with {length}: {units}.",
            length=remedy_word(RemedyWord.LENGTH_UNIT),
            units=joined(tr(" or "), units),
        ),
    )


def looks_like_metres(positions: Iterable[Sequence[float]]) -> bool:
    """Return whether all X and Y lie where in mm no flange is (docs/reference/calibration.md 3)."""
    return all(abs(p[0]) < _METRES_BELOW and abs(p[1]) < _METRES_BELOW for p in positions)


def may_be_radians(rows: Iterable[Sequence[float]]) -> bool:
    """Return whether angles of which some are not 0 all lie within a turn in radians."""
    largest = max((abs(angle) for row in rows for angle in row), default=0.0)
    return 0 < largest <= _FULL_TURN_RAD


def may_be_degrees(rows: Iterable[Sequence[float]]) -> bool:
    """Return whether a rotation vector is longer than a turn in radians, which none has to be."""
    return any(math.hypot(*row) > _FULL_TURN_RAD for row in rows)


def unit_in(comments: Iterable[str], *, angle: bool) -> str:
    """Return the first comment that names a unit other than mm and degrees."""
    for comment in comments:
        found = _UNIT_IN_COMMENT.search(comment)
        if found and bool(_ANGLE_WORD.search(found[0])) == angle:
            return comment
    return ""
